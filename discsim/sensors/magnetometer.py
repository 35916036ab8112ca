"""Magnetometer: the local field in body axes, bent and shifted by iron, late, noisy and rounded."""

from __future__ import annotations

from dataclasses import dataclass, field

from discsim.arrays import FloatArray, readonly, vector3
from discsim.effects.sensors import HardIron, Lag, SoftIron, StrayField, hard_iron, soft_iron, stray_field
from discsim.effects.setup import BoardRotation, SiteField, field_there, on_board
from discsim.effects.timing_rows import Average
from discsim.errors import InputError
from discsim.motion import State, Surroundings
from discsim.sensors.additions import Addition, BoardSensor
from discsim.sensors.sampling import Noise, Sampling, check_lag

__all__ = ["Magnetometer"]


@dataclass(frozen=True)
class Magnetometer(BoardSensor):
    """A three-axis magnetometer; every error starts at zero, so a bare one is ideal.

    ``noise``, ``resolution`` and ``range`` are in uT; ``misalignment`` (3,) rad turns its axes. Scale and cross-axis
    errors are the diagonal and the rest of ``soft_iron``.
    """

    sampling: Sampling = field(default_factory=lambda: Sampling(100.0))
    misalignment: FloatArray = field(default_factory=lambda: readonly([0.0, 0.0, 0.0]))
    soft_iron: SoftIron = field(default_factory=SoftIron)
    hard_iron: HardIron = field(default_factory=HardIron)
    stray_field: StrayField = field(default_factory=StrayField)
    lag: Lag = field(default_factory=Lag)
    average: Average = field(default_factory=Average)
    noise: Noise = field(default_factory=Noise)
    resolution: float = 0.0
    range: float = float("inf")
    #: what else is added to its readings before lag and noise
    additions: tuple[Addition, ...] = ()
    #: how the board that it sits on is turned in the disc
    board: BoardRotation = field(default_factory=BoardRotation)
    #: how the field that is there differs from the stated one
    site: SiteField = field(default_factory=SiteField)

    def __post_init__(self) -> None:
        object.__setattr__(self, "misalignment", vector3(self.misalignment, "magnetometer misalignment"))
        check_lag(self.lag)
        if not self.stray_field.height_m > 0:
            raise InputError(f"stray field dies out over {self.stray_field.height_m:g} m, expected above zero")

    def reading(self, state: State, surroundings: Surroundings) -> FloatArray:
        """Return the reading (..., n, 3) uT."""
        m = on_board(self.board, state.in_body(field_there(self.site, surroundings.magnetic_field)))
        m = hard_iron(self.hard_iron, soft_iron(self.soft_iron, m))
        if any(self.stray_field[:3]):
            m = m + on_board(self.board, state.in_body(stray_field(self.stray_field, -state.position[..., 2])))
        return on_board(BoardRotation(*self.misalignment), m)
