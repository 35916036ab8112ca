"""The paper's magnetometer estimator against spins whose rate is known in closed form."""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from discsim.errors import InputError
from discsim.recording import Samples, read_recording
from estimators import FftSettings, fft

BIN_DEG_S = 360 * 100 / 128  # sampling rate over window, the width of a line
GRID_DEG_S = 360 * 100 / 2**14  # (PE1)


def field(phase, rng=None, noise=0.6, offset=(0.0, 0.0), amplitude=30.0):
    """A magnetometer's samples, uT, of a field that turns by ``phase`` (rad)."""
    x, y = amplitude * np.cos(phase) + offset[0], -amplitude * np.sin(phase) + offset[1]
    value = np.stack([x, y, np.full(phase.size, 39.0)], axis=1)
    if rng is not None:
        value = np.round((value + rng.normal(0.0, noise, value.shape)) / 0.15) * 0.15
    return value


def steady(rate_deg_s, duration=3.0, phase=0.3, rng=None, **options):
    t = np.arange(round(100 * duration)) / 100
    return Samples(t, field(phase + np.radians(rate_deg_s) * t, rng, **options))


def naive(x, n, k, rate_hz, threshold_deg_s):
    """(P-3) to (P-6) for one window, word by word."""
    padded = np.concatenate([x, np.zeros(k)])
    amplitude = np.abs(np.fft.fft(padded))
    frequency = np.arange(n + k) * rate_hz / (n + k)
    amplitude[(frequency * 360 < threshold_deg_s) | (frequency > rate_hz / 2)] = 0
    return frequency[np.argmax(amplitude)] * 360


@settings(deadline=None, max_examples=25)
@given(rate=st.floats(900.0, 8000.0), phase=st.floats(0.0, 6.28), seed=st.integers(0, 1000))
def test_each_value_is_the_papers_procedure_on_its_window(rate, phase, seed):
    """Rounding to the grid hides only round-off, hence 1e-9 relative."""
    samples = steady(rate, 1.4, phase, np.random.default_rng(seed))
    estimate = fft(samples)
    for index in (0, 5, 12):
        window = samples.value[index : index + 128, :2]
        x = window[:, np.argmax(np.var(window, axis=0))]
        assert np.degrees(estimate.rate[index]) == pytest.approx(naive(x, 128, 2**14 - 128, 100.0, 500.0), rel=1e-9)


