"""The spin-rate methods by the names a person types, and ``best``: the best that a recording allows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType, NoneType
from typing import NamedTuple

import numpy as np

from discsim.arrays import BoolArray, FloatArray, runs
from discsim.errors import InputError, require_type
from discsim.estimators.accelerometer import STANDARD_GRAVITY, AccelerometerErrors, accelerometer
from discsim.estimators.fft import FftSettings, fft
from discsim.estimators.fusion import (
    FusionSettings,
    accelerometer_calibrated,
    by_slow_field,
    compare_sensors,
    contradictions,
    fusion,
    mostly_clipped,
    unfolding,
)
from discsim.estimators.gyroscope import gyroscope, rate_reference
from discsim.estimators.likelihood import likelihood
from discsim.estimators.rate import YawRate
from discsim.estimators.tracking import tracking
from discsim.estimators.usable import FASTEST, Usable, unclipped, usable
from discsim.recording import Recording, Samples
from discsim.threads import one_thread

__all__ = [
    "METHODS",
    "Method",
    "Options",
    "all_methods",
    "best",
    "best_of",
    "estimate",
    "folded",
    "missing_sensors",
]

#: `best` takes the first method that knows the rate for at least this share of its samples.
ENOUGH = 0.5

#: The sensor whose contradiction with the magnetometer makes a method's answer doubtful.
DOUBTED_BY = MappingProxyType(
    {
        "gyroscope": "gyroscope",
        "tracking": "gyroscope",
        "likelihood": "gyroscope",
        "fft": "gyroscope",
        "accelerometer": "accelerometer",
    }
)

#: Methods that know the rate by the field's turning alone.
BY_THE_FIELD = ("tracking", "likelihood", "fft")
#: The methods whose rate is a turning of the field over time: a wrong spacing of the rows scales it.
BY_THE_CLOCK = ("fusion", "tracking", "likelihood", "fft", "accelerometer_calibrated")

#: Least share of the turning's square that is a steady spin about z where a spectrum shows it. A ramp from rest has
#: 3/4, a disc that wobbles by a tenth 0.99; a body whose axis wanders, by hand or under a parachute, 0 to 1/3.
STEADY = 0.5

#: Fewest readings in a row that show a sensor's noise beside a steady change (a second difference).
SCATTERING = 3


@dataclass(frozen=True)
class Options:
    """What the methods may be told; the defaults are the paper's."""

    fft: FftSettings = field(default_factory=FftSettings)
    accelerometer: AccelerometerErrors = field(default_factory=AccelerometerErrors)

    def __post_init__(self) -> None:
        require_type(self.fft, FftSettings, "options fft", "FftSettings(...)")
        require_type(self.accelerometer, AccelerometerErrors, "options accelerometer", "AccelerometerErrors(...)")

    @staticmethod
    def of(options: Options | None) -> Options:
        """Return the options, the paper's for none; raises `InputError` for another type."""
        require_type(options, (Options, NoneType), "options", "Options(fft=..., accelerometer=...), or nothing")
        return options or Options()


class Method(NamedTuple):
    """A way to the spin rate: the sensors it needs, and its function."""

    sensors: tuple[str, ...]
    estimate: Callable[[Recording, Options], YawRate]


def _fft(recording: Recording, options: Options) -> YawRate:
    field = unclipped(recording, "magnetometer")
    found = fft(
        recording.need("magnetometer") if field is None else field,
        options.fft,
        strength=recording.environment.field_strength,
        fixed_axis=recording.plant in ("rate_table", "spin_down"),
    )
    length = options.fft.window * recording.need("magnetometer").interval
    late = length / 2 if options.fft.stamp == "unshifted" else 0.0
    fits = ~_tumbling(recording, found.t - late, length)
    return replace(found, rate=np.where(fits, found.rate, np.nan), sd=np.where(fits, found.sd, np.nan))


def _tumbling(recording: Recording, centres: FloatArray, length: float) -> BoolArray:
    """Tell in which windows (n,), of ``length`` s, a gyroscope shows no steady spin about z: a spectrum's line is none.

    There the square of the mean rate about z is less than `STEADY` of the mean square of the whole rate. Where the
    gyroscope has no reading, clips, or there is none, nothing is told.
    """
    gyroscope = unclipped(recording, "gyroscope")
    if gyroscope is None or len(gyroscope) < 2:
        return np.zeros(centres.size, dtype=np.bool_)
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(np.nan_to_num(_turning(gyroscope.value)), axis=0)])
    first = np.searchsorted(gyroscope.t, centres - length / 2)
    after = np.searchsorted(gyroscope.t, centres + length / 2)
    count, z, square = (sums[after] - sums[first]).T
    whole = (after - first > 0) & (count >= after - first)
    return np.asarray(whole & (z**2 < STEADY * square * count))


