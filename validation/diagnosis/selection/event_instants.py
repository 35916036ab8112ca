"""The instant of a kick that a fit found: tried half a turn and a turn apart, where more than noise is left.

What a kick leaves in sensors on board goes round with the body, and is nearly the same along a line half a turn later:
a fit stays at the best instant of the half turn that it began in.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.effects.catalogue import catalogued
from discsim.effects.events import Impulse
from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.selection.search_state import Search, far, values_of_fit
from discsim.validation.identification.gauss_newton import Bars, merit_of
from discsim.validation.identification.residual_tests import unmodelled_residuals

__all__ = ["with_best_instant"]

_KICK = catalogued(Impulse).id
#: turns of the body by which the instant is moved
_TURNS = (-1.0, -0.5, 0.5, 1.0)


def with_best_instant(found: Search, current: ContinuousFit) -> ContinuousFit:
    """Return a fit whose last effect is a kick at the instant, among those half a turn apart, that explains most."""
    candidate = current.hypothesis.candidates[-1]
    spin = found.relaxed_fit.plant.layout.spin
    if candidate.id != _KICK or candidate.recordings is None or spin is None or far(found, current):
        return current
    if not unmodelled_residuals(current.fit.linears, current.residuals, current.fit.noise):
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
        best = min(best, replace(fitted, score=fitted.score + found.cost), key=lambda one: one.score)
    return best
