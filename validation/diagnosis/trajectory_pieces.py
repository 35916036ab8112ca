"""A recording as a chain of short pieces of motion, and how its readings depend on every unknown: one linearisation.

One long simulation from the release has many wrong minima: a spin phase that is off by a turn is one. Here each piece
of half a second starts from a state of its own, so that it stays beside the data whatever physics is missing. The
unknowns of a recording are the first state and the jumps between pieces; where jumps are not allowed, the step of a
fit closes them (multiple shooting; Bock, "Recent advances in parameter identification", 1983).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.effects.catalogue import CATALOGUE
from discsim.frames import conjugate, multiply, rotation_vector, turn
from discsim.parameters import PARAMETERS, Tables, parameter_index, parameters, tables
from discsim.recording import SENSORS, Recording
from validation.diagnosis.pieces_of_motion import (
    LAW_PLACES,
    ROW,
    SIZE,
    STATE,
    flight_pieces,
    free_spin_pieces,
    spin_down_pieces,
    table_pieces,
)
from validation.diagnosis.plateau import plateau
from validation.diagnosis.readings import CLOCKS, Values, delay, is_motion, predicted, value
from validation.diagnosis.rows import row_of, user_effects_on
from validation.diagnosis.starts import spin_starts

__all__ = [
    "STEPS",
    "WOBBLE",
    "Chain",
    "Channel",
    "Column",
    "Linear",
    "Readings",
    "chain",
    "group_of",
    "linearise",
    "moved",
    "read",
    "readings_of",
    "recut",
    "shown",
    "stepped",
    "undone",
]

IntArray: TypeAlias = np.ndarray[Any, np.dtype[np.int64]]

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
#: a table turns a corner of its command within some of the time constants of its speed loop, s
CORNER = 4e-3
#: half the differences of states: m, m/s, rad, rad/s
STEPS = {
    "flight": np.repeat([1e-3, 1e-3, 1e-5, 1e-4], 3),
    "free_spin": np.array([1e-2, 1e-2, 1e-2, 1e-2, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4, 1e-3, 3e-3, 3e-3]),
    "spin_down": np.array([1e-5, 1e-4]),
    "rate_table": np.array([1e-5]),
}
#: longest step of a free spin, s: the moments of the air change within 20 ms of release
_FREE_STEP = 0.005
#: half the difference in time by which a reading's slope is taken, s
_TIME_STEP = 2e-4
#: neighbours simulated at a time, to bound memory
_BATCH = 16
#: instants of several pieces that are read together
_INSTANTS = 256
#: nodes and weights of a first-order lag: an integral over the past with weight exp(-s)
_LAG_NODES, _LAG_WEIGHTS = np.polynomial.laguerre.laggauss(8)
#: a lagged sensor has forgotten its start after this many time constants
_FORGOTTEN = 8.0


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


@dataclass(frozen=True)
class Readings:
    """The usable readings of one sensor of a recording.

    t (n,) written times; value (n, k); good (n, k) tells which readings count; sd (k,) the stated noise with rounding
    (NaN where nothing is stated); clipped (n, k) stand at the limit, which is the range unless readings stand still
    below it.
    """

    sensor: str
    t: FloatArray
    value: FloatArray
    good: BoolArray
    clipped: BoolArray
    sd: FloatArray
    axes: tuple[str, ...]
    #: the range that clips them, as stated or lower; None where there is none
    limit: float | None = None
    #: written times and weights (w, n) of the samples that each reading is a mean of; None where it is one sample
    taken: FloatArray | None = None
    weights: FloatArray | None = None


@dataclass(frozen=True)
class Channel:
    """One axis of one sensor in a linearisation: where its rows are, and their place among the sensor's samples."""

    sensor: str
    axis: str
    group: str
    rows: slice
    index: IntArray


@dataclass(frozen=True)
class Chain:
    """The pieces of one recording: boundaries (k + 1,) s and the states (k, s) they start from."""

    recording: Recording
    readings: tuple[Readings, ...]
    edges: FloatArray
    states: FloatArray
    #: sensor -> samples lost before each of its samples (n,), where some were
    lost: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def tangent(self) -> int:
        """Number of directions in which a state can move."""
        return {"flight": 12, "free_spin": 15, "spin_down": 2, "rate_table": 1}[self.recording.plant]


