"""How much of a concealed effect the recordings of its case can show, computed without any diagnosis.

The difference that an effect makes to noise-free readings, in standard deviations of the noise, less what the unknowns
of the recordings take in (release states, yaw phases, coefficients within their stated sigma) and less what the other
concealed effect does, is the gain in chi2 that its true model brings on average: Fisher's information times the size
squared. The detection limit is the size at which this gain is `THRESHOLD`. Motions are those of the true disc or rig,
from the standalone model; nothing is fitted.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import pi, sqrt
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import BSpline

from discsim.arrays import BoolArray, FloatArray
from discsim.disc import Disc, Release, Rig
from discsim.effects.catalogue import CATALOGUE, Effect, catalogued, effect
from discsim.effects.sensors import DroppedSamples, Lag
from discsim.effects.timing_rows import LostRows
from discsim.frames import body_to_ned
from discsim.motion import Motion, State
from discsim.rig import spin_down, turn_table
from discsim.sensors import Instruments, Noise, record
from discsim.trajectory import predict
from discsim.validation.challenge.cases.case import Case, Coast, Concealed, Run, Turning
from discsim.validation.challenge.cases.sizes import HIDING, conceivable, hiding_of

__all__ = ["THRESHOLD", "noncentrality", "sizes", "sizes_and_apart", "strength"]

#: gain in chi2 that chance does not bring among fifty hypotheses of one to three parameters: 25 + 2 ln(n) and more
THRESHOLD = 40.0
#: steps of the unknowns of a release: m, m/s, rad, rad/s; small enough to be linear, large beside rounding
_POSITION, _VELOCITY, _ANGLE, _RATE = 1e-3, 1e-4, 1e-5, 1e-4
#: knots of what is unknown but smooth in a free spin, s
_KNOTS_S = 0.2
#: the same where the air settles after a release, s, and for how long it does
_QUICK, _SETTLING = 0.05, 0.4
#: who finds what is counted row by row
_COUNTED = catalogued(LostRows, "clock").detector
#: and sample by sample
_DROPPED = catalogued(DroppedSamples, "accelerometer").detector
#: what moves the centre of mass moves the accelerometer off it
_ON_ACCELEROMETER = ("body.mass_imbalance",)
#: readings by sensor: times (n,), values (n, k)
Readings: TypeAlias = Mapping[str, tuple[FloatArray, FloatArray]]


def strength(case: Case) -> float | None:
    """Return the least concealed effect's size in units of its detection limit; None where none is concealed."""
    return min(sizes(case).values(), default=None)


def sizes(case: Case) -> dict[str, float]:
    """Return each concealed effect's size in units of its detection limit, by id.

    Faults of the setup have none. Nor has, in a case like a real logger's, what is counted row by row: readings are not
    linear in a pattern of rows, and one of these effects shows by what another does to it. It counts as above it.
    """
    return _sizes(case, _Bench(case))


def sizes_and_apart(case: Case) -> tuple[dict[str, float], dict[str, float]]:
    """Return sizes in units of the detection limit, and of the size at which an effect is told from others, by id.

    The others are the effects of the same sensor that have no more numbers, each of any size: readings that one of
    them explains as well are no evidence for the one that is concealed. What is lost sample by sample or cut off
    leaves marks that no other effect leaves.
    """
    bench = _Bench(case)
    seen = _sizes(case, bench)
    told = {}
    for item in _weighed(case):
        others = _others(case, item)
        marked = item.effect.row.hides_readings or item.effect.row.detector == _DROPPED
        rivals = [] if marked else _rivals(case, item.effect)
        beside = [_size(bench.noncentrality(item, [*others, *rival])) for rival in rivals]
        told[item.effect.id] = min([seen[item.effect.id], *beside])
    return seen, told


def _sizes(case: Case, bench: _Bench) -> dict[str, float]:
    return {item.effect.id: _size(bench.noncentrality(item, _others(case, item))) for item in _weighed(case)}


def noncentrality(case: Case, item: Concealed) -> float:
    """Return the mean gain in chi2 of one concealed effect, all unknowns fitted with it and without."""
    return _Bench(case).noncentrality(item)


def _weighed(case: Case) -> list[Concealed]:
    """Return the concealed effects that have a detection limit."""
    real = case.kind == "like_real"
    return [
        item
        for item in case.concealed
        if not (item.effect.row.setup or (real and item.effect.row.detector == _COUNTED))
    ]


def _size(gain: float) -> float:
    return sqrt(max(gain, 0.0) / THRESHOLD)


