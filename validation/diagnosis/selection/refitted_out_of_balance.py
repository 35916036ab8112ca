"""Measured discs out of balance: what was found, fitted once more with moments fixed in the body where these serve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.relaxed_fit.out_of_balance import unbalanced
from discsim.validation.diagnosis.relaxed_fit.sensor_residuals import left_across
from discsim.validation.diagnosis.selection.all_at_once import worth_of_each
from discsim.validation.diagnosis.selection.exchange import eliminated_backward
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.diagnosis.settings import RELAXED_FIT

__all__ = ["refitted_out_of_balance"]


def refitted_out_of_balance(found: Search) -> Search:
    """Return a search of free spins whose rows were counted, its effects refitted as of bodies out of balance.

    It is returned as it is where that brings x and y of the gyroscope not much nearer. Here all errors of the sensors
    were fitted at once, also those that make its rates lean. Instants are known to well below a millisecond. So what is
    left of its x and y is what turns the body. Before the body's own moments were free, an effect on the motion, as an
    asymmetry of its inertia, may have stood for what they do, and holds a fit beside its optimum: these come last.
    """
    fit, every = found.final.fit, found.final.hypothesis.candidates
    if fit.plant.unbalanced is None or not every:
        return found
    of_sensors = tuple(candidate for candidate in every if candidate.row.acts_on != "motion")
    start, first = replace(fit, trajectories=unbalanced(fit)), Hypothesis(of_sensors or every)
    final = found.with_cost(continuous_fit(start, first, found.own, fit.noise, values_of_fit(found.final)))
    if left_across(replace(final.fit, noise=fit.noise)) >= RELAXED_FIT.unbalanced * left_across(fit):
        return found
    of_motion = [candidate for candidate in every if candidate not in first.candidates]
    # what stood for the bodies' own moments explains nothing beside them
    final = eliminated_backward(found, _with_what_is_worth_it(found, final, of_motion))
    return replace(found, final=final)


def _with_what_is_worth_it(found: Search, final: ContinuousFit, candidates: Sequence[CandidateEffect]) -> ContinuousFit:
    """Return a fit with those of some effects besides that are worth their price, as algebra and then a fit have it."""
    for candidate in candidates:
        fit, more = final.fit, (*final.hypothesis.candidates, candidate)
        if worth_of_each(found.about(fit).equations, more, found.own)[candidate.name] <= price(candidate):
            continue
        fitted = continuous_fit(fit, Hypothesis(more), found.own, fit.noise, values_of_fit(final))
        fitted = found.with_cost(fitted)
        if fitted.gain_upon(final) > price(candidate):
            final = fitted
    return final
