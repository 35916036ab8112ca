"""Maximum likelihood in windows: at the bound, signed, honest, and NaN where nothing can be known."""

from __future__ import annotations

import numpy as np
import pytest
from support.spinning_sensor import MPU9250, Faults, Spin, move, record, tone, without

from discsim.errors import InputError
from discsim.estimators.bound import tone_bound
from discsim.estimators.likelihood import LikelihoodSettings, likelihood, likelihood_from_samples
from discsim.estimators.precession import axial_field, phase_rate, transverse_rates
from discsim.recording import Samples


def one_window(window: float, **changes: float) -> LikelihoodSettings:
    return LikelihoodSettings(window=window, longest_window=window, degree=1, turns=0.01, **changes)


@pytest.mark.parametrize(
    ("window", "decibels", "rate"),
    [(0.25, 30.0, 2000.0), (0.5, 50.0, -4200.0), (1.28, 34.0, 500.0), (1.28, 20.0, 7000.0), (4.0, 60.0, 17000.0)],
)
def test_a_window_reaches_the_bound_and_says_so(window, decibels, rate):
    """rms over 80 windows scatters by 8 % of itself (one sigma); 25 % is three of them."""
    rng = np.random.default_rng(round(abs(rate) + 10 * decibels))
    errors, sds, bounds = [], [], []
    for _ in range(80):
        samples, noise = tone(rng, rate=rate, window=window, decibels=decibels, chirp=3.0)
        answer = likelihood_from_samples(samples, one_window(window), fixed_axis=True)
        errors.append(answer.rate[0] - np.radians(rate))
        sds.append(answer.sd[0])
        bounds.append(tone_bound(samples.t, 30.0, noise, np.radians(rate), ellipse_sd=0.05).rate)
    errors, sds = np.array(errors), np.array(sds)
    assert np.sqrt(np.mean(errors**2)) / np.mean(bounds) == pytest.approx(1.0, abs=0.25)
    assert np.sqrt(np.mean((errors / sds) ** 2)) == pytest.approx(1.0, abs=0.25)
    assert abs(np.mean(errors)) < 4 * np.mean(bounds) / np.sqrt(80)


def test_soft_iron_does_not_bend_the_rate():
    """An ellipse of 4 % at 60 dB: without it in the model the error is many times the bound."""
    rng = np.random.default_rng(5)
    samples, noise = tone(rng, rate=800.0, window=1.0, decibels=60.0, ellipse=0.03 - 0.026j)
    answer = likelihood_from_samples(samples, one_window(1.0), fixed_axis=True)
    bound = tone_bound(samples.t, 30.0, noise, np.radians(800.0), ellipse_sd=0.05).rate
    assert abs(answer.rate[0] - np.radians(800.0)) < 4 * bound


def test_missing_and_uneven_samples_count_by_their_time_stamps():
    rng = np.random.default_rng(6)
    errors, sds = [], []
    for _ in range(40):
        t = np.sort(0.01 * np.arange(128) + rng.uniform(-0.003, 0.003, 128))
        t = t[rng.random(128) > 0.3]
        samples, _ = tone(rng, rate=-5100.0, window=1.28, decibels=34.0, t=t)
        answer = likelihood_from_samples(samples, one_window(1.6), fixed_axis=True)
        errors.append(answer.rate[0] - np.radians(-5100.0))
        sds.append(answer.sd[0])
    assert np.sqrt(np.mean((np.array(errors) / np.array(sds)) ** 2)) == pytest.approx(1.0, abs=0.35)


def test_a_rate_that_wobbles_within_the_window_is_answered_with_the_wobble_in_its_deviation():
    """A clean signal of 340 deg/s whose rate swings by 15 deg/s rms at 6 Hz: the mean is known, the instant is not."""
    rng = np.random.default_rng(12)
    t = 0.01 * np.arange(460)
    swing, pace = np.radians(15.0) * np.sqrt(2), 2 * np.pi * 6.0
    phase = -np.radians(340.0) * t + swing / pace * np.cos(pace * t)
    field = np.stack([29 * np.cos(phase), 29 * np.sin(phase), np.full(t.size, 25.0)], -1) + np.array([-30.0, 1.0, 0.0])
    samples = Samples(t, field + rng.normal(0, 0.05, field.shape))
    answer = likelihood_from_samples(samples, fixed_axis=True)
    error = answer.rate - np.radians(340.0) - swing * np.sin(pace * answer.t)
    assert np.mean(np.isfinite(answer.rate)) > 0.9
    assert np.sqrt(np.nanmean((error / answer.sd) ** 2)) == pytest.approx(1.0, abs=0.25)


