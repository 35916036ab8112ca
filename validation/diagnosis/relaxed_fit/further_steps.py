"""The Gauss-Newton steps that bring a relaxed fit to its end from where it stands."""

from __future__ import annotations

from discsim.validation.identification.gauss_newton import Fit, refit

__all__ = ["STEPS", "TOLERANCE", "fitted_further"]

#: most Gauss-Newton steps, and the gain in chi-squared per reading below which a step is the last
STEPS, TOLERANCE = 12, 1e-4


def fitted_further(fit: Fit, count: int) -> Fit:
    """Return a relaxed fit where its steps lead to; ``count`` are the readings by which a gain is measured."""
    return refit(fit, iterations=STEPS, tolerance=TOLERANCE * count)
