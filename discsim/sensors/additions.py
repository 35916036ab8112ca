"""What all sensors share: a reading of the motion, and what is added to it before lag and noise.

That is effects which are called by their row, and laws.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Effect
from discsim.effects.sensors import Lag
from discsim.effects.timing_rows import Average
from discsim.law import Law
from discsim.motion import Motion, State, Surroundings
from discsim.recording import SENSORS, Samples, SensorSheet
from discsim.sensors.sampling import Noise, Sampling, digitise, filtered, stated

__all__ = ["Addition", "BoardSensor", "MotionSensor", "by_effect", "by_law"]

#: readings (n, k), the state they are of, whose times are since the motion's start, and the motion, to new readings
Addition: TypeAlias = Callable[[FloatArray, State, Motion], FloatArray]


class MotionSensor:
    """A sensor: what it reads of a state of motion, and what is added to that."""

    additions: tuple[Addition, ...]

    def reading(self, state: State, surroundings: Surroundings) -> FloatArray:
        """Return the readings (..., n, k) before additions, lag and noise of states whose t is since the start."""
        raise NotImplementedError

    def ideal(self, motion: Motion, t: FloatArray) -> FloatArray:
        """Return the reading (n, k) before lag and noise at instants t (n,) s of a motion."""
        state = motion.at(t)._replace(t=t - motion.start)
        readings = self.reading(state, motion.surroundings)
        for addition in self.additions:
            readings = addition(readings, state, motion)
        return readings


class BoardSensor(MotionSensor):
    """A sensor of the board: its readings lag, are noisy and rounded, and clip at ``limit``."""

    sampling: Sampling
    lag: Lag
    #: how far its rows show means of two samples
    average: Average = Average()
    #: what a lag still holds at the motion's start beyond the reading there, in the sensor's unit; None: nothing
    held: FloatArray | None = None
    noise: Noise
    resolution: float
    range: float
    #: which of x, y, z exist
    axes: tuple[bool, bool, bool] = (True, True, True)

    @property
    def limit(self) -> float:
        """Where readings clip, in the sensor's unit."""
        return self.range

    def measure(self, motion: Motion, rng: np.random.Generator) -> Samples:
        """Return the samples of a motion, value (n, 3) in the sensor's unit."""
        written, taken, before = self.sampling.acquired(motion.start, motion.end, rng)
        value = filtered(self.lag, motion, lambda t: self.ideal(motion, t), taken, self.held)
        if self.average.weight > 0.0:
            earlier = filtered(self.lag, motion, lambda t: self.ideal(motion, t), np.minimum(before, taken), self.held)
            value = (1.0 - self.average.weight) * value + self.average.weight * earlier
        step, axes = self.resolution, np.array(self.axes)
        return Samples(written, digitise(value, written, self.noise, rng, resolution=step, limit=self.limit, axes=axes))

    @property
    def sheet(self) -> SensorSheet:
        """What its data sheet states; the hidden errors are not in it."""
        return stated(self.sampling, self.noise, self.resolution, self.range)


def by_effect(effect: Effect) -> Addition:
    """Return what an effect with a function of its own does to its sensor's readings."""
    applied = effect.applied
    assert applied is not None

    def addition(readings: FloatArray, state: State, motion: Motion) -> FloatArray:
        return applied.on_readings(tuple(effect.value), readings, state.t, state)

    return addition


def by_law(law: Law) -> Addition:
    """Return what a law about a sensor's column adds to its readings; V is relative to the known wind."""
    sensor, _, column = law.target.partition(".")
    place = SENSORS[sensor].columns.index(column)

    def addition(readings: FloatArray, state: State, motion: Motion) -> FloatArray:
        changed = readings.copy()
        changed[:, place] += law.evaluate(_symbols(readings, state, motion))
        return changed

    return addition


def _symbols(readings: FloatArray, state: State, motion: Motion) -> dict[str, FloatArray]:
    """Return the symbols of a law, each (n,)."""
    u, v, w = state.in_body(state.velocity - motion.environment.wind).T
    beta = np.arctan2(v, u)
    P, Q, r = state.rate.T
    from scipy.interpolate import CubicHermiteSpline  # loads in a third of a second, and few sensors have a law

    spin = CubicHermiteSpline(motion.t, motion.rate[:, 2], motion.angular_acceleration[:, 2])
    read = {name: readings[:, k] for k, name in enumerate("xyz") if k < readings.shape[1]}
    return {
        "t": state.t,
        "h": -state.position[:, 2],
        "V": np.sqrt(u * u + v * v + w * w),
        "alpha": np.arctan2(w, np.hypot(u, v)),
        "p_H": np.cos(beta) * P + np.sin(beta) * Q,
        "q_H": np.cos(beta) * Q - np.sin(beta) * P,
        "r": r,
        "psi": spin.antiderivative()(motion.start + state.t),
        **read,
    }
