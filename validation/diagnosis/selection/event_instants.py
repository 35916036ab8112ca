"""The instant of an event that a fit found: tried elsewhere, and its error told by the likelihood of all instants.

A fit stays at the best instant of the dip that it began in. What a kick leaves in sensors on board goes round with the
body, and is nearly the same along a line half a turn later; a step that is small beside the noise has a dip at every
instant at which noise looks like it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.effects.catalogue import catalogued
from discsim.effects.events import Impulse
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.selection.search_state import Search, far, values_of_fit
from discsim.validation.identification.gauss_newton import Bars, merit_of
from discsim.validation.identification.instant_profile import instant_profile, instants_of, with_errors_of_instants

__all__ = ["with_best_instant", "with_instants_weighed"]

_KICK = catalogued(Impulse).id
#: turns of the body by which the instant is moved
_TURNS = (-1.0, -0.5, 0.5, 1.0)
#: what another instant must gain in chi-squared to be gone to, and the steps that end there: as a fit ends
_GAIN, _STEPS = 0.05, 2


def with_best_instant(found: Search, current: ContinuousFit) -> ContinuousFit:
    """Return a fit whose last effect, where that is a brief event, is at the instant that explains most."""
    candidate = current.hypothesis.candidates[-1]
    if not candidate.row.brief or candidate.recordings is None or far(found, current):
        return current
    return _in_the_deepest_dip(found, _at_the_best_turn(found, current))


def _in_the_deepest_dip(found: Search, current: ContinuousFit) -> ContinuousFit:
    """Return a fit whose last effect is an event at the instant at which chi-squared is least, all else following."""
    last, fit = current.hypothesis.candidates[-1], current.fit
    for place in instants_of(fit):
        q = fit.parameters[place]
        profile = instant_profile(fit, place) if (q.group, q.recordings) == (last.id, last.recordings) else None
        if profile is None or np.min(profile.chi2) > -_GAIN:
            continue
        moved = profile.at_least()
        start = values_of_fit(replace(current, fit=moved))
        bars = Bars(merit_of(fit, fit.linears))
        fitted = continuous_fit(
            moved, current.hypothesis, found.own, fit.noise, start, iterations=_STEPS, polish=0, bars=bars
        )
        return min(current, found.with_cost(fitted), key=lambda one: one.score)
    return current


def _at_the_best_turn(found: Search, current: ContinuousFit) -> ContinuousFit:
    """Return a fit whose last effect is a kick at the instant, among those half a turn apart, that explains most.

    Others are tried where more than noise is left.
    """
    candidate = current.hypothesis.candidates[-1]
    spin = found.relaxed_fit.plant.layout.spin
    if candidate.id != _KICK or candidate.recordings is None or spin is None:
        return current
    if not current.unmodelled():
        return current
    (number,) = candidate.recordings
    trajectory = current.fit.trajectories[number]
    start = values_of_fit(current)
    key = ((candidate.id, "t_s"), candidate.recordings)
    rate = abs(float(trajectory.states[trajectory.segment_of(np.array(start[key]))][spin]))
    bars = Bars(merit_of(current.fit, current.fit.linears))
    best = current
    for turns in _TURNS if rate > 0.0 else ():
        instant = start[key] + turns * 2.0 * np.pi / rate
        if not found.relaxed_fit.plant.durations.event_from < instant < trajectory.nodes[-1]:
            continue
        moved = {**start, key: instant}
        fitted = continuous_fit(current.fit, current.hypothesis, found.own, current.fit.noise, moved, bars=bars)
        best = min(best, found.with_cost(fitted), key=lambda one: one.score)
    return best


def with_instants_weighed(found: Search) -> Search:
    """Return a search whose last fit knows the errors of its events' instants by the likelihood of all instants."""
    fit = with_errors_of_instants(found.final.fit)
    if fit is found.final.fit:
        return found
    # where it stands has not changed, nor what is known about it there
    asked = fit if found.asked is found.final.fit else found.asked
    return replace(found, final=replace(found.final, fit=fit), asked=asked)
