"""A map of a raw logger: which file and columns hold which sensor, in what unit, axes and time base.

A map is a small TOML file (docs/importing.md). The shipped ones stand in ``models/imports``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date, datetime
from pathlib import Path
from types import MappingProxyType
from typing import cast

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc, Release
from discsim.environment import FIELD_MODEL_SIGMA, Environment, world_magnetic_field
from discsim.errors import InputError
from discsim.files import model_file
from discsim.limits import Limit
from discsim.recording import PLANTS, SENSORS, Plant, SensorSheet, read_sheet
from discsim.shipped import load_disc, load_site
from discsim.toml_table import TomlTable, read_toml
from discsim.validation.importing.raw_table import REPAIRS, Layout
from discsim.validation.importing.throw import MeasuredThrow

__all__ = ["SPEEDS", "UNITS", "ImportMap", "SensorMap", "TimeBase", "find_map", "read_map"]

G0 = 9.80665  # standard gravity, the "g" of data sheets
UNITS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "uT": {"uT": 1.0, "nT": 1e-3, "mT": 1e3, "T": 1e6, "gauss": 1e2, "mgauss": 0.1},
        "m_s2": {"m/s^2": 1.0, "g": G0, "mg": 1e-3 * G0},
        "rad_s": {
            **{"rad/s": 1.0, "deg/s": np.pi / 180, "mdeg/s": np.pi / 180e3, "mrad/s": 1e-3},
            **{"rpm": np.pi / 30, "Hz": 2 * np.pi},
        },
        "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048},
        "": {"SI": 1.0, "deg": 1.0, "degE7": 1.0},
    }
)
#: Metres per second in one of a receiver's velocity (a knot is 1852 m an hour, a mile 1609.344 m).
SPEEDS: Mapping[str, float] = MappingProxyType(
    {
        **{"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "km/h": 1 / 3.6},
        **{"ft/s": 0.3048, "mph": 1609.344 / 3600, "kn": 1852 / 3600},
    }
)
TIME_UNITS = {"d": 86400.0, "min": 60.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "iso": 1.0}
#: Degrees in one of a receiver's latitude: whole numbers of u-blox and MAVLink count ten millionths.
_DEGREES = {"deg": 1.0, "degE7": 1e-7}
#: How far two devices' clocks are apart: one may count from its start, the other from 1900, as NTP's do.
_OFFSET = Limit(1e-9, 5e9, "the finest unit of loggers' clocks; the seconds from 1900 to 2058")
BODY_SENSORS = ("magnetometer", "accelerometer", "gyroscope")


@dataclass(frozen=True)
class TimeBase:
    """Time of a row: a column times ``scale`` (s), or the row's number (or its counter) times ``step`` (s).

    ``iso``: the column holds dates and times, or times of the day. ``step_sigma``: what ``step`` may be off by, s;
    ``off``: the share of ``scale`` that it may be off by.
    ``spacings``: the column holds what went by since the row before, and is added up. ``shared``: several rows share a
    stamp of a coarse clock, and are even between stamps.
    """

    column: str | None = None
    scale: float = 1.0
    step: float | None = None
    counter: str | None = None
    iso: bool = False
    step_sigma: float | None = None
    spacings: bool = False
    off: float | None = None
    shared: bool = False


@dataclass(frozen=True)
class SensorMap:
    """Where one sensor's readings are.

    Attributes
    ----------
    file : str or None
        Pattern of the file's name in a folder (``*_gyro_*.csv``).
    columns : tuple of tuples of str
        Names of the columns, and other names they may have; the first set that the file has counts.
    factor : float
        What turns a reading into the sensor's unit in a recording.
    axes : tuple
        Per coordinate in a recording the number of the column it is taken from and its sign, or None where it was
        not seen.
    where : tuple of str or None
        A column and the value it has in the rows of this sensor.
    optional : bool
        Whether the sensor may be absent.
    time : str or None
        The column of this sensor's own time stamps, in the unit of ``[time]``; None where it has the file's.
    time_unit : str or None
        The unit of that column, where it is another one.
    sheet : SensorSheet
        What the data sheet states; a rate of NaN is taken from the time stamps.
    degrees : float
        Degrees in one of a GPS's first two columns, latitude and longitude beside a height; 0 where they are metres.
    height : float or None
        Metres in one of that height; None where the map does not state its unit (then m).
    speed : float
        Metres per second in one of a GPS's velocity.
    layout : Layout or None
        How its file is laid out, where that is otherwise than the map's.
    offset : float
        What is added to the sensor's times, s: its clock is behind the main one's by so much.
    """

    file: str | None
    columns: tuple[tuple[str, ...], ...]
    factor: float
    axes: tuple[tuple[int, float] | None, ...]
    where: tuple[str, str] | None
    optional: bool
    sheet: SensorSheet
    time: str | None = None
    degrees: float = 0.0
    height: float | None = None
    offset: float = 0.0
    time_unit: str | None = None
    speed: float = 1.0
    layout: Layout | None = None

    def written(self, value: FloatArray) -> FloatArray:
        """Return readings (n, 3) of a recording as the log has them, but for the order of the axes."""
        signs = np.array([1.0 if axis is None else axis[1] for axis in self.axes])
        return np.asarray(value / (self.factor * signs))


@dataclass(frozen=True)
class ImportMap:
    """What a map states; ``throws`` are release conditions by the stem of the raw file's name.

    ``recognised_by`` are columns that tell this logger from all others beside those that the map reads; None where the
    map is taken only if it is named.
    """

    path: Path
    name: str
    plant: Plant
    layout: Layout
    time: TimeBase
    repairs: tuple[str, ...]
    environment: Environment
    disc: Disc | None
    release: Release | None
    throws: Mapping[str, MeasuredThrow]
    sensors: Mapping[str, SensorMap]
    recognised_by: tuple[str, ...] | None = None

    def laid_out(self, sensor: str) -> ImportMap:
        """Return the map with the layout of a sensor's file."""
        own = self.sensors[sensor].layout
        return self if own is None else replace(self, layout=own)

    def time_of(self, sensor: str) -> TimeBase:
        """Return the clock of a sensor's rows: its own column of time stamps, or the file's."""
        own = self.sensors[sensor]
        if own.time is None:
            return self.time
        if own.time_unit is None:
            return replace(self.time, column=own.time, shared=False)
        return TimeBase(own.time, TIME_UNITS[own.time_unit], iso=own.time_unit == "iso")


