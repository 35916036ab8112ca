"""A chip of gyroscope and accelerometer that free-runs beside its logger: its clock, and what asks for none."""

from __future__ import annotations

import numpy as np
import pytest
from support import logger_loop as loop

from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.imu_clock import imu_clock_of
from discsim.validation.diagnosis.consistency.own_clock import FoundOwnClock, own_clock_of
from discsim.validation.diagnosis.consistency.time_stamp_recovery import rows_of
from discsim.validation.diagnosis.detectors.row_times import RowTimes

NAMES = loop.NAMES


def counted(seed: int, chip: float | None) -> tuple[list[Recording], FoundOwnClock]:
    made = [
        loop.logged(motion, seed + k, own_clock=True, weight=0.5, chip=chip)[0]
        for k, motion in enumerate(loop.motions())
    ]
    rows = rows_of(made, NAMES)
    assert rows is not None
    clock = own_clock_of(made, NAMES, rows)
    assert clock is not None
    return made, clock


@pytest.mark.parametrize(
    ("seed", "chip"),
    [(1, 0.0091), pytest.param(11, 0.0096, marks=pytest.mark.slow), pytest.param(21, 0.0104, marks=pytest.mark.slow)],
)
def test_the_wobble_tells_the_period_of_a_chip_that_free_runs(seed, chip):
    made, clock = counted(seed, chip)
    found = imu_clock_of(made, NAMES, clock)
    assert found is not None
    # its clock is the field's own period, and periods count as one within half a per cent
    assert found.period_s == pytest.approx(chip, rel=5e-3)
    assert not found.loops
    for one in found.shown:
        # the gyroscope's own noise is 0.0015 rad/s
        assert one.left[1] < 0.5 * one.left[0]


@pytest.mark.parametrize(
    "seed", [1, pytest.param(11, marks=pytest.mark.slow), pytest.param(21, marks=pytest.mark.slow)]
)
def test_a_chip_that_is_read_in_step_has_no_clock_of_its_own(seed):
    made, clock = counted(seed, None)
    found = imu_clock_of(made, NAMES, clock)
    assert found is None or found.loops
    named = {effect.id for effect in RowTimes(tuple(NAMES), clock, (), found).effects()}
    assert "imu.own_clock" not in named


@pytest.mark.parametrize("seed", [1, pytest.param(11, marks=pytest.mark.slow)])
def test_rows_that_are_read_in_step_stand_behind_the_samples_that_they_show_by_their_true_ages(seed):
    made, clock = counted(seed, None)
    found = imu_clock_of(made, NAMES, clock)
    assert found is not None
    assert found.loops
    for k, (one, name) in enumerate(zip(made, NAMES, strict=True)):
        shown = next(item for item in clock.shown if item.recording == name)
        timed = clock.counted(one, name)
        assert timed is not None
        put = found.counted(one, timed, name, shown, clock.period_s)
        newest = put.samples["magnetometer"].t + 0.5 * shown.apart * clock.period_s
        age = put.samples["gyroscope"].t - newest
        true = loop.ages(seed + k)
        # as the field's samples slip by 0.6 ms in a step, ages that are none or a whole period are seen to better
        assert np.quantile(np.abs(age - true), 0.95) < 3e-4
        assert true.mean() > 3e-3


@pytest.mark.parametrize("seed", [1, 21, 41, 51])
def test_samples_of_a_chip_that_is_nearly_as_fast_as_the_magnetometer_are_told_all_the_same(seed):
    # the two slip by less than a sample in a throw: at one period for all, no phase is that of the first guess
    chip = 1.002 * loop.PERIOD
    made, clock = counted(seed, chip)
    found = imu_clock_of(made, NAMES, clock)
    assert found is not None
    for k, one in enumerate(found.shown):
        true = loop.chip_times(seed + k, chip)
        # later on the wobble has died
        off = (one.times * chip / one.period_s - true)[:100]
        assert np.mean(np.abs(off - np.median(off)) < 0.4 * chip) > 0.98


def test_a_disc_that_does_not_wobble_tells_nothing_of_its_chip():
    made, clock = counted(1, 0.0091)
    assert imu_clock_of(loop.without_wobble(made, 3), NAMES, clock) is None


def test_rows_stand_where_the_chip_made_them():
    made, clock = counted(1, 0.0091)
    found = imu_clock_of(made, NAMES, clock)
    assert found is not None
    for one, name in zip(made, NAMES, strict=True):
        shown = next(item for item in clock.shown if item.recording == name)
        timed = clock.counted(one, name)
        assert timed is not None
        put = found.counted(one, timed, name, shown, clock.period_s)
        t = put.samples["gyroscope"].t
        assert t[0] >= 0.0
        steps = np.diff(t) / found.period_s
        assert np.mean(np.abs(steps - np.rint(steps)) < 0.05) > 0.95
        assert np.array_equal(put.samples["gyroscope"].value, one.samples["gyroscope"].value)
        # the field keeps its own times: one row's sensors are of different instants, none more than two periods apart
        assert np.max(np.abs(put.samples["magnetometer"].t - t)) < 2.5 * loop.PERIOD
