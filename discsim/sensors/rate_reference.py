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
    """The rate about z_B; ``noise`` and ``resolution`` in rad/s, ``scale`` its relative error.

    An encoder of ``counts_per_turn`` tells the counts between two instants half a sampling interval before and after a
    reading's; its noise has a part in proportion to the rate, ``noise_share``, stated for ``largest_rate`` (rad/s).
    """

    sampling: Sampling = field(default_factory=lambda: Sampling(100.0))
    scale: float = 0.0
    noise: Noise = field(default_factory=Noise)
    resolution: float = 0.0
    counts_per_turn: int = 0
    noise_share: float = 0.0
    largest_rate: float = 0.0
    #: what else is added to its readings before lag and noise
    additions: tuple[Addition, ...] = ()

    def reading(self, state: State, surroundings: Surroundings) -> FloatArray:
        """Return the rate about z_B, (..., n, 1) rad/s."""
        return np.asarray((1.0 + self.scale) * state.rate[..., 2:])

    def measure(self, motion: Motion, rng: np.random.Generator) -> Samples:
        """Return the samples of a motion, value (n,) rad/s."""
        written, taken = self.sampling.instants(motion.start, motion.end, rng)
        rate = self.ideal(motion, taken)
        if self.noise_share > 0.0:
            rate = rate * (1.0 + self.noise_share * rng.standard_normal(rate.shape))
        if self.counts_per_turn > 0:
            rate = rate + self._counted(motion, taken)[:, None]
        return Samples(written, digitise(rate, written, self.noise, rng, resolution=self.resolution)[:, 0])

    def _counted(self, motion: Motion, t: FloatArray) -> FloatArray:
        """Return what counting adds to the rate at instants t (n,): its steps, and the mean over the interval."""
        from scipy.interpolate import CubicSpline  # loads in a third of a second, and few have an encoder

        # what is added to a reading may take away what an encoder does not see, such as the turning of its frame
        spin = CubicSpline(motion.t, self.ideal(motion, motion.t)[:, 0])
        half, count = 0.5 / self.sampling.rate_hz, 2.0 * np.pi / self.counts_per_turn
        first, last = np.maximum(t - half, motion.start), np.minimum(t + half, motion.end)
        turned = np.floor(spin.antiderivative()(np.stack([first, last])) / count)
        told = count * (turned[1] - turned[0]) / (last - first)
        return np.asarray(told - spin(t))

    @property
    def sheet(self) -> SensorSheet:
        """What its data sheet states; of noise in proportion to the rate that at the largest."""
        # the difference of two roundings of uniform error over the interval between them
        counting = (
            2.0 * np.pi / self.counts_per_turn / np.sqrt(6.0) * self.sampling.rate_hz if self.counts_per_turn else 0.0
        )
        noise = float(np.sqrt(self.noise.white**2 + counting**2 + (self.noise_share * self.largest_rate) ** 2))
        return SensorSheet(self.sampling.rate_hz, noise, self.resolution or None)
