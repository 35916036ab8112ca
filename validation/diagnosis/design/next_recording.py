"""Experiment design: which next recording would tell a named effect from one that could stand in for it.

Takes what a search found; gives the recording and its expected evidence (T-optimality: Atkinson and Fedorov, "The
design of experiments for discriminating between two rival models", 1975). A recording that could be made is simulated
with the named effect as it was found, its readings compared with what the other hypothesis predicts, and all that this
hypothesis may move is moved: the new recording's own unknowns freely, the common numbers as far as the recordings in
hand let them. The chi-squared that is left, in the noise that was found, is the expected evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE, catalogued
from discsim.effects.rig import AxisTilt
from discsim.recording import SENSORS, Recording, Samples
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, parameters_of
from discsim.validation.diagnosis.candidates.evidence import BOUNDS
from discsim.validation.diagnosis.design.plans import plans_about
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.diagnosis.result import Advice, Separation
from discsim.validation.diagnosis.selection.search_state import Rival, Search
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.gauss_newton import Fit, mapped
from discsim.validation.identification.linearisation import linearise, moved
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.normal_equations import common_step, nuisance_step, reduce
from discsim.validation.identification.parameters import Parameter, Values, values_of
from discsim.validation.identification.plants import Plant
from discsim.validation.identification.plants.plan import Plan
from discsim.validation.identification.prediction import read, shown
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.readings import Readings, group_of
from discsim.validation.identification.segments import Trajectory, resegmented, trajectory_of

__all__ = ["ENOUGH", "advise", "confusions", "expected_evidence", "in_words"]

#: expected evidence that settles a question: noise alters it by twice its root, so the other way round is rare
ENOUGH = 25.0
#: recordings of one kind that a person may be asked for
_MOST = 10
#: a person leans a rig to within this, rad
_LEAN_SIGMA = 0.03
_LEAN = tuple((catalogued(AxisTilt).id, name) for name in AxisTilt._fields)
#: steps of the fit of a hypothesis to a recording that could be made
_STEPS = 3
#: a step that improves less than this share is the last
_SETTLED = 0.01


def _once(id: str) -> bool:
    """Tell whether an effect happened once, and will not happen again in a new recording."""
    return id in CATALOGUE and CATALOGUE[id].event


#: of rows that were counted no recording is simulated; what is asked of them is how chips sit, and what is near them
BY_HAND = "the disc turned slowly by hand about all three axes: what stands still along the axis of a spin moves there."


def in_words(id: str, advice: Advice | None) -> str:
    """Return what to record next to tell an effect from another, as a sentence without its first word's capital."""
    if _once(id):
        return "no further recording can, for it happened once; more sensors or faster ones would show such a thing."
    if advice is None:
        return "none of the recordings that were tried can be simulated."
    best, size = advice.best, advice.best.expected_chi2
    if size >= ENOUGH:
        parts = [f"{best.recording} (expected evidence {_figure(size)}; {ENOUGH:g} settles it)"]
    elif size * _MOST >= ENOUGH:
        count = ceil(ENOUGH / size)
        parts = [f"{count} times {best.recording} (expected evidence {_figure(size)} each; {ENOUGH:g} settles it)"]
    else:
        parts = [
            f"no recording that was tried settles it; best is {best.recording} (expected evidence {_figure(size)})"
        ]
    if advice.runner_up is not None:
        parts.append(f"next best: {advice.runner_up.recording} ({_figure(advice.runner_up.expected_chi2)})")
    if advice.again is not None and advice.again not in (best, advice.runner_up):
        parts.append(f"one as those in hand again: {_figure(advice.again.expected_chi2)}")
    return f"{'; '.join(parts)}."


def _figure(chi2: float) -> str:
    return f"{chi2:,.0f}" if chi2 >= 10.0 else f"{chi2:.1f}"


