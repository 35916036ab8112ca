"""What a reader of logs gives: one table of readings per sensor, and the sentences that go with it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.recording import SENSORS
from discsim.validation.importing.stamps import EPOCH

__all__ = ["Log", "Rows", "Table", "chosen", "course_velocity", "positions", "write_table"]

#: Columns of a table; those of motion have a unit in brackets, where the log tells it.
COLUMNS: Mapping[str, tuple[str, ...]] = {
    "gyroscope": ("gyro_x", "gyro_y", "gyro_z"),
    "accelerometer": ("accel_x", "accel_y", "accel_z"),
    "magnetometer": ("mag_x", "mag_y", "mag_z"),
    "gps": SENSORS["gps"].columns,
}
#: The units of the tables that readers fill; a table of counts has none.
UNITS = {"gyroscope": "rad/s", "accelerometer": "m/s^2", "magnetometer": "uT", "gps": ""}
#: The earth's ellipsoid: half its longer axis in m, and its first eccentricity squared (WGS 84, NIMA TR8350.2).
_SEMI_MAJOR, _ECCENTRICITY2 = 6378137.0, 6.69437999014e-3


class Table(NamedTuple):
    """Readings of a sensor: time (n,) us on the log's clock, value (n, k) in ``unit`` (empty: counts, or a gps's)."""

    time: FloatArray
    value: FloatArray
    unit: str = ""


class Log(NamedTuple):
    """What a log holds: tables by sensor, and what to say of it.

    ``damaged``: some of its bytes are no message. ``dated``: its times are those since 2000, UTC.
    """

    tables: Mapping[str, Table]
    notes: tuple[str, ...] = ()
    damaged: bool = False
    dated: bool = False


class Rows:
    """Gathers readings in the order in which they come, by the source (a message, a topic) and the sensor."""

    def __init__(self) -> None:
        self._rows: dict[str, dict[str, list[tuple[float, ...]]]] = defaultdict(lambda: defaultdict(list))

    def add(self, source: str, sensor: str, time: float, values: Sequence[float]) -> None:
        """Add a reading: time in us; values in the sensor's unit, of a gps as `positions` takes them."""
        self._rows[source][sensor].append((time, *values))

    def sources(self, counts: Sequence[str] = ()) -> dict[str, dict[str, Table]]:
        """Return the tables by source and sensor; ``counts`` are sources whose readings have no unit."""
        return {
            source: {sensor: _table(sensor, rows, source in counts) for sensor, rows in sensors.items()}
            for source, sensors in self._rows.items()
        }


def _table(sensor: str, rows: list[tuple[float, ...]], counts: bool) -> Table:
    array = np.array(rows, dtype=float)
    value = positions(array[:, 1:]) if sensor == "gps" else array[:, 1:]
    return Table(array[:, 0], value, "" if counts else UNITS[sensor])


def chosen(sources: Mapping[str, Mapping[str, Table]]) -> tuple[dict[str, Table], list[str]]:
    """Return one table per sensor, and what was left out.

    Of several sources the one with the most readings is taken, of as many the first; the accelerometer and, where it
    is as long, the magnetometer are taken from where the gyroscope is.
    """
    tables: dict[str, Table] = {}
    notes = []
    home = ""
    for sensor in COLUMNS:
        there = {name: tables_of[sensor] for name, tables_of in sources.items() if sensor in tables_of}
        # a board without a sensor of this kind sends zeros; a receiver that stands is zero metres from its first fix
        having = {name: table for name, table in there.items() if sensor == "gps" or np.any(table.value != 0)}
        if not having:
            notes += [f"{sensor}: all its readings are zero; left out"] * bool(there)
            continue
        name = max(having, key=lambda name: (having[name].time.size, name == home))
        name = home if sensor == "accelerometer" and home in having else name
        home = name if sensor == "gyroscope" else home
        tables[sensor] = having[name]
        if len(having) > 1:
            others = "; ".join(f"{other} ({having[other].time.size})" for other in having if other != name)
            notes.append(f"{sensor}: {name} is taken ({having[name].time.size} readings); left out: {others}")
    return tables, notes


