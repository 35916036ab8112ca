"""Units that are not those of the columns: a magnitude off by a factor that some unit has, and by nothing near one.

Field strengths, gravity, the pull towards the axis and the rate at which the field turns are known to some tens of
per cent before anything is fitted; a wrong unit is off by a factor of nine at least. So each magnitude names its unit,
or none: where it is near one, or near no unit's factor, nothing is said.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Effect, effect_of
from discsim.effects.setup import UNITS, AccelerometerUnit, ClockUnit, GyroscopeUnit, MagnetometerUnit
from discsim.estimators.fusion import slow_field
from discsim.glitches import FASTEST_SPIN
from discsim.recording import Recording, Samples
from discsim.validation.diagnosis.signals.spin_signals import FEWEST, PURE, turning_axis

__all__ = ["ClockDoubt", "clock_doubts", "clock_unit", "sensor_units"]

#: a magnitude within this factor of another unit's is taken for it, and within it of the right one for right; half way
#: between the nearest units (rpm and deg/s are 6 apart, s and ms 1000) is 2.4
NEAR = 2.2
#: more than the field's own size, with soft iron, turns in no sensor
_SWING = 1.6
#: steps are a unit's factor times the resolution to this share: sheets round it, and two decimals of deg/s round a step
#: of 0.061; and fewest readings whose smallest difference is a step
_EXACT, _TELLING = 0.03, 100
_UNITS_OF: Mapping[str, type[Any]] = MappingProxyType({"accelerometer": AccelerometerUnit, "gyroscope": GyroscopeUnit})
#: stamps that are the units' whole factor away from the stated rate, within this share, are in that unit
_STAMPS = 0.3
#: what one sensor's times may be in; a rate that is stated so many times too high by mistake is hardly met
_TIMES = MappingProxyType({1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"})
#: times of all sensors that are off by one factor, alike within this share, are ticks of one clock
_ONE_CLOCK = 0.05


@dataclass(frozen=True)
class ClockDoubt:
    """Times of some ``sensors`` that lie a ``factor`` further apart than the stated rates say.

    ``unit`` is empty where the factor is none's; ``what``, ``expected`` and ``remedy`` are parts of a sentence.
    """

    sensors: tuple[str, ...]
    factor: float
    unit: str

    @property
    def what(self) -> str:
        """What contradicts what."""
        of = "its" if len(self.sensors) == 1 else "all"
        return f"{of} times lie {self.factor:.4g} times as far apart as rate_hz says"

    @property
    def expected(self) -> str:
        """What a file's times are in."""
        return "seconds"

    @property
    def remedy(self) -> str:
        """What mends it."""
        which = f"{self.sensors[0]}.csv" if len(self.sensors) == 1 else "every file"
        seconds = f"multiply time_s of {which} by {1.0 / self.factor:.4g}"
        if self.unit:
            return f"they are {self.unit}: {seconds}"
        return f"are they ticks of {1.0 / self.factor:.4g} s? Then {seconds}; else correct rate_hz"

    @property
    def sentence(self) -> str:
        """The doubt in one line."""
        return f"{', '.join(self.sensors)}: {self.what}; expected {self.expected}; {self.remedy}"


def clock_unit(recordings: Sequence[Recording]) -> Effect | None:
    """Return the unit of time where every sensor's stamps lie a thousand, or a million, times the stated spacing apart.

    Where the rates were taken from the stamps themselves, the fixes' positions over their velocities tell.
    """
    spacing = [
        samples.interval * one.sheets[name].rate_hz
        for one in recordings
        for name, samples in one.samples.items()
        if len(samples) > FEWEST
    ]
    taken = [ratio for one in recordings if (ratio := _path_ratio(one)) is not None]
    for unit, factor in UNITS[ClockUnit].items():
        # rates that were taken from the stamps themselves are right in any unit; velocities are not
        by_stamps, by_path = (all(abs(one / factor - 1.0) < _STAMPS for one in some) for some in (spacing, taken))
        usual = all(1.0 / NEAR < one < NEAR for one in spacing)
        if factor > 1.0 and ((by_path and (by_stamps or usual)) if taken else (by_stamps and bool(spacing))):
            return effect_of(ClockUnit(unit))
    return None


