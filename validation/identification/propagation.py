"""Propagation of segments: parameters laid flat, steps of the integrator, the compiled motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE
from discsim.effects.kind import BOARD
from discsim.parameters import PARAMETERS, Tables, parameter_index, parameters, tables
from discsim.recording import Recording
from validation.identification.competing_effects import applied_on, row_of
from validation.identification.dynamics import (
    LAW_PLACES,
    ROW,
    SIZE,
    flight_pieces,
    free_spin_pieces,
    spin_down_pieces,
    table_pieces,
)
from validation.identification.sensor_model import Values, is_motion, value

__all__ = ["FLAT_ENVIRONMENT", "WOBBLE", "Column", "Runner", "place_in_flat", "runner_of"]

#: longest step of a flight's integrator, s, and in radians of nutation
STEP, NUTATION = 0.01, 1.2


#: and where an uneven body makes the motion follow the spin
UNEVEN = 0.6


#: and where coefficients come from a table, whose corners a step may not leap over
CORNERED = 0.5


#: a fit that has gone astray to faster spins, rad/s, is not followed with ever shorter steps
FASTEST = 400.0


#: longest step of a table's integrator in radians of its ripple
RIPPLE = 0.3


#: longest step of a free spin, s: the moments of the air change within 20 ms of release; and in radians of nutation:
#: over 0.2 s at 120 rad/s a wobble of 3.6 rad/s is 1.2e-4 rad/s off, a thirtieth of a good gyroscope's noise
_FREE_STEP, _FREE_NUTATION = 0.005, 0.22


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


def base_flat(recording: Recording, values: Values, columns: Sequence[tuple[str, str]] = ()) -> FloatArray:
    """Return the flat parameter array of a recording's baseline with values in their places.

    ``columns`` are keys that need a place, too.
    """
    flat = np.concatenate([parameters(recording.environment, recording.disc, recording.rig), _own_sizes().ravel()])
    terms = 1 + max((_term(name) for group, name in (*values, *columns) if group == "law"), default=-1)
    flat = np.concatenate([flat, np.zeros(terms * len(LAW_PLACES))])
    for (group, name), number in values.items():
        if (is_motion(group) and group != "environment") or (group, name) in FLAT_ENVIRONMENT:
            flat[place_in_flat(group, name)] = number
    return flat


def _term(name: str) -> int:
    return int(name.partition(".")[0])


def place_in_flat(group: str, name: str) -> int:
    """Return the place of a parameter in a flat array: behind the physics own effects stand, and then a law's terms."""
    if group == "law":
        behind = SIZE + _own_sizes().size
        return behind + _term(name) * len(LAW_PLACES) + LAW_PLACES.index(name.partition(".")[2])
    own = [effect.id for effect in applied_on("motion")]
    if group in own:
        row = row_of(group)
        assert row is not None
        return int(SIZE + own.index(group) * _own_sizes().shape[1] + row.parameters.index(name))
    return parameter_index(group, name)


def _own_sizes() -> FloatArray:
    """Return the parameters of the effects on motion that are called, at which they do nothing, (effects, k)."""
    return tables(None, None, applied_on("motion")).own_sizes


FLAT_ENVIRONMENT = {("environment", name) for name in PARAMETERS["environment"].names or ()}


