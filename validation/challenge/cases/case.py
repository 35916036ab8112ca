"""A case of the challenge: what is there, what is concealed in it, and what is stated of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from discsim.arrays import FloatArray
from discsim.disc import Disc, Release, Rig
from discsim.effects.catalogue import Effect
from discsim.environment import Environment
from discsim.recording import Plant, Samples
from discsim.sensors import Instruments
from discsim.validation.challenge.cases.off_catalogue import OffCatalogue

__all__ = ["LONGEST_FLIGHT_S", "MASKS", "Case", "Coast", "Concealed", "Kind", "Mask", "Run", "Turning"]

Mask = Literal[
    "stated_loosely",
    "coloured_noise",
    "second_effect",
    "few_recordings",
    "short",
    "clipped",
    "magnetometer_only",
    "near_limit",
]
#: under what an effect may hide, in words
MASKS: Mapping[Mask, str] = {
    "stated_loosely": "every coefficient is off by its stated sigma",
    "coloured_noise": "the noise of every sensor is louder than stated and correlated",
    "second_effect": "a second effect, as large as they come, hides the first",
    "few_recordings": "two recordings only",
    "short": "flights end after 1.5 s, runs of a rig after 6 s",
    "clipped": "accelerometer of 8 g and gyroscope of 500 deg/s, clipped most of the time",
    "magnetometer_only": "no other sensor",
    "near_limit": "effects of 0.4 to 4 times their detection limit",
}
#: nearly all flights of the challenge last longer, s
ORDINARY_FLIGHT_S = 3.5
#: no throw of the challenge stays up this long, s
LONGEST_FLIGHT_S = 20.0

Kind = Literal["nothing", "noise", "within_sigma", "beyond_sigma", "one", "two", "off_catalogue", "setup", "like_real"]


@dataclass(frozen=True)
class Coast:
    """One run of a spin-down rig: rate rad/s and yaw rad at the start, duration s."""

    rate: float
    yaw: float
    duration: float


@dataclass(frozen=True)
class Turning:
    """One run of a rate table: its profile, and the yaw at the start, rad."""

    profile: Samples
    yaw: float


#: what happens in one recording
Run: TypeAlias = Release | Coast | Turning


@dataclass(frozen=True)
class Concealed:
    """One effect with its size; ``recording`` is the only one it is in (from 0), or None for all."""

    effect: Effect
    recording: int | None = None


@dataclass(frozen=True)
class Case:
    """Everything about one case; only what is ``stated`` and what the instruments read reaches a recording.

    ``disc`` and ``rig`` are the true ones, ``sheets_of`` the instruments as their data sheets describe them. A flight
    is recorded until it ends or for ``longest`` (s). ``hands`` (3,) m/s^2, one for each run where there are any, are
    what a lagging accelerometer still holds of the hand that threw.
    """

    seed: int
    plant: Plant
    kind: Kind
    environment: Environment
    runs: tuple[Run, ...]
    instruments: Instruments
    sheets_of: Instruments
    concealed: tuple[Concealed, ...] = ()
    secret: OffCatalogue | None = None
    disc: Disc | None = None
    stated_disc: Disc | None = None
    rig: Rig | None = None
    stated_rig: Rig | None = None
    stated_releases: tuple[Release | None, ...] = ()
    moved: Mapping[str, float] = field(default_factory=dict)
    longest: float = LONGEST_FLIGHT_S
    hands: tuple[FloatArray, ...] = ()

    @property
    def recorded(self) -> float:
        """Shortest time that a recording lasts, s; of a flight about."""
        rig_runs = [run.duration for run in self.runs if isinstance(run, Coast)]
        return min(rig_runs, default=min(self.longest, ORDINARY_FLIGHT_S))

    @property
    def verdict(self) -> str:
        """The right answer."""
        if self.secret is not None:
            return "unexplained"
        if self.concealed:
            return "explained"
        return "recalibrated" if self.kind == "beyond_sigma" else "consistent"
