"""Releases as the paper tells them, and how far they carry."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from discsim.disc import Disc, Release
from discsim.environment import Environment
from discsim.shipped import load_throw
from discsim.trajectory import Flight, predict

__all__ = ["PaperThrow", "carry"]


@dataclass(frozen=True)
class PaperThrow:
    """The paper's attitude (section 4.4) with what it does not print: m/s, degrees and deg/s.

    The defaults are those of models/throws/paper.toml.
    """

    speed: float = 24.0
    heading: float = 112.0
    climb: float = 10.0
    spin: float = 4200.0

    @property
    def release(self) -> Release:
        """The release state."""
        climb, heading = np.radians(self.climb), np.radians(self.heading)
        level = np.cos(climb)
        along = np.array([level * np.cos(heading), level * np.sin(heading), -np.sin(climb)])
        return replace(
            load_throw("paper"),
            velocity=self.speed * along,
            body_rate=np.array([0.0, 0.0, np.radians(self.spin)]),
        )


def carry(disc: Disc, environment: Environment, release: Release) -> tuple[float, Flight]:
    """Return how far from the release a flight touches down, m, and the flight."""
    flight = predict(disc, environment, release)
    return float(np.hypot(*flight.landing[:2])), flight
