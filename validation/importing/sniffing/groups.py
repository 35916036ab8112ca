"""Columns in threes. Takes the tables of a raw file or folder; gives each triple of columns that may be a sensor."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.recording import SENSORS
from discsim.validation.importing.cell_texts import CellTexts, number
from discsim.validation.importing.overflow import continued
from discsim.validation.importing.raw_table import RawTable
from discsim.validation.importing.sniffing.dialect import Dialect
from discsim.validation.importing.sniffing.names import (
    Name,
    about_axes,
    is_of_mavlink,
    is_of_quaternion,
    last_word,
    penalty_of,
    read_name,
    says_nothing,
    sensor_of,
    sensor_of_code,
    sensor_of_file,
    words_of,
)
from discsim.validation.importing.sniffing.units import COUNTS, OTHER, Reading, readings_of
from discsim.validation.importing.unsigned import signed
from discsim.validation.importing.wild import wild_rows
from discsim.validation.rows.failed import failed_on_one_axis, failed_rows

__all__ = ["FEWEST_ROWS", "Numbers", "Triple", "triples_of"]

#: A column of text with at most this many different values names sensors (or parts) row by row.
MAX_IDS = 20
#: Rows without which a triple is no sensor: three say nothing of a unit or an axis, and a line of text may hold them.
FEWEST_ROWS = 4
#: Rows of a column by which it is told to ascend.
_ROWS = 12
#: What SCALED_IMU counts in whole numbers (MAVLink, common messages); ArduPilot's RAW_IMU counts the same.
_MAVLINK = {"gyroscope": "mrad/s", "accelerometer": "mg", "magnetometer": "mgauss"}
#: What messages of ROS hold of the two under its own names (sensor_msgs/Imu).
_ROS = {"gyroscope": "rad/s", "accelerometer": "m/s^2"}
_OF_ROS = (("angular", "velocity"), ("linear", "acceleration"))
#: What the decoder of Betaflight's and INAV's blackbox writes; the two log whole deg/s, and no unit with them.
_BLACKBOX = {"loopiteration", "gyroadc[0]", "gyroadc[1]", "gyroadc[2]"}
_PLACE = ({"lat", "latitude"}, {"lon", "lng", "long", "longitude"})
#: a quaternion has turned where one of its numbers has changed by more: by 23 degrees at least
_TURNED = 0.2
_ID_NAMES = ("id", "sensor", "sensorname", "sensor_name", "sensor_id", "sensorid", "type", "name", "source", "device",
             "kind", "topic", "imu", "sensor_type", "sensortype")  # fmt: skip
#: a part's address on its bus, as that of two of one kind in a log
_ADDRESS = re.compile(r"0[xX][0-9a-fA-F]{2}")
#: share of rows at which a code changes that is one of sensors in turn; and by how much less readings must change from
#: a code's row to its next than from row to row, in three columns at least: those of one sensor change by as much
_IN_TURN, _PARTED = 0.2, 0.5


@dataclass(frozen=True)
class Numbers:
    """A table's cells as numbers, what its dialect says of it, and whether it is the only file there."""

    table: RawTable
    dialect: Dialect
    alone: bool = False

    @property
    def path(self) -> Path:
        """The raw file."""
        return self.table.path

    @property
    def tells_positions(self) -> bool:
        """Whether it has the columns of a recording's gps, or a latitude and a longitude."""
        return set(SENSORS["gps"].columns) <= set(self.table.columns) or self.degrees is not None

    @cached_property
    def names_motion(self) -> bool:
        """Whether three columns or more are called after a gyroscope, an accelerometer or a magnetometer."""
        return sum(sensor_of(read_name(name).base) is not None for name in self.names) > 2

    @cached_property
    def is_of_ros(self) -> bool:
        """Whether it has an angular velocity and a linear acceleration, as sensor_msgs/Imu calls the two."""
        words = [words_of(name) for name in self.names]
        return all(sum({*pair} <= own for own in words) >= 3 for pair in _OF_ROS)

    @cached_property
    def degrees(self) -> tuple[int, int] | None:
        """The columns that are called a latitude and a longitude; None where there are none."""
        words = [last_word(name) for name in self.names]
        latitude, longitude = (next((k for k, word in enumerate(words) if word in own), None) for own in _PLACE)
        if latitude is None and longitude is None:  # GPS_coord[0] and [1], as Betaflight's log decoder calls them
            read = [read_name(name) for name in self.names]
            pair = [k for k, word in enumerate(words) if word == "coord" and read[k].axis in (0, 1)]
            latitude, longitude = pair if len(pair) == 2 else (None, None)
        return None if latitude is None or longitude is None else (latitude, longitude)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The columns' names, with the units of a line of their own put into brackets."""
        units = self.dialect.units
        return tuple(
            f"{name} [{units[k].strip('()[]{}<> ')}]" if k < len(units) and units[k].strip("()[]{}<>- ") else name
            for k, name in enumerate(about_axes(self.table.columns))
        )

    @cached_property
    def values(self) -> FloatArray:
        """The cells as numbers, (n, columns); NaN where one is none."""
        value = np.empty((len(self.table), len(self.table.columns)))
        for k, column in enumerate(self.table.texts):
            value[:, k], _ = column.numbers(self.dialect.layout.decimal)
        return value

    @cached_property
    def orientations(self) -> tuple[tuple[int, int, int, int], ...]:
        """Four neighbours each that are the quaternion of a fused orientation: no sensor's, of length 1 as it turns.

        A pull in g that a hand turns slowly has that length, too, and is told by its names. Four that are called a
        quaternion are one before they turn.
        """
        found: list[tuple[int, int, int, int]] = []
        for k in range(len(self.names) - 3):
            four = self.values[:, k : k + 4]
            four = four[np.isfinite(four).all(axis=1)]
            named = sum(sensor_of(read_name(name).base) is not None for name in self.names[k : k + 4])
            if named > 2 or len(four) < FEWEST_ROWS or (found and k <= found[-1][-1]):
                continue
            spans = np.ptp(four, axis=0)
            # a column of noughts behind a pull is a button's
            turned = spans.max() > _TURNED and spans[3] > 0.0
            if (turned or all(map(is_of_quaternion, self.names[k : k + 4]))) and _is_unit(four):
                found.append((k, k + 1, k + 2, k + 3))
        return tuple(found)

    def cells(self, column: int) -> CellTexts:
        """Return a column's texts."""
        return self.table.texts[column]

    @cached_property
    def ids(self) -> tuple[int, tuple[str, ...]] | None:
        """The column that says whose row it is, and its values in the order of appearance; None where there is none."""
        for k, name in enumerate(self.table.columns):
            few = self.cells(k).few(MAX_IDS)
            if few is None or len(self.table) <= 4 * len(few):
                continue
            words = all(number(text, self.dialect.layout.decimal) is None for text in few)
            telling = sum(sensor_of(text) is not None for text in few)
            called = name.strip().lower() in _ID_NAMES
            numbered = len(few) > 1 and all(text.isdecimal() for text in few) and not self._in_stretches(k)
            addressed = len(few) > 1 and all(_ADDRESS.fullmatch(text) for text in few)
            if addressed or (words and (called or telling > 1)) or (numbered and (called or self._takes_turns(k))):
                return k, few
        return None

    def _in_stretches(self, column: int) -> bool:
        """Tell numbers of stretches of a log, as windows that somebody cut it into: each comes once, in its order."""
        code = self.values[:, column]
        return bool(np.all(np.diff(code) >= 0)) and float(np.ptp(code)) >= 2.0

    def _takes_turns(self, column: int) -> bool:
        """Tell codes of sensors whose rows come in turn: what stands beside them goes on from a code's row to its next.

        A flag that toggles does not part readings so.
        """
        code = self.values[:, column]
        changes = np.diff(code) != 0
        if not np.isfinite(code).all() or np.mean(changes) < _IN_TURN:
            return False
        order = np.argsort(code, kind="stable")
        same = np.diff(code[order]) == 0
        parted = 0
        for k in range(len(self.names)):
            value = self.values[:, k]
            if k == column or not np.isfinite(value).all() or np.all(np.diff(value) >= 0):
                continue
            own = np.abs(np.diff(value[order]))[same]
            across = np.abs(np.diff(value))[changes]
            parted += bool(np.median(own) < _PARTED * np.median(across))
        return parted > 2


