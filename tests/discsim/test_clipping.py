"""Readings at a sensor's limit, told from the readings themselves, and motions that stand still but are not clipped."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from discsim import clipping
from discsim.clipping import clipped, constant_axes, dead_axes, limits, step_of
from discsim.recording import SensorSheet

#: an MPU-9250's gyroscope: step, noise (rad/s) and limit
STEP, NOISE, LIMIT = np.radians(1 / 16.4), 0.003, np.radians(2000.0)


def wobbling(rate, rng, noise=NOISE, step=STEP):
    """Return readings of a body that turns at ``rate`` (n,) about z and wobbles by 1 rad/s."""
    k = np.arange(rate.size)
    value = np.stack([np.sin(0.3 * k), np.cos(0.3 * k), rate], axis=1) + rng.normal(0.0, noise, (rate.size, 3))
    return np.rint(value / step) * step if step else value


@pytest.mark.parametrize("step", [STEP, 0.0, 3 * STEP])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("stated", [None, 34.9066, np.radians(4000.0)])
def test_a_gyroscope_at_its_limit_is_seen_whatever_is_stated(step, sign, stated):
    """A spin-down from 3797 deg/s clips until it is below 2000; the file has five decimals of 34.906585."""
    rate = sign * np.radians(3797.0) * np.exp(-np.arange(3000) / 2000)
    seen = np.round(np.clip(wobbling(rate, np.random.default_rng(2), step=step), -LIMIT, LIMIT), 5)
    found = clipped(seen, stated, step or None)
    beyond = np.abs(rate) > LIMIT + 5 * NOISE
    below = np.abs(rate) < LIMIT - 5 * NOISE - 2 * step
    assert found[beyond, 2].all()
    assert not found[below, 2].any()
    assert not found[:, :2].any()


@pytest.mark.parametrize("step", [STEP, 0.0])
@pytest.mark.parametrize("resting", [0.0, 0.25])
def test_a_log_that_writes_one_number_at_rest_hides_no_limit(step, resting):
    """Zeros, or a bias to the last digit, before and after a throw that clips: the throw shows the noise."""
    rate = np.radians(3797.0) * np.exp(-np.arange(600) / 400)
    throw = np.clip(wobbling(rate, np.random.default_rng(2), step=step), -LIMIT, LIMIT)
    rest = np.full((500, 3), resting)
    found = clipped(np.concatenate([rest, throw, rest]), None, None)
    beyond = np.concatenate([np.zeros(500, bool), rate > LIMIT + 5 * NOISE, np.zeros(500, bool)])
    assert found[beyond, 2].all()
    assert not found[~beyond & (np.arange(1600) > 900)].any()
    assert not found[:, :2].any()


def test_a_gyroscope_that_clips_all_through_is_told_by_its_other_axes():
    seen = np.clip(wobbling(np.full(400, 66.0), np.random.default_rng(1)), -LIMIT, LIMIT)
    assert clipped(seen, None, None)[:, 2].all()


def test_an_accelerometer_that_clips_at_the_crests_of_its_turns_only():
    """60 m/s^2 of centripetal force and gravity's 9.8 on it, ten turns a second: three readings in twenty are lost."""
    rng = np.random.default_rng(0)
    x = 60.0 + 9.8 * np.sin(2 * np.pi * 10.3 * np.arange(1000) / 200)
    force = np.stack([x, 0.3 * x, 0 * x - 9.8], axis=1) + rng.normal(0.0, 0.08, (1000, 3))
    found = clipped(np.minimum(np.rint(force / 0.0048) * 0.0048, 68.0), None, None)
    assert found[x > 68.4, 0].all()
    assert not found[x < 67.6, 0].any()
    assert not found[:, 1:].any()


