"""Fig. 9: the disc with the module of 37 g and with that of 15 g, thrown alike, and as an arm or the paper has it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from discsim.disc import Disc, Release
from discsim.environment import Environment
from discsim.module import Module, loaded
from discsim.shipped import load_throw
from discsim.trajectory import predict
from discsim.validation.studies.paper.releases import PaperThrow, carry

__all__ = ["NEW", "OLD", "TWO_MODULES", "bare_disc", "compare_modules", "two_throws"]

#: the paper's disc without a module, kg
BARE_KG = 0.164
#: the plates of the two modules: masses as the paper weighs them; their size it does not print. Of at most 30 mm of
#: radius: the inertia then differs by 0.9 %, and that is all the size is worth here
OLD, NEW = Module(0.037, radius=0.03), Module(0.015, radius=0.03)
#: how much more the paper found with the lighter module: spin, and time and distance of flight
MORE_SPIN, MORE_DISTANCE = 1.10, 1.30
#: what is kept alike, or set, between the two throws
TWO_MODULES = ("same speed and spin", "same energy of speed and of spin", "speed and spin 10 % lower with 37 g")
#: a module of 4 by 1.5 cm across the wind, and a bluff body's drag coefficient: its share of C_D
STICKS_OUT_CD = 1.1 * 0.04 * 0.015 / (np.pi * 0.212**2 / 4)


def bare_disc(disc: Disc) -> Disc:
    """Return the driver as heavy as the paper's disc, its inertia in proportion."""
    share = BARE_KG / disc.mass
    return replace(disc, mass=BARE_KG, Ixx=disc.Ixx * share, Izz=disc.Izz * share)


@dataclass(frozen=True)
class _Pair:
    old: Disc
    new: Disc

    def factors(self, way: str) -> tuple[float, float]:
        """Return speed and spin with the old module over those with the new one."""
        if way == TWO_MODULES[1]:
            return float(np.sqrt(self.new.mass / self.old.mass)), float(np.sqrt(self.new.Izz / self.old.Izz))
        return (1.0, 1.0) if way == TWO_MODULES[0] else (1 / MORE_SPIN, 1 / MORE_SPIN)


def two_throws(disc: Disc, release: Release, way: str) -> tuple[tuple[Disc, Release], tuple[Disc, Release]]:
    """Return disc and release with the old module, and with the new one, whose release is the one given."""
    pair = _Pair(loaded(bare_disc(disc), OLD)[0], loaded(bare_disc(disc), NEW)[0])
    speed, spin = pair.factors(way)
    assert release.velocity is not None
    assert release.body_rate is not None
    slower = replace(release, velocity=speed * release.velocity, body_rate=spin * release.body_rate)
    return (pair.old, slower), (pair.new, release)


def compare_modules(disc: Disc, environment: Environment) -> dict[str, Any]:
    """Return spin, time and distance with 15 g over those with 37 g, and the drag that would make the paper's ratio."""
    found: dict[str, Any] = {}
    for name, release in (("paper", PaperThrow().release), ("driver", load_throw("driver"))):
        for way in TWO_MODULES:
            (old, slower), (new, given) = two_throws(disc, release, way)
            far, fast = carry(new, environment, given)
            near, slow = carry(old, environment, slower)
            bluff, _ = carry(_draggier(old, STICKS_OUT_CD), environment, slower)
            assert given.body_rate is not None
            assert slower.body_rate is not None
            found[f"{name}: {way}"] = {
                "spin": given.body_rate[2] / slower.body_rate[2],
                "distance": far / near,
                "time": fast.end / slow.end,
                "distance_with_bluff_module": far / bluff,
                "more_CD_needed": _drag_needed(old, environment, slower, far / MORE_DISTANCE),
                "decay": [1 - flight.state[-1, 12] / flight.state[0, 12] for flight in (slow, fast)],
            }
    old, new = (loaded(bare_disc(disc), module)[0] for module in (OLD, NEW))
    return {
        "ways": found,
        "mass": [old.mass, new.mass],
        "Izz": [old.Izz, new.Izz],
        "bluff_CD": STICKS_OUT_CD,
        "CD0": disc.aero.CD0 if disc.aero is not None else np.nan,
    }


def _draggier(disc: Disc, more: float) -> Disc:
    assert disc.aero is not None
    return replace(disc, aero=disc.aero._replace(CD0=disc.aero.CD0 + more))


def _drag_needed(disc: Disc, environment: Environment, release: Release, metres: float) -> float:
    """Return the addition to CD0 with which a throw carries so far; NaN where none between 0 and 0.3 does."""

    def excess(more: float) -> float:
        return float(np.hypot(*predict(_draggier(disc, more), environment, release).landing[:2])) - metres

    if excess(0.0) < 0.0 or excess(0.3) > 0.0:
        return float("nan")
    return float(brentq(excess, 0.0, 0.3, xtol=1e-5))
