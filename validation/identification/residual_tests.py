"""Residual whiteness tests: whether what is left is noise.

Takes residuals and their noise model; gives what no first-order noise could have made (model validation as in Ljung,
"System Identification", 1999, chapter 16). A sensor whose noise is larger or slower than stated is no physics. What
tells the two apart: noise with one level and one correlation, once whitened, is flat over frequency and the same at all
times; missing physics is neither. And what is many times as loud as stated and hardly changes within a recording is no
noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.stats import chi2

from discsim.arrays import FloatArray
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.noise import NoiseModel, estimate_noise, log_likelihood, whitened
from discsim.validation.identification.normal_equations import inverse_of

__all__ = [
    "RESIDUAL_TESTS",
    "ResidualTests",
    "UnmodelledResidual",
    "Whiteness",
    "loudest",
    "unmodelled_residuals",
    "whiteness",
]


@dataclass(frozen=True)
class ResidualTests:
    """Limits beyond which what is left is not noise; `benchmarks/thresholds.py` measures what noise alone reaches.

    Attributes
    ----------
    bands : int
        Bands of frequency in which the whitened residuals of a group are compared.
    band_z, band_share : float
        Excess of a band over their median, in its standard errors and as a share of the level: beyond both.
    window : int
        Readings in a window of time.
    window_z : float
        Excess of a window's squares in standard errors.
    wild : float
        Most that one reading's square counts in a window: of the limit's excess, 62, two wild readings reach 58.
    course_terms : int
        Terms of a course over time that recordings may have in common: a drift that bends, no wave.
    course_gain : float
        What such a course must gain, in twice the log likelihood, over slow noise that is each recording's own.
    loud, slow : float
        No noise is this many times as loud as stated, with a memory beyond this share of the longest recording: the
        blind test's loudest noise is three times as loud as stated.
    loud_samples : float
        Nor is noise of means over turns this many times as loud as stated of one sample: that same loudest noise.
    """

    bands: int = 24
    band_z: float = 8.0
    band_share: float = 0.2
    window: int = 24
    window_z: float = 9.0
    wild: float = 30.0
    course_terms: int = 5
    course_gain: float = 90.0
    loud: float = 10.0
    slow: float = 0.1
    loud_samples: float = 3.0


RESIDUAL_TESTS = ResidualTests()
#: lags that Ljung and Box's test looks at, at most, and how many values a series must have for each
LAGS, VALUES_PER_LAG = 5, 4


@dataclass(frozen=True)
class UnmodelledResidual:
    """Something left that is not noise: in which group, which recording (None: all), when, how strong."""

    group: str
    recording: int | None
    kind: str
    z: float
    from_s: float
    to_s: float
    axis: str = "all"


def unmodelled_residuals(
    linears: Sequence[Linear],
    residuals: Sequence[FloatArray],
    noise: NoiseModel,
    limits: ResidualTests = RESIDUAL_TESTS,
    settled: float = -np.inf,
) -> list[UnmodelledResidual]:
    """Return what the residuals (n,) of each recording hold beside noise, strongest first.

    Bands and windows are asked of what comes after the instant ``settled``, s.
    """
    white = [
        whitened(linear, noise, residual[:, None])[:, 0] for linear, residual in zip(linears, residuals, strict=True)
    ]
    return sorted(
        [
            *_bands(linears, white, limits, settled),
            *_windows(linears, white, limits, settled),
            *_common_trends(linears, residuals, noise, limits),
            *_absorbed_by_noise(linears, noise, limits),
        ],
        key=lambda item: -item.z,
    )


def _bands(
    linears: Sequence[Linear], white: Sequence[FloatArray], limits: ResidualTests, settled: float
) -> list[UnmodelledResidual]:
    """Test the flatness of each group's spectrum, pooled over axes and recordings."""
    sums: dict[str, FloatArray] = {}
    counts: dict[str, FloatArray] = {}
    ends: dict[str, float] = {}
    for linear, x in zip(linears, white, strict=True):
        for channel in linear.channels:
            late = linear.t[channel.rows] > settled
            y, index = x[channel.rows][late], channel.index[late]
            if y.size < 4 * limits.bands or index.size < 0.8 * (index[-1] - index[0] + 1):
                continue
            y = y - y.mean()
            power = np.abs(np.fft.rfft(y)) ** 2 / y.size
            place = np.minimum((np.arange(1, power.size) * limits.bands) // power.size, limits.bands - 1)
            group = channel.group
            sums.setdefault(group, np.zeros(limits.bands))
            counts.setdefault(group, np.zeros(limits.bands))
            np.add.at(sums[group], place, power[1:])
            np.add.at(counts[group], place, 1.0)
            ends[group] = max(ends.get(group, 0.0), float(linear.t[channel.rows][-1]))
    found = []
    for group, total in sums.items():
        n = np.maximum(counts[group], 1.0)
        mean = total / n
        level = float(np.median(mean))
        z = (mean / level - 1.0) * np.sqrt(n)
        worst = int(np.argmax(z))
        if z[worst] > limits.band_z and mean[worst] > (1.0 + limits.band_share) * level:
            found.append(UnmodelledResidual(group, None, f"band {worst}", float(z[worst]), 0.0, ends[group]))
    return found


def _windows(
    linears: Sequence[Linear], white: Sequence[FloatArray], limits: ResidualTests, settled: float
) -> list[UnmodelledResidual]:
    """Test that the level is the same at all times."""
    found = []
    for index, (linear, x) in enumerate(zip(linears, white, strict=True)):
        for channel in linear.channels:
            t = linear.t[channel.rows]
            late = t > settled
            t, y = t[late], np.minimum(x[channel.rows][late] ** 2, limits.wild)
            if y.size < 2 * limits.window:
                continue
            total = np.convolve(y, np.ones(limits.window), mode="valid")
            z = (total - limits.window) / np.sqrt(2.0 * limits.window)
            worst = int(np.argmax(z))
            if z[worst] > limits.window_z:
                found.append(
                    UnmodelledResidual(
                        channel.group,
                        index,
                        "window",
                        float(z[worst]),
                        float(t[worst]),
                        float(t[worst + limits.window - 1]),
                        channel.axis,
                    )
                )
    return found


def _common_trends(
    linears: Sequence[Linear], residuals: Sequence[FloatArray], noise: NoiseModel, limits: ResidualTests
) -> list[UnmodelledResidual]:
    """Test that slow noise goes its own way in each recording.

    A sensor that drifts the same way in all of them leaves residuals that one recording alone cannot tell from slow
    noise. A polynomial of the time since the start, common to all recordings for each axis, must not gain more by the
    likelihood, noise estimated anew, than its terms do by chance.
    """
    found = []
    for group, slow in noise.items():
        channels = [[c for c in linear.channels if c.group == group] for linear in linears]
        if slow.correlation == 0.0 or sum(bool(some) for some in channels) < 2:
            continue
        ends = [float(linear.t[c.rows][-1]) for linear, some in zip(linears, channels, strict=True) for c in some]
        alone = [replace(linear, channels=tuple(some)) for linear, some in zip(linears, channels, strict=True)]
        left, own = list(residuals), {group: slow}
        before = sum(log_likelihood(linear, own, e) for linear, e in zip(alone, left, strict=True))
        after, now = before, own
        for _ in range(3):
            left = _without_trend(alone, residuals, now, max(ends), limits.course_terms)
            now = estimate_noise(alone, left)
            after = min(after, sum(log_likelihood(linear, now, e) for linear, e in zip(alone, left, strict=True)))
        if before - after > limits.course_gain:
            found.append(UnmodelledResidual(group, None, "course", float(np.sqrt(before - after)), 0.0, max(ends)))
    return found


def loudest(group: str, linears: Sequence[Linear], limits: ResidualTests = RESIDUAL_TESTS) -> float:
    """Return how loud noise of a group may be: so many times what is stated of its readings, or of a sample of means.

    Noise that is slow beside a turn is as loud in a mean over turns as in each sample.
    """
    linear, channel = next((one, c) for one in linears for c in one.channels if c.group == group)
    stated, of_one = float(linear.sd[channel.rows][0]), float(np.sqrt(channel.worth))
    return stated * max(limits.loud, limits.loud_samples * of_one if of_one > 1.0 else 0.0)


def _absorbed_by_noise(linears: Sequence[Linear], noise: NoiseModel, limits: ResidualTests) -> list[UnmodelledResidual]:
    """Test that no noise so loud and slow was supposed that it has swallowed what is missing."""
    found = []
    for group, slow in noise.items():
        if slow.correlation <= 0.0:
            continue
        channels = [(linear, c) for linear in linears for c in linear.channels if c.group == group and c.index.size > 1]
        if not channels:
            continue
        most = loudest(group, linears, limits)
        times = [linear.t[c.rows] for linear, c in channels]
        interval = float(np.median(np.diff(times[0])))
        longest = max(float(t[-1] - t[0]) for t in times)
        if slow.sd > most and slow.memory(interval) > limits.slow * longest:
            excess, end = limits.loud * slow.sd / most, max(float(t[-1]) for t in times)
            found.append(UnmodelledResidual(group, None, "swallowed", excess, 0.0, end))
    return found


def _without_trend(
    linears: Sequence[Linear], residuals: Sequence[FloatArray], noise: NoiseModel, end: float, terms: int
) -> list[FloatArray]:
    """Return residuals less the course that each axis has in common in all recordings, estimated in a noise."""
    axes = list(dict.fromkeys(c.axis for linear in linears for c in linear.channels))
    columns = []
    for linear in linears:
        A = np.zeros((linear.t.size, terms * len(axes)))
        for c in linear.channels:
            k = terms * axes.index(c.axis)
            A[c.rows, k : k + terms] = legvander(2.0 * linear.t[c.rows] / end - 1.0, terms - 1)
        columns.append(A)
    width = terms * len(axes)
    H, right = np.zeros((width, width)), np.zeros(width)
    for linear, A, e in zip(linears, columns, residuals, strict=True):
        white = np.hstack([whitened(linear, noise, A), whitened(linear, noise, e[:, None])])
        H += white[:, :-1].T @ white[:, :-1]
        right += white[:, :-1].T @ white[:, -1]
    common = inverse_of(H) @ right
    return [e - A @ common for A, e in zip(columns, residuals, strict=True)]


class Whiteness(NamedTuple):
    """Q = n(n + 2) sum rho_k^2/(n - k) summed over series, its degrees of freedom, and the chance of more if white."""

    Q: float
    lags: int
    p: float


def whiteness(series: Sequence[FloatArray]) -> Whiteness:
    """Test series of residuals (n_i,) evenly spaced, each for itself (no lag reaches from one to the next).

    Series of fewer than four values, or constant ones, tell nothing; p is NaN where none tells anything. A fit takes
    parameters out of its residuals, so where series are short p is only a guide.
    """
    total, count = 0.0, 0
    for values in series:
        x = values[np.isfinite(values)]
        lags = min(LAGS, x.size // VALUES_PER_LAG)
        if lags == 0 or np.ptp(x) == 0.0:
            continue
        n, x = x.size, x - x.mean()
        for k in range(1, lags + 1):
            total += n * (n + 2) * float(x[:-k] @ x[k:] / (x @ x)) ** 2 / (n - k)
        count += lags
    return Whiteness(total, count, float(chi2.sf(total, count)) if count else float("nan"))
