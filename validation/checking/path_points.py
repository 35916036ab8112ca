"""Points of a path that are none: rows out of reach of the others, and rows that stand while the body flies."""

from __future__ import annotations

import numpy as np

from discsim.arrays import BoolArray, FloatArray, runs
from discsim.validation.checking.statements import FASTEST

__all__ = ["out_of_reach", "rows_in_words", "standing"]

#: beyond so many rows a course is followed across the last of them alone: all pairs would take minutes
_ALL, _LAST = 3000, 300
#: numbers that repeat in all axes for so many rows, and so long (s), are no coincidence: a body that falls from rest
#: is 0.3 m further after a quarter of a second
_STANDS, _STANDS_S = 5, 0.25
#: a slow receiver's fixes each fill several rows of a fast log: what stands is longer than the usual by this factor
_LONGER = 3.0


def rows_in_words(t: FloatArray, chosen: BoolArray) -> str:
    """Return where chosen rows (n,) are, by their times t (n,) s: the first three runs, and how many more there are."""
    found = runs(chosen)
    spans = [f"{t[first]:.3f} s" + f" to {t[after - 1]:.3f} s" * (after - first > 1) for first, after in found[:3]]
    more = f" and {len(found) - 3} times more" * (len(found) > 3)
    return ", ".join(spans) + more


def out_of_reach(t: FloatArray, position: FloatArray, slack: float) -> BoolArray:
    """Tell which rows (n,) are left out of the longest course that no throw is too slow for.

    From one row of a course to its next, t (n,) s and position (n, k) m, lies no more than the fastest throw's speed
    times the time between, and ``slack`` m.
    """
    n = t.size
    length, before = np.ones(n, dtype=np.int64), np.full(n, -1)
    for row in range(1, n):
        start = 0 if n <= _ALL else max(0, row - _LAST)
        apart = np.linalg.norm(position[start:row] - position[row], axis=1)
        near = np.where(apart <= FASTEST * (t[row] - t[start:row]) + slack, length[start:row], 0)
        best = int(near.size - 1 - np.argmax(near[::-1]))  # the latest of those that are as long
        if near[best] > 0:
            length[row], before[row] = near[best] + 1, start + best
    out = np.ones(n, dtype=np.bool_)
    row = int(np.argmax(length)) if n else -1
    while row >= 0:
        out[row] = False
        row = int(before[row])
    return out


def standing(t: FloatArray, position: FloatArray) -> list[tuple[int, int]]:
    """Return the runs of rows in which a position (n, k) repeats to the last digit, longer than any receiver's usual.

    The first row of each and the one after its last; none where nothing moves at all.
    """
    same = np.all(position[1:] == position[:-1], axis=1)
    edges = np.flatnonzero(~np.concatenate([[False], same, [False]]))
    lengths = np.diff(edges)
    fewest = max(_STANDS, _LONGER * float(np.median(lengths))) if lengths.size > 1 else np.inf
    found = [(int(first), int(first + length)) for first, length in zip(edges, lengths, strict=False)]
    return [
        (first, after) for first, after in found if after - first >= fewest and t[after - 1] - t[first] >= _STANDS_S
    ]
