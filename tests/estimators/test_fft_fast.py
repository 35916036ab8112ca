"""The fast search of the padded spectrum finds what the padded transform finds."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.fft
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.fft_fast import padded_peak


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
