"""The spin rate as a cubic spline of time whose roughness has a prior: values, slopes, and the penalty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from discsim.arrays import FloatArray

__all__ = ["IndexArray", "SpinSpline"]

IndexArray = NDArray[np.int64]

#: a second difference
_BEND = (1.0, -2.0, 1.0)


@dataclass(frozen=True)
class SpinSpline:
    """Cubic B-splines on equal intervals from ``start`` on; ``count`` intervals of ``spacing`` s."""

    start: float
    spacing: float
    count: int

    @classmethod
    def over(cls, start: float, stop: float, spacing: float) -> SpinSpline:
        """Return splines that cover start..stop with intervals of about ``spacing``."""
        count = max(1, round((stop - start) / spacing))
        return cls(start, (stop - start) / count, count)

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return self.count + 3

    @property
    def knots(self) -> FloatArray:
        """Knots (size + 4,), s."""
        return self.start + self.spacing * np.arange(-3.0, self.count + 4.0)

    def local(self, t: FloatArray) -> tuple[IndexArray, FloatArray]:
        """Return for each t (n,) the first of its four coefficients (n,) and their weights (n, 4)."""
        s = (np.asarray(t) - self.start) / self.spacing
        index = np.clip(np.floor(s).astype(np.int64), 0, self.count - 1)
        u = s - index
        weights = np.stack([(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3], axis=-1)
        return index, weights / 6

    def basis(self, t: FloatArray, derivative: int = 0) -> FloatArray:
        """Return values of the splines, or of their derivative, at t: (n, size)."""
        if derivative:
            splines = BSpline(self.knots, np.eye(self.size), 3).derivative(derivative)
            return np.asarray(splines(np.clip(t, self.start, self.start + self.spacing * self.count)))
        index, weights = self.local(t)
        matrix = np.zeros((len(index), self.size))
        matrix[np.arange(len(index))[:, None], index[:, None] + np.arange(4)] = weights
        return matrix

    def bend(self, coefficients: FloatArray) -> FloatArray:
        """Return the second differences (size - 2,) of coefficients (size,), whose squares sum to that of r''.

        They are in white-noise units: with r'' white noise of spectral density S, each has variance S.
        """
        return np.asarray(np.diff(coefficients, 2) * self.spacing**-1.5)

    def pulled(self, bend: FloatArray) -> FloatArray:
        """Return the sum (size,) over second differences of ``bend`` (size - 2,) times their derivatives."""
        out = np.zeros(self.size)
        for place, factor in enumerate(_BEND):
            out[place : place + bend.size] += factor * bend
        return np.asarray(out * self.spacing**-1.5)

    def bend_precision(self, local: FloatArray) -> FloatArray:
        """Return the precision (size, size) of coefficients whose second differences have precisions (size - 2,)."""
        out, row = np.zeros((self.size, self.size)), np.arange(self.size - 2)
        for i, one in enumerate(_BEND):
            for j, other in enumerate(_BEND):
                out[row + i, row + j] += one * other * self.spacing**-3 * local
        return out

    def bend_variance(self, covariance: FloatArray) -> FloatArray:
        """Return the variances (size - 2,) of `bend` of coefficients with a covariance (size, size)."""
        out, row = np.zeros(self.size - 2), np.arange(self.size - 2)
        for i, one in enumerate(_BEND):
            for j, other in enumerate(_BEND):
                out += one * other * self.spacing**-3 * covariance[row + i, row + j]
        return out
