"""Fifty-six metres against the paper's 72: what one unknown alone would have to be."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from discsim.arrays import FloatArray
from discsim.disc import Disc
from discsim.environment import Environment
from discsim.shipped import load_disc, load_throw
from discsim.validation.studies.paper.releases import PaperThrow, carry
from discsim.validation.yaw_damping.paper_table import SPEEDS_M_S

__all__ = ["PAPER_M", "UNKNOWNS", "distances"]

#: distance of the throw that the paper maps, m (Fig. 10)
PAPER_M = 72.0
#: between which each unknown is looked through: coefficients as published (models/discs/driver.toml; CD0 and alpha0 of
#: the five measured discs and a little more), the sum of disc and module within 10 %, speeds and headings of a hand
UNKNOWNS: Mapping[str, tuple[float, float, str]] = {
    "speed": (15.0, 32.0, "m/s"),
    "climb": (-5.0, 25.0, "deg"),
    "heading": (70.0, 150.0, "deg"),
    "spin": (2500.0, 7000.0, "deg/s"),
    "mass": (0.161, 0.197, "kg"),
    "CL0": (0.08, 0.33, ""),
    "CLa": (1.9, 3.1, ""),
    "CD0": (0.03, 0.10, ""),
    "CDa": (0.7, 3.3, ""),
    "alpha0": (-0.1, 0.0, "rad"),
    "CM0": (-0.05, 0.02, ""),
    "CMa": (0.06, 0.43, ""),
    "CRr": (-0.01, 0.01, ""),
    "CRp": (-0.25, 0.0, ""),
    "CNr": (-0.009, 0.0, ""),
}
#: highest airspeed of the paper's table, m/s
FASTEST_M_S = float(SPEEDS_M_S[-1])
#: values looked at of each unknown: neighbours differ by 2.5 % of the range
_STEPS = 41


def distances(disc: Disc, environment: Environment) -> dict[str, Any]:
    """Return the carry as taken, and of each unknown the least and greatest carry and the values that give 72 m.

    ``needed_at_23`` are those values at 23 m/s, the highest speed of the paper's table.
    """
    taken, fastest = PaperThrow(), PaperThrow(speed=FASTEST_M_S)
    baseline, flight = carry(disc, environment, taken.release)
    found: dict[str, Any] = {}
    for name, (low, high, unit) in UNKNOWNS.items():
        carried, needed = _look_through(_carrier(disc, environment, name, taken), low, high)
        _, at_23 = _look_through(_carrier(disc, environment, name, fastest), low, high)
        found[name] = {
            "unit": unit,
            "taken": _taken(disc, name),
            "range": [low, high],
            "least_m": carried.min(),
            "most_m": carried.max(),
            "needed": needed,
            "needed_at_23": at_23 if name != "speed" else [],
        }
    slow, _ = carry(disc, environment, fastest.release)
    return {
        "m": baseline,
        "s": flight.end,
        "at_23_m": slow,
        "unknowns": found,
        "discs": _discs(),
        "undamped_m": _undamped(),
    }


def _look_through(metres: Callable[[float], float], low: float, high: float) -> tuple[FloatArray, list[float]]:
    """Return carries (n,) m from low to high, and the values in between that carry 72 m."""
    values = np.linspace(low, high, _STEPS)
    carried = np.array([metres(value) for value in values])
    short = carried < PAPER_M
    roots = [
        float(brentq(lambda value: metres(value) - PAPER_M, a, b, xtol=1e-5 * (high - low)))
        for a, b, turns in zip(values[:-1], values[1:], short[:-1] != short[1:], strict=True)
        if turns
    ]
    return carried, roots


def _carrier(disc: Disc, environment: Environment, name: str, base: PaperThrow) -> Callable[[float], float]:
    """Return carry (m) as a function of one unknown, the others as taken."""

    def metres(value: float) -> float:
        throw, flown = base, disc
        if name in ("speed", "climb", "heading", "spin"):
            throw = replace(throw, **{name: value})
        elif name == "mass":
            share = value / disc.mass
            flown = replace(disc, mass=value, Ixx=disc.Ixx * share, Izz=disc.Izz * share)
        else:
            assert disc.aero is not None
            flown = replace(disc, aero=disc.aero._replace(**{name: value}))
        return carry(flown, environment, throw.release)[0]

    return metres


def _taken(disc: Disc, name: str) -> float:
    if name == "mass":
        return disc.mass
    if hasattr(PaperThrow(), name):
        return float(getattr(PaperThrow(), name))
    assert disc.aero is not None
    return float(getattr(disc.aero, name))


def _discs() -> dict[str, float]:
    """Return the carry of each shipped disc from the paper's release as taken."""
    names = ("driver", "dd2", "cd1", "cd5", "fd2", "ultrastar")
    return {name: carry(*load_disc(name), PaperThrow().release)[0] for name in names}


def _undamped() -> dict[str, list[float]]:
    """Return how far the touch-down of each shipped disc moves without yaw damping, paper's and driver's release, m."""
    moved: dict[str, list[float]] = {}
    for name in ("driver", "dd2", "cd1", "cd5", "fd2", "ultrastar"):
        disc, environment = load_disc(name)
        assert disc.aero is not None
        without = replace(disc, aero=disc.aero._replace(CNr=0.0))
        moved[name] = [
            float(np.linalg.norm(carry(without, environment, r)[1].landing - carry(disc, environment, r)[1].landing))
            for r in (PaperThrow().release, load_throw("driver"))
        ]
    return moved