def test_a_fast_spin_up_is_found():
    """90 rad/s^2 turns the phase by 18 rad beyond a steady tone's within a window: the coarse search must chirp too."""
    samples, noise = tone(np.random.default_rng(7), rate=3000.0, window=1.28, decibels=34.0, chirp=90.0)
    answer = likelihood_from_samples(samples, one_window(1.28), fixed_axis=True)
    bound = tone_bound(samples.t, 30.0, noise, np.radians(3000.0)).rate
    assert abs(answer.rate[0] - np.radians(3000.0)) < 4 * bound


@pytest.mark.parametrize("plain", ["noise", "field along the axis", "standing still", "half a turn"])
def test_what_cannot_be_known_is_nan(plain):
    rng = np.random.default_rng(8)
    amplitude = {"noise": 0.0, "field along the axis": 0.15}.get(plain, 30.0)
    rate = {"standing still": 0.0, "half a turn": 20.0}.get(plain, 4200.0)
    t = 0.01 * np.arange(128)
    phase = 0.3 - np.radians(rate) * t
    field = np.stack([5 + amplitude * np.cos(phase), amplitude * np.sin(phase), np.full(128, 45.0)], -1)
    samples = Samples(t, field + rng.normal(0, 0.6, field.shape))
    answer = likelihood_from_samples(samples, LikelihoodSettings(longest_window=1.28), fixed_axis=True)
    assert np.all(np.isnan(answer.rate))


def test_a_slow_spin_gets_a_longer_window():
    """50 deg/s: the standard window holds a sixth of a turn, the one that is taken more than one."""
    samples, _ = tone(np.random.default_rng(9), rate=50.0, window=20.0, decibels=34.0)
    answer = likelihood_from_samples(samples, fixed_axis=True)
    known = np.isfinite(answer.rate)
    assert np.mean(known) > 0.4
    error = answer.rate[known] - np.radians(50.0)
    assert np.sqrt(np.mean((error / answer.sd[known]) ** 2)) < 2.0
    assert np.degrees(np.max(np.abs(error))) < 2.0


@pytest.fixture(scope="module")
def thrown():
    spin = Spin()
    return spin, move(spin)


def test_the_phase_turns_at_the_rate_of_the_derivation(thrown):
    """Numerical derivative of the exact field's phase against -r + m_z (p m_x + q m_y)/m_perp^2: second differences."""
    spin, truth = thrown
    m = truth.attitude @ np.array(spin.magnetic_field)
    phase = np.unwrap(np.arctan2(m[:, 1], m[:, 0]))
    numerical = np.gradient(phase, truth.t)[5:-5]
    assert np.degrees(np.max(np.abs(numerical - phase_rate(m, truth.w)[5:-5]))) < 0.1
    departure = np.degrees(phase_rate(m, truth.w) + truth.w[:, 2])
    assert 5 < abs(np.mean(departure)) < 15


def test_nutation_leaves_only_a_term_of_second_order():
    """It swings the phase's rate by about its own size, but on average by 0.013 deg/s for 15, and four times for 30."""
    means = []
    for nutation in (15.0, 30.0):
        spin = Spin(
            duration=1.0, decay=1e9, decay_change=0.0, precession=(0.0, 0.0), precession_change=(0.0, 0.0),
            nutation=nutation, nutation_decay=1e9,
        )  # fmt: skip
        truth = move(spin, step=5e-4)
        false = np.degrees(phase_rate(truth.attitude @ np.asarray(spin.magnetic_field), truth.w) + truth.w[:, 2])
        assert np.std(false) > 0.9 * nutation
        # a Hann window: the ends of the stretch, cut anywhere in a swing, would count for more
        weight = np.hanning(false.size)
        means.append(np.sum(weight * false) / np.sum(weight))
    assert abs(means[0]) < 0.02
    assert means[1] / means[0] == pytest.approx(4.0, rel=0.1)


