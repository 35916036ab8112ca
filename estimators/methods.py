"""The spin-rate methods by the names a person types, and ``best``: the best that a recording allows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.recording import Recording
from estimators.accelerometer import STANDARD_GRAVITY, AccelerometerErrors, accelerometer
from estimators.fft import FftSettings, fft
from estimators.fusion import accelerometer_calibrated, contradictions, fusion
from estimators.gyroscope import gyroscope, rate_reference
from estimators.likelihood import likelihood
from estimators.rate import YawRate
from estimators.tracking import tracking
from estimators.usable import FASTEST, Usable, unclipped, usable

__all__ = [
    "METHODS",
    "Method",
    "Options",
    "all_methods",
    "best",
    "best_of",
    "estimate",
    "field_notes",
    "folding_notes",
    "missing_sensors",
    "sampling_notes",
]

#: `best` takes the first method that knows the rate for at least this share of its samples.
ENOUGH = 0.5

#: A rate above half the magnetometer's sampling rate is worth a note where this share of a sensor's readings shows it.
FOLDED_SHARE = 0.01

#: A sampling rate from time stamps further than this from the sheet's is worth a note.
RATE_TOLERANCE = 0.01


@dataclass(frozen=True)
class Options:
    """What the methods may be told; the defaults are the paper's."""

    fft: FftSettings = field(default_factory=FftSettings)
    accelerometer: AccelerometerErrors = field(default_factory=AccelerometerErrors)


class Method(NamedTuple):
    """A way to the spin rate: the sensors it needs, and its function."""

    sensors: tuple[str, ...]
    estimate: Callable[[Recording, Options], YawRate]


def _fft(recording: Recording, options: Options) -> YawRate:
    field = unclipped(recording, "magnetometer")
    return fft(recording.need("magnetometer") if field is None else field, options.fft)


def _accelerometer(recording: Recording, options: Options) -> YawRate:
    errors = options.accelerometer
    if recording.plant in ("flight", "free_spin") and errors.origin == 0:
        # A disc decelerates at up to about one g in its plane and lifts up to about two; a rate table stands still.
        errors = replace(errors, origin=STANDARD_GRAVITY, vertical=2 * STANDARD_GRAVITY)
    return accelerometer(recording.need("accelerometer"), recording.sheets["accelerometer"], errors)


def _gyroscope(recording: Recording, _: Options) -> YawRate:
    return gyroscope(recording.need("gyroscope"), recording.sheets["gyroscope"])


def _rate_reference(recording: Recording, _: Options) -> YawRate:
    return rate_reference(recording.need("rate_reference"), recording.sheets["rate_reference"])


#: Every method, in the order in which `best` prefers them where they know the rate.
METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "rate_reference": Method(("rate_reference",), _rate_reference),
        "fusion": Method(("magnetometer",), lambda recording, _: fusion(recording)),
        "gyroscope": Method(("gyroscope",), _gyroscope),
        "tracking": Method(("magnetometer",), lambda recording, _: tracking(recording)),
        "likelihood": Method(("magnetometer",), lambda recording, _: likelihood(recording)),
        "fft": Method(("magnetometer",), _fft),
        "accelerometer_calibrated": Method(
            ("accelerometer",), lambda recording, _: accelerometer_calibrated(recording)
        ),
        "accelerometer": Method(("accelerometer",), _accelerometer),
    }
)


def estimate(recording: Recording, name: str, options: Options | None = None) -> YawRate:
    """Spin rate of a recording by the method of that name, or by `best`.

    What no estimator may use is taken out first (`estimators.usable`). Raises `InputError` for an unknown name (listing
    those there are), a missing sensor, or what the method raises.
    """
    options = options or Options()
    if name == "best":
        return best(recording, options)
    if name not in METHODS:
        raise InputError(f"no method '{name}'; expected one of best, {', '.join(METHODS)}")
    return _estimate(usable(recording), name, options)