def confusions(found: Search, candidate: CandidateEffect) -> list[Rival]:
    """Return the effects that recordings in hand cannot tell from a named one."""
    size = len(parameters_of(candidate))
    return [
        rival
        for rival in found.rivals.get(candidate.name, [])
        if rival.worse
        < SELECTION.confused + SELECTION.per_parameter * max(0, len(parameters_of(rival.candidate)) - size)
        and not _become(rival, candidate)
    ]


#: the parameter by which an effect becomes another must be known to this share of how uncertain it was at first
_KNOWN = 0.1


def _become(rival: Rival, candidate: CandidateEffect) -> bool:
    """Tell whether the recordings shape a rival so that it is the effect in whose place it stands."""
    row = rival.candidate.row
    if row.becomes is None or row.becomes[0] != candidate.id:
        return False
    _, name, value = row.becomes
    known, fit = _KNOWN * row.grid_sigma[name], rival.fitted.fit
    place = next(k for k, q in enumerate(fit.parameters) if q.key == (rival.candidate.id, name))
    sd = float(np.sqrt(max(float(fit.covariance[place, place]), 0.0)))
    return 0.0 < sd < known and abs(float(fit.at[place]) - value) < 3.0 * sd


def advise(found: Search, names: Sequence[str], plans: Sequence[Plan] | None = None) -> dict[tuple[str, str], Advice]:
    """Return for each named effect and each that it is confused with what recording would tell them apart.

    ``names`` are those of the recordings; ``plans`` recordings that could be made, by default such as are made easily
    about those in hand. Keys are the names of the two candidates. What happened in one recording only, at one instant,
    has no advice: no new recording holds it. Nor have effects beside rows that were counted.
    """
    advice: dict[tuple[str, str], Advice] = {}
    if found.at_once:
        return advice
    for candidate in found.final.hypothesis.candidates:
        rivals = confusions(found, candidate)
        if not rivals or _once(candidate.id):
            continue
        like = _typical(found, candidate)
        longest = max(one.recording.end for one in found.final.fit.trajectories)
        about = plans_about(found.final.fit.trajectories[like], longest)
        again, offered = about[0], about[1:] if plans is None else list(plans)
        held = "" if candidate.recordings is None else f" (under the conditions of recording {names[like]})"
        for rival in rivals:
            evidence = expected_evidence(found, rival, [again, *offered], like)
            told = [
                Separation(plan.text + held, value)
                for plan, value in zip([again, *offered], evidence, strict=True)
                if np.isfinite(value)
            ]
            if told:
                ranked = sorted(told, key=lambda item: -item.expected_chi2)
                repeated = told[0] if np.isfinite(evidence[0]) else None
                advice[candidate.name, rival.candidate.name] = Advice(
                    ranked[0], ranked[1] if ranked[1:] else None, repeated
                )
    return advice


