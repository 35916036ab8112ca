"""The noise of a sensor, found in its readings whatever smooth motion is under it.

A motion that spins and nutates is a sum of a few tones and a trend over a short block of readings. Pieces of L readings
in a row, taken as vectors, then span few directions; white noise is in all of them alike. So the small eigenvalues of
the pieces' covariance (Pisarenko's idea) are the noise's variance, however large the tones are. Eigenvalues of a short
block scatter and the small ones lie low: by how much is found once, by the same procedure on white noise.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from discsim.arrays import FloatArray

__all__ = ["noise_of"]

#: readings of a block, and of a piece: a disc at 2000 deg/s and 100 Hz turns 3.5 times in a block
BLOCK, PIECE = 64, 16
#: eigenvalues taken for noise: those beyond two tones and a trend (two each) of the three axes' common motion
SMALL = 8
#: blocks looked at, at most, evenly over the recording
MOST = 200


def noise_of(value: FloatArray) -> float | None:
    """Return the rms of white noise per axis of readings (n, k), None where the readings do not tell.

    They do not where they are fewer than a block, or where most repeat (a resolution coarser than the noise). Rounding
    counts as noise, and so does what moves a reading from row to row otherwise: vibration, jolts, times that are off.
    """
    table = value.reshape(len(value), -1)
    table = table[:, ~np.all(np.isnan(table), axis=0)]
    table = table[np.all(np.isfinite(table), axis=1)]
    if len(table) < BLOCK or table.shape[1] == 0:
        return None
    starts = np.unique(np.linspace(0, len(table) - BLOCK, min(MOST, len(table) // BLOCK)).astype(int))
    found = []
    for start in starts:
        block = table[start : start + BLOCK]
        # an axis that repeats is clipped, or rests on one step
        block = block[:, np.mean(np.diff(block, axis=0) == 0, axis=0) < 0.5]
        if block.shape[1] == 0:
            continue
        found.append(float(np.mean(_small(block))) / _lowered(block.shape[1]))
    if len(found) < max(1, len(starts) // 4):
        return None
    # the least eigenvalues of readings without noise round to either side of zero
    return float(np.sqrt(max(0.0, float(np.median(found)))))


def _small(block: FloatArray) -> FloatArray:
    """Return the `SMALL` smallest eigenvalues of the covariance of a block's pieces, ascending."""
    pieces = np.lib.stride_tricks.sliding_window_view(block, PIECE, axis=0).reshape(-1, PIECE)
    return np.asarray(np.linalg.eigvalsh(pieces.T @ pieces / len(pieces))[:SMALL])


@cache
def _lowered(axes: int) -> float:
    """Return the mean of the small eigenvalues of white noise of unit variance beside one strong tone per axis.

    The tone takes two directions, as a spinning body's does, and the noise has what is left.
    """
    rng = np.random.default_rng(0)
    means = []
    for _ in range(200):
        phase = rng.uniform(0.2, 1.2) * np.arange(BLOCK)[:, None] + 2 * np.pi * np.arange(axes) / 3
        means.append(float(np.mean(_small(1e4 * np.cos(phase) + rng.standard_normal((BLOCK, axes))))))
    return float(np.median(means))