def _turning(rate: FloatArray) -> FloatArray:
    """Return for readings (n, 3) one, the rate about z, and the square of the whole rate, (n, 3); NaN for gaps."""
    square = np.sum(rate**2, axis=1)
    return np.where(np.isnan(square)[:, None], np.nan, np.stack([np.ones(len(rate)), rate[:, 2], square], axis=1))


def _accelerometer(recording: Recording, options: Options) -> YawRate:
    errors = options.accelerometer
    if recording.plant in ("flight", "free_spin") and errors.origin == 0:
        # A disc decelerates at up to about one g in its plane and lifts up to about two; a rate table stands still.
        errors = replace(errors, origin=STANDARD_GRAVITY, vertical=2 * STANDARD_GRAVITY)
    return accelerometer(recording.need("accelerometer"), recording.sheets["accelerometer"], errors)


def _gyroscope(recording: Recording, _: Options) -> YawRate:
    found = gyroscope(recording.need("gyroscope"), recording.sheets["gyroscope"])
    known = int(np.count_nonzero(np.isfinite(found.rate)))
    if 0 < known < SCATTERING and recording.sheets["gyroscope"].noise_rms is None:
        raise InputError(
            f"the gyroscope has {known} usable readings of z, which show no noise; expected {SCATTERING} at least, or "
            "noise_rms_rad_s in [sensors.gyroscope]"
        )
    return found


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


@one_thread
def estimate(recording: Recording, name: str, options: Options | None = None) -> YawRate:
    """Spin rate of a recording by the method of that name, or by `best`.

    What no estimator may use is taken out first (`discsim.estimators.usable`). Raises `InputError` for an unknown name
    (listing those there are), a missing sensor, or what the method raises.
    """
    require_type(name, str, "name", f"the name of a method: best, {', '.join(METHODS)}")
    options = Options.of(options)
    if name == "best":
        return best(recording, options)
    if name not in METHODS:
        raise InputError(f"no method '{name}'; expected one of best, {', '.join(METHODS)}")
    return _estimate(usable(recording), name, options)


def _estimate(sound: Usable, name: str, options: Options) -> YawRate:
    for sensor in METHODS[name].sensors:
        if sensor in sound.gone:
            raise InputError(f"{sensor}: {sound.gone[sensor]}")
    found = _clocked(METHODS[name].estimate(sound.recording, options), sound.recording)
    with np.errstate(invalid="ignore"):
        possible = (np.abs(found.rate) <= FASTEST) & (found.sd <= FASTEST)
    if np.all(possible | np.isnan(found.rate)):
        return found
    rate, sd = np.where(possible, found.rate, np.nan), np.where(possible, found.sd, np.nan)
    return replace(found, rate=rate, sd=sd)


def folded(recording: Recording, name: str) -> str:
    """Return why a method shows another rate than the spin's; empty where it may show that.

    A gyroscope's limit tells it, or that a throw would spin up by the field alone. What a gyroscope in range says is
    told beside the rates (`folding_notes`).
    """
    if name not in BY_THE_FIELD or "magnetometer" not in recording:
        return ""
    bounded = mostly_clipped(recording)
    # with the settings that `fusion` has asked with just before, so that it is not worked out again
    if not (bounded or by_slow_field(recording)) or unfolding(recording, FusionSettings()) == (0, True):
        return ""
    rate = 1.0 / recording.need("magnetometer").interval
    told = "by the limit of the gyroscope" if bounded else "as it would spin up in the air else, or by its pull,"
    return (
        f"{told} it spins faster than {rate:.3g} readings of a field in a second show: beyond half of them it seems to "
        "turn more slowly, or the other way"
    )


def _clocked(found: YawRate, recording: Recording) -> YawRate:
    """Return a rate that goes by the magnetometer's time with what its sampling rate is stated to be off by."""
    sheet = recording.sheets.get("magnetometer")
    if sheet is None or found.method not in BY_THE_CLOCK or not sheet.rate_uncertainty > 0:
        return found
    return replace(found, sd=np.hypot(found.sd, sheet.rate_uncertainty * np.abs(found.rate)))


@one_thread
def all_methods(
    recording: Recording,
    options: Options | None = None,
    *,
    each: Callable[[Iterable[str]], Iterable[str]] = iter,
) -> tuple[list[YawRate], dict[str, str]]:
    """Return what every method gives, and the methods left out, each with the reason in a sentence.

    ``each`` passes the names of the methods through as they are tried, to show how far it is.
    Raises `InputError` where no method can be used.
    """
    options, sound = Options.of(options), usable(recording)
    rates: list[YawRate] = []
    left_out: dict[str, str] = {}
    for name in each(METHODS):
        if absent := missing_sensors(recording, name):
            left_out[name] = f"no {', '.join(absent)} in the recording"
            continue
        if told := folded(sound.recording, name):
            left_out[name] = told
            continue
        try:
            found = _estimate(sound, name, options)
        except InputError as error:
            left_out[name] = str(error)
            continue
        if np.any(np.isfinite(found.rate)):
            rates.append(found)
        else:
            left_out[name] = _why_unknown(sound.recording, name, options)
    if not rates:
        raise InputError(f"{recording.path or recording.name}: no method tells the spin ({_in_words(left_out)})")
    return rates, left_out


