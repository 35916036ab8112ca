"""Tracks that run on after the touch-down, or begin with points that stand still: what of them is a flight.

Takes a track; gives its flight and how much was cut. A disc in the air loses a third of its speed in a second at
most; one that touches down loses it within a few frames, and one that was not yet thrown has none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import FloatArray, scatter_of
from discsim.recording import Samples

__all__ = ["TrackCut", "flight_of"]

#: share of the speed of the half second beside it below which a track's end, or beginning, is no flight: the drag of a
#: driver (C_D of 0.3 at 20 m/s, 0.18 kg) takes 30 % of the speed in a second, 10 % between the middles of the two
_SLOW, _BESIDE_S = 0.85, 0.5
#: a speed is that of a line through so many rows, s or rows, whichever is longer
_WINDOW_S, _FEWEST = 0.1, 4
#: what is cut must last this long, s: a slip of one click does not
_LEAST_S = 0.06
#: a speed counts as slow where it is so by this many of its standard deviations: with the share above, 4 of them by
#: chance at the end of a track whose points scatter by 0.1 m
_SURE = 2.5


@dataclass(frozen=True)
class TrackCut:
    """The flight in a track, and the time (s) cut off before and after it."""

    flight: Samples
    before: float
    after: float


def flight_of(track: Samples, noise: float | None = None) -> TrackCut:
    """Return the part of a track (n, 3) m in which the disc flies; noise is that of one coordinate, m, where stated.

    Speeds are those in plan. Where noise hides them nothing is cut.
    """
    seen = np.flatnonzero(np.isfinite(track.value[:, :2]).all(axis=1))
    if seen.size < 4 * _FEWEST:
        return TrackCut(track, 0.0, 0.0)
    t, plan = track.t[seen], track.value[seen, :2]
    level = max(noise or 0.0, scatter_of(plan))
    last = _flying(t, plan, level)
    first = t.size - 1 - _flying(-t[::-1], plan[::-1], level)
    if last <= first:
        return TrackCut(track, 0.0, 0.0)
    before = float(t[first] - t[0]) if t[first] - t[0] >= _LEAST_S else 0.0
    after = float(t[-1] - t[last]) if t[-1] - t[last] >= _LEAST_S else 0.0
    if not before and not after:
        return TrackCut(track, 0.0, 0.0)
    flight = track.between(t[first] if before else -np.inf, t[last] if after else np.inf)
    return TrackCut(flight, before, after)


def _flying(t: FloatArray, plan: FloatArray, noise: float) -> int:
    """Return the last row of a track's flight: behind it, to the end, the plan's speed is that of no flying disc."""
    width = max(_FEWEST, round(_WINDOW_S / float(np.median(np.diff(t)))) + 1)
    speed, sd = _speeds(t, plan, width, noise)
    last = t[width - 1 :]  # a window is told by its last row
    fastest = np.maximum.accumulate(speed[::-1])[::-1] + _SURE * sd
    for k in range(speed.size):
        before = speed[(last >= last[k] - _BESIDE_S - _WINDOW_S) & (last < last[k] - _WINDOW_S)]
        usual = float(np.median(before)) if before.size >= _FEWEST else 0.0
        if fastest[k] < _SLOW * usual and _SURE * sd < 0.5 * usual:
            return k  # the first row of the first slow window, where the disc came down
    return t.size - 1


def _speeds(t: FloatArray, plan: FloatArray, width: int, noise: float) -> tuple[FloatArray, float]:
    """Return the speeds of lines through so many rows each, (n - width + 1,) m/s, and their standard deviation."""
    rows = np.arange(t.size - width + 1)[:, None] + np.arange(width)
    dt = t[rows] - t[rows].mean(axis=1, keepdims=True)
    square = np.sum(dt**2, axis=1)
    velocity = np.einsum("nw,nwk->nk", dt, plan[rows]) / square[:, None]
    return np.linalg.norm(velocity, axis=1), noise / float(np.sqrt(np.median(square)))
