"""Counts of lost samples and the motion better one another: a fit of which a sensor lost some, counted once more.

Takes a search and its fit; gives both with the counts that the motion tells since an effect was added.
"""

from __future__ import annotations

from dataclasses import replace

from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import ClockRate, DroppedSamples
from discsim.effects.setup import TimeOffset
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.detectors.dropped_samples import (
    Shifted,
    begun_later,
    recounted,
    uncounted,
    with_losses,
    without_losses,
)
from discsim.validation.diagnosis.detectors.even_losses import rather_lost
from discsim.validation.diagnosis.detectors.walk_of_losses import price_of_walk, walked
from discsim.validation.diagnosis.selection.exchange import in_reach
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.identification.gauss_newton import Fit

__all__ = ["with_losses_recounted"]

#: the effect of lost samples of each sensor that is counted by the motion
_LOST = {sensor: catalogued(DroppedSamples, sensor).id for sensor in ("magnetometer", "accelerometer")}
#: most rounds in which counts of lost samples and the motion better one another
_RECOUNTS = 6
#: by how much a score must fall for another round: less is where fits stop
_SETTLED = 0.1
#: fewest losses for which a slow clock may stand
_FEWEST = 4


def with_losses_recounted(found: Search, current: ContinuousFit) -> tuple[Search, ContinuousFit]:
    """Return a search and its fit with the losses of its sensors counted anew by the motion that it tells."""
    for sensor, id in _LOST.items():
        found, current = _walked(found, current, sensor)
        if any(candidate.id == id for candidate in current.hypothesis.candidates):
            found, current = _recounted(found, current, sensor)
            found, current = _begun_later(found, current, sensor)
            found, current = _by_a_slow_clock(found, current, sensor)
    return found, current


def _walked(found: Search, current: ContinuousFit, sensor: str) -> tuple[Search, ContinuousFit]:
    """Return a search and its fit with the walk of losses for which a slow clock of a sensor stands, while it gains.

    What a clock leaves of them would pass for a drift, a shift of a run's times, a place. A walk that gains no longer
    what it costs, beside what was found since, is none.
    """
    clock = next((c for c in current.hypothesis.candidates if (c.row.type, c.row.acts_on) == (ClockRate, sensor)), None)
    if clock is None:
        return found, current
    has = price_of_walk(current.fit, clock, found.relaxed_noise)
    for _ in range(_RECOUNTS if rather_lost(current.fit, clock) is not None else 0):
        again, cost = walked(current.fit, clock, found.relaxed_noise)
        fitted = _with_times_of(found, current, again, cost - has)
        if not fitted.score < current.score - _SETTLED:
            break
        found, current, has = _holding(found, again, sensor, cost - has), fitted, cost
    if has:
        bare = without_losses(current.fit, sensor)
        fitted = _with_times_of(found, current, bare, -has)
        if fitted.score < current.score:
            return _holding(found, bare, sensor, -has), fitted
    return found, current


def _with_times_of(found: Search, current: ContinuousFit, again: Fit, dearer: float) -> ContinuousFit:
    """Return the fit of the same effects with the losses of the trajectories of another, which cost so much more."""
    fitted = continuous_fit(again, current.hypothesis, found.own, current.fit.noise, values_of_fit(current))
    return found.with_cost(fitted, dearer)


def _holding(found: Search, fit: Fit, sensor: str, dearer: float) -> Search:
    """Return a search whose relaxed fit holds the losses of a sensor as a fit has them, none where that has none."""
    relaxed_fit = with_losses(without_losses(found.relaxed_fit, sensor), fit, sensor)
    return replace(found, relaxed_fit=relaxed_fit, cost=found.cost + dearer)


def _recounted(found: Search, current: ContinuousFit, sensor: str) -> tuple[Search, ContinuousFit]:
    """Return a search and its fit with the losses of one sensor counted anew as long as that is better."""
    for _ in range(_RECOUNTS):
        again = recounted(current.fit, sensor)
        if again is None:
            break
        fitted = _fitted(found, current, current.hypothesis, sensor, again)
        if not fitted.score < current.score:
            break
        found, current = _taken(found, sensor, again), fitted
    return found, current


def _begun_later(found: Search, current: ContinuousFit, sensor: str) -> tuple[Search, ContinuousFit]:
    """Return a search and its fit without times of a losing sensor that are early in a recording by whole samples.

    Samples that were lost before the first reading that a recording has make all of its times early by as many.
    """
    for candidate in current.hypothesis.candidates:
        own = tuple(candidate.recordings or range(len(current.fit.trajectories)))
        if (candidate.row.type, candidate.row.acts_on, len(own)) != (TimeOffset, sensor, 1):
            continue
        recording = own[0]
        rate_hz = current.fit.trajectories[recording].recording.sheets[sensor].rate_hz
        offset = values_of_fit(current)[(candidate.id, "offset_s"), candidate.recordings]
        if (count := round(-offset * rate_hz)) < 1:
            continue
        again = begun_later(current.fit, sensor, recording, count)
        fitted = _fitted(found, current, current.hypothesis.without(candidate), sensor, again)
        if fitted.score < current.score + price(candidate):
            return _taken(found, sensor, again), fitted
    return found, current


def _by_a_slow_clock(found: Search, current: ContinuousFit, sensor: str) -> tuple[Search, ContinuousFit]:
    """Return a search and its fit with a slow clock of a sensor in place of losses, where it explains as much.

    From far away no slope leads to a clock by which corners of a motion come a tenth of a second late; counts do.
    Between corners nothing tells where samples were lost, so that losses of a clock's need not look even.
    """
    clock = next((c for c in found.candidates if (c.row.type, c.row.acts_on) == (ClockRate, sensor)), None)
    lost = sum(float(one.lost[sensor][-1]) for one in current.fit.trajectories if sensor in one.lost)
    if clock is None or clock in current.hypothesis.candidates or lost < _FEWEST:
        return found, current
    losses = next(one for one in current.hypothesis.candidates if one.id == _LOST[sensor])
    ((_, fraction, _),) = losses.fixed_values
    without, cheaper = uncounted(current.fit, sensor)
    fitted = continuous_fit(
        without,
        current.hypothesis.without(losses).plus(clock),
        found.own,
        current.fit.noise,
        {**values_of_fit(current), ((clock.id, "ratio"), None): 1.0 - fraction},
        bars=in_reach(current),
    )
    fitted = found.with_cost(fitted, -cheaper)
    if not fitted.score + price(clock) < current.score + price(losses):
        return found, current
    return replace(found, relaxed_fit=without_losses(found.relaxed_fit, sensor), cost=found.cost - cheaper), fitted


def _fitted(
    found: Search, current: ContinuousFit, hypothesis: Hypothesis, sensor: str, again: tuple[Shifted, float]
) -> ContinuousFit:
    """Return the fit of a hypothesis with other losses of a sensor, which are dearer by so much."""
    shifted, dearer = again
    candidates = hypothesis.candidates
    counted = Hypothesis(tuple(shifted.screened.candidate if c.id == _LOST[sensor] else c for c in candidates))
    start = replace(current.fit, trajectories=shifted.trajectories)
    fitted = continuous_fit(start, counted, found.own, current.fit.noise, values_of_fit(current))
    return found.with_cost(fitted, dearer)


def _taken(found: Search, sensor: str, again: tuple[Shifted, float]) -> Search:
    """Return a search whose relaxed fit holds other losses of a sensor."""
    shifted, dearer = again
    return replace(found, relaxed_fit=with_losses(found.relaxed_fit, shifted.fit, sensor), cost=found.cost + dearer)
