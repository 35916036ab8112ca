"""A measuring module on board: what it adds to a disc's mass and inertia, and where it moves the centre of mass."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from discsim.disc import Disc
from discsim.effects.catalogue import Effect, effect
from discsim.errors import InputError

__all__ = ["Module", "loaded"]


@dataclass(frozen=True)
class Module:
    """A flat round plate of a module in the disc's plane: mass kg, centre (x, y) in B and radius of the plate, m.

    Radius zero is a point. Raises `InputError` for a mass that is not above zero, a negative radius, and a place off
    both axes: x_B and y_B would no longer be principal.
    """

    mass: float
    x: float = 0.0
    y: float = 0.0
    radius: float = 0.0

    def __post_init__(self) -> None:
        if not np.isfinite([self.mass, self.x, self.y, self.radius]).all() or self.mass <= 0 or self.radius < 0:
            raise InputError(
                f"module: mass {self.mass:g} kg at ({self.x:g}, {self.y:g}) m, radius {self.radius:g} m; expected a "
                "mass above zero and a radius not below it"
            )
        if self.x and self.y:
            raise InputError(
                f"module: sits at ({self.x:g}, {self.y:g}) m; expected a place on x_B or y_B, which stay principal "
                "axes then (turn the axes)"
            )


def loaded(disc: Disc, module: Module) -> tuple[Disc, list[Effect]]:
    """Return the disc with a module in it, and the effects of one that does not sit in the middle.

    Mass is m_T of (18). Inertia is about the common centre of mass: the plate's own M a^2 (1/4, 1/4, 1/2), and the
    reduced mass at the distance. Off the middle come body.mass_imbalance and body.inertia_asymmetry. The air is the
    bare disc's, so the drag of a module that sticks out is not in it. Raises `InputError` for a module outside the
    rim, and where Izz exceeds twice the smaller Ixx.
    """
    distance = abs(module.x) + abs(module.y)  # one of them is zero
    if distance + module.radius > disc.diameter / 2:
        raise InputError(
            f"module: reaches out to {1000 * (distance + module.radius):g} mm, beyond the rim at "
            f"{500 * disc.diameter:g} mm; expected a place and a radius (m) inside"
        )
    total = disc.mass + module.mass
    reduced = disc.mass * module.mass / total
    own = module.mass * module.radius**2 / 4
    try:
        heavier = replace(
            disc,
            mass=total,
            Ixx=disc.Ixx + own + reduced * module.y**2,
            Izz=disc.Izz + 2 * own + reduced * distance**2,
        )
    except ValueError as error:
        raise InputError(
            f"module at x = {module.x:g} m: {error}; a place on y_B has the larger inertia in Ixx"
        ) from None
    if distance == 0.0:
        return heavier, []
    share = module.mass / total
    return heavier, [
        effect("body.mass_imbalance", ex_m=share * module.x, ey_m=share * module.y),
        effect("body.inertia_asymmetry", dIyy_kg_m2=reduced * (module.x**2 - module.y**2)),
    ]
