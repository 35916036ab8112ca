"""Noise as it is: whitening, likelihood and estimates, against simulated noise and dense covariances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import multivariate_normal

from discsim.arrays import FloatArray
from discsim.validation.identification.linear import Channel, Linear
from discsim.validation.identification.noise import (
    GroupNoise,
    estimate_noise,
    likeliest_noise,
    log_likelihood,
    stated_noise,
    whitened,
)


def rows(*sizes: tuple[str, int], sd: float = 1.0, missing: tuple[int, ...] = ()) -> Linear:
    """A linearisation of no unknowns: channels (group, readings), of each the samples ``missing``."""
    channels, at, times = [], 0, []
    for k, (group, size) in enumerate(sizes):
        index = np.setdiff1d(np.arange(size), missing)
        channels.append(Channel(group, f"{k}", group, slice(at, at + index.size), index))
        times.append(index / 100.0)
        at += index.size
    none = np.empty((at, 0))
    return Linear(
        raw=np.zeros(at),
        own=none,
        segment=np.zeros(at, dtype=np.int64),
        whole=none,
        t=np.concatenate(times),
        sd=np.full(at, sd),
        channels=tuple(channels),
        defect=np.empty(0),
        defect_kind=np.empty(0, dtype=np.int64),
        defect_segment=np.empty(0, dtype=np.int64),
        sensitivities=np.zeros((1, 0, 0)),
        transitions=np.zeros((0, 0, 0)),
        matching=np.zeros((1, 0)),
        mismatch=np.zeros((0, 0)),
        shifts=np.zeros(at),
    )


def coloured(rng: np.random.Generator, n: int, sd: float, phi: float) -> FloatArray:
    drive = sd * np.sqrt(1.0 - phi**2) * rng.standard_normal(n)
    drive[0] /= np.sqrt(1.0 - phi**2)
    return np.asarray(lfilter([1.0], [1.0, -phi], drive))


@pytest.mark.parametrize("phi", [0.0, 0.4, 0.9])
def test_whitened_noise_is_white_with_unit_level(phi: float):
    rng, n = np.random.default_rng(1), 20000
    linear = rows(("gyroscope", n))
    white = whitened(linear, {"gyroscope": GroupNoise(0.3, phi)}, coloured(rng, n, 0.3, phi)[:, None])[:, 0]
    # four standard errors each
    assert np.var(white) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / n))
    for lag in (1, 2, 5):
        assert abs(np.mean(white[lag:] * white[:-lag])) < 4.0 / np.sqrt(n)


def test_whitening_reaches_over_missing_samples():
    """Neighbours that lie three samples apart have the cube of the correlation in common."""
    linear = rows(("gps", 6), missing=(2, 3))
    noise = {"gps": GroupNoise(0.5, 0.8)}
    index = linear.channels[0].index
    covariance = 0.25 * 0.8 ** np.abs(index[:, None] - index[None, :])
    W = whitened(linear, noise, np.eye(4))
    assert pytest.approx(np.eye(4), abs=1e-12) == W @ covariance @ W.T


@pytest.mark.parametrize("missing", [(), (2, 3), tuple(range(2, 60))])
def test_a_wander_under_white_noise_goes_on_where_samples_are_missing(missing):
    """A blind case without anything in it had an alarm: beyond a clipped stretch the wander passed for news."""
    linear = rows(("gyroscope", 70), missing=missing)
    own = GroupNoise(0.5, 0.95, 0.6)
    index = linear.channels[0].index
    covariance = 0.25 * (0.6 * 0.95 ** np.abs(index[:, None] - index[None, :]) + 0.4 * np.eye(index.size))
    W = whitened(linear, {"gyroscope": own}, np.eye(index.size))
    assert pytest.approx(np.eye(index.size), abs=1e-12) == W @ covariance @ W.T
    residual = np.random.default_rng(7).standard_normal(index.size)
    told = log_likelihood(linear, {"gyroscope": own}, residual)
    dense = -2.0 * multivariate_normal(cov=covariance).logpdf(residual)
    # less what readings that fit in the noise of the sheet have, 1 here
    assert told == pytest.approx(dense - index.size * (np.log(2.0 * np.pi) + 1.0), abs=1e-9)


def test_channels_do_not_leak_into_one_another():
    linear = rows(("gyroscope", 5), ("gyroscope", 5))
    W = whitened(linear, {"gyroscope": GroupNoise(1.0, 0.7)}, np.eye(10))
    assert not W[5:, :5].any()
    assert not W[:5, 5:].any()


def test_pieces_are_whitened_apart_where_they_are_asked_to_be():
    linear = rows(("gyroscope", 6))
    segment = np.array([0, 0, 0, 1, 1, 1])
    W = whitened(linear, {"gyroscope": GroupNoise(1.0, 0.7)}, np.eye(6), segment)
    assert not W[3:, :3].any()
    assert pytest.approx(W[:3, :3]) == W[3:, 3:]


def test_the_likelihood_is_that_of_the_dense_covariance():
    rng = np.random.default_rng(2)
    linear = rows(("gyroscope", 12), ("gps", 7), missing=(3,))
    noise = {"gyroscope": GroupNoise(0.3, 0.6), "gps": GroupNoise(2.0, 0.0)}
    e = rng.standard_normal(linear.raw.size)
    expected = 0.0
    for channel in linear.channels:
        sd, phi, *_ = noise[channel.group]
        apart = np.abs(channel.index[:, None] - channel.index[None, :])
        covariance = sd**2 * (phi**apart if phi else np.eye(channel.index.size))
        dense = multivariate_normal(np.zeros(channel.index.size), covariance)
        expected += -2.0 * float(dense.logpdf(e[channel.rows])) - channel.index.size * np.log(2.0 * np.pi)
        expected -= channel.index.size  # what readings that fit in the stated noise, of level 1 here, have
    assert log_likelihood(linear, noise, e) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("level", [0.003, 1.0, 40.0])
def test_readings_that_are_left_out_win_and_lose_nothing(level: float):
    """A lag leaves out those that it cannot know; in the sensor's own unit each would have a price of its own."""
    e = level * np.random.default_rng(4).standard_normal(2000)
    e *= level / np.std(e)
    noise = {"gyroscope": GroupNoise(level)}
    whole = log_likelihood(rows(("gyroscope", 2000), sd=level), noise, e)
    less = log_likelihood(rows(("gyroscope", 1500), sd=level), noise, e[500:])
    assert abs(whole - less) < 4.0 * np.sqrt(2.0 * 500)


