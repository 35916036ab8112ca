"""Effects of the air that a baseline leaves out: wind, its shear and gusts, density, ground effect."""

from __future__ import annotations

from math import exp
from typing import NamedTuple

from discsim.compiled import compiled

__all__ = ["Density", "GroundEffect", "Gust", "Wind", "WindShear", "ground_effect", "gust", "wind_shear"]

#: height that stands for "on the ground", m: no effect is evaluated below it
LOWEST_HEIGHT = 0.02


class Wind(NamedTuple):
    """Steady wind beside the known one; V is relative to it (air.wind)."""

    w_north_m_s: float = 0.0
    w_east_m_s: float = 0.0


class WindShear(NamedTuple):
    """Wind that grows with height, ``w(h) = w (h/10 m)^exponent`` (air.wind_shear)."""

    w_north_m_s: float = 0.0
    w_east_m_s: float = 0.0
    exponent: float = 0.0


@compiled
def wind_shear(effect: WindShear, h: float) -> float:
    """Factor on the wind at 10 m; h is the height above ground in m."""
    if effect.exponent == 0.0:
        return 1.0
    return float((max(h, LOWEST_HEIGHT) / 10.0) ** effect.exponent)


class Gust(NamedTuple):
    """A passing gust, ``w exp(-((t - t_s)/width)^2/2)`` (air.gust)."""

    t_s: float = 0.0
    width_s: float = 1.0
    w_north_m_s: float = 0.0
    w_east_m_s: float = 0.0


@compiled
def gust(effect: Gust, t: float) -> float:
    """Factor on the gust's peak at time t."""
    if effect.w_north_m_s == 0.0 and effect.w_east_m_s == 0.0:
        return 0.0
    s = (t - effect.t_s) / effect.width_s
    return exp(-0.5 * s * s)


class Density(NamedTuple):
    """Air denser or thinner than stated, ``rho -> ratio rho`` (air.density)."""

    ratio: float = 1.0


class GroundEffect(NamedTuple):
    """Lift that grows near the ground, ``C_L -> C_L (1 + k exp(-h/(2 d)))`` (air.ground_effect)."""

    k: float = 0.0


@compiled
def ground_effect(effect: GroundEffect, h: float, d: float) -> float:
    """Factor on the lift coefficient at height h (m) of a disc of diameter d (m)."""
    if effect.k == 0.0:
        return 1.0
    return 1.0 + effect.k * exp(-max(h, LOWEST_HEIGHT) / (2.0 * d))