def find_map(name_or_path: str) -> Path:
    """Return the file of a shipped map, or the file named; raises `InputError` listing the shipped ones."""
    if name_or_path.endswith(".toml") or Path(name_or_path).is_file():
        return Path(name_or_path)
    try:
        return model_file(f"imports/{name_or_path}.toml")
    except InputError as error:
        raise InputError(f"--map {name_or_path}: {error}, or a file that ends in .toml") from None


def read_map(path: Path) -> ImportMap:
    """Read a map strictly; raises `InputError` naming file, line and what was expected."""
    top = read_toml(path)
    name = top.text("name")
    plant = cast(Plant, top.text("plant", choices=PLANTS))
    assert name is not None
    if plant == "spin_down":
        raise top.error("plant", "'plant' is 'spin_down', expected flight, rate_table or free_spin in a map")
    repairs = _texts(top, "repairs", choices=tuple(REPAIRS)) or ()
    layout = _layout(top.table("layout"))
    time = _time_base(_need(top, "time"))
    environment = _environment(_need(top, "environment"), flying=plant == "flight")
    disc = _disc(top.table("disc", required=plant == "flight"), flying=plant == "flight")
    release_table = top.table("release")
    release = None if release_table is None else Release.from_toml(release_table)
    throws = _throws(top.table("throws"))
    sensors = _sensors(_need(top, "sensors"), strict=plant != "free_spin")
    recognised_by = _texts(top, "recognised_by")
    top.finish()
    own = [sensor for sensor, sensor_map in sensors.items() if sensor_map.time is not None]
    if own and time.column is None:
        what = f"[sensors.{own[0]}] names a column of time stamps"
        raise top.error("sensors", f"{what}; expected 'column' in [time] too, whose unit holds for both")
    if throws and "track" not in sensors:
        raise top.error("throws", "[throws] without [sensors.track]; expected the track whose first row is the release")
    return ImportMap(
        path,
        name,
        plant,
        layout,
        time,
        repairs,
        environment,
        disc,
        release,
        throws,
        sensors,
        recognised_by,
    )


