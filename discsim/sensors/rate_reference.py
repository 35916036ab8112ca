"""Rate reference: an encoder, a tachometer or a rate table's own read-out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from discsim.motion import Motion
from discsim.recording import Samples, SensorSheet
from discsim.sensors.additions import Addition, added
from discsim.sensors.sampling import Noise, Sampling, digitise

__all__ = ["RateReference"]


@dataclass(frozen=True)
class RateReference:
    """The rate about z_B; ``noise`` and ``resolution`` in rad/s, ``scale`` its relative error."""

    sampling: Sampling = field(default_factory=lambda: Sampling(100.0))
    scale: float = 0.0
    noise: Noise = field(default_factory=Noise)
    resolution: float = 0.0
    #: what else is added to its readings before lag and noise
    additions: tuple[Addition, ...] = ()

    def measure(self, motion: Motion, rng: np.random.Generator) -> Samples:
        """Return the samples of a motion, value (n,) rad/s."""
        written, taken = self.sampling.instants(motion.start, motion.end, rng)
        rate = added(self.additions, (1.0 + self.scale) * motion.at(taken).rate[:, 2:], taken, motion)
        return Samples(written, digitise(rate, written, self.noise, rng, resolution=self.resolution)[:, 0])

    @property
    def sheet(self) -> SensorSheet:
        """What its data sheet states."""
        return SensorSheet(self.sampling.rate_hz, self.noise.white, self.resolution or None)