@dataclass(frozen=True)
class Runner:
    """Runs pieces of one recording."""

    recording: Recording
    lookup: Tables
    knots: FloatArray
    events: tuple[tuple[float, float], ...]
    #: highest order of a speed ripple
    order: float = 0.0
    #: whether the body is uneven, so that its motion follows the spin
    uneven: bool = False

    def times(self, start: float, stop: float, last: float, state: FloatArray) -> tuple[FloatArray, int]:
        """Return the integrator's steps from start over at least [start, last], and the place of ``stop`` in them."""
        plant = self.recording.plant
        if plant == "flight":
            disc = self.recording.disc
            assert disc is not None
            spin = min(abs(float(state[12])), FASTEST)
            nutation = max(spin * disc.Izz / disc.Ixx, spin, 1.0)
            largest = CORNERED if disc.aero_table is not None else UNEVEN if self.uneven else NUTATION
            # a path shows no nutation: 0.04 mm off after 2.5 s at 138 rad/s, by tables and with a wobble of 2 rad/s
            largest = NUTATION if BOARD.isdisjoint(self.recording.samples) else largest
            h = min(STEP, largest / nutation)
        elif plant == "free_spin":
            h = min(_FREE_STEP, _FREE_NUTATION / max(min(abs(float(state[12])), FASTEST) * 2.0, 1.0))
        elif plant == "spin_down":
            h = 0.01
        else:
            # the fastest the table turns in this piece
            inside = np.interp([start, max(stop, last)], *self.knots)
            within = self.knots[1, (self.knots[0] > start) & (self.knots[0] < max(stop, last))]
            turning = float(np.max(np.abs(np.concatenate([inside, within]))))
            h = min(0.01, RIPPLE / max(self.order * turning, 1.0))
        marks = [start, stop]
        if last > stop:
            marks.append(last + 1e-9)
        if plant == "rate_table":
            marks += [float(t) for t in self.knots[0] if start < t < max(stop, last)]
        for t, width in self.events:
            for mark in (t - 6 * width, t + 6 * width):
                if start < mark < max(stop, last):
                    marks.append(mark)
        marks = sorted(set(marks))
        steps = [np.array([start])]
        for a, b in pairwise(marks):
            fine = h
            for t, width in self.events:
                if abs(0.5 * (a + b) - t) < 6 * width:
                    fine = min(fine, 0.25 * width)
            n = max(1, int(np.ceil((b - a) / fine - 1e-9)))
            steps.append(np.linspace(a, b, n + 1)[1:])
        times = np.concatenate(steps)
        return times, int(np.argmin(np.abs(times - stop)))

    def run(
        self, flats: FloatArray, wobbles: FloatArray, states: FloatArray, times: FloatArray, last: int, out: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return rows (c, m, 19) at instants out and the states (c, s) at ``times[last]``."""
        c = states.shape[0]
        rows, ends = np.empty((c, out.size, ROW)), np.empty(states.shape)
        plant = self.recording.plant
        if plant == "flight":
            flight_pieces(flats, self.lookup, states, times, last, out, rows, ends)
        elif plant == "free_spin":
            free_spin_pieces(flats, wobbles, states, times, last, out, rows, ends)
        elif plant == "spin_down":
            spin_down_pieces(flats, self.lookup, states, times, last, out, rows, ends)
        else:
            table_pieces(flats, self.knots, states, times, last, out, rows, ends)
        return rows, ends


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
    """Return the highest order of a speed ripple among values and among the shapes that columns are taken at."""
    found = [values.get(key, 0.0) for key in _PER_TURN]
    found += [n for c in columns for name, n in c.given if (c.group, name) in _PER_TURN]
    return max(abs(order) for order in found)


#: brief events, and how far from its instant one acts, s: six times its width of 10 ms, and what an instant is moved by
EVENTS, EVENT_REACH = tuple(row.id for row in CATALOGUE.values() if row.brief), 0.08
#: parameters that say how often in a turn something repeats
_PER_TURN = tuple((row.id, row.per_turn) for row in CATALOGUE.values() if row.per_turn)
#: those of a body that is uneven, so that its motion follows the spin
_UNEVEN_BODY = tuple((row.id, name) for row in CATALOGUE.values() if row.follows_spin for name in row.parameters)


def runner_of(recording: Recording, values: Values, columns: Sequence[Column] = ()) -> Runner:
    """Return what runs a recording's segments with values, in steps short enough for ``columns``, too."""
    return Runner(
        recording,
        tables(recording.disc, None, applied_on("motion")),
        _knots(recording),
        _events(values, columns),
        _order(values, columns),
        any(value(values, *key) != 0.0 for key in _UNEVEN_BODY),
    )


#: how the wobble of a free spin dies (1/s) and turns (rad/s), how that differs along and across the wind, and their
#: slopes in time: unknowns of each recording
WOBBLE = (
    *(("free_spin", f"{name}_{unit}") for name in ("decay", "turn", "along", "across") for unit in ("1_s", "1_s2")),
    ("free_spin", "decay_1_s3"),
    ("free_spin", "turn_1_s3"),
)
