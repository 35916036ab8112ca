"""Where a search begins: the fit that follows the data, what every candidate promises about it, the baseline's fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

from discsim.effects import Effect
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import Lag
from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.followed import true_noise
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.relaxed_fit.clocks import clock_of_accelerometer
from discsim.validation.diagnosis.relaxed_fit.outliers import without_outliers
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.diagnosis.selection.candidates import candidates_for
from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.selection.hypothesis import Hypothesis, Start, fitted_parameters
from discsim.validation.diagnosis.selection.score_tests import hinted, pictured_from_above, start_of
from discsim.validation.diagnosis.selection.screening import NormalEquations, normal_equations_of
from discsim.validation.diagnosis.selection.search_state import Search, chi2_in, hopeless, values_of_fit, wobbles
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.competing_effects import CATALOGUED, Competing
from discsim.validation.identification.gauss_newton import NO_BARS, Bars, Fit, merit_of
from discsim.validation.identification.noise import NoiseModel, estimate_noise
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.stated_parameters import stated_parameters

__all__ = ["HELD", "Report", "screened"]

#: told of a search: the stage, steps done, steps in all
Report: TypeAlias = Callable[[str, int, int], None]

#: the lag that holds what was there before a recording began
HELD = catalogued(Lag, "accelerometer").id


def screened(
    recordings: Sequence[Recording],
    report: Report = lambda stage, done, total: None,
    as_stated: Sequence[Recording] | None = None,
    followed: Fit | None = None,
    free: Sequence[Parameter] = (),
    hints: Sequence[Effect] = (),
    effects: Competing = CATALOGUED,
    before: Search | None = None,
) -> Search:
    """Return where the search begins: the relaxed fit with all candidates asked about it, and the baseline's fit.

    ``as_stated`` are the same with nothing that stands in for what they do not state, ``followed`` their relaxed fit
    where it is known already; ``free`` are numbers that every fit may move. ``hints`` are effects of about the right
    size that sensors asked of one another before any fit: algebra from far away finds no clock by whose error phases
    run away. ``effects`` are those that compete. ``before`` is a search of the same recordings in other segments, whose
    baseline stands where this one would be hopeless beside what was found.
    """
    known = (*stated_parameters(recordings), *free)
    own = (*known, *unknowns(recordings))
    report("following the data", 0, 4)
    relaxed_fit, left_out = without_outliers(relaxed(recordings, known) if followed is None else followed)
    relaxed_fit = replace(
        relaxed_fit, trajectories=tuple(replace(trajectory, effects=effects) for trajectory in relaxed_fit.trajectories)
    )
    noise = _noise_of(relaxed_fit)
    given = {q.group for q in free}
    if relaxed_fit.plant.held and HELD not in {hint.id for hint in hints}:
        # of means over turns a lag changes nothing but how what it holds dies away, which was asked before any fit
        given.add(HELD)
    candidates = tuple(candidate for candidate in candidates_for(recordings, effects) if candidate.id not in given)
    report("asking every effect", 1, 4)
    asked_in = relaxed_fit.noise if relaxed_fit.from_release else noise
    equations = normal_equations_of(relaxed_fit, candidates, asked_in, relaxed_fit.continuous_defects)
    report("fitting the baseline", 2, 4)
    bars = NO_BARS if before is None else hopeless(chi2_in(before.final, noise), before.final.fit.count)
    base = _baseline(relaxed_fit, equations, own, noise, bars)
    if before is not None and base.fit.merit > min(bars):
        base = before.base
    told = clock_of_accelerometer(relaxed_fit)
    hints = hints if told is None else (*hints, told)
    asked = tuple(hinted(hint) for hint in hints if any(candidate.id == hint.id for candidate in candidates))
    asked += pictured_from_above(recordings, candidates)
    stated = tuple(as_stated or recordings)
    return Search(
        stated,
        own,
        relaxed_fit,
        noise,
        candidates,
        base,
        base,
        equations,
        equations,
        relaxed_fit,
        outliers=tuple(left_out),
        hints=asked,
    )


def _noise_of(relaxed_fit: Fit) -> NoiseModel:
    """Return the noise of readings: what a fit leaves that follows them, else what they show themselves."""
    if relaxed_fit.from_release:
        return true_noise([readings for trajectory in relaxed_fit.trajectories for readings in trajectory.readings])
    return estimate_noise(relaxed_fit.linears, [linear.residual for linear in relaxed_fit.linears])


def _baseline(
    relaxed_fit: Fit, equations: NormalEquations, own: Sequence[Parameter], noise: NoiseModel, bars: Bars
) -> ContinuousFit:
    """Return the fit without any effect; one that will stay above its ``bars`` is given up."""
    plant = relaxed_fit.plant
    start = {**_start(equations, Hypothesis(), own), **wobbles(relaxed_fit)}
    base = continuous_fit(relaxed_fit, Hypothesis(), own, noise, start, iterations=plant.base_steps, bars=bars)
    if chi2_in(base, noise) < SELECTION.far * base.fit.count and base.fit.iterations >= plant.base_steps:
        # beside the data what the baseline has left to gain would pass for what an effect gains
        again = continuous_fit(
            base.fit,
            Hypothesis(),
            own,
            base.fit.noise,
            values_of_fit(base),
            iterations=plant.base_steps,
            bars=Bars(merit_of(base.fit, base.fit.linears)),
        )
        base = min(base, again, key=lambda one: one.score)
    return base


def _start(equations: NormalEquations, hypothesis: Hypothesis, own: Sequence[Parameter]) -> Start:
    """Return what algebra expects of a hypothesis's parameters."""
    taken = equations.columns_of(fitted_parameters(hypothesis, own))
    return start_of(taken, equations.solve(taken))
