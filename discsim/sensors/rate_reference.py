"""Rate reference: an encoder, a tachometer or a rate table's own read-out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from discsim.arrays import FloatArray
from discsim.motion import Motion, State, Surroundings
from discsim.recording import Samples, SensorSheet
from discsim.sensors.additions import Addition, MotionSensor
from discsim.sensors.sampling import Noise, Sampling, digitise

__all__ = ["RateReference"]


@dataclass(frozen=True)
class RateReference(MotionSensor):
    """The rate about z_B; ``noise`` and ``resolution`` in rad/s, ``scale`` its relative error."""

    sampling: Sampling = field(default_factory=lambda: Sampling(100.0))
    scale: float = 0.0
    noise: Noise = field(default_factory=Noise)
    resolution: float = 0.0
    #: what else is added to its readings before lag and noise
    additions: tuple[Addition, ...] = ()

    def reading(self, state: State, surroundings: Surroundings) -> FloatArray:
        """Return the rate about z_B, (..., n, 1) rad/s."""
        return np.asarray((1.0 + self.scale) * state.rate[..., 2:])

    def measure(self, motion: Motion, rng: np.random.Generator) -> Samples:
        """Return the samples of a motion, value (n,) rad/s."""
        written, taken = self.sampling.instants(motion.start, motion.end, rng)
        return Samples(
            written, digitise(self.ideal(motion, taken), written, self.noise, rng, resolution=self.resolution)[:, 0]
        )

    @property
    def sheet(self) -> SensorSheet:
        """What its data sheet states."""
        return SensorSheet(self.sampling.rate_hz, self.noise.white, self.resolution or None)
