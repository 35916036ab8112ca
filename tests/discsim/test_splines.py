from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from discsim.splines import hermite, spline_slopes


def uneven(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A grid of n instants, values on it (n, 3), and instants in between, the ends included."""
    rng = np.random.default_rng(n)
    t = np.cumsum(rng.uniform(0.5e-3, 1.5e-3, n))
    return t, rng.normal(size=(n, 3)), np.concatenate([np.sort(rng.uniform(t[0], t[-1], 500)), t])


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6, 1001])
def test_a_spline_is_that_of_scipy(n):
    """To rounding of values of size three, which the equations of 1001 points do not magnify."""
    t, value, between = uneven(n)
    found = hermite(t, value, spline_slopes(t, value), between)
    np.testing.assert_allclose(found, CubicSpline(t, value)(between), atol=2e-14)


@pytest.mark.parametrize("n", [2, 3, 50])
def test_a_cubic_with_given_slopes_is_that_of_scipy_also_outside(n):
    t, value, between = uneven(n)
    slope = value[::-1] * 100.0
    at = np.concatenate([between, [t[0] - 1e-4, t[-1] + 1e-4]])
    np.testing.assert_allclose(hermite(t, value, slope, at), CubicHermiteSpline(t, value, slope)(at), atol=2e-14)


def test_a_cubic_is_its_own_spline():
    t = np.array([0.0, 0.3, 0.4, 1.1, 1.2])
    cubic = np.stack([1.0 - 2.0 * t + 0.5 * t**3, t**2], axis=1)
    slopes = np.stack([-2.0 + 1.5 * t**2, 2.0 * t], axis=1)
    np.testing.assert_allclose(spline_slopes(t, cubic), slopes, atol=1e-13)
