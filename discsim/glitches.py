"""Readings of a rate that no thrown body has, alone or a few on end: slips of a log, such as a lost decimal point."""

from __future__ import annotations

import numpy as np

from discsim.arrays import BoolArray, FloatArray, runs

__all__ = ["FASTEST_SPIN", "beyond_spin", "glitches"]

#: Fastest spin of a throw, rad/s: the fastest have 200, and no gyroscope of a logger reads beyond 80 (4500 deg/s).
FASTEST_SPIN = 250.0

#: A glitch differs from each neighbour by more than this share of itself; a motion has neighbours like itself.
APART = 0.5

#: Most readings on end that are glitches: a slip lasts a row or two, a motor that starts stays where it leapt to.
ON_END = 3

#: Where more of the rows are beyond `FASTEST_SPIN`, the unit is wrong, or the body is no throw: no glitches.
MOST = 0.05

RATES = ("gyroscope", "rate_reference")


def beyond_spin(sensor: str, value: FloatArray) -> BoolArray:
    """Tell which readings, (n,) or (n, k) rad/s, are beyond `FASTEST_SPIN`; none of a sensor that shows no rate."""
    if sensor not in RATES:
        return np.zeros(value.shape, dtype=np.bool_)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(value) > FASTEST_SPIN)


def glitches(sensor: str, value: FloatArray) -> BoolArray:
    """Tell which readings, (n,) or (n, k) rad/s, leap beyond `FASTEST_SPIN` and back, `ON_END` at most on end.

    Neighbours are the readings of the same axis before and after, across gaps; they are within `FASTEST_SPIN`.
    """
    beyond = beyond_spin(sensor, value)
    rows = beyond.reshape(len(value), -1)
    if not np.any(rows) or np.mean(np.any(rows, axis=1)) > MOST:
        return np.zeros(value.shape, dtype=np.bool_)
    found = np.zeros(rows.shape, dtype=np.bool_)
    for axis, column in enumerate(value.reshape(len(value), -1).T):
        there = np.flatnonzero(np.isfinite(column))
        seen, wild = column[there], rows[there, axis]
        leaps = np.abs(np.diff(seen)) > APART * np.maximum(np.abs(seen[1:]), np.abs(seen[:-1]))
        for first, after in runs(wild):
            there_and_back = np.all(leaps[max(first - 1, 0) : first]) and np.all(leaps[after - 1 : after])
            if there_and_back and after - first <= ON_END:
                found[there[first:after], axis] = True
    return found.reshape(value.shape)
