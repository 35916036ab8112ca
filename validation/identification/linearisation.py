"""Multiple shooting: a recording as a trajectory of short segments, and how its readings depend on every unknown.

One long simulation from the release has many wrong minima: a spin phase that is off by a turn is one. Here each segment
of half a second starts from a state of its own, so that it stays beside the data whatever physics is missing. The
unknowns of a recording are the first state and the defects between segments; where defects are not allowed, the step of
a fit closes them (multiple shooting; Bock, "Recent advances in parameter identification", 1983).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from discsim.arrays import BoolArray, FloatArray, IntArray
from discsim.effects.catalogue import CATALOGUE
from discsim.effects.sensors import Lag
from discsim.parameters import parameter_index, parameters
from discsim.validation.identification.competing_effects import Competing
from discsim.validation.identification.dynamics import ROW
from discsim.validation.identification.linear import Channel, Linear
from discsim.validation.identification.looks import Look, looks_at, of_each
from discsim.validation.identification.parameters import Values
from discsim.validation.identification.plants import Plant
from discsim.validation.identification.prediction import Sampled
from discsim.validation.identification.propagation import (
    EVENT_REACH,
    EVENTS,
    FLAT_ENVIRONMENT,
    Column,
    base_flat,
    place_in_flat,
    runner_of,
)
from discsim.validation.identification.readings import group_of
from discsim.validation.identification.segments import Trajectory, stepped
from discsim.validation.identification.sensitivities import add_weighted, readings_of_neighbours, write_slopes
from discsim.validation.identification.sensor_model import CLOCKS, is_motion, predicted, sensed

__all__ = ["linearise", "moved", "reread"]

#: instants of several segments that are read together
_INSTANTS = 256
#: fewest segments that are worth a thread of their own
_SHARE = 3
#: a lagged sensor has forgotten its start after this many time constants
_FORGOTTEN = 8.0


def linearise(
    current: Trajectory,
    values: Values,
    columns: Sequence[Column],
    defects: BoolArray,
    *,
    central: bool = True,
    threads: int = 1,
) -> Linear:
    """Linearise the readings of a trajectory about its states and values.

    ``columns`` are parameters with the step of their differences; ``defects`` (d,) tells in which directions segments
    may jump. Columns are differences of the segment's own motion, chained over the segments; one-sided ones, where
    ``central`` is false, cost half. The segments are run on so many ``threads``.
    """
    around = _Around(current, values, columns, central)
    samples = [Sampled(current, readings, values) for readings in current.readings]
    # the instants of all sensors, each with its neighbours in time for slopes and its past for a lag
    segment_of = [current.segment_of(s.instants) for s in samples]
    read = _Read(around, samples)
    ends = read.run_all(segment_of, threads)
    continuity = _continuity(current, around, ends, defects)
    for s, M, rows in zip(samples, read.slopes, read.rows, strict=True):
        _add_sensor_columns(around, s, rows, M)
    return _stack(current, samples, read, segment_of, continuity)


class _Around:
    """The neighbours of a trajectory's motion: one per direction of a state and per parameter of the motion, or two.

    Row 0 is the motion itself; then come ``half`` neighbours ahead and, where differences are central, as many behind;
    none at all where ``central`` is None.
    """

    def __init__(self, current: Trajectory, values: Values, columns: Sequence[Column], central: bool | None) -> None:
        self.trajectory, self.values, self.columns, self.central = current, values, columns, central
        self.recording, self.plant = recording, plant = current.recording, current.plant
        self.effects = effects = current.effects
        self.runner = runner_of(recording, values, columns, effects)
        self.motion = [j for j, column in enumerate(columns) if _moves(column, plant, effects)]
        self.d = d = plant.layout.directions
        self.half = d + len(self.motion)
        #: half the differences, and the columns of slopes that they belong to
        self.widths = np.concatenate([plant.sizes.differences, [columns[j].step for j in self.motion]])
        self.places = np.array([*range(d), *(d + j for j in self.motion)])
        self.flat = base_flat(recording, values, [column.key for column in columns], effects)
        self.own = plant.own_values(values)
        signs = () if central is None else (1.0, -1.0) if central else (1.0,)
        self.flats = np.repeat(self.flat[None], 1 + len(signs) * self.half, axis=0)
        self.owns = np.repeat(self.own[None], 1 + len(signs) * self.half, axis=0)
        tangents = np.zeros((1 + len(signs) * self.half, d))
        for side, sign in enumerate(signs):
            first = 1 + side * self.half
            tangents[first : first + d] = sign * np.diag(plant.sizes.differences)
            for row, j in enumerate(self.motion, first + d):
                self._set_parameter(row, columns[j], sign)
        self.everyone = np.arange(tangents.shape[0])
        #: the states (k, c, s) that the neighbours of each segment start from
        self.states = np.repeat(current.states[:, None], tangents.shape[0], axis=1)
        turned = np.flatnonzero(np.any(tangents != 0.0, axis=1))
        self.states[:, turned] = plant.layout.moved(current.states[:, None], tangents[turned])
        #: rows of the neighbours that belong to a short event, and when it is there and in the motion itself, s
        self._events = {
            row: instants
            for row, column in enumerate([columns[j] for j in self.motion], 1 + d)
            if (instants := _instants(column, values))
        }

    def acting(self, start: float, stop: float) -> IntArray:
        """Return the neighbours (a,) that may part from the motion between two instants: an event moves no others."""
        if not self._events:
            return self.everyone
        first, last = start - EVENT_REACH, stop + EVENT_REACH
        still = [row for row, instants in self._events.items() if not any(first < t < last for t in instants)]
        still += [row + self.half for row in still] if self.central else []
        return np.setdiff1d(self.everyone, still)

    def _set_parameter(self, row: int, column: Column, sign: float) -> None:
        """Move a parameter of the motion in one row of neighbours."""
        group, name, size, given = column
        if column.key in self.plant.motion_keys:
            self.owns[row, self.plant.motion_keys.index(column.key)] += sign * size
            return
        for shape, number in given:
            self.flats[row, place_in_flat(group, shape, self.effects)] = number
        self.flats[row, place_in_flat(group, name, self.effects)] += sign * size

    def current(self, group: str, name: str) -> float:
        """Return the value a parameter has now: given, or as the recording states it, or the baseline."""
        if (group, name) in self.values:
            return self.values[group, name]
        if (row := self.effects.row(group)) is not None:
            return row.fitted[name]
        recording = self.recording
        if group == "environment" and name.startswith("magnetic_"):
            return float(recording.environment.magnetic_field[["north", "east", "down"].index(name.split("_")[1])])
        own = next((q for q in (*self.plant.own, *self.plant.held, *self.plant.zeros) if q.key == (group, name)), None)
        if own is not None:
            return own.stated
        return float(parameters(recording.environment, recording.disc, recording.rig)[parameter_index(group, name)])

    def read(self, sensor: str, values: Values, t: FloatArray, rows: FloatArray) -> FloatArray:
        """Return what a sensor reads (..., m, k) at true times t (m,) of rows (..., m, 19) under some values."""
        return predicted(sensor, self.recording, values, t, rows, self.effects)

    def slopes(self, values: FloatArray, acting: IntArray | None = None) -> FloatArray:
        """Return slopes (half, ...) from what the motion and its neighbours give (c, ...), or those that are acting."""
        half, widths = self.half, self.widths
        if acting is not None:
            chosen = acting[(acting > 0) & (acting <= half)]
            half, widths = chosen.size, widths[chosen - 1]
        ahead = values[1 : 1 + half]
        behind, span = (values[1 + half :], 2.0 * widths) if self.central else (values[:1], widths)
        return np.asarray((ahead - behind) / span.reshape(-1, *(1,) * (values.ndim - 1)))


def reread(current: Trajectory, values: Values, linear: Linear, threads: int = 1) -> Linear | None:
    """Return a linearisation with the residuals where a trajectory stands now, and its slopes as they were (a chord).

    One motion in the place of dozens, for steps within which the slopes hardly change. None where other readings take
    part, or fall into other segments, than in ``linear``.
    """
    d = current.plant.layout.directions
    samples = [Sampled(current, readings, values) for readings in current.readings]
    segment_of = [current.segment_of(s.instants) for s in samples]
    read = _Read(_Around(current, values, (), None), samples)
    ends = read.run_all(segment_of, threads)[:, 0]
    raw: list[FloatArray] = []
    channels = iter(linear.channels)
    for s, y, segment in zip(samples, read.ideal, segment_of, strict=True):
        prediction = s.weighted(y)
        for axis in range(s.width):
            index = _counted(s, prediction, axis)
            if index.size == 0:
                continue
            channel = next(channels, None)
            if channel is None or not np.array_equal(channel.index, index):
                return None
            if not np.array_equal(linear.segment[channel.rows], segment[index] if s.nodes == 1 else -1 + 0 * index):
                return None
            raw.append(s.readings.value[index, axis] - prediction[index, axis])
    if next(channels, None) is not None:
        return None
    mismatch = current.plant.layout.difference(current.states[1:], ends[:-1])
    matching = _matching(linear.transitions, mismatch, np.setdiff1d(np.arange(d), linear.defect_kind))
    defect, some = np.zeros_like(linear.defect), linear.defect_kind >= 0
    defect[some] = mismatch[linear.defect_segment[some] - 1, linear.defect_kind[some]]
    return replace(
        linear,
        raw=np.concatenate([np.empty(0), *raw]),
        defect=defect,
        matching=matching,
        mismatch=mismatch,
        shifts=np.einsum("nd,nd->n", linear.own[:, :d], matching[linear.segment]),
    )


class _Read:
    """What each sensor reads of a trajectory's motion, and its slopes by its segment's state and the parameters.

    Attributes
    ----------
    rows : list of (m, 19) arrays
        The motion at each sensor's instants.
    ideal : list of (m, width) arrays
        What an ideal sensor shows there.
    slopes : list of (m, width, d + p) arrays
    """

    def __init__(self, around: _Around, samples: Sequence[Sampled]) -> None:
        self._around, self._samples = around, samples
        columns = around.d + len(around.columns)
        self.rows = [np.empty((s.instants.size, ROW)) for s in samples]
        self.ideal = [np.empty((s.instants.size, s.width)) for s in samples]
        self.slopes = [np.zeros((s.instants.size, s.width, columns)) for s in samples]
        self._senses = [sensed(s.sensor, around.recording, around.values, around.effects) for s in samples]

    def run_all(self, segment_of: Sequence[IntArray], threads: int) -> FloatArray:
        """Run all segments and read the sensors; return the states (k, c, s) at the ends of the segments.

        Each segment starts from a state of its own, so that shares of them run side by side on ``threads``.
        """
        ends = np.empty(self._around.states.shape)
        looks = looks_at([s.instants for s in self._samples], segment_of, len(ends))
        shares = np.array_split(np.arange(len(ends)), max(1, min(threads, len(ends) // _SHARE)))
        if len(shares) == 1:
            self._run(shares[0], looks, ends)
            return ends
        with ThreadPoolExecutor(len(shares)) as pool:
            tasks = [pool.submit(copy_context().run, self._run, share, looks, ends) for share in shares]
            for task in tasks:
                task.result()
        return ends

    def _run(self, share: IntArray, looks: Sequence[Look], ends: FloatArray) -> None:
        """Run a share of the segments, read the sensors, and write the states (c, s) at its ends into ``ends``."""
        around, nodes = self._around, self._around.trajectory.nodes
        waiting: list[tuple[list[IntArray], IntArray, FloatArray]] = []
        acted, flats, owns = around.everyone, around.flats, around.owns
        for i in share:
            start, stop = float(nodes[i]), float(nodes[i + 1])
            own, place, out = looks[i]
            last_instant = float(out[-1]) if out.size else stop
            times, last = around.runner.times(start, stop, last_instant, around.trajectory.states[i])
            acting = around.acting(start, float(times[-1]))
            if not np.array_equal(acting, acted):
                self._read(waiting, acted)
                waiting, acted, flats, owns = [], acting, around.flats[acting], around.owns[acting]
            rows, there = around.runner.run(
                flats,
                owns,
                around.states[i, acting],
                times,
                last,
                np.maximum(out, start),
            )
            ends[i] = there[0]
            ends[i, acting] = there
            waiting.append((own, place, rows))
            if sum(rows.shape[1] for *_, rows in waiting) >= _INSTANTS:
                self._read(waiting, acted)
                waiting = []
        self._read(waiting, acted)

    def _read(self, segments: Sequence[tuple[list[IntArray], IntArray, FloatArray]], acting: IntArray) -> None:
        """Read the sensors in the rows of segments, which are those of the neighbours that are ``acting`` there.

        A segment is the readings of each sensor in it, the place of each among its instants, and its rows.
        """
        if not segments:
            return
        around = self._around
        half = acting[(acting > 0) & (acting <= around.half)]
        columns, spans = around.places[half - 1], around.widths[half - 1] * (2.0 if around.central else 1.0)
        rows = segments[0][2] if len(segments) == 1 else np.concatenate([one[2] for one in segments], axis=1)
        firsts = np.cumsum([0, *(one[2].shape[1] for one in segments)])
        bounds = [np.cumsum([0, *(o.size for o in own)]) for own, *_ in segments]
        for which, s in enumerate(self._samples):
            o = np.concatenate([own[which] for own, *_ in segments])
            if o.size == 0:
                continue
            mine = np.concatenate(
                [
                    first + place[b[which] : b[which + 1]]
                    for first, b, (_, place, _) in zip(firsts, bounds, segments, strict=False)
                ]
            )
            t, motion = s.instants[o], rows[0, mine]
            self.rows[which][o] = motion
            # weighted means share instants: each is read once
            once, first, again = (
                np.unique(mine, return_index=True, return_inverse=True)
                if s.nodes > 1
                else (mine, slice(None), slice(None))
            )
            read = partial(around.read, s.sensor, around.values, t[first])
            ideal, follows = readings_of_neighbours(read, self._senses[which], rows, once, spans, bool(around.central))
            ideal, follows = ideal[again], follows[again]
            self.ideal[which][o] = ideal + s.held[o]
            for j, place in enumerate(half - 1 - around.d):
                if place >= 0 and around.columns[around.motion[place]].key in _ALSO_READ:
                    # it moves the readings of a given motion, too
                    follows[:, :, j] += self._also_moved(s.sensor, t, motion, around.columns[around.motion[place]])
            write_slopes(follows, o, columns, self.slopes[which])

    def _also_moved(self, sensor: str, t: FloatArray, rows: FloatArray, column: Column) -> FloatArray:
        """Return how what a sensor reads of a given motion follows a parameter, (m, width)."""
        around = self._around
        now = around.current(*column.key)
        up, down = (
            around.read(sensor, {**around.values, column.key: now + sign * column.step}, t, rows)
            for sign in (1.0, -1.0)
        )
        return np.asarray((up - down) / (2.0 * column.step))


@dataclass(frozen=True)
class _Continuity:
    """How the segments follow the unknowns and one another; as the attributes of `Linear` of these names."""

    sensitivities: FloatArray
    transitions: FloatArray
    matching: FloatArray
    mismatch: FloatArray
    allowed: IntArray
    unknowns: int


def _continuity(current: Trajectory, around: _Around, ends: FloatArray, defects: BoolArray) -> _Continuity:
    """Chain the segments: their states as functions of [first state | defects | parameters]."""
    layout, d, k, p = current.plant.layout, around.d, current.states.shape[0], len(around.columns)
    allowed, forbidden = np.flatnonzero(defects), np.flatnonzero(~defects)
    u = d + (k - 1) * allowed.size
    S = np.zeros((k, d, u + p))
    S[0, :, :d] = np.eye(d)
    transitions = np.zeros((max(k - 1, 0), d, d + p))
    nominal = ends[:-1, 0]
    mismatch = layout.difference(current.states[1:], nominal)
    reached = layout.difference(ends[:-1], np.broadcast_to(nominal[:, None], ends[:-1].shape))
    transitions[:, :, around.places] = np.moveaxis(around.slopes(np.moveaxis(reached, 1, 0)), 0, 2)
    for i in range(k - 1):
        Phi, first = transitions[i, :, :d], d + i * allowed.size
        S[i + 1, :, :first] = Phi @ S[i, :, :first]
        S[i + 1, :, u:] = Phi @ S[i, :, u:] + transitions[i, :, d:]
        S[i + 1, allowed, first + np.arange(allowed.size)] = 1.0
    return _Continuity(S, transitions, _matching(transitions, mismatch, forbidden), mismatch, allowed, u)


def _matching(transitions: FloatArray, mismatch: FloatArray, forbidden: IntArray) -> FloatArray:
    """Return how the states of the segments (k, d) move to close the defects that are not allowed."""
    d = mismatch.shape[1]
    matching = np.zeros((mismatch.shape[0] + 1, d))
    for i, gap in enumerate(mismatch):
        matching[i + 1] = transitions[i, :, :d] @ matching[i]
        matching[i + 1, forbidden] -= gap[forbidden]
    return matching


def _add_sensor_columns(around: _Around, s: Sampled, rows: FloatArray, M: FloatArray) -> None:
    """Write the slopes by parameters of sensors and clocks into M (m, width, d + p), from the motion as it is."""
    values = around.values
    rate: FloatArray | None = None
    for j, (group, name, size, given) in enumerate(around.columns):
        if (group, name) in around.plant.held_keys:
            if s.dying is not None:
                M[:, around.plant.held_keys.index((group, name)), around.d + j] = s.dying
            continue
        if (group, name) in around.plant.zero_keys:
            if s.sensor == "magnetometer":
                M[:, around.plant.zero_keys.index((group, name)), around.d + j] = 1.0
            continue
        if j in around.motion or not _concerns(group, s.sensor, around.effects):
            continue
        here = {**values, **{(group, shape): number for shape, number in given}}
        place = around.d + j
        if group in CLOCKS or group in _LAGS:
            if rate is None:
                rate = s.time_slope(around.runner, around.flat, around.own, values, around.trajectory)
            if group in CLOCKS:
                base = around.current(group, name)
                plus, minus = {**here, (group, name): base + size}, {**here, (group, name): base - size}
                late = (s.delays(plus) - s.delays(minus)) / (2.0 * size)
            else:
                late = s.lag_slope
            M[:, :, place] = -rate * late[:, None]
            if group in _LAGS:
                M[:, :, place] += s.held_slope
            continue
        base = around.current(group, name)
        up = around.read(s.sensor, {**here, (group, name): base + size}, s.instants, rows)
        down = around.read(s.sensor, {**here, (group, name): base - size}, s.instants, rows)
        M[:, :, place] = (up - down) / (2.0 * size)


#: parameters of the motion that also enter what a sensor reads of a given motion
_ALSO_READ = {
    *((row.id, name) for row in CATALOGUE.values() if row.also_read for name in row.parameters),
    ("environment", "gravity"),
}
#: the effects by which a sensor lags
_LAGS = {row.id for row in CATALOGUE.values() if row.type is Lag}


def _instants(column: Column, values: Values) -> tuple[float, ...]:
    """Return when the event is that a column belongs to, as it is given and as it is, s; nothing of no short event."""
    if column.group not in EVENTS:
        return ()
    return tuple(t for t in (dict(column.given).get("t_s"), values.get((column.group, "t_s"))) if t is not None)


def _moves(column: Column, plant: Plant, effects: Competing) -> bool:
    """Tell whether a column is of the motion; the field of the earth is only read."""
    if column.group == "environment":
        return column.key in FLAT_ENVIRONMENT
    return is_motion(column.group, effects) or column.key in plant.motion_keys


def _concerns(group: str, sensor: str, effects: Competing) -> bool:
    """Tell whether an effect that is not of the motion can touch a sensor."""
    if group == "environment":
        return sensor == "magnetometer"
    row = effects.row(group)
    return row is not None and row.acts_with((sensor,))


def _counted(s: Sampled, prediction: FloatArray, axis: int) -> IntArray:
    """Return the places of the readings of one axis that take part beside a prediction (n, width)."""
    readings, limit = s.readings, s.readings.limit
    good = readings.good[:, axis]
    if s.tau > 0 and s.dying is None:
        good = good & (readings.t > _FORGOTTEN * s.tau)
    if limit is not None:
        # a clipped reading says only that the motion was beyond the range
        margin = 6.0 * np.nan_to_num(readings.sd[..., axis])
        inside = readings.clipped[:, axis] & (np.abs(prediction[:, axis]) < limit - margin)
        good = good | (inside & np.isfinite(readings.value[:, axis]))
    return np.flatnonzero(good)


def _channel(s: Sampled, axis: int, at: int, index: IntArray) -> Channel:
    """Return where the rows of an axis stand, from ``at`` on, of readings ``index`` (n,) of its sensor."""
    readings, rows = s.readings, slice(at, at + index.size)
    return Channel(s.sensor, readings.axes[axis], group_of(s.sensor, axis), rows, index, readings.worth)


def _stack(
    current: Trajectory,
    samples: Sequence[Sampled],
    read: _Read,
    segment_of: Sequence[IntArray],
    continuity: _Continuity,
) -> Linear:
    """Put the rows of all sensors together, channel by channel, without those that take no part."""
    S, matching, u = continuity.sensitivities, continuity.matching, continuity.unknowns
    raw, own, segments, whole, t, sd, shifts = [], [], [], [], [], [], []
    channels: list[Channel] = []
    at = 0
    d = current.plant.layout.directions
    p = S.shape[2] - u
    for s, y, M, segment in zip(samples, read.ideal, read.slopes, segment_of, strict=True):
        readings = s.readings
        # what the closing of forbidden defects adds
        closed = np.einsum("mwd,md->mw", M[:, :, :d], matching[segment])
        spread = s.nodes > 1
        prediction, closed = s.weighted(y), s.weighted(closed)
        slopes = _by_unknowns(s, M, segment, continuity) if spread else M
        for axis in range(s.width):
            index = _counted(s, prediction, axis)
            if index.size == 0:
                continue
            raw.append(readings.value[index, axis] - prediction[index, axis])
            if spread:
                whole.append(slopes[index, axis])
                own.append(np.zeros((index.size, d + p)))
                segments.append(np.full(index.size, -1))
            else:
                own.append(slopes[index, axis])
                segments.append(segment[index])
            shifts.append(closed[index, axis])
            t.append(readings.t[index])
            sd.append(np.broadcast_to(readings.sd, readings.value.shape)[index, axis])
            channels.append(_channel(s, axis, at, index))
            at += index.size

    def joined(parts: list[Any]) -> Any:
        return np.concatenate(parts) if parts else np.empty(0)

    rows_of = joined(own) if own else np.empty((0, d + p))
    return Linear(
        joined(raw),
        rows_of,
        joined(segments).astype(np.int64),
        joined(whole) if whole else np.empty((0, u + p)),
        joined(t),
        joined(sd),
        tuple(channels),
        *_jumps(continuity),
        S,
        continuity.transitions,
        matching,
        continuity.mismatch,
        joined(shifts),
        bool(current.recording.averaged),
    )


def _by_unknowns(s: Sampled, M: FloatArray, segment: IntArray, continuity: _Continuity) -> FloatArray:
    """Return slopes (n, width, u + p) of weighted readings by the unknowns of a recording.

    ``M`` are those of what they are means of, by the states of its segments. The instants of one reading lie in few
    segments: what it says of the state of each is summed first.
    """
    S, u = continuity.sensitivities, continuity.unknowns
    d, full = S.shape[1], np.zeros((M.shape[0] // s.nodes, M.shape[1], S.shape[2]))
    if full.shape[2] > u:
        full[:, :, u:] = s.weighted(M[:, :, d:])
    assert s.weights is not None
    weights, reading = s.weights.ravel(), np.arange(M.shape[0]) % full.shape[0]
    for i, mine in enumerate(of_each(segment, S.shape[0])):
        mine = mine[weights[mine] != 0.0]
        which, place = np.unique(reading[mine], return_inverse=True)
        said = np.zeros((which.size, M.shape[1], d))
        add_weighted(M, weights, mine, place, said)
        # a state follows what comes before it alone
        before = d + i * continuity.allowed.size
        full[which, :, :before] += said @ S[i, :, :before]
        full[which, :, u:] += said @ S[i, :, u:]
    return full


def _jumps(continuity: _Continuity) -> tuple[FloatArray, IntArray, IntArray]:
    """Return size (u,), direction (-1: none) and segment of the defects among the unknowns."""
    d, u, allowed = continuity.sensitivities.shape[1], continuity.unknowns, continuity.allowed
    defect, kind, where = np.zeros(u), np.full(u, -1), np.zeros(u, dtype=np.int64)
    for i, gap in enumerate(continuity.mismatch):
        place = slice(d + i * allowed.size, d + (i + 1) * allowed.size)
        defect[place], kind[place], where[place] = gap[allowed], allowed, i + 1
    return defect, kind, where


def moved(current: Trajectory, linear: Linear, nuisance: FloatArray, common: FloatArray) -> Trajectory:
    """Return the trajectory after a step of its unknowns: local (l,) and shared (p,)."""
    return stepped(current, linear.sensitivities @ np.concatenate([nuisance, common]) + linear.matching)
