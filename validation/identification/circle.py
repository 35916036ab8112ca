"""The circle that points in a plane lie on, as the tip of a field does that turns. No time enters."""

from __future__ import annotations

import numpy as np

from discsim.arrays import ComplexArray, FloatArray

__all__ = ["circle_centre", "circle_through"]

#: reweighted steps of the robust circle (bisquare's cousin: Cauchy weights)
_REWEIGHTED = 12


def circle_through(z: ComplexArray) -> tuple[complex, float]:
    """Return the centre and the radius of the circle nearest to points x + i y (n,), by algebraic least squares."""
    A = np.stack([2.0 * z.real, 2.0 * z.imag, np.ones(z.size)], axis=1)
    (a, b, c), *_ = np.linalg.lstsq(A, z.real * z.real + z.imag * z.imag, rcond=None)
    return complex(a, b), float(np.sqrt(max(c + a * a + b * b, 0.0)))


def circle_centre(value: ComplexArray) -> complex:
    """Return the centre of the circle that a field (n,) runs, robustly, by its algebraic equation; no time enters."""
    x, y = value.real, value.imag
    A, b = np.column_stack([2.0 * x, 2.0 * y, np.ones(x.size)]), x * x + y * y
    weight = np.ones(x.size)
    solution: FloatArray = np.zeros(3)
    for _ in range(_REWEIGHTED):
        solution = np.asarray(np.linalg.lstsq(A * weight[:, None], b * weight, rcond=None)[0])
        left = np.abs(b - A @ solution)
        weight = 1.0 / np.sqrt(1.0 + (left / (1.5 * max(float(np.median(left)), 1e-12))) ** 2)
    return complex(solution[0], solution[1])