def _typical(found: Search, candidate: CandidateEffect) -> int:
    """Return the recording in hand that new ones are made like: of those that hold an effect the middle one."""
    trajectories = found.final.fit.trajectories
    some = [i for i in range(len(trajectories)) if candidate.recordings is None or i in candidate.recordings]
    most = max(len(trajectories[i].recording.samples) for i in some)
    some = [i for i in some if len(trajectories[i].recording.samples) == most]
    some.sort(key=lambda i: _pace(trajectories[i]))
    return some[len(some) // 2]


def _pace(one: Trajectory) -> float:
    """Return what recordings are put in order by: a throw's speed, a table's highest rate, else the rate at first."""
    layout = one.plant.layout
    if layout.velocity is not None:
        return float(np.linalg.norm(one.states[0, layout.velocity]))
    if one.recording.command is not None:
        return float(np.max(np.abs(one.recording.command.value)))
    return 0.0 if layout.spin is None else abs(float(one.states[0, layout.spin]))


def expected_evidence(found: Search, rival: Rival, plans: Sequence[Plan], like: int) -> list[float]:
    """Return what each plan is expected to say for the final hypothesis and against a rival one, in chi-squared.

    Plans are recorded with the hardware of recording number ``like`` and hold the effects that it holds. NaN where a
    plan cannot be simulated: a table of coefficients does not reach there, a throw that starts on the ground.
    """
    held = _Held.of(rival.fitted.fit, found.final.fit.noise)

    def one(plan: Plan) -> float:
        own = _own(found, plan, like)
        made = _recorded(found, plan, own, like)
        return np.nan if made is None else held.beyond(made, own, like)

    return mapped(one, plans)


# ----------------------------------------------------------------------------- the recording that could be made


def _values(fit: Fit, own: Sequence[Parameter], like: int) -> dict[tuple[str, str], float]:
    """Return the values that would hold in a new recording with unknowns of its own."""
    parameters = (*fit.parameters, *own)
    at = np.concatenate([fit.at, [q.stated for q in own]])
    shared = [k for k, q in enumerate(fit.parameters) if _holds(q, like, fit.plant)]
    return {**fit.fixed, **_sums(parameters, at, [*shared, *range(len(fit.parameters), len(parameters))])}


def _recorded(found: Search, plan: Plan, own: Sequence[Parameter], like: int) -> Trajectory | None:
    """Return a plan as it would be recorded without noise under the final hypothesis; None where it cannot be made."""
    fit = found.final.fit
    values = _values(fit, own, like)
    old = fit.trajectories[like]
    plant = old.plant
    state = plan.state if plant.design is None else plant.design.as_in_hand(plan.state, old.states)
    bare = replace(old.recording, command=plan.command, release=None, name="planned", path=None, samples={})
    whole = trajectory_of(bare, np.array([0.0, plan.duration]), state[None], old.effects)
    end = _landing(whole, values) if plant.follows_path else plan.duration
    count = max(1, round(end / plant.durations.segment))
    cut = resegmented(whole, values, np.linspace(0.0, end + 1e-6, count + 1))
    samples = {sensor: _samples(cut, values, sensor, old.recording, fit.noise) for sensor in old.recording.samples}
    samples = {sensor: item for sensor, item in samples.items() if len(item)}
    if end == 0.0 or not samples or not np.all(np.isfinite(cut.states)):
        return None
    sheets = dict(bare.sheets)
    if "accelerometer" in sheets:  # readings that stand still for want of noise are no limit
        sheets["accelerometer"] = replace(sheets["accelerometer"], noise_rms=0.0)
    planned = replace(bare, samples=samples, sheets=sheets)
    return trajectory_of(planned, cut.nodes, cut.states, old.effects, unbalanced=old.unbalanced)


def _landing(whole: Trajectory, values: Values) -> float:
    """Return when a throw of one segment reaches the ground, s; its end where it does not, zero if it starts there."""
    t = np.arange(0.0, float(whole.nodes[-1]), 0.02)
    below = np.flatnonzero(shown(whole, values, "track", t)[:, 2] >= 0.0)
    return float(t[below[0]]) if below.size else float(whole.nodes[-1])


def _samples(cut: Trajectory, values: Values, sensor: str, like: Recording, noise: NoiseModel) -> Samples:
    """Return a sensor's readings of a motion without noise: on the axes that a recording in hand has, in its range."""
    sheet, old = like.sheets[sensor], like.samples[sensor]
    t = np.arange(float(old.t[0]) if len(old) else 0.0, float(cut.nodes[-1]), 1.0 / sheet.rate_hz)
    axes = SENSORS[sensor].columns
    blank = np.zeros((t.size, len(axes)))
    readings = Readings(sensor, t, blank, blank == 0.0, blank != 0.0, np.zeros(len(axes)), axes)
    value = read(cut, values, readings)
    if sheet.range is not None:
        value = np.clip(value, -sheet.range, sheet.range)
    seen = np.any(np.isfinite(old.value.reshape(len(old), -1)), axis=0)
    known = [group_of(sensor, axis) in noise for axis in range(len(axes))]
    value = np.where(seen & known, value, np.nan)
    return Samples(t, value if len(axes) > 1 else value[:, 0])


# ------------------------------------------------------------------------------- the rival's best at reading it


@dataclass(frozen=True)
class _Held:
    """What the recordings in hand say under a rival hypothesis: its fit, and their normal matrices, reduced, summed.

    ``chi2`` is the least that they leave; ``noise`` that of the final hypothesis, in which both are judged.
    """

    fit: Fit
    gram: FloatArray
    chi2: float
    noise: NoiseModel

    @classmethod
    def of(cls, rival: Fit, noise: NoiseModel) -> _Held:
        reduced = [
            reduce(linear, one, noise, rival.defects)
            for linear, one in zip(rival.linears, rival.trajectories, strict=True)
        ]
        gram = np.sum([item.gram for item in reduced], axis=0)
        return cls(rival, gram, common_step(gram, rival.parameters, rival.at)[2], noise)

    def beyond(self, made: Trajectory, own: Sequence[Parameter], like: int) -> float:
        """Return by how much the least chi-squared grows with a new recording whose own unknowns are ``own``.

        ``made`` starts where the final hypothesis moves, segment by segment, so that no phase can slip by a turn on the
        way to where the rival's segments are continuous. NaN where predictions leave what is finite.
        """
        fit = self.fit
        parameters = (*fit.parameters, *own)
        shared, p = len(fit.parameters), len(parameters)
        at = np.concatenate([fit.at, [q.stated for q in own]])
        active = [k for k, q in enumerate(parameters) if k >= shared or _holds(q, like, fit.plant)]
        columns = [Column(q.group, q.name, q.step) for q in (parameters[k] for k in active)]
        growth = np.nan
        for _ in range(_STEPS):
            linear = linearise(made, _sums(parameters, at, active), columns, fit.defects.allowed, central=False)
            linear = linear.spread(active, p)
            new = reduce(linear, made, self.noise, fit.defects)
            step, _, expected = common_step(new.gram + self._at(at[:shared], p), parameters, at)
            before, growth = growth, max(float(expected) - self.chi2, 0.0)
            if not np.isfinite(expected) or abs(before - growth) < _SETTLED * (growth + 1.0):
                break
            bounds = np.array([BOUNDS.get(q.key, (-np.inf, np.inf)) for q in parameters])
            step = np.clip(at + step, bounds[:, 0], bounds[:, 1]) - at
            made, at = moved(made, linear, nuisance_step(new, step), step), at + step
        return float(growth) if np.isfinite(expected) else float(before)

    def _at(self, at: FloatArray, width: int) -> FloatArray:
        """Return the normal matrix (width + 1, width + 1) with the shared parameters moved to ``at``."""
        n, off = at.size, at - self.fit.at
        H, e = self.gram[:n, :n], self.gram[:n, -1]
        full = np.zeros((width + 1, width + 1))
        full[:n, :n] = H
        full[:n, -1] = full[-1, :n] = e - H @ off
        full[-1, -1] = self.gram[-1, -1] - 2.0 * off @ e + off @ H @ off
        return full


def _holds(q: Parameter, like: int, plant: Plant) -> bool:
    """Tell whether a parameter of those in hand would act in a new recording like number ``like``."""
    return q.acts_in(like) and not _once(q.group) and q.key not in plant.own_keys


def _sums(parameters: Sequence[Parameter], at: FloatArray, active: Sequence[int]) -> dict[tuple[str, str], float]:
    """Return values of parameters; what two of them say of one number, as of a rig's lean, is added up."""
    values: dict[tuple[str, str], float] = {}
    for k in active:
        values[parameters[k].key] = values.get(parameters[k].key, 0.0) + float(at[k])
    return values


def _own(found: Search, plan: Plan, like: int) -> tuple[Parameter, ...]:
    """Return what a new recording leaves open beside its states: a free spin's wobble, a rig's lean."""
    values = values_of(found.final.fit.parameters, found.final.fit.at, like, {})
    motion = [
        replace(q, stated=values.get(q.key, q.stated), recordings=None) for q in unknowns([found.recordings[like]])
    ]
    lean = [
        Parameter(*key, angle, 2e-4, _LEAN_SIGMA) for key, angle in zip(_LEAN, plan.lean, strict=True) if any(plan.lean)
    ]
    return (*motion, *lean)
