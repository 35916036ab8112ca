"""The spin rate as a cubic spline of time whose roughness has a prior: values, slopes, and the penalty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from discsim.arrays import FloatArray

__all__ = ["IndexArray", "SpinSpline"]

IndexArray = NDArray[np.int64]


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

    def second_difference(self) -> FloatArray:
        """Return the rows (size - 2, size) whose squares sum to the integral of (r'')^2, in white-noise units.

        With r'' white noise of spectral density S, each row times the coefficients has variance S.
        """
        rows = np.diff(np.eye(self.size), 2, axis=0) / self.spacing**2
        return np.asarray(rows * np.sqrt(self.spacing))