@pytest.mark.parametrize("noise", [0.0, 0.05 * STEP, 0.3 * STEP, STEP, 5 * STEP])
@pytest.mark.parametrize("step", [STEP, 0.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_steady_table_is_not_clipped(noise, step, seed):
    """Plateaus with ramps between, and rest before: without noise, or in coarse steps, a sensor stands still there."""
    rng = np.random.default_rng(seed)
    rate = np.interp(np.arange(0, 30, 0.005), [0, 2, 4, 10, 12, 20, 22], [0, 0, 20, 20, 30, 30, 0])
    value = np.stack([0 * rate, 0 * rate, rate], axis=1) + rng.normal(0.0, noise, (rate.size, 3))
    value = np.rint(value / step) * step if step else value
    assert not clipped(value, LIMIT, None).any()


@given(
    noise=st.floats(0.03, 30.0),
    count=st.integers(20, 3000),
    level=st.floats(0.0, 100.0),
    seed=st.integers(0, 1000),
)
def test_a_sensor_at_rest_is_not_clipped_however_coarse_it_is(noise, count, level, seed):
    """In steps of one: the largest readings of noise are many where it is small, and few where it is large."""
    value = np.rint(np.random.default_rng(seed).normal(level, noise, (count, 3)))
    assert not np.isfinite(limits(value).largest)


def test_a_noiseless_turning_sensor_is_not_clipped_though_its_crests_repeat():
    t = np.arange(3000) / 100
    for rate in (np.radians(4000.0), 2 * np.pi, 17.3):
        field = np.stack([30 * np.cos(rate * t), -30 * np.sin(rate * t), 0 * t + 39], axis=1)
        assert not clipped(field, None, None).any()
        assert not clipped(np.rint(field / 0.15) * 0.15, None, None).any()


@pytest.mark.parametrize("counts", [32764, 32767, -32768])
def test_the_ends_of_sixteen_bits_are_limits_from_the_first_reading_on(counts):
    """One reading is enough: 32767 counts are no chance where the step is one count."""
    value = np.random.default_rng(0).integers(-3000, 3000, (500, 3)).astype(float)
    value[100, 1] = counts
    found = clipped(value * 0.000122 * 9.80665, None, None)
    assert found[100, 1]
    assert np.count_nonzero(found) == 1


def test_a_range_is_reached_to_the_last_digit_it_is_stated_to():
    for stated, written in ((34.9066, 34.90659), (34.907, 34.90659), (39.2, 39.19922)):
        value = np.array([[0.0, 1.0, written], [0.1, 0.9, 0.98 * written]])
        assert SensorSheet(100.0, range=stated).clipped(value)[0, 2]
        assert not SensorSheet(100.0, range=stated).clipped(value)[1, 2]


@given(step=st.floats(1e-6, 10.0), seed=st.integers(0, 100))
def test_the_step_is_the_smallest_spacing_of_rounded_readings_and_none_of_unrounded_ones(step, seed):
    free = 500 * step * np.random.default_rng(seed).normal(size=(2000, 3))
    assert step_of(np.rint(free / step) * step) == pytest.approx(step, rel=1e-6)
    assert step_of(free) < 0.02 * step  # 6000 numbers within 2000 steps have no common measure that is coarser


def test_an_axis_that_never_changes_is_dead_where_others_scatter_and_it_is_small():
    rng = np.random.default_rng(0)
    value = rng.normal(0.0, 1.0, (100, 3))
    value[:, 1] = 0.0
    assert dead_axes(value).tolist() == [False, True, False]
    value[:, 1] = 34.9  # this may be a limit
    assert constant_axes(value).tolist() == [False, True, False]
    assert not dead_axes(value).any()
    ramp = np.stack([0 * np.arange(100.0), 0 * np.arange(100.0), np.arange(100.0)], axis=1)
    assert not dead_axes(ramp).any()  # without noise an axis at rest stands still


def test_recordings_that_are_looked_at_side_by_side_do_not_disturb_one_another(monkeypatch):
    """What is remembered of readings goes with them: threads that drop theirs at once clear one memory."""
    monkeypatch.setattr(clipping, "clipped_anew", lambda value, *_: np.zeros(value.shape, dtype=np.bool_))

    def look(number: int) -> int:
        for _ in range(3000):
            value = np.zeros((4, 1))
            value.flags.writeable = False
            clipped(value, 1e3, 1e-3)
        return number

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as pool:
            assert list(pool.map(look, range(8))) == list(range(8))
    finally:
        sys.setswitchinterval(before)


def test_noise_found_piece_by_piece_is_that_of_the_whole(monkeypatch):
    rate = np.radians(3797.0) * np.exp(-np.arange(3000) / 2000)
    seen = np.clip(wobbling(rate, np.random.default_rng(3)), -LIMIT, LIMIT)
    whole, found = limits(seen), clipped(seen, None, None)
    monkeypatch.setattr(clipping, "PIECE", 100)
    np.testing.assert_array_equal(limits(seen), whole)
    assert np.array_equal(clipped(seen.copy(), None, None), found)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("step", [0.01, 0.0])
def test_a_rough_motion_is_clipped_where_its_largest_reading_stands_out(step, seed):
    """A rocket's motor shakes a part of 2 g: three of four readings stood at its limit, and none was said to."""
    rng = np.random.default_rng(seed)
    shaken = rng.normal([0.3, 0.5, 2.2], [0.8, 0.7, 0.4], (900, 3))
    written = step * np.rint(shaken / step) if step else shaken
    assert not np.any(clipped(written, None, None))
    at_end = np.clip(written, -2.0, 1.98)
    assert np.array_equal(clipped(at_end, None, None)[:, 2], at_end[:, 2] == 1.98)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shape", ["uniform", "sine", "heavy"])
def test_a_rough_motion_that_ends_by_itself_is_not_clipped(shape, seed):
    """A crest in rough motion has more readings than what lies below it has, as far as `DENSER` goes."""
    rng = np.random.default_rng(seed)
    n = 3000
    value = {
        "uniform": rng.uniform(-1.0, 1.0, (n, 3)),
        "sine": np.sin(rng.uniform(0.0, 2 * np.pi, (n, 3))),
        "heavy": np.tanh(rng.normal(0.0, 0.5, (n, 3))),
    }[shape]
    assert not np.any(clipped(np.rint(value / 0.01) * 0.01, None, None))