@dataclass(frozen=True)
class Linear:
    """Residuals of a recording and how they depend on its unknowns: ``residual - J du``.

    The unknowns are the local ones, the first state and the allowed jumps (l,), and the shared ones (p,). Each row is
    kept by the state of its own piece (compact); `local` and `shared` chain the pieces on demand.

    Attributes
    ----------
    raw : (n,) array
        Measured minus predicted where the chain stands, rows by channel.
    own : (n, d + p) array
        Derivatives of the prediction by the state of the row's piece and by the parameters within it.
    piece : (n,) int array
        The piece of each row; -1 for a reading that hangs on several, as with a lag or where it is a mean.
    whole : (m, l + p) array
        Derivatives of those by the unknowns themselves, in their order.
    t, sd : (n,) arrays
        Written times, stated noise.
    channels : tuple of Channel
    jump, jump_kind, jump_piece : (l,) arrays
        Current size of each allowed jump, its direction within the state (-1 for the first state) and its piece.
    moves : (k, d, l + p) array
        How the states of the pieces follow the unknowns.
    passes : (k - 1, d, d + p) array
        How the state of each next piece follows that of the one before and the shared parameters.
    closing : (k, d) array
        How they move to close the jumps that are not allowed.
    gaps : (k - 1, d) array
        All jumps as they stand.
    shifts : (n,) array
        What the closing adds to the prediction.
    """

    raw: FloatArray
    own: FloatArray
    piece: IntArray
    whole: FloatArray
    t: FloatArray
    sd: FloatArray
    channels: tuple[Channel, ...]
    jump: FloatArray
    jump_kind: IntArray
    jump_piece: IntArray
    moves: FloatArray
    passes: FloatArray
    closing: FloatArray
    gaps: FloatArray
    shifts: FloatArray

    @property
    def unknowns(self) -> int:
        """Number of local unknowns, l."""
        return self.jump.size

    @property
    def residual(self) -> FloatArray:
        """Measured minus predicted (n,) once the jumps that are not allowed are closed."""
        return self.raw - self.shifts

    @cached_property
    def _full(self) -> FloatArray:
        d, width = self.moves.shape[1:]
        full = np.empty((self.raw.size, width))
        for i in range(self.moves.shape[0]):
            rows = np.flatnonzero(self.piece == i)
            full[rows] = self.own[rows, :d] @ self.moves[i]
        full[:, self.unknowns :] += self.own[:, d:]
        if self.whole.size:
            full[self.piece < 0] = self.whole
        return full

    def spread(self, places: Sequence[int], width: int) -> Linear:
        """Return the linearisation with its shared columns at ``places`` of ``width``, the others zero."""
        u, n = self.unknowns, self.raw.size
        kept = self.own.shape[1] - len(places)
        own = np.zeros((n, kept + width))
        own[:, :kept] = self.own[:, :kept]
        own[:, [kept + j for j in places]] = self.own[:, kept:]
        moves = np.zeros((*self.moves.shape[:2], u + width))
        moves[:, :, :u] = self.moves[:, :, :u]
        moves[:, :, [u + j for j in places]] = self.moves[:, :, u:]
        passes = np.zeros((*self.passes.shape[:2], kept + width))
        passes[:, :, :kept] = self.passes[:, :, :kept]
        passes[:, :, [kept + j for j in places]] = self.passes[:, :, kept:]
        whole = np.zeros((self.whole.shape[0], u + width))
        whole[:, :u] = self.whole[:, :u]
        whole[:, [u + j for j in places]] = self.whole[:, u:]
        return replace(self, own=own, moves=moves, passes=passes, whole=whole)

    def after(self, local: FloatArray, shared: FloatArray) -> FloatArray:
        """Return the residuals (n,) that a step of the unknowns is expected to leave."""
        d = self.moves.shape[1]
        step = np.concatenate([local, shared])
        tangents = self.moves @ step
        moved = np.einsum("nd,nd->n", self.own[:, :d], tangents[self.piece]) + self.own[:, d:] @ shared
        if self.whole.size:
            moved[self.piece < 0] = self.whole @ step
        return np.asarray(self.residual - moved)

    @property
    def local(self) -> FloatArray:
        """Derivatives of the prediction (n, l) by the local unknowns."""
        return self._full[:, : self.unknowns]

    @property
    def shared(self) -> FloatArray:
        """Derivatives of the prediction (n, p) by the shared parameters."""
        return self._full[:, self.unknowns :]


# ------------------------------------------------------------------------------------------------- readings


