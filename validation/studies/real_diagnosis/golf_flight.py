"""A tracked throw flown from its stated release by a model, and how far from the track that comes down."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.model_file import Model
from discsim.recording import Recording
from discsim.trajectory import predict

__all__ = ["Flown", "flown"]


@dataclass(frozen=True)
class Flown:
    """A throw flown from its stated release by a model.

    Attributes
    ----------
    t : (m,) array
        Times of the track up to the touch-down, s.
    path : (m, 2) array
        The flight there, north and east, m.
    landing : (3,) array
        North, east (m) and time (s) of the touch-down.
    miss : (2,) array
        Touch-down less the track's end, m.
    on_the_way : float
        Root mean square distance in plan while both fly, m.
    """

    t: FloatArray
    path: FloatArray
    landing: FloatArray
    miss: FloatArray
    on_the_way: float

    @property
    def distance(self) -> float:
        """Length of the miss, m."""
        return float(np.linalg.norm(self.miss))


def flown(recording: Recording, model: Model, name: str | None = None) -> Flown:
    """Fly a recording's stated release by a model and hold it against the track.

    Effects that the model has in single recordings alone act only in the one called ``name``. The yaw of a release
    that does not state it is taken as zero: the phase of the spin, which moves no round disc.
    """
    assert model.disc is not None
    assert recording.release is not None
    release = replace(recording.release, yaw=recording.release.yaw or 0.0)
    flight = predict(model.disc, model.environment, release, model.effects_in(name), law=model.laws)
    track = recording.need("track")
    plan = track.value[:, :2]
    both = (track.t >= 0.0) & (track.t <= flight.end)
    path = flight.at(track.t[both]).position[:, :2]
    apart = np.linalg.norm(path - plan[both], axis=1)
    landing = np.array([*flight.landing[:2], flight.touch_down])
    return Flown(track.t[both], path, landing, landing[:2] - plan[-1], float(np.sqrt(np.mean(apart**2))))