def _need(table: TomlTable, key: str) -> TomlTable:
    part = table.table(key, required=True)
    assert part is not None
    return part


def _texts(table: TomlTable, key: str, *, choices: tuple[str, ...] = ()) -> tuple[str, ...] | None:
    value = table.raw(key)
    if value is None:
        return None
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise table.error(key, f"'{key}' is {value!r}, expected a list of texts")
    for item in value:
        if choices and item not in choices:
            raise table.error(key, f"'{key}' holds '{item}', expected {', '.join(choices)}")
    return tuple(value)


def _layout(table: TomlTable | None) -> Layout:
    if table is None:
        return Layout()
    separator = table.text("separator", required=False) or ","
    if separator != "blank" and len(separator) != 1:
        raise table.error("separator", f"'separator' is '{separator}', expected one character or 'blank'")
    decimal = table.text("decimal", required=False, choices=(".", ",")) or "."
    skip_lines = table.raw("skip_lines") or 0
    if not isinstance(skip_lines, int) or isinstance(skip_lines, bool) or skip_lines < 0:
        raise table.error("skip_lines", f"'skip_lines' is {skip_lines!r}, expected a whole number from 0")
    columns = _texts(table, "columns") or ()
    comment = table.text("comment", required=False) or ""
    lists, encoding, thousands = table.flag("lists"), _encoding(table), table.text("thousands", required=False) or ""
    labelled = table.flag("labelled")
    if labelled and not columns:
        raise table.error("labelled", "'labelled' is true, expected 'columns' with it: the names before the cells")
    # either may be the separator as well, where numbers stand in quotes
    if len(thousands) > 1 or (thousands and thousands == decimal):
        raise table.error("thousands", f"'thousands' is '{thousands}', expected one character of its own")
    order = table.text("sorted_by", required=False) or ""
    layout = Layout(separator, decimal, skip_lines, columns, comment, lists, encoding, thousands, labelled, order)
    table.finish()
    return layout


def _encoding(table: TomlTable) -> str:
    encoding = table.text("encoding", required=False) or "utf-8"
    try:
        # a codec such as "hex", which knows no text, fails here, and one such as "idna", which knows no damaged text
        b"1".decode(encoding, errors="replace")
    except (LookupError, ValueError):
        raise table.error("encoding", f"'encoding' is '{encoding}', expected one such as utf-8 or latin-1") from None
    return encoding


def _time_base(table: TomlTable) -> TimeBase:
    column = table.text("column", required=False)
    unit = table.text("unit", required=False, choices=tuple(TIME_UNITS)) or "s"
    step = table.number("step", "s", required=False, positive=True)
    counter, spacings = table.text("counter", required=False), table.flag("spacings")
    if (column is None) == (step is None):
        raise table.error(None, "expected either 'column' (of time stamps) or 'step_s' (of rows at one rate) in [time]")
    if spacings and (column is None or unit == "iso"):
        raise table.error("spacings", "'spacings' is true, expected a 'column' of numbers in s, ms, us, ns, min or d")
    shared = table.flag("shared")
    if shared and column is None:
        raise table.error("shared", "'shared' is true, expected a 'column' of stamps that several rows share")
    count = table.number("scale", required=False, positive=True)
    if count is not None and (column is None or unit == "iso"):
        raise table.error("scale", "'scale' is the worth of one count of a 'column' of numbers; expected one beside it")
    table.finish()
    off = None if count is None or "scale" not in table.sigma else float(np.max(table.sigma["scale"])) / count
    sigma = table.sigma.get("step_s")
    step_off = None if sigma is None else float(np.max(sigma))
    scale = TIME_UNITS[unit] * (count or 1.0)
    return TimeBase(column, scale, step, counter, unit == "iso", step_off, spacings, off, shared)


