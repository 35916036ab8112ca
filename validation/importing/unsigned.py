"""Counts of 16 bits that were written without their sign: -3 stands as 65533.

A program that puts two bytes of a register together and forgets the sign writes a reading just below zero as one just
below 65536. Takes a sensor's readings as written; gives them with their sign.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray

__all__ = ["signed"]

SPAN = 65536.0
#: Leaps over half the span that tell it, and the share of them that may be left with the sign: readings go through zero
#: again and again, and a register that overflows where no sign was lost leaps a few times.
FEWEST, LEFT = 5, 0.1


def signed(value: FloatArray) -> FloatArray | None:
    """Return a sensor's readings (n, k) as written with their sign; None where they have it, or nothing tells.

    They are whole numbers from 0 to 65535 that leap over half of that, and with the sign hardly ever.

    >>> signed(np.array([[3.0, 65530, 2, 65535, 1, 65534, 4, 65533, 0, 65532]]).T).ravel().tolist()
    [3.0, -6.0, 2.0, -1.0, 1.0, -2.0, 4.0, -3.0, 0.0, -4.0]
    """
    sound = value[np.isfinite(value).all(axis=1)]
    if len(sound) < 2 or np.any(sound < 0) or np.any(sound >= SPAN) or np.any(sound % 1 != 0):
        return None
    leaps, above = _leaps(sound), sound[sound >= SPAN / 2]
    meant = np.where(value >= SPAN / 2, value - SPAN, value)
    left = _leaps(np.where(sound >= SPAN / 2, sound - SPAN, sound))
    # a single value above stands for readings that failed
    return None if min(leaps, np.unique(above).size) < FEWEST or left > LEFT * leaps else meant


def _leaps(value: FloatArray) -> int:
    return int(np.count_nonzero(np.abs(np.diff(value, axis=0)) > SPAN / 2))
