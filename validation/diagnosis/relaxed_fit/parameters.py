"""What a relaxed fit leaves open beside the motion: what a recording does not state, and ordinary errors of sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from discsim.effects.catalogue import CATALOGUE, Effect, catalogued
from discsim.effects.sensors import ClockRate
from discsim.recording import Recording
from discsim.validation.diagnosis.settings import RELAXED_FIT
from discsim.validation.identification.ordinary_errors import ordinary_errors
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import plant_of

__all__ = ["free_clock", "free_clocks", "ordinary", "relaxed_parameters", "supposed_parameters", "unknowns"]


def ordinary(sensors: set[str], plant: str, *, free_running: bool = False) -> tuple[Parameter, ...]:
    """Return the ordinary errors of some sensors, and of the motion of a plant, each free within its prior.

    ``free_running`` adds those of parts that sample by themselves, beside a logger that reads them when it can.
    """
    chosen = list[Parameter]()
    uses = ("relaxed fit", "relaxed fit of free-running parts") if free_running else ("relaxed fit",)
    for id, name, sigma, _ in [error for use in uses for error in ordinary_errors(use)]:
        row = CATALOGUE[id]
        if plant in row.plants and (row.acts_on == "motion" or row.acts_on in sensors):
            size = row.scale[row.parameters.index(name)]
            chosen.append(Parameter(id, name, float(getattr(row.baseline, name)), 0.1 * size, sigma))
    return tuple(chosen)


def unknowns(recordings: Sequence[Recording]) -> tuple[Parameter, ...]:
    """Return what each recording leaves open beside its states, as how the wobble of a free spin dies and turns.

    Each parameter is one recording's own.
    """
    plant = plant_of(recordings[0])
    return tuple(
        replace(q, recordings=frozenset([i]))
        for i, recording in enumerate(recordings)
        for q in (
            *plant.own,
            *(plant.held if "accelerometer" in recording else ()),
            *(plant.zeros if "magnetometer" in recording.averaged else ()),
        )
    )


def relaxed_parameters(
    recordings: Sequence[Recording], sensors: set[str], *, free_running: bool = False
) -> tuple[Parameter, ...]:
    """Return all that a relaxed fit of recordings with some sensors leaves free beside stated numbers.

    For ``free_running`` see `ordinary`.
    """
    return (*unknowns(recordings), *ordinary(sensors, recordings[0].plant, free_running=free_running))


def free_clock(sensor: str) -> Parameter:
    """Return the clock of a sensor on board, free within a few per cent."""
    return Parameter(catalogued(ClockRate, sensor).id, "ratio", 1.0, 1e-6, RELAXED_FIT.clock_sigma)


def free_clocks(sensors: set[str]) -> tuple[Parameter, ...]:
    """Return the free clocks of those sensors on board that are among ``sensors``."""
    return tuple(free_clock(one) for one in ("magnetometer", "accelerometer", "gyroscope") if one in sensors)


#: one sigma of what is supposed, as a share of its size: what dies away within a recording is told to a tenth
_SUPPOSED = 0.3


def supposed_parameters(effects: Sequence[Effect]) -> tuple[Parameter, ...]:
    """Return the parameters of supposed effects, free about their sizes."""
    found = []
    for effect in effects:
        row = effect.row
        for name, scale in zip(row.parameters, row.scale, strict=True):
            value = float(getattr(effect.value, name))
            found.append(Parameter(effect.id, name, value, 0.1 * scale, _SUPPOSED * abs(value)))
    return tuple(found)
