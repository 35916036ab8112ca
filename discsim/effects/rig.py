"""Effects of rigs that a baseline leaves out: friction, drag, a tilted axis, ripple of the table's speed."""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

from discsim.compiled import compiled

__all__ = [
    "AxisTilt",
    "CoulombFriction",
    "QuadraticDrag",
    "SpeedRipple",
    "axis",
    "coulomb_friction",
    "quadratic_drag",
    "speed_ripple",
]


class CoulombFriction(NamedTuple):
    """Torque ``-torque sign(r)`` of a dry bearing (rig.coulomb_friction)."""

    torque_N_m: float = 0.0


@compiled
def coulomb_friction(effect: CoulombFriction, r: float) -> float:
    """Torque, N m."""
    return -effect.torque_N_m if r > 0.0 else (effect.torque_N_m if r < 0.0 else 0.0)


class QuadraticDrag(NamedTuple):
    """Torque ``-coefficient r |r|`` of the air around a rig (rig.quadratic_drag)."""

    coefficient_N_m_s2: float = 0.0


@compiled
def quadratic_drag(effect: QuadraticDrag, r: float) -> float:
    """Torque, N m."""
    return -effect.coefficient_N_m_s2 * r * abs(r)


class AxisTilt(NamedTuple):
    """Axis along ``(tilt_north, tilt_east, 1)`` in N instead of straight down (rig.axis_tilt)."""

    tilt_north_rad: float = 0.0
    tilt_east_rad: float = 0.0


@compiled
def axis(effect: AxisTilt) -> tuple[float, float, float]:
    """Unit vector of the axis in N."""
    n, e = effect.tilt_north_rad, effect.tilt_east_rad
    length = sqrt(n * n + e * e + 1.0)
    return n / length, e / length, 1.0 / length


class SpeedRipple(NamedTuple):
    """``r = r_cmd + amplitude sin(order psi + phase)`` while the table turns (rig.speed_ripple).

    psi is the angle turned since the recording began; the rate reference shows the ripple.
    """

    order: float = 1.0
    amplitude_rad_s: float = 0.0
    phase_rad: float = 0.0


@compiled
def speed_ripple(effect: SpeedRipple, psi: float, r: float) -> tuple[float, float]:
    """Rate (rad/s) and angular acceleration (rad/s^2) added to the command's, at angle psi and total rate r."""
    angle = effect.order * psi + effect.phase_rad
    return effect.amplitude_rad_s * sin(angle), effect.amplitude_rad_s * effect.order * r * cos(angle)