def clock_doubts(recording: Recording) -> tuple[ClockDoubt, ...]:
    """Return which sensors' times are in another unit than seconds by the rates that are stated for them.

    Of one sensor the usual units are told, of all of them any factor that they share, as of a timer's ticks.
    """
    spacing = {
        name: samples.interval * recording.sheets[name].rate_hz
        for name, samples in recording.samples.items()
        if len(samples) > FEWEST
    }
    doubts = []
    for factor, unit in _TIMES.items():
        own = tuple(name for name, one in spacing.items() if abs(one / factor - 1.0) < _STAMPS)
        doubts += [ClockDoubt(own, factor, unit)] if own else []
    middle = float(np.median([*spacing.values()])) if spacing else 1.0
    if not doubts and len(spacing) > 1 and middle > NEAR:
        alike = all(abs(one / middle - 1.0) < _ONE_CLOCK for one in spacing.values())
        doubts += [ClockDoubt(tuple(spacing), middle, "")] if alike else []
    return tuple(doubts)


def _path_ratio(recording: Recording) -> float | None:
    """Return how many times longer fixes take by their stamps than by their velocities."""
    samples = recording.get("gps")
    if samples is None:
        return None
    good = np.all(np.isfinite(samples.value), axis=1)
    if np.count_nonzero(good) < FEWEST:
        return None
    way = np.linalg.norm(np.diff(samples.value[good, :3], axis=0), axis=1)
    speed = np.linalg.norm(samples.value[good, 3:], axis=1)
    taken = np.diff(samples.t[good])
    fast = speed[1:] > 3.0
    if np.count_nonzero(fast) < FEWEST:
        return None
    return float(np.median(taken[fast] * speed[1:][fast] / np.maximum(way[fast], 1e-9)))


def sensor_units(recordings: Sequence[Recording]) -> list[Effect]:
    """Return the units of the sensors where a sensor's magnitude is that of another unit."""
    found = []
    kinds: tuple[tuple[type[Any], Callable[[Recording], float | None]], ...] = (
        (MagnetometerUnit, _field_ratio),
        (AccelerometerUnit, _force_ratio),
        (GyroscopeUnit, _rate_ratio),
    )
    for kind, ratio in kinds:
        turning = recordings if kind is MagnetometerUnit else [_where_it_turns(one) for one in recordings]
        ratios = [value for one in turning if (value := ratio(one)) is not None]
        if ratios:
            unit = _nearest(float(np.median(ratios)), UNITS[kind])
            if unit is not None:
                found.append(effect_of(kind(unit)))
    return found


def _where_it_turns(recording: Recording) -> Recording:
    """Return the seconds of a recording in which the field changes most: a whole log rests before and after a spin."""
    field = recording.get("magnetometer")
    if field is None or len(field) < FEWEST:
        return recording
    second = np.floor(field.t[1:]).astype(np.int64)
    seconds, place, count = np.unique(second, return_inverse=True, return_counts=True)
    steps = np.nan_to_num(np.sum(np.diff(field.value, axis=0) ** 2, axis=1))
    size = np.sqrt(np.bincount(place, steps) / count)
    chosen = seconds[size >= 0.5 * np.max(size)]
    samples = {}
    for name, one in recording.samples.items():
        there = np.isin(np.floor(one.t), chosen)
        samples[name] = Samples(one.t[there], one.value[there]) if np.count_nonzero(there) >= FEWEST else one
    return replace(recording, samples=samples)


def _nearest(ratio: float, units: Mapping[str, float]) -> str | None:
    """Return the unit whose factor is nearest to a ratio, None for the right unit, or where none is near."""
    if not ratio > 0.0:
        return None
    apart = {unit: abs(float(np.log(ratio / factor))) for unit, factor in units.items()}
    unit = min(apart, key=lambda name: apart[name])
    return unit if units[unit] != 1.0 and apart[unit] < np.log(NEAR) else None


def _whole(recording: Recording, sensor: str) -> FloatArray | None:
    samples = recording.get(sensor)
    if samples is None:
        return None
    good = samples.value[np.all(np.isfinite(samples.value), axis=1)]
    return good if len(good) >= FEWEST else None


