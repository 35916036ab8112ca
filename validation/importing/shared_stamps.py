"""Rows that share a time stamp, as those of a logger whose clock is coarser than its rows.

At 200 rows a second stamps of hundredths stand on two rows each. Takes stamps; gives a time for each row: what logs
motion does so at even times, but for rows that come late or are lost, and a straight line through the stamps of many
rows is known to a small part of their step.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import BoolArray, FloatArray, IntArray

__all__ = ["evened", "repeats"]

#: a straight line serves where no stamp is further from it than this many of their steps: those of even rows lie within
#: half of one, and what is more shows a pause within a tenth of it (0.3 ms rms at 10 ms; with 1 step 2 ms)
WITHIN = 0.6
#: fewest rows of a line: of fewer nothing tells that they are even, and they share out the step between stamps
FEWEST = 12


def repeats(time: FloatArray) -> BoolArray:
    """Return which rows (n,) of stamps (n,) stand at the stamp of the row before."""
    return np.asarray(np.diff(time, prepend=np.nan) == 0.0)


def evened(time: FloatArray) -> FloatArray:
    """Return times (n,) s of rows by stamps (n,) that several of them share, NaN where a row has none.

    Rows are even as long as a line serves: where rows were lost, or the clock was set, another begins. Of stamps that
    are cut off, not rounded, half a step is lost to all rows alike.

    >>> evened(np.floor(np.arange(100) / 2.5))[50:54].round(2).tolist()
    [19.6, 20.0, 20.4, 20.8]
    """
    known = np.flatnonzero(np.isfinite(time))
    stamps = time[known]
    steps = np.diff(stamps)
    if not np.any(steps > 0):
        return time
    step = float(np.median(steps[steps > 0]))
    found = _shared_out(stamps, step)
    # a line ends where rows are lost, and where the clock goes back or leaps
    ends = np.flatnonzero((steps < 0) | (steps > 1.5 * step)) + 1
    for part in np.split(np.arange(stamps.size), ends):
        _along_lines(stamps, part, step, found)
    result = np.full(time.size, np.nan)
    result[known] = found
    return result


def _shared_out(stamps: FloatArray, step: float) -> FloatArray:
    """Return stamps (n,) whose rows take even shares of the step, before and after what they share."""
    first = np.flatnonzero(~repeats(stamps))
    count = np.diff(first, append=stamps.size)
    place = np.arange(stamps.size) - np.repeat(first, count)
    return np.asarray(stamps + step * ((place + 0.5) / np.repeat(count, count) - 0.5))


def _along_lines(stamps: FloatArray, rows: IntArray, step: float, found: FloatArray) -> None:
    """Put rows (k,) onto a line through their stamps, or onto several where one does not serve, into ``found`` (n,)."""
    if rows.size < FEWEST:
        return
    place = rows - rows[0]
    slope, _ = np.polyfit(place, stamps[rows], 1)
    apart = stamps[rows] - slope * place
    middle = 0.5 * (np.max(apart) + np.min(apart))
    if np.ptp(apart) <= 2.0 * WITHIN * step:
        found[rows] = slope * place + middle
        return
    # the line leaves the stamps most where it should have ended
    cut = int(np.clip(np.argmax(np.abs(apart - np.mean(apart))), FEWEST // 2, rows.size - FEWEST // 2))
    _along_lines(stamps, rows[:cut], step, found)
    _along_lines(stamps, rows[cut:], step, found)