def readings_of(recording: Recording) -> tuple[Readings, ...]:
    """Return the usable readings of all sensors: gaps, and readings that stand at a limit, take no part."""
    found = []
    for sensor in SENSORS:
        samples = recording.get(sensor)
        if samples is None or len(samples) == 0:
            continue
        sheet = recording.sheets[sensor]
        measured = samples.value if samples.value.ndim == 2 else samples.value[:, None]
        if sensor == "gps":
            sd = np.repeat([_or_nan(sheet.noise_rms or None), _or_nan(sheet.velocity_noise_rms or None)], 3)
            clipped, limit = np.zeros(measured.shape, dtype=np.bool_), None
        else:
            level = np.hypot(_or_nan(sheet.noise_rms), (sheet.resolution or 0.0) / np.sqrt(12.0))
            # a noise of zero is none: nobody knows it
            sd = np.full(measured.shape[1], level if level > 0.0 else np.nan)
            clipped, limit = sheet.clipped(measured), sheet.range
            lower = plateau(recording) if sensor == "accelerometer" else None
            if lower is not None:
                clipped, limit = np.abs(measured) >= lower - 1e-9 * lower, lower
        good = np.isfinite(measured) & ~clipped
        if sensor == "accelerometer" and recording.plant == "rate_table" and recording.command is not None:
            # there a real table's angular acceleration is neither that before the knot nor that after it
            apart = np.abs(samples.t[:, None] - recording.command.t[None, :])
            good &= np.min(apart, axis=1, initial=np.inf)[:, None] > CORNER
        axes = tuple(SENSORS[sensor].columns)
        t, m = samples.t, measured
        one = Readings(sensor, t, m, good, clipped, sd, axes, limit)
        if recording.plant == "free_spin" and sensor == "accelerometer":
            found += _over_turns(recording, one)
        else:
            found.append(one)
    return tuple(found)


#: a reading of a turn's mean is a mean over this many turns, weighted as if a turn's mean were taken three times: what
#: turns once per turn is not seen, nor its slope, nor its curvature
_TURNS = 3.0


def _over_turns(recording: Recording, one: Readings) -> list[Readings]:
    """Return the means over turns of an accelerometer on a disc whose path is unknown.

    Translation and gravity turn with the spin and average out; what remains of x and y is centripetal.
    """
    grid = np.linspace(0.0, recording.end, max(int(recording.end / 0.05), 2))
    rate = spin_starts(recording, grid).rate[:, 2]
    phase = np.interp(one.t, grid, np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(grid))]))
    phase = np.abs(phase) / (2.0 * np.pi)
    centres = np.arange(phase[0] + _TURNS / 2, phase[-1] - _TURNS / 2, _TURNS / 2)
    first, last = np.searchsorted(phase, centres - _TURNS / 2), np.searchsorted(phase, centres + _TURNS / 2)
    if centres.size < 4 or np.any(np.diff(phase) < 0) or np.min(last - first) < 8:
        return []
    width = int(np.max(last - first))
    place = np.minimum(first[None, :] + np.arange(width)[:, None], one.t.size - 1)
    inside = np.arange(width)[:, None] < (last - first)[None, :]
    usable = np.all(one.good[:, :2], axis=1)
    off = np.abs(phase[place] - centres)
    bell = np.where(off < 0.5, 0.75 - off**2, 0.5 * np.maximum(_TURNS / 2 - off, 0.0) ** 2)
    weights = np.where(inside & usable[place], bell, 0.0)
    # where samples are missing, what turns with the spin does not average out
    whole = np.sum(inside & ~usable[place], axis=0) == 0
    weights = weights / np.maximum(np.sum(weights, axis=0), 1e-12)
    values = np.einsum("wn,wnk->nk", weights, np.nan_to_num(one.value)[place])
    good = np.repeat(whole[:, None], 3, axis=1)
    good[:, 2] = False
    t = np.einsum("wn,wn->n", weights, one.t[place])
    sd = one.sd * float(np.sqrt(np.median(np.sum(weights**2, axis=0))))
    clipped = np.zeros(values.shape, dtype=np.bool_)
    return [Readings(one.sensor, t, values, good, clipped, sd, one.axes, None, one.t[place], weights)]


def _or_nan(number: float | None) -> float:
    return np.nan if number is None else number


# -------------------------------------------------------------------------------------------------- plants


def base_flat(recording: Recording, values: Values, columns: Sequence[tuple[str, str]] = ()) -> FloatArray:
    """Return the flat parameter array of a recording's baseline with values in their places.

    ``columns`` are keys that need a place, too.
    """
    flat = np.concatenate([parameters(recording.environment, recording.disc, recording.rig), _own_sizes().ravel()])
    terms = 1 + max((_term(name) for group, name in (*values, *columns) if group == "law"), default=-1)
    flat = np.concatenate([flat, np.zeros(terms * len(LAW_PLACES))])
    for (group, name), number in values.items():
        if (is_motion(group) and group != "environment") or (group, name) in _FLAT_ENVIRONMENT:
            flat[_place(group, name)] = number
    return flat


def _term(name: str) -> int:
    return int(name.partition(".")[0])


def _place(group: str, name: str) -> int:
    """Return the place of a parameter in a flat array: behind the physics own effects stand, and then a law's terms."""
    if group == "law":
        behind = SIZE + _own_sizes().size
        return behind + _term(name) * len(LAW_PLACES) + LAW_PLACES.index(name.partition(".")[2])
    own = [effect.id for effect in user_effects_on("motion")]
    if group in own:
        row = row_of(group)
        assert row is not None
        return int(SIZE + own.index(group) * _own_sizes().shape[1] + row.parameters.index(name))
    return parameter_index(group, name)


