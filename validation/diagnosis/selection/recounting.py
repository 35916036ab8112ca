"""Counts of lost samples and the motion better one another: a fit of which a sensor lost some, counted once more.

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

#: the effect of lost samples of each sensor that is counted by the motion
_LOST = {sensor: catalogued(DroppedSamples, sensor).id for sensor in ("magnetometer", "accelerometer")}
#: most rounds in which counts of lost samples and the motion better one another
_RECOUNTS = 6


def with_losses_recounted(found: Search, current: ContinuousFit) -> tuple[Search, ContinuousFit]:
    """Return a search and its fit with the losses of its sensors counted anew by the motion that it tells."""
    for sensor, id in _LOST.items():
        if any(candidate.id == id for candidate in current.hypothesis.candidates):
            found, current = _recounted(found, current, sensor)
    return found, current


def _recounted(found: Search, current: ContinuousFit, sensor: str) -> tuple[Search, ContinuousFit]:
    """Return a search and its fit with the losses of one sensor counted anew as long as that is better."""
    for _ in range(_RECOUNTS):
        again = recounted(current.fit, sensor)
        if again is None:
            break
        shifted, dearer = again
        candidates = current.hypothesis.candidates
        hypothesis = Hypothesis(tuple(shifted.screened.candidate if c.id == _LOST[sensor] else c for c in candidates))
        start = replace(current.fit, trajectories=shifted.trajectories)
        fitted = continuous_fit(start, hypothesis, found.own, current.fit.noise, values_of_fit(current))
        fitted = found.with_cost(fitted, dearer)
        if not fitted.score < current.score:
            break
        trajectories = tuple(
            replace(one, lost={**one.lost, **other.lost})
            for one, other in zip(found.relaxed_fit.trajectories, shifted.trajectories, strict=True)
        )
        relaxed_fit = replace(found.relaxed_fit, trajectories=trajectories)
        found, current = replace(found, relaxed_fit=relaxed_fit, cost=found.cost + dearer), fitted
    return found, current
