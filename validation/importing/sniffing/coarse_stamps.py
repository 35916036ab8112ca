"""Time stamps coarser than the rows: whole seconds, or minutes. Takes stamps; gives the rows written in a second.

Such a column is no time of a row. Where it goes on it counts the rows, and so states their mean spacing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray

__all__ = ["Counted", "counted_rows"]

#: Fewest whole seconds (or minutes) between two changes of the stamp: of one, nothing tells whether rows are missing.
FEWEST = 2
#: Least rows in a second: two have stamps that are a clock's.
LEAST_ROWS = 5
#: A second with a share of rows as far as this off the usual one's holds a pause, and is not counted.
USUAL = 0.25


class Counted(NamedTuple):
    """Rows per second, the share that this may be off by (one sigma), and over how many seconds they were counted."""

    rate: float
    off: float
    span: float


def counted_rows(stamps: FloatArray) -> Counted | None:
    """Return the rows per second between changes of ``stamps``, (n,) s that ascend; None where they tell none.

    Rows that repeat the stamp before may be left out, as NaN. The first and the last second are cut off by the log. A
    change lies between two rows: the count of a stretch is sure to a row, which has a standard deviation of 1/sqrt(6)
    where both its ends are anywhere within one.
    """
    known = np.flatnonzero(np.isfinite(stamps))
    steps = np.diff(stamps[known])
    changes = np.flatnonzero(steps > 0)
    if changes.size < FEWEST + 1 or np.any(steps < 0):
        return None
    # a stamp that has just changed is true to a row
    new = known[changes + 1]
    rows, spans = np.diff(new).astype(np.float64), np.diff(stamps[new])
    each = rows / spans
    usual = np.abs(each / np.median(each) - 1) <= USUAL
    rows, spans = rows[usual], spans[usual]
    if rows.size < FEWEST or np.min(rows) < LEAST_ROWS:
        return None
    total, span = float(np.sum(rows)), float(np.sum(spans))
    scatter = float(np.std(rows / spans * span / total)) / np.sqrt(rows.size)
    return Counted(total / span, float(np.hypot(scatter, 1 / np.sqrt(6.0) / total)), span)
