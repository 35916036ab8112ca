"""A slow clock has lost samples as its twin where no motion tells the two apart, and only there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from support import made
from support.made import FIELD, RIG, coasts, throws

from discsim.effects import Effect, effect
from discsim.recording import Recording
from discsim.rig import spin_down
from discsim.sensors import Instruments, record
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, free_candidate
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit, standard_errors
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.detectors.even_losses import beside_losses, lost_as_well, rather_lost
from discsim.validation.diagnosis.detectors.walk_of_losses import evidence_of_walk
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import values_of_fit
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import GroupNoise
from discsim.validation.identification.parameters import Parameter


def clocked(recordings: Sequence[Recording], ratio: float, id: str = "accel.clock_rate") -> Fit:
    """Return a fit of recordings with a sensor's clock."""
    trajectories = tuple(first_trajectory(one) for one in recordings)
    clock = Parameter(id, "ratio", 1.0, 1e-6, 0.03)
    noise = {"accelerometer": GroupNoise(0.1), "magnetometer": GroupNoise(0.6), "gyroscope": GroupNoise(0.005)}
    defects = trajectories[0].plant.sizes.continuous
    return Fit(trajectories, (clock,), np.array([ratio]), defects, noise, covariance=np.array([[4e-8]]))


def coasting() -> list[Recording]:
    module = Instruments.from_parts("mpu9250")
    motion = spin_down(RIG, FIELD, 30.0, 6.0, yaw=0.3)
    return [record(motion, module, np.random.default_rng(1), plant="spin_down", name="run", rig=RIG)]


def fitted_by_a_clock(errors: Iterable[Sequence[Effect]]) -> tuple[ContinuousFit, CandidateEffect]:
    """Return the fit of runs of a coasting rig, each with errors of its own, by one clock of the accelerometer."""
    runs = []
    for k, some in enumerate(errors):
        motion = spin_down(RIG, FIELD, 60.0 - 10.0 * k, 10.0, yaw=0.5 + k)
        runs.append(made.coasting(motion, RIG, k, some))
    found = screened(SearchProblem(runs))
    clock = next(c for c in found.candidates if c.id == "accel.clock_rate" and c.recordings is None)
    own, values = found.own, values_of_fit(found.base)
    return continuous_fit(found.base.fit, Hypothesis((clock,)), own, found.base.fit.noise, values), clock


def test_on_a_rig_that_coasts_a_slow_clock_may_have_lost_samples():
    """Three of some 140 blind cases: a logger that lost 0.4 to 0.6 % of an accelerometer's samples had a slow clock."""
    found = lost_as_well(clocked(coasting(), 0.996), free_candidate("accel.clock_rate"))
    assert found is not None
    assert found[0] == "accel.dropped_samples"
    assert found[1] == pytest.approx(0.004)
    # a clock's own error is 2e-4; the walk of 1200 samples ends about this far from the line that the clock draws
    end = np.sqrt(0.004 * 0.996 / 1200)
    assert 0.4 * end < found[2] < 1.1 * end


def test_of_a_fit_without_a_covariance_the_share_has_no_error():
    fit = replace(clocked(coasting(), 0.996), covariance=np.empty((0, 0)))
    assert lost_as_well(fit, free_candidate("accel.clock_rate")) == (
        "accel.dropped_samples",
        pytest.approx(0.004),
        None,
    )


def test_a_fast_clock_has_lost_nothing():
    assert lost_as_well(clocked(coasting(), 1.004), free_candidate("accel.clock_rate")) is None


def test_where_a_reading_turns_with_the_spin_each_loss_shows():
    assert lost_as_well(clocked(throws(seconds=1.0), 0.996), free_candidate("accel.clock_rate")) is None
    field = free_candidate("mag.clock_rate")
    assert lost_as_well(clocked(coasting(), 0.996, "mag.clock_rate"), field) is None