def positions(fixes: FloatArray) -> FloatArray:
    """Return (n, 6) position and velocity, North-East-Down of the first fix, m and m/s.

    ``fixes`` (n, 6) are latitude and longitude in degrees, height in m, and velocity north, east, down in m/s; NaN is a
    gap. Heights above the sea or the ellipsoid do alike: their difference is the same over the length of a flight.
    """
    place = fixes[:, :3]
    known = place[np.isfinite(place[:, :2]).all(axis=1)]
    if known.size == 0:
        return np.asarray(np.column_stack([np.full(place.shape, np.nan), fixes[:, 3:]]))
    heights = known[np.isfinite(known[:, 2]), 2]
    level = heights[0] if heights.size else 0.0
    flat = np.where(np.isfinite(place[:, 2]), place[:, 2], level)
    apart = _cartesian(place[:, 0], place[:, 1], flat) - _cartesian(known[:1, 0], known[:1, 1], np.array([level]))
    north, east, down = _axes(*np.radians(known[0, :2]))
    ned = np.column_stack([apart @ north, apart @ east, np.where(np.isfinite(place[:, 2]), apart @ down, np.nan)])
    return np.asarray(np.column_stack([ned, fixes[:, 3:]]))


def _cartesian(latitude: FloatArray, longitude: FloatArray, height: FloatArray) -> FloatArray:
    """Return earth-fixed coordinates (n, 3) m of degrees and a height in m above the ellipsoid."""
    phi, lam = np.radians(latitude), np.radians(longitude)
    normal = _SEMI_MAJOR / np.sqrt(1 - _ECCENTRICITY2 * np.sin(phi) ** 2)
    across = (normal + height) * np.cos(phi)
    up = ((1 - _ECCENTRICITY2) * normal + height) * np.sin(phi)
    return np.asarray(np.column_stack([across * np.cos(lam), across * np.sin(lam), up]))


def _axes(phi: float, lam: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the directions north, east and down in earth-fixed coordinates at a latitude and longitude, rad."""
    north = np.array([-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)])
    east = np.array([-np.sin(lam), np.cos(lam), 0.0])
    return north, east, np.cross(north, east)


def course_velocity(speed: float, course: float) -> tuple[float, float]:
    """Return velocity north and east of a speed over ground (m/s) and a course (degrees from north, clockwise)."""
    if speed == 0:
        return 0.0, 0.0
    angle = np.radians(course)
    return float(speed * np.cos(angle)), float(speed * np.sin(angle))


def _date(time: float) -> str:
    """Return the date and time of microseconds since 2000.

    >>> _date(60.5e6)
    '2000-01-01T00:01:00.500000Z'
    """
    moment = EPOCH + timedelta(microseconds=round(time))
    return f"{moment.replace(tzinfo=None).isoformat(timespec='microseconds')}Z"


def write_table(path: Path, sensor: str, table: Table, remarks: Sequence[str], *, dated: bool = False) -> None:
    """Write a table as text, with the remarks in lines of comment above it.

    Times keep three decimals of a microsecond, values the nine digits that a float of 32 bits has. A gap is empty.
    Times since 2000 (``dated``) are written as dates.
    """
    unit = f" ({table.unit})" if table.unit else ""
    lines = [f"# {remark}".replace(",", ";") for remark in remarks]  # a comma would be taken for a record glued to it
    lines.append(",".join(["time_utc" if dated else "timestamp_us", *(f"{name}{unit}" for name in COLUMNS[sensor])]))
    for time, row in zip(table.time, table.value, strict=True):
        cells = ("" if np.isnan(value) else f"{value:.9g}" for value in row)
        lines.append(f"{_date(time) if dated else f'{time:.3f}'},{','.join(cells)}")
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
