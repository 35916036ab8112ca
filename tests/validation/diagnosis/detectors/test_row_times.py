"""Rows that are counted before any fit: believed where another sensor gains, applied, and named as effects."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support import logger_loop as loop

from discsim.effects import effect
from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.imu_clock import FoundImuClock
from discsim.validation.diagnosis.consistency.spin_agreement import agreement_of
from discsim.validation.diagnosis.detectors.row_times import RowTimes, row_times
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import GroupNoise
from discsim.validation.identification.observations import readings_of
from discsim.validation.identification.plants.free_spin import FREE_SPIN

NAMES = tuple(loop.NAMES)
HIDDEN = (
    effect("clock.lost_rows", fraction=0.2),
    effect("mag.own_clock", period_s=0.0094),
    effect("mag.average", weight=0.5),
)


@cache
def logged() -> tuple[Recording, ...]:
    """Return free spins as a logger without time writes them: lost rows, and a magnetometer with its own clock."""
    return tuple(loop.logged(one, 1 + k, own_clock=True, weight=0.5)[0] for k, one in enumerate(loop.motions()))


@cache
def counted() -> RowTimes:
    found = row_times(logged(), NAMES, agreement_of(logged(), NAMES))
    assert found is not None
    return found


def test_what_was_counted_is_named_with_its_sizes():
    named = {one.id: one for one in counted().effects()}
    assert list(named) == [one.id for one in HIDDEN]
    assert named["clock.lost_rows"].parameters["fraction"].value == pytest.approx(0.2, abs=0.06)
    assert named["mag.own_clock"].parameters["period_s"].value == pytest.approx(0.0094, rel=5e-3)
    for one in named.values():
        assert one.evidence.delta_bic > 100.0
        assert one.evidence.heldout_delta_log_likelihood is not None
        assert one.evidence.heldout_delta_log_likelihood > 50.0


def test_the_share_of_lost_rows_is_no_surer_than_so_many_steps_by_chance():
    found = counted()
    told, lost = found.effects()[0].parameters["fraction"], [shown.lost for shown in found.clock.shown]
    steps = [(shown.newest.size - 1) / (1.0 - shown.lost) for shown in found.clock.shown]
    assert told.sd is not None
    assert told.sd >= np.sqrt(told.value * (1.0 - told.value) / sum(steps))
    assert told.sd >= np.std(lost, ddof=1) / np.sqrt(len(lost))
    same = replace(found, clock=replace(found.clock, shown=(found.clock.shown[0],) * 2))
    alike = same.effects()[0].parameters["fraction"].sd
    assert alike == pytest.approx(np.sqrt(lost[0] * (1.0 - lost[0]) / (2.0 * steps[0])))


def test_a_fit_sees_the_field_as_means_of_two_samples_at_their_times():
    for before, after in zip(logged(), counted().applied(logged()), strict=True):
        field = next(one for one in readings_of(after) if one.sensor == "magnetometer")
        assert field.taken is not None
        assert field.weights is not None
        assert field.taken.mean(axis=0) == pytest.approx(field.t)
        assert np.all(np.isin(np.rint((field.taken[0] - field.taken[1]) / 0.0094), (1.0, 2.0)))
        # a fifth of the rows is missing, so that it lasted longer than it is written
        assert after.end / before.end == pytest.approx(1.25, abs=0.1)
        assert {len(own) for own in after.samples.values()} == {len(own) for own in before.samples.values()}


def test_rows_at_the_ends_take_no_part_in_a_fit():
    """Nothing beyond them holds a flexible motion: it follows them wherever they are counted, and a fit was bent."""
    for timed, used in zip(counted().timed(logged()), counted().applied(logged()), strict=True):
        for sensor, own in used.samples.items():
            before, left = timed.samples[sensor].value, np.isfinite(own.value).all(axis=1)
            some = slice(5, -5) if sensor in ("magnetometer", "gyroscope") else slice(None)
            assert np.array_equal(own.value[some], before[some], equal_nan=True)
            assert np.count_nonzero(left) == np.count_nonzero(np.isfinite(before[some]).all(axis=1))
            assert np.array_equal(own.t, timed.samples[sensor].t)


def test_a_fit_may_scale_all_times_and_what_was_counted_follows_it():
    found = counted()
    scale, offset = replace(found, imu=None).free
    assert scale.key == ("clock.rate", "ratio")
    # a chip that is tilted by 0.1 rad shows less of the spin by its cosine
    assert 1.0 - np.cos(0.1) <= scale.sigma < 0.01
    assert offset.key == ("mag.time_offset", "offset_s")
    assert offset.sigma == pytest.approx(0.5 * found.clock.period_s)
    bare = Fit((), (scale,), np.array([1.001]), FREE_SPIN.sizes.continuous, {}, covariance=np.array([[4e-10]]))
    here, refined = ({one.id: one.parameters for one in some.effects()} for some in (found, found.refined(bare)))
    period, better = (some["mag.own_clock"]["period_s"] for some in (here, refined))
    # written times are the true ones times the ratio
    assert better.value == pytest.approx(period.value / 1.001)
    assert better.sd == pytest.approx(2e-5 * period.value)
    assert refined["clock.lost_rows"] == here["clock.lost_rows"]
    assert found.refined(replace(bare, parameters=(), at=np.array([]))) is found


def test_the_fields_clock_beside_a_chips_own_is_free_and_both_periods_follow_it():
    """Whole numbers hold one comb to the other: 0.015 % of that bent a motion by more than all that was concealed."""
    chip = FoundImuClock(0.0091, 1e-6, (), False)
    found = replace(counted(), imu=chip)
    scale, beside, offset, *placed = found.free
    assert (scale.key, beside.key) == (("clock.rate", "ratio"), ("mag.clock_rate", "ratio"))
    assert offset.key == ("mag.time_offset", "offset_s")
    # its samples are placed in each recording for itself, which bent the periods by up to five of their errors
    assert [one.recordings for one in placed] == [{k} for k in range(len(NAMES))]
    assert {(one.key, one.sigma) for one in placed} == {(("gyro.time_offset", "offset_s"), 3e-4)}
    # a quarter of a sample at the end of the shorter of the recordings
    assert beside.sigma == pytest.approx(0.25 / min(shown.newest[-1] for shown in found.clock.shown), rel=0.3)
    covariance = np.array([[4e-10, -3e-10], [-3e-10, 4e-10]])
    at, sizes = np.array([1.001, 0.9995]), FREE_SPIN.sizes.continuous
    fit = Fit((), (scale, beside), at, sizes, {}, covariance=covariance)
    told = found.refined(fit)
    assert told.clock.period_s == pytest.approx(found.clock.period_s / (1.001 * 0.9995))
    # what the two ratios share is told better than each of them
    assert told.clock.sd_s == pytest.approx(found.clock.period_s * np.sqrt(2e-10))
    assert told.imu is not None
    assert told.imu.period_s == pytest.approx(chip.period_s / 1.001)
    assert told.imu.sd_s == pytest.approx(np.hypot(1e-6, chip.period_s * 2e-5))


def test_the_baseline_is_charged_for_the_field_as_it_is_written():
    found = counted()
    loud, still = (found.excess({"magnetometer": GroupNoise(sd)}, 1000) for sd in (0.2, 0.1))
    assert still == pytest.approx(4.0 * loud)
    assert loud > 10.0


@pytest.mark.slow
def test_single_samples_of_a_part_with_its_own_clock_are_named_without_means():
    single = [loop.logged(one, 1 + k, own_clock=True, weight=0.0)[0] for k, one in enumerate(loop.motions())]
    found = row_times(single, NAMES, agreement_of(single, NAMES))
    assert found is not None
    assert [one.id for one in found.effects()] == ["clock.lost_rows", "mag.own_clock"]
    for one in found.effects():
        assert one.evidence.delta_bic > 20.0
    for after in found.applied(single):
        field = next(one for one in readings_of(after) if one.sensor == "magnetometer")
        assert field.taken is not None
        assert field.taken[0] == pytest.approx(field.taken[1])


@pytest.mark.slow
def test_counts_that_no_other_sensor_bears_out_are_not_believed():
    agreement = agreement_of(logged(), NAMES)
    assert row_times(loop.without_wobble(logged(), 1), NAMES, agreement) is None
    assert row_times(logged()[:1], NAMES[:1], agreement) is None
    assert row_times(logged(), NAMES, None) is None


@pytest.mark.slow
def test_rows_are_believed_where_their_tick_came_out_as_a_whole_period():
    agreement = agreement_of(logged(), NAMES)
    assert agreement is not None
    # counted by the wrong tick rows leave more than even ones; by the samples that they show they leave little
    wrong = tuple(replace(one, left=(*one.left[:2], 1.5 * one.left[1], one.left[3])) for one in agreement.row_proofs)
    found = row_times(logged(), NAMES, replace(agreement, row_proofs=wrong))
    assert found is not None
    assert {one.id for one in found.effects()} == {one.id for one in counted().effects()}


@cache
def with_late_rows(weight: float, chip: float | None) -> RowTimes | None:
    """Return what is counted of a logger that loses no row: three in ten come 4 ms late."""
    late = tuple(
        loop.logged(one, 31 + k, own_clock=True, weight=weight, chip=chip, late=(0.004, 0.3))[0]
        for k, one in enumerate(loop.motions())
    )
    return row_times(late, NAMES, agreement_of(late, NAMES))


@pytest.mark.parametrize(
    ("weight", "chip"), [(0.5, None), (0.0, None), pytest.param(0.5, 0.0091, marks=pytest.mark.slow)]
)
def test_rows_that_came_late_are_told_from_rows_that_were_lost(weight, chip):
    found = with_late_rows(weight, chip)
    assert found is not None
    named = {one.id: one for one in found.effects()}
    means, own = ["mag.average"] if weight else [], [] if chip is None else ["imu.own_clock"]
    assert list(named) == ["clock.late_rows", "mag.own_clock", *means, *own]
    late = named["clock.late_rows"].parameters
    # the windows of two free-running parts tell the tick to some tenths of a millisecond, phases better
    assert late["tick_s"].value == pytest.approx(0.004, abs=1.2e-4 if chip is None else 5e-4)
    assert late["fraction"].value == pytest.approx(0.3, abs=0.1)
    assert named["clock.late_rows"].evidence.delta_bic > 24.0
    assert found.located(2.0)[0].text != ""


def test_samples_that_late_rows_show_are_counted_where_one_is_shown_twice():
    found = with_late_rows(0.5, None)
    assert found is not None
    for k, shown in enumerate(found.clock.shown):
        newest = loop.logged(loop.motions()[k], 31 + k, own_clock=True, weight=0.5, late=(0.004, 0.3))[1]
        assert np.any(np.diff(newest) == 0)
        assert shown.lost == 0.0
        assert np.mean(np.diff(shown.newest) == np.diff(newest)) > 0.98
