"""The fast search of the padded spectrum finds what the padded transform finds."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.fft
from hypothesis import given, settings
from hypothesis import strategies as st

from discsim.estimators.fft_fast import highest, padded_peak, spectra, transform_at


def padded(x, total, first, last):
    power = np.abs(scipy.fft.rfft(x, total, axis=1)) ** 2
    orders = np.arange(power.shape[1])
    power[(orders < first[:, None]) | (orders > last[:, None])] = -1.0
    return np.argmax(power, axis=1), np.max(power, axis=1)


def windows(rng, n, count, offset):
    k = np.arange(n)
    rate, phase = rng.uniform(0.05, 3.1, (count, 1)), rng.uniform(0, 2 * np.pi, (count, 1))
    return offset + 30 * np.cos(rate * k + phase) + rng.normal(0, rng.choice([0.1, 3.0, 30.0]), (count, n))


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    n=st.sampled_from([16, 31, 64, 128]),
    total=st.sampled_from([500, 2048, 4099, 16384]),
    offset=st.sampled_from([0.0, 10.0, 300.0]),
)
def test_the_order_is_that_of_the_padded_transform(seed, n, total, offset):
    """Noise, tones and strong offsets, sizes that are no multiples; powers to rounding (1e-9 of the greatest)."""
    rng = np.random.default_rng(seed)
    x = windows(rng, n, 12, offset)
    first = rng.integers(0, total // 3, 12)
    last = np.full(12, total // 2)
    order, power = padded_peak(x, total, first, last)
    expected, greatest = padded(x, total, first, last)
    everything = np.sum(np.abs(x), axis=1) ** 2
    np.testing.assert_allclose(power, greatest, rtol=1e-9, atol=1e-11 * np.max(everything))
    same = order == expected
    # where the orders differ their powers are one to rounding
    exact = np.abs(scipy.fft.rfft(x, total, axis=1)) ** 2
    rows = np.flatnonzero(~same)
    np.testing.assert_allclose(exact[rows, order[rows]], greatest[rows], rtol=1e-9)


def test_the_paper_window_is_found_on_its_own_grid():
    rng = np.random.default_rng(1)
    x = windows(rng, 128, 600, 12.0)
    first, last = np.full(600, 228), np.full(600, 8192)
    order, _ = padded_peak(x, 2**14, first, last)
    np.testing.assert_array_equal(order, padded(x, 2**14, first, last)[0])


@pytest.mark.parametrize("total", [64, 100, 2**14])
def test_an_empty_range_has_no_peak(total):
    order, power = padded_peak(np.ones((2, 16)), total, np.array([5, 9]), np.array([4, 9]))
    assert order[0] == -1
    assert power[0] == -1.0
    assert order[1] == 9


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    total=st.sampled_from([64, 500, 4099, 16384]),
    share=st.sampled_from([0.5, 0.999, 1.001]),
)
def test_a_peak_counts_only_above_what_it_must_exceed(seed, total, share):
    """A thousandth either way is far above rounding."""
    rng = np.random.default_rng(seed)
    x = windows(rng, 64, 8, 30.0)
    first, last = np.zeros(8, dtype=int), np.full(8, total // 2)
    mean = x.mean(axis=1)
    still = x - mean[:, None]
    expected, greatest = padded(still, total, first, last)
    order, power = highest(spectra(still, mean, total), first, last, offset=False, above=share * greatest)
    if share > 1:
        assert np.all(order == -1)
        assert np.all(power == -1)
    else:
        np.testing.assert_allclose(power, greatest, rtol=1e-9)
        np.testing.assert_array_equal(order, expected)


def test_one_value_is_that_of_the_padded_transform_counted_from_the_centre():
    rng = np.random.default_rng(2)
    x = windows(rng, 31, 5, 3.0)
    mean, orders = x.mean(axis=1), np.array([0, 3, 100, 249, 250])
    still = x - mean[:, None]
    value = transform_at(spectra(still, mean, 500), orders)
    angle = 2 * np.pi * orders[:, None] / 500 * (np.arange(31) - 15)
    np.testing.assert_allclose(value.real, np.sum(still * np.cos(angle), axis=1), atol=1e-10)
    np.testing.assert_allclose(value.imag, -np.sum(still * np.sin(angle), axis=1), atol=1e-10)
