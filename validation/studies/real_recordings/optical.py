"""Body rate from an attitude that cameras measured."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from discsim.arrays import FloatArray

__all__ = ["HALF", "optical_rate"]

#: Samples on either side of the one whose rate is wanted: 9 in all, 31 ms at 285.7 Hz.
HALF = 4


def optical_rate(t: FloatArray, attitude: FloatArray, half: int = HALF) -> tuple[FloatArray, FloatArray]:
    """Return the body rate, (n, 3) rad/s, and its standard deviation per axis, (n,), of an evenly sampled attitude.

    ``attitude`` is (n, 4), w first, from body to a fixed frame. About each sample the turns from there to its
    neighbours, as rotation vectors in the body, are fitted with a cubic in time; its slope there is the rate. (A mean
    rate over the same stretch would be a chord's, too small where the hand reverses.) The deviation is the
    slope's, from what the fit leaves. Both are NaN within ``half`` samples of the ends.
    """
    n = t.size
    rotation = Rotation.from_quat(attitude[:, [1, 2, 3, 0]])
    back = rotation[half : n - half].inv()
    steps = np.arange(-half, half + 1)
    turned = np.stack([(back * rotation[half + k : n - half + k]).as_rotvec() for k in steps])  # (steps, m, 3)
    design = np.vander(steps * float(np.median(np.diff(t))), 4, increasing=True)
    solve = np.linalg.pinv(design)
    coefficients = np.tensordot(solve, turned, axes=1)
    left = turned - np.tensordot(design, coefficients, axes=1)
    spread = np.sqrt(np.sum(left**2, axis=(0, 2)) / (3 * (steps.size - 4)))
    rate, sd = np.full((n, 3), np.nan), np.full(n, np.nan)
    rate[half : n - half] = coefficients[1]
    sd[half : n - half] = spread * np.linalg.norm(solve[1])
    return rate, sd