@dataclass(frozen=True)
class _Free:
    """One number of an effect that is unknown: the effect with it at a small size, that size, and where it acts."""

    effect: Effect
    step: float
    recording: int | None


def _others(case: Case, item: Concealed) -> list[_Free]:
    """Return the numbers of what is concealed beside an effect: who names it does not know them either."""
    beside = [other for other in _weighed(case) if other is not item and not other.effect.row.hides_readings]
    return [free for other in beside for free in _numbers(other.effect, case, other.recording)]


def _rivals(case: Case, item: Effect) -> list[list[_Free]]:
    """Return the numbers of each effect of the same sensor that has no more numbers than an effect."""
    beside = {*_ON_ACCELEROMETER, *(id for id in HIDING if CATALOGUE[id].acts_on == "accelerometer")}
    rivals = []
    for id in conceivable(case.plant, tuple(case.sheets_of.sensors)):
        row, hiding = CATALOGUE[id], HIDING.get(id)
        sensor = row.acts_on in case.sheets_of.sensors and row.acts_on == item.row.acts_on
        if hiding is None or id == item.id or not (sensor or {id, item.id} <= beside):
            continue
        if row.detector or row.hides_readings or len(hiding.sized) > len(hiding_of(item.id).sized):
            continue
        middle = {name: 0.5 * (low + high) for name, (low, high) in hiding.ranges.items()}
        none = {name: hiding.about for name in hiding.sized}
        rivals.append(_numbers(effect(id, **none, **middle), case, None))
    return rivals


def _numbers(item: Effect, case: Case, recording: int | None) -> list[_Free]:
    """Return each number of an effect by itself, at a size where readings are linear in it."""
    if item.row.detector in (_DROPPED, _COUNTED):
        clock, share = _small(item, case)
        return [_Free(clock, share, recording)]
    hiding, values = hiding_of(item.id), item.value._asdict()
    step = 0.1 * hiding.limits(case.plant)[0]
    none = {**values, **{name: hiding.about for name in hiding.sized}}
    return [_Free(effect(item.id, **{**none, name: none[name] + step}), step, recording) for name in hiding.sized]


class _Quiet(NamedTuple):
    """One recording as it is without what is concealed, what its own unknowns take in, and what is uncertain in all."""

    motion: Motion
    sheet: _Sheet
    basis: FloatArray
    shared: list[FloatArray]


def _less(column: FloatArray, basis: FloatArray) -> FloatArray:
    return np.asarray(column - basis @ (basis.T @ column))


class _Bench:
    """The recordings of a case as they are without what is concealed; each is made when it is asked for."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self._quiet: dict[int, _Quiet] = {}
        self._known: dict[tuple[int, Effect, float], FloatArray] = {}

    def quiet(self, number: int) -> _Quiet:
        """Return a recording by its number."""
        if number not in self._quiet:
            run, here = self.case.runs[number], replace(self.case, hands=self.case.hands[number : number + 1])
            motion = _motion(here, run, [], here.disc, here.rig)
            sheet = _Sheet.of(here, _measured(here, motion, []))
            basis = _orthonormal(_unknowns(here, run, sheet))
            shared = [_less(sheet.column(made, step), basis) for made, step in _uncertain(here, run)]
            self._quiet[number] = _Quiet(motion, sheet, basis, shared)
        return self._quiet[number]

    def noncentrality(self, item: Concealed, beside: Sequence[_Free] = ()) -> float:
        """Return the mean gain in chi2 of one concealed effect, all unknowns fitted with it and without.

        The numbers ``beside`` are unknown like the coefficients, and nothing is stated of them.
        """
        small, share = _small(item.effect, self.case)
        known = len(self.quiet(item.recording or 0).shared)
        information, right, gain = np.diag([1.0] * known + [0.0] * len(beside)), np.zeros(known + len(beside)), 0.0
        for number in range(len(self.case.runs)):
            here = item.recording in (None, number)
            if not (here or beside):
                continue
            quiet = self.quiet(number)
            unknown = [*quiet.shared, *(self._column(number, free) for free in beside)]
            columns = np.reshape(unknown, (right.size, len(quiet.basis))).T
            information += columns.T @ columns
            if here:
                signature = self._column(number, _Free(small, share, item.recording))
                gain += float(signature @ signature)
                right += columns.T @ signature if right.size else right
        if not right.size:
            return gain
        scale = np.sqrt(np.where(np.diag(information) > 0.0, np.diag(information), 1.0))
        taken_in = np.linalg.lstsq(information / np.outer(scale, scale), right / scale, rcond=1e-10)[0]
        return gain - float(right / scale @ taken_in)

    def _column(self, number: int, free: _Free) -> FloatArray:
        """Return what a number of an effect changes in one recording, per unit of it, less what is taken in."""
        quiet = self.quiet(number)
        if free.recording not in (None, number):
            return np.zeros(len(quiet.basis))
        known = self._known.get((number, free.effect, free.step))
        if known is None:
            here = quiet.sheet.case
            if free.effect.row.acts_on == "motion":
                made = readings(here, self.case.runs[number], [free.effect])
            else:
                made = _measured(here, quiet.motion, [free.effect])
            column = quiet.sheet.column(made, free.step)
            known = self._known[number, free.effect, free.step] = _less(column, quiet.basis)
        return known


def _orthonormal(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the columns' span; directions that nothing shows are left out."""
    norms = np.linalg.norm(columns, axis=0)
    if not np.any(norms > 0):  # without a magnetometer no yaw shows
        return np.empty((len(columns), 0))
    u, s, _ = np.linalg.svd(columns[:, norms > 0] / norms[norms > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-7 * s[0]])