def _own_sizes() -> FloatArray:
    """Return the parameters of the user's own effects on motion at which they do nothing, (effects, k)."""
    return tables(None, None, [effect.sized({}) for effect in user_effects_on("motion")]).own_sizes


_FLAT_ENVIRONMENT = {("environment", name) for name in PARAMETERS["environment"].names or ()}


def shifted(plant: str, states: FloatArray, tangents: FloatArray) -> FloatArray:
    """Return states (..., s) moved by tangents (..., d): rotations are small turns in B."""
    shape = (*np.broadcast_shapes(states.shape[:-1], tangents.shape[:-1]), states.shape[-1])
    moved = np.array(np.broadcast_to(states, shape))
    if plant in ("flight", "free_spin"):
        moved[..., :6] += tangents[..., :6]
        moved[..., 6:10] = multiply(moved[..., 6:10], turn(tangents[..., 6:9]))
        moved[..., 10:] += tangents[..., 9:]
    else:
        d = tangents.shape[-1]
        moved[..., :d] += tangents
    return moved


def difference(plant: str, a: FloatArray, b: FloatArray, d: int) -> FloatArray:
    """Return the tangents (..., d) that move states b (..., s) to a."""
    if plant in ("flight", "free_spin"):
        return np.concatenate(
            [
                a[..., :6] - b[..., :6],
                rotation_vector(multiply(conjugate(b[..., 6:10]), a[..., 6:10])),
                a[..., 10:] - b[..., 10:],
            ],
            axis=-1,
        )
    return np.asarray(a[..., :d] - b[..., :d])


@dataclass(frozen=True)
class _Runner:
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
            h = min(STEP, largest / nutation)
        elif plant == "free_spin":
            h = min(_FREE_STEP, 0.15 / max(min(abs(float(state[12])), FASTEST) * 2.0, 1.0))
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
    """Return instants and widths of short events among values and among the shapes that columns are taken at."""
    found = {values[group, "t_s"] for group in _EVENTS if (group, "t_s") in values}
    found |= {number for column in columns if column.group in _EVENTS for name, number in column.given if name == "t_s"}
    return tuple((t, 0.01) for t in sorted(found))


def _order(values: Values, columns: Sequence[Column] = ()) -> float:
    """Return the highest order of a speed ripple among values and among the shapes that columns are taken at."""
    found = [values.get(("rig.speed_ripple", "order"), 0.0)]
    found += [n for c in columns if c.group == "rig.speed_ripple" for name, n in c.given if name == "order"]
    return max(abs(order) for order in found)


_EVENTS = ("event.impulse", "event.spin_step")


_UNEVEN_BODY = (
    ("body.inertia_asymmetry", "dIyy_kg_m2"),
    ("body.mass_imbalance", "ex_m"),
    ("body.mass_imbalance", "ey_m"),
)


def _runner(recording: Recording, values: Values, columns: Sequence[Column] = ()) -> _Runner:
    return _Runner(
        recording,
        tables(recording.disc, None, [effect.sized({}) for effect in user_effects_on("motion")]),
        _knots(recording),
        _events(values, columns),
        _order(values, columns),
        any(value(values, *key) != 0.0 for key in _UNEVEN_BODY),
    )


# ------------------------------------------------------------------------------------------ linearisation


def chain(
    recording: Recording, edges: FloatArray, states: FloatArray, lost: Mapping[str, FloatArray] | None = None
) -> Chain:
    """Return a recording cut at edges (k + 1,) s with states (k, s) at the starts of its pieces.

    Numbers of a state beyond those given are zero.
    """
    missing = STATE[recording.plant] - states.shape[1]
    states = np.hstack([states, np.zeros((len(states), missing))])
    return Chain(recording, readings_of(recording), edges, states, dict(lost or {}))


