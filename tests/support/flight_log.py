"""Made flight logs: one motion as a PX4 autopilot writes it, a ULog."""

from __future__ import annotations

import struct

import numpy as np

from support.made_logs import Log

BOOT = 3_000_000  # us from the autopilot's start to the log's
LATE = 0.1503  # s by which the magnetometer's first reading comes after the gyroscope's

Rows = list[tuple[int, bytes]]


def message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def ulog(topics: dict[str, tuple[str, Rows]]) -> bytes:
    """Return the bytes of a ULog: per topic its fields, and rows of a stamp and packed fields."""
    text = [b"ULog\x01\x12\x35\x01", struct.pack("<Q", BOOT), message("B", bytes(40))]
    text += [message("F", f"{name}:uint64_t timestamp;{fields}".encode()) for name, (fields, _) in topics.items()]
    text += [message("A", struct.pack("<BH", 0, k) + name.encode()) for k, name in enumerate(topics)]
    rows = [(stamp, k, packed) for k, (_, rows) in enumerate(topics.values()) for stamp, packed in rows]
    text += [message("D", struct.pack("<HQ", k, stamp) + packed) for stamp, k, packed in sorted(rows)]
    return b"".join(text)


def stamps(t: np.ndarray) -> list[int]:
    return [BOOT + round(1e6 * time) for time in t]


def combined(log: Log, lag: int = -700) -> tuple[str, Rows]:
    """Return sensor_combined: the accelerometer is read ``-lag`` us before the gyroscope; it has none in row 0."""
    t, fields = log.t, "float[3] gyro_rad;int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;"
    accel = np.column_stack([np.interp(t + 1e-6 * lag, t, log.accel[:, k]) for k in range(3)])
    lags = [0x7FFFFFFF, *[lag] * (t.size - 1)]
    values = zip(log.gyro, lags, accel, strict=True)
    return fields, list(zip(stamps(t), [struct.pack("<3fi3f", *w, d, *a) for w, d, a in values], strict=True))


def integrals(log: Log) -> tuple[str, Rows]:
    """Return vehicle_imu: what the gyroscope and accelerometer have gathered since the reading before."""
    fields = "uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
    fields += "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;"
    step = np.diff(log.t)[:, None]
    angle, velocity = (0.5 * (v[1:] + v[:-1]) * step for v in (log.gyro, log.accel))
    read = stamps(log.t)[1:]
    packed = [struct.pack("<Q6fII", s, *a, *v, 5000, 5000) for s, a, v in zip(read, angle, velocity, strict=True)]
    return fields, [(s + 350, row) for s, row in zip(read, packed, strict=True)]  # published after it was read


def magnetometer(log: Log) -> tuple[str, Rows]:
    """Return vehicle_magnetometer at 50 Hz, gauss, published 2 ms after it was read.

    There are no more rows than the log has, whose clock may jump by days.
    """
    t = LATE + 0.02 * np.arange(int(min(np.ceil((log.t[-1] - LATE) / 0.02), log.t.size)))
    field = np.column_stack([np.interp(t, log.t, log.mag[:, k]) for k in range(3)]) / 100
    rows = [struct.pack("<Q3f", s, *b) for s, b in zip(stamps(t), field, strict=True)]
    return "uint64_t timestamp_sample;float[3] magnetometer_ga;", [
        (s + 2000, row) for s, row in zip(stamps(t), rows, strict=True)
    ]


def battery(log: Log) -> tuple[str, Rows]:
    return "float voltage_v;", [(s, struct.pack("<f", 11.1)) for s in stamps(log.t[::20])]


def flight(log: Log) -> dict[str, tuple[str, Rows]]:
    return {"battery_status": battery(log), "sensor_combined": combined(log), "vehicle_magnetometer": magnetometer(log)}
