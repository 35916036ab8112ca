"""Noise as it is: level and first-order correlation of each sensor from residuals, and the whitening that follows.

Takes residuals; gives a `NoiseModel` and whitened rows (Cochrane and Orcutt, 1949). Each group (a sensor; gps.position
and gps.velocity apart) has one level and one correlation for all its axes and recordings. What a sheet states is a
first guess and a thing to compare with.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import OptimizeResult, minimize
from scipy.special import expit, logit

from discsim.arrays import FloatArray, IntArray, sd_by_median
from discsim.compiled import compiled_nogil
from discsim.validation.identification.linear import Channel, Linear

__all__ = ["GroupNoise", "NoiseModel", "chi_squared", "estimate_noise", "likeliest_noise", "log_likelihood", "whitened"]

#: correlations from one sample to the next that are tried; slower noise than the last is not taken for noise
CORRELATIONS = np.concatenate([np.linspace(0.05, 0.9, 18), 1.0 - np.geomspace(0.08, 0.005, 9)])
#: lags (samples) at which noise is looked at
LAGS = np.unique(np.geomspace(1, 100, 16).astype(int))
#: the slowest noise, s: what is slower is not taken for noise
_SLOWEST = 2.0
#: correlation this weak is taken for none
LEAST_CORRELATED = 0.04


class GroupNoise(NamedTuple):
    """Level (in the sensor's unit), correlation from one sample to the next, share of the variance that has it.

    The rest of the variance is white, as where a slow wander lies under the noise of single readings. A level that is
    ``relative`` is a multiple of what is stated of each reading.
    """

    sd: float
    correlation: float = 0.0
    share: float = 1.0
    relative: bool = False

    def memory(self, interval: float) -> float:
        """Return the time constant of the correlated part, s, of samples that lie ``interval`` s apart."""
        return -interval / float(np.log(self.correlation)) if self.correlation > 0.0 else 0.0


NoiseModel = Mapping[str, GroupNoise]


def whitened(linear: Linear, noise: NoiseModel, columns: FloatArray, segment: IntArray | None = None) -> FloatArray:
    """Return columns (n, c) with rows divided by the noise and freed of its correlation.

    With ``segment`` (n,) rows of different segments stay apart: the first of a segment keeps its correlated part.
    Rows of no channel become zero.
    """
    result = np.zeros_like(columns)
    for channel in linear.channels:
        segments = None if segment is None else segment[channel.rows]
        result[channel.rows] = whitened_channel(linear, noise, channel, columns[channel.rows], segments)
    return result


def whitened_channel(
    linear: Linear, noise: NoiseModel, channel: Channel, rows: FloatArray, segment: IntArray | None = None
) -> FloatArray:
    """Return what `whitened` makes of the rows (m, c) of one channel, with the segment (m,) of each."""
    own = noise[channel.group]
    x = rows / own.sd
    if own.relative:
        x /= linear.sd[channel.rows, None]
    if not own.correlation or x.shape[0] < 2:
        return np.asarray(x)
    cuts = np.empty(0, dtype=np.int64) if segment is None else np.flatnonzero(np.diff(segment) != 0) + 1
    if own.share >= 1.0:
        # rows follow the one before them alone: all at once, and the first of each segment as it was
        first = x[cuts]
        x = _freed(x, own, channel.index)
        x[cuts] = first
        return x
    for start, stop in pairwise([0, *cuts, x.shape[0]]):
        x[start:stop] = _freed(x[start:stop], own, channel.index[start:stop])
    return x


def _freed(x: FloatArray, noise: GroupNoise, index: IntArray) -> FloatArray:
    """Return rows (n, c) of unit level freed of their correlation; ``index`` tells where samples are missing."""
    phi = noise.correlation
    if noise.share >= 1.0:
        gap = phi ** np.diff(index)[:, None].astype(float)
        x[1:] = (x[1:] - gap * x[:-1]) / np.sqrt(1.0 - gap**2)
        return x
    freed = np.array(x, dtype=float)
    _innovations(freed, index, phi, noise.share)
    return freed


@compiled_nogil
def _innovations(x: FloatArray, index: IntArray, phi: float, share: float) -> float:
    """Put into rows (n, c) of unit level what each adds to those before it, in its spread; return log determinant.

    By a Kalman filter of a wander of variance ``share`` with the correlation ``phi`` under white noise (A. Harvey,
    Forecasting, Structural Time Series Models and the Kalman Filter, 1989, 3.4). Where samples are missing, which
    ``index`` tells, the wander goes on and is known the less: what it does meanwhile would be taken for something new,
    reading after reading.
    """
    known = np.zeros(x.shape[1])
    variance, total = share, 0.0
    for n in range(x.shape[0]):
        if n > 0:
            kept = phi ** (index[n] - index[n - 1])
            known *= kept
            variance = kept * kept * variance + share * (1.0 - kept * kept)
        spread = variance + 1.0 - share
        gain = variance / spread
        for k in range(x.shape[1]):
            new = x[n, k] - known[k]
            known[k] += gain * new
            x[n, k] = new / np.sqrt(spread)
        variance *= 1.0 - gain
        total += np.log(spread)
    return float(total)


def chi_squared(linear: Linear, noise: NoiseModel, residual: FloatArray) -> float:
    """Return the chi-squared of residuals (n,) in a noise, its correlation included."""
    white = whitened(linear, noise, residual[:, None])[:, 0]
    return float(white @ white)


def log_likelihood(linear: Linear, noise: NoiseModel, residual: FloatArray) -> float:
    """Return -2 log likelihood of residuals (n,), less what readings that fit in the stated noise have.

    So a reading that one hypothesis leaves out, as those are in which a lag remembers what nobody recorded, neither
    wins nor loses.
    """
    levels = (_level(linear, noise[channel.group], channel, channel.index.size) for channel in linear.channels)
    return chi_squared(linear, noise, residual) + sum(levels)


def log_likelihood_of_first(
    linear: Linear, noise: NoiseModel, residual: FloatArray, counts: Mapping[tuple[str, str], int]
) -> float:
    """Return what of `log_likelihood` the first so many readings are, by sensor and axis."""
    white = whitened(linear, noise, residual[:, None])[:, 0]
    total = 0.0
    for channel in linear.channels:
        first = counts.get((channel.sensor, channel.axis), 0)
        total += float(np.sum(white[channel.rows][:first] ** 2)) + _level(linear, noise[channel.group], channel, first)
    return total


def _level(linear: Linear, noise: GroupNoise, channel: Channel, count: int) -> float:
    """Return -2 log likelihood of the first ``count`` readings of a channel, but for their chi-squared."""
    stated = float(linear.sd[channel.rows][0])
    usual = stated if np.isfinite(stated) and stated > 0.0 else DEFAULT[channel.group]
    level = count * (2.0 * float(np.log(noise.sd / usual)) - 1.0)
    return level + (_log_determinant(noise, channel.index[:count]) if noise.correlation and count else 0.0)


def estimate_noise(
    linears: Sequence[Linear], residuals: Sequence[FloatArray], *, coloured: bool = True, spent: float = 0.0
) -> dict[str, GroupNoise]:
    """Return level and correlation of each group from residuals, one (n,) per linearisation.

    ``spent`` is how many parameters the residuals were fitted with; it is shared out over the groups by their size.
    """
    squares: dict[str, float] = {}
    counts: dict[str, int] = {}
    products: dict[str, FloatArray] = {}
    pairs: dict[str, FloatArray] = {}
    spacing: dict[str, float] = {}
    for linear, residual in zip(linears, residuals, strict=True):
        for channel in linear.channels:
            x = residual[channel.rows]
            group = channel.group
            spacing[group] = min(spacing.get(group, np.inf), _spacing(linear, channel))
            squares[group] = squares.get(group, 0.0) + float(x @ x)
            counts[group] = counts.get(group, 0) + x.size
            at_lags = products.setdefault(group, np.zeros(LAGS.size))
            numbers = pairs.setdefault(group, np.zeros(LAGS.size))
            for k, lag in enumerate(LAGS):
                if x.size > 2 * lag:
                    apart = channel.index[lag:] - channel.index[:-lag] == lag
                    at_lags[k] += float(x[:-lag][apart] @ x[lag:][apart])
                    numbers[k] += np.count_nonzero(apart)
    total = sum(counts.values())
    share = max(1.0 - spent / total, 0.1) if total else 1.0
    model = {}
    for group, n in counts.items():
        sd = max(float(np.sqrt(squares[group] / (n * share))), 1e-12)
        phi, part = 0.0, 1.0
        if coloured and squares[group] > 0:
            rho = products[group] / np.maximum(pairs[group], 1.0) / (squares[group] / n)
            phi, part = _correlation(rho, pairs[group], _slowest(group, spacing[group], linears))
        model[group] = GroupNoise(sd, phi, part)
    return model


def _correlation(rho: FloatArray, pairs: FloatArray, slowest: float) -> tuple[float, float]:
    """Return correlation and share of noise from its autocorrelations (k,) at the lags; (0, 1) where it is white.

    ``slowest`` is its longest memory in samples.
    """
    some = pairs > 20
    lags, rho, weight = LAGS[some], rho[some], pairs[some]
    if lags.size == 0 or lags[0] != 1:
        return 0.0, 1.0
    error = 1.0 / np.sqrt(weight)
    best, fit = (0.0, 1.0), float(np.sum((rho / error) ** 2))
    white = fit
    most = float(np.exp(-1.0 / slowest))
    for phi in CORRELATIONS[CORRELATIONS <= most]:
        shape = phi ** lags.astype(float)
        part = float(np.clip(np.sum(rho * shape / error**2) / np.sum((shape / error) ** 2), 0.0, 1.0))
        left = float(np.sum(((rho - part * shape) / error) ** 2))
        if left < fit:
            best, fit = (float(phi), part), left
    # two numbers for colour must pay, and be large enough to matter
    phi, part = best
    if white - fit < 20.0 or phi * part < LEAST_CORRELATED * max(1.0, 1.0 - phi) * 0.25:
        return 0.0, 1.0
    # first lag alone when all of the noise has it: exact where the grid is coarse
    if part > 0.9 and 0.0 < rho[0] < CORRELATIONS[-1]:
        return min(float(rho[0]), most), 1.0
    return phi, part


def _spacing(linear: Linear, channel: Channel) -> float:
    """Return the ordinary spacing of a channel's readings, s; without end where there are none."""
    return float(np.median(np.diff(linear.t[channel.rows]))) if channel.index.size > 1 else np.inf


def _slowest(group: str, spacing: float, linears: Sequence[Linear]) -> float:
    """Return the longest memory of a group's noise in samples, which lie ``spacing`` s apart.

    Of a receiver 200 samples at least: its position wanders for minutes with satellites and atmosphere. So do readings
    whose instants were counted, about a motion that follows miscounted ones. In means over turns so many would outlast
    the recording, and swallow every constant error.
    """
    wanders = group.startswith("gps") or any(linear.counted for linear in linears)
    return max(_SLOWEST / spacing, -1.0 / float(np.log(CORRELATIONS[-1])) if wanders else 1.0)


#: residuals this many times the stated noise are not noise: what they are likeliest with says nothing
_NOT_NOISE = 5.0


def likeliest_noise(linears: Sequence[Linear], residuals: Sequence[FloatArray], model: NoiseModel) -> NoiseModel:
    """Return noise whose correlated groups have the level, correlation and share that residuals are likeliest with.

    Autocorrelations at a few lags give these roughly where noise is slow beside a recording. What they lack would be
    won by whatever changes the residuals a little, and taken for evidence of it.
    """
    found = dict(model)
    usual = stated_noise(linears)
    for group, own in model.items():
        if not own.correlation or own.sd > _NOT_NOISE * usual[group].sd:
            continue
        parts = [
            (residual[channel.rows], channel.index)
            for linear, residual in zip(linears, residuals, strict=True)
            for channel in linear.channels
            if channel.group == group
        ]
        count = sum(x.size for x, _ in parts)
        spacing = min(
            (_spacing(linear, channel) for linear in linears for channel in linear.channels if channel.group == group),
            default=np.inf,
        )
        slowest = _slowest(group, spacing, linears)
        found[group] = _likeliest(parts, count, own, slowest)
    return found


#: share of a variance that a search for the correlated part starts from, where a first look took all of it to be so
_PART = 0.9


def _likeliest(parts: Sequence[tuple[FloatArray, IntArray]], count: int, own: GroupNoise, slowest: float) -> GroupNoise:
    """Return the noise of one group that its residuals (n,), each with the numbers of its samples, are likeliest with.

    ``slowest`` is its longest memory in samples. The level keeps its correction for what was fitted. Where all of it
    seems correlated a white part beside it is tried, too: it stands for one number more (Schwarz, 1978).
    """
    squares = sum(float(x @ x) for x, _ in parts)
    corrected = own.sd**2 * count / squares if squares > 0 else 1.0

    def noise(at: FloatArray) -> GroupNoise:
        correlation = float(np.exp(-np.exp(-min(at[0], np.log(slowest)))))
        return GroupNoise(1.0, correlation, 1.0 if at.size == 1 else float(expit(at[1])))

    def cost(at: FloatArray) -> tuple[float, float]:
        trial = noise(at)
        total = determinant = 0.0
        for x, index in parts:
            if x.size == 0:
                continue
            white = _freed(x[:, None].copy(), trial, index)
            total += float(np.sum(white**2))
            determinant += _log_determinant(trial, index)
        variance = max(total / count, 1e-300)
        return count * float(np.log(variance)) + determinant, variance

    def badness(at: FloatArray) -> float:
        return cost(at)[0]

    def improved(first: list[float]) -> OptimizeResult:
        return minimize(
            badness, np.array(first), method="Nelder-Mead", options={"xatol": 0.01, "fatol": 0.05, "maxfev": 50}
        )

    memory = float(-np.log(-np.log(own.correlation)))
    whole = own.share >= 1.0
    first = [memory] if whole else [memory, float(logit(np.clip(own.share, 1e-4, 1.0 - 1e-4)))]
    best, least = improved(first), cost(np.array(first))[0]
    if whole:
        mixed = improved([memory, float(logit(_PART))])
        if mixed.fun + np.log(count) < min(best.fun, least):
            best = mixed
    if not best.fun < least:
        return own
    return noise(best.x)._replace(sd=float(np.sqrt(cost(best.x)[1] * corrected)))


def _log_determinant(noise: GroupNoise, index: IntArray) -> float:
    """Return twice the log determinant of the whitening of one channel of unit level, less its sign."""
    if noise.share >= 1.0:
        return float(np.sum(np.log1p(-(noise.correlation ** (2.0 * np.diff(index))))))
    return float(_innovations(np.zeros((index.size, 0)), index, noise.correlation, noise.share))


def robust_noise(linears: Sequence[Linear], residuals: Sequence[FloatArray]) -> dict[str, GroupNoise]:
    """Return white noise by the median of the residuals' sizes: what a short event does not raise."""
    sizes: dict[str, list[FloatArray]] = {}
    for linear, residual in zip(linears, residuals, strict=True):
        for channel in linear.channels:
            sizes.setdefault(channel.group, []).append(residual[channel.rows])
    return {group: GroupNoise(max(float(sd_by_median(np.concatenate(found))), 1e-12)) for group, found in sizes.items()}


def stated_noise(linears: Sequence[Linear], floor: Mapping[str, float] | None = None) -> dict[str, GroupNoise]:
    """Return what the sheets state, white; a group without a statement takes ``floor``."""
    model: dict[str, GroupNoise] = {}
    for linear in linears:
        for channel in linear.channels:
            sd = float(linear.sd[channel.rows][0])
            if not np.isfinite(sd) or sd <= 0:
                sd = (floor or {}).get(channel.group, DEFAULT[channel.group])
            model[channel.group] = GroupNoise(max(sd, model.get(channel.group, GroupNoise(0.0)).sd))
    return model


#: noise of a sensor whose sheet says nothing, for the first pass only
DEFAULT = {
    "magnetometer": 0.6,
    "accelerometer": 0.08,
    "gyroscope": 0.003,
    "gps.position": 0.5,
    "gps.velocity": 0.1,
    "rate_reference": 0.001,
    "track": 0.05,
}


def channel_of(linear: Linear, sensor: str, axis: str) -> Channel | None:
    """Return a channel by name."""
    return next((c for c in linear.channels if (c.sensor, c.axis) == (sensor, axis)), None)
