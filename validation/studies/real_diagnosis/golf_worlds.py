"""What may be behind the golf throws' misses: changes of air, disc, release, ground and of how the track was taken.

A `World` holds all that a throw is flown and seen in; a `Cause` changes it by a few numbers, zero for no change. Causes
that act on the flight are of the catalogue, or factors and offsets of the tabulated coefficients; those of the track
act on what is seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc
from discsim.effects.aero import SpinDrag, SpinLift, SpinPitchingMoment, SpinSideForce
from discsim.effects.air import Density, GroundEffect, Wind, WindShear
from discsim.effects.catalogue import Effect, catalogued, effect_of
from discsim.effects.track_rows import Camera, Parallax, camera_of, pictured

__all__ = ["CAMERA", "CAUSES", "NONE", "Cause", "World", "pair"]

#: a rate derivative is within this of what is stated: discs have -0.2 to 0.01 (models/discs), and a fit asks for -9
_RATES = 0.5
#: inputs of a throw (`discsim.validation.studies.golf_throws.prediction.drawn`)
INPUTS = 12


@dataclass(frozen=True)
class World:
    """What a throw is flown in, and how its track was taken.

    Attributes
    ----------
    disc : Disc
    effects : tuple of Effect
        Of the catalogue, on the motion.
    bias : (12,) array
        By how much all throws' inputs differ from what is stated, in its sigmas.
    picture : Parallax
        The camera.
    scale, late, ratio : float
        A metre of the track less one; its time at release, s; a second of it less one.
    ground : (3,) array
        Height of the ground at the release, m, and its slopes north and east.
    """

    disc: Disc
    effects: tuple[Effect, ...] = ()
    bias: FloatArray = field(default_factory=lambda: readonly(np.zeros(INPUTS)))
    picture: Parallax = field(default_factory=Parallax)
    scale: float = 0.0
    late: float = 0.0
    ratio: float = 0.0
    ground: FloatArray = field(default_factory=lambda: readonly(np.zeros(3)))

    def instants(self, written: FloatArray) -> FloatArray:
        """Return the true times (m,) s of a track's points."""
        return np.maximum((written - self.late) / (1.0 + self.ratio), 0.0)

    def above(self, position: FloatArray) -> FloatArray:
        """Return the height (...,) m above its ground of positions (..., 3)."""
        level: FloatArray = self.ground[0] + position[..., :2] @ self.ground[1:]
        return -position[..., 2] - level

    def true(self, seen: FloatArray, height: float) -> FloatArray:
        """Return where something at a height above ground is, (2,) m, that a track has at ``seen``."""
        curvature, *nadir = self.picture
        place: FloatArray = seen * (1.0 - curvature * height) + height * np.array(nadir)
        return place

    def seen(self, position: FloatArray, release: FloatArray) -> FloatArray:
        """Return the plan (..., 2) m that a track has of positions (..., 3) of a throw released at (2,) m."""
        above = position.copy()
        above[..., 2] = -self.above(position)
        plan: FloatArray = pictured(self.picture, above)[..., :2]
        return release + (1.0 + self.scale) * (plan - release)


