"""Which setup fault makes the sensors agree: hypotheses about columns, ranked by the relations between sensors.

Takes recordings of one hardware; gives hypotheses with what their relations cost (`.relations`), best first. Faults of
one sensor's columns are signed permutations, all of them; a whole board is turned by what its sensors show
(`.rotation`); offsets of time turn a sensor's phase against the field's by rate times offset.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product
from types import MappingProxyType

import numpy as np
from scipy.spatial.transform import Rotation

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Effect, effect_of
from discsim.effects.setup import Axes, BoardRotation, axes_of
from discsim.estimators.fusion import mostly_clipped, slow_field, unfolding
from discsim.recording import Recording
from discsim.validation.diagnosis.settings import RELAXED_FIT
from discsim.validation.diagnosis.setup.rotation import board_turns, spin_axis
from discsim.validation.diagnosis.signals.relations import Columns, misfit, wanted_force
from discsim.validation.diagnosis.signals.spin_signals import SpinSignals, spin_signals
from discsim.validation.identification.ordinary_errors import ordinary_sigma
from discsim.validation.identification.plants import plant_of
from discsim.written import corrected

__all__ = [
    "LATEST",
    "MOST_TWINS",
    "PERMUTATIONS",
    "TWIN",
    "Hypothesis",
    "Ranking",
    "beside_physics",
    "board_effect",
    "chosen",
    "hypotheses",
    "pairs",
]

#: sensors that sit on the board
BOARD = ("magnetometer", "gyroscope", "accelerometer")
#: so many recordings tell as much as all
MOST = 4
#: a hypothesis that costs no more than this above the best cannot be told from it
TWIN = 8.0
#: most of those that are told
MOST_TWINS = 8
#: largest offset of time that is looked for, s, and how far the phase turns between two that are tried, rad
LATEST, PHASE_STEP = 0.15, 0.25
#: lags that are tried as rivals, as phases, rad; clocks are tried as far as a relaxed fit lets one go
LAGS = np.array([0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.2, 3.3, 5.0, 8.0])
#: largest share of samples lost that is tried as a rival: a fifth above the one in twenty that cases conceal at most
MOST_LOST = 0.06
#: a board nearer to a right angle than this (root sum of squares of the matrix) stands at it
SNAP = 0.15
#: what a statement costs that a hypothesis takes back (as readings that clip become gaps in a turned board): half of
#: what one costs that misses by its ordinary size
SILENT = 0.35
#: what is smaller than this is left to the fit, whose steps from the stated numbers reach it: an offset's phase, rad; a
#: field's direction, rad, and size, share; a board's tilt and its turn about the axis (less may be an accelerometer off
#: its stated place), rad
PHASE_LEAST, FIELD_LEAST, SIZE_LEAST, TILT_LEAST, TURN_LEAST = 0.5, 0.05, 0.05, 0.04, 0.4


def _permutations() -> tuple[FloatArray, ...]:
    found = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[list(order), range(3)] = signs
            found.append(matrix)
    return tuple(sorted(found, key=changes))


def changes(matrix: FloatArray) -> float:
    """Return how unlikely a mistake a signed permutation is: one axis reversed 1, two swapped 1.5, more after."""
    moved = int(np.count_nonzero(np.argmax(np.abs(matrix), axis=0) != np.arange(3)))
    reversed_ = int(np.count_nonzero(np.sum(matrix, axis=0) < 0))
    return {0: 0.0, 2: 1.5, 3: 2.5}[moved] + {0: 0.0, 1: 1.0, 2: 1.8, 3: 2.0}[reversed_]


#: all signed permutations of three axes, likely mistakes first
PERMUTATIONS = _permutations()


@dataclass(frozen=True)
class Hypothesis:
    """A supposed fault: ``kind`` (axes, board, offset, field; "" for none), its sensor, columns, and what it costs.

    ``costs`` (k,) are those of all relations by recording, ``weight`` how many independent statements they are,
    ``worst`` the cost per statement of the relation that holds worst, ``size`` how unlikely the mistake is before
    looking.
    """

    kind: str
    sensor: str
    columns: Columns
    costs: FloatArray
    weight: float
    worst: float
    size: float = 0.0

    @property
    def cost(self) -> float:
        """The cost of all recordings."""
        return float(np.sum(self.costs))

    @property
    def charged(self) -> float:
        """The cost with the mistake's own."""
        return self.cost + self.size


