"""Failed readings that a logger wrote as a number: every axis of a sensor is exactly 0, or -999, amid other readings.

A bus that does not answer leaves a driver's buffer as it was made, zeros, or reads ones: 65535, which is -1 with a
sign. A program writes -1, -999 or the end of its type. No magnetometer on earth reads zeros; an accelerometer does in
an ideal free fall, a gyroscope at an ideal rest, and these two last. Another number on all axes at once is a reading
where others lie near it or lead to it. It is clipped where single axes stand at it, too, and do not fail with it. On a
single axis only numbers that no part's range ends at tell a failure, and no other reading may come and go like them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from discsim.arrays import BoolArray, FloatArray, runs
from discsim.validation.rows.cleaning import FROZEN_ROWS, FROZEN_TIMES
from discsim.validation.rows.held import step_of
from discsim.validation.rows.readings import Readings

__all__ = ["dead_axis", "failed_at_once", "failed_on_one_axis", "failed_rows", "on_all_axes"]

#: A reading beside is no small one: this share of the usual (median) size, and this many steps of resolution. One of a
#: coarse accelerometer in free fall, a step or two beside zero, is.
SHARE, STEPS = 0.2, 10.0
#: A gyroscope leaps to zero and back: on both sides it reads this many times the most that changes from row to row.
LEAP = 3.0
#: Sound readings on either side that show how much changes from row to row.
BESIDE = 5
#: Runs of a number that no program is known to write for a failure: of readings of a resolution of a hundredth of their
#: span one row in ten thousand has three equal ones by chance, and hardly ever the same ones.
FEWEST = 3
#: A range's end is met on a single axis to within this share: 16 bits end at 32767 and at -32768.
END = 1e-3
#: Numbers of a failed reading on one axis that one row tells where nothing is near: 65535 and nines (-999); and those
#: that `FEWEST` rows tell: -1, and nines with decimals, which a body may read.
SURELY = np.array([65535.0, *(sign * (10.0**digits - 1) for digits in (3, 4, 5, 6) for sign in (-1, 1))])
PERHAPS = np.array(
    [-1.0, *(sign * (10.0**k - 1) / 10**d for k in (2, 3, 4, 5) for d in (0, 1, 2) for sign in (-1, 1) if d or k == 2)]
)
ENDS = np.array([-32768.0, -32767.0, 32767.0])
#: A number of a failed reading is met to within this share: files round it to seven digits.
WRITTEN = 1e-6


def on_all_axes(value: FloatArray) -> FloatArray:
    """Return the number (n,) that a sensor's readings (n, 3) have on all axes, NaN where they differ or are gaps."""
    equal = (value[:, 0] == value[:, 1]) & (value[:, 0] == value[:, 2])
    return np.where(equal, value[:, 0], np.nan)


def failed_rows(sensor: str | None, value: FloatArray) -> BoolArray:
    """Tell which rows (n,) of a sensor's readings as written (n, 3) failed, by its readings alone.

    Of an accelerometer or a gyroscope (or a sensor that is not known) runs of fewer than `FROZEN_ROWS` zeros are told:
    what stands for longer is told by the others (`discsim.validation.rows.cleaning.frozen_runs`).
    """
    failed, common = np.zeros(len(value), dtype=np.bool_), on_all_axes(value)
    if not np.isfinite(common).any():
        return failed
    sound = _sound(value)
    for first, stop in _amid(sensor, value, sound):
        failed[first:stop] = sensor == "magnetometer" or stop - first < FROZEN_ROWS
    for number in np.unique(common[np.isfinite(common) & (common != 0)]):
        found = runs(common == number)
        often = len(found) >= FEWEST or max(stop - first for first, stop in found) >= _stands(value)
        if often or _for_failed(number):
            told = _amid(sensor, value, sound, float(number))
            # at rest -1 is no leap; where most of a number's runs are no readings, none is
            for first, stop in found if 2 * len(told) > len(found) else told:
                failed[first:stop] = True
    return failed


