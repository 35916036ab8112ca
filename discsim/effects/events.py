"""Events that a baseline leaves out: a touch that changes velocity, a kick that changes spin."""

from __future__ import annotations

from math import exp, pi, sqrt
from typing import NamedTuple

from discsim.compiled import compiled

__all__ = ["EVENT_WIDTH_S", "Impulse", "SpinStep", "impulse", "spin_step"]

#: one-sigma duration of an event, s (physics reference)
EVENT_WIDTH_S = 0.01


@compiled
def _pulse(t: float, t_s: float) -> float:
    """Gaussian of unit area, 1/s."""
    s = (t - t_s) / EVENT_WIDTH_S
    return exp(-0.5 * s * s) / (EVENT_WIDTH_S * sqrt(2.0 * pi))


class Impulse(NamedTuple):
    """Acceleration of the centre of mass, ``dv`` spread over a Gaussian of 10 ms (event.impulse).

    The accelerometer feels it; the rates do not change.
    """

    t_s: float = 0.0
    dv_north_m_s: float = 0.0
    dv_east_m_s: float = 0.0
    dv_down_m_s: float = 0.0


@compiled
def impulse(effect: Impulse, t: float) -> tuple[float, float, float]:
    """Acceleration in N, m/s^2."""
    if effect.dv_north_m_s == 0.0 and effect.dv_east_m_s == 0.0 and effect.dv_down_m_s == 0.0:
        return 0.0, 0.0, 0.0
    f = _pulse(t, effect.t_s)
    return f * effect.dv_north_m_s, f * effect.dv_east_m_s, f * effect.dv_down_m_s


class SpinStep(NamedTuple):
    """``rdot += dr`` spread over a Gaussian of 10 ms, along the direction of spin if positive (event.spin_step)."""

    t_s: float = 0.0
    dr_rad_s: float = 0.0


@compiled
def spin_step(effect: SpinStep, t: float, r: float) -> float:
    """Angular acceleration about z_B, rad/s^2."""
    if effect.dr_rad_s == 0.0:
        return 0.0
    direction = 1.0 if r >= 0.0 else -1.0
    return direction * effect.dr_rad_s * _pulse(t, effect.t_s)
