"""A recording that could be made next, and the words in which plans say how something turns and where it points."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, pi

from discsim.arrays import FloatArray
from discsim.recording import Samples

__all__ = ["Plan", "towards", "turns"]

_WINDS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


@dataclass(frozen=True)
class Plan:
    """A recording that could be made.

    ``text`` says in words what to do, ``state`` (s,) is where its motion starts, as its plant lays states out (of a
    free spin without what the air does), ``duration`` its length in s; what flies ends on the ground at the latest.
    ``command`` are a rate table's knots; ``lean`` how far a rig's axis is leant to north and east, rad, known to the
    person roughly and to the diagnosis not at all.
    """

    text: str
    state: FloatArray
    duration: float
    command: Samples | None = None
    lean: tuple[float, float] = (0.0, 0.0)


def turns(rate: float) -> str:
    """Return a rate (rad/s) in words."""
    way = "clockwise" if rate >= 0 else "anticlockwise"
    return f"{abs(rate) / (2 * pi):.1f} turns a second {way} seen from above"


def towards(heading: float) -> str:
    """Return a direction (rad from north, clockwise) in words."""
    angle = degrees(heading) % 360.0
    return f"towards {_WINDS[round(angle / 45.0) % 8]} ({angle:.0f}°)"