def _estimate(sound: Usable, name: str, options: Options) -> YawRate:
    for sensor in METHODS[name].sensors:
        if sensor in sound.gone:
            raise InputError(f"{sensor}: {sound.gone[sensor]}")
    found = METHODS[name].estimate(sound.recording, options)
    with np.errstate(invalid="ignore"):
        possible = (np.abs(found.rate) <= FASTEST) & (found.sd <= FASTEST)
    if np.all(possible | np.isnan(found.rate)):
        return found
    rate, sd = np.where(possible, found.rate, np.nan), np.where(possible, found.sd, np.nan)
    return replace(found, rate=rate, sd=sd)


def all_methods(recording: Recording, options: Options | None = None) -> tuple[list[YawRate], dict[str, str]]:
    """Return what every method gives, and the methods left out, each with the reason in a sentence.

    Raises `InputError` where no method can be used.
    """
    options, sound = options or Options(), usable(recording)
    rates: list[YawRate] = []
    left_out: dict[str, str] = {}
    for name in METHODS:
        if absent := missing_sensors(recording, name):
            left_out[name] = f"no {', '.join(absent)} in the recording"
            continue
        try:
            found = _estimate(sound, name, options)
        except InputError as error:
            left_out[name] = str(error)
            continue
        if np.any(np.isfinite(found.rate)):
            rates.append(found)
        else:
            left_out[name] = _why_unknown(sound.recording, name)
    if not rates:
        reasons = "; ".join(f"{method}: {reason}" for method, reason in left_out.items())
        raise InputError(f"{recording.path or recording.name}: no method tells the spin ({reasons})")
    return rates, left_out


def best(recording: Recording, options: Options | None = None) -> YawRate:
    """Spin rate by the first of `METHODS` that knows it for half of its samples, else by the one that knows most.

    A gyroscope that clips for most of a recording thus gives way to a magnetometer. The result bears the name of the
    method taken. Raises `InputError` where no method can be used, with each one's reason.
    """
    return best_of(recording, options)[0]


def best_of(recording: Recording, options: Options | None = None) -> tuple[YawRate, dict[str, str]]:
    """Return the rate of `best`, and why each method that it prefers to the one taken was passed over."""
    options, sound = options or Options(), usable(recording)
    reasons: dict[str, str] = {}
    candidates: list[tuple[float, YawRate]] = []
    for name in METHODS:
        if absent := missing_sensors(recording, name):
            reasons[name] = f"no {', '.join(absent)}"
            continue
        try:
            candidate = _estimate(sound, name, options)
        except InputError as error:
            reasons[name] = str(error)
            continue
        share = float(np.mean(np.isfinite(candidate.rate))) if len(candidate) else 0.0
        if share >= ENOUGH:
            return candidate, reasons
        if share > 0:
            reasons[name] = f"knows the rate for {100 * share:.2g} % of its times only"
            candidates.append((share, candidate))
        else:
            reasons[name] = _why_unknown(sound.recording, name)
    if not candidates:
        told = "; ".join(f"{name}: {reason}" for name, reason in reasons.items())
        raise InputError(f"{recording.path or recording.name}: no method can be used ({told})")
    taken = max(candidates, key=lambda pair: pair[0])[1]  # of equals the first, which is the one preferred
    return taken, {name: reason for name, reason in reasons.items() if name != taken.method}


def field_notes(recording: Recording) -> list[str]:
    """Say what is lost where the magnetic field of the place is not stated."""
    if "magnetometer" not in recording or recording.environment.field_known:
        return []
    return [
        "the magnetic field of the place is not stated: hard iron along the spin axis is then hardly known, and of the "
        "magnetometer's methods the standard deviation is larger; --place LAT,LON --date YYYY-MM-DD looks it up"
    ]


