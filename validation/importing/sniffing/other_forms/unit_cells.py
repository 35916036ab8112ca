"""Numbers with their unit in the same cell (`9.81 m/s^2`, `12ms`), as people print them: the units moved to the header.

Takes a table with a line of names or without; each column must have one unit, or none, in all its first cells. Where
there are no names, the units are all that tells the sensors.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import chain, repeat
from pathlib import Path
from typing import NamedTuple

from discsim.errors import InputError
from discsim.validation.importing.cell_texts import GAPS
from discsim.validation.importing.sniffing.other_forms.written import (
    NUMBER,
    all_rows,
    comma_separated,
    first_rows,
    write_named,
)

__all__ = ["begins", "write_tables"]

#: A number and what stands behind it: no digit, no sign that would make it a date or a time, and no power of ten.
_CELL = re.compile(rf"\s*({NUMBER})\s*(?![eE][-+]?\d)([^\s\d:.,;/-][^\s:;]*(?: [^\s\d:;][^\s:;]*)?)\s*")
_PLAIN = re.compile(rf"\s*(?:{NUMBER})?\s*")
#: The fewest rows below the names, and the columns with a unit without which nothing is moved.
_FEWEST, _COLUMNS = 3, 3


def begins(path: Path) -> bool:
    """Tell a table three of whose columns have numbers with a unit in all of the first rows."""
    return _layout(path) is not None


class _Layout(NamedTuple):
    """How a table is written, the unit of each column (empty where it has none), and whether it has a line of names."""

    encoding: str
    separator: str
    units: tuple[str, ...]
    named: bool


def _layout(path: Path) -> _Layout | None:
    """Return how a table with units in its cells is written; None where this is none."""
    for encoding, separator, rows in first_rows(path):
        if len(rows) > _FEWEST and len(rows[0]) >= _COLUMNS:
            named = not any(map(_number, rows[0]))
            units = [_unit([row[k] for row in rows[named:]]) for k in range(len(rows[0]))]
            if sum(bool(unit) for unit in units) >= _COLUMNS and (named or all(map(_number, rows[0]))):
                return _Layout(encoding, separator, tuple(unit or "" for unit in units), named)
    return None


def _number(cell: str) -> bool:
    """Tell whether a cell is a number, with a unit or without, or empty."""
    return _PLAIN.fullmatch(cell) is not None or _CELL.fullmatch(cell) is not None


def _unit(cells: Sequence[str]) -> str | None:
    """Return the unit behind each number of some cells; None where they have none, or not the same one."""
    full = [cell for cell in cells if cell.strip() and cell.strip().lower() not in GAPS]
    found = [_CELL.fullmatch(cell) for cell in full]
    units = {match[2].strip() for match in found if match is not None}
    return units.pop() if full and all(found) and len(units) == 1 else None


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write a table with the units of its cells in the line of names, and return what to say.

    A cell with another unit, or none, stays as it is, and is found with what else cannot be read. Raises `InputError`
    for a table that is too large.
    """
    layout = _layout(raw)
    if layout is None:
        raise InputError.at(raw, None, "has no units in its cells any more; expected the file that it was")
    rows = all_rows(raw, layout.encoding, layout.separator)
    names = rows.pop(0) if layout.named else [f"c{k + 1}" for k in range(len(layout.units))]
    named = zip(names, layout.units, strict=True)
    header = [f"{name.strip()} ({unit})" if unit else name.strip() for name, unit in named]
    moved = [list(map(_bare, row, chain(layout.units, repeat("")))) for row in rows]
    write_named(target, {raw.stem: comma_separated([header, *moved])})
    said = ", ".join(dict.fromkeys(filter(None, layout.units)))
    return [f"{raw.name}: units stand in its cells ({said}); moved to the names of the columns"]


def _bare(cell: str, unit: str) -> str:
    match = _CELL.fullmatch(cell) if unit else None
    return match[1] if match is not None and match[2].strip() == unit else cell
