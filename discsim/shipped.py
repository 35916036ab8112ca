"""Discs, throws and places by name or from a file: the shipped ones stand in ``models``."""

from __future__ import annotations

from datetime import date, datetime
from os import PathLike, fspath
from pathlib import Path
from typing import NamedTuple

from discsim.disc import Disc, Release
from discsim.environment import Environment
from discsim.errors import InputError, require_path
from discsim.files import model_file, model_names
from discsim.toml_table import TomlTable, read_toml

__all__ = ["Site", "load_disc", "load_site", "load_throw", "shipped_or_path"]


class Site(NamedTuple):
    """A place on Earth and the day for which its field holds; height in m above sea level."""

    latitude_deg: float
    longitude_deg: float
    height_m: float
    day: date
    environment: Environment


def load_disc(name_or_path: str | PathLike[str]) -> tuple[Disc, Environment]:
    """Return a shipped disc (``driver``), or that of a TOML file, with the surroundings stated beside it.

    The file has the tables ``[disc]`` and ``[environment]`` of a recording, aerodynamics and air included. Raises
    `InputError`: a name that is neither shipped nor a file, or what is wrong in the file.
    """
    table = read_toml(shipped_or_path("discs", name_or_path))
    environment = Environment.from_toml(_need(table, "environment"), air_required=True)
    disc = Disc.from_toml(_need(table, "disc"), aero_required=True)
    table.finish()
    return disc, environment


def load_throw(name_or_path: str | PathLike[str]) -> Release:
    """Return a shipped throw (``driver``), or that of a TOML file with the keys of a recording's ``[release]``.

    Raises `InputError`: a name that is neither shipped nor a file, what is wrong in the file, or a throw without
    velocity and body rate.
    """
    table = read_toml(shipped_or_path("throws", name_or_path))
    release = Release.from_toml(table)
    for value, key in ((release.velocity, "velocity_ned_m_s"), (release.body_rate, "body_rate_rad_s")):
        if value is None:
            raise table.error(None, f"missing key '{key}' in a throw; expected three numbers")
    return release


def load_site(name_or_path: str | PathLike[str]) -> Site:
    """Return a shipped place (``seoul``), or that of a TOML file with the tables ``[site]`` and ``[environment]``.

    Raises `InputError`: a name that is neither shipped nor a file, or what is wrong in the file.
    """
    table = read_toml(shipped_or_path("sites", name_or_path))
    place = _need(table, "site")
    latitude, longitude = place.need("latitude", "deg", minimum=-90.0), place.need("longitude", "deg", minimum=-180.0)
    if latitude > 90.0 or longitude > 360.0:
        raise place.error(None, f"latitude {latitude:g}, longitude {longitude:g}: expected at most 90 and 360 deg")
    height = place.need("height", "m")
    day = place.raw("date")
    if not isinstance(day, date) or isinstance(day, datetime):
        raise place.error("date", f"'site.date' is {day!r}, expected a date such as 2021-10-15")
    place.finish()
    environment = Environment.from_toml(_need(table, "environment"), air_required=False)
    table.finish()
    return Site(latitude, longitude, height, day, environment)


def _need(table: TomlTable, name: str) -> TomlTable:
    part = table.table(name, required=True)
    assert part is not None
    return part


def shipped_or_path(folder: str, name_or_path: str | PathLike[str]) -> Path:
    """Return the file of a shipped name in a folder of ``models``, or the path given; `InputError` where it is none."""
    require_path(name_or_path, f"a {folder[:-1]}", "a shipped name, or the path of a TOML file")
    name = fspath(name_or_path)
    shipped = model_names(folder)
    if name in shipped:
        return model_file(f"{folder}/{name}.toml")
    path = Path(name)
    if not path.is_file():
        raise InputError(f"no {folder[:-1]} '{name}'; expected one of {', '.join(shipped)}, or the path of a TOML file")
    return path