def test_of_what_is_no_clock_or_has_no_such_losses_nothing_is_said():
    assert lost_as_well(clocked(coasting(), 0.996, "gyro.clock_rate"), free_candidate("gyro.clock_rate")) is None
    assert lost_as_well(clocked(coasting(), 0.996), free_candidate("accel.bias")) is None


def test_a_clock_that_no_part_has_is_told_as_lost_samples():
    """Four of 330 blind cases: 2 to 4 % lost were a clock slow by as much; output rates are stated within 1 %."""
    clock = free_candidate("accel.clock_rate")
    found = rather_lost(clocked(coasting(), 0.98), clock)
    assert found is not None
    assert found[0] == "accel.dropped_samples"
    assert rather_lost(clocked(coasting(), 0.996), clock) is None
    assert rather_lost(clocked(coasting(), 0.98), replace(clock, recordings=frozenset([0]))) is None


@pytest.mark.parametrize(
    ("ratios", "lost"),
    [((0.9945,) * 3, False), ((0.9930, 0.9945, 0.9960), True), ((0.9940, 0.9945, 0.9950), True)],
)
def test_a_clock_that_differs_between_recordings_is_told_as_lost_samples(ratios, lost):
    """Two blind cases lost 0.6 %: one run's clock was off by more than its error, and a drift was named for it.

    In a third the runs' clocks were as unlike as one in a thousand sets of one clock has them, and most of losses.
    """
    fitted, clock = fitted_by_a_clock([effect("accel.clock_rate", ratio=ratio)] for ratio in ratios)
    assert (rather_lost(fitted.fit, clock) is not None) is lost
    plain = standard_errors(fitted)
    wider = beside_losses(fitted.fit, [clock], plain)
    assert np.all(wider >= plain)
    assert bool(wider[-1] > 2.0 * plain[-1]) is lost


@pytest.mark.parametrize("ratio", [0.97, 0.985, 0.995])
def test_a_clock_about_which_nothing_walks_is_a_clock_however_slow(ratio):
    """A blind case: a clock 1.3 % slow was told as lost samples, 67 times what tells the two apart."""
    fitted, clock = fitted_by_a_clock([[effect("accel.clock_rate", ratio=ratio)]] * 3)
    assert evidence_of_walk(fitted.fit, clock) < -20.0
    assert rather_lost(fitted.fit, clock) is None


@pytest.mark.parametrize("fraction", [0.005, 0.015, 0.03])
def test_losses_at_random_walk_about_a_clock(fraction):
    fitted, clock = fitted_by_a_clock([[effect("accel.dropped_samples", fraction=fraction)]] * 3)
    assert evidence_of_walk(fitted.fit, clock) > 20.0
    assert lost_as_well(fitted.fit, clock) is not None


@pytest.mark.slow
def test_lost_samples_of_run_downs_are_named_with_their_share_and_the_clock_beside_them():
    runs = coasts(errors=[effect("accel.dropped_samples", fraction=0.03)], rates=(60.0, 40.0, 25.0), seconds=10.0)
    rows = sum(len(run.samples["accelerometer"]) for run in runs)
    sampled = sum(1 + round(10.0 * run.sheets["accelerometer"].rate_hz) for run in runs)
    outcome = diagnose([runs], ["lossy"])
    (named,) = outcome.diagnosis.effects
    assert named.id == "accel.dropped_samples"
    share = named.parameters["fraction"]
    assert share.sd is not None
    assert share.value == pytest.approx(1.0 - rows / sampled, abs=3.0 * share.sd)
    (clock,) = [twin for twin in named.confused_with if twin.id == "accel.clock_rate"]
    assert clock.parameters["ratio"].value == pytest.approx(1.0 - share.value)
    assert [item.effect.id for item in outcome.model.effects] == ["accel.dropped_samples"]
    reasons = {one.id: one.note for one in outcome.candidates}
    assert reasons["accel.clock_rate"] == "named as accel.dropped_samples"
