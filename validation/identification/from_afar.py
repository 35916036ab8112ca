"""A fit from far away: what a start leaves counts as noise at first, which comes down as the fit comes nearer.

In the noise of the readings themselves a path that starts metres off would ask for any speed and attitude within a few
steps, far from where they are linear; in what is left stated numbers keep their say (graduated non-convexity: Blake and
Zisserman, *Visual Reconstruction*, 1987; here with Gaussian noise throughout).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from discsim.validation.identification.gauss_newton import Fit, linearised, merit_of, refit
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.noise import GroupNoise, NoiseModel, estimate_noise

__all__ = ["fitted_from_afar"]

#: rounds, steps in each, and the share of the noise below which a round must bring it for another to follow
_ROUNDS, _STEPS, _LOWER = 8, 2, 0.97


def fitted_from_afar(fit: Fit, *, bounds: Mapping[tuple[str, str], tuple[float, float]] | None = None) -> Fit:
    """Return a fit that has come as near its readings as it does, in the noise that is left, at least its own.

    The noise is white, one level for each group. Takes and gives a `Fit` as `refit` does.
    """
    least = fit.noise
    linears = linearised(fit)
    fit = replace(fit, linears=linears, noise=_left(linears, least), merit=np.inf)
    for _ in range(_ROUNDS):
        nearer = refit(fit, iterations=_STEPS, bounds=bounds, relinearise=False)
        noise = _left(nearer.linears, least)
        lower = any(noise[group].sd < _LOWER * fit.noise[group].sd for group in noise)
        fit = replace(nearer, noise=noise, merit=merit_of(replace(nearer, noise=noise), nearer.linears))
        if not lower:
            break
    return fit


def _left(linears: tuple[Linear, ...], least: NoiseModel) -> dict[str, GroupNoise]:
    """Return the root mean square of residuals by group, at least the level in ``least``."""
    left = estimate_noise(linears, [linear.residual for linear in linears], coloured=False)
    return {group: level._replace(sd=max(level.sd, least[group].sd)) for group, level in left.items()}
