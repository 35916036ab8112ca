"""Cubic curves through the points of a grid, as `scipy.interpolate` has them, which takes 0.3 s to load."""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled

__all__ = ["hermite", "spline_slopes"]


def hermite(t: FloatArray, value: FloatArray, slope: FloatArray, at: FloatArray) -> FloatArray:
    """Return the cubic that meets values and slopes (n, k) on a grid t (n,), at instants ``at`` (m,): (m, k).

    Outside the grid it goes on with the cubic of the nearest cell.
    """
    cell = np.clip(np.searchsorted(t, at, side="right") - 1, 0, t.size - 2)
    step, s = (t[cell + 1] - t[cell])[:, None], (at - t[cell])[:, None]
    start, first, last = value[cell], slope[cell], slope[cell + 1]
    mean = (value[cell + 1] - start) / step
    bend = (first + last - 2.0 * mean) / step
    return np.asarray(start + first * s + ((mean - first) / step - bend) * (s * s) + bend / step * (s * s * s))


@compiled
def spline_slopes(t: FloatArray, value: FloatArray) -> FloatArray:
    """Return the slopes (n, k) with which `hermite` is twice differentiable: a cubic spline through values (n, k).

    At either end two cells share one cubic (not a knot); two points make a line, three a parabola.
    """
    n, width = value.shape
    slopes = np.empty((n, width))
    step = t[1:] - t[:-1]
    if n <= 3:
        for j in range(width):
            first = (value[1, j] - value[0, j]) / step[0]
            last = (value[n - 1, j] - value[n - 2, j]) / step[n - 2]
            curve = (last - first) / (t[n - 1] - t[0]) if n == 3 else 0.0
            for i in range(n):
                slopes[i, j] = first + curve * (2.0 * t[i] - t[0] - t[1])
        return slopes
    # the equations are tridiagonal: rows eliminated downwards, slopes found upwards
    upper = np.empty(n)
    for i in range(n):
        if i == 0:
            left, middle, right = 0.0, step[1], t[2] - t[0]
        elif i == n - 1:
            left, middle, right = t[n - 1] - t[n - 3], step[n - 3], 0.0
        else:
            left, middle, right = step[i], 2.0 * (step[i - 1] + step[i]), step[i - 1]
        pivot = middle if i == 0 else middle - left * upper[i - 1]
        upper[i] = right / pivot
        for j in range(width):
            if i == 0:
                known = _end(t[1] - t[0], t[2] - t[1], value[0, j], value[1, j], value[2, j])
            elif i == n - 1:
                known = -_end(step[n - 2], step[n - 3], value[n - 1, j], value[n - 2, j], value[n - 3, j])
            else:
                before = (value[i, j] - value[i - 1, j]) / step[i - 1]
                known = 3.0 * (step[i] * before + step[i - 1] * (value[i + 1, j] - value[i, j]) / step[i])
            slopes[i, j] = (known if i == 0 else known - left * slopes[i - 1, j]) / pivot
    for i in range(n - 2, -1, -1):
        for j in range(width):
            slopes[i, j] -= upper[i] * slopes[i + 1, j]
    return slopes


@compiled
def _end(near: float, far: float, first: float, second: float, third: float) -> float:
    """Right-hand side of the equation at an end whose two cells are one cubic; steps and values from there inwards."""
    both = near + far
    return ((near + 2.0 * both) * far * (second - first) / near + near * near * (third - second) / far) / both