def test_a_gyroscope_removes_what_precession_does_to_the_phase(thrown):
    spin, truth = thrown
    faults = Faults(hard_iron=(11.0, 4.0, -15.0))
    recording, _ = record(spin, np.random.default_rng(10), faults, truth=truth)
    blind, _ = record(spin, np.random.default_rng(10), faults, truth=truth, sensors=("magnetometer",))
    corrected, plain = likelihood(recording), likelihood(blind)
    error = np.degrees(corrected.rate - truth.r(corrected.t))
    uncorrected = np.degrees(plain.rate - truth.r(plain.t))
    assert np.mean(np.abs(uncorrected)) > 5.0
    assert np.sqrt(np.mean(error**2)) < 1.2
    # windows of 1.28 s every 0.05 s: some four independent ones in the flight
    assert np.sqrt(np.mean((error / np.degrees(corrected.sd)) ** 2)) < 2.0
    # without a gyroscope the standard deviation contains what is not known
    assert np.sqrt(np.mean((uncorrected / np.degrees(plain.sd)) ** 2)) < 2.5


def test_the_field_strength_tells_the_hard_iron_along_z():
    amplitude = np.full(40, 29.0)
    axial = np.full(40, np.sqrt(49.6**2 - 29.0**2) - 13.0)
    found = axial_field(amplitude, axial, 49.6)
    assert found.offset == pytest.approx(-13.0, abs=0.3)
    # d offset = B dB / m_z with B known to a per cent
    assert found.sd == pytest.approx(0.496 * 49.6 / np.sqrt(49.6**2 - 29.0**2), rel=0.1)
    assert axial_field(amplitude, axial, None).sd > 3 * found.sd


def test_a_gap_in_the_gyroscope_is_not_bridged(thrown):
    spin, truth = thrown
    recording, _ = record(spin, np.random.default_rng(11), truth=truth, sensors=("gyroscope",))
    gyroscope = recording.need("gyroscope")
    keep = (gyroscope.t < 1.0) | (gyroscope.t > 1.5)
    rates, _ = transverse_rates(Samples(gyroscope.t[keep], gyroscope.value[keep]), np.arange(0.5, 2.0, 0.01))
    t = np.arange(0.5, 2.0, 0.01)[:-1]
    assert np.all(np.isnan(rates[(t > 1.02) & (t < 1.46)]))
    assert np.all(np.isfinite(rates[(t < 0.95) | (t > 1.55)]))


def test_settings_out_of_range_are_refused():
    with pytest.raises(InputError, match="window"):
        LikelihoodSettings(window=0.0)
    with pytest.raises(InputError, match="degree"):
        LikelihoodSettings(degree=7)
    with pytest.raises(InputError, match=r"expected \(n, 3\)"):
        likelihood_from_samples(Samples(np.arange(3.0), np.zeros((3, 2))))


def test_a_clipped_reading_is_not_used(thrown):
    spin, truth = thrown
    sheets = dict(MPU9250)
    recording, _ = record(spin, np.random.default_rng(12), truth=truth)
    field = recording.need("magnetometer").value.copy()
    field[100:110, 0] = sheets["magnetometer"].range
    answer = likelihood_from_samples(
        Samples(recording.need("magnetometer").t, field),
        sheet=sheets["magnetometer"],
        gyroscope=recording.need("gyroscope"),
        field=49.6,
    )
    error = np.degrees(answer.rate - truth.r(answer.t))
    assert np.sqrt(np.nanmean(error**2)) < 1.3


@pytest.mark.parametrize("precession", [True, False])
def test_windows_fitted_in_parts_are_those_of_the_whole(monkeypatch, precession):
    """A part's search begins some windows before it: from there on each starts as in the whole."""
    spin = Spin() if precession else without(Spin(), precession=False)
    recording, _ = record(spin, np.random.default_rng(12), sensors=("magnetometer", "gyroscope"))
    whole = likelihood(recording)
    monkeypatch.setattr("discsim.estimators.likelihood.TOGETHER", 20)
    parts = likelihood(recording)
    assert len(whole) > 60
    assert np.array_equal(np.isnan(parts.rate), np.isnan(whole.rate))
    # a fit ends within a ten-thousandth of a standard deviation
    np.testing.assert_allclose((parts.rate - whole.rate) / whole.sd, 0.0, atol=1e-3)
