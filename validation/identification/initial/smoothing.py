"""Smoothing shared by the initial states: readings on a grid, Gaussian kernel averages, medians.

Takes readings at uneven instants; gives averages at others (kernel regression, Nadaraya 1964, Watson 1964).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from discsim.arrays import ComplexArray, FloatArray
from discsim.recording import Recording

__all__ = ["Readings", "median_of", "readings_for", "smoothed"]


#: spacing of the instants at which attitudes are found before they are smoothed, s
GRID = 0.1


#: fewest readings of a sensor that is used at all
FEWEST = 12


#: slower than this, rad/s, an unclipped gyroscope tells the spin better than the field's phase, which precession
#: bends; up to the second, where the disc wobbles half as fast as it spins
SLOW, TUMBLING = 6.0, 20.0


class Readings(NamedTuple):
    """Times (n,) s and values (n, k) of a sensor's whole readings."""

    t: FloatArray
    value: FloatArray


def readings_for(recording: Recording, sensor: str, columns: slice | int = slice(None)) -> Readings | None:
    """Return the readings of which every asked column is there and not clipped, or None for too few."""
    samples = recording.get(sensor)
    if samples is None or not len(samples):  # of no row there is no number of columns
        return None
    value = np.where(recording.sheets[sensor].clipped(samples.value), np.nan, samples.value)
    value = value.reshape(len(samples), -1)[:, columns]
    good = np.isfinite(value).reshape(len(samples), -1).all(axis=1)
    if np.count_nonzero(good) < FEWEST:
        return None
    return Readings(samples.t[good], value[good])


def smoothed(t: FloatArray, value: FloatArray | ComplexArray, at: FloatArray, sigma: float) -> FloatArray:
    """Return values (n, k) smoothed by a Gaussian, evaluated at (m,) instants, linear near the ends of the data.

    A local straight line, so that a drift across an end or a gap does not bias.
    """
    out = np.empty((at.size, *value.shape[1:]), dtype=value.dtype)
    lo = np.searchsorted(t, at - 3.5 * sigma)
    hi = np.searchsorted(t, at + 3.5 * sigma)
    for i, instant in enumerate(at):
        first, last = int(lo[i]), int(hi[i])
        if last - first < 4:  # a gap, or outside: the nearest readings
            nearest = int(np.clip(np.searchsorted(t, instant), 2, max(t.size - 2, 2)))
            out[i] = np.mean(value[max(nearest - 2, 0) : nearest + 2], axis=0)
            continue
        x = (t[first:last] - instant) / sigma
        w = np.exp(-0.5 * x * x)
        w0, w1, w2 = w.sum(), w @ x, w @ (x * x)
        # the slope's ridge keeps one-sided windows from extrapolating noise
        out[i] = (w * (w2 + 0.05 * w0 - w1 * x)) @ value[first:last] / (w0 * (w2 + 0.05 * w0) - w1 * w1)
    return out


def median_of(value: FloatArray) -> float:
    """Return the median size of values (n,)."""
    return float(np.median(np.abs(value)))