def _small(item: Effect, case: Case) -> tuple[Effect, float]:
    """Return the effect at a size where readings are linear in it, and the share of its size that this is."""
    hiding = hiding_of(item.id)
    values = item.value._asdict()
    if item.id.endswith(("dropped_samples", "lost_rows")):
        # what the losses do on average: a clock that runs slow by the share that is lost
        clock = item.id.replace("dropped_samples", "clock_rate").replace("lost_rows", "rate")
        return effect(clock, ratio=1.0 - 1e-5), 1e-5 / values["fraction"]
    if item.id == "accel.saturation":
        return item, 1.0  # a clipped reading is not linear in the limit
    if item.id == "accel.lag" and case.hands:
        return item, 1.0  # nor what dies away in its time constant
    size = float(np.linalg.norm([values[name] - hiding.about for name in hiding.sized]))
    share = min(1.0, 0.1 * hiding.limits(case.plant)[0] / size)
    small = {name: hiding.about + share * (values[name] - hiding.about) for name in hiding.sized}
    return effect(item.id, **{**values, **small}), share


# ---------------------------------------------------------------------------------------------- readings


def readings(
    case: Case, run: Run, effects: Sequence[Effect], disc: Disc | None = None, rig: Rig | None = None
) -> Readings:
    """Return the noise-free readings of one run, which any ``hands`` of the case threw first."""
    return _measured(case, _motion(case, run, effects, disc or case.disc, rig or case.rig), effects)


def _motion(case: Case, run: Run, effects: Sequence[Effect], disc: Disc | None, rig: Rig | None) -> Motion:
    if isinstance(run, Turning):
        return turn_table(run.profile, case.environment, effects, yaw=run.yaw, timestep=4e-3)
    if isinstance(run, Coast):
        assert rig is not None
        return spin_down(rig, case.environment, run.rate, run.duration, effects, yaw=run.yaw, timestep=4e-3)
    assert disc is not None
    return predict(disc, case.environment, run, effects, duration=case.longest).motion()


def _measured(case: Case, motion: Motion, effects: Sequence[Effect]) -> Readings:
    quiet: Instruments = case.sheets_of
    if case.hands:
        quiet = quiet.fitted("accelerometer", held=case.hands[0])
    for name, sensor in quiet.sensors.items():
        names = {item.name for item in fields(sensor)}
        still = {item: Noise() for item in ("noise", "position_noise", "velocity_noise") if item in names}
        quiet = quiet.fitted(name, **still, **({"resolution": 0.0} if "resolution" in names else {}))
    if "track" in quiet.sensors:
        quiet = quiet.fitted("track", unseen=0.0)
    rng = np.random.default_rng(0)  # draws nothing: there is no noise
    taken = record(motion, quiet.with_effects(effects), rng, plant=case.plant, name="quiet")
    made = {}
    for name, samples in taken.samples.items():
        value = samples.value if samples.value.ndim == 2 else samples.value[:, None]
        made[name] = (samples.t, value)
    return made


