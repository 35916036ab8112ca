"""Accelerometer: specific force at its place on the disc, Eq. (1), through the error model (3)-(5)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from discsim.arrays import FloatArray, readonly, vector3
from discsim.effects.sensors import (
    AccelerometerBias,
    AccelerometerSaturation,
    BiasDrift,
    CrossAxis,
    Lag,
    PositionOffset,
    Scale,
    bias_drift,
    sensitivity,
)
from discsim.effects.setup import BoardRotation, on_board
from discsim.errors import InputError
from discsim.frames import body_to_ned, turn
from discsim.motion import Motion, State
from discsim.recording import Samples, SensorSheet
from discsim.sensors.additions import Addition, added
from discsim.sensors.sampling import Noise, Sampling, check_lag, digitise, filtered, stated

__all__ = ["Accelerometer", "specific_force"]


def specific_force(state: State, motion: Motion, position: FloatArray) -> FloatArray:
    """f_B = C_BN (a_N - g_N) + w x (w x d) + wdot x d, Eq. (1), (n, 3) m/s^2, at ``position`` (3,) m in B.

    The paper adds g in (1) and in its x row, (6); a sensor at rest reads minus gravity (f_z = -g), as here. d runs
    from the centre of mass, whose acceleration a_N is; ``position`` from the geometric centre.
    """
    d = np.broadcast_to(position - motion.centre_of_mass, state.rate.shape)
    gravity = np.array([0.0, 0.0, motion.environment.gravity])
    centripetal = np.cross(state.rate, np.cross(state.rate, d))
    tangential = np.cross(state.angular_acceleration, d)
    return np.asarray(state.in_body(state.acceleration - gravity) + centripetal + tangential)


@dataclass(frozen=True)
class Accelerometer:
    """A three-axis accelerometer by (3); every error starts at zero, so a bare one is ideal.

    ``position`` (3,) m in B is where it is stated to sit and ``offset`` what that is wrong by; ``misalignment`` (3,)
    rad turns its axes. ``noise``, ``resolution`` and ``range`` are in m/s^2.
    """

    sampling: Sampling = field(default_factory=lambda: Sampling(200.0))
    position: FloatArray = field(default_factory=lambda: readonly([-0.0161, 0.0, 0.0]))
    offset: PositionOffset = field(default_factory=PositionOffset)
    misalignment: FloatArray = field(default_factory=lambda: readonly([0.0, 0.0, 0.0]))
    scale: Scale = field(default_factory=Scale)
    cross_axis: CrossAxis = field(default_factory=CrossAxis)
    bias: AccelerometerBias = field(default_factory=AccelerometerBias)
    drift: BiasDrift = field(default_factory=BiasDrift)
    lag: Lag = field(default_factory=Lag)
    saturation: AccelerometerSaturation = field(default_factory=AccelerometerSaturation)
    noise: Noise = field(default_factory=Noise)
    resolution: float = 0.0
    range: float = float("inf")
    #: what else is added to its readings before lag and noise
    additions: tuple[Addition, ...] = ()
    #: how the board that it sits on is turned in the disc
    board: BoardRotation = field(default_factory=BoardRotation)

    def __post_init__(self) -> None:
        for name in ("position", "misalignment"):
            object.__setattr__(self, name, vector3(getattr(self, name), f"accelerometer {name}"))
        check_lag(self.lag)
        if not self.saturation.limit_m_s2 > 0:
            raise InputError(f"accelerometer saturates at {self.saturation.limit_m_s2:g} m/s^2, expected above zero")

    def ideal(self, motion: Motion, t: FloatArray) -> FloatArray:
        """Return the reading (n, 3) m/s^2 before lag and noise, S_T f + bias, Eq. (5), at instants t (n,)."""
        f = specific_force(motion.at(t), motion, self.position + np.array(self.offset))
        turned = on_board(self.board, f) @ body_to_ned(turn(self.misalignment))
        drifting = bias_drift(self.drift, t - motion.start)
        reading = turned @ sensitivity(self.scale, self.cross_axis).T + np.array(self.bias) + drifting
        return added(self.additions, np.asarray(reading), t, motion)

    def measure(self, motion: Motion, rng: np.random.Generator) -> Samples:
        """Return the samples of a motion, value (n, 3) m/s^2."""
        written, taken = self.sampling.instants(motion.start, motion.end, rng)
        value = filtered(self.lag, motion, lambda t: self.ideal(motion, t), taken)
        limit = min(self.range, self.saturation.limit_m_s2)
        reading = digitise(value, written, self.noise, rng, resolution=self.resolution, limit=limit)
        return Samples(written, reading)

    @property
    def sheet(self) -> SensorSheet:
        """What its data sheet states; the hidden errors are not in it."""
        return stated(self.sampling, self.noise, self.resolution, self.range, self.position)
