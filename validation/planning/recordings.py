"""Recordings that are planned, as they would come out without noise: what their information is taken from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.disc import Disc, Rig
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.recording import SENSORS, Plant, Recording, Samples, SensorSheet
from discsim.sensors import Instruments
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.identification.parameters import Values
from discsim.validation.identification.plants import PLANTS
from discsim.validation.identification.plants.plan import Plan
from discsim.validation.identification.prediction import read, shown
from discsim.validation.identification.readings import Readings
from discsim.validation.identification.segments import Trajectory, resegmented, trajectory_of

__all__ = ["Bench", "planned_trajectory", "plans_like"]

_NO_VALUES: Values = {}
#: a throw ends on the ground, at the latest after this long, s
_LONGEST_THROW = 15.0


@dataclass(frozen=True)
class Bench:
    """What planned recordings are made with: plant, place, disc or rig, and what the sensors' sheets state."""

    plant: Plant
    environment: Environment
    disc: Disc | None
    rig: Rig | None
    sheets: dict[str, SensorSheet]

    @classmethod
    def of(
        cls,
        plant: Plant,
        environment: Environment,
        parts: Sequence[str],
        disc: Disc | None = None,
        rig: Rig | None = None,
    ) -> Bench:
        """Return the bench of parts by name; raises `InputError` for an unknown part."""
        instruments = Instruments.from_parts(*parts)
        seen = ("gps", "track") if not PLANTS[plant].follows_path else ("rate_reference",) * PLANTS[plant].airborne
        sheets = {name: part.sheet for name, part in instruments.sensors.items() if name not in seen}
        if not sheets:
            raise InputError(f"{', '.join(parts)}: no sensor of these works on a {plant}; expected one that does")
        if not PLANTS[plant].airborne:
            environment = replace(environment, air_density=None)
        return cls(plant, environment, disc, rig, sheets)

    @classmethod
    def like(cls, recording: Recording) -> Bench:
        """Return the bench of a recording in hand."""
        one = recording
        return cls(one.plant, one.environment, one.disc, one.rig, {name: one.sheets[name] for name in one.samples})

    def recording(self) -> Recording:
        """Return a recording of this bench without readings."""
        return Recording(self.plant, "planned", self.environment, self.disc, self.rig, sheets=self.sheets)


def plans_like(recordings: Sequence[Recording]) -> list[Plan]:
    """Return plans of recordings like those in hand: from where their motion seems to start, by their data."""
    plans = []
    for one in recordings:
        first = first_trajectory(one)
        what = f"as {one.name} again" if one.name else "one as in hand again"
        duration = _LONGEST_THROW if first.plant.follows_path else one.end
        plans.append(Plan(what, first.states[0], duration, one.command))
    return plans


def planned_trajectory(plan: Plan, bench: Bench) -> Trajectory | None:
    """Return a plan as it would be recorded without noise, cut into segments that are continuous.

    None where it cannot be made: a throw that starts on the ground, numbers that leave what is finite. Raises
    `InputError` where the bench lacks what its plant needs.
    """
    bare = replace(bench.recording(), command=plan.command)
    plant = PLANTS[bench.plant]
    lacks = plant.lacks(bare)
    if lacks is not None:
        raise InputError(f"a plan of a {bench.plant}: {lacks}")
    whole = trajectory_of(bare, np.array([0.0, plan.duration]), plan.state[None])
    end = _landing(whole) if plant.follows_path else plan.duration
    if end <= 0.0:
        return None
    count = max(1, round(end / plant.durations.segment))
    cut = resegmented(whole, _NO_VALUES, np.linspace(0.0, end + 1e-6, count + 1))
    if not np.all(np.isfinite(cut.states)):
        return None
    samples = {name: made for name in bench.sheets if len(made := _samples(cut, name))}
    if not samples:
        return None
    return trajectory_of(replace(bare, samples=samples), cut.nodes, cut.states)


def _landing(whole: Trajectory) -> float:
    """Return when a throw of one segment reaches the ground, s; its end where it does not."""
    t = np.arange(0.0, float(whole.nodes[-1]), 0.02)
    below = np.flatnonzero(shown(whole, _NO_VALUES, "track", t)[:, 2] >= 0.0)
    return float(t[below[0]]) if below.size else float(whole.nodes[-1])


def _samples(cut: Trajectory, sensor: str) -> Samples:
    """Return a sensor's readings of a motion without noise, within its range."""
    sheet = cut.recording.sheets[sensor]
    t = np.arange(0.0, float(cut.nodes[-1]), 1.0 / sheet.rate_hz)
    axes = SENSORS[sensor].columns
    blank = np.zeros((t.size, len(axes)))
    value = read(cut, _NO_VALUES, Readings(sensor, t, blank, blank == 0.0, blank != 0.0, np.zeros(len(axes)), axes))
    if sheet.range is not None:
        value = np.clip(value, -sheet.range, sheet.range)
    return Samples(t, value if len(axes) > 1 else value[:, 0])