def linearise(
    current: Chain,
    values: Values,
    columns: Sequence[Column],
    jumps: BoolArray,
    *,
    central: bool = True,
) -> Linear:
    """Linearise the readings of a chain about its states and values.

    ``columns`` are parameters with the step of their differences; ``jumps`` (d,) tells in which directions pieces may
    jump. Columns are differences of the piece's own motion, chained over the pieces; one-sided ones, where ``central``
    is false, cost half.
    """
    recording, d, k = current.recording, current.tangent, current.states.shape[0]
    plant = recording.plant
    runner = _runner(recording, values, columns)
    steps = STEPS[plant]

    samples = [_Sampled(current, readings, values) for readings in current.readings]
    # the instants of all sensors, each with its neighbours in time for slopes and its past for a lag
    motion_columns = [j for j, column in enumerate(columns) if _moves(column)]
    sensor_columns = [j for j in range(len(columns)) if j not in motion_columns]
    piece_of = [np.clip(np.searchsorted(current.edges, s.instants, side="right") - 1, 0, k - 1) for s in samples]

    p = len(columns)
    # states of the pieces as functions of [first state | jumps | parameters]
    allowed, forbidden = np.flatnonzero(jumps), np.flatnonzero(~jumps)
    u = d + (k - 1) * allowed.size
    S = np.zeros((k, d, u + p))
    S[0, :, :d] = np.eye(d)
    passes = np.zeros((max(k - 1, 0), d, d + p))
    closing = np.zeros((k, d))
    gaps = np.zeros((max(k - 1, 0), d))
    flat = base_flat(recording, values, [column.key for column in columns])
    wobble = np.array([values.get(key, 0.0) for key in WOBBLE])

    out_rows = [np.empty((s.instants.size, ROW)) for s in samples]
    # per sensor: derivative of each ideal reading by the state of its piece and by the parameters within it
    J = [np.zeros((s.instants.size, s.width, d + p)) for s in samples]
    ideal = [np.empty((s.instants.size, s.width)) for s in samples]

    half = d + len(motion_columns)
    widths = np.concatenate([steps, [columns[j].step for j in motion_columns]])
    moving = np.array([*range(d), *(d + j for j in motion_columns)])

    def read_all(pieces: Sequence[tuple[list[IntArray], IntArray, FloatArray]]) -> None:
        """Read the sensors in the rows of pieces: what they show, and its slopes by state and motion."""
        for which, (s, w, y, M) in enumerate(zip(samples, out_rows, ideal, J, strict=True)):
            o = np.concatenate([own[which] for own, _, _ in pieces])
            if o.size == 0:
                continue
            mine = np.concatenate([rows[:, b[which] : b[which + 1]] for _, b, rows in pieces], axis=1)
            t = s.instants[o]
            w[o] = mine[0]
            read = np.empty((mine.shape[0], o.size, s.width))
            for first in range(0, mine.shape[0], _BATCH):
                part = slice(first, first + _BATCH)
                read[part] = predicted(s.sensor, recording, values, t, mine[part])
            for row, j in enumerate(motion_columns):
                group, name, size, _ = columns[j]
                if (group, name) in _ALSO_READ:  # it moves the readings of a given motion, too
                    for place, sign in ((1 + d + row, 1.0), (1 + half + d + row, -1.0))[: 2 if central else 1]:
                        moved_values = {**values, (group, name): _current(values, recording, group, name) + sign * size}
                        read[place] = predicted(s.sensor, recording, moved_values, t, mine[place])
            y[o] = read[0]
            other, span = (read[1 + half :], 2.0 * widths) if central else (read[:1], widths)
            slope = (read[1 : 1 + half] - other) / span[:, None, None]
            M[o[:, None], :, moving] = np.moveaxis(slope, 0, 1)

    waiting: list[tuple[list[IntArray], IntArray, FloatArray]] = []
    for i in range(k):
        start, stop = float(current.edges[i]), float(current.edges[i + 1])
        own = [np.flatnonzero(piece == i) for piece in piece_of]
        instants = [s.instants[o] for s, o in zip(samples, own, strict=True)]
        out = np.concatenate(instants) if instants else np.empty(0)
        bounds = np.cumsum([0, *(o.size for o in own)])
        state = current.states[i]
        last_instant = float(out.max()) if out.size else stop
        times, last = runner.times(start, stop, last_instant, state)
        out = np.maximum(out, start)

        # neighbours: two per direction of the state and per parameter of the motion
        states = [state[None]]
        flats, wobbles = [flat[None]], [wobble[None]]
        for sign in (1.0, -1.0) if central else (1.0,):
            states.append(shifted(plant, state, sign * np.diag(steps)))
            flats.append(np.broadcast_to(flat, (d, flat.size)))
            wobbles.append(np.broadcast_to(wobble, (d, len(WOBBLE))))
            if motion_columns:
                moved = np.repeat(flat[None], len(motion_columns), axis=0)
                moved_wobble = np.repeat(wobble[None], len(motion_columns), axis=0)
                for row, j in enumerate(motion_columns):
                    group, name, size, given = columns[j]
                    if (group, name) in WOBBLE:
                        moved_wobble[row, WOBBLE.index((group, name))] += sign * size
                        continue
                    for shape, number in given:
                        moved[row, _place(group, shape)] = number
                    moved[row, _place(group, name)] += sign * size
                states.append(np.repeat(state[None], len(motion_columns), axis=0))
                flats.append(moved)
                wobbles.append(moved_wobble)
        all_states, all_flats = np.concatenate(states), np.concatenate(flats)
        rows, ends = runner.run(
            np.ascontiguousarray(all_flats), np.concatenate(wobbles), np.ascontiguousarray(all_states), times, last, out
        )
        nominal_end = ends[0]
        end_tangent = difference(plant, ends[1:], np.broadcast_to(nominal_end, ends[1:].shape), d)
        if central:
            Phi_Psi = ((end_tangent[:half] - end_tangent[half:]) / (2.0 * widths[:, None])).T  # (d, half)
        else:
            Phi_Psi = (end_tangent / widths[:, None]).T
        Phi, Psi = Phi_Psi[:, :d], Phi_Psi[:, d:]

        waiting.append((own, bounds, rows))
        if i + 1 == k or sum(rows.shape[1] for *_, rows in waiting) >= _INSTANTS:
            read_all(waiting)
            waiting = []

        if i + 1 < k:
            passes[i, :, :d], passes[i][:, d + np.array(motion_columns, dtype=int)] = Phi, Psi
            S[i + 1] = Phi @ S[i]
            S[i + 1, :, u:] += passes[i, :, d:]
            closing[i + 1] = Phi @ closing[i]
            gap = difference(plant, current.states[i + 1], nominal_end, d)
            gaps[i] = gap
            first = d + i * allowed.size
            S[i + 1, allowed, first + np.arange(allowed.size)] += 1.0
            closing[i + 1, forbidden] -= gap[forbidden]

    # parameters of sensors and clocks, from the motion as it is
    for s, w, M in zip(samples, out_rows, J, strict=True):
        if not sensor_columns:
            break
        rate = None
        for j in sensor_columns:
            group, name, size, given = columns[j]
            if not _concerns(group, s.sensor):
                continue
            here = {**values, **{(group, shape): number for shape, number in given}}
            if group in CLOCKS:
                if rate is None:
                    rate = s.time_slope(runner, flat, wobble, values, current)
                base = _current(values, recording, group, name)
                plus, minus = {**here, (group, name): base + size}, {**here, (group, name): base - size}
                moved = s.delays(plus) - s.delays(minus)
                M[:, :, d + j] = -rate * (moved / (2.0 * size))[:, None]
            elif name == "tau_s" and group in CATALOGUE:
                if rate is None:
                    rate = s.time_slope(runner, flat, wobble, values, current)
                M[:, :, d + j] = -rate * s.lag_slope[:, None]
            else:
                base = _current(values, recording, group, name)
                up = predicted(s.sensor, recording, {**here, (group, name): base + size}, s.instants, w)
                down = predicted(s.sensor, recording, {**here, (group, name): base - size}, s.instants, w)
                M[:, :, d + j] = (up - down) / (2.0 * size)
    return _stack(current, samples, ideal, J, piece_of, S, passes, closing, gaps, allowed, u)