def _is_unit(value: FloatArray) -> bool:
    """Tell whether rows (n, 4) have length 1: all but one in a hundred, to a unit of the second decimal place."""
    with np.errstate(over="ignore"):
        length = np.sqrt(np.sum(value**2, axis=1))
    return bool(np.mean(np.abs(length - 1.0) < 0.01) >= 0.99)


@dataclass(frozen=True)
class Triple:
    """Three columns that may be one sensor's x, y, z.

    ``names`` are the columns as the table calls them; ``sensor`` what names and units say (None: nothing), ``units``
    what the unit may mean, ``penalty`` how far it stands back, ``where`` the id's column and value.
    """

    numbers: Numbers
    columns: tuple[int, int, int]
    base: str
    sensor: str | None
    source: str
    units: tuple[Reading, ...]
    spelling: str
    penalty: int
    where: tuple[str, str] | None

    def is_beside(self, other: Triple) -> bool:
        """Whether it has another's columns, in the rows of another part."""
        return self.numbers is other.numbers and self.columns == other.columns and self.where != other.where

    @property
    def names(self) -> tuple[str, ...]:
        """The columns' names in the table."""
        return tuple(self.numbers.table.columns[k] for k in self.columns)

    @cached_property
    def rows(self) -> BoolArray:
        """The rows that are this triple's, (n,)."""
        if self.where is None:
            return np.ones(len(self.numbers.table), dtype=np.bool_)
        return self.numbers.table.column(self.where[0]).equal(self.where[1])

    @cached_property
    def values(self) -> FloatArray:
        """Its readings as meant, (n, 3): with their sign, NaN for failed ones, continued where they overflowed."""
        value = np.asarray(self.numbers.values[:, list(self.columns)])
        value = value if self.where is None else value[self.rows]
        meant = signed(value)
        value = value if meant is None else meant
        failed = failed_rows(self.sensor, value)
        value = np.where(failed[:, None], np.nan, value) if failed.any() else value
        cells = failed_on_one_axis(value)
        value = np.where(cells, np.nan, value) if cells.any() else value
        wild = wild_rows(value)
        value = np.where(wild[:, None], np.nan, value) if wild.any() else value
        if self.sensor != "gyroscope":
            return value
        whole = [continued(column) for column in value.T]
        if all(one is None for one in whole):
            return value
        return np.column_stack([c if one is None else one.value for c, one in zip(value.T, whole, strict=True)])

    @property
    def label(self) -> str:
        """The columns as a person reads them."""
        where = "" if self.where is None else f" where {self.where[0]} = {self.where[1]}"
        return ", ".join(self.names) + where


