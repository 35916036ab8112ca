"""The Cramer-Rao bounds: closed forms, and what raises them."""

from __future__ import annotations

import numpy as np
import pytest
from support.bounds import flight_bound, regular_bound

from discsim.estimators.bound import tone_bound


def test_a_long_window_has_the_closed_form():
    """Hard iron is nearly orthogonal to a tone of many turns, a chirp wholly to the rate at the centre."""
    t = 0.01 * np.arange(128)
    closed = regular_bound(128, 0.01, 30.0, 0.6)
    assert np.degrees(closed) == pytest.approx(0.27, abs=5e-3)  # the worked figure
    for degree in (0, 1):
        assert tone_bound(t, 30.0, 0.6, np.radians(4200.0), degree=degree).rate == pytest.approx(closed, rel=2e-3)


def test_curvature_costs_two_and_a_half_times():
    """Slopes of Legendre's P1 and P3 at the centre are 1 and -3/2: variances 3 and 3 + 7 (9/4), a ratio of 2.5^2."""
    t = 0.01 * np.arange(400)
    linear = tone_bound(t, 30.0, 0.6, 60.0, degree=1).rate
    assert tone_bound(t, 30.0, 0.6, 60.0, degree=2).rate / linear == pytest.approx(2.5, rel=5e-3)


def test_less_than_a_turn_is_confused_with_hard_iron():
    t = 0.01 * np.arange(25)
    known = tone_bound(t, 30.0, 0.6, np.radians(500.0), hard_iron=False).rate
    unknown = tone_bound(t, 30.0, 0.6, np.radians(500.0)).rate
    assert unknown > 3 * known


def test_an_ellipse_that_is_nearly_known_costs_nearly_nothing():
    t = 0.01 * np.arange(25)
    known = tone_bound(t, 30.0, 0.6, np.radians(500.0)).rate
    assert tone_bound(t, 30.0, 0.6, np.radians(500.0), ellipse_sd=1e-6).rate == pytest.approx(known, rel=1e-3)
    assert tone_bound(t, 30.0, 0.6, np.radians(500.0), ellipse_sd=0.1).rate > known


def test_samples_at_the_ends_say_most():
    """The bound depends on the spread of the time stamps only, for a tone of many turns."""
    even = np.linspace(0.0, 2.0, 200)
    ends = np.concatenate([np.linspace(0.0, 0.5, 100), np.linspace(1.5, 2.0, 100)])
    ratio = tone_bound(ends, 30.0, 0.6, 70.0, degree=0).rate / tone_bound(even, 30.0, 0.6, 70.0, degree=0).rate
    assert ratio == pytest.approx(np.std(even) / np.std(ends), rel=0.02)


def test_the_chirp_has_the_closed_form():
    """Phase c t^2/2 in white noise: var c = 4 * 180 sigma^2 / (A^2 N^5 T^4) for large N."""
    t = 0.01 * np.arange(1000)
    bound = tone_bound(t, 30.0, 0.6, 70.0)
    assert bound.chirp == pytest.approx(np.sqrt(720 / 1000**5) * (0.6 / 30) / 0.01**2, rel=5e-3)


def test_a_stiff_smoother_has_the_bound_of_one_straight_line():
    """With r'' almost zero a flight is one window with chirp; its middle has the closed form."""
    t = 0.01 * np.arange(401)
    middle = flight_bound(t, 30.0, 0.6, 1e-9, np.array([2.0]))[0]
    assert middle == pytest.approx(regular_bound(401, 0.01, 30.0, 0.6), rel=5e-3)


def test_a_rough_spin_is_known_less_and_worst_at_the_ends():
    t = 0.01 * np.arange(401)
    at = np.array([0.0, 2.0])
    smooth, rough = (flight_bound(t, 30.0, 0.6, density, at) for density in (0.1, 100.0))
    assert np.all(rough > 1.2 * smooth)
    assert np.all([smooth[0] > 2 * smooth[1], rough[0] > 2 * rough[1]])
