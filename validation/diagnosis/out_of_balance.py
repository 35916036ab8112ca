"""Measured discs out of balance: what was found, fitted once more with moments fixed in the body where these serve."""

from __future__ import annotations

from dataclasses import replace

from discsim.validation.diagnosis.relaxed_fit import left_across, unbalanced
from discsim.validation.diagnosis.selection.continuous_fit import continuous_fit
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.diagnosis.settings import RELAXED_FIT

__all__ = ["out_of_balance"]


def out_of_balance(found: Search) -> Search:
    """Return what was found of free spins whose rows were counted, as of bodies out of balance where a gyroscope asks.

    Errors of its parts are fitted at once there, those that lean its rates among them, and instants are known to well
    below a millisecond: what its x and y still keep is what turns the body.
    """
    fit = found.final.fit
    if fit.plant.unbalanced is None or not found.final.hypothesis.candidates:
        return found
    start = replace(fit, trajectories=unbalanced(fit))
    final = continuous_fit(start, found.final.hypothesis, found.own, fit.noise, values_of_fit(found.final))
    nearer = left_across(replace(final.fit, noise=fit.noise)) < RELAXED_FIT.unbalanced * left_across(fit)
    return replace(found, final=final) if nearer else found
