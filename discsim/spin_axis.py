"""Which axis a body spins about, by its gyroscope: the one that has most of the rate's square where it spins fast."""

from __future__ import annotations

import numpy as np

from discsim.arrays import BoolArray, FloatArray

__all__ = ["FAST", "ONE_AXIS", "axis_shares", "fast_rows"]

#: A turn a second, rad/s: slower than any throw, faster than a hand turns a thing about one axis for long.
FAST = 2 * np.pi
#: Share of the rate's square on one axis that makes it the spin axis: an axis tilted by 25 degrees still has 0.82.
ONE_AXIS = 0.8
#: Fewest fast rows that tell an axis.
FEWEST = 5


def axis_shares(rate: FloatArray) -> FloatArray | None:
    """Return the share (3,) that each axis has of the square of rates (n, 3) rad/s in the fast rows; None of too few.

    >>> axis_shares(np.tile([3.0, 0.0, 30.0], (9, 1))).round(2).tolist()
    [0.01, 0.0, 0.99]
    """
    fast = fast_rows(rate)
    if np.count_nonzero(fast) < FEWEST:
        return None
    square = np.mean(rate[fast] ** 2, axis=0)
    return np.asarray(square / square.sum())


def fast_rows(rate: FloatArray) -> BoolArray:
    """Return which rows (n,) of (n, 3) rad/s have half the largest rate that is kept for more than a few rows, or more.

    None is slower than `FAST`, and none has a gap: of an axis that was not read no share is known.
    """
    norm = np.linalg.norm(rate, axis=1)
    norm = np.where(np.isfinite(norm), norm, 0.0)
    if norm.size == 0:
        return np.zeros(0, dtype=np.bool_)
    place = -min(norm.size, max(5, norm.size // 200))
    top = np.partition(norm, place)[place]
    return np.asarray((norm >= 0.5 * top) & (norm > FAST))
