"""Logs of one kind in a folder: several throws, and not a file per sensor. Takes a folder; gives the files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.sniffing.archive import MAX_FILES
from discsim.validation.importing.sniffing.dialect import dialect_of
from discsim.validation.importing.sniffing.names import read_name, sensor_of, sensor_of_file
from discsim.validation.importing.sniffing.track import coordinates_of

__all__ = ["listed", "several_logs"]

#: Names that a sentence lists.
_MOST = 8


def several_logs(raw: Path) -> list[Path]:
    """Return the files of a folder that are a log each, in the order of their names; empty where it is one log.

    They have the same columns, whose names speak of the same sensors. Of a file per sensor, the columns or the files
    are called after it; a folder that holds a table of other columns beside is taken for one log.
    """
    if not raw.is_dir():
        return []
    paths = sorted(path for path in raw.iterdir() if path.is_file() and not path.name.startswith("."))
    tables: list[Path] = []
    kinds: set[tuple[str, ...]] = set()
    for path in paths[: MAX_FILES + 1]:
        try:
            names = dialect_of(path).names
        except InputError:
            continue  # a photo, a note
        tables.append(path)
        kinds.add(tuple(names))
        if len(kinds) > 1 or not _sensors(names):
            return []
    one_sensor = all(len(_sensors(names)) == 1 for names in kinds)
    # beside a file for each of two sensors there may be one of what was worked out (Gravity.csv)
    called = {sensor_of_file(path) for path in tables} - {None}
    per_sensor = one_sensor and (len(called) > 1 or all(sensor_of_file(path) for path in tables))
    return [] if len(tables) < 2 or per_sensor else tables


def listed(paths: Sequence[Path]) -> str:
    """Return the names of files for a sentence."""
    names = ", ".join(path.name for path in paths[:_MOST])
    return f"{names} and {len(paths) - _MOST} more" if len(paths) > _MOST else names


def _sensors(names: Sequence[str]) -> set[str]:
    """Return the sensors of which three columns are there by their names alone; a track where there are coordinates."""
    read = [read_name(name) for name in names]
    axes = Counter({(sensor_of(name.base), name.axis) for name in read if name.axis is not None and name.base})
    counts = Counter(sensor for sensor, _ in axes if sensor not in (None, "time"))
    found = {sensor for sensor, count in counts.items() if sensor is not None and count == 3}
    return found or ({"track"} if coordinates_of(names) else set())
