"""Shipped maps that were made for a logger. Takes a raw path; gives the one whose files and columns are there."""

from __future__ import annotations

import tempfile
from fnmatch import fnmatch
from pathlib import Path

from discsim.errors import InputError
from discsim.files import model_names
from discsim.validation.importing.import_map import ImportMap, find_map, read_map
from discsim.validation.importing.raw_table import RepairList, read_raw

__all__ = ["recognised"]

#: Bytes at a file's beginning in which its header stands, with some rows.
_HEAD = 1 << 16


def recognised(raw: Path) -> ImportMap | None:
    """Return the one shipped map that fits exactly; None where there is none, or more than one.

    A map takes part that has ``recognised_by``: it fits where every file that it names is there and has the columns
    that the map reads and those named in ``recognised_by``, which no other logger has.
    """
    fitting = []
    for name in model_names("imports"):
        shipped = read_map(find_map(name))
        if shipped.recognised_by is not None and _fits(raw, shipped):
            fitting.append(shipped)
    return fitting[0] if len(fitting) == 1 else None


def _fits(raw: Path, shipped: ImportMap) -> bool:
    files = [raw] if raw.is_file() else sorted(child for child in raw.iterdir() if child.is_file())
    known: set[str] = set()
    there = 0
    for sensor in shipped.sensors.values():
        mine = [file for file in files if sensor.file is None or fnmatch(file.name, sensor.file)]
        if sensor.file is None and len(mine) != 1:
            return False
        columns = [_columns(file, shipped) for file in mine]
        wanted = [set(names) | _always(shipped) for names in sensor.columns]
        having = [names for names in columns if any(names.issuperset(one) for one in wanted)]
        if len(having) != 1 and not sensor.optional:
            return False
        there += len(having) == 1
        known |= set().union(*having)
    return there > 0 and known.issuperset(shipped.recognised_by or ())


def _always(shipped: ImportMap) -> set[str]:
    return {name for name in (shipped.time.column, shipped.time.counter) if name is not None}


def _columns(file: Path, shipped: ImportMap) -> set[str]:
    """Return the columns of a file as the map reads its beginning; none where it cannot."""
    with tempfile.TemporaryDirectory() as place:
        head = Path(place) / file.name
        try:
            with file.open("rb") as stream:
                head.write_bytes(stream.read(_HEAD).rpartition(b"\n")[0])
            return set(read_raw(head, shipped.layout, RepairList(shipped.repairs)).columns)
        except (InputError, OSError):
            return set()
