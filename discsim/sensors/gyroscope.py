"""Gyroscope: body rates, clipped at its range, with the errors of a real one."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from discsim.arrays import FloatArray, readonly, vector3
from discsim.effects.sensors import GSensitivity, GyroscopeBias, Lag, Scale, g_sensitivity
from discsim.effects.setup import BoardRotation, on_board
from discsim.motion import State, Surroundings
from discsim.sensors.accelerometer import specific_force
from discsim.sensors.additions import Addition, BoardSensor
from discsim.sensors.sampling import Noise, Sampling, check_lag

__all__ = ["Gyroscope"]


@dataclass(frozen=True)
class Gyroscope(BoardSensor):
    """A gyroscope of one to three axes; every error starts at zero, so a bare one is ideal.

    ``axes`` tells which of x, y, z exist; absent ones read NaN. ``position`` (3,) m in B is the accelerometer's stated
    place, where the specific force that fakes rates is taken (`Instruments` sees to it). ``noise``, ``resolution`` and
    ``range`` are in rad/s.
    """

    sampling: Sampling = field(default_factory=lambda: Sampling(200.0))
    axes: tuple[bool, bool, bool] = (True, True, True)
    misalignment: FloatArray = field(default_factory=lambda: readonly([0.0, 0.0, 0.0]))
    scale: Scale = field(default_factory=Scale)
    bias: GyroscopeBias = field(default_factory=GyroscopeBias)
    g_sensitivity: GSensitivity = field(default_factory=GSensitivity)
    position: FloatArray = field(default_factory=lambda: readonly([-0.0161, 0.0, 0.0]))
    lag: Lag = field(default_factory=Lag)
    noise: Noise = field(default_factory=Noise)
    resolution: float = 0.0
    range: float = float("inf")
    #: what else is added to its readings before lag and noise
    additions: tuple[Addition, ...] = ()
    #: how the board that it sits on is turned in the disc
    board: BoardRotation = field(default_factory=BoardRotation)

    def __post_init__(self) -> None:
        for name in ("position", "misalignment"):
            object.__setattr__(self, name, vector3(getattr(self, name), f"gyroscope {name}"))
        check_lag(self.lag)

    def reading(self, state: State, surroundings: Surroundings, felt: FloatArray | None = None) -> FloatArray:
        """Return the reading (..., n, 3) rad/s.

        ``felt`` is the specific force along its axes, (n, 3) m/s^2, where something tells it better than the motion.
        """
        w = on_board(BoardRotation(*self.misalignment), on_board(self.board, state.rate))
        w = w * (1.0 + np.array(self.scale)) + np.array(self.bias)
        if any(self.g_sensitivity):
            if felt is None:
                felt = on_board(self.board, specific_force(state, surroundings, self.position))
            w = w + g_sensitivity(self.g_sensitivity, felt)
        return np.asarray(w)
