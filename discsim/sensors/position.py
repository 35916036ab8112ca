"""What sees the disc move: a GPS receiver on board, a camera or radar that tracks it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.sensors import Latency
from discsim.effects.track_rows import Camera, pictured
from discsim.errors import InputError
from discsim.motion import Motion, State, Surroundings
from discsim.recording import Samples, SensorSheet
from discsim.sensors.additions import Addition, MotionSensor
from discsim.sensors.sampling import Noise, Sampling

__all__ = ["Gps", "Tracker"]


@dataclass(frozen=True)
class Gps(MotionSensor):
    """Position and velocity of the centre of mass; noise in m and m/s per axis.

    A fix stamped t shows the state at t - delay, and there is none before t = delay.
    """

    sampling: Sampling = field(default_factory=lambda: Sampling(10.0))
    latency: Latency = field(default_factory=Latency)
    position_noise: Noise = field(default_factory=Noise)
    velocity_noise: Noise = field(default_factory=Noise)
    #: what else is added to its readings before lag and noise
    additions: tuple[Addition, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.latency.delay_s < np.inf:
            raise InputError(f"gps latency is {self.latency.delay_s:g} s, expected zero or more")

    def reading(self, state: State, surroundings: Surroundings) -> FloatArray:
        """Return position and velocity, (..., n, 6)."""
        return np.concatenate((state.position, state.velocity), axis=-1)

    def measure(self, motion: Motion, rng: np.random.Generator) -> Samples:
        """Return the fixes of a motion, value (n, 6): position in m, velocity in m/s, in N."""
        written, taken = self.sampling.instants(motion.start, motion.end, rng)
        seen = taken - self.latency.delay_s
        some = seen >= motion.start
        written, shown = written[some], self.ideal(motion, seen[some])
        position = shown[:, :3] + self.position_noise.sample(written, 3, rng)
        velocity = shown[:, 3:] + self.velocity_noise.sample(written, 3, rng)
        fixes = np.hstack((position, velocity)).astype(np.float64)
        return Samples(written, np.round(fixes, 9))

    @property
    def sheet(self) -> SensorSheet:
        """What its data sheet states."""
        return SensorSheet(
            self.sampling.rate_hz, self.position_noise.white, velocity_noise_rms=self.velocity_noise.white
        )


@dataclass(frozen=True)
class Tracker(MotionSensor):
    """A camera or radar that sees the centre of mass; noise in m per axis, a share ``unseen`` of coordinates lost.

    The plan of a ``camera`` whose height is not taken into account has what flies too far out.
    """

    sampling: Sampling = field(default_factory=lambda: Sampling(30.0))
    noise: Noise = field(default_factory=Noise)
    unseen: float = 0.0
    camera: Camera = field(default_factory=Camera)
    #: what else is added to its readings before lag and noise
    additions: tuple[Addition, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.unseen < 1:
            raise InputError(f"share of coordinates unseen is {self.unseen:g}, expected 0 to below 1")

    def reading(self, state: State, surroundings: Surroundings) -> FloatArray:
        """Return the position, (..., n, 3), as the camera's plan has it."""
        return pictured(self.camera, state.position)

    def measure(self, motion: Motion, rng: np.random.Generator) -> Samples:
        """Return the track of a motion, value (n, 3) m in N, NaN where unseen."""
        written, taken = self.sampling.instants(motion.start, motion.end, rng)
        position = np.add(self.ideal(motion, taken), self.noise.sample(written, 3, rng)).round(9)
        if self.unseen > 0:
            position[rng.random(position.shape) < self.unseen] = np.nan
        return Samples(written, position)

    @property
    def sheet(self) -> SensorSheet:
        """What its data sheet states."""
        return SensorSheet(self.sampling.rate_hz, self.noise.white)
