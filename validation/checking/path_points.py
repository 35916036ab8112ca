"""Points of a path that are none: rows out of reach of the others, and rows that stand while the body flies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.validation.checking.statements import FASTEST

__all__ = ["Run", "out_of_reach", "rows_in_words", "runs_of", "scatter_of", "standing"]

#: beyond so many rows a course is followed across the last of them alone: all pairs would take minutes
_ALL, _LAST = 3000, 300
#: numbers that repeat in all axes for so many rows, and so long (s), are no coincidence: a body that falls from rest
#: is 0.3 m further after a quarter of a second
_STANDS, _STANDS_S = 5, 0.25
#: a slow receiver's fixes each fill several rows of a fast log: what stands is longer than the usual by this factor
_LONGER = 3.0


class Run(NamedTuple):
    """Rows from ``first`` to ``last``, both among them."""

    first: int
    last: int

    @property
    def rows(self) -> int:
        """How many rows."""
        return self.last - self.first + 1


def runs_of(chosen: BoolArray) -> list[Run]:
    """Return the runs of rows on end that are chosen (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(np.int8)))
    return [Run(int(first), int(after) - 1) for first, after in zip(edges[::2], edges[1::2], strict=True)]


def rows_in_words(t: FloatArray, runs: list[Run]) -> str:
    """Return where runs of rows are, by their times t (n,) s: the first three, and how many more there are."""
    spans = [f"{t[run.first]:.3f} s" + f" to {t[run.last]:.3f} s" * (run.rows > 1) for run in runs[:3]]
    more = f" and {len(runs) - 3} times more" * (len(runs) > 3)
    return ", ".join(spans) + more


def scatter_of(position: FloatArray) -> float:
    """Return the scatter of single points (n, k) m by third differences, robustly; 0 of fewer than four.

    Third differences of white noise have 20 times its variance.
    """
    third = np.diff(position, 3, axis=0)
    return float(np.median(np.abs(third)) / 0.6745 / np.sqrt(20.0)) if third.size else 0.0


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


def standing(t: FloatArray, position: FloatArray) -> list[Run]:
    """Return the runs of rows in which a position (n, k) repeats to the last digit, longer than any receiver's usual.

    Empty where nothing moves at all.
    """
    same = np.all(position[1:] == position[:-1], axis=1)
    edges = np.flatnonzero(~np.concatenate([[False], same, [False]]))
    lengths = np.diff(edges)
    fewest = max(_STANDS, _LONGER * float(np.median(lengths))) if lengths.size > 1 else np.inf
    found = [Run(int(first), int(first + length) - 1) for first, length in zip(edges, lengths, strict=False)]
    return [run for run in found if run.rows >= fewest and t[run.last] - t[run.first] >= _STANDS_S]
