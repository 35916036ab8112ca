"""A PX4 flight log (ULog) as tables: units and fields as PX4's message definitions have them."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.logs.tables import Log, Table

__all__ = ["TOPICS", "begins", "read"]

#: The first bytes of a ULog (PX4 guide, "ULog File Format"); the next byte is its version.
MAGIC = b"ULog\x01\x12\x35"
#: What PX4 writes as relative time where the sensor has no reading yet (sensor_combined.msg).
_NO_TIME = 0x7FFFFFFF


class _Source(NamedTuple):
    """Where a topic holds a sensor: fields of x, y, z, ``scale`` to the table's unit.

    ``lag`` is a field with the reading's time after the row's, us; ``over`` one with the span that the values are
    integrals over, us.
    """

    topic: str
    fields: tuple[str, str, str]
    scale: float = 1.0
    lag: str = ""
    over: str = ""


class _Found(NamedTuple):
    """Readings of a topic's instance: stamps (n,) us, values (n, 3)."""

    topic: str
    stamp: FloatArray
    value: FloatArray


def _indexed(name: str) -> tuple[str, str, str]:
    return f"{name}[0]", f"{name}[1]", f"{name}[2]"


_XYZ = ("x", "y", "z")
#: Topics by sensor, as PX4's message definitions have them (rad/s, m/s^2, gauss). Those of one row, gyroscope and
#: accelerometer, are in the same axes: forward, right, down of the body, or of the board in the last row.
_INERTIAL = (
    (
        _Source("sensor_combined", _indexed("gyro_rad")),
        _Source("sensor_combined", _indexed("accelerometer_m_s2"), lag="accelerometer_timestamp_relative"),
    ),
    (
        _Source("vehicle_imu", _indexed("delta_angle"), over="delta_angle_dt"),
        _Source("vehicle_imu", _indexed("delta_velocity"), over="delta_velocity_dt"),
    ),
    (_Source("sensor_gyro", _XYZ), _Source("sensor_accel", _XYZ)),
)
_MAGNETIC = (
    _Source("vehicle_magnetometer", _indexed("magnetometer_ga"), scale=100.0),
    _Source("sensor_combined", _indexed("magnetometer_ga"), scale=100.0, lag="magnetometer_timestamp_relative"),
    _Source("sensor_mag", _XYZ, scale=100.0),
)
TOPICS = sorted({source.topic for source in (*_MAGNETIC, *(one for pair in _INERTIAL for one in pair))})
_UNITS = {"gyroscope": "rad/s", "accelerometer": "m/s^2", "magnetometer": "uT"}


def begins(head: bytes) -> bool:
    """Tell a ULog."""
    return head.startswith(MAGIC)


def read(raw: Path) -> Log:
    """Return the tables of a log; times are since the start of the autopilot.

    Of several topics the one with the most rows is taken, the accelerometer's from where the gyroscope's is. A log that
    breaks off is read up to there.
    """
    from pyulog import ULog

    with raw.open("rb") as stream, contextlib.redirect_stdout(io.StringIO()):  # it prints what it finds damaged
        log = ULog(stream, list(TOPICS))
    tables = {
        sensor: Table(found.stamp, found.value, _UNITS[sensor]) for sensor, found in _chosen(log.data_list).items()
    }
    damaged = bool(log.file_corruption)
    return Log(tables, ("damaged messages in it were left out",) if damaged else (), damaged)


def _chosen(topics: Iterable[Any]) -> dict[str, _Found]:
    """Return the sensors' tables."""
    by_name: dict[str, list[dict[str, Any]]] = {}
    for topic in topics:
        by_name.setdefault(topic.name, []).append(topic.data)
    gyro = _longest(by_name, [pair[0] for pair in _INERTIAL])
    beside = [pair[1] for pair in _INERTIAL if gyro is not None and pair[0].topic == gyro.topic]
    accel = _longest(by_name, beside) or _longest(by_name, [pair[1] for pair in _INERTIAL])
    found = {"gyroscope": gyro, "accelerometer": accel, "magnetometer": _longest(by_name, _MAGNETIC)}
    return {sensor: table for sensor, table in found.items() if table is not None}


def _longest(by_name: dict[str, list[dict[str, Any]]], sources: Iterable[_Source]) -> _Found | None:
    """Return the table with the most rows, of several the first; None where none has a row."""
    tables = [_table(source, data) for source in sources for data in by_name.get(source.topic, [])]
    return max((table for table in tables if table is not None), key=lambda table: table.stamp.size, default=None)


def _table(source: _Source, data: dict[str, Any]) -> _Found | None:
    """Return the readings of one instance of a topic; None where fields are missing or no row is sound."""
    needed = {"timestamp", *source.fields, *filter(None, (source.lag, source.over))}
    if not needed <= set(data):
        return None
    stamp = np.asarray(data["timestamp"], dtype=float)
    sampled = np.asarray(data.get("timestamp_sample", stamp), dtype=float)  # when it was read; 0 where that is unknown
    stamp = np.where(sampled > 0, sampled, stamp)
    value = source.scale * np.column_stack([np.asarray(data[name], dtype=float) for name in source.fields])
    sound = stamp > 0
    if source.lag:
        lag = np.asarray(data[source.lag], dtype=float)
        sound &= lag != _NO_TIME
        stamp = stamp + lag
    if source.over:
        over = np.asarray(data[source.over], dtype=float)
        sound &= over > 0
        value = value / np.where(over > 0, over * 1e-6, np.nan)[:, None]
        stamp = stamp - over / 2  # the mean over a span is the reading of its middle
    return _Found(source.topic, stamp[sound], value[sound]) if sound.any() else None