def chosen(recordings: Sequence[Recording]) -> list[Recording]:
    """Return the recordings that are looked at: as many as are of use, both directions of spin among them."""

    def direction(recording: Recording) -> float:
        for sensor, column in (("rate_reference", 0), ("gyroscope", 2)):
            if sensor in recording:
                value = recording.samples[sensor].value
                value = value if value.ndim == 1 else value[:, column]
                if np.any(np.isfinite(value)):
                    return float(np.sign(np.nanmedian(value)))
        return 0.0

    if len(recordings) <= MOST:
        return list(recordings)
    by_direction: dict[float, list[Recording]] = {}
    for recording in recordings:
        by_direction.setdefault(direction(recording), []).append(recording)
    some: list[Recording] = []
    while len(some) < MOST:
        for group in by_direction.values():
            if group and len(some) < MOST:
                some.append(group.pop(0))
    return some


@dataclass(frozen=True)
class _Base:
    """Columns that are supposed beforehand, so that the spin axis is z, and the signals there."""

    axes: Mapping[str, FloatArray]
    signals: tuple[SpinSignals, ...]

    def total(self, columns: Columns) -> Columns:
        """Return columns as they act on what is written."""
        axes = {name: columns.of(name) @ self.axes.get(name, np.eye(3)) for name in {*self.axes, *columns.axes}}
        return replace(columns, axes=axes)


def _base(recordings: Sequence[Recording], axes: Mapping[str, FloatArray], fault: Effect | None) -> _Base:
    """Return the signals of recordings corrected by a fault, which is what ``axes`` say."""
    some = recordings if fault is None else [corrected(one, [fault]) for one in recordings]
    found = [spin_signals(one) for one in some]
    return _Base(axes, tuple(one for one in found if one is not None))


@dataclass(frozen=True)
class Ranking:
    """All hypotheses about recordings, best first; ``as_written`` is None where relations cannot even be asked so."""

    as_written: Hypothesis | None
    found: tuple[Hypothesis, ...]
    base: _Base


def hypotheses(recordings: Sequence[Recording], price: float = 0.0) -> Ranking:
    """Return what the relations between sensors cost as written and under every single fault of the setup.

    No hypothesis is tried where the written ones cost less than a ``price``: none could gain that much.
    """
    some = [_without_folded_field(one) for one in chosen(recordings)]
    axis = spin_axis(some, "magnetometer")
    main = 2 if axis is None else int(np.argmax(np.abs(axis)))
    if main == 2:
        base = _base(some, {}, None)
    else:
        upright = _to_z(main)
        base = _base(some, {"magnetometer": upright}, effect_of(Axes(axes_of(upright.T)), "magnetometer"))
    found: list[Hypothesis] = []
    as_written = None
    if base.signals and not base.axes:
        as_written = Hypothesis("", "", Columns(), *misfit(base.signals, Columns()))
        if as_written.cost < price:
            return Ranking(as_written, (), base)
        if any(np.any(np.isfinite(one.rate)) for one in base.signals):
            found += [*_offsets(base), *_field(base), *_rivals(base)]
    if base.signals:
        found += list(_one_sensor(base))
    found += list(_boards(some))
    most = max((item.weight for item in found), default=0.0)
    found = [replace(item, size=item.size + SILENT * (most - item.weight)) for item in found]
    return Ranking(as_written, tuple(sorted(found, key=lambda item: item.charged)), base)


#: permutations of each of two sensors that are tried together: all that leave the spin axis where it is
_OF_EACH = 16


def pairs(base: _Base) -> list[tuple[Hypothesis, Hypothesis, Hypothesis]]:
    """Return hypotheses of two sensors' axes at once, best first: both, and each of them by itself."""
    if not base.signals:
        return []
    each: dict[str, list[Hypothesis]] = {}
    for item in sorted(_one_sensor(base, alone=False), key=lambda item: item.cost):
        own = each.setdefault(item.sensor, [])
        if len(own) < _OF_EACH:
            own.append(item)
    found = []
    for first, second in combinations(each, 2):
        for one, other in product(each[first], each[second]):
            # the signals are those of the base: what it supposes is taken off again
            axes = {
                item.sensor: item.columns.of(item.sensor) @ base.axes.get(item.sensor, np.eye(3)).T
                for item in (one, other)
            }
            both = Hypothesis("axes", "", Columns(axes), *misfit(base.signals, Columns(axes)), one.size + other.size)
            found.append((both, one, other))
    return sorted(found, key=lambda item: item[0].charged)


def _to_z(axis: int) -> FloatArray:
    """Return the rotation (3, 3) by a third of a turn, or none, that takes an axis to z."""
    return np.roll(np.eye(3), (2 - axis) % 3, axis=0)


