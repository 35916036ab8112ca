"""Samples that a sensor lost at random, told as a slow clock and their walk about it where no reading tells each."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import coasts

from discsim.effects import effect
from discsim.effects.catalogue import Effect
from discsim.validation.challenge.blind import Request
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.detectors.dropped_samples import without_losses
from discsim.validation.diagnosis.detectors.walk_of_losses import evidence_of_walk, price_of_walk, walked
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.selection.recounting import with_losses_recounted
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.diagnosis.selection.starting_point import screened

SENSOR, SECONDS, RATE = "accelerometer", 15.0, 200.0


@cache
def clocked(error: Effect) -> tuple[Search, ContinuousFit]:
    """Return where a search of two runs begins, and the fit with a clock of the accelerometer."""
    runs = coasts(errors=[error], rates=(60.0, 40.0), seconds=SECONDS)
    found = screened(SearchProblem(runs))
    clock = next(c for c in found.candidates if c.id == "accel.clock_rate" and c.recordings is None)
    start = {**values_of_fit(found.base), (("accel.clock_rate", "ratio"), None): 0.97}
    fitted = continuous_fit(found.base.fit, Hypothesis((clock,)), found.own, found.base.fit.noise, start)
    return found, fitted


LOST = effect("accel.dropped_samples", fraction=0.03)
SLOW = effect("accel.clock_rate", ratio=0.97)


def test_the_walk_about_a_clock_ends_where_so_many_samples_are_lost():
    """The last row tells how many are missing, which no fit is told."""
    found, fitted = clocked(LOST)
    (clock,) = fitted.hypothesis.candidates
    again, cost = walked(fitted.fit, clock, found.relaxed_noise)
    ratio = again.values(0)["accel.clock_rate", "ratio"]
    for trajectory in again.trajectories:
        rows = len(trajectory.recording.samples[SENSOR])
        missing = 1 + round(SECONDS * RATE) - rows
        told = rows * (1.0 / ratio - 1.0) + trajectory.lost[SENSOR][-1]
        # a clock alone is off by what a walk of 90 losses ends beside it, ten samples and more
        assert told == pytest.approx(missing, abs=3.0)
    assert cost > 0.0
    # what it costs once it is held is what it cost
    assert price_of_walk(again, clock, found.relaxed_noise) == pytest.approx(cost, rel=0.1)
    assert price_of_walk(fitted.fit, clock, found.relaxed_noise) == 0.0
    assert all(SENSOR not in one.lost for one in without_losses(again, SENSOR).trajectories)


def test_a_search_holds_the_walk_where_it_gains_and_leaves_noise_alone():
    found, fitted = clocked(LOST)
    after, better = with_losses_recounted(found, fitted)
    assert better.score < fitted.score - 20.0
    assert not better.unmodelled()
    assert after.cost == pytest.approx(
        price_of_walk(better.fit, better.hypothesis.candidates[0], found.relaxed_noise), rel=0.1
    )
    for one in (*after.relaxed_fit.trajectories, *better.fit.trajectories):
        assert np.ptp(one.lost[SENSOR]) > 1.0
    # once more it is as it is
    again, settled = with_losses_recounted(after, better)
    assert settled.score == pytest.approx(better.score, abs=0.2)
    assert again.cost == pytest.approx(after.cost, abs=1.0)


def test_a_slow_clock_has_no_walk():
    found, fitted = clocked(SLOW)
    after, same = with_losses_recounted(found, fitted)
    assert same is fitted
    assert after.cost == 0.0
    assert all(SENSOR not in one.lost for one in after.relaxed_fit.trajectories)


def test_a_walk_that_gains_nothing_any_more_is_given_up():
    found, fitted = clocked(SLOW)
    (clock,) = fitted.hypothesis.candidates
    held, cost = walked(fitted.fit, clock, found.relaxed_noise)
    worse = continuous_fit(held, fitted.hypothesis, found.own, fitted.fit.noise, values_of_fit(fitted))
    beside = found.with_cost(worse, cost)
    after, better = with_losses_recounted(replace(found, cost=cost), beside)
    assert better.score < beside.score
    assert all(SENSOR not in one.lost for one in better.fit.trajectories)
    assert after.cost == pytest.approx(0.0, abs=0.1 * cost)


@pytest.mark.slow
def test_what_a_clock_leaves_of_losses_is_no_drift_and_no_shift_of_times():
    """A blind case named both beside them, after nine minutes."""
    found = diagnose([recordings(Request(682026).draw())], ["runs"]).diagnosis
    (named,) = found.effects
    assert named.id == "accel.dropped_samples"
    share = named.parameters["fraction"]
    assert share.sd is not None
    assert share.value == pytest.approx(0.02392, abs=3.0 * share.sd)


def test_a_clock_that_is_fast_has_no_walk_whatever_trajectories_hold():
    """Its share of lost samples is negative: a search asks for the price before it asks whether the clock is slow."""
    found, fitted = clocked(LOST)
    (clock,) = fitted.hypothesis.candidates
    held, _ = walked(fitted.fit, clock, found.relaxed_noise)
    at = held.at.copy()
    at[[q.group == clock.id for q in held.parameters].index(True)] = 1.0001
    fast = replace(held, at=at)
    assert price_of_walk(fast, clock, found.relaxed_noise) == 0.0
    assert evidence_of_walk(fast, clock) == 0.0
    assert walked(fast, clock, found.relaxed_noise) == (fast, 0.0)
