"""Spin rate from centripetal acceleration, (8), (9), (11), (12), against closed forms."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from discsim.errors import InputError
from discsim.estimators import AccelerometerErrors, accelerometer, envelope, rate_with_known_terms
from discsim.recording import Samples, SensorSheet

POSITION = np.array([-0.0161, 0.0, 0.0])
G = 9.80665
NOTHING = AccelerometerErrors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def sheet(position=POSITION, **stated):
    return SensorSheet(200.0, position=position, **stated)


def steady_spin(rate, position=POSITION, n=3, origin=(0.0, 0.0, -G)):
    """Specific force (1) of a steady spin about z: origin + w x (w x d)."""
    force = -(rate**2) * np.array([position[0], position[1], 0.0]) + np.asarray(origin)
    return Samples(np.arange(n) / 200, np.tile(force, (n, 1)))


@settings(deadline=None)
@given(rate=st.floats(0.01, 150.0), a=st.floats(-0.1, 0.1), b=st.floats(-0.1, 0.1))
def test_a_level_steady_spin_is_recovered_at_any_place_off_the_axis(rate, a, b):
    assume(np.hypot(a, b) > 1e-3)
    place = np.array([a, b, 0.004])
    estimate = accelerometer(steady_spin(rate, place), sheet(place))
    np.testing.assert_allclose(estimate.rate, rate, rtol=1e-12)


def test_on_the_papers_axis_it_is_exactly_equation_12():
    a_x = np.array([0.0, 0.3, 12.0, 140.0])
    samples = Samples(np.arange(4.0), np.stack([a_x, a_x * 0 + 5.0, a_x * 0 - G], axis=1))
    np.testing.assert_array_equal(accelerometer(samples, sheet()).rate, np.sqrt(a_x / 0.0161))


@settings(deadline=None)
@given(rate=st.floats(10.0, 120.0), e=st.floats(-0.005, 0.005))
def test_an_installation_error_scales_the_rate_by_a_square_root(rate, e):
    """Eq. (9) with e_n = 0: the sensor sits at d_x + e but is taken to sit at d_x."""
    samples = steady_spin(rate, POSITION + np.array([e, 0, 0]))
    estimate = accelerometer(samples, sheet())
    np.testing.assert_allclose(estimate.rate, rate * np.sqrt(1 + e / POSITION[0]), rtol=1e-12)
    np.testing.assert_allclose(rate_with_known_terms(samples, POSITION, offset=[e, 0, 0]), rate, rtol=1e-12)


@settings(deadline=None)
@given(
    rate=st.floats(20.0, 120.0),
    errors=st.lists(st.floats(-0.02, 0.02), min_size=9, max_size=9),
    bias=st.lists(st.floats(-0.6, 0.6), min_size=3, max_size=3),
    offset=st.lists(st.floats(-0.004, 0.004), min_size=2, max_size=2),
    origin=st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3),
)
def test_equation_8_undoes_every_term_that_is_known(rate, errors, bias, offset, origin):
    """(5) in, (8) out."""
    S = np.eye(3) + np.reshape(errors, (3, 3))
    true = steady_spin(rate, POSITION + np.array([*offset, 0.0]), origin=origin)
    measured = Samples(true.t, true.value @ S.T + bias)
    found = rate_with_known_terms(measured, POSITION, offset=[*offset, 0.0], sensitivity=S, bias=bias, origin=origin)
    np.testing.assert_allclose(found, rate, rtol=1e-9)


def test_with_nothing_known_equation_8_is_equation_12():
    samples = steady_spin(50.0)
    np.testing.assert_array_equal(rate_with_known_terms(samples, POSITION), accelerometer(samples, sheet()).rate)


def test_known_terms_that_put_the_sensor_on_the_axis_are_refused():
    with pytest.raises(ValueError, match="from the axis"):
        rate_with_known_terms(steady_spin(50.0), POSITION, offset=[0.02, 0.0, 0.0])


def test_the_rate_is_unknown_where_the_force_points_outwards_or_is_missing_or_clipped():
    value = np.tile([0.0, 0.0, -G], (5, 1))
    value[:, 0] = [-0.1, np.nan, 156.9, 50.0, 50.0]
    value[4, 1] = -156.9
    estimate = accelerometer(Samples(np.arange(5.0), value), sheet(range=156.9, resolution=0.005))
    np.testing.assert_array_equal(np.isfinite(estimate.rate), [False, False, False, True, False])
    np.testing.assert_array_equal(np.isfinite(estimate.sd), [False, False, False, True, False])


@pytest.mark.parametrize("position", [None, np.zeros(3), np.array([0.0, 0.0, 0.01])])
def test_without_a_place_off_the_axis_nothing_is_known(position):
    estimate = accelerometer(steady_spin(50.0), sheet(position))
    assert np.isnan(estimate.rate).all()


def corners(a, position, errors):
    """(11) by brute force: every corner of the error box of (3), (13) and the mount, sensor on the negative x axis."""
    signs = product((-1, 1), repeat=8)
    squares = []
    for s_xx, s_xy, s_xz, bias, d_x, d_y, noise, along in signs:
        S_xx, S_xy, S_xz = s_xx * errors.nonlinearity, s_xy * errors.cross_axis, s_xz * errors.cross_axis
        numerator = (1 + S_xx) * along * errors.origin + S_xz * errors.vertical + bias * errors.bias
        numerator += noise * errors.noise
        denominator = -(1 + S_xx) * (position[0] + d_x * errors.mount) - S_xy * d_y * errors.mount
        squares.append((a - numerator) / denominator)
    return np.sqrt(np.maximum(np.min(squares, axis=0), 0)), np.sqrt(np.max(squares, axis=0))


@pytest.mark.parametrize("mount", [0.0, 0.001, 0.005])
def test_the_envelope_is_the_extreme_of_all_corners_of_the_error_box(mount):
    a = np.linspace(0.0, 150.0, 40)
    errors = AccelerometerErrors(mount=mount)
    lower, upper = envelope(a, POSITION, errors)
    least, most = corners(a, POSITION, errors)
    np.testing.assert_allclose(lower, least, rtol=1e-12)
    np.testing.assert_allclose(upper, most, rtol=1e-12)


@pytest.mark.parametrize("mount", [0.001, 0.005])
def test_the_envelope_at_high_rate_is_that_of_the_denominator(mount):
    """At 5000 deg/s: -d_x (1 + S) + e (1 + S) + S_xy e for the longest arm, Eq. (8); bias adds under 1 %."""
    rate = np.radians(5000.0)
    lower, upper = envelope(rate**2 * 0.0161 * np.ones(1), POSITION, AccelerometerErrors(mount=mount))
    longest = 1.005 * (0.0161 + mount) + 0.02 * mount
    shortest = 0.995 * (0.0161 - mount) - 0.02 * mount
    assert lower[0] / rate == pytest.approx(np.sqrt(0.0161 / longest), rel=0.01)
    assert upper[0] / rate == pytest.approx(np.sqrt(0.0161 / shortest), rel=0.01)


@settings(deadline=None)
@given(
    rate=st.floats(5.0, 120.0),
    unit=st.lists(st.floats(-1, 1), min_size=9, max_size=9),
    angle=st.floats(0.0, 6.28),
    rest=st.lists(st.floats(-1, 1), min_size=7, max_size=7),
)
def test_the_truth_lies_inside_the_envelope_whatever_the_errors_within_their_bounds(rate, unit, angle, rest):
    """Any place in the plane, any error within its bound."""
    errors = AccelerometerErrors(origin=3.0)
    place = 0.0161 * np.array([np.cos(angle), np.sin(angle), 0.0])
    S = np.eye(3) + np.reshape(unit, (3, 3)) * np.where(np.eye(3) > 0, errors.nonlinearity, errors.cross_axis)
    along = errors.origin * rest[0] * np.array([np.cos(rest[1] * np.pi), np.sin(rest[1] * np.pi)])
    moved = place + errors.mount * np.array([rest[2], rest[3], 0.0])
    true = steady_spin(rate, moved, origin=[*along, -G * rest[4]])
    value = true.value @ S.T + errors.bias * np.array([rest[5], rest[6], 1.0])
    estimate = accelerometer(Samples(true.t, value), sheet(place), errors)
    assert np.all(estimate.lower <= rate * (1 + 1e-12))
    assert np.all(estimate.upper >= rate * (1 - 1e-12))


def test_an_envelope_that_may_hold_the_axis_has_no_upper_bound():
    errors = AccelerometerErrors(mount=0.02)
    lower, upper = envelope(np.array([50.0, -5.0]), POSITION, errors)
    assert np.isinf(upper[0])
    assert lower[0] > 0
    assert np.isnan(lower[1])
    assert np.isnan(upper[1])


def test_at_rest_the_envelope_begins_at_zero_and_ends_at_what_bias_and_tilt_of_axes_allow():
    """Non-zero rate at rest, Section 2.1: (60 mg + 2 % of g + 0.3 % of g) over 0.995 of 15.1 mm less 2 % of 1 mm."""
    lower, upper = envelope(np.zeros(1), POSITION, AccelerometerErrors())
    assert lower[0] == 0.0
    assert upper[0] == pytest.approx(np.sqrt(0.083 * G / (0.995 * 0.0151 - 0.02 * 0.001)), rel=1e-9)


@pytest.mark.parametrize("rate", [0.5, 5.0, 20.0, 80.0])
def test_the_standard_deviation_is_the_scatter_that_noise_alone_gives(rate):
    """First order at high rate; near zero half of the samples are lost and what is left scatters as sqrt(s) does."""
    rng = np.random.default_rng(4)
    samples = steady_spin(rate, n=20000)
    noisy = Samples(samples.t, samples.value + rng.normal(0, 0.08, samples.value.shape))
    estimate = accelerometer(noisy, sheet(noise_rms=0.08), NOTHING)
    known = np.isfinite(estimate.rate)
    error = np.sqrt(np.mean((estimate.rate[known] - rate) ** 2))
    assert 0.5 < error / np.median(estimate.sd[known]) < 2.0
    if rate >= 20:
        assert np.median(estimate.sd) == pytest.approx(0.08 / (2 * 0.0161 * rate), rel=0.01)


def test_the_mount_error_dominates_at_high_rate():
    """1 mm of 16.1 mm, uniform: half of 1 / 16.1 / sqrt(3) of the rate, 1.8 %; bias and noise add a tenth of it."""
    estimate = accelerometer(steady_spin(80.0), sheet(noise_rms=0.08))
    assert estimate.sd[0] / 80.0 == pytest.approx(0.5 / 16.1 / np.sqrt(3), rel=0.1)


def test_a_stated_uncertainty_of_the_position_takes_the_place_of_the_mount_error():
    stated = sheet(sigma={"position_m": 0.0001})
    unstated = sheet()
    errors = AccelerometerErrors(0.0, 0.0, 0.0, 0.0, 0.001)
    ratio = accelerometer(steady_spin(80.0), stated, errors).sd / accelerometer(steady_spin(80.0), unstated, errors).sd
    np.testing.assert_allclose(ratio, 0.1 * np.sqrt(3), rtol=0.02)


def test_a_negative_bound_is_refused():
    with pytest.raises(InputError, match="mount"):
        AccelerometerErrors(mount=-0.001)
