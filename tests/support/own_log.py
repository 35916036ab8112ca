"""The log of docs/your-own-log.md: a simulated throw as a stranger's logger would write it, with names of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict

__all__ = ["write_own_log"]

G0 = 9.80665
RATE = 200  # rows a second; the magnetometer gives a new reading every second row
REST, SWING = 2.0, 0.1  # s before the release: lying in the hand, and the hand's spin-up
SEED = 7


def write_own_log(path: Path) -> float:
    """Write the log and return the true spin rate, deg/s, in the middle of the flight.

    A driver is thrown with an MPU-9250 on board, whose gyroscope stops at 2000 deg/s. The board's z points up, times
    are milliseconds since it was switched on, the magnetometer's columns state no unit and hold a reading for two rows.
    """
    disc, environment = load_disc("driver")
    motion = predict(disc, environment, load_throw("driver"), duration=3.0).motion()
    parts = Instruments.from_parts("mpu9250")
    flight = record(motion, parts, np.random.default_rng(SEED), plant="flight", name="flight", disc=disc)
    t = np.arange(-REST, float(flight.end), 1 / RATE)
    columns = {sensor: np.empty((t.size, 3)) for sensor in ("accelerometer", "gyroscope", "magnetometer")}
    flying, rest = t >= 0, t < -SWING
    rng = np.random.default_rng(SEED + 1)
    for sensor, value in columns.items():
        samples = flight.samples[sensor]
        row = np.clip(np.searchsorted(samples.t, t[flying] + 1e-9, side="right") - 1, 0, None)
        value[flying] = samples.value[row]
        first = samples.value[0] * [0.0, 0.0, 1.0] if sensor != "magnetometer" else samples.value[0]
        still = {"accelerometer": [0.0, 0.0, -G0], "gyroscope": [0.0, 0.0, 0.0], "magnetometer": samples.value[0]}[
            sensor
        ]
        value[~flying] = still
        if sensor != "magnetometer":  # spun up evenly: rates grow with time, the pull to the centre with its square
            ramp = ((t + SWING) / SWING)[~rest & ~flying][:, None]
            pull = samples.value[0] * [1.0, 1.0, 0.0]
            value[~rest & ~flying] = still + (first * ramp if sensor == "gyroscope" else pull * ramp**2)
        else:
            angle = np.cumsum(np.where(~rest & ~flying, (t + SWING) / SWING, 0.0))[~flying] * 73.0 / RATE
            turn = angle - angle[-1]
            x, y, _ = samples.value[0]
            value[~flying, 0] = x * np.cos(turn) + y * np.sin(turn)
            value[~flying, 1] = y * np.cos(turn) - x * np.sin(turn)
        noise = {"accelerometer": 0.03, "gyroscope": 0.002, "magnetometer": 0.6}[sensor]
        value[~flying] += noise * rng.standard_normal((int((~flying).sum()), 3))
    held = columns["magnetometer"]
    held[1::2] = held[:-1:2][: len(held[1::2])]
    up = np.array([1.0, -1.0, -1.0])
    table = np.column_stack(
        [
            np.round(1000 * (t + REST)) + 48_210,
            up * columns["accelerometer"] / G0,
            np.degrees(up * columns["gyroscope"]),
            up * held,
        ]
    )
    names = "ms,AccX [g],AccY [g],AccZ [g],GyrX [dps],GyrY [dps],GyrZ [dps],MagX,MagY,MagZ"
    formats = ["%d", *["%.4f"] * 3, *["%.2f"] * 3, *["%.1f"] * 3]
    np.savetxt(path, table, fmt=formats, delimiter=",", header=names, comments="")
    middle = np.argmin(np.abs(motion.t - flight.end / 2))
    return float(np.degrees(motion.rate[middle, 2]))
