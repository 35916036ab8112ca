"""Rates that are measured directly."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.estimators import gyroscope, rate_reference
from discsim.recording import Samples, SensorSheet

RANGE = np.radians(2000.0)


def turning(rate, rng=None, noise=0.0):
    value = np.stack([0 * rate, 0 * rate, rate], axis=1)
    if rng is not None:
        value = value + rng.normal(0.0, noise, value.shape)
    return Samples(np.arange(rate.size) / 200, np.clip(value, -RANGE, RANGE))


def test_the_z_axis_passes_with_its_sign_and_is_unknown_where_it_clips():
    rate = np.linspace(-50.0, 50.0, 501)
    estimate = gyroscope(turning(rate), SensorSheet(200.0, 0.003, 0.001, RANGE))
    known = np.isfinite(estimate.rate)
    np.testing.assert_array_equal(known, np.abs(rate) < RANGE)
    np.testing.assert_array_equal(estimate.rate[known], rate[known])
    np.testing.assert_array_equal(np.isfinite(estimate.sd), known)
    assert estimate.signed


@pytest.mark.parametrize("slope", [0.0, 10.0, -100.0])
def test_noise_larger_than_stated_is_seen_whatever_the_acceleration(slope):
    """5 % is five standard deviations of a median over 20000 second differences."""
    rng = np.random.default_rng(0)
    rate = np.clip(slope * np.arange(20000) / 200, -30.0, 30.0)
    estimate = gyroscope(turning(rate, rng, 0.05), SensorSheet(200.0, 0.003, 0.0, RANGE))
    assert estimate.sd[0] == pytest.approx(0.05, rel=0.05)


def test_the_stated_noise_stands_where_less_is_seen():
    estimate = gyroscope(turning(np.full(100, 3.0)), SensorSheet(200.0, 0.003, 0.002, RANGE))
    np.testing.assert_allclose(estimate.sd, np.hypot(0.003, 0.002 / np.sqrt(12)))


def test_a_rate_reference_passes_with_its_sign_and_its_gaps():
    samples = Samples(np.arange(4.0), np.array([1.0, -2.0, np.nan, 4.0]))
    estimate = rate_reference(samples, SensorSheet(100.0, 0.0006))
    np.testing.assert_array_equal(estimate.rate, samples.value)
    assert estimate.method == "rate_reference"


@pytest.mark.parametrize(
    ("rate", "median", "beyond"),
    [
        # six of a hundred readings happened not to clip
        (np.concatenate([np.linspace(30.0, 34.0, 6), np.full(94, 56.0)]), RANGE, True),
        (-np.concatenate([np.linspace(30.0, 34.0, 6), np.full(94, 56.0)]), -RANGE, True),
        # most of a slow-down is within the range: the median counts what is beyond it as more
        (np.linspace(50.0, 10.0, 101), 30.0, False),
        (np.linspace(-20.0, 20.0, 101), 0.0, False),
    ],
    ids=["clipped", "clipped, turning back", "slowing down", "never clipped"],
)
def test_of_a_gyroscope_that_mostly_clips_the_median_is_its_limit_or_more(rate, median, beyond):
    found = gyroscope(turning(rate), SensorSheet(200.0, 0.003, 0.001, RANGE)).median
    assert found.rate == pytest.approx(median, abs=1e-9)
    assert found.beyond is beyond
    assert np.isnan(found.sd) == beyond


def test_a_rate_that_nothing_tells_has_no_median():
    found = rate_reference(Samples(np.arange(4.0), np.full(4, np.nan)), SensorSheet(100.0, 0.0006)).median
    assert np.isnan(found.rate)
    assert not found.beyond
