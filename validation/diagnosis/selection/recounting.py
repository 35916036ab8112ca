"""Counts of lost samples and the motion better one another: a fit whose accelerometer lost some, counted once more.

Takes a search and its fit; gives both with the counts that the motion tells since an effect was added.
"""

from __future__ import annotations

from dataclasses import replace

from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import DroppedSamples
from discsim.validation.diagnosis.detectors.dropped_samples import recounted
from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.selection.hypothesis import Hypothesis
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit

__all__ = ["with_losses_recounted"]

_LOST = catalogued(DroppedSamples, "accelerometer").id
#: most rounds in which counts of lost samples and the motion better one another
_RECOUNTS = 6


def with_losses_recounted(found: Search, current: ContinuousFit) -> tuple[Search, ContinuousFit]:
    """Return a search and its fit with an accelerometer's losses counted anew by the motion that it tells."""
    if all(candidate.id != _LOST for candidate in current.hypothesis.candidates):
        return found, current
    for _ in range(_RECOUNTS):
        again = recounted(current.fit)
        if again is None:
            break
        shifted, dearer = again
        candidates = current.hypothesis.candidates
        hypothesis = Hypothesis(tuple(shifted.screened.candidate if c.id == _LOST else c for c in candidates))
        start = replace(current.fit, trajectories=shifted.trajectories)
        fitted = continuous_fit(start, hypothesis, found.own, current.fit.noise, values_of_fit(current))
        fitted = replace(fitted, score=fitted.score + found.cost + dearer)
        if not fitted.score < current.score:
            break
        trajectories = tuple(
            replace(one, lost={**one.lost, **other.lost})
            for one, other in zip(found.relaxed_fit.trajectories, shifted.trajectories, strict=True)
        )
        relaxed_fit = replace(found.relaxed_fit, trajectories=trajectories)
        found, current = replace(found, relaxed_fit=relaxed_fit, cost=found.cost + dearer), fitted
    return found, current
