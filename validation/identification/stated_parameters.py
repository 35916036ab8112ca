"""Stated numbers that may move: those of a recording's environment, disc, rig and sensors that come with a sigma."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from discsim.arrays import FloatArray
from discsim.disc import Aero, Disc, aero_key
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import ClockRate, PositionOffset
from discsim.recording import Recording
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import plant_of

__all__ = ["ON_BOARD", "STATED_NAMES", "exact_numbers", "stated_parameters"]

#: sensors whose times are those of a logger's rows
ON_BOARD = ("magnetometer", "accelerometer", "gyroscope")
#: shares that rates are off by are one and the same where they differ by no more than rates of three digits are rounded
_ROUNDED = 0.99
_DISC = {"mass_kg": "mass", "diameter_m": "d", "Ixx_kg_m2": "Ixx", "Izz_kg_m2": "Izz"}
_RIG = {"Izz_kg_m2": "Izz", "viscous_N_m_s": "viscous"}
#: the name in a recording of each stated number of the hardware and the surroundings, by its place among parameters
STATED_NAMES = {
    **{("disc", place): name for name, place in _DISC.items()},
    **{("rig", place): name for name, place in _RIG.items()},
    ("environment", "air_density"): "air_density_kg_m3",
    ("environment", "gravity"): "gravity_m_s2",
}


def stated_parameters(recordings: Sequence[Recording]) -> tuple[Parameter, ...]:
    """Return the numbers that are stated with an uncertainty; a sigma of zero is exact.

    Recordings of one data set share their hardware; where they state different numbers, each recording's own place
    and uncertainty hold for it alone.
    """
    found: dict[tuple[str, str], list[tuple[int, float, float]]] = {}
    for index, recording in enumerate(recordings):
        for group, name, stated, sigma in _of(recording):
            if sigma > 0:
                found.setdefault((group, name), []).append((index, stated, sigma))
    parameters = []
    for (group, name), places in found.items():
        distinct = {(stated, sigma) for _, stated, sigma in places}
        for stated, sigma in sorted(distinct):
            where = frozenset(i for i, a, b in places if (a, b) == (stated, sigma))
            recordings_of = None if len(where) == len(recordings) else where
            parameters.append(Parameter(group, name, stated, 0.02 * sigma, sigma, recordings_of))
    return tuple(parameters)


def exact_numbers(recordings: Sequence[Recording]) -> dict[tuple[str, str], float]:
    """Return the sizes of the hardware that all recordings state alike and without an uncertainty, those that show.

    Of a body that nothing but its own inertia turns, or a rig, the ratio of two shows, so that one of them is enough.
    """
    first, *others = map(_exact, recordings)
    return first if all(one == first for one in others) else {}


def _exact(recording: Recording) -> dict[tuple[str, str], float]:
    """Return the sizes of a recording's hardware that it states without an uncertainty, by their places."""
    plant, disc, rig = plant_of(recording), recording.disc, recording.rig
    found: dict[tuple[str, str], float] = {}
    if disc is not None and "disc" in plant.hardware:
        names = _DISC if plant.air_modelled else {"Ixx_kg_m2": "Ixx"}
        found |= {("disc", place): _size(disc, place) for name, place in names.items() if name not in disc.sigma}
    if rig is not None and "rig" in plant.hardware and "viscous_N_m_s" not in rig.sigma:
        found["rig", "viscous"] = float(rig.viscous)
    return {key: size for key, size in found.items() if size > 0.0}


def _size(disc: Disc, place: str) -> float:
    """Return a size of a disc by its place among parameters."""
    return float(disc.diameter if place == "d" else getattr(disc, place))


def _of(recording: Recording) -> Iterator[tuple[str, str, float, float]]:
    """Yield (group, name, stated, sigma) of one recording."""
    environment = recording.environment
    for key, sigma in environment.sigma.items():
        if key == "gravity_m_s2":
            yield "environment", "gravity", environment.gravity, float(np.max(sigma))
        elif key == "air_density_kg_m3" and environment.air_density is not None:
            yield "environment", "air_density", environment.air_density, float(np.max(sigma))
        elif key.startswith("magnetic_field"):
            for axis, each, size in zip(
                ("north", "east", "down"), environment.magnetic_field, _three(sigma), strict=True
            ):
                yield "environment", f"magnetic_{axis}", float(each), float(size)
        elif key.startswith("wind"):
            for axis, each, size in zip(("north", "east", "down"), environment.wind, _three(sigma), strict=True):
                yield "environment", f"wind_{axis}", float(each), float(size)
    disc, hardware = recording.disc, plant_of(recording).hardware
    if disc is not None and "disc" in hardware:
        for key, sigma in disc.sigma.items():
            if key in _DISC:
                yield "disc", _DISC[key], _size(disc, _DISC[key]), float(np.max(sigma))
        if disc.aero is not None and "aero" in hardware:
            for name in Aero._fields:
                if aero_key(name) in disc.sigma:
                    yield "aero", name, float(getattr(disc.aero, name)), float(np.max(disc.sigma[aero_key(name)]))
    rig = recording.rig
    if rig is not None and "rig" in hardware:
        for key, sigma in rig.sigma.items():
            if key in _RIG:
                yield "rig", _RIG[key], float(getattr(rig, _RIG[key])), float(np.max(sigma))
    yield from _clocks(recording)
    sheet = recording.sheets.get("accelerometer")
    if sheet is not None and "position_m" in sheet.sigma and sheet.position is not None:
        moved = catalogued(PositionOffset).id
        for axis, size in zip("xyz", _three(sheet.sigma["position_m"]), strict=True):
            yield moved, f"d{axis}_m", 0.0, float(size)


def _clocks(recording: Recording) -> Iterator[tuple[str, str, float, float]]:
    """Yield the clocks of sensors on board whose sampling rate comes with a sigma: one of all where rows are alike."""
    off = {sensor: sheet.rate_uncertainty for sensor in ON_BOARD if (sheet := recording.sheets.get(sensor)) is not None}
    most = max(off.values(), default=0.0)
    alike = all(share > _ROUNDED * most for share in off.values())
    for sensor, share in {"clock": most}.items() if alike else off.items():
        row = catalogued(ClockRate, sensor)
        if recording.plant in row.plants:
            yield row.id, "ratio", row.baseline.ratio, share


def _three(sigma: ArrayLike) -> FloatArray:
    return np.broadcast_to(np.asarray(sigma, dtype=float), 3)