@dataclass(frozen=True)
class Cause:
    """A change of the world by numbers x: ``apply`` returns the world that goes with them.

    ``steps`` are sizes by which they are tried, none for a cause that is not fitted; ``reach`` (k, 2) is where they
    make sense. ``told`` says their size in words.
    """

    name: str
    steps: tuple[float, ...]
    apply: Callable[[World, FloatArray], World]
    reach: tuple[tuple[float, float], ...] = ()
    told: Callable[[FloatArray], str] = lambda x: ", ".join(f"{one:+.3g}" for one in x)

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest numbers (2, k)."""
        free = [(-np.inf, np.inf)] * len(self.steps)
        return np.array(self.reach or free, dtype=float).reshape(-1, 2).T


def pair(first: Cause, second: Cause) -> Cause:
    """Return two causes at once."""
    k = len(first.steps)
    reach = tuple(map(tuple, np.hstack([first.bounds, second.bounds]).T))
    return Cause(
        f"{first.name} and {second.name}",
        (*first.steps, *second.steps),
        lambda world, x: second.apply(first.apply(world, x[:k]), x[k:]),
        reach,
        lambda x: f"{first.told(x[:k])}; {second.told(x[k:])}",
    )


def _table(name: str, column: str, change: Callable[[FloatArray, float], FloatArray], step: float) -> Cause:
    def apply(world: World, x: FloatArray) -> World:
        assert world.disc.aero_table is not None
        table = replace(world.disc.aero_table, **{column: change(getattr(world.disc.aero_table, column), float(x[0]))})
        return replace(world, disc=replace(world.disc, aero_table=table))

    return Cause(name, (step,), apply)


def _factor(name: str, column: str) -> Cause:
    return _table(f"{name}, factor less 1", column, lambda c, x: c * (1.0 + x), 0.01)


def _offset(name: str, column: str, step: float) -> Cause:
    return _table(f"{name}, offset", column, lambda c, x: c + x, step)


def _rate(name: str, step: float) -> Cause:
    def apply(world: World, x: FloatArray) -> World:
        aero = world.disc.aero
        assert aero is not None
        changed = aero._replace(**{name: getattr(aero, name) + float(x[0])})
        return replace(world, disc=replace(world.disc, aero=changed))

    return Cause(f"{name} of the disc, offset", (step,), apply, ((-_RATES, _RATES),))


def _catalogued(what: str, steps: tuple[float, ...], effect: Callable[..., Any], most: float = np.inf) -> Cause:
    """Return an effect of the catalogue as a cause; ``what`` is its size in words, behind its id."""
    name = f"`{catalogued(type(effect(*(0.0,) * len(steps)))).id}`, {what}"

    def apply(world: World, x: FloatArray) -> World:
        return replace(world, effects=(*world.effects, effect_of(effect(*x.tolist()))))

    return Cause(name, steps, apply, ((-most, most),) * len(steps))


def _bias(name: str, column: int, unit: float = 1.0, step: float = 0.1) -> Cause:
    def apply(world: World, x: FloatArray) -> World:
        bias = world.bias.copy()
        bias[column] += float(x[0]) / unit
        return replace(world, bias=bias)

    return Cause(f"stated {name}, bias", (step,), apply)


def _seen(name: str, steps: tuple[float, ...], change: Callable[[World, FloatArray], World], **more: Any) -> Cause:
    return Cause(name, steps, change, **more)


def _camera(x: FloatArray) -> str:
    camera: Camera = camera_of(Parallax(*x.tolist()))
    return f"{camera.height_m:.0f} m high at {camera.north_m:.0f} m north, {camera.east_m:.0f} m east"


def _ground(world: World, k: int, x: FloatArray) -> World:
    ground = world.ground.copy()
    ground[k : k + x.size] += x
    return replace(world, ground=ground)


NONE = Cause("none", (), lambda world, x: world)
CAMERA = _seen(
    f"`{catalogued(Camera).id}`",
    (2e-4, 0.01, 0.01),
    lambda world, x: replace(world, picture=Parallax(*x.tolist())),
    reach=((-0.002, 0.05), (-2.0, 2.0), (-2.0, 2.0)),
    told=_camera,
)
CAUSES: Sequence[Cause] = (
    NONE,
    CAMERA,
    _seen("scale of the track, less 1", (0.01,), lambda world, x: replace(world, scale=float(x[0]))),
    _seen("clock of the track, less 1", (0.01,), lambda world, x: replace(world, ratio=float(x[0]))),
    _seen("release in the track's time, s late", (0.01,), lambda world, x: replace(world, late=float(x[0]))),
    _seen("height of the ground, m", (0.1,), lambda world, x: _ground(world, 0, x)),
    _seen("slope of the ground, north and east", (0.005, 0.005), lambda world, x: _ground(world, 1, x)),
    _catalogued("north, east, m/s", (0.1, 0.1), Wind),
    _catalogued("north, east, m/s, exponent 0.25", (0.1, 0.1), lambda n, e: WindShear(n, e, 0.25)),
    _catalogued("ratio less 1", (0.01,), lambda x: Density(1.0 + x), 0.7),
    _catalogued("k", (0.05,), GroundEffect, 2.0),
    _factor("lift", "CL"),
    _offset("lift", "CL", 0.005),
    _factor("drag", "CD"),
    _offset("drag", "CD", 0.002),
    _factor("pitching moment", "CM"),
    _offset("pitching moment", "CM", 0.001),
    _rate("CRr", 0.0005),
    _rate("CRp", 0.005),
    _rate("CMq", 0.005),
    _catalogued("CLr", (0.002,), SpinLift),
    _catalogued("CDrr", (0.002,), SpinDrag),
    _catalogued("CYr", (0.002,), SpinSideForce),
    _catalogued("CMr", (0.0002,), SpinPitchingMoment),
    _bias("speed, sigmas", 0),
    _bias("pitch, sigmas", 1),
    _bias("yaw, sigmas", 2),
    _bias("roll, sigmas", 3),
    _bias("nose, sigmas", 4),
    _bias("spin, rad/s", 5, 0.035, 1.0),
)
