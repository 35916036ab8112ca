"""Profiles of a rate table in CSV files, whoever wrote them, and what a table would make of them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from discsim.errors import InputError
from discsim.files import model_names
from discsim.rate_tables import RateTable, load_table
from discsim.recording import COMMAND_HEADER, Samples
from discsim.rig import profile_fault, read_profile
from discsim.validation.estimating.rate_files import Told, read_told

__all__ = ["Profile", "fastest_shipped", "read_knots", "speed_note"]

#: headers that say what they hold, the first in deg/s; `discsim.rig.read_profile` reads them
_PLAIN = ("time_s,rate_deg_s", COMMAND_HEADER)


class Profile(NamedTuple):
    """Knots of a profile, t (n,) s and rate (n,) rad/s, linear between; whether its file says rad/s, and notes."""

    knots: Samples
    in_radians: bool
    notes: tuple[str, ...] = ()


def read_knots(path: Path) -> Profile:
    """Read a profile as `discsim.rig.read_profile` does, and CSV files with other names, units and separators.

    So ``Time (ms);Speed (rpm)`` is read, aloud. Knots then count from the first of them. Raises `InputError` naming
    file, line and what was expected.
    """
    if path.suffix == ".toml" or path.is_dir():
        return Profile(read_profile(path), in_radians=False)
    told = read_told(path)
    if told.header in _PLAIN:
        return Profile(read_profile(path), in_radians=told.header != _PLAIN[0])
    knots = _knots(path, told)
    notes = [f"{path.name}: '{told.time_name}' and '{told.rate_name}' are read as time and rate"]
    if start := float(knots.t[0]):
        notes.append(f"{path.name}: the profile begins at {start:.6g} s; it is counted from there")
        knots = Samples(knots.t - start, knots.value)
    if found := profile_fault(knots):
        knot, message = found
        raise InputError.at(path, told.lines[knot], message)
    return Profile(knots, in_radians=told.per_rate == 1.0, notes=tuple(notes))


def _knots(path: Path, told: Told) -> Samples:
    """Return the one rate of a file over time; raises `InputError` where there is none, or a knot without a rate."""
    if len(told.tables) != 1:
        raise InputError.at(path, None, f"holds {len(told.tables)} methods; expected one profile")
    (table,) = told.tables.values()
    t, rate, _ = np.array(table).T
    if t.size < 2:
        raise InputError.at(path, 2, "one knot only; expected at least two")
    if np.any(unknown := ~np.isfinite(rate)):
        raise InputError.at(path, told.lines[int(np.argmax(unknown))], "has no rate; expected a number")
    return Samples(t, rate)


def speed_note(profile: Profile, table: RateTable, name: str = "--profile") -> str | None:
    """Return what to say of a profile that asks for more than the table gives, and None where it does not.

    ``name`` is what the profile is called. Of a table whose fastest rate is not stated the fastest of the shipped ones
    is taken (``models/tables``).
    """
    asked = float(np.max(np.abs(profile.knots.value)))
    own = table.drive.largest_rate
    fastest = own if np.isfinite(own) else fastest_shipped()
    if asked <= fastest * (1.0 + 1e-9):
        return None
    gives = "the table turns at most" if np.isfinite(own) else "the fastest table shipped turns"
    note = f"{name} asks for {np.degrees(asked):.6g} deg/s, and {gives} {np.degrees(fastest):.6g} deg/s"
    if profile.in_radians and np.radians(asked) <= fastest:
        note += f"; were deg/s meant under rad/s? Then the header is '{_PLAIN[0]}'"
    return note


def fastest_shipped() -> float:
    """Return the largest rate, rad/s, of the rate tables that are shipped and state one."""
    rates = [load_table(name).drive.largest_rate for name in model_names("tables")]
    return max(rate for rate in rates if np.isfinite(rate))
