"""When a sensor with a clock of its own took its readings, from the rows of a log at which they first show.

A logger's loop writes what such a sensor read last: a reading is up to a row older than the row at which it first
shows, on which it stands alone (the rows between are empty) or on each row until the next.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray, IntArray
from discsim.validation.rows.held import come_evenly
from discsim.validation.rows.readings import Readings
from discsim.validation.rows.timing import row_timing

__all__ = ["LESS", "STRETCH", "OwnTimes", "between_rows", "in_step", "left_by_turning", "own_times"]

#: share of a reading's lateness that moves the phase of its sensor, times the share of rows that repeat
PHASE_GAIN = 0.1
#: share of readings that one clock must explain; the first row of a reading is lost as often as any row
ONE_CLOCK = 0.97
#: readings over which the clock of a held sensor is taken as even where one clock does not do for all
NEARBY = 21
#: rows over which a sensor that never leaves the logger's count of rows is read by its loop: oscillators of parts agree
#: within 1 to 3 %, and so part by a row in a hundred rows; three times as many for two that happen to agree better
IN_STEP = 300
#: share of the rows of a log on which its fastest sensor stands; where several take turns each has a stamp of its own
EVERY_ROW = 0.95
#: readings that are fitted by one turning at a time (a spin that dies by a third in a second stays in step over them),
#: stretches of them at most, and how finely the turning is sought: steps of a sixteenth of what tells two apart. Beside
#: a step of a quarter the nearest turning leaves up to 6 % of the changes, as much as wrong times do
STRETCH, MOST, FINENESS = 16, 100, 16
#: times of rows are left where even ones leave this share of the changes: at rest, where noise is all that is left,
#: both leave the same within two per cent
LESS = 0.95


class OwnTimes(NamedTuple):
    """A sensor's period, s, the times (n,) of its readings, and whether one even clock explains them all."""

    period: float
    time: FloatArray
    one_clock: bool

    @property
    def even(self) -> str:
        """What its times are, in words."""
        return "the even times of its own clock" if self.one_clock else "times as even as the rows allow"


def between_rows(found: Readings, others: Mapping[str, Readings]) -> tuple[Readings, OwnTimes, float] | None:
    """Return what a magnetometer reads on some rows of a log, when by its own clock, and the rows' spacing, s.

    ``others`` are all sensors of the log. None for one that is as fast as the log, that is read by its loop, or that
    has stamps of its own; where no other sensor stands on all rows; and where it turns no more evenly by its own times.
    """
    found = found.select(~np.all(np.isnan(found.value), axis=1))
    if found.time.size < 2 * STRETCH:
        return None
    first, last = found.number[0], found.number[-1]
    whole = last - first + 1
    if found.time.size == whole:
        return None
    fastest = max((one.select((one.number >= first) & (one.number <= last)) for one in others.values()), key=_rows)
    _, own, its = np.intersect1d(found.number, fastest.number, return_indices=True)
    if _rows(fastest) < EVERY_ROW * whole or own.size < EVERY_ROW * _rows(found):
        return None
    if not np.array_equal(found.time[own], fastest.time[its]):
        return None
    absent = np.ones(whole, dtype=np.bool_)
    absent[found.number - first] = False
    if not come_evenly(absent):
        return None
    row, written = row_timing(fastest.time).interval, np.diff(found.number)
    stands = (whole - 1) / written.size
    if in_step(found.time / row, written, stands) is not None or np.all(written == written[0]):
        return None
    own_clock = own_times(found.time, written.astype(float), stands, row)
    if not _turns_evenly(found, own_clock.time):
        return None
    return Readings(found.number, own_clock.time, found.value), own_clock, row


def _rows(one: Readings) -> int:
    return one.time.size


def _turns_evenly(found: Readings, time: FloatArray) -> bool:
    """Tell whether a sensor's readings turn as even times (n,) s have it, and not as the times of their rows do."""
    if not np.all(np.diff(time) > 0):
        return False
    return left_by_turning(time, found) < LESS * left_by_turning(found.time, found)


def left_by_turning(time: FloatArray, found: Readings) -> float:
    """Return the share of a sensor's changes that steady turnings leave, at some times (n,) s of its readings."""
    count = time.size // STRETCH
    t = time[: count * STRETCH].reshape(count, STRETCH)
    value = found.value[: count * STRETCH].reshape(count, STRETCH, -1)
    whole = np.all(np.isfinite(value), axis=(1, 2))
    t, value = t[whole], value[whole]
    value = value - value.mean(axis=1, keepdims=True)
    size = np.sum(value**2, axis=(1, 2))
    chosen = np.argsort(-size, kind="stable")[:MOST]
    left = sum(_left(t[k] - t[k].mean(), value[k]) for k in chosen)
    return float(left / max(np.sum(size[chosen]), 1e-300))


