"""A latitude and a longitude in one cell (`49.1234 8.5678`), as EdgeTX and OpenTX write a receiver's fix: parted.

Takes a table with a line of names; gives it with two columns, called a latitude and a longitude, in the place of one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from discsim.errors import InputError
from discsim.validation.importing.cell_texts import GAPS
from discsim.validation.importing.sniffing.names import words_of
from discsim.validation.importing.sniffing.other_forms.written import (
    all_rows,
    comma_separated,
    first_rows,
    write_named,
)

__all__ = ["begins", "write_tables"]

#: Words for a place in the name of a column.
_PLACE = {*("gps", "gnss", "location", "position", "coordinates", "coordinate", "coords", "coord"), "latlon", "latlng"}
#: Degrees north and east, with four decimals at least: fewer are no fix to ten metres, but a place in a room.
_PAIR = re.compile(r"\s*[(\[]?\s*([-+]?\d{1,3}\.\d{4,})(?:\s*[,;]\s*|\s+)([-+]?\d{1,3}\.\d{4,})\s*[)\]]?\s*")
#: The fewest rows below the names with such a cell, and how many are looked at: a receiver's first fix takes a minute.
_FEWEST, _MOST = 3, 2000


class _Layout(NamedTuple):
    encoding: str
    separator: str
    column: int


def begins(path: Path) -> bool:
    """Tell a table with a column called after a place, all of whose full cells hold two numbers in degrees."""
    return _layout(path) is not None


def _layout(path: Path) -> _Layout | None:
    for encoding, separator, (header, *rows) in first_rows(path, _MOST):
        for k, name in enumerate(header):
            if len(header) > 1 and words_of(name) & _PLACE and _are_pairs([row[k] for row in rows]):
                return _Layout(encoding, separator, k)
    return None


def _are_pairs(cells: Sequence[str]) -> bool:
    """Tell cells that hold a latitude and a longitude, or nothing as before the first fix."""
    full = [cell for cell in cells if cell.strip() and cell.strip().lower() not in GAPS]
    found = [_PAIR.fullmatch(cell) for cell in full]
    degrees = [(float(pair[1]), float(pair[2])) for pair in found if pair is not None]
    within = all(abs(north) <= 90.0 and abs(east) <= 180.0 for north, east in degrees)
    return len(degrees) == len(full) >= _FEWEST and within


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write a table with a column each for latitude and longitude, and return what to say; a cell of neither is empty.

    Raises `InputError` for a table that is too large.
    """
    layout = _layout(raw)
    if layout is None:
        raise InputError.at(
            raw, None, "has no latitude and longitude in a cell any more; expected the file that it was"
        )
    names, *rows = all_rows(raw, layout.encoding, layout.separator)
    k, name = layout.column, names[layout.column].strip()

    def parted(row: list[str]) -> list[str]:
        pair = _PAIR.fullmatch(row[k]) if k < len(row) else None
        return [*row[:k], *(("", "") if pair is None else (pair[1], pair[2])), *row[k + 1 :]]

    header = [*names[:k], f"{name} lat", f"{name} lon", *names[k + 1 :]]
    write_named(target, {raw.stem: comma_separated([header, *map(parted, rows)])})
    return [f"{raw.name}: '{name}' holds two numbers a cell; read as a latitude and a longitude"]
