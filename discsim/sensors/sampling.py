"""When a sensor samples, and what its electronics do to a reading: rate, clock, jitter, losses, noise, rounding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from scipy.signal import lfilter

from discsim.arrays import BoolArray, FloatArray
from discsim.effects.sensors import ClockRate, DroppedSamples, Lag, lag, true_time
from discsim.motion import Motion

__all__ = ["Noise", "Sampling", "digitise", "filtered"]

#: an ideal reading (n, k) at instants (n,) s
Signal: TypeAlias = Callable[[FloatArray], FloatArray]

#: a lag is followed on a grid this fine, s: a 7000 deg/s sine is then linear per step to 2e-5 of its amplitude
FINE_STEP = 1e-4


@dataclass(frozen=True)
class Sampling:
    """When samples are taken and what time is written for them.

    Sample k is written as ``phase_s + k/rate_hz``. It was taken at the written time over the clock's ratio, plus a
    jitter of ``jitter_s`` rms that nobody knows. Of the samples a share ``gaps`` is lost honestly (their time stamps
    are missing), and a share ``dropped`` silently: the rest are written at the nominal spacing.
    """

    rate_hz: float
    phase_s: float = 0.0
    jitter_s: float = 0.0
    gaps: float = 0.0
    clock: ClockRate = field(default_factory=ClockRate)
    dropped: DroppedSamples = field(default_factory=DroppedSamples)

    def __post_init__(self) -> None:
        if not self.rate_hz > 0:
            raise ValueError(f"sampling rate is {self.rate_hz:g} Hz, expected above zero")
        for name, share in (("gaps", self.gaps), ("dropped", self.dropped.fraction)):
            if not 0 <= share < 1:
                raise ValueError(f"share of samples lost ({name}) is {share:g}, expected 0 to below 1")

    def instants(
        self, start: float, stop: float, rng: np.random.Generator, common_clock: ClockRate | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return written and true times (n,) s of the samples taken from ``start`` to ``stop``.

        ``start`` is time zero of the recording. A clock common to all sensors multiplies the sensor's own.
        """
        ratio = self.clock.ratio * (common_clock.ratio if common_clock else 1.0)
        clock = ClockRate(ratio)
        count = int(np.floor(((stop - start) * ratio - self.phase_s) * self.rate_hz + 1e-9)) + 1
        nominal = self.phase_s + np.arange(max(count, 0)) / self.rate_hz
        taken = start + true_time(clock, nominal)
        written = nominal
        if self.dropped.fraction > 0:
            taken = taken[rng.random(taken.size) >= self.dropped.fraction]
            written = nominal[: taken.size]
        if self.gaps > 0:
            kept = rng.random(taken.size) >= self.gaps
            taken, written = taken[kept], written[kept]
        if self.jitter_s > 0:
            taken = taken + self.jitter_s * rng.standard_normal(taken.size)
        return written, np.clip(taken, start, stop)


@dataclass(frozen=True)
class Noise:
    """Noise per axis in the sensor's unit: white, correlated over ``correlation_s``, and a bias that walks.

    ``walk`` is the rms growth of the bias per square root of a second.
    """

    white: float = 0.0
    correlated: float = 0.0
    correlation_s: float = 1.0
    walk: float = 0.0

    def sample(self, t: FloatArray, width: int, rng: np.random.Generator) -> FloatArray:
        """Return noise (n, width) at times t (n,) s; only what is not zero draws from ``rng``."""
        shape = (t.size, width)
        noise = np.zeros(shape)
        if t.size == 0:
            return noise
        steps = np.diff(t, prepend=t[0])
        if self.white > 0:
            noise += self.white * rng.standard_normal(shape)
        if self.correlated > 0:
            kept = np.exp(-float(np.median(steps[1:] if t.size > 1 else 1.0)) / self.correlation_s)
            drive = rng.standard_normal(shape)
            drive[1:] *= np.sqrt(1 - kept**2)
            noise += self.correlated * lfilter([1.0], [1.0, -kept], drive, axis=0)
        if self.walk > 0:
            noise += self.walk * np.cumsum(np.sqrt(steps)[:, None] * rng.standard_normal(shape), axis=0)
        return noise


def filtered(effect: Lag, motion: Motion, signal: Signal, taken: FloatArray) -> FloatArray:
    """Return ``signal`` at the instants ``taken`` (n,), through a first-order lag where there is one.

    A lag settles on the signal at the motion's start.
    """
    if effect.tau_s <= 0:
        return signal(taken)
    fine = np.linspace(motion.start, motion.end, int(np.ceil((motion.end - motion.start) / FINE_STEP)) + 1)
    grid = np.union1d(fine, taken)
    return lag(effect, grid, signal(grid))[np.searchsorted(grid, taken)]


def digitise(
    value: FloatArray,
    t: FloatArray,
    noise: Noise,
    rng: np.random.Generator,
    *,
    resolution: float = 0.0,
    limit: float = np.inf,
    axes: BoolArray | None = None,
) -> FloatArray:
    """Return readings (n, k): noise added, rounded to the resolution, clipped at +-limit, absent axes NaN."""
    reading = value + noise.sample(t, value.shape[1], rng)
    if resolution > 0:
        reading = np.round(reading / resolution) * resolution
    reading = np.clip(reading, -limit, limit)
    # a converter's steps carry no more digits than this; files stay short and survive a round trip
    reading = np.round(reading, 9)
    if axes is not None:
        reading[:, ~axes] = np.nan
    return np.asarray(reading)