#: how the wobble of a free spin dies (1/s) and turns (rad/s), how that differs along and across the wind, and their
#: slopes in time: unknowns of each recording
WOBBLE = (
    *(("free_spin", f"{name}_{unit}") for name in ("decay", "turn", "along", "across") for unit in ("1_s", "1_s2")),
    ("free_spin", "decay_1_s3"),
    ("free_spin", "turn_1_s3"),
)
#: parameters of the motion that also enter what a sensor reads of a given motion
_ALSO_READ = {
    ("body.mass_imbalance", "ex_m"),
    ("body.mass_imbalance", "ey_m"),
    ("environment", "gravity"),
}


def _current(values: Values, recording: Recording, group: str, name: str) -> float:
    """Return the value a parameter has now: given, or as the recording states it, or the baseline."""
    if (group, name) in values:
        return values[group, name]
    if row_of(group) is not None:
        return value(values, group, name)
    if group == "environment" and name.startswith("magnetic_"):
        return float(recording.environment.magnetic_field[["north", "east", "down"].index(name.split("_")[1])])
    if (group, name) in WOBBLE:
        return 0.0
    return float(parameters(recording.environment, recording.disc, recording.rig)[parameter_index(group, name)])


def _moves(column: Column) -> bool:
    """Tell whether a column is of the motion; the field of the earth is only read."""
    if column.group == "environment":
        return column.key in _FLAT_ENVIRONMENT
    return is_motion(column.group) or column.key in WOBBLE


def _concerns(group: str, sensor: str) -> bool:
    """Tell whether an effect that is not of the motion can touch a sensor."""
    if group == "clock.rate":
        return True
    if group == "environment":
        return sensor == "magnetometer"
    row = row_of(group)
    return row is not None and row.acts_with((sensor,))