def _environment(table: TomlTable, *, flying: bool) -> Environment:
    """Return the surroundings; the field is zero where it is not known."""
    density = table.number("air_density", "kg_m3", required=flying, positive=True)
    wind = table.vector("wind", "m_s", frame="ned", default=(0.0, 0.0, 0.0))
    assert wind is not None
    site = table.text("site", required=False)
    if site is not None:
        there = load_site(site).environment
        field, gravity = there.magnetic_field, there.gravity
        table.sigma["magnetic_field_ned_uT"] = FIELD_MODEL_SIGMA
    else:
        gravity = table.need("gravity", "m_s2", positive=True)
        latitude = table.number("latitude", "deg", required=False)
        if latitude is not None:
            longitude, height = table.need("longitude", "deg"), table.number("height", "m", required=False) or 0.0
            day = table.raw("date")
            if not isinstance(day, date) or isinstance(day, datetime):
                raise table.error("date", f"'date' is {day!r}, expected a date such as 2021-10-15")
            field = world_magnetic_field(latitude, longitude, day, height)
            table.sigma["magnetic_field_ned_uT"] = FIELD_MODEL_SIGMA
        else:
            stated = table.vector("magnetic_field", "uT", frame="ned", required=False)
            if stated is None:
                table.finish()
                return Environment(gravity, readonly([0.0, 0.0, 0.0]), density, wind, table.sigma)
            field = stated
    table.finish()
    return Environment(gravity, field, density, wind, table.sigma)


def _disc(table: TomlTable | None, *, flying: bool) -> Disc | None:
    if table is None:
        return None
    name = table.text("name", required=False)
    if name is None:
        return Disc.from_toml(table, aero_required=flying)
    table.finish()
    return load_disc(name)[0]


def _throws(table: TomlTable | None) -> Mapping[str, MeasuredThrow]:
    throws = {}
    for stem in table or ():
        assert table is not None
        throws[stem] = MeasuredThrow.from_toml(_need(table, stem))
    return MappingProxyType(throws)


def _sensors(table: TomlTable, *, strict: bool) -> Mapping[str, SensorMap]:
    sensors = {}
    for sensor in table:
        if sensor not in SENSORS:
            raise table.error(sensor, f"unknown sensor '{sensor}'; expected one of {', '.join(SENSORS)}")
        sensors[sensor] = _sensor(_need(table, sensor), sensor, strict=strict)
    if not sensors:
        raise table.error(None, f"no sensor; expected at least one of {', '.join(SENSORS)}")
    return MappingProxyType(sensors)


