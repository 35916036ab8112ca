"""When a sensor samples, and what its electronics do to a reading: rate, clock, jitter, losses, noise, rounding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.compiled import compiled
from discsim.effects.sensors import ClockRate, DroppedSamples, Lag, lag, true_time
from discsim.effects.setup import TimeOffset
from discsim.effects.timing_rows import ImuClock, LateRows, LostRows, OwnClock, held_since, late_by, written_rows
from discsim.errors import InputError
from discsim.limits import MOST_ROWS
from discsim.motion import Motion
from discsim.recording import SensorSheet

__all__ = ["Noise", "Sampling", "check_lag", "digitise", "filtered", "stated"]

#: an ideal reading (n, k) at instants (n,) s
Signal: TypeAlias = Callable[[FloatArray], FloatArray]

#: a lag is followed on a grid this fine, s: a 7000 deg/s sine is then linear per step to 2e-5 of its amplitude
FINE_STEP = 1e-4


@dataclass(frozen=True)
class Sampling:
    """When samples are taken and what time is written for them.

    Sample k is written as ``phase_s + k/rate_hz``. It was taken at the written time less the offset, over the clock's
    ratio, plus a jitter of ``jitter_s`` rms that nobody knows; there is none from before the motion. Of the samples a
    share ``gaps`` is lost honestly (their time stamps are missing), and a share ``dropped`` silently: the rest are
    written at the nominal spacing. Rows that a logger loses or writes late, and parts that free-run beside it, are
    those of `discsim.effects.timing_rows`.
    """

    rate_hz: float
    phase_s: float = 0.0
    jitter_s: float = 0.0
    gaps: float = 0.0
    clock: ClockRate = field(default_factory=ClockRate)
    dropped: DroppedSamples = field(default_factory=DroppedSamples)
    offset: TimeOffset = field(default_factory=TimeOffset)
    lost_rows: LostRows = field(default_factory=LostRows)
    late_rows: LateRows = field(default_factory=LateRows)
    own_clock: OwnClock = field(default_factory=OwnClock)
    imu_clock: ImuClock = field(default_factory=ImuClock)
    #: from which the pattern of rows is drawn, which all sensors of a recording share
    rows_seed: int = 0

    def __post_init__(self) -> None:
        for name, value, unit in (("rate", self.rate_hz, " Hz"), ("clock rate", self.clock.ratio, "")):
            if not 0 < value < np.inf:
                raise InputError(f"sampling {name} is {value:g}{unit}, expected above zero")
        for name, value in (("phase", self.phase_s), ("jitter", self.jitter_s)):
            if not 0 <= value < np.inf:
                raise InputError(f"sampling {name} is {value:g} s, expected zero or more")
        for name, share in (("gaps", self.gaps), ("dropped", self.dropped.fraction)):
            if not 0 <= share < 1:
                raise InputError(f"share of samples lost ({name}) is {share:g}, expected 0 to below 1")

    def instants(self, start: float, stop: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Return written and true times (n,) s of the samples taken from ``start`` to ``stop``.

        ``start`` is time zero of the recording.
        """
        written, taken, _ = self.acquired(start, stop, rng)
        return written, taken

    def acquired(
        self, start: float, stop: float, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return written and true times (n,) s as `instants` does, and the true times (n,) one step before each."""
        late = self.offset.offset_s - self.phase_s
        rows = ((stop - start) * self.clock.ratio + late) * self.rate_hz
        if not rows < MOST_ROWS:
            raise InputError(
                f"sampling {stop - start:g} s at {self.rate_hz:g} Hz (clock rate {self.clock.ratio:g}) gives "
                f"{rows:.3g} rows; expected at most {MOST_ROWS}"
            )
        count = int(np.floor(max(rows, -1.0) + 1e-9)) + 1
        nominal = self.phase_s + np.arange(max(count, 0)) / self.rate_hz
        if self.offset.offset_s > 0.0:
            nominal = nominal[nominal >= self.offset.offset_s - 1e-9 / self.rate_hz]
        taken = start + true_time(self.clock, nominal - self.offset.offset_s)
        taken, wrote = self._in_rows(start, taken)
        before = np.concatenate([taken[:1], taken[:-1]])
        taken, before = taken[wrote], before[wrote]
        written = nominal[: taken.size]
        if self.dropped.fraction > 0:
            kept = rng.random(taken.size) >= self.dropped.fraction
            taken, before = taken[kept], before[kept]
            written = nominal[: taken.size]
        if self.gaps > 0:
            kept = rng.random(taken.size) >= self.gaps
            taken, before, written = taken[kept], before[kept], written[kept]
        if self.jitter_s > 0:
            shaken = self.jitter_s * rng.standard_normal(taken.size)
            taken, before = taken + shaken, before + shaken
        return written, np.clip(taken, start, stop), np.clip(before, start, stop)

    def _in_rows(self, start: float, t: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return when what a logger's steps at t (n,) s show was taken, and which of them wrote a row."""
        rows = np.random.default_rng(self.rows_seed)
        wrote = np.ones(t.size, dtype=np.bool_)
        if self.lost_rows.fraction > 0.0:
            wrote = written_rows(self.lost_rows, t.size, rows)
        if self.late_rows.fraction > 0.0:
            t = t + late_by(self.late_rows, t.size, rows)
        for clock, stream in ((self.own_clock, 1), (self.imu_clock, 2)):
            if clock.period_s > 0.0:
                t = start + held_since(clock, t - start, np.random.default_rng([self.rows_seed, stream]))
        return t, wrote


@dataclass(frozen=True)
class Noise:
    """Noise per axis in the sensor's unit: white, correlated over ``correlation_s``, and a bias that walks.

    ``walk`` is the rms growth of the bias per square root of a second.
    """

    white: float = 0.0
    correlated: float = 0.0
    correlation_s: float = 1.0
    walk: float = 0.0

    def __post_init__(self) -> None:
        for name in ("white", "correlated", "walk"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"{name} noise is {getattr(self, name):g}, expected zero or more")
        if not self.correlation_s > 0:
            raise InputError(f"correlation time of noise is {self.correlation_s:g} s, expected above zero")

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
            noise += self.correlated * _remembering(np.exp(-steps / self.correlation_s), rng.standard_normal(shape))
        if self.walk > 0:
            noise += self.walk * np.cumsum(np.sqrt(steps)[:, None] * rng.standard_normal(shape), axis=0)
        return noise


@compiled
def _remembering(kept: FloatArray, drive: FloatArray) -> FloatArray:
    """Unit noise (n, k) of which the share kept[i] of the sample before lives on, driven by unit white noise."""
    y = drive.copy()
    for i in range(1, kept.size):
        for j in range(drive.shape[1]):
            y[i, j] = kept[i] * y[i - 1, j] + np.sqrt(1.0 - kept[i] ** 2) * drive[i, j]
    return y


def check_lag(effect: Lag) -> None:
    """Refuse a lag that is no time; raises `InputError`."""
    if not 0 <= effect.tau_s < np.inf:
        raise InputError(f"lag is {effect.tau_s:g} s, expected zero or more")


def filtered(
    effect: Lag, motion: Motion, signal: Signal, taken: FloatArray, held: FloatArray | None = None
) -> FloatArray:
    """Return ``signal`` at the instants ``taken`` (n,), through a first-order lag where there is one.

    A lag has settled on the signal at the motion's start, or holds ``held`` (k,) beyond it.
    """
    if effect.tau_s <= 0:
        return signal(taken)
    fine = np.linspace(motion.start, motion.end, int(np.ceil((motion.end - motion.start) / FINE_STEP)) + 1)
    grid = np.union1d(fine, taken)
    x = signal(grid)
    return lag(effect, grid, x, None if held is None else x[0] + held)[np.searchsorted(grid, taken)]


def stated(
    sampling: Sampling, noise: Noise, resolution: float, limit: float, position: FloatArray | None = None
) -> SensorSheet:
    """Return what a data sheet states of a sensor; the errors that are hidden in it are not there."""
    finite = limit if np.isfinite(limit) else None
    return SensorSheet(sampling.rate_hz, noise.white, resolution or None, finite, position=position)


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
