"""Which further throw would tell two causes apart: what a camera would see of it under either.

Takes two fits; gives, for throws that differ from a measured one in a single thing, how far apart the two would have
their tracks and their touch-downs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.recording import Samples
from discsim.validation.studies.real_diagnosis.golf_causes import OWN, CauseFit, Throw, positions
from discsim.validation.studies.real_diagnosis.golf_worlds import World

__all__ = ["Decision", "decided"]

#: throws that could be made, by what they are and the change of speed (m/s), pitch, yaw, roll, nose (deg)
FURTHER = (
    ("as low as can be: pitch 0 deg", {1: 0.0}),
    ("high: pitch 25 deg", {1: 25.0}),
    ("aside: yaw 60 deg", {2: 60.0}),
    ("to the other side: yaw -60 deg", {2: -60.0}),
    ("slow: 15 m/s", {0: 15.0}),
)
#: rows of a track that is asked for, and how long it is, s
_ROWS, _LONGEST = 60, 8.0


@dataclass(frozen=True)
class Decision:
    """A throw that could be made, and by how much two causes differ on its track (rms) and its touch-down, m."""

    throw: str
    track: float
    touch_down: float


def decided(throws: Mapping[str, Throw], one: CauseFit, other: CauseFit) -> Sequence[Decision]:
    """Return throws that could be made, the one first whose track two causes tell most different.

    Each is the last throw with one thing changed, flown as stated under either cause and the wind that goes with it.
    """
    throw = list(throws.values())[-1]
    found = []
    for what, changes in FURTHER:
        conditions = throw.measured.conditions.copy()
        for column, value in changes.items():
            conditions[column] = np.radians(value) if column else value
        track = Samples(np.linspace(0.0, _LONGEST, _ROWS), np.tile(np.append(throw.place, 0.0), (_ROWS, 1)))
        asked = Throw(
            replace(throw.recording, samples={"track": track}), replace(throw.measured, conditions=conditions)
        )
        found.append(Decision(what, *_apart(asked, one, other)))
    return sorted(found, key=lambda item: -item.track)


def _apart(throw: Throw, one: CauseFit, other: CauseFit) -> tuple[float, float]:
    """Return how far apart (m) two causes have the track of a throw while both fly, and its touch-down."""
    seen, above = [], []
    for fit in (one, other):
        assert throw.recording.disc is not None
        world = fit.cause.apply(World(throw.recording.disc), fit.x)
        path = positions(throw, world, np.concatenate([np.zeros(OWN), fit.wind])[None])[0]
        seen.append(world.seen(path, throw.place))
        above.append(world.above(path))
    flying = np.minimum(*above) >= 0.0
    apart = np.linalg.norm(seen[0] - seen[1], axis=1)[flying]
    landed = [_landed(plan, height) for plan, height in zip(seen, above, strict=True)]
    return float(np.sqrt(np.mean(apart**2))), float(np.linalg.norm(landed[0] - landed[1]))


def _landed(plan: FloatArray, above: FloatArray) -> FloatArray:
    """Return the last place (2,) m of a plan before the ground."""
    flying = np.flatnonzero(above >= 0.0)
    place: FloatArray = plan[flying[-1]]
    return place
