"""Aerodynamic effects that a baseline leaves out, as terms of the coefficients.

gamma is the advance ratio (15), V the airspeed in m/s, alpha the angle of attack in rad.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

from discsim.compiled import compiled

__all__ = [
    "SpinDrag",
    "SpinLift",
    "SpinPitchingMoment",
    "SpinSideForce",
    "Stall",
    "YawAlpha",
    "YawQuadratic",
    "YawReynolds",
    "spin_drag",
    "spin_lift",
    "spin_pitching_moment",
    "spin_side_force",
    "stall",
    "yaw_alpha",
    "yaw_quadratic",
    "yaw_reynolds",
]


class SpinSideForce(NamedTuple):
    """Side force of the spin, ``C_Y = CYr gamma`` along +y_H (aero.spin_side_force)."""

    CYr: float = 0.0


@compiled
def spin_side_force(effect: SpinSideForce, gamma: float) -> float:
    """Term of C_Y."""
    return effect.CYr * gamma


class SpinLift(NamedTuple):
    """Lift that grows with spin, ``C_L += CLr |gamma|`` (aero.spin_lift)."""

    CLr: float = 0.0


@compiled
def spin_lift(effect: SpinLift, gamma: float) -> float:
    """Term of C_L."""
    return effect.CLr * abs(gamma)


class SpinDrag(NamedTuple):
    """Drag that grows with spin, ``C_D += CDrr gamma^2`` (aero.spin_drag)."""

    CDrr: float = 0.0


@compiled
def spin_drag(effect: SpinDrag, gamma: float) -> float:
    """Term of C_D."""
    return effect.CDrr * gamma * gamma


class SpinPitchingMoment(NamedTuple):
    """Pitching moment of the spin, ``C_M += CMr gamma`` (aero.spin_pitching_moment)."""

    CMr: float = 0.0


@compiled
def spin_pitching_moment(effect: SpinPitchingMoment, gamma: float) -> float:
    """Term of C_M."""
    return effect.CMr * gamma


class Stall(NamedTuple):
    """Lift lost above alpha_stall, ``C_L -= k CLa (alpha - alpha_stall)`` (aero.stall)."""

    k: float = 0.0
    alpha_stall_rad: float = pi / 2


@compiled
def stall(effect: Stall, CLa: float, alpha: float) -> float:
    """Term of C_L."""
    return -effect.k * CLa * max(alpha - effect.alpha_stall_rad, 0.0)


class YawReynolds(NamedTuple):
    """Yaw damping that changes with airspeed, ``CNr -> CNr (V/15 m/s)^exponent`` (aero.yaw_reynolds)."""

    exponent: float = 0.0


@compiled
def yaw_reynolds(effect: YawReynolds, V: float) -> float:
    """Factor on CNr."""
    if effect.exponent == 0.0:
        return 1.0
    return float((V / 15.0) ** effect.exponent)


class YawQuadratic(NamedTuple):
    """Yaw damping that grows with spin, ``C_N += CNrr gamma |gamma|`` (aero.yaw_quadratic)."""

    CNrr: float = 0.0


@compiled
def yaw_quadratic(effect: YawQuadratic, gamma: float) -> float:
    """Term of C_N."""
    return effect.CNrr * gamma * abs(gamma)


class YawAlpha(NamedTuple):
    """Yaw damping that grows with angle of attack, ``C_N += CNraa gamma alpha^2`` (aero.yaw_alpha)."""

    CNraa: float = 0.0


@compiled
def yaw_alpha(effect: YawAlpha, gamma: float, alpha: float) -> float:
    """Term of C_N."""
    return effect.CNraa * gamma * alpha * alpha