def _left(t: FloatArray, value: FloatArray) -> float:
    """Return the sum of squares that the best of all turnings leaves of values (n, k) at times t (n,)."""
    steps = np.arange(1, FINENESS * t.size // 2) * 2.0 * np.pi / (FINENESS * (t[-1] - t[0]))
    phase = steps[:, None] * t
    basis, _ = np.linalg.qr(np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)], axis=2))
    held = np.sum(np.einsum("gnb,nk->gbk", basis, value) ** 2, axis=(1, 2))
    return float(np.sum(value**2) - np.max(held))


def in_step(first_shown: FloatArray, written: IntArray, rows_per_reading: float) -> int | None:
    """Return every how many rows a held sensor is read by the logger's own loop; None for one on a clock of its own.

    ``first_shown`` (n,) are the times of the rows at which its readings first show, in rows, ``written`` (n - 1,) the
    rows between. Two oscillators part by a row within `IN_STEP` rows; those of one loop never do. The first reading may
    stand since before the first row.
    """
    every = round(rows_per_reading)
    if every < 2:
        return None
    rows = np.round(np.diff(first_shown))[1:]
    in_step = (rows % every == 0) | (written[1:] % every == 0)
    return every if rows.sum() >= IN_STEP and np.all(in_step) else None


def own_times(first_shown: FloatArray, written: FloatArray, rows_per_reading: float, row: float) -> OwnTimes:
    """Return when a sensor with a clock of its own took its readings.

    ``first_shown`` (n,) s are the times of the rows at which they first show, ``written`` (n - 1,) the rows between.
    A reading was taken within one row before the row at which it first shows. Where one clock lies within these rows, a
    line through the counted readings, half a row earlier, is that clock. Else (the two clocks run apart, readings came
    in bursts) the line is followed over `NEARBY` readings and the times kept within the row before each first row.
    """
    count = _counted(first_shown / row, written, rows_per_reading)
    if first_shown.size < 8:
        return OwnTimes(rows_per_reading * row, first_shown - row / 2, False)
    near = np.ones(count.size, dtype=np.bool_)
    for _ in range(4):
        slope, start = np.polyfit(count[near], first_shown[near] - first_shown[0], 1)
        late = first_shown - first_shown[0] - (start + slope * count)
        # lateness is even from 0 to one row; a tenth of a row is left for the stamps' own rounding
        near = np.abs(late - np.median(late)) <= 0.55 * row
    # where a row was lost, a reading shows a row or more later
    if np.mean(near) >= ONE_CLOCK:
        return OwnTimes(float(slope), np.asarray(first_shown - late - row / 2), True)
    width = min(NEARBY, first_shown.size // 2 * 2 - 1)
    # the first reading may stand since long before the first row, as where a throw is cut out of a log
    padded = np.pad(np.concatenate([late[1:2], late[1:]]), width // 2, mode="reflect", reflect_type="odd")
    smooth = np.convolve(padded, np.ones(width) / width, mode="valid")
    time = first_shown - late + smooth - row / 2
    time[0] = min(time[0], first_shown[0])
    time[1:] = np.clip(time[1:], first_shown[1:] - 0.99 * row, first_shown[1:])
    return OwnTimes(float(np.median(np.diff(time))), time, False)


def _counted(first_shown: FloatArray, written: FloatArray, rows_per_reading: float) -> FloatArray:
    """Return the number (n,) of each reading in its sensor's own count, from the row times of first showing, in rows.

    A reading stands on at most one row more than its period, so the rows between two readings tell the least number of
    readings in them, and where no row was lost this is the number. Else the sensor's phase decides: its period comes
    from the longest stretch without a lost row, its phase is followed with a loop that is slow against the beat of the
    two clocks, over which lateness runs through its row.
    """
    rows = np.diff(first_shown)
    lost = np.maximum(np.round(rows - written), 0.0)
    before = np.concatenate([[0.0], lost[:-1]])
    least = np.maximum(1.0, np.ceil((rows - 1 - lost) / rows_per_reading - 0.05))
    doubtful = lost + before > 0
    most = np.where(doubtful, np.maximum(least, np.floor((rows + 1 + before) / rows_per_reading + 0.05)), least)
    if not np.any(doubtful):
        return np.concatenate([[0.0], np.cumsum(least)])
    edges = np.concatenate([[0], np.flatnonzero(doubtful) + 1, [first_shown.size]])
    longest = int(np.argmax(np.diff(edges)))
    period = rows_per_reading
    first = np.concatenate([[0.0], np.cumsum(least)])
    if edges[longest + 1] - edges[longest] > NEARBY:
        whole = slice(edges[longest], edges[longest + 1])
        period = float(np.polyfit(first[whole], first_shown[whole], 1)[0])
    gain = PHASE_GAIN * (1 - 1 / period)
    numbers = np.zeros(first_shown.size)
    phase = float(np.mean(first_shown[: edges[1]] - period * first[: edges[1]]))
    for k in range(rows.size):
        # a reading that came while rows were lost shows late by half of them, on average
        expected = first_shown[k + 1] - lost[k] / 2
        near = float(np.round((expected - phase) / period))
        step = float(min(max(near, least[k]), most[k]))
        numbers[k + 1] = numbers[k] + step
        phase += step * period
        phase += gain * (expected - phase)
    return numbers
