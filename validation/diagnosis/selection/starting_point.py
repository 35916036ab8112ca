"""Where a search begins: the fit that follows the data, what every candidate promises about it, the baseline's fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import Lag
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, candidates_for
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, Start, fitted_parameters
from discsim.validation.diagnosis.candidates.score_tests import hinted, pictured_from_above, start_of
from discsim.validation.diagnosis.candidates.screening import NormalEquations, normal_equations_of
from discsim.validation.diagnosis.consistency.followed import true_noise
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.relaxed_fit.astray import from_nearer_motion, from_other_flights
from discsim.validation.diagnosis.relaxed_fit.clocks import clock_of_accelerometer
from discsim.validation.diagnosis.relaxed_fit.outliers import without_outliers
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search, chi2_in, hopeless, values_of_fit, wobbles
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.gauss_newton import NO_BARS, Bars, Fit, merit_of
from discsim.validation.identification.noise import NoiseModel, estimate_noise
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import Plant
from discsim.validation.identification.stated_parameters import stated_parameters

__all__ = ["HELD", "screened"]

#: steps of a fit of flights of which neither a path nor a force tells how fast they were
_WEAKLY_TOLD = 40
#: the lag that holds what was there before a recording began
HELD = catalogued(Lag, "accelerometer").id


def screened(problem: SearchProblem, before: Search | None = None) -> Search:
    """Return where the search begins: the relaxed fit with all candidates asked about it, and the baseline's fit.

    ``before`` is a search of the same recordings in other segments: its baseline takes the place of one that would be
    hopeless beside what it found.
    """
    recordings = problem.recordings
    known = (*stated_parameters(recordings), *problem.free)
    own = (*known, *unknowns(recordings))
    problem.progress("following the data", 0, 4)
    followed = relaxed(recordings, known) if problem.followed is None else problem.followed
    relaxed_fit, left_out = without_outliers(followed)
    trajectories = tuple(replace(trajectory, effects=problem.effects) for trajectory in relaxed_fit.trajectories)
    relaxed_fit = replace(relaxed_fit, trajectories=trajectories)
    noise = _noise_of(relaxed_fit)
    candidates = _competing(problem, relaxed_fit.plant)
    problem.progress("asking every effect", 1, 4)
    asked_in = relaxed_fit.noise if relaxed_fit.path_alone else noise
    equations = normal_equations_of(relaxed_fit, candidates, asked_in, relaxed_fit.continuous_defects)
    problem.progress("fitting the baseline", 2, 4)
    bars = NO_BARS if before is None else hopeless(chi2_in(before.final, noise), before.final.fit.count)
    base = _baseline(relaxed_fit, equations, own, noise, bars)
    if (nearer := from_nearer_motion(relaxed_fit, base.fit)) is not None:
        return screened(replace(problem, followed=nearer), before)
    if before is not None and base.fit.merit > min(bars):
        base = before.base
    told = clock_of_accelerometer(relaxed_fit)
    hints = problem.hints if told is None else (*problem.hints, told)
    asked = tuple(hinted(hint) for hint in hints if any(candidate.id == hint.id for candidate in candidates))
    asked += pictured_from_above(recordings, candidates)
    return Search(
        recordings=tuple(problem.as_stated or recordings),
        own=own,
        relaxed_fit=relaxed_fit,
        relaxed_noise=noise,
        candidates=candidates,
        base=base,
        final=base,
        relaxed_equations=equations,
        equations=equations,
        asked=relaxed_fit,
        outliers=tuple(left_out),
        hints=asked,
    )


def _competing(problem: SearchProblem, plant: Plant) -> tuple[CandidateEffect, ...]:
    """Return the effects that compete: none of which a number is free in every fit."""
    left_out = {q.group for q in problem.free}
    if plant.held and HELD not in {hint.id for hint in problem.hints}:
        # of means over turns a lag changes nothing but how what it holds dies away, which was asked before any fit
        left_out.add(HELD)
    return tuple(one for one in candidates_for(problem.recordings, problem.effects) if one.id not in left_out)


def _noise_of(relaxed_fit: Fit) -> NoiseModel:
    """Return the noise of readings: what the relaxed fit leaves of them.

    A flight seen from outside alone is not followed so closely: there the readings themselves show their noise.
    """
    if relaxed_fit.path_alone:
        return true_noise([readings for trajectory in relaxed_fit.trajectories for readings in trajectory.readings])
    return estimate_noise(relaxed_fit.linears, [linear.residual for linear in relaxed_fit.linears])


def _baseline(
    relaxed_fit: Fit, equations: NormalEquations, own: Sequence[Parameter], noise: NoiseModel, bars: Bars
) -> ContinuousFit:
    """Return the fit without any effect; one that will stay above its ``bars`` is given up."""
    plant = relaxed_fit.plant
    start = {**_start(equations, Hypothesis(), own), **wobbles(relaxed_fit)}
    base = continuous_fit(relaxed_fit, Hypothesis(), own, noise, start, iterations=plant.base_steps, bars=bars)
    base = _of_other_flights(base, own, noise)
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


def _of_other_flights(base: ContinuousFit, own: Sequence[Parameter], noise: NoiseModel) -> ContinuousFit:
    """Return a baseline's fit whose recordings begin from other flights where these leave less; as it is without any.

    What neither a path nor a force tells is weakly told: such a fit takes many steps.
    """
    begun = replace(base.fit, noise=noise, merit=merit_of(replace(base.fit, noise=noise), base.fit.linears))
    elsewhere = from_other_flights(begun)
    if elsewhere is begun:
        return base
    other = continuous_fit(elsewhere, Hypothesis(), own, noise, values_of_fit(base), iterations=_WEAKLY_TOLD)
    return min(base, other, key=lambda one: one.score)


def _start(equations: NormalEquations, hypothesis: Hypothesis, own: Sequence[Parameter]) -> Start:
    """Return what algebra expects of a hypothesis's parameters."""
    taken = equations.columns_of(fitted_parameters(hypothesis, own))
    return start_of(taken, equations.solve(taken))
