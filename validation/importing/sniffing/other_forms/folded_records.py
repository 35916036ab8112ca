"""Records over several lines below names in one (`ax,ay,az,gx,gy,gz` over `1,2,3` and `4,5,6`): joined to one line.

Takes a text; gives it with a record a line. The lines of a record have as many numbers together as there are names.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from discsim.errors import InputError
from discsim.validation.importing.sniffing.names import read_name, sensor_of
from discsim.validation.importing.sniffing.other_forms.written import (
    FEWEST,
    FIRST_ROWS,
    NUMBER,
    first_lines,
    rewrite_lines,
)

__all__ = ["begins", "write_tables"]

_PARTS = re.compile(r"\s*[,;\t]\s*|\s+")
#: A cell with what `_PARTS` would break kept whole: names hold blanks where another sign parts them.
_SIGNS = ("\t", ";", ",")
_NUMBER = re.compile(NUMBER)
#: Names of sensors without which a line above numbers is no line of names: two sensors, or it is no record of several.
_NAMED = 6
#: The most lines of a record: one for each sensor, the time and the temperature.
_MOST = 6
#: The share of records that are whole: a line that broke off spoils its own.
_SHARE = 0.8


class _Fold(NamedTuple):
    """The names, the line in which they stand, and how many numbers each line of a record has."""

    at: int
    names: tuple[str, ...]
    widths: tuple[int, ...]


def begins(path: Path) -> bool:
    """Tell a text with names in a line, and below it lines that only together have as many numbers."""
    return _fold(path) is not None


def _fold(path: Path) -> _Fold | None:
    _, lines = first_lines(path)
    for at, line in enumerate(lines[:FIRST_ROWS]):
        names = _cells(line)
        if sum(sensor_of(read_name(name).base) is not None for name in names) < _NAMED:
            continue
        sign = _sign(line)
        below = [one for one in lines[at + 1 :] if one.strip()]
        if sign is not None and 2 * sum(one.count(sign) >= line.count(sign) for one in below) > len(below):
            return None  # each line has a cell for each name, empty where a column has nothing to say
        widths = [len(cells) for cells in map(_numbers, below) if cells]
        record = _widths(widths, len(names))
        return None if record is None else _Fold(at, tuple(names), record)
    return None


def _widths(widths: Sequence[int], count: int) -> tuple[int, ...] | None:
    """Return the numbers in each line of the records that ``count`` names are for; None where lines are others."""
    for lines in range(2, _MOST + 1):
        record = tuple(widths[:lines])
        whole = widths[: len(widths) // lines * lines]
        if sum(record) == count and len(whole) >= FEWEST * lines:
            alike = sum(tuple(whole[k : k + lines]) == record for k in range(0, len(whole), lines))
            return record if alike * lines >= _SHARE * len(whole) else None
    return None


def _sign(line: str) -> str | None:
    """Return the sign that parts a line's cells, None where blanks do."""
    return next((sign for sign in _SIGNS if sign in line), None)


def _cells(line: str) -> list[str]:
    sign = _sign(line)
    return [cell.strip() for cell in (line.split() if sign is None else line.strip(f"{sign} \n").split(sign))]


def _numbers(line: str) -> list[str]:
    """Return the numbers of a line; none where anything else stands in it."""
    cells = [cell for cell in _PARTS.split(line.strip()) if cell]
    return cells if all(map(_NUMBER.fullmatch, cells)) else []


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the records of a text a line each and return what to say.

    A record with a line of another length, or one that breaks off, becomes an empty line. Raises `InputError` where the
    file cannot be read.
    """
    fold = _fold(raw)
    if fold is None:
        raise InputError.at(raw, None, "has no records over several lines any more; expected the file that it was")
    lost = 0

    def joined(lines: Iterable[str]) -> Iterator[str]:
        nonlocal lost
        yield ",".join(name.replace(",", " ") for name in fold.names)
        record: list[list[str]] = []
        for number, line in enumerate(lines):
            if number <= fold.at or not line.strip():
                continue
            record.append(_numbers(line))
            if len(record) == len(fold.widths):
                whole = tuple(map(len, record)) == fold.widths
                lost += not whole
                yield ",".join(cell for cells in record for cell in cells) if whole else ""
                record = []

    rewrite_lines(raw, target, joined)
    shape = " + ".join(map(str, fold.widths))
    said = [f"{raw.name}: its {len(fold.names)} names are those of {len(fold.widths)} lines ({shape} numbers); joined"]
    return said + [f"{raw.name}: {lost} records with a line of another length LEFT OUT"] * (lost > 0)
