"""Rate tables: drive, encoder, field and second axis of one, shipped or read from a TOML file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.effects.catalogue import Effect
from discsim.environment import Environment
from discsim.limits import LONGEST_RUN
from discsim.motion import Motion, State
from discsim.recording import Samples
from discsim.rig import read_profile, turn_table
from discsim.second_axis import SecondAxis
from discsim.sensors import Instruments, RateReference
from discsim.sensors.sampling import Noise, Sampling
from discsim.shipped import shipped_or_path
from discsim.table_drive import TableDrive, read_drive
from discsim.table_field import TableField, read_field
from discsim.toml_table import TomlTable, read_toml

__all__ = ["RateTable", "load_table"]


@dataclass(frozen=True)
class RateTable:
    """A rate table: by default one that turns as commanded, disturbs no sensor and tells its rate by AC1120S's figures.

    ``encoder`` None leaves the rate reference to the parts.
    """

    name: str = "ideal"
    drive: TableDrive = field(default_factory=TableDrive)
    encoder: RateReference | None = None
    stray: TableField = field(default_factory=TableField)
    second: SecondAxis | None = None

    def run(
        self, profile: Samples, environment: Environment, effects: tuple[Effect, ...] = (), **how: object
    ) -> Motion:
        """Return the true motion of the table for a profile; ``how`` are options of `turn_table`."""
        motion = turn_table(
            self.drive.follow(profile),
            environment,
            effects,
            inertia=self.drive.inertia,
            **how,  # type: ignore[arg-type]
        )
        return motion if self.second is None else self.second.carry(motion)

    def fit_out(self, module: Instruments) -> Instruments:
        """Return a module with the table's encoder, and its magnetometer in the table's field."""
        if self.encoder is not None:
            module = replace(module, sensors={**module.sensors, "rate_reference": self.encoder})
        if self.second is not None and "rate_reference" in module.sensors:
            module = module.adding("rate_reference", self._unseen)
        if not self.stray.is_none and "magnetometer" in module.sensors:
            module = module.adding("magnetometer", self._disturb)
        return module

    def _unseen(self, readings: FloatArray, state: State, motion: Motion) -> FloatArray:
        assert self.second is not None
        return self.second.unseen(readings, motion.start + state.t, motion)

    def _disturb(self, readings: FloatArray, state: State, motion: Motion) -> FloatArray:
        return readings + self.stray.at(motion.start + state.t, motion, self.drive, self.second)


def load_table(name_or_path: str | PathLike[str]) -> RateTable:
    """Return a shipped rate table (``ac1120s``), or that of a TOML file (docs/rate-table.md).

    Raises `InputError`: a name that is neither shipped nor a file, or what is wrong in the file.
    """
    path = shipped_or_path("tables", name_or_path)
    top = read_toml(path)
    name = top.text("name", required=False) or path.stem
    drive = read_drive(top.table("drive"))
    table = RateTable(
        name,
        drive,
        _encoder(top.table("encoder"), drive),
        read_field(top.table("field")),
        _second(top.table("second_axis"), path.parent),
    )
    top.finish()
    return table


def _encoder(table: TomlTable | None, drive: TableDrive) -> RateReference | None:
    if table is None:
        return None
    counts = table.raw("counts_per_turn")
    if counts is not None and (isinstance(counts, bool) or not isinstance(counts, int) or counts < 1):
        raise table.error("counts_per_turn", f"'encoder.counts_per_turn' is {counts!r}, expected a whole number from 1")
    share = table.number("noise_share", required=False, minimum=0.0) or 0.0
    largest = table.number("largest_rate", "deg_s", required=False, positive=True)
    rate = drive.largest_rate if largest is None else float(np.radians(largest))
    if share > 0.0 and not np.isfinite(rate):
        raise table.error(
            "noise_share",
            "encoder.noise_share needs encoder.largest_rate_deg_s or drive.largest_rate_deg_s, to state it",
        )
    encoder = RateReference(
        Sampling(table.need("rate", "hz", positive=True)),
        noise=Noise(table.number("noise_rms", "rad_s", required=False, minimum=0.0) or 0.0),
        resolution=table.number("resolution", "rad_s", required=False, minimum=0.0) or 0.0,
        counts_per_turn=counts or 0,
        noise_share=share,
        largest_rate=rate if share > 0.0 else 0.0,
    )
    table.finish()
    return encoder


def _second(table: TomlTable | None, folder: Path) -> SecondAxis | None:
    if table is None:
        return None
    direction = table.vector("direction_ned", "")
    arm = table.vector("arm_ned", "m", default=(0.0, 0.0, 0.0))
    profile, steady = table.text("profile", required=False), table.number("rate", "deg_s", required=False)
    if (profile is None) == (steady is None):
        raise table.error(None, "[second_axis] expected one of profile (a file) and rate_deg_s")
    if profile is not None:
        knots = read_profile(folder / profile)
    else:
        knots = Samples(np.array([0.0, LONGEST_RUN]), np.full(2, np.radians(steady or 0.0)))
    table.finish()
    assert direction is not None
    assert arm is not None
    if not np.linalg.norm(direction) > 0.0:
        raise table.error("direction_ned", "second_axis.direction_ned is zero; expected a direction")
    return SecondAxis(direction, knots, readonly(arm))