def failed_at_once(readings: Mapping[str, Readings]) -> dict[str, BoolArray]:
    """Return which rows (n,) of each sensor failed, of those in which any did; ``readings``, as written, of one table.

    A run in which an accelerometer and another sensor are zero at once is a failure however long it is, and a gyroscope
    that is zero with a failed accelerometer failed, too. So did a sensor of the same number as another that failed.
    """
    failed = {s: failed_rows(s, found.value) for s, found in readings.items() if found.value.shape[1] == 3}
    common = {s: on_all_axes(readings[s].value) for s in failed}
    zero = {s: common[s] == 0 for s in failed}
    if "accelerometer" in failed:
        accel = readings["accelerometer"]
        others = [readings[s].number[zero[s]] for s in ("gyroscope", "magnetometer") if s in zero]
        at_once = zero["accelerometer"] & np.isin(accel.number, np.concatenate([accel.number[:0], *others]))
        for first, stop in _amid("accelerometer", accel.value, _sound(accel.value)):
            failed["accelerometer"][first:stop] |= at_once[first:stop]
        if "gyroscope" in failed:
            dead = accel.number[failed["accelerometer"]]
            failed["gyroscope"] |= zero["gyroscope"] & np.isin(readings["gyroscope"].number, dead)
    alone = dict(failed)
    for other, rows in alone.items():
        for number in np.unique(common[other][rows & ~zero[other]]):
            dead = readings[other].number[rows & (common[other] == number)]
            for sensor in failed:
                same = (common[sensor] == number) & np.isin(readings[sensor].number, dead)
                failed[sensor] = failed[sensor] | same
    return {sensor: rows for sensor, rows in failed.items() if rows.any()}


def failed_on_one_axis(value: FloatArray) -> BoolArray:
    """Tell which cells (n, 3) of a sensor's readings as written (n, 3) hold a number of a failed reading, axis by axis.

    Rows that failed as a whole are gaps in ``value``. A number counts where no other reading of the axis is near it, or
    in rows in which it leaps there and back as no other reading does: of a body that is knocked readings of any size
    do, and one at rest may read -1.
    """
    failed = np.zeros(value.shape, dtype=np.bool_)
    for axis, column in enumerate(value.T):
        there = np.flatnonzero(np.isfinite(column))
        seen = np.array(column[there])
        # counts that became SI and counts again are whole to within their last digits
        decimals = bool(np.any(np.abs(seen - np.rint(seen)) > WRITTEN * np.abs(seen)))
        codes = np.concatenate([SURELY, ENDS, PERHAPS]) if decimals else np.concatenate([SURELY, PERHAPS])
        codes = np.unique(codes)
        nearest = codes[np.searchsorted(0.5 * (codes[1:] + codes[:-1]), seen)]
        seen = np.where(np.abs(seen - nearest) <= WRITTEN * np.abs(nearest), nearest, seen)
        for code in codes[np.isin(codes, seen)]:
            failed[there[_of_no_reading(seen, float(code), codes)], axis] = True
    return failed


def dead_axis(value: FloatArray) -> int | None:
    """Return the axis of a gyroscope's readings (n, 3) that is 0 in every row while both others change, or None.

    One that lies still changes by its last digit.
    """
    sound = value[np.isfinite(value).all(axis=1)]
    if not len(sound):
        return None
    zero = np.flatnonzero(np.all(sound == 0, axis=0))
    if zero.size != 1:
        return None
    changes = [np.ptp(column) > STEPS * (step_of(column) or 0.0) and np.ptp(column) > 0 for column in sound.T]
    return int(zero[0]) if sum(changes) == 2 else None


def _of_no_reading(seen: FloatArray, code: float, codes: FloatArray) -> BoolArray:
    """Tell which readings (n,) of one axis are a number that stands for none; ``codes``: all that may."""
    sound, same = seen[~np.isin(seen, codes)], np.asarray(seen == code)
    if len(sound) < BESIDE:
        return np.zeros_like(same)
    # a run of the number counts once
    first = ~same | np.concatenate([[True], ~same[:-1]])
    shown, told = seen[first], same[first]
    # beside zeros of one at rest, -1 is the step
    graded = seen if code in PERHAPS else sound
    step = max(step_of(graded) or 0.0, float(np.min(np.diff(np.unique(graded)), initial=np.inf)))
    step = step if np.isfinite(step) else 0.0
    far = np.min(np.abs(sound - code)) > max(SHARE * float(np.median(np.abs(sound))), STEPS * step)
    if far and (code not in PERHAPS or np.count_nonzero(told) >= FEWEST):
        return same
    leaps = _leaps(shown, STEPS * step)
    if 2 * np.count_nonzero(leaps & told) <= np.count_nonzero(leaps) or np.count_nonzero(leaps & told) < FEWEST:
        return np.zeros_like(same)
    return np.asarray(same & (leaps & told)[np.cumsum(first) - 1])


