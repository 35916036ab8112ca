"""What each method says over a span, and how far that is from a reference sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.estimators.fft import FftSettings
from discsim.estimators.methods import METHODS, Options, estimate, missing_sensors
from discsim.estimators.rate import YawRate
from discsim.recording import Recording
from discsim.validation.studies.real_recordings.sources import Measured, Source
from discsim.validation.studies.real_recordings.turns import phase_rate

__all__ = [
    "LOWERED",
    "PHASE_WINDOW",
    "Agreement",
    "Attempt",
    "agreement",
    "attempts",
    "mean_between",
    "run_fft",
]

#: Methods that every source is given; what else the registry has follows where a source spins steadily.
CORE = ("fft", "accelerometer")
REFERENCES = ("gyroscope", "rate_reference")
LOWERED = "fft, lowered"
#: Ratios are taken where the reference turns at this rate or faster, rad/s: beside zero they say nothing.
RATIO_FROM = float(np.radians(30.0))
#: Samples between windows where a whole log is looked over: a sixteenth of a window and less.
COARSE = 8
#: Stretch over which the slope of the field's phase is taken, s.
PHASE_WINDOW = 1.5


@dataclass(frozen=True)
class Attempt:
    """A method on a span: its rate, or why there is none; ``window`` is the time over which it takes a mean, s."""

    method: str
    rate: YawRate | None
    reason: str = ""
    window: float = 0.0


@dataclass(frozen=True)
class Agreement:
    """How a method stands to a reference over a span; rates in rad/s, NaN where there is nothing to say.

    Attributes
    ----------
    method, reference : str
        ``reference`` is empty where there is none.
    values, known : int, float
        Answers asked for, and the share of them that are numbers.
    median, reference_median : float
        Of the rates at the times where both are known (of the method's where there is no reference).
    ratio : float
        Median of method over reference where the reference turns fast enough.
    rms : float
        Root mean square difference.
    beyond : float
        Share of the differences larger than three of the method's own standard deviations.
    reason : str
        Why it says nothing, where it raised.
    """

    method: str
    reference: str
    values: int = 0
    known: float = 0.0
    median: float = float("nan")
    reference_median: float = float("nan")
    ratio: float = float("nan")
    rms: float = float("nan")
    beyond: float = float("nan")
    reason: str = ""


def held(measured: Measured, made: Sequence[Attempt]) -> list[Agreement]:
    """Hold each method against the reference, and where a vector from elsewhere is known also against its size."""
    found = [agreement(one, measured.reference) for one in made]
    return found + (_against_size(measured, made) if any(one.method == "gyroscope" for one in made) else [])


def _against_size(measured: Measured, made: Sequence[Attempt]) -> list[Agreement]:
    """Hold `fft`, and the size of the gyroscope's vector, against the size of the reference's vector.

    For a body whose axis wanders: what turns the field in the sensor is all of the rate, and not its part about z.
    """
    reference, vector = measured.reference, measured.vector
    if reference is None or vector is None:
        return []
    size = YawRate(f"{reference.method}, size", reference.t, np.linalg.norm(vector, axis=1), reference.sd)
    gyroscope = measured.recording.need("gyroscope")
    sd = float(np.nanmedian(next(one.rate.sd for one in made if one.method == "gyroscope" and one.rate is not None)))
    length = np.linalg.norm(gyroscope.value, axis=1)
    whole = YawRate("gyroscope, size", gyroscope.t, length, np.where(np.isfinite(length), sd, np.nan))
    sized = [one for one in made if one.method in ("fft", LOWERED)] + [Attempt(whole.method, whole)]
    return [agreement(one, size) for one in sized]


def attempts(source: Source, measured: Measured, also: Sequence[str] | None = None) -> list[Attempt]:
    """Run the methods on a span: the paper's, and where it spins steadily ``also`` (default: all that there are).

    Raises `InputError` for a name that the registry does not have.
    """
    others = [name for name in METHODS if name not in CORE + REFERENCES] if also is None else list(also)
    for name in others:
        if name not in METHODS:
            raise InputError(f"no method '{name}'; expected one of {', '.join(METHODS)}")
    recording = measured.recording
    made = [_attempt("fft", recording, FftSettings())]
    if source.lowered is not None:
        made.append(replace(_attempt("fft", recording, source.lowered), method=LOWERED))
    made.append(_attempt("accelerometer", recording))
    if source.slow and "magnetometer" in recording:
        phase = phase_rate(recording.samples["magnetometer"], PHASE_WINDOW)
        made.append(Attempt(phase.method, phase, window=PHASE_WINDOW))
    if source.reference == "optical":
        made.append(_attempt("gyroscope", recording))
    if source.steady:
        made += [_attempt(name, recording) for name in others if name not in CORE]
    return [replace(one, rate=None if one.rate is None else replace(one.rate, method=one.method)) for one in made]


def run_fft(recording: Recording, settings: FftSettings, name: str) -> YawRate:
    """Return `fft` with these settings, every `COARSE` samples of a log, under a name of its own."""
    return replace(estimate(recording, "fft", Options(fft=replace(settings, step=COARSE))), method=name)


def _attempt(name: str, recording: Recording, settings: FftSettings | None = None) -> Attempt:
    if absent := missing_sensors(recording, name):
        return Attempt(name, None, f"no {', '.join(absent)}")
    options = Options() if settings is None else Options(fft=settings)
    try:
        rate = estimate(recording, name, options)
    except InputError as error:
        # the recording's name stands above the table
        return Attempt(name, None, str(error).removeprefix(f"{recording.name}: ").removeprefix(f"{name}: "))
    except np.linalg.LinAlgError as error:  # a fault of the method, which the page shows rather than ends on
        return Attempt(name, None, f"failed: {error}")
    reason = ""
    if name == "accelerometer" and recording.sheets[name].position is None:
        reason = "where it sits is not stated"
    window = settings.window * recording.samples["magnetometer"].interval if settings is not None else 0.0
    return Attempt(name, rate, reason, window)


def agreement(attempt: Attempt, reference: YawRate | None) -> Agreement:
    """Hold a method against a reference, at the method's times.

    A method that takes a mean over a window (`Attempt.window`) is held against the reference's mean over the same
    window, any other against its value at the time. Where one of the two has no sign the magnitudes are compared.
    """
    name = "" if reference is None else reference.method
    rate = attempt.rate
    if rate is None:
        return Agreement(attempt.method, name, reason=attempt.reason)
    known = np.isfinite(rate.rate)
    reason = attempt.reason or ("" if known.any() else "silent throughout")
    found = Agreement(attempt.method, name, len(rate), float(known.mean()), reason=reason)
    if reference is None:
        return replace(found, median=float(np.median(rate.rate[known])) if known.any() else float("nan"))
    other = mean_between(reference, rate.t - attempt.window / 2, rate.t + attempt.window / 2)
    value = rate.rate
    if not (rate.signed and reference.signed):
        value, other = np.abs(value), np.abs(other)
    both = known & np.isfinite(other)
    if not both.any():
        return found
    value, other, sd = value[both], other[both], rate.sd[both]
    fast = np.abs(other) >= RATIO_FROM
    return replace(
        found,
        median=float(np.median(value)),
        reference_median=float(np.median(other)),
        ratio=float(np.median(value[fast] / other[fast])) if fast.any() else float("nan"),
        rms=float(np.sqrt(np.mean((value - other) ** 2))),
        beyond=float(np.mean(np.abs(value - other) > 3 * sd)),
    )


def mean_between(rate: YawRate, start: FloatArray, stop: FloatArray) -> FloatArray:
    """Return the mean of a rate from each start to each stop, or its value where they meet; NaN where it has a gap."""
    if np.all(start == stop):
        return rate.at(start)
    gap = ~np.isfinite(rate.rate)
    value = np.where(gap, 0.0, rate.rate)
    pieces = np.diff(rate.t)
    total = cumulative_trapezoid(value, rate.t, initial=0)
    gaps = np.concatenate(([0.0], np.cumsum((gap[1:] | gap[:-1]) * pieces)))
    inside = (start >= rate.t[0] - pieces[0]) & (stop <= rate.t[-1] + pieces[-1])
    start, stop = np.maximum(start, rate.t[0]), np.minimum(stop, rate.t[-1])
    length = stop - start
    bridged = np.interp(stop, rate.t, gaps) - np.interp(start, rate.t, gaps)
    sound = inside & (length > 0) & (bridged < 1e-9)
    integral = np.interp(stop, rate.t, total) - np.interp(start, rate.t, total)
    return np.asarray(np.divide(integral, length, out=np.full(length.shape, np.nan), where=sound))
