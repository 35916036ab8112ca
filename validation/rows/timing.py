"""Late and lost rows, told from the time stamps of one sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import FloatArray, sd_by_median
from discsim.rounded_stamps import last_decimal

__all__ = ["RowTiming", "row_timing"]

#: a row is late where its step differs from the usual one by more than this share (beyond the stamps' own rounding):
#: stamps in whole milliseconds at 250 Hz are 0.25 of a step apart, which the rounding covers
LATE = 0.2
#: rows are missing where a step is at least this many usual ones and the next does not make up for it
MISSING = 1.5
#: a row is written twice where its step is below this share of the usual one
TWICE = 0.1
#: stamps rounded to more than this share of a step: their mean step is taken, for the median would be off by a per cent
ROUNDED = 0.01
#: stamps coarser than this share of a step: the usual step may be the rounding's (a row each 1.18 ms in whole ms)
COARSE = 0.3
#: rows that come evenly, in stamps so coarse, stay this near to a straight line (in units of the last decimal) over so
#: many steps that the rounding made longer, by the median of so many pieces: 0.5 where they are even to the last, 0.9
#: to 1.7 where they come late by up to half a unit; rows that were lost at random part from it by 2.3 and more
NEAR, LONGER, PIECES = 1.9, 16, 5
#: steps that agree within this are written by a rule, and no clock's: nothing is told from them
EXACT = 1e-6


@dataclass(frozen=True)
class RowTiming:
    """What the stamps of a sensor tell.

    Attributes
    ----------
    interval : float
        Time between rows where none is late or missing, s (NaN for a single row).
    late : int
        Rows whose stamp is off the even spacing while none is missing.
    lost : int
        Rows that are missing, by steps of two or more intervals.
    breaks : int
        Places where rows are missing.
    longest : float
        The longest step, s.
    twice : int
        Rows that follow the one before at once, as if it were written twice.
    exact : bool
        Whether the stamps are even to the last digit, apart from missing rows: then they show no late row, for they
        were made by a rule and not by a clock.
    """

    interval: float
    late: int
    lost: int
    breaks: int
    longest: float
    twice: int
    exact: bool


def row_timing(t: FloatArray) -> RowTiming:
    """Return what ascending stamps (n,) s tell of late and lost rows."""
    if t.size < 3:
        nan = float("nan")
        return RowTiming(float(t[1] - t[0]) if t.size == 2 else nan, 0, 0, 0, nan, 0, True)
    steps = np.diff(t)
    usual = float(np.median(steps))
    # stamps rounded to a third of a step or more tell no lateness of that size; a missing row they still do
    unit = last_decimal(t)
    rounding = min(unit / usual, COARSE)
    even = _even_step(t, unit) if rounding == COARSE else None
    if even is not None:
        usual, rounding = even, unit / even
    elif rounding > ROUNDED:  # the median is one of the rounded steps, and off by as much
        usual = float(np.mean(steps[np.abs(steps / usual - 1) < LATE + rounding]))
    ratio = steps / usual
    uneven = np.abs(ratio - 1) > LATE + rounding
    # a late row makes one step long and the next as much too short
    after = np.append(ratio[1:], 1.0)
    late_row = (ratio >= MISSING) & (np.abs(ratio + after - 2) <= LATE + rounding)
    # in a log whose every step is uneven, a long step is one of them; six of its scatter are not
    scatter = float(sd_by_median(ratio - np.median(ratio)))
    missing = (ratio >= max(MISSING, 1 + 6 * scatter, 1 + 1.05 * rounding)) & ~late_row
    twice = int(np.count_nonzero(ratio < TWICE)) if 1 - 6 * scatter > TWICE else 0
    lost = int(np.sum(np.round(ratio[missing]) - 1))
    made_up = np.append(False, late_row[:-1])
    late = int(np.count_nonzero(uneven & ~missing & ~made_up))
    exact = bool(np.all(np.abs(ratio - np.round(ratio)) < EXACT * np.maximum(1.0, np.abs(t[1:]) / usual * 1e-3)))
    return RowTiming(usual, late, lost, int(np.count_nonzero(missing)), float(np.max(steps)), twice, exact)


def _even_step(t: FloatArray, unit: float) -> float | None:
    """Return the even step, s, of stamps (n,) rounded to a ``unit`` (s) of about a step; None where they are not even.

    Most of their steps are one unit of the rounding, some two. Rows that were lost at random are none of such a rule.
    """
    steps = np.round(np.diff(t) / unit)
    longer = int(np.count_nonzero(steps > np.median(steps)))
    if longer < LONGER:
        return None
    size = int(np.ceil(t.size * LONGER / longer))
    pieces = [t[start : start + size] for start in range(0, t.size - size + 1, size)]
    row = np.arange(size)
    lines = [np.polynomial.polynomial.polyfit(row, piece, 1) for piece in pieces]
    off = [np.max(np.abs(piece - line[0] - line[1] * row)) for piece, line in zip(pieces, lines, strict=True)]
    if len(off) < PIECES or np.median(off) > NEAR * unit:
        return None
    return float(np.median([line[1] for line in lines]))