def _one_sensor(base: _Base, *, alone: bool = True) -> Iterator[Hypothesis]:
    """Return the hypotheses of one sensor's axes; unless ``alone``, also those that need another one beside them."""
    there = [name for name in BOARD if any(name in one.recording for one in base.signals)]
    there += ["gps"] if any("gps" in one.recording for one in base.signals) else []
    for sensor in there:
        if alone and base.axes and sensor not in base.axes:
            continue  # the magnetometer's spin axis is another: without its own columns nothing can be right
        for matrix in PERMUTATIONS:
            if sensor == "magnetometer" and abs(matrix[2, 2]) < 0.5:
                continue
            total = base.total(Columns({sensor: matrix}))
            unlikely = changes(total.of(sensor))
            if unlikely > 0.0:
                costs = misfit(base.signals, Columns({sensor: matrix}))
                yield Hypothesis("axes", sensor, total, *costs, 4.0 + unlikely)


def _shifting(base: _Base) -> list[str]:
    """Return the sensors whose phase is seen: on a rig, where nothing precesses, only that of the field."""
    rig = not plant_of(base.signals[0].recording).airborne
    return [name for name in (BOARD[:1] if rig else BOARD) if any(name in one.recording for one in base.signals)]


def _fastest(base: _Base) -> float:
    """Return the fastest spin that any recording shows, rad/s; where a gyroscope clips all through it shows none."""
    shown = [np.abs(one.rate[np.isfinite(one.rate)]) for one in base.signals]
    return float(np.max(np.concatenate(shown)))


def _offsets(base: _Base) -> Iterator[Hypothesis]:
    """Return the best offset of each sensor's times, where motion tells it from a wrong clock.

    A rig that coasts slows down by a share of its rate each second: late is slow there, and fits weigh the two.
    """
    plant = plant_of(base.signals[0].recording)
    if not (plant.airborne or plant.commanded):
        return
    fastest = _fastest(base)
    step = PHASE_STEP / fastest
    count = int(LATEST / step)
    for sensor in _shifting(base):
        tried = []
        for k in range(-count, count + 1):
            columns = Columns({}, {sensor: k * step})
            tried.append(Hypothesis("offset", sensor, columns, *misfit(base.signals, columns), 6.0))
        best = min(tried, key=lambda item: item.cost)
        if abs(best.columns.offset[sensor]) * fastest > PHASE_LEAST:
            yield best


#: axes, best by themselves, that are tried with physics beside; each takes a second
_BESIDE = 6


def beside_physics(ranking: Ranking) -> list[Hypothesis]:
    """Return hypotheses of one sensor's axes with a lag, a clock or lost samples of some sensor beside, best first.

    A clock that is 2 % off turns a phase by more than a mistaken axis does: neither makes the sensors agree alone.
    """
    base = ranking.base
    if not base.signals or not any(np.any(np.isfinite(one.rate)) for one in base.signals):
        return []
    found = []
    for item in sorted((one for one in ranking.found if one.kind == "axes"), key=lambda one: one.cost)[:_BESIDE]:
        # the signals are those of the base: what it supposes is taken off again
        own = {item.sensor: item.columns.of(item.sensor) @ base.axes.get(item.sensor, np.eye(3)).T}
        for both in _rivals(base, own):
            columns = replace(item.columns, rival=both.columns.rival)
            found.append(replace(both, kind="axes", sensor=item.sensor, columns=columns, size=item.size + both.size))
    return sorted(found, key=lambda one: one.charged)


def _rivals(base: _Base, axes: Mapping[str, FloatArray] = MappingProxyType({})) -> Iterator[Hypothesis]:
    """Return physics that is no fault of the setup, so that what it explains is not taken for one.

    Lags and clocks, and lost samples: a clock of its own in each recording, by which samples were taken ever later.
    Sensors have their columns, or other ``axes``.
    """
    if not plant_of(base.signals[0].recording).airborne:
        return
    fastest = _fastest(base)
    longest = max(float(one.grid[-1]) for one in base.signals)
    step = PHASE_STEP / (fastest * longest)

    def tried(sensor: str, kind: str, sizes: Sequence[float]) -> list[Hypothesis]:
        columns = [Columns(axes, {}, None, {f"{sensor}.{kind}": size}) for size in sizes]
        return [Hypothesis("rival", sensor, each, *misfit(base.signals, each), 6.0) for each in columns]

    least = int(RELAXED_FIT.clock_sigma / step)
    for sensor in _shifting(base):
        yield min(tried(sensor, "lag", (LAGS / fastest).tolist()), key=lambda item: item.cost)
        clocks = tried(sensor, "clock", (step * np.arange(-int(MOST_LOST / step), least + 1)).tolist())
        yield min(clocks[-(2 * least + 1) :], key=lambda item: item.cost)
        yield _losses(sensor, clocks[: len(clocks) - least])