@pytest.mark.parametrize("phi", [0.0, 0.3, 0.85])
def test_level_and_correlation_are_estimated_from_residuals(phi: float):
    rng, n = np.random.default_rng(3), 4000
    linears = [rows(("accelerometer", n), ("accelerometer", n)) for _ in range(2)]
    residuals = [np.concatenate([coloured(rng, n, 0.08, phi) for _ in range(2)]) for _ in linears]
    found = estimate_noise(linears, residuals)["accelerometer"]
    count = 4 * n
    # a sample correlation has variance (1 - phi^2)/n; a level's count shrinks by (1 - phi^2)/(1 + phi^2)
    assert found.correlation == pytest.approx(phi, abs=4.0 * np.sqrt((1.0 - phi**2) / count))
    assert found.sd == pytest.approx(0.08, rel=4.0 * np.sqrt((1.0 + phi**2) / (1.0 - phi**2) / (2.0 * count)))


def test_white_noise_is_never_given_a_correlation():
    linear = rows(("magnetometer", 300), ("magnetometer", 300), ("magnetometer", 300))
    for seed in range(200):
        e = np.random.default_rng(seed).standard_normal(900)
        # 3 standard errors of 0.033: one in 740 sequences, one-sided
        assert estimate_noise([linear], [e])["magnetometer"].correlation < 0.12
    found = [
        estimate_noise([linear], [np.random.default_rng(s).standard_normal(900)])["magnetometer"] for s in range(200)
    ]
    assert sum(noise.correlation > 0 for noise in found) <= 2


def test_fitted_parameters_take_their_share_of_the_level():
    linear = rows(("track", 100))
    plain = estimate_noise([linear], [np.ones(100)], coloured=False)["track"]
    spent = estimate_noise([linear], [np.ones(100)], coloured=False, spent=19.0)["track"]
    assert plain.sd == pytest.approx(1.0)
    assert spent.sd == pytest.approx(1.0 / np.sqrt(0.81))


