"""Recordings that could be made next: such as are made easily about those in hand, or a person's own list."""

from __future__ import annotations

from pathlib import Path

from discsim.errors import InputError
from discsim.toml_table import read_toml
from discsim.validation.identification.plants import PLANTS, Plant
from discsim.validation.identification.plants.plan import Plan
from discsim.validation.identification.plants.plant import Design
from discsim.validation.identification.segments import Trajectory

__all__ = ["plans_about", "read_plans"]


def plans_about(trajectory: Trajectory, longest: float) -> list[Plan]:
    """Return recordings about one in hand: first the same again, then others.

    ``longest`` is the length in s of the longest recording in hand.
    """
    return _design(trajectory.plant).about(
        trajectory.recording, trajectory.states[0], float(trajectory.nodes[-1]), longest
    )


def read_plans(path: Path, plant: str) -> list[Plan]:
    """Read the recordings that a person could make: an array of tables ``[[recording]]`` in a TOML file.

    Each may have a ``text``, which the report shows; the other keys are those of a throw file (flight; of a free spin
    without position and velocity), ``rate_rad_s`` (spin_down) or ``time_s`` and ``rate_rad_s`` (rate_table), and
    ``duration_s``; a rig may be leant by ``tilt_north_rad`` and ``tilt_east_rad``. Raises `InputError`.
    """
    file = read_toml(path)
    tables = file.tables("recording")
    if not tables:
        raise file.error(None, "no recording named; expected one or more tables [[recording]]")
    file.finish()
    design = _design(PLANTS[plant])
    return [design.read(table) for table in tables]


def _design(plant: Plant) -> Design:
    if plant.design is None:
        raise InputError(f"{plant.name}: no next recording can be proposed of it; expected a plant with a design")
    return plant.design