class _Sampled:
    """The instants at which one sensor's readings show the motion."""

    def __init__(self, current: Chain, readings: Readings, values: Values) -> None:
        self.readings, self.sensor = readings, readings.sensor
        self.width = readings.value.shape[1]
        self.rate_hz = current.recording.sheets[readings.sensor].rate_hz
        self.lost = current.lost.get(readings.sensor)
        self.tau = 0.0
        self.written = readings.t if readings.taken is None else readings.taken.ravel()
        self.weights = readings.weights
        written = self.written
        taken = written - self.delays(values)
        prefix = {"magnetometer": "mag", "accelerometer": "accel", "gyroscope": "gyro"}.get(self.sensor, "")
        self.tau = value(values, f"{prefix}.lag", "tau_s") if prefix and self.weights is None else 0.0
        self.nodes = 1
        if self.tau > 0:
            self.weights = np.repeat(_LAG_WEIGHTS[:, None], written.size, axis=1)
            # every reading is a weighted mean over its past
            past = taken[None, :] - self.tau * _LAG_NODES[:, None]
            self.instants = past.ravel()
            self.lag_slope = np.repeat(_LAG_NODES, written.size)
        else:
            self.instants = taken
            self.lag_slope = np.ones(written.size)
        self.nodes = 1 if self.weights is None else self.weights.shape[0]

    def delays(self, values: Values) -> FloatArray:
        """Return how much earlier than written the readings (nodes n,) show the motion."""
        late = delay(values, self.sensor, self.written)
        if self.lost is not None and self.lost.size == late.size:
            late = late - self.lost / self.rate_hz
        if self.tau > 0:
            late = np.tile(late, _LAG_NODES.size)
        return late

    def time_slope(
        self, runner: _Runner, flat: FloatArray, wobble: FloatArray, values: Values, current: Chain
    ) -> FloatArray:
        """Return the slopes (m, width) of the ideal readings in time."""
        slope = np.empty((self.instants.size, self.width))
        edges = current.edges
        piece = np.clip(np.searchsorted(edges, self.instants, side="right") - 1, 0, current.states.shape[0] - 1)
        for i in range(current.states.shape[0]):
            o = np.flatnonzero(piece == i)
            if o.size == 0:
                continue
            t = np.maximum(self.instants[o], edges[i])
            early = np.maximum(t - _TIME_STEP, edges[i])
            late = early + 2.0 * _TIME_STEP
            both = np.concatenate([late, early])
            times, last = runner.times(float(edges[i]), float(edges[i + 1]), float(both.max()), current.states[i])
            rows, _ = runner.run(flat[None], wobble[None], current.states[i : i + 1], times, last, both)
            read = predicted(self.sensor, current.recording, values, both, rows[0])
            slope[o] = (read[: o.size] - read[o.size :]) / (2.0 * _TIME_STEP)
        return slope

    def weighted(self, array: FloatArray) -> FloatArray:
        """Return what the sensor shows of ideal readings (nodes n, ...): itself, or the weighted past."""
        if self.weights is None:
            return array
        parts = array.reshape(self.nodes, -1, *array.shape[1:])
        return np.asarray(np.einsum("wn,wn...->n...", self.weights, parts))


def group_of(sensor: str, axis: int) -> str:
    """Return the name under which an axis shares its noise with others."""
    if sensor == "gps":
        return "gps.position" if axis < 3 else "gps.velocity"
    return sensor


def _stack(
    current: Chain,
    samples: Sequence[_Sampled],
    ideal: Sequence[FloatArray],
    J: Sequence[FloatArray],
    piece_of: Sequence[IntArray],
    S: FloatArray,
    passes: FloatArray,
    closing: FloatArray,
    gaps: FloatArray,
    allowed: IntArray,
    u: int,
) -> Linear:
    """Put the rows of all sensors together, channel by channel, without those that take no part."""
    raw, own, pieces, whole, t, sd, shifts = [], [], [], [], [], [], []
    channels: list[Channel] = []
    at = 0
    d = current.tangent
    p = S.shape[2] - u
    for s, y, M, piece in zip(samples, ideal, J, piece_of, strict=True):
        readings = s.readings
        # what the closing of forbidden jumps adds
        closed = np.einsum("mwd,md->mw", M[:, :, :d], closing[piece])
        spread = s.nodes > 1
        if spread:
            full = np.empty((*M.shape[:2], u + p))
            for i in np.unique(piece):
                full[piece == i] = M[piece == i, :, :d] @ S[i]
            full[:, :, u:] += M[:, :, d:]
            M = full
        prediction, slopes, closed = s.weighted(y), s.weighted(M), s.weighted(closed)
        limit = readings.limit
        for axis in range(s.width):
            good = readings.good[:, axis]
            if s.tau > 0:
                good = good & (readings.t > _FORGOTTEN * s.tau)
            if limit is not None:
                # a clipped reading says only that the motion was beyond the range
                margin = 6.0 * np.nan_to_num(readings.sd[axis])
                inside = readings.clipped[:, axis] & (np.abs(prediction[:, axis]) < limit - margin)
                good = good | (inside & np.isfinite(readings.value[:, axis]))
            index = np.flatnonzero(good)
            if index.size == 0:
                continue
            raw.append(readings.value[index, axis] - prediction[index, axis])
            if spread:
                whole.append(slopes[index, axis])
                own.append(np.zeros((index.size, d + p)))
                pieces.append(np.full(index.size, -1))
            else:
                own.append(slopes[index, axis])
                pieces.append(piece[index])
            shifts.append(closed[index, axis])
            t.append(readings.t[index])
            sd.append(np.full(index.size, readings.sd[axis]))
            rows = slice(at, at + index.size)
            channels.append(Channel(s.sensor, readings.axes[axis], group_of(s.sensor, axis), rows, index))
            at += index.size
    kind, where, jump = np.full(u, -1), np.zeros(u, dtype=np.int64), np.zeros(u)
    for i in range(gaps.shape[0]):
        place = slice(d + i * allowed.size, d + (i + 1) * allowed.size)
        kind[place], where[place], jump[place] = allowed, i + 1, gaps[i, allowed]

    def joined(parts: list[Any]) -> Any:
        return np.concatenate(parts) if parts else np.empty(0)

    rows_of = joined(own) if own else np.empty((0, d + p))
    return Linear(
        joined(raw),
        rows_of,
        joined(pieces).astype(np.int64),
        joined(whole) if whole else np.empty((0, u + p)),
        joined(t),
        joined(sd),
        tuple(channels),
        jump,
        kind,
        where,
        S,
        passes,
        closing,
        gaps,
        joined(shifts),
    )


