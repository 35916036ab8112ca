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
from discsim.motion import State, Surroundings
from discsim.recording import SensorSheet
from discsim.sensors.additions import Addition, BoardSensor
from discsim.sensors.sampling import Noise, Sampling, check_lag, stated

__all__ = ["Accelerometer", "force_at", "specific_force"]


def force_at(place: FloatArray, force: FloatArray, w: FloatArray, dw: FloatArray) -> FloatArray:
    """Return the specific force f + w x (w x d) + wdot x d (..., 3), m/s^2, where that at a centre is f (..., 3).

    ``place`` d (3,) m in B is seen from there; rates and their slopes (..., 3) in B.
    """
    d, along, squared = place, w @ place, np.sum(w * w, axis=-1)
    # w x (w x d) = w (w d) - w^2 d
    f = force + w * along[..., None] - squared[..., None] * d
    f[..., 0] += dw[..., 1] * d[2] - dw[..., 2] * d[1]
    f[..., 1] += dw[..., 2] * d[0] - dw[..., 0] * d[2]
    f[..., 2] += dw[..., 0] * d[1] - dw[..., 1] * d[0]
    return np.asarray(f)


def specific_force(state: State, surroundings: Surroundings, position: FloatArray) -> FloatArray:
    """f_B = C_BN (a_N - g_N) + w x (w x d) + wdot x d, Eq. (1), (..., 3) m/s^2, at ``position`` (3,) m in B.

    The paper adds g in (1) and in its x row, (6); a sensor at rest reads minus gravity (f_z = -g), as here. d runs
    from the centre of mass, whose acceleration a_N is; ``position`` from the geometric centre.
    """
    f = state.in_body(state.acceleration - np.array([0.0, 0.0, surroundings.gravity]))
    return force_at(position - surroundings.centre_of_mass, f, state.rate, state.angular_acceleration)


@dataclass(frozen=True)
class Accelerometer(BoardSensor):
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
    #: what a lag still holds of the hand that threw, (3,) beyond the reading at the motion's start; None: nothing
    held: FloatArray | None = None
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

    def reading(self, state: State, surroundings: Surroundings) -> FloatArray:
        """Return S_T f + bias, Eq. (5), (..., n, 3) m/s^2."""
        f = self.reading_of(specific_force(state, surroundings, self.position + np.array(self.offset)))
        f = f + np.array(self.bias)
        return np.asarray(f + bias_drift(self.drift, state.t) if any(self.drift) else f)

    def reading_of(self, f: FloatArray) -> FloatArray:
        """Return what a specific force (..., 3) m/s^2 in B alone reads: S_T f of a sensor that is turned in B."""
        f = on_board(BoardRotation(*self.misalignment), on_board(self.board, f))
        return f @ sensitivity(self.scale, self.cross_axis).T if any(self.scale) or any(self.cross_axis) else f

    @property
    def limit(self) -> float:
        """Where readings clip, m/s^2."""
        return min(self.range, self.saturation.limit_m_s2)

    @property
    def sheet(self) -> SensorSheet:
        """What its data sheet states; the hidden errors are not in it."""
        return stated(self.sampling, self.noise, self.resolution, self.range, self.position)