def best(recording: Recording, options: Options | None = None) -> YawRate:
    """Spin rate by the first of `METHODS` that knows it for half of its samples, else by the one that knows most.

    A gyroscope that clips for most of a recording thus gives way to a magnetometer. The result bears the name of the
    method taken. Raises `InputError` where no method can be used, with each one's reason.
    """
    return best_of(recording, options)[0]


@one_thread
def best_of(recording: Recording, options: Options | None = None) -> tuple[YawRate, dict[str, str]]:
    """Return the rate of `best`, and why each method that it prefers to the one taken was passed over."""
    options, sound = Options.of(options), usable(recording)
    reasons: dict[str, str] = {}
    candidates: list[tuple[float, YawRate]] = []
    for name in METHODS:
        if absent := missing_sensors(recording, name):
            reasons[name] = f"no {', '.join(absent)}"
            continue
        if told := folded(sound.recording, name):
            reasons[name] = told
            continue
        try:
            candidate = _estimate(sound, name, options)
        except InputError as error:
            reasons[name] = str(error)
            continue
        share = float(np.mean(np.isfinite(candidate.rate))) if len(candidate) else 0.0
        if share >= ENOUGH:
            return _with_contradiction(candidate, sound.recording), reasons
        if share > 0:
            reasons[name] = f"knows the rate for {100 * share:.2g} % of its times only"
            candidates.append((share, candidate))
        else:
            reasons[name] = _why_unknown(sound.recording, name, options)
    if not candidates:
        raise InputError(f"{recording.path or recording.name}: no method can be used ({_in_words(reasons)})")
    taken = max(candidates, key=lambda pair: pair[0])[1]  # of equals the first, which is the one preferred
    taken = _with_contradiction(taken, sound.recording)
    return taken, {name: reason for name, reason in reasons.items() if name != taken.method}


def _in_words(reasons: Mapping[str, str]) -> str:
    """Return why methods were left out, those of one reason together."""
    alike: dict[str, list[str]] = {}
    for name, reason in reasons.items():
        alike.setdefault(reason, []).append(name)
    return "; ".join(f"{', '.join(names)}: {reason}" for reason, names in alike.items())


def _with_contradiction(taken: YawRate, recording: Recording) -> YawRate:
    """Return an estimate whose standard deviation holds what its sensor and the magnetometer contradict each other by.

    Which of the two is right nothing can tell then (`fusion` is silent): the rms of their difference is what either may
    be off by. An accelerometer against the magnetometer's methods is not counted: its mount is the likelier fault.
    """
    sensor = DOUBTED_BY.get(taken.method)
    if sensor is None or not contradictions(recording):
        return taken
    off = [one.scatter for one in compare_sensors(recording) if one.sensor == sensor and not one.agrees]
    return replace(taken, sd=np.hypot(taken.sd, off[0])) if off else taken


def _why_unknown(recording: Recording, name: str, options: Options) -> str:
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
    if name == "fusion" and (told := folded(recording, BY_THE_FIELD[0])):
        return told
    if name in ("fusion", "accelerometer_calibrated"):
        against = contradictions(recording)
        if against:
            names = " and ".join(line.split()[0] for line in against)
            return f"what the {names} shows contradicts the magnetometer, by how much the notes say"
    if name == "fft":
        magnetometer = recording.need("magnetometer")
        if np.all(_tumbling(recording, magnetometer.t, options.fft.window * magnetometer.interval)):
            return "the gyroscope shows no steady spin about z, which a line in the field's spectrum takes for granted"
        if (longest := _longest_whole(magnetometer)) < options.fft.window:
            return (
                f"no window of {options.fft.window} samples is without gaps: readings or rows are missing, and at most "
                f"{longest} come on end; --window takes fewer, and tracking and likelihood go across gaps"
            )
        lowest = f"{np.degrees(options.fft.threshold):.0f} deg/s"
        return f"no window of {options.fft.window} samples shows a line above {lowest}; --threshold looks lower"
    return "no part of the recording shows a spin to it"


def _longest_whole(magnetometer: Samples) -> int:
    """Return how many readings of x and y come on end, none missing nor more than half a sample off its time."""
    known = np.asarray(np.isfinite(magnetometer.value[:, :2]).all(axis=1))
    even = np.abs(np.diff(magnetometer.t) - magnetometer.interval) <= magnetometer.interval / 2
    steps = runs(known[1:] & known[:-1] & even)
    return 1 + max((after - first for first, after in steps), default=0)


def missing_sensors(recording: Recording, name: str) -> tuple[str, ...]:
    """Return the sensors that a method needs and a recording has not."""
    return tuple(sensor for sensor in METHODS[name].sensors if sensor not in recording)