def _why_unknown(recording: Recording, name: str) -> str:
    """Say why a method knows the rate at no time, by what its sensors show."""
    for sensor in METHODS[name].sensors:
        samples, sheet = recording.need(sensor), recording.sheets[sensor]
        axes = {"gyroscope": [2], "accelerometer": [0, 1]}.get(sensor, [0])
        value = samples.value if samples.value.ndim == 2 else samples.value[:, None]
        known = np.any(np.isfinite(value[:, axes]), axis=0)
        letters = " and ".join("xyz"[axis] for axis in axes)
        if not np.any(known):
            return f"the {sensor} has no usable reading of {letters}"
        if np.all(np.any(sheet.clipped(value)[:, axes], axis=1) | ~np.isfinite(value[:, axes]).all(axis=1)):
            return f"the {sensor}'s {letters} stands at its limit in every reading: the spin is beyond what it can show"
        if sensor == "accelerometer" and (sheet.position is None or not np.hypot(*sheet.position[:2]) > 0):
            return (
                "the accelerometer's place off the spin axis is not stated; add position_m = [x, y, z] to "
                "[sensors.accelerometer] of recording.toml, or to the import map"
            )
    if name in ("fusion", "accelerometer_calibrated"):
        against = contradictions(recording)
        if against:
            return f"its sensors contradict each other: {'; '.join(against)}"
    return "no part of the recording shows a spin to it"


def missing_sensors(recording: Recording, name: str) -> tuple[str, ...]:
    """Return the sensors that a method needs and a recording has not."""
    return tuple(sensor for sensor in METHODS[name].sensors if sensor not in recording)


def sampling_notes(recording: Recording) -> list[str]:
    """Say where a sensor's time stamps contradict the sampling rate that its sheet states, and where rows are missing.

    The stamps are used; `fft`, which needs an even grid, is silent where the magnetometer's is not.
    """
    notes = []
    for sensor, samples in recording.samples.items():
        stated = recording.sheets[sensor].rate_hz
        if len(samples) < 2:
            continue
        found = 1 / samples.interval
        if abs(found / stated - 1) > RATE_TOLERANCE:
            notes.append(f"{sensor}: time stamps say {found:.4g} Hz, its sheet {stated:.4g} Hz; the stamps are used")
        gaps = int(np.count_nonzero(np.diff(samples.t) > 1.5 * samples.interval))
        if gaps:
            silent = "; fft is silent across them" if sensor == "magnetometer" else ""
            notes.append(
                f"{sensor}: {gaps} steps longer than one and a half of the usual {samples.interval:.4g} s{silent}"
            )
    return notes


def folding_notes(recording: Recording) -> list[str]:
    """Say where another sensor shows a spin of more than half the magnetometer's sampling rate.

    Whole turns from sample to sample leave no trace in the field: at 100 Hz a spin of 20000 deg/s (180 deg a sample is
    18000) shows as one of 16000. `fft` and `likelihood` give that; `tracking` and `fusion` are told the missing turns
    by the other sensor. A gyroscope that clips above the limit counts, and an accelerometer by two standard deviations.
    """
    if "magnetometer" not in recording:
        return []
    half = np.pi / recording.need("magnetometer").interval
    notes = []
    for name in ("rate_reference", "gyroscope", "accelerometer"):
        if name not in recording:
            continue
        shown = np.abs(_shown(recording, name))
        above = shown > half
        share = float(np.mean(above)) if above.size else 0.0
        if share < FOLDED_SHARE:
            continue
        rate = float(np.median(shown[above]))
        folded = abs((rate + half) % (2 * half) - half)
        notes.append(
            f"{name}: {np.degrees(rate):.0f} deg/s for {100 * share:.0f} % of its readings, above half the "
            f"magnetometer's sampling rate ({np.degrees(half):.0f} deg/s); fft and likelihood see it folded, as "
            f"{np.degrees(folded):.0f} deg/s"
        )
    return notes


def _shown(recording: Recording, sensor: str) -> FloatArray:
    """Return the rate that a sensor surely shows, rad/s; a clipped one has its range, which is a lower bound."""
    samples = recording.need(sensor)
    if sensor == "rate_reference":
        return samples.value
    if sensor == "gyroscope":
        return np.asarray(samples.value[:, 2])
    found = _accelerometer(recording, Options())
    return found.rate - 2 * found.sd