def triples_of(numbers: Numbers, taken: Sequence[int]) -> list[Triple]:
    """Return the triples of a table: by names first, and of columns whose names say nothing, in threes.

    ``taken`` are columns that hold time, counters or ids.
    """
    ids = numbers.ids
    wheres: list[tuple[str, str] | None] = [None]
    if ids is not None:
        wheres = [(numbers.table.columns[ids[0]], value) for value in ids[1]]
    apart = {*taken, *([] if ids is None else [ids[0]]), *(k for four in numbers.orientations for k in four)}
    free = [k for k in range(len(numbers.names)) if k not in apart]
    found = []
    for where in wheres:
        names = {k: read_name(numbers.names[k]) for k in free}
        whole = _named_alike(names)
        found += [_named(numbers, names, axes, where) for axes in whole]
        used = {k for axes in whole for k in axes.values()}
        found += _unnamed(numbers, [k for k in free if k not in used and says_nothing(names[k].base)], where)
    return [triple for triple in found if _has_readings(triple)]


def _named_alike(names: Mapping[int, Name]) -> list[dict[int, int]]:
    """Return the columns that share a name but for the axis, by axis; of the rest those that do in small letters."""
    found: list[dict[int, int]] = []
    for spelt in (str, str.casefold):  # GyroX and gyroX may stand for two sensors; gyroX, GyroY, GyroZ are one
        used = {k for axes in found for k in axes.values()}
        by_base: dict[tuple[str, str], dict[int, int]] = defaultdict(dict)
        for k, name in names.items():
            if name.axis is not None and k not in used:
                by_base[spelt(name.base), spelt(name.unit)].setdefault(name.axis, k)
        found += [axes for axes in by_base.values() if set(axes) == {0, 1, 2}]
    return found