@dataclass(frozen=True)
class _Sheet:
    """The readings of a baseline, which of them count, and their noise."""

    case: Case
    base: Readings
    kept: Mapping[str, BoolArray]

    @classmethod
    def of(cls, case: Case, base: Readings) -> _Sheet:
        kept = {}
        for name, (_, value) in base.items():
            limit = getattr(case.sheets_of.sensors[name], "range", np.inf)
            kept[name] = np.isfinite(value) & (np.abs(value) < 0.999 * limit)
        for item in case.concealed:
            # what it held before the first reading nobody knows; that a simulated one held nothing is no evidence
            if item.effect.row.type is Lag and not case.hands:
                kept[item.effect.row.acts_on][:1] = False
        return cls(case, base, kept)

    def column(self, made: Readings, step: float) -> FloatArray:
        """Return the difference from the baseline per ``step``, in standard deviations, as one vector."""
        parts = []
        for name, (t, value) in self.base.items():
            other_t, other = made[name]
            _, mine, theirs = np.intersect1d(_ticks(t), _ticks(other_t), return_indices=True)
            change = np.zeros(value.shape)
            change[mine] = other[theirs] - value[mine]
            parts.append(self.weighed(name, change) / step)
        return np.concatenate(parts)

    def weighed(self, name: str, change: FloatArray) -> FloatArray:
        """Return changes (n, k) of a sensor's readings in standard deviations, what does not count left out, (m,)."""
        change = np.where(self.kept[name], change, 0.0)
        return np.asarray((self._averaged(name, change) / self._noise(name)).ravel())

    def _noise(self, name: str) -> FloatArray:
        sensor = self.case.sheets_of.sensors[name]
        if name == "gps":
            return np.repeat([sensor.position_noise.white, sensor.velocity_noise.white], 3)  # type: ignore[union-attr]
        rounding = getattr(sensor, "resolution", 0.0) / sqrt(12.0)
        noise = np.hypot(sensor.noise.white, rounding)  # type: ignore[union-attr]
        if self._per_turn(name):
            noise = noise / sqrt(self._block(name))
        return np.atleast_1d(noise)

    def _per_turn(self, name: str) -> bool:
        return self.case.plant == "free_spin" and name == "accelerometer"

    def _block(self, name: str) -> int:
        """Samples per turn."""
        run = self.case.runs[0]
        assert isinstance(run, Release)
        assert run.body_rate is not None
        turn_s = 2 * pi / abs(float(run.body_rate[2]))
        return max(round(self.case.sheets_of.sensors[name].sampling.rate_hz * turn_s), 1)

    def _averaged(self, name: str, change: FloatArray) -> FloatArray:
        """Return what counts of a sensor: of a free spin's accelerometer only the means over turns of x and y."""
        if not self._per_turn(name):
            return change
        block = self._block(name)
        whole = len(change) // block
        return np.asarray(change[: whole * block, :2].reshape(whole, block, 2).mean(axis=1))


def _ticks(t: FloatArray) -> FloatArray:
    return np.round(t * 1e6)


# ---------------------------------------------------------------------------------------------- unknowns


def _unknowns(case: Case, run: Run, sheet: _Sheet) -> FloatArray:
    """Return how readings change with each unknown of one recording, (n, unknowns), in standard deviations."""
    if case.plant == "free_spin":
        assert isinstance(run, Release)
        return _smooth_unknowns(case, run, sheet)
    moved: list[tuple[Run, float]] = []
    if isinstance(run, Turning | Coast):
        moved.append((replace(run, yaw=run.yaw + _ANGLE), _ANGLE))
        if isinstance(run, Coast):
            moved.append((replace(run, rate=run.rate + _RATE), _RATE))
        return np.column_stack([sheet.column(readings(case, other, []), step) for other, step in moved])
    assert run.position is not None
    moved += [(replace(run, position=run.position + _POSITION * axis), _POSITION) for axis in np.eye(3)]
    moved += _moved_releases(run)
    return np.column_stack([sheet.column(readings(case, other, []), step) for other, step in moved])


def _moved_releases(run: Release) -> list[tuple[Release, float]]:
    """Return releases with each of velocity, rates and angles moved, and by how much."""
    assert run.velocity is not None
    assert run.body_rate is not None
    moved = [(replace(run, velocity=run.velocity + _VELOCITY * axis), _VELOCITY) for axis in np.eye(3)]
    moved += [(replace(run, body_rate=run.body_rate + _RATE * axis), _RATE) for axis in np.eye(3)]
    moved.append((replace(run, roll=(run.roll or 0.0) + _ANGLE), _ANGLE))
    moved.append((replace(run, pitch=(run.pitch or 0.0) + _ANGLE), _ANGLE))
    moved.append((replace(run, yaw=(run.yaw or 0.0) + _ANGLE), _ANGLE))
    return moved