def test_what_a_sheet_states_is_the_first_guess_and_something_stands_in_where_it_is_silent():
    assert stated_noise([rows(("gyroscope", 5), sd=0.7)])["gyroscope"] == GroupNoise(0.7)
    silent = stated_noise([rows(("gyroscope", 5), sd=np.nan)])["gyroscope"]
    assert np.isfinite(silent.sd)
    assert silent.sd > 0


@pytest.mark.parametrize(("group", "swallowed"), [("accelerometer", False), ("gps.position", True)])
def test_a_constant_in_readings_that_lie_far_apart_is_noise_of_a_receiver_alone(group: str, swallowed: bool):
    """Two hundred means over turns, 0.15 s apart, would remember for 30 s, as a receiver's position does."""
    linear = rows(*[(group, 60)] * 3)
    linear = replace(linear, t=15.0 * linear.t)
    residual = np.repeat([20.0, -30.0, 15.0], 60) + np.random.default_rng(5).standard_normal(180)
    for noise in (first := estimate_noise([linear], [residual]), likeliest_noise([linear], [residual], first)):
        assert (noise[group].memory(0.15) > 2.01) is swallowed


def slow(seed: int, memory: float) -> tuple[Linear, FloatArray]:
    """Three axes of 30 s: white noise of 0.6 and, over so many samples, noise of 0.8."""
    rng, phi = np.random.default_rng(seed), float(np.exp(-1.0 / memory))
    axes = [0.6 * rng.standard_normal(3000) + coloured(rng, 3000, 0.8, phi) for _ in range(3)]
    return rows(*[("gyroscope", 3000)] * 3), np.concatenate(axes)


def likeliest(linear: Linear, residual: FloatArray) -> GroupNoise:
    return likeliest_noise([linear], [residual], estimate_noise([linear], [residual]))["gyroscope"]


@pytest.mark.parametrize("memory", [20.0, 50.0, 150.0])
def test_slow_noise_under_white_noise_is_told_by_its_likelihood(memory: float):
    found = [likeliest(*slow(seed, memory)) for seed in range(12)]
    memories = -1.0 / np.log([noise.correlation for noise in found])
    # the mean of twelve, each with the scatter of 90 s of noise that is over after some samples
    scatter = memory * np.sqrt(2.0 * memory / 9000.0) * 4.0 / np.sqrt(len(found))
    assert np.mean(memories) == pytest.approx(memory, abs=max(scatter, 0.05 * memory))
    assert np.mean([noise.share for noise in found]) == pytest.approx(0.64, abs=0.03)
    assert np.mean([noise.sd for noise in found]) == pytest.approx(1.0, abs=0.05)


def test_noise_that_seems_all_slow_may_have_a_white_part():
    """A first look has all of it correlated, by the first lag alone: a likelihood with one number more tells."""
    linear, residual = slow(3, 12.0)
    model = {"gyroscope": GroupNoise(1.0, 0.6)}
    found = likeliest_noise([linear], [residual], model)["gyroscope"]
    assert found.share == pytest.approx(0.64, abs=0.05)
    whole = coloured(np.random.default_rng(4), 9000, 1.0, 0.6)
    assert likeliest_noise([rows(("gyroscope", 9000))], [whole], model)["gyroscope"].share == 1.0


def test_a_constant_gains_no_more_than_chance_in_slow_noise():
    """Three numbers that are not there gain what chi-squared of three degrees of freedom does."""
    gains = []
    for seed in range(24):
        linear, residual = slow(seed, 150.0)
        level = np.concatenate([axis - np.mean(axis) for axis in np.split(residual, 3)])
        with_it, without = (log_likelihood(linear, {"gyroscope": likeliest(linear, e)}, e) for e in (level, residual))
        gains.append(without - with_it)
    assert np.mean(gains) == pytest.approx(3.0, abs=4.0 * np.sqrt(6.0 / len(gains)))
    assert max(gains) < 16.3  # one in a thousand


def test_what_is_far_beyond_the_stated_noise_is_not_made_the_likeliest_noise():
    linear = rows(("gyroscope", 2000), sd=0.01)
    residual = coloured(np.random.default_rng(5), 2000, 1.0, 0.95)
    model = estimate_noise([linear], [residual])
    assert likeliest_noise([linear], [residual], model) == model