def _sensor(table: TomlTable, sensor: str, *, strict: bool) -> SensorMap:
    file = table.text("file", required=False)
    columns = _columns(table, sensor)
    choices = UNITS[SENSORS[sensor].unit]
    # a path without a unit is in metres
    unit = table.text("unit", required=sensor not in ("track", "gps"), choices=tuple(choices)) or next(iter(choices))
    scale = table.number("scale", required=False)
    if scale == 0:
        raise table.error("scale", "'scale' is 0, expected the unit's worth of one count")
    axes = _axes(table, sensor, len(columns[0]))
    where = table.table("where")
    chosen = None
    if where is not None:
        keys = list(where)
        if len(keys) != 1:
            raise where.error(None, f"{len(keys)} keys, expected one: COLUMN = 'value'")
        chosen = (keys[0], cast(str, where.text(keys[0])))
    optional = table.flag("optional")
    time = table.text("time", required=False)
    time_unit = table.text("time_unit", required=False, choices=tuple(TIME_UNITS))
    if time_unit is not None and time is None:
        raise table.error("time_unit", "'time_unit' is the unit of the sensor's own column; expected 'time' beside it")
    if strict and sensor == "accelerometer" and "position_m" not in table:
        raise table.error(
            None,
            "missing key 'position_m' in [sensors.accelerometer]; expected where it sits in the body frame, m from the "
            "axis of the spin: write position_m = [x, y, z] there, and import with this map (--map FILE)",
        )
    height = table.text("height_unit", required=False, choices=tuple(UNITS["m"]))
    place = _DEGREES.get(unit, 0.0) if sensor == "gps" else 0.0
    if height is not None and not place:
        raise table.error("height_unit", "'height_unit' is for a gps with unit = \"deg\"; expected it there alone")
    metres = None if height is None else UNITS["m"][height]
    velocity = table.text("velocity_unit", required=False, choices=tuple(SPEEDS))
    if velocity is not None and (sensor != "gps" or len(columns[0]) < 6):
        raise table.error("velocity_unit", "'velocity_unit' is for a gps with six columns; expected it there alone")
    own_layout = table.table("layout")
    layout = None if own_layout is None else _layout(own_layout)
    offset = table.number("time_offset", "s", required=False, limit=_OFFSET) or 0.0
    # a rate that the map does not state comes from the time stamps
    sheet = read_sheet(table, sensor, strict=strict, rate_required=False)
    factor = choices[unit] * (scale or 1.0)
    worth = SPEEDS[velocity or "m/s"]
    return SensorMap(
        *(file, columns, factor, axes, chosen, optional, sheet, time, place, metres, offset, time_unit, worth),
        layout=layout,
    )


def _columns(table: TomlTable, sensor: str) -> tuple[tuple[str, ...], ...]:
    width = len(SENSORS[sensor].columns)
    # a plan view has no third coordinate, and not every receiver writes velocities
    widths = {"track": (2, 3), "gps": (3, 6)}.get(sensor, (width,))
    value = table.raw("columns")
    sets = value if isinstance(value, list) and value and isinstance(value[0], list) else [value]
    expected = " or ".join(map(str, widths))
    for names in sets:
        if (
            not isinstance(names, list)
            or len(names) not in widths
            or len(names) != len(sets[0])
            or not all(isinstance(item, str) for item in names)
        ):
            raise table.error(
                "columns",
                f"'{table.name}.columns' is {value!r}, expected {expected} names of columns (or a list of such lists)",
            )
    return tuple(tuple(names) for names in sets)


def _axes(table: TomlTable, sensor: str, width: int) -> tuple[tuple[int, float] | None, ...]:
    names = _texts(table, "axes")
    mirrored = table.flag("mirrored")
    if names is None:
        seen: list[tuple[int, float] | None] = [(column, 1.0) for column in range(width)]
        return tuple(seen + [None] * (len(SENSORS[sensor].columns) - width))
    letters = "xyz"[:width]
    axes: list[tuple[int, float] | None] = []
    for name in names:
        match = re.fullmatch(r"([+-]?)([xyz])", name)
        if match and match.group(2) in letters:
            axes.append((letters.index(match.group(2)), -1.0 if match.group(1) == "-" else 1.0))
        elif sensor == "track" and name == "none":
            axes.append(None)
    used = [axis[0] for axis in axes if axis is not None]
    if len(SENSORS[sensor].columns) != 3 or len(names) != 3 or len(axes) != 3 or len(set(used)) != len(used):
        raise table.error(
            "axes",
            f"'{table.name}.axes' is {list(names)}, expected three of {', '.join(letters)}, each once, "
            "with '-' where reversed (in a track 'none' for what was not seen)",
        )
    if sensor in BODY_SENSORS and _mirrors(axes) != mirrored:
        remedy = (
            "remove mirrored = true" if mirrored else "expected a rotation, or mirrored = true for left-handed axes"
        )
        raise table.error("axes", f"'{table.name}.axes' {'rotate' if mirrored else 'mirror'} the sensor; {remedy}")
    return tuple(axes)


def _mirrors(axes: list[tuple[int, float] | None]) -> bool:
    matrix = np.zeros((3, 3))
    for row, axis in enumerate(axes):
        assert axis is not None
        matrix[row, axis[0]] = axis[1]
    return bool(np.linalg.det(matrix) < 0)