def _field_ratio(recording: Recording) -> float | None:
    """Return the field's size over the stated one, 1 where that can be right; None where none is stated.

    Iron may add any number to the whole, but nothing to what turns, and what turns is at most the field.
    """
    value = _whole(recording, "magnetometer")
    strength = float(np.linalg.norm(recording.environment.magnetic_field))
    if value is None or strength == 0.0:
        return None
    swing = 0.5 * float(np.max(np.percentile(value, 98, axis=0) - np.percentile(value, 2, axis=0))) / strength
    whole = float(np.median(np.linalg.norm(value, axis=1))) / strength
    return whole if swing > _SWING or whole < 1.0 / NEAR else 1.0


def _spin_of(recording: Recording) -> float | None:
    """Return the size of the spin, rad/s, that anything but gyroscope and accelerometer shows; None for no spin."""
    for samples in (recording.get("rate_reference"), recording.command):
        if samples is not None:
            return float(np.sqrt(np.nanmean(samples.value**2)))
    samples = recording.get("magnetometer")
    if samples is None or len(samples) < FEWEST:
        return None
    turned = turning_axis(samples.t, samples.value)
    if turned is None or turned[1] < PURE:
        return None  # from one noisy reading to the next a field that hardly turns points anywhere
    d = np.diff(samples.value, axis=0)
    gap = np.diff(samples.t)
    usual = float(np.median(gap))
    angles = []
    for (a, b), (first, second) in zip(pairwise(d), pairwise(gap), strict=True):
        size = float(np.linalg.norm(a) * np.linalg.norm(b))
        if size > 0.0 and max(first, second) < 1.5 * usual:
            angles.append((float(np.arccos(np.clip(a @ b / size, -1.0, 1.0))), size))
    if len(angles) < FEWEST:
        return None
    angle, size = np.array(angles).T
    return float(np.sum(angle * size) / np.sum(size)) / usual


def _folds(recording: Recording) -> bool:
    """Tell a recording whose spin a magnetometer alone tells, and one too slow for the fastest throws."""
    return recording.command is None and "rate_reference" not in recording and slow_field(recording)


def _steps_ratio(recording: Recording, sensor: str) -> float | None:
    """Return the step between a sensor's readings over the resolution that its sheet states, where that is a unit's.

    In another unit steps are the resolution's exactly. A step of 1, 2 or 5 in a decimal place is that of rounding, and
    of few readings the smallest difference is that of no neighbours.
    """
    value, stated = _whole(recording, sensor), recording.sheets[sensor].resolution
    if value is None or not stated or len(value) < _TELLING:
        return None
    steps = np.diff(np.unique(value[:, 0]))
    steps = steps[steps > 1e-9 * float(np.max(np.abs(value)))]
    if not steps.size:
        return None
    step = float(np.min(steps))
    first = float(f"{step / 10.0 ** np.floor(np.log10(step)):.4g}")
    ratio, factors = step / stated, UNITS[_UNITS_OF[sensor]].values()
    exact = min(abs(float(np.log(ratio / factor))) for factor in factors) < np.log1p(_EXACT)
    return ratio if exact and first not in (1.0, 2.0, 5.0, 10.0) else None


def _force_ratio(recording: Recording) -> float | None:
    value, spin = _whole(recording, "accelerometer"), _spin_of(recording)
    if value is None:
        return None
    if spin is None:  # nothing tells how much a spin pulls
        return _steps_ratio(recording, "accelerometer")
    place = recording.sheets["accelerometer"].position
    pull = 0.0 if place is None or spin is None else spin**2 * float(np.hypot(place[0], place[1]))
    limit = recording.sheets["accelerometer"].range
    gravity = max(recording.environment.gravity, 1.0)
    expected = float(np.hypot(pull if limit is None else min(pull, limit), gravity))
    return float(np.sqrt(np.mean(np.sum(value**2, axis=1)))) / expected


def _rate_ratio(recording: Recording) -> float | None:
    value, spin = _whole(recording, "gyroscope"), _spin_of(recording)
    if value is None:
        return None
    if spin is None or spin < 1.0:
        return _steps_ratio(recording, "gyroscope")
    limit = recording.sheets["gyroscope"].range
    largest = float(np.max(np.abs(value)))
    if _folds(recording) and largest < FASTEST_SPIN:
        return None  # the field may show a part of the spin, and the readings are a spin's as they are
    if limit is not None and spin > limit:  # it clips: at its range, in whatever unit
        return largest / limit
    return float(np.sqrt(np.mean(np.sum(value**2, axis=1)))) / spin
