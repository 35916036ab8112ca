"""A log to try the commands on: simulated throws as a stranger's logger would write them, with names of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Effect
from discsim.files import write_text
from discsim.motion import Motion
from discsim.recording import Recording
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_site
from discsim.trajectory import predict
from discsim.validation.scenarios.throws import Throw

__all__ = ["SEED", "write_example_log"]

G0 = 9.80665
RATE = 200  # rows a second; the magnetometer gives a new reading every second row
REST, SWING, FLIGHT = 2.0, 0.1, 3.0  # s: lying in the hand, the hand's spin-up before the release, and in the air
SEED = 7
SITE = "seoul"  # whose field there is
STARTED = 48_210  # ms on the logger's clock when the log begins
NAMES = "ms,AccX [g],AccY [g],AccZ [g],GyrX [dps],GyrY [dps],GyrZ [dps],MagX,MagY,MagZ"
_SENSORS = ("accelerometer", "gyroscope", "magnetometer")
_UP = np.array([1.0, -1.0, -1.0])  # the board was glued in with its z axis up


def write_example_log(
    path: Path, throws: int = 1, spin_deg_s: float = 4200.0, effects: Sequence[Effect] = (), seed: int = SEED
) -> list[float]:
    """Write the log and return the true spin rate, deg/s, in the middle of each flight.

    A driver is thrown with an MPU-9250 on board, whose gyroscope stops at 2000 deg/s; throws go to headings all round.
    The board's z points up, times are milliseconds since it was switched on, the magnetometer's columns state no unit
    and hold a reading for two rows. ``effects`` of the catalogue are in all of it.
    """
    disc, air = load_disc("driver")
    environment = replace(air, magnetic_field=load_site(SITE).environment.magnetic_field)
    tables, rates, started = [], [], float(STARTED)
    for number in range(throws):
        release = Throw(24.0, 360.0 * number / throws, spin_deg_s).release
        motion = predict(disc, environment, release, tuple(effects), duration=FLIGHT).motion()
        parts = Instruments.from_parts("mpu9250").with_effects(tuple(effects))
        stream = np.random.default_rng(seed + 2 * number)
        flight = record(motion, parts, stream, plant="flight", name="flight", disc=disc)
        table = _rows(motion, flight, np.random.default_rng(seed + 2 * number + 1))
        table[:, 0] = np.round(table[:, 0]) + started
        started = table[-1, 0] + 1000 / RATE
        tables.append(table)
        middle = np.argmin(np.abs(motion.t - motion.end / 2))
        rates.append(float(np.degrees(motion.rate[middle, 2])))
    formats = ["%d", *["%.4f"] * 3, *["%.2f"] * 3, *["%.1f"] * 3]
    lines = (",".join(form % cell for form, cell in zip(formats, row, strict=True)) for row in np.vstack(tables))
    write_text(path, "\n".join([NAMES, *lines, ""]))
    return rates


def _rows(motion: Motion, flight: Recording, rng: np.random.Generator) -> FloatArray:
    """Return the rows of one throw, from rest to the end of the flight: ms from its start, g, deg/s, uT."""
    t = np.arange(-REST, float(flight.end), 1 / RATE)
    columns = {sensor: _readings(sensor, flight, t, rng) for sensor in _SENSORS}
    held = columns["magnetometer"]
    held[1::2] = held[:-1:2][: len(held[1::2])]
    return np.column_stack(
        [
            1000 * (t + REST),
            _UP * columns["accelerometer"] / G0,
            np.degrees(_UP * columns["gyroscope"]),
            _UP * held,
        ]
    )


def _readings(sensor: str, flight: Recording, t: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return what a sensor reads at times t (n,) s from the release, (n, 3): at rest, in the swing, in flight."""
    samples = flight.samples[sensor]
    value = np.empty((t.size, 3))
    flying, rest = t >= 0, t < -SWING
    swing = ~rest & ~flying
    value[flying] = samples.value[np.clip(np.searchsorted(samples.t, t[flying] + 1e-9, side="right") - 1, 0, None)]
    still = {"accelerometer": [0.0, 0.0, -G0], "gyroscope": [0.0] * 3, "magnetometer": samples.value[0]}[sensor]
    value[~flying] = still
    if sensor == "magnetometer":
        angle = np.cumsum(np.where(swing, (t + SWING) / SWING, 0.0))[~flying] * 73.0 / RATE
        turn = angle - angle[-1]
        x, y, _ = samples.value[0]
        value[~flying, 0] = x * np.cos(turn) + y * np.sin(turn)
        value[~flying, 1] = y * np.cos(turn) - x * np.sin(turn)
    else:  # spun up evenly: rates grow with time, the pull to the centre with its square
        ramp = ((t + SWING) / SWING)[swing][:, None]
        if sensor == "gyroscope":
            value[swing] = still + samples.value[0] * [0.0, 0.0, 1.0] * ramp
        else:
            value[swing] = still + samples.value[0] * [1.0, 1.0, 0.0] * ramp**2
    noise = {"accelerometer": 0.03, "gyroscope": 0.002, "magnetometer": 0.6}[sensor]
    value[~flying] += noise * rng.standard_normal((int((~flying).sum()), 3))
    return value