def shown(current: Chain, values: Values, sensor: str, t: FloatArray) -> FloatArray:
    """Return what a sensor would read (n, k) at true instants t (n,) of a chain's motion, before lag and noise."""
    recording = current.recording
    runner = _runner(recording, values)
    flat, wobble = base_flat(recording, values), np.array([values.get(key, 0.0) for key in WOBBLE])
    rows = np.empty((t.size, ROW))
    piece = np.clip(np.searchsorted(current.edges, t, side="right") - 1, 0, len(current.states) - 1)
    for i in range(len(current.states)):
        mine = np.flatnonzero(piece == i)
        if mine.size:
            out = np.maximum(t[mine], current.edges[i])
            start, stop = float(current.edges[i]), float(current.edges[i + 1])
            times, last = runner.times(start, stop, float(out.max()), current.states[i])
            rows[mine] = runner.run(flat[None], wobble[None], current.states[i : i + 1], times, last, out)[0][0]
    return predicted(sensor, recording, values, t, rows)


def read(current: Chain, values: Values, readings: Readings) -> FloatArray:
    """Return what a sensor would read (n, width) of a chain's motion when `readings` are written, clocks and lag too.

    Noise, rounding and range are left to whoever asks.
    """
    sampled = _Sampled(current, readings, values)
    return sampled.weighted(shown(current, values, readings.sensor, sampled.instants))


def recut(current: Chain, values: Values, edges: FloatArray) -> Chain:
    """Return the chain cut at other edges (k + 1,), its new pieces starting where the old motion was."""
    recording = current.recording
    runner = _runner(recording, values)
    flat, wobble = base_flat(recording, values), np.array([values.get(key, 0.0) for key in WOBBLE])
    states = np.empty((edges.size - 1, current.states.shape[1]))
    piece = np.clip(np.searchsorted(current.edges, edges[:-1] + 1e-9, side="right") - 1, 0, len(current.states) - 1)
    for j, i in enumerate(piece):
        start, state = float(current.edges[i]), current.states[i]
        stop = float(edges[j])
        if stop - start < 1e-9:
            states[j] = state
            continue
        times, last = runner.times(start, stop, stop, state)
        _, ends = runner.run(flat[None], wobble[None], state[None], times, last, np.empty(0))
        states[j] = ends[0]
    return replace(current, edges=edges, states=states)


def moved(current: Chain, linear: Linear, local: FloatArray, shared: FloatArray) -> Chain:
    """Return the chain after a step of its unknowns: local (l,) and shared (p,)."""
    return stepped(current, linear.moves @ np.concatenate([local, shared]) + linear.closing)


def stepped(current: Chain, tangents: FloatArray) -> Chain:
    """Return the chain with its states moved by tangents (k, d)."""
    states = shifted(current.recording.plant, current.states, tangents)
    if current.recording.plant == "rate_table":
        # the angle turned so far goes along with the yaw
        states[:, 1] = states[:, 0] - states[0, 0]
    return replace(current, states=states)


def undone(moves: FloatArray, change: FloatArray) -> FloatArray:
    """Return the change (d, c) of a first state that amounts to a change (d, c) of a later one, moved there by (d, d).

    What motion has damped beyond double precision cannot be undone; of that the least is taken.
    """
    return np.asarray(np.linalg.lstsq(moves, change, rcond=1e-13)[0])
