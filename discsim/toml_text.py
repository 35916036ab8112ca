"""TOML as this project writes it: the tables of an environment, a disc, a rig and a release, each on lines of its own.

Numbers survive a round trip to the last bit, and an uncertainty stands below its quantity. Arrays stay on one line, a
vector of three is one thing to a reader; that is why no library writes them (tomli-w gives each number a line).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from discsim.disc import Aero, Disc, Release, Rig, aero_key
from discsim.environment import Environment
from discsim.errors import InputError

if TYPE_CHECKING:
    from discsim.recording import SensorSheet

__all__ = [
    "disc_toml",
    "environment_toml",
    "release_toml",
    "rig_toml",
    "sheet_toml",
    "sigma_key",
    "toml_lines",
    "toml_table",
    "toml_value",
]


def environment_toml(environment: Environment) -> list[str]:
    """Return the lines of an ``[environment]`` table."""
    return toml_table(
        "environment",
        {
            "gravity_m_s2": environment.gravity,
            "magnetic_field_ned_uT": environment.magnetic_field,
            "air_density_kg_m3": environment.air_density,
            "wind_ned_m_s": environment.wind
            if np.any(environment.wind) or "wind_ned_m_s" in environment.sigma
            else None,
        },
        environment.sigma,
    )


def disc_toml(disc: Disc) -> list[str]:
    """Return the lines of a ``[disc]`` table and its sub-tables."""
    aero_keys = [aero_key(name) for name in Aero._fields]
    body = {key: value for key, value in disc.sigma.items() if key not in aero_keys}
    lines = toml_table(
        "disc",
        {"mass_kg": disc.mass, "diameter_m": disc.diameter, "Ixx_kg_m2": disc.Ixx, "Izz_kg_m2": disc.Izz},
        body,
    )
    if disc.aero is not None:
        lines += toml_table("disc.aero", {aero_key(k): v for k, v in disc.aero._asdict().items()}, {})
    if aero_sigma := {key: disc.sigma[key] for key in aero_keys if key in disc.sigma}:
        if disc.aero is None:
            raise InputError("[disc.aero_sigma] without [disc.aero]; expected the coefficients it is about")
        lines += toml_table("disc.aero_sigma", aero_sigma, {})
    if (table := disc.aero_table) is not None:
        lines += toml_table(
            "disc.aero_table", {"alpha_rad": table.alpha, "CL": table.CL, "CD": table.CD, "CM": table.CM}, {}
        )
    if (rolling := disc.rolling_table) is not None:
        columns = {"advance_ratio": rolling.advance_ratio, "CR": rolling.CR, "CRp": rolling.CRp}
        lines += toml_table("disc.CR_table", {"alpha_rad": rolling.alpha, **columns}, {})
    if (damping := disc.yaw_damping_table) is not None:
        lines += toml_table(
            "disc.CNr_table",
            {"rate_deg_s": [_degrees(rate) for rate in damping.rate], "speed_m_s": damping.speed, "CNr": damping.CNr},
            {},
        )
    return lines


def rig_toml(rig: Rig) -> list[str]:
    """Return the lines of a ``[rig]`` table."""
    return toml_table("rig", {"Izz_kg_m2": rig.Izz, "viscous_N_m_s": rig.viscous}, rig.sigma)


def sheet_toml(sensor: str, sheet: SensorSheet, unit: str) -> list[str]:
    """Return the lines of a ``[sensors.NAME]`` table; ``unit`` is the sensor's, which its keys end with."""
    stated: dict[str, Any] = {"rate_hz": sheet.rate_hz}
    if sensor == "gps":
        stated |= {"position_noise_rms_m": sheet.noise_rms, "velocity_noise_rms_m_s": sheet.velocity_noise_rms}
    else:
        stated |= {
            f"noise_rms_{unit}": sheet.noise_rms,
            f"resolution_{unit}": sheet.resolution,
            f"range_{unit}": sheet.range,
            "position_m": sheet.position,
        }
    return toml_table(f"sensors.{sensor}", stated, sheet.sigma)


def release_toml(release: Release, name: str = "release") -> list[str]:
    """Return the lines of a ``[release]`` table."""
    return toml_table(
        name,
        {
            "position_ned_m": release.position,
            "velocity_ned_m_s": release.velocity,
            "roll_rad": release.roll,
            "pitch_rad": release.pitch,
            "yaw_rad": release.yaw,
            "body_rate_rad_s": release.body_rate,
        },
        release.sigma,
    )


def _degrees(radians: float) -> float:
    """Return the shortest degrees that read back as ``radians`` to the last bit, where there are any."""
    exact = float(np.degrees(radians))
    near = [round(exact, 9), exact, float(np.nextafter(exact, -np.inf)), float(np.nextafter(exact, np.inf))]
    return next((degrees for degrees in near if np.radians(degrees) == radians), exact)


_UNITS = ("kg_m2", "kg_m3", "N_m_s", "rad_s", "m_s2", "m_s", "uT", "kg", "rad", "hz", "m")


def sigma_key(key: str) -> str:
    """Return the key of a quantity's uncertainty: ``sigma`` before the unit, without the frame."""
    for unit in _UNITS:
        if key.endswith(f"_{unit}"):
            return f"{key.removesuffix(f'_{unit}').removesuffix('_ned')}_sigma_{unit}"
    return f"{key}_sigma"


def toml_table(name: str, values: Mapping[str, Any], sigma: Mapping[str, Any]) -> list[str]:
    """Return the lines of a table; raises `InputError` for an uncertainty of what is not stated."""
    lines = ["", f"[{name}]"] if name else []
    for key, value in values.items():
        if value is None:
            continue
        lines.append(f"{key} = {toml_value(value)}")
        if key in sigma:
            lines.append(f"{sigma_key(key)} = {toml_value(sigma[key])}")
    if lost := [key for key in sigma if values.get(key) is None]:
        raise InputError(f"[{name}]: uncertainty of '{lost[0]}', which is not stated; expected both or neither")
    return lines


def toml_lines(values: Mapping[str, Any]) -> list[str]:
    """Return one line ``key = value`` for each text, truth value, number, array, or list of texts."""
    return [f"{key} = {toml_value(value)}" for key, value in values.items()]


def toml_value(value: ArrayLike | str | bool | Sequence[str]) -> str:
    """Return a value as it stands behind the equals sign, on one line."""
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    array = np.asarray(value, dtype=float)
    if array.ndim == 0:
        return repr(float(array))
    return "[" + ", ".join(toml_value(item) for item in array) + "]"
