"""What is validated: a disc and its surroundings, the parts on board, the throws and the rate table's profile."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from discsim.disc import Disc
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.recording import Samples
from discsim.rig import PLATEAUS_DEG_S, default_profile
from discsim.sensors import Instruments
from discsim.shipped import load_disc, load_throw
from discsim.validation.scenarios.profile_files import read_knots
from discsim.validation.scenarios.throws import FULL_SET, PARTS, QUICK_SET, StatedThrow, Throw

__all__ = ["QUICK_PLATEAUS", "Subject", "shipped_subject", "stated_subject"]

QUICK_PLATEAUS = (0, 300, 1000, 2500, 4000, 5000)


@dataclass(frozen=True)
class Subject:
    """What a validation run is about."""

    disc: Disc
    environment: Environment
    parts: tuple[str, ...]
    throws: tuple[Throw | StatedThrow, ...]
    profile: Samples


def shipped_subject(quick: bool) -> Subject:
    """Return the driver, the paper's module, the project's throws and profile."""
    disc, environment = load_disc("driver")
    profile = default_profile(QUICK_PLATEAUS if quick else PLATEAUS_DEG_S, hold=3.0 if quick else 5.0)
    return Subject(disc, environment, PARTS, QUICK_SET if quick else FULL_SET, profile)


def stated_subject(
    quick: bool,
    *,
    disc: tuple[Disc, Environment] | None = None,
    parts: Sequence[str] = (),
    throws: Sequence[str] = (),
    profile: Path | None = None,
) -> Subject:
    """Return the shipped subject with what is given in its place; throws are names of shipped ones or TOML files.

    Raises `InputError`: parts without a magnetometer or gps, a disc whose C_Nr is no constant other than zero, and
    what is wrong in a file.
    """
    own = shipped_subject(quick)
    body, surroundings = (own.disc, own.environment) if disc is None else disc
    if body.aero is None or body.yaw_damping_table is not None or body.aero.CNr == 0.0:
        raise InputError(
            "the disc has no constant CNr other than zero; expected one, for what is fitted is held against it"
        )
    names = tuple(parts) or own.parts
    if absent := {"magnetometer", "gps"} - set(Instruments.from_parts(*names).sensors):
        raise InputError(
            f"--parts {','.join(names)}: no {' and no '.join(sorted(absent))} on board; expected both, for the spin is "
            "told by the field and C_Nr by the path (such as mpu9250,neo_m8n)"
        )
    stated = tuple(StatedThrow(Path(name).stem, load_throw(name)) for name in throws)
    if len({throw.name for throw in stated}) < len(stated):
        raise InputError(f"--throws {','.join(throws)}: two throws have one name; expected each its own")
    return Subject(
        body,
        surroundings,
        names,
        stated or own.throws,
        own.profile if profile is None else read_knots(profile).knots,
    )