def papers_transform(samples, chosen):
    """Peaks (P-3) to (P-5) of all windows by whole padded transforms, and where they are lines of their own."""
    n, total, h = chosen.window, chosen.window + chosen.pad, samples.interval
    block = np.lib.stride_tricks.sliding_window_view(samples.value[:, :2], n, axis=0)
    axis = np.argmax(np.var(block, axis=2), axis=1)
    x = block[np.arange(axis.size), axis]
    still = np.abs(np.fft.rfft(x - x.mean(axis=1, keepdims=True), total, axis=1))
    amplitude = still if chosen.remove_mean else np.abs(np.fft.rfft(x, total, axis=1))
    lowest = int(np.ceil(chosen.threshold * total * h / (2 * np.pi)))
    peak = lowest + np.argmax(amplitude[:, lowest:], axis=1)
    own = (peak > lowest) & (peak < total // 2)
    own &= still[np.arange(axis.size), peak] > np.max(still[:, :lowest], axis=1)
    return 2 * np.pi * peak / (total * h), own


@pytest.mark.parametrize("remove_mean", [False, True])
@pytest.mark.parametrize("pad", [0, 372, 2**14 - 128])
@pytest.mark.parametrize(("offset", "noise"), [(0.0, 0.6), (40.0, 0.1), (100.0, 0.6), (5.0, 10.0)])
def test_every_window_gives_what_the_whole_padded_transform_gives(offset, noise, pad, remove_mean):
    """From below the threshold to near half the sampling rate: no value differs by more than rounding (1e-12), none
    is given where a line of its own is lacking, and all are where it stands far out of the noise and leakage."""
    t = np.arange(1500) / 100
    phase = np.radians(200.0 * t + 500.0 * t**2)
    value = field(phase, offset=(offset, -offset))
    samples = Samples(t, value + np.random.default_rng(3).normal(0, noise, value.shape))
    chosen = FftSettings(pad=pad, remove_mean=remove_mean)
    found, (expected, own) = fft(samples, chosen), papers_transform(samples, chosen)
    known = np.isfinite(found.rate)
    np.testing.assert_allclose(found.rate[known], expected[known], rtol=1e-12)
    assert not known[~own].any()
    assert known.any()
    if noise < 1 and offset < 100:
        assert known[own].mean() > 0.95


@settings(deadline=None, max_examples=25)
@given(rate=st.floats(900.0, 8000.0), seed=st.integers(0, 1000))
def test_every_rate_stands_on_the_grid_of_the_padded_spectrum(rate, seed):
    estimate = fft(steady(rate, 1.5, rng=np.random.default_rng(seed)))
    orders = np.degrees(estimate.rate) / GRID_DEG_S
    np.testing.assert_allclose(orders, np.round(orders), atol=1e-6)


def test_the_sampling_rate_is_that_of_the_time_stamps():
    """A clock 3 % fast: the same samples stamped 3 % closer turn 3 % faster, whatever a sheet says."""
    samples = steady(3000.0)
    fast = Samples(samples.t / 1.03, samples.value)
    np.testing.assert_allclose(fft(fast).rate, 1.03 * fft(samples).rate, rtol=1e-9)


@pytest.mark.parametrize("decibels", [20, 30, 40, 50])
@pytest.mark.parametrize("rate", [550, 800, 1500, 3000, 5000, 7000])
def test_the_standard_deviation_matches_the_scatter(rate, decibels):
    """Over phases, rates and noise: normalised errors of unit size within a factor of two either way."""
    rng = np.random.default_rng([rate, decibels])
    noise = 30.0 / np.sqrt(2) / 10 ** (decibels / 20)
    ratios = []
    for _ in range(25):
        truth = rate * rng.uniform(0.97, 1.03)
        t = np.arange(170) / 100
        value = field(rng.uniform(0, 2 * np.pi) + np.radians(truth) * t)
        estimate = fft(Samples(t, value + rng.normal(0, noise, value.shape)), FftSettings(step=7))
        known = np.isfinite(estimate.rate)
        assert known.mean() > 0.9
        ratios += list((estimate.rate[known] - np.radians(truth)) / estimate.sd[known])
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 2.0


@pytest.mark.parametrize(("offset", "rate"), [(30.0, 1000), (30.0, 4000), (100.0, 2000), (100.0, 6000)])
def test_the_standard_deviation_holds_the_leakage_of_a_hard_iron(offset, rate):
    rng = np.random.default_rng(rate)
    ratios = []
    for _ in range(25):
        truth = rate * rng.uniform(0.97, 1.03)
        samples = steady(truth, 1.7, rng.uniform(0, 6.28), rng, offset=(offset, offset))
        estimate = fft(samples, FftSettings(step=7))
        known = np.isfinite(estimate.rate)
        ratios += list((np.degrees(estimate.rate[known]) - truth) / np.degrees(estimate.sd[known]))
    assert len(ratios) > 50
    assert 0.5 < np.sqrt(np.mean(np.square(ratios))) < 2.0


@settings(deadline=None, max_examples=25)
@given(rate=st.floats(3000.0, 8000.0), iron=st.floats(-20.0, 20.0), phase=st.floats(0.0, 6.28))
def test_a_hard_iron_moves_a_fast_spin_by_no_more_than_its_leakage(rate, iron, phase):
    """To first order 3 / pi^2 (2 B / A) / x0 bins with x0 turns in the window, a tenth more for the second order,
    and a grid step between two roundings."""
    with_iron, without = (fft(steady(rate, 1.35, phase, offset=(b, b))).rate for b in (iron, 0.0))
    turns = rate / BIN_DEG_S
    bound = 3 / np.pi**2 * (2 * abs(iron) / 30.0) / turns * BIN_DEG_S
    assert np.max(np.abs(np.degrees(with_iron - without))) <= 1.1 * bound + GRID_DEG_S * 1.001


def test_without_its_mean_a_hard_iron_does_not_matter():
    """Only the grid's step and the leakage common to both are left; the transform is linear to round-off."""
    chosen = FftSettings(remove_mean=True)
    shifted, bare = fft(steady(1500.0, offset=(200.0, -150.0)), chosen), fft(steady(1500.0), chosen)
    np.testing.assert_allclose(shifted.rate, bare.rate, atol=np.radians(GRID_DEG_S) * 1.001)


def test_the_paper_distorts_a_static_rate_by_leakage_of_the_negative_frequency():
    """The Remark of Section 3: a ripple at a static rate. Its size without noise is that of the formula in `_leakage`:
    3 / pi^2 / (2 x0) bins at most, plus half a grid step."""
    estimate = fft(steady(1000.0, 8.0))
    error = np.degrees(estimate.rate) - 1000.0
    bound = 3 / np.pi**2 / (2 * 1000 / BIN_DEG_S) * BIN_DEG_S
    assert 0.3 * bound < np.max(np.abs(error)) < 1.3 * bound + GRID_DEG_S / 2


@pytest.mark.parametrize("iron", [0.0, 100.0])
@pytest.mark.parametrize("rate", [0, 20, 100, 150, 300, 400, 450, 490])
def test_below_the_threshold_nothing_is_given(rate, iron):
    """Side lobes of a slow line are local maxima above the threshold; they are no rates."""
    estimate = fft(steady(rate, 20.0, rng=np.random.default_rng(rate), offset=(iron, -iron)), FftSettings(step=5))
    assert not np.isfinite(estimate.rate).any()
    assert not np.isfinite(estimate.sd).any()


@pytest.mark.parametrize("level", [0.1, 0.01])
def test_white_noise_passes_for_a_line_as_often_as_stated(level):
    """4000 independent windows; a factor of 1.6 is more than three standard deviations at 0.01."""
    rng = np.random.default_rng(7)
    t = np.arange(4000 * 128) / 100
    chosen = FftSettings(step=128, pad=1024 - 128, false_alarm=level)
    known = np.isfinite(fft(Samples(t, rng.normal(0, 0.6, (t.size, 3))), chosen).rate).mean()
    assert level / 1.6 < known < level * 1.6


def test_a_gap_of_more_than_half_a_sample_silences_the_windows_that_hold_it():
    samples = steady(3000.0)
    for gap, silent in ((0.004, False), (0.006, True)):
        t = samples.t + gap * (samples.t > 1.495)
        estimate = fft(Samples(t, samples.value))
        across = (np.arange(len(estimate)) <= 149) & (np.arange(len(estimate)) + 127 >= 150)
        assert np.isnan(estimate.rate[across & (np.abs(np.arange(len(estimate)) - 86) < 30)]).all() == silent
        assert np.isfinite(estimate.rate[~across]).all()


def test_a_missing_sample_silences_the_windows_that_hold_it():
    samples = steady(3000.0)
    value = samples.value.copy()
    value[150, 0] = np.nan
    estimate = fft(Samples(samples.t, value))
    starts = np.arange(len(estimate))
    np.testing.assert_array_equal(np.isnan(estimate.rate), (starts <= 150) & (starts + 127 >= 150))


def test_the_axis_with_the_larger_variance_is_taken():
    """y turns at 3000 deg/s with 30 uT, x at 5000 deg/s with 10 uT."""
    samples = steady(3000.0)
    value = samples.value.copy()
    value[:, 0] = 10 * np.cos(np.radians(5000.0) * samples.t)
    np.testing.assert_allclose(np.degrees(fft(Samples(samples.t, value)).rate), 3000.0, atol=5.0)


def test_the_centred_stamp_follows_a_ramp_and_the_unshifted_one_lags_by_half_a_window():
    """Fig. 7's delay: 200 deg/s^2 over half of 127 samples is 127 deg/s. What is left is the leakage of the negative
    frequency, 3 / pi^2 / (2 x0) bins at most (6.0 deg/s at the slow end, 2000 deg/s), and half a grid step."""
    leakage = 3 / np.pi**2 / (2 * 2000 / BIN_DEG_S) * BIN_DEG_S
    t = np.arange(1000) / 100
    samples = Samples(t, field(np.radians(2000.0 * t + 100.0 * t**2)))
    for stamp, lag in (("centre", 0.0), ("unshifted", 127.0)):
        estimate = fft(samples, FftSettings(stamp=stamp))
        error = np.degrees(estimate.rate) - (2000.0 + 200.0 * estimate.t)
        np.testing.assert_allclose(error, -lag, atol=leakage + GRID_DEG_S / 2)


def test_where_the_acceleration_changes_inside_a_window_the_standard_deviation_says_so():
    """At a knot of slope the peak is off by 0.094 of the change of slope times the window (closed form of least
    squares): 48 deg/s at 400 deg/s^2."""
    t = np.arange(1200) / 100
    rate = 2000.0 + 400.0 * np.clip(t - 6, 0, None)
    phase = np.radians(2000.0 * t + 200.0 * np.clip(t - 6, 0, None) ** 2)
    estimate = fft(Samples(t, field(phase, np.random.default_rng(1))))
    error = np.degrees(estimate.rate) - np.interp(estimate.t, t, rate)
    knot = np.argmin(np.abs(estimate.t - 6))
    assert error[knot] == pytest.approx(0.094 * 400 * 1.28, abs=6.0)
    assert np.max(np.abs(error / np.degrees(estimate.sd))) < 3.5


def test_the_sign_of_spin_is_not_seen():
    np.testing.assert_allclose(fft(steady(-3000.0, phase=0.0)).rate, fft(steady(3000.0, phase=0.0)).rate)
    assert not fft(steady(3000.0)).signed


def test_a_recording_shorter_than_a_window_is_refused_with_the_length_needed():
    with pytest.raises(InputError, match=r"100 samples \(1.00 s\); a window needs 128 samples \(1.28 s\)"):
        fft(steady(3000.0, 1.0))


def test_a_threshold_beyond_half_the_sampling_rate_is_refused():
    with pytest.raises(InputError, match="18000 deg/s"):
        fft(steady(3000.0), FftSettings(threshold=np.radians(20000.0)))


@pytest.mark.parametrize(
    "wrong",
    [{"window": 2}, {"pad": -1}, {"step": 0}, {"threshold": 0.0}, {"stamp": "middle"}, {"false_alarm": 0.0}],
)
def test_settings_without_sense_are_refused(wrong):
    with pytest.raises(InputError, match="expected"):
        FftSettings(**wrong)


def test_an_hour_takes_little_more_memory_than_its_samples():
    """360 000 samples, 11.5 MB, every 60th window; the answer and its arithmetic take as much again. All spectra at
    once would be 790 MB."""
    samples = steady(3000.0, 3600.0)
    fft(Samples(samples.t[:200], samples.value[:200]))  # compiled, and its tables made
    tracemalloc.start()
    fft(samples, FftSettings(step=60))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 25e6


def test_a_rate_table_is_followed_within_the_stated_deviation():
    """A measured run with the table's own read-out as truth, where its rate was steady over the window."""
    root = Path(os.environ.get("DISCSIM_RECORDINGS", Path(__file__).parents[3] / "shared" / "recordings"))
    folder = root / "practice" / "table-b" / "01"
    if not folder.is_dir():
        pytest.skip("no recordings: set DISCSIM_RECORDINGS to the folder that holds practice/table-b")
    recording = read_recording(folder)
    reference = recording.need("rate_reference")
    estimate = fft(recording.need("magnetometer"), FftSettings(step=8))
    around = [np.interp(estimate.t + shift, reference.t, reference.value) for shift in (-0.7, -0.35, 0.0, 0.35, 0.7)]
    steady_rate = (np.ptp(around, axis=0) < 0.01) & (around[2] > np.radians(900))
    known = np.isfinite(estimate.rate)
    assert known[steady_rate].all()
    ratio = ((estimate.rate - around[2]) / estimate.sd)[steady_rate]
    assert 0.5 < np.sqrt(np.mean(ratio**2)) < 2.0
    assert not known[np.max(around, axis=0) < np.radians(400)].any()
