"""Columns that no sensor of the proposed map reads. Takes the tables and what is read of them; gives notes.

A typo in the names of one or two columns leaves a whole sensor out: that is asked about aloud.
"""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from discsim.recording import Plant
from discsim.validation.importing.import_map import UNITS
from discsim.validation.importing.sniffing.groups import FEWEST_ROWS, Numbers
from discsim.validation.importing.sniffing.names import NO_READING, penalty_of, read_name, sensor_of
from discsim.validation.importing.sniffing.units import COUNTS, readings_of

__all__ = ["missing_axes", "one_axis_rate", "rate_columns", "unused_columns"]

#: A log of hundreds of columns, or a folder of as many files, fills no screen with them.
MOST_NAMES, MOST_FILES = 60, 6
#: What the reader puts behind a name that stands in the header for the second time.
_AGAIN = re.compile(r"\.\d+$")
#: How the names of sensors begin in logs, in full and cut off: a name that is a slip away from one may mean it.
_SPELLINGS = {
    "gyroscope": ("gyr", "gyro", "gyros", "gyroscope"),
    "accelerometer": ("acc", "accel", "acceleration", "accelerometer"),
    "magnetometer": ("mag", "magn", "magneto", "magnetic", "magnetometer"),
}


def unused_columns(tables: Sequence[Numbers], used: Collection[tuple[Path, str]], plant: Plant) -> list[str]:
    """Return a line for each table with the columns of numbers that are not ``used`` (file and name).

    ``plant`` is what the log was taken for: the rate of a rate table is taken where it is called one.
    """
    notes = []
    for numbers in tables:
        names = [_shown(numbers.table.columns[k]) or f"column {k + 1} (no name)" for k in _left(numbers, used)]
        more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
        if names:
            rates = _rates(numbers, used)
            option = "" if plant == "rate_table" else "; of a rate table, --plant rate_table takes it"
            read = f"; {rates[0]}{option}" if len(rates) == 1 else ""
            notes.append(f"not used{_of(numbers, tables)}: {', '.join(names[:MOST_NAMES])}{more}{read}")
    others = len(notes) - MOST_FILES
    return notes[:MOST_FILES] + ([f"not used: columns of {others} more files"] if others > 0 else [])


def missing_axes(tables: Sequence[Numbers], used: Collection[tuple[Path, str]], found: Collection[str]) -> list[str]:
    """Return a line for each sensor not ``found`` of which two columns are there, and the third under no such name.

    Also where no two are named alike: the line names the columns that were probably meant.
    """
    notes = []
    for numbers in tables:
        left = _left(numbers, used)
        by_base: dict[tuple[str, str], dict[int, int]] = defaultdict(dict)
        for k in left:
            name = read_name(numbers.names[k])
            if name.axis is not None:
                by_base[name.base, name.unit].setdefault(name.axis, k)
        asked: set[str] = set()
        for (base, unit), axes in by_base.items():
            sensor = _meant(base, unit)
            if len(axes) == 2 and sensor is not None and sensor not in found:
                whole = {k for mates in by_base.values() if len(mates) > 1 for k in mates.values()}
                alone = [numbers.table.columns[k] for k in left if k not in whole]
                notes.append(_asked(numbers, sensor, axes, alone) + _of(numbers, tables))
                asked.add(sensor)
        for sensor in _SPELLINGS:
            if sensor not in found and sensor not in asked and (line := _not_alike(numbers, sensor, left)):
                notes.append(line + _of(numbers, tables))
                asked.add(sensor)
        if "gyroscope" not in {*found, *asked} and (line := _one_rate(numbers, left)):
            notes.append(line + _of(numbers, tables))
    return notes[:MOST_FILES]


def _one_rate(numbers: Numbers, left: Sequence[int]) -> str | None:
    """Return how a map takes the only column of a gyroscope, or None where there is none or more than one."""
    names = {k: read_name(numbers.names[k]) for k in left}
    rates = [k for k, name in names.items() if name.axis is not None and _meant(name.base, name.unit) == "gyroscope"]
    if len(rates) != 1:
        return None
    units = [one.unit for one in readings_of(names[rates[0]].unit) if one.sensor == "gyroscope"]
    unit = f'"{units[0]}"' if units else '"rad/s" or "deg/s"'
    column = json.dumps(numbers.table.columns[rates[0]], ensure_ascii=False)
    return (
        f"of the gyroscope {'xyz'[names[rates[0]].axis or 0]} alone was found: a map takes it as a rate about the spin "
        f"axis, [sensors.rate_reference] columns = [{column}], unit = {unit} (scale = -1 where body z is reversed)"
    )


