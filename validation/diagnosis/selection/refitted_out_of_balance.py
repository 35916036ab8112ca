"""Measured discs out of balance: what was found, fitted once more with moments fixed in the body where these serve."""

from __future__ import annotations

from dataclasses import replace

from discsim.validation.diagnosis.relaxed_fit.out_of_balance import unbalanced
from discsim.validation.diagnosis.relaxed_fit.sensor_residuals import left_across
from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.selection.exchange import eliminated_backward
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.diagnosis.settings import RELAXED_FIT

__all__ = ["refitted_out_of_balance"]


def refitted_out_of_balance(found: Search) -> Search:
    """Return a search of free spins whose rows were counted, its effects refitted as of bodies out of balance.

    It is returned as it is where that brings x and y of the gyroscope not much nearer. Here all errors of the sensors
    were fitted at once, also those that make its rates lean. Instants are known to well below a millisecond. So what is
    left of its x and y is what turns the body.
    """
    fit = found.final.fit
    if fit.plant.unbalanced is None or not found.final.hypothesis.candidates:
        return found
    start = replace(fit, trajectories=unbalanced(fit))
    final = found.with_cost(
        continuous_fit(start, found.final.hypothesis, found.own, fit.noise, values_of_fit(found.final))
    )
    nearer = left_across(replace(final.fit, noise=fit.noise)) < RELAXED_FIT.unbalanced * left_across(fit)
    return replace(found, final=_without_what_stood_for_it(found, final)) if nearer else found


def _without_what_stood_for_it(found: Search, final: ContinuousFit) -> ContinuousFit:
    """Return a fit of bodies out of balance less the effects on the motion that are not worth their price any more.

    Before the body's own moments were free, an asymmetry of its inertia stood for some of what they do.
    """
    of_sensors = [candidate for candidate in final.hypothesis.candidates if candidate.row.acts_on != "motion"]
    return eliminated_backward(found, final, kept=of_sensors)