def _leaps(shown: FloatArray, least: float) -> BoolArray:
    """Tell which readings (n,) leap there and back: by more than ``least``, and than `LEAP` times the steps beside."""
    leaps = np.zeros(shown.size, dtype=np.bool_)
    if shown.size > 2:
        steps = np.abs(np.diff(shown))
        largest = sliding_window_view(np.pad(steps, BESIDE), BESIDE).max(axis=1)
        # of reading k, steps k - 1 and k are to and from it; the windows end before the one and begin behind the other
        before, after = largest[: shown.size - 2], largest[BESIDE + 2 : BESIDE + shown.size]
        both = np.minimum(steps[1:], steps[:-1])
        leaps[1:-1] = both > np.maximum(least, LEAP * np.maximum(before, after))
    return leaps


def _for_failed(number: float) -> bool:
    """Tell a number that programs write for no reading and no part's range ends at: -1, 65535 or nines (-999, 99.9)."""
    text = f"{number:.9g}"
    digits = text.replace(".", "").lstrip("-")
    return text in ("-1", "65535") or (len(digits) > 1 and set(digits) == {"9"})


def _stands(value: FloatArray) -> float:
    """Return for how many rows on end a number stands that does not change as a sensor's readings (n, 3) do."""
    changes = np.count_nonzero(np.any(value[1:] != value[:-1], axis=1)) + 1
    return max(FROZEN_ROWS, FROZEN_TIMES * len(value) / changes)


class _Sound(NamedTuple):
    """A sensor's readings (m, 3) whose axes differ; how far from them is far; their largest, and their step."""

    value: FloatArray
    least: float
    largest: float
    step: float


def _sound(value: FloatArray) -> _Sound:
    """Return what of readings (n, 3) are no number on all axes; where all are, those that are not zero."""
    there = value[np.isfinite(value).all(axis=1)]
    apart = np.isnan(on_all_axes(there))
    sound = there[apart if apart.any() else there.any(axis=1)]
    if not len(sound):
        return _Sound(sound, np.inf, np.inf, np.inf)
    step = max(step_of(column) or 0.0 for column in sound.T)
    usual = float(np.median(np.linalg.norm(sound, axis=1)))
    return _Sound(sound, max(SHARE * usual, STEPS * step), float(np.max(np.abs(sound))), step)


def _amid(sensor: str | None, value: FloatArray, sound: _Sound, number: float = 0.0) -> list[tuple[int, int]]:
    """Return the runs of rows that are a number on all axes, beside readings that are far from it.

    Zeros need no more of an accelerometer and a magnetometer. A gyroscope must leap to them and back; to another number
    any sensor must leap, or no reading of the log may be near it. At the end of a range all axes of a gyroscope leap in
    no motion; an impact clips an accelerometer, a hard iron a magnetometer.
    """
    there = np.flatnonzero(np.isfinite(value).all(axis=1))
    size = np.linalg.norm(value[there] - number, axis=1)
    same = size == 0
    at_end = number != 0 and abs(sound.largest / abs(number) - 1) < END
    if not same.any() or not len(sound.value) or (at_end and sensor != "gyroscope"):
        return []
    if number == 0:
        by_size, by_leap = (known := sensor in ("accelerometer", "magnetometer")), not known
    else:
        near = np.min(np.linalg.norm(sound.value - number, axis=1)) <= sound.least
        by_size, by_leap = not (at_end or near), True
    step = sound.step
    if step == 0.0:  # a gyroscope that lies still reads one number and nought, a step apart
        step = max(float(np.min(np.diff(np.unique(column)), initial=np.inf)) for column in value[there].T)
    found = []
    for first, stop in runs(same):
        before, after = np.arange(max(0, first - BESIDE), first), np.arange(stop, min(size.size, stop + BESIDE))
        before, after = before[~same[before]], after[~same[after]]
        beside = np.concatenate([size[before[-1:]], size[after[:1]]])
        far = by_size and beside.size > 0 and bool(np.all(beside > sound.least))
        if by_leap and not far and beside.size == 2:
            changes = [np.linalg.norm(np.diff(value[there[side]], axis=0), axis=1) for side in (before, after)]
            largest = float(np.max(np.concatenate(changes), initial=0.0))
            far = bool(np.all(beside > max(STEPS * step, LEAP * largest)))
        if far:
            found.append((int(there[first]), int(there[stop - 1]) + 1))
    return found