#: Names of numbers of a throw as a whole, and how many make a table of throws.
_OF_THROWS = re.compile(r"\b(?:launch|nose|hyzer|carry|club|handedness|ball speed|advance ratio)\b", re.IGNORECASE)
_SUMMED = 2


def one_axis_rate(tables: Sequence[Numbers]) -> str | None:
    """Return how a map takes a column that is a rate about one axis, or None where no column's unit is one.

    Where each row tells a throw, as of a radar or a disc that sums up its flight, that is said.
    """
    for numbers in tables:
        summed = [_shown(name) for name in numbers.table.columns if _OF_THROWS.search(name)]
        if len(summed) >= _SUMMED:
            return (
                f"each row tells a whole throw ({', '.join(map(repr, summed[:4]))}), and a recording is readings over "
                "the time of one: discsim fly takes such numbers (--speed, --spin, --launch, --nose, --hyzer)"
            )
        if rates := _rates(numbers, ()):
            return rates[0]
    return None


def _rates(numbers: Numbers, used: Collection[tuple[Path, str]]) -> list[str]:
    """Return how a map takes each column that is not ``used`` and whose unit is that of a rate."""
    return [
        f"'{_shown(name)}' is a rate about one axis: a map takes it in [sensors.rate_reference], "
        f'columns = ["{_shown(name)}"], unit = "{unit}"'
        for name, unit in rate_columns(numbers, used)
    ]


def rate_columns(numbers: Numbers, used: Collection[tuple[Path, str]]) -> list[tuple[str, str]]:
    """Return name and unit of each column that is not ``used`` and whose unit is that of a rate."""
    found = []
    for k in _left(numbers, used):
        name = numbers.table.columns[k]
        units = [reading.unit for reading in readings_of(read_name(numbers.names[k]).unit)]
        bare = [reading.unit for reading in readings_of(_shown(name))]  # 'rpm'
        unit = next((unit for unit in (*units, *bare) if unit in UNITS["rad_s"] and unit != "Hz"), None)
        if unit is not None:  # 'rate (Hz)' is a sampling rate as often
            found.append((name, unit))
    return found


def _of(numbers: Numbers, tables: Sequence[Numbers]) -> str:
    return f" (in {_shown(numbers.path.name)})" if len(tables) > 1 else ""


def _shown(name: str) -> str:
    return "".join(c for c in name if c.isprintable())


def _left(numbers: Numbers, used: Collection[tuple[Path, str]]) -> list[int]:
    """Return the columns of numbers that are not used."""
    enough = np.isfinite(numbers.values).sum(axis=0) >= FEWEST_ROWS
    return [k for k, name in enumerate(numbers.table.columns) if enough[k] and (numbers.path, name) not in used]


def _meant(base: str, unit: str) -> str | None:
    """Return the sensor that two columns' shared name and unit speak of, or None."""
    units = [reading.sensor for reading in readings_of(unit)]
    sensor = sensor_of(base) or next((one for one in units if one != COUNTS), None)
    other = bool(units) and not {sensor, COUNTS} & set(units)  # an angle, a speed
    known = sensor in ("gyroscope", "accelerometer", "magnetometer")
    return sensor if known and not other and penalty_of(base) < NO_READING else None


def _asked(numbers: Numbers, sensor: str, axes: dict[int, int], alone: Sequence[str]) -> str:
    """Return what is asked about the third column: whether it is the only one ``alone`` whose name is a slip away."""
    columns = numbers.table.columns
    (first, one), (second, two) = sorted(axes.items())
    (third,) = {0, 1, 2} - set(axes)
    name = _expected(columns[one], columns[two], third)
    near = [
        other
        for other in alone
        if name is not None
        and _a_slip_away(_AGAIN.sub("", other).casefold(), name.casefold())
        and sensor_of(read_name(other).base) in (None, sensor)
    ]
    found = f"of the {sensor} {'xyz'[first]} and {'xyz'[second]} were found and {'xyz'[third]} was not"
    if name in columns:
        return (
            f"{found}: '{_shown(name)}' is there and holds too few numbers; a map may leave it out (docs/importing.md)"
        )
    if len(near) == 1:
        return f"{found}: is it '{_shown(near[0])}'? Rename it, or state it in a map"
    probable = _probable(numbers, sensor, [one, two, *(columns.index(other) for other in alone)])
    if len(probable) == 3:
        also = f"Rename it, or write in a map: {_map_line(numbers, sensor, probable)}"
        return f"{found}: is it '{_shown(columns[probable[third]])}'? {also}"
    those = f"'{_shown(columns[one])}' and '{_shown(columns[two])}'"
    return f"{found}: name its column as {those} are named, or state it in a map"