def _smooth_unknowns(case: Case, run: Release, sheet: _Sheet) -> FloatArray:
    """Return how readings of a free spin change if its attitude turns by every smooth function of time, or wobbles.

    This is more than unknown air moments and an unknown spin decay can do, so the limit errs on the large side. A
    wobble that dies as this one does may have begun with any phase and size: a low-pass of the gyroscope shifts it so.
    """
    motion = _motion(case, run, [], case.disc, None)
    turned = np.concatenate([_turned(case, motion, name, sheet) for name in sheet.base])
    begun = [sheet.column(readings(case, other, []), step) for other, step in _moved_releases(run)]
    return np.column_stack([turned, *begun])


def _turned(case: Case, motion: Motion, name: str, sheet: _Sheet) -> FloatArray:
    """Return how one sensor's readings change, (n, functions), as the attitude turns by a small angle in N.

    For a turn ``phi`` a vector b of N changes by -C_BN (phi x b) in B and the body rate by C_BN dphi/dt.
    """
    state = motion.at(sheet.base[name][0])
    field_ned = motion.environment.magnetic_field
    columns = []
    for angle, speed, push in _turns(case, motion, state):
        rate = state.in_body(speed)
        if name == "magnetometer":
            change = -state.in_body(np.cross(angle, field_ned))
        elif name == "gyroscope":
            change = rate
        else:
            d = case.sheets_of.sensors[name].position  # type: ignore[union-attr]
            turning = state.in_body(push) - np.cross(state.rate, rate)
            w = state.rate
            change = np.cross(rate, np.cross(w, d)) + np.cross(w, np.cross(rate, d)) + np.cross(turning, d)
        columns.append(sheet.weighed(name, change))
    return np.column_stack(columns)


def _turns(case: Case, motion: Motion, state: State) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Yield small turns in N (n, 3) with two derivatives: cubic splines along each axis, and a wobble that changes."""
    assert case.disc is not None
    t = state.t
    knots = _knots(motion.start, motion.end)
    for k in range(len(knots) - 4):
        bump = BSpline.basis_element(knots[k : k + 5], extrapolate=False)
        shape = [np.nan_to_num(form(t)) for form in (bump, bump.derivative(1), bump.derivative(2))]
        for axis in np.eye(3):
            angle, speed, push = (np.outer(part, axis) for part in shape)
            yield angle, speed, push
    z = body_to_ned(state.attitude)[..., 2]
    first = np.array([1.0, 0.0, 0.0]) - z[:, :1] * z
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    pace = case.disc.Izz / case.disc.Ixx * motion.rate[:, 2]
    phase = np.interp(t, motion.t, cumulative_trapezoid(pace, motion.t, initial=0))
    now = np.interp(t, motion.t, pace)[:, None]
    for growth in (np.ones_like(t), t / motion.end):
        for shift in (0.0, pi / 2):
            way = growth[:, None] * (
                np.cos(phase + shift)[:, None] * first + np.sin(phase + shift)[:, None] * np.cross(z, first)
            )
            yield way, now * np.cross(z, way), -(now**2) * way


def _knots(start: float, end: float) -> FloatArray:
    """Return knots (k,) of cubic splines from start to end, s, with three more at either side.

    Within `_SETTLING` of release the moments of the air change several times as fast as later.
    """
    lasting = end - start
    quick = int(min(_SETTLING, 0.5 * lasting) / _QUICK)
    inner = np.concatenate(
        [_QUICK * np.arange(quick), np.linspace(_QUICK * quick, lasting, max(round(lasting / _KNOTS_S), 2) + 1)]
    )
    before, after = inner[1] - inner[0], inner[-1] - inner[-2]
    beside = np.arange(1, 4)
    return np.asarray(start + np.concatenate([-before * beside[::-1], inner, lasting + after * beside]))


def _rig_sigma(case: Case) -> Mapping[str, float | FloatArray]:
    return case.stated_rig.sigma if case.stated_rig is not None else {}


def _uncertain(case: Case, run: Run) -> list[tuple[Readings, float]]:
    """Return readings with each parameter that has a stated sigma moved, and the step in sigmas."""
    step = 0.01
    made: list[tuple[Readings, float]] = []
    if isinstance(run, Coast) and case.rig is not None and (known := _rig_sigma(case)):
        rig = replace(case.rig, viscous=case.rig.viscous + step * float(known["viscous_N_m_s"]))
        made.append((readings(case, run, [], rig=rig), step))
    disc = case.disc
    if isinstance(run, Release) and disc is not None and case.stated_disc is not None and disc.aero is not None:
        for name, sigma in case.stated_disc.sigma.items():
            value = getattr(disc.aero, name) + step * float(sigma)
            moved = replace(disc, aero=disc.aero._replace(**{name: value}))
            made.append((readings(case, run, [], disc=moved), step))
    return made