def _losses(sensor: str, clocks: Sequence[Hypothesis]) -> Hypothesis:
    """Return what lost samples leave of clocks of one sensor: the best in each recording, each with a price."""
    best = [clocks[k] for k in np.argmin([item.costs for item in clocks], axis=0)]
    costs = np.array([item.costs[i] for i, item in enumerate(best)])
    size = float(np.median([item.columns.rival[f"{sensor}.clock"] for item in best]))
    columns = replace(best[0].columns, rival={f"{sensor}.losses": size})
    worst = max(item.worst for item in best)
    return Hypothesis("rival", sensor, columns, costs, best[0].weight, worst, len(best) * best[0].size)


#: what f . m leaves on sound throws, times the field's size, m/s^2; how far a field may be from the stated one, as a
#: share of it, and iron along the axis, uT
_LEFT, _APART, _IRON = 0.25, 0.4, ordinary_sigma("setup, rival of a field")


def _field(base: _Base) -> Iterator[Hypothesis]:
    """Return the field for which f . m in the body is (a - g) . B along the path, and its rival: iron along the axis.

    Both are linear in what is looked for.
    """
    B = base.signals[0].recording.environment.magnetic_field
    strength = float(np.linalg.norm(B))
    rows, targets = [], []
    for one in base.signals:
        if one.force is not None and one.path is not None:
            across = np.real(one.force.turning[:, 0] + 1j * one.force.turning[:, 1])
            axial = one.force.mean[:, 2]
            felt = one.across * across + one.along * axial
            A = np.column_stack([wanted_force(one, np.eye(3)), axial])
            good = np.isfinite(felt) & np.all(np.isfinite(A), axis=1)
            rows.append(A[good])
            targets.append(felt[good])
    if not rows or strength == 0.0:
        return
    A, y = np.vstack(rows), np.concatenate(targets)
    left = y - A[:, :3] @ B
    site = B + _linear(A[:, :3], left, _LEFT * strength, _APART * strength)
    apart = np.arccos(np.clip(site @ B / (np.linalg.norm(site) * strength), -1.0, 1.0))
    if apart > FIELD_LEAST or abs(np.log(np.linalg.norm(site) / strength)) > SIZE_LEAST:
        columns = Columns({}, {}, site)
        yield Hypothesis("field", "site", columns, *misfit(base.signals, columns), 9.0)
    iron = _linear(A[:, 3:], left, _LEFT * strength, _IRON)
    columns = Columns({}, {}, None, {"iron": float(iron[0])})
    yield Hypothesis("rival", "magnetometer", columns, *misfit(base.signals, columns), 6.0)


def _linear(A: FloatArray, y: FloatArray, usual: float, sigma: float) -> FloatArray:
    """Return x (k,) of y = A x with robust weights, a scatter that neighbours share, and a prior of zero +- sigma."""
    sd = 2.5 * usual
    x: FloatArray = np.zeros(A.shape[1])
    for _ in range(6):
        weight = 1.0 / (sd**2 * (1.0 + ((y - A @ x) / (3.0 * sd)) ** 2))
        normal = (A * weight[:, None]).T @ A + np.eye(x.size) / sigma**2
        x = np.asarray(np.linalg.solve(normal, (A * weight[:, None]).T @ y))
    return np.asarray(x)


def board_effect(matrix: FloatArray) -> Effect:
    """Return the rotation of the board of a matrix (3, 3) that takes what is written to body axes."""
    return effect_of(BoardRotation(*Rotation.from_matrix(matrix).as_rotvec().tolist()))


def _without_folded_field(recording: Recording) -> Recording:
    """Return a recording without a slow magnetometer that the limit of a gyroscope beside it refutes.

    Such a field turns the other way than the body does, or more slowly, which no axes and no board have to make up for.
    Those of a board would even mix readings at the limit into all others, and leave gaps: the only witness against
    them goes.
    """
    if not slow_field(recording) or not mostly_clipped(recording) or unfolding(recording) == (0, True):
        return recording
    return replace(recording, samples={name: one for name, one in recording.samples.items() if name != "magnetometer"})


def _boards(some: Sequence[Recording]) -> Iterator[Hypothesis]:
    there = [sensor for sensor in BOARD if any(sensor in one for one in some)]
    for turned in board_turns(some):
        right_angle = min(PERMUTATIONS, key=lambda item: float(np.linalg.norm(turned - item)))
        # right angles are what boards are mounted at, and mix no clipped reading into others
        matrix = right_angle if np.linalg.norm(turned - right_angle) < SNAP else turned
        tilt, about = np.arccos(np.clip(matrix[2, 2], -1.0, 1.0)), np.arctan2(matrix[1, 0], matrix[0, 0])
        if tilt < TILT_LEAST and abs(about) < TURN_LEAST:
            continue
        axes = {sensor: matrix for sensor in there}
        base = _base(some, axes, board_effect(matrix))
        if base.signals:
            yield Hypothesis("board", "board", Columns(axes), *misfit(base.signals, Columns()), 9.0)