def _not_alike(numbers: Numbers, sensor: str, left: Sequence[int]) -> str | None:
    """Return what is asked about a sensor no two of whose columns share a name, or None where two are not there."""
    axes = _probable(numbers, sensor, left)
    if len(axes) < 2:
        return None
    said = ", ".join(f"{'xyz'[axis]} in '{_shown(numbers.table.columns[k])}'" for axis, k in sorted(axes.items()))
    start = f"the {sensor} was not taken, for its columns are not named alike: probably {said}"
    if len(axes) == 2:
        (third,) = {0, 1, 2} - set(axes)
        return f"{start}; {'xyz'[third]} was not found: name its column as these, or state it in a map"
    return f"{start}. Rename them alike, or write in a map: {_map_line(numbers, sensor, axes)}"


def _probable(numbers: Numbers, sensor: str, left: Sequence[int]) -> dict[int, int]:
    """Return the one column of each axis (0, 1, 2) whose name may mean a sensor; none where no name surely does."""
    axes: dict[int, list[int]] = defaultdict(list)
    sure = False
    for k in left:
        name = read_name(numbers.names[k])
        meant = _meant(name.base, name.unit)
        # of a unit that is known, and another sensor's or none's, it is no slip
        slip = meant is None and not readings_of(name.unit) and sensor_of(name.base) is None
        near = slip and any(_a_slip_away(name.base.casefold(), one) for one in _SPELLINGS[sensor])
        if name.axis is not None and (meant == sensor or near):
            axes[name.axis].append(k)
            sure |= meant == sensor
    return {axis: those[0] for axis, those in axes.items() if sure and len(those) == 1}


def _map_line(numbers: Numbers, sensor: str, axes: dict[int, int]) -> str:
    """Return how a map states a sensor's three columns, with their unit where a name says it."""
    columns = ", ".join(json.dumps(numbers.table.columns[axes[axis]], ensure_ascii=False) for axis in range(3))
    units = [one for k in axes.values() for one in readings_of(read_name(numbers.names[k]).unit)]
    unit = next((f'"{one.unit}"' for one in units if one.sensor == sensor), "its unit")
    return f"[sensors.{sensor}] columns = [{columns}], unit = {unit}"


def _expected(one: str, two: str, axis: int) -> str | None:
    """Return the name that a third axis would have beside two that differ in one letter, or None.

    >>> _expected("GyrX [dps]", "GyrY [dps]", 2), _expected("gyro[0]", "gyro[2]", 1), _expected("rateX", "gyroY", 2)
    ('GyrZ [dps]', 'gyro[1]', None)
    """
    places = [k for k, (a, b) in enumerate(zip(one, two, strict=False)) if a != b]
    if len(one) != len(two) or len(places) != 1 or one[places[0]] not in "xyzXYZ012":
        return None
    letter = one[places[0]]
    third = str(axis) if letter.isdigit() else "xyz"[axis].upper() if letter.isupper() else "xyz"[axis]
    return one[: places[0]] + third + one[places[0] + 1 :]


def _a_slip_away(one: str, two: str) -> bool:
    """Tell names that are equal, or where a sign is wrong, too many or missing, or two neighbours are swapped.

    >>> [_a_slip_away(name, "gyrz") for name in ("gryz", "gyyrz", "gyz", "gyrx", "rgzy", "az")]
    [True, True, True, True, False, False]
    """
    if len(one) == len(two):
        off = [k for k, (a, b) in enumerate(zip(one, two, strict=True)) if a != b]
        swapped = len(off) == 2 and off[1] == off[0] + 1 and one[off[0]] == two[off[1]] and one[off[1]] == two[off[0]]
        return len(off) <= 1 or swapped
    shorter, longer = sorted((one, two), key=len)
    return len(longer) == len(shorter) + 1 and any(longer[:k] + longer[k + 1 :] == shorter for k in range(len(longer)))
