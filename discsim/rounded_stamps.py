"""Time stamps that a logger has rounded, of rows that come evenly: the times themselves.

A clock of milliseconds rounds 400 rows a second to steps of 2 and 3 ms. A disc at 55 rad/s turns by 1.6 % of a radian
in the 0.29 ms rms that this leaves: 0.8 uT of a field of 50, more than a sensor's noise. Takes stamps; gives times.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray

__all__ = ["evened", "last_decimal", "unit_of"]

#: stamps that are rounded to less than this share of a step are left as they are
COARSE = 0.02
#: a straight line serves where all stamps lie within so many units of one another beside it: rows that are even to the
#: last lie within one, and by a tenth of a unit rms late (less than the rounding's 0.29) within this
WITHIN = 1.6
#: fewest rows of a line, which knows its ends to 0.1 of a unit; fewer keep their stamps
FEWEST = 24
#: rows over which a usual step is taken: the rounding is a thirtieth of it
_SPAN = 32


def last_decimal(t: FloatArray) -> float:
    """Return the last decimal place to which stamps, or steps between them, (n,) s are written, from 1 s to 1 ns."""
    return next((10.0**-d for d in range(9) if np.all(np.abs(t - np.round(t, d)) < 1e-10)), 1e-9)


def unit_of(t: FloatArray) -> float:
    """Return the decimal place, s, of which all steps between stamps (n,) s are whole multiples."""
    return last_decimal(np.diff(t))


def evened(t: FloatArray) -> FloatArray:
    """Return the times (n,) s of ascending stamps (n,) s that are rounded; the stamps where rows are not even.

    Rows on either side of lost ones have lines of their own. Of stamps that are cut off, not rounded, half a unit is
    lost to all rows alike.

    >>> evened(np.round(np.arange(100) / 400.0, 3))[50:53].round(5).tolist()
    [0.125, 0.1275, 0.13]
    """
    if t.size < FEWEST:
        return t
    unit, span = unit_of(t), min(_SPAN, t.size - 1)
    step = float(np.median(t[span:] - t[:-span])) / span
    if unit < COARSE * step:
        return t
    found = t.copy()
    # the rounding makes a step longer by a unit at most, and one over a lost row shorter
    for rows in np.split(np.arange(t.size), np.flatnonzero(np.diff(t) > max(1.5 * step, step + 1.01 * unit)) + 1):
        if rows.size < FEWEST:
            continue
        place = rows - rows[0]
        slope, start = np.polyfit(place, t[rows], 1)
        off = t[rows] - start - slope * place
        if np.ptp(off) > WITHIN * unit:
            return t
        found[rows] = start + slope * place + 0.5 * (np.max(off) + np.min(off))
    return found if np.max(np.abs(found - t)) > 1e-9 else t
