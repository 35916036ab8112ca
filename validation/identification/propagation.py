"""Propagation of segments: parameters laid flat, steps of the integrator, the compiled motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE
from discsim.parameters import PARAMETERS, parameter_index, parameters, tables
from discsim.recording import Recording
from discsim.validation.identification.competing_effects import CATALOGUED, Competing
from discsim.validation.identification.dynamics import LAW_PLACES, SIZE
from discsim.validation.identification.parameters import Values
from discsim.validation.identification.plants import Plant, plant_of
from discsim.validation.identification.plants.plant import Given
from discsim.validation.identification.sensor_model import is_motion, value

__all__ = ["FLAT_ENVIRONMENT", "Column", "Runner", "place_in_flat", "runner_of"]


class Column(NamedTuple):
    """A direction in which predictions move: a parameter, half its difference, shapes that its effect is taken at."""

    group: str
    name: str
    step: float
    given: tuple[tuple[str, float], ...] = ()

    @property
    def key(self) -> tuple[str, str]:
        """Group and name."""
        return self.group, self.name


def base_flat(
    recording: Recording,
    values: Values,
    columns: Sequence[tuple[str, str]] = (),
    effects: Competing = CATALOGUED,
) -> FloatArray:
    """Return the flat parameter array of a recording's baseline with values in their places.

    ``columns`` are keys that need a place, too.
    """
    flat = np.concatenate(
        [parameters(recording.environment, recording.disc, recording.rig), _own_sizes(effects).ravel()]
    )
    terms = 1 + max((_term(name) for group, name in (*values, *columns) if group == "law"), default=-1)
    flat = np.concatenate([flat, np.zeros(terms * len(LAW_PLACES))])
    for (group, name), number in values.items():
        if (is_motion(group, effects) and group != "environment") or (group, name) in FLAT_ENVIRONMENT:
            flat[place_in_flat(group, name, effects)] = number
    return flat


def _term(name: str) -> int:
    return int(name.partition(".")[0])


def place_in_flat(group: str, name: str, effects: Competing = CATALOGUED) -> int:
    """Return the place of a parameter in a flat array: behind the physics own effects stand, and then a law's terms."""
    if group == "law":
        behind = SIZE + _own_sizes(effects).size
        return behind + _term(name) * len(LAW_PLACES) + LAW_PLACES.index(name.partition(".")[2])
    for place, effect in enumerate(effects.called_on("motion")):
        if effect.id == group:
            return int(SIZE + place * _own_sizes(effects).shape[1] + effect.row.parameters.index(name))
    return parameter_index(group, name)


def _own_sizes(effects: Competing) -> FloatArray:
    """Return the parameters of the effects on motion that are called, at which they do nothing, (effects, k)."""
    return tables(None, None, effects.called_on("motion")).own_sizes


FLAT_ENVIRONMENT = {("environment", name) for name in PARAMETERS["environment"].names or ()}


@dataclass(frozen=True)
class Runner:
    """Runs segments of one recording: by its plant, of what is ``given``, with short steps about ``events``.

    These are instants and widths, s.
    """

    plant: Plant
    given: Given
    events: tuple[tuple[float, float], ...]

    def times(self, start: float, stop: float, last: float, state: FloatArray) -> tuple[FloatArray, int]:
        """Return the integrator's steps from start over at least [start, last], and the place of ``stop`` in them."""
        dynamics, end = self.plant.dynamics, max(stop, last)
        h = dynamics.longest_step(self.given, state, start, end)
        marks = [start, stop]
        if last > stop:
            marks.append(last + 1e-9)
        marks += dynamics.corners(self.given, start, end)
        for t, width in self.events:
            for mark in (t - 6 * width, t + 6 * width):
                if start < mark < end:
                    marks.append(mark)
        marks = sorted(set(marks))
        steps = [np.array([start])]
        for a, b in pairwise(marks):
            fine = h
            for t, width in self.events:
                if abs(0.5 * (a + b) - t) < 6 * width:
                    fine = min(fine, 0.25 * width)
            n = max(1, int(np.ceil((b - a) / fine - 1e-9)))
            even = np.arange(1, n + 1) * ((b - a) / n) + a
            even[-1] = b
            steps.append(even)
        times = np.concatenate(steps)
        return times, int(np.argmin(np.abs(times - stop)))

    def run(
        self, flats: FloatArray, own: FloatArray, states: FloatArray, times: FloatArray, last: int, out: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return rows (c, m, 19) at instants out and the states (c, s) at ``times[last]``.

        ``flats`` (c, k) are parameters of the physics, ``own`` (c, o) those of the plant's own.
        """
        return self.plant.dynamics.propagate(self.given, flats, own, states, times, last, out)


def _knots(recording: Recording) -> FloatArray:
    """Return the knots (2, n) of a rate table's command; of other plants none."""
    command = recording.command
    return np.empty((2, 0)) if command is None else np.stack([command.t, command.value])


def _events(values: Values, columns: Sequence[Column] = ()) -> tuple[tuple[float, float], ...]:
    """Return instants and widths of brief events among values and among the shapes that columns are taken at."""
    found = {values[group, "t_s"] for group in EVENTS if (group, "t_s") in values}
    found |= {number for column in columns if column.group in EVENTS for name, number in column.given if name == "t_s"}
    return tuple((t, 0.01) for t in sorted(found))


def _order(values: Values, columns: Sequence[Column] = ()) -> float:
    """Return the highest order of what repeats in a turn, among values and among the shapes of columns."""
    found = [values.get(key, 0.0) for key in _PER_TURN]
    found += [n for (group, name), n in values.items() if group == "law" and name.endswith(".order")]
    found += [n for c in columns for name, n in c.given if (c.group, name) in _PER_TURN or name.endswith(".order")]
    return max(abs(order) for order in found)


#: brief events, and how far from its instant one acts, s: six times its width of 10 ms, and what an instant is moved by
EVENTS, EVENT_REACH = tuple(row.id for row in CATALOGUE.values() if row.brief), 0.08
#: parameters that say how often in a turn something repeats
_PER_TURN = tuple((row.id, row.per_turn) for row in CATALOGUE.values() if row.per_turn)
#: those of a body that is uneven, so that its motion follows the spin
_UNEVEN_BODY = tuple((row.id, name) for row in CATALOGUE.values() if row.follows_spin for name in row.parameters)


def runner_of(
    recording: Recording, values: Values, columns: Sequence[Column] = (), effects: Competing = CATALOGUED
) -> Runner:
    """Return what runs a recording's segments with values, in steps short enough for ``columns``, too."""
    given = Given(
        recording,
        tables(recording.disc, None, effects.called_on("motion")),
        _knots(recording),
        _order(values, columns),
        any(value(values, *key) != 0.0 for key in _UNEVEN_BODY),
    )
    return Runner(plant_of(recording), given, _events(values, columns))