def _named(
    numbers: Numbers, names: Mapping[int, Name], axes: Mapping[int, int], where: tuple[str, str] | None
) -> Triple:
    columns = (axes[0], axes[1], axes[2])
    name = names[columns[0]]
    units = readings_of(name.unit)
    by_name = sensor_of(name.base)
    source = "its name"
    if by_name is None and where is not None:
        by_name, source = _sensor_of_id(numbers, where[1])
    if by_name is None and says_nothing(name.base) and not (units and units[0].sensor != COUNTS):
        by_name, source = sensor_of_file(numbers.path), "the file's name"
    if by_name in _MAVLINK and not units and all(is_of_mavlink(numbers.names[k]) for k in columns):
        value = numbers.values[:, list(columns)]
        whole = not np.any(value[np.isfinite(value)] % 1)
        units = [Reading(by_name, _MAVLINK[by_name])] if whole else units
    if by_name == "gyroscope" and not units and _BLACKBOX <= set(map(str.lower, numbers.names)):
        units = [Reading(by_name, "deg/s")]
    if by_name in _ROS and not units and numbers.is_of_ros:
        units = [Reading(by_name, _ROS[by_name])]
    if by_name is not None:
        if by_name == "gyroscope" and units and units[0].unit == "rad":  # PX4's gyro_rad is in rad/s
            units = [Reading("gyroscope", "rad/s")]
        meant = [unit for unit in units if unit.sensor in (by_name, COUNTS)]
        other = bool(units) and not meant  # an angle, a speed: not this sensor's reading
        sensor: str | None = OTHER if other else by_name
    else:
        meant, sensor, source = units, (units[0].sensor if units else None), "its unit"
        if sensor == COUNTS:
            sensor = None
    back = penalty_of(name.base) + penalty_of("" if where is None else where[1])
    # a file per sensor: its name speaks of its columns; that of an only file (motion.csv, bias.csv) is the user's
    if len(numbers.names) <= 8 and (not numbers.alone or source == "the file's name"):
        back += penalty_of(numbers.path.stem)
    return Triple(numbers, columns, name.base, sensor, source, tuple(meant), name.unit, back, where)


def _sensor_of_id(numbers: Numbers, text: str) -> tuple[str | None, str]:
    """Return the sensor that an id of a table speaks of, and what says so."""
    if (named := sensor_of(text)) is not None:
        return named, f"the id {text}"
    codes = () if numbers.ids is None else numbers.ids[1]
    return sensor_of_code(text, codes), f"Android's number for it, {text},"


def _unnamed(numbers: Numbers, free: list[int], where: tuple[str, str] | None) -> list[Triple]:
    """Return neighbouring columns in threes: of a run of them from its first if it comes out even, else from each."""
    own, by_id = (None, "") if where is None else _sensor_of_id(numbers, where[1])
    file = own or sensor_of_file(numbers.path)
    source = by_id if own else "the file's name" if file else ""
    runs: list[list[int]] = []
    for k in free:
        if not np.isfinite(numbers.values[:, k]).any() or _ascends(numbers.values[:, k]):
            continue  # a word before each row; a time that is too coarse for a clock
        if not runs or k != runs[-1][-1] + 1:
            runs.append([])
        runs[-1].append(k)
    sensor = file if [len(run) for run in runs] == [3] else None
    return [
        Triple(numbers, (run[k], run[k + 1], run[k + 2]), "", sensor, source, (), "", 0, where)
        for run in runs
        for k in range(0, len(run) - 2, 3 if len(run) % 3 == 0 else 1)
    ]


def _ascends(value: FloatArray) -> bool:
    """Tell a column that goes up and never down, as a time does: by chance one of `_ROWS` readings is so in 5e8."""
    sound = value[np.isfinite(value)]
    return len(sound) >= _ROWS and bool(np.all(np.diff(sound) >= 0) and np.ptp(sound) > 0)


def _has_readings(triple: Triple) -> bool:
    """Tell whether enough rows have three numbers; a triple without is another file's or always empty."""
    if triple.sensor in (OTHER, "time"):
        return False
    return int(np.isfinite(triple.values).all(axis=1).sum()) >= FEWEST_ROWS
