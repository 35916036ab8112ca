"""Failed readings that a logger wrote as zeros: every axis of a sensor is exactly 0 in some rows amid others.

A bus that does not answer leaves a driver's buffer as it was made. No magnetometer on earth reads that; an
accelerometer does in an ideal free fall, a gyroscope at an ideal rest, and these two last.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from discsim.arrays import BoolArray, FloatArray, runs
from discsim.validation.importing.cleaning import FROZEN_ROWS, Readings
from discsim.validation.importing.held import step_of

__all__ = ["dead_axis", "failed_at_once", "failed_rows"]

#: A reading beside is no small one: this share of the usual (median) size, and this many steps of resolution. One of a
#: coarse accelerometer in free fall, a step or two beside zero, is.
SHARE, STEPS = 0.2, 10.0
#: A gyroscope leaps to zero and back: on both sides it reads this many times the most that changes from row to row.
LEAP = 3.0
#: Sound readings on either side that show how much changes from row to row.
BESIDE = 5


def failed_rows(sensor: str | None, value: FloatArray) -> BoolArray:
    """Tell which rows (n,) of a sensor's readings (n, 3) failed, by its readings alone.

    Of an accelerometer or a gyroscope (or a sensor that is not known) runs of fewer than `FROZEN_ROWS` are told: what
    stands for longer is told by the others (`discsim.validation.importing.cleaning.frozen_runs`).
    """
    failed = np.zeros(len(value), dtype=np.bool_)
    for first, stop in _amid(sensor, value):
        failed[first:stop] = sensor == "magnetometer" or stop - first < FROZEN_ROWS
    return failed


def failed_at_once(readings: Mapping[str, Readings]) -> dict[str, BoolArray]:
    """Return which rows (n,) of each sensor failed, of those in which any did; ``readings`` are of one table.

    A run in which an accelerometer and another sensor are zero at once is a failure however long it is, and a gyroscope
    that is zero with a failed accelerometer failed, too.
    """
    failed = {s: failed_rows(s, found.value) for s, found in readings.items() if found.value.shape[1] == 3}
    zero = {s: np.all(readings[s].value == 0, axis=1) for s in failed}
    if "accelerometer" in failed:
        accel = readings["accelerometer"]
        others = [readings[s].number[zero[s]] for s in ("gyroscope", "magnetometer") if s in zero]
        at_once = zero["accelerometer"] & np.isin(accel.number, np.concatenate([accel.number[:0], *others]))
        for first, stop in _amid("accelerometer", accel.value):
            failed["accelerometer"][first:stop] |= at_once[first:stop]
        if "gyroscope" in failed:
            dead = accel.number[failed["accelerometer"]]
            failed["gyroscope"] |= zero["gyroscope"] & np.isin(readings["gyroscope"].number, dead)
    return {sensor: rows for sensor, rows in failed.items() if rows.any()}


def dead_axis(value: FloatArray) -> int | None:
    """Return the axis of a gyroscope's readings (n, 3) that is 0 in every row while both others change, or None."""
    sound = value[np.isfinite(value).all(axis=1)]
    if not len(sound):
        return None
    zero = np.flatnonzero(np.all(sound == 0, axis=0))
    return int(zero[0]) if zero.size == 1 and np.count_nonzero(np.ptp(sound, axis=0)) == 2 else None


def _amid(sensor: str | None, value: FloatArray) -> list[tuple[int, int]]:
    """Return the runs of rows that are zero on all axes, beside readings that are far from it."""
    there = np.flatnonzero(np.isfinite(value).all(axis=1))
    size = np.linalg.norm(value[there], axis=1)
    zero = size == 0
    if not zero.any() or zero.all():
        return []
    sound = value[there][~zero]
    steps = [step_of(column) or 0.0 for column in sound.T]
    least = max(SHARE * float(np.median(size[~zero])), STEPS * max(steps))
    found = []
    for first, stop in runs(zero):
        before, after = np.arange(max(0, first - BESIDE), first), np.arange(stop, min(size.size, stop + BESIDE))
        before, after = before[~zero[before]], after[~zero[after]]
        beside = np.concatenate([size[before[-1:]], size[after[:1]]])
        far = beside.size > 0 and bool(np.all(beside > least))
        if sensor not in ("accelerometer", "magnetometer"):
            changes = [np.linalg.norm(np.diff(value[there[side]], axis=0), axis=1) for side in (before, after)]
            largest = float(np.max(np.concatenate(changes), initial=0.0))
            far = beside.size == 2 and bool(np.all(beside > max(STEPS * max(steps), LEAP * largest)))
        if far:
            found.append((int(there[first]), int(there[stop - 1]) + 1))
    return found
