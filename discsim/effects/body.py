"""Effects of the body that a baseline leaves out: centre of mass off the middle, unequal transverse inertia."""

from __future__ import annotations

from typing import NamedTuple

from discsim.compiled import compiled

__all__ = ["InertiaAsymmetry", "MassImbalance", "centre_of_mass", "transverse_inertia"]


class MassImbalance(NamedTuple):
    """Centre of mass at (ex, ey, 0) in B (body.mass_imbalance).

    Air forces act at the geometric centre with the velocity of the centre of mass, sensors keep their place in the
    disc, the stated inertia is about the centre of mass, and a release state is the centre of mass's.
    """

    ex_m: float = 0.0
    ey_m: float = 0.0


@compiled
def centre_of_mass(effect: MassImbalance) -> tuple[float, float, float]:
    """Centre of mass in B from the geometric centre, m."""
    return effect.ex_m, effect.ey_m, 0.0


class InertiaAsymmetry(NamedTuple):
    """``Iyy = Ixx + dIyy``, principal axes along x_B and y_B (body.inertia_asymmetry)."""

    dIyy_kg_m2: float = 0.0


@compiled
def transverse_inertia(effect: InertiaAsymmetry, Ixx: float) -> float:
    """Return Iyy, kg m^2."""
    return Ixx + effect.dIyy_kg_m2
