"""Numbers that cells hold as a formula (`="9.81"`), with an apostrophe (`'9.81`) or in hex (`0x1F`): written plainly.

Programs write the first two so that a spreadsheet keeps every digit, and firmware prints a register as it is.
"""

from __future__ import annotations

import re
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.sniffing.other_forms.written import (
    NUMBER,
    all_rows,
    comma_separated,
    first_rows,
    write_named,
)

__all__ = ["begins", "write_tables"]

#: A formula whose text is a number, what an apostrophe keeps as text, and a number in hex.
_QUOTED = re.compile(rf"\s*(?:=\s*\"\s*({NUMBER})\s*\"|'\s*({NUMBER})\s*'?|(0[xX][0-9a-fA-F]+))\s*")
#: Text of a formula, as a name is written by the same program.
_TEXT = re.compile(r"\s*=\s*\"(.*)\"\s*")
#: The fewest rows below the names, and the columns of such cells without which nothing is rewritten.
_FEWEST, _COLUMNS = 3, 2


def begins(path: Path) -> bool:
    """Tell a table two of whose columns have such cells alone in all of the first rows."""
    return _layout(path) is not None


def _layout(path: Path) -> tuple[str, str] | None:
    """Return encoding and separator of a table with such cells; None where this is none."""
    for encoding, separator, (_, *rows) in first_rows(path):
        columns = list(zip(*rows, strict=True))
        if len(rows) >= _FEWEST and sum(all(map(_QUOTED.fullmatch, cells)) for cells in columns) >= _COLUMNS:
            return encoding, separator
    return None


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write a table with its numbers as plain ones, and return what to say; raises `InputError` for one too large.

    A negative number in hex is what a register of 8, 16 or 32 bits holds: the reader finds that by its jumps.
    """
    layout = _layout(raw)
    if layout is None:
        raise InputError.at(raw, None, "has no quoted numbers any more; expected the file that it was")
    rows = all_rows(raw, *layout)
    write_named(target, {raw.stem: comma_separated([[_plain(cell) for cell in row] for row in rows])})
    return [f"{raw.name}: numbers stand in its cells as formulas, with apostrophes or in hex; they are read as numbers"]


def _plain(cell: str) -> str:
    if (match := _QUOTED.fullmatch(cell)) is not None:
        return match[1] or match[2] or str(int(match[3], 16))
    return match[1] if (match := _TEXT.fullmatch(cell)) is not None else cell
