"""What of a recording an estimator may use: no reading that no sensor can give, no stamp twice, no dead sensor."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from discsim.arrays import FloatArray
from discsim.clipping import clipping_notes, constant_axes, dead_axes
from discsim.errors import InputError, require_type
from discsim.estimators.ceiling import ceiling
from discsim.glitches import FASTEST_SPIN, glitches
from discsim.recording import Recording, Samples

__all__ = ["FASTEST", "Usable", "remembered", "unclipped", "usable"]

#: Largest reading that a sensor can give, in its unit: ten times the strongest permanent magnets; a thousand times a
#: shock sensor's 100 g range; and twice the fastest turbines there are (a dental drill's 4e4 rad/s).
LARGEST = {"magnetometer": 1e7, "accelerometer": 1e6, "gyroscope": 1e5, "rate_reference": 1e5}

#: No estimate of a spin rate beyond this, rad/s, is given: as for a gyroscope.
FASTEST = LARGEST["gyroscope"]

#: Stamps closer than this, s, are of one instant: clocks of microseconds are the finest that loggers have.
SAME_INSTANT = 1e-6

#: Slowest sampling that shows a spin, s: the longest window of `likelihood` (10.24 s) needs 14 readings.
SLOWEST = 0.7

#: Rows this many times as far apart as the sheet says have times that are hardly seconds.
_OTHER_CLOCK = 2.0

R = TypeVar("R")
P = ParamSpec("P")


def remembered(function: Callable[Concatenate[Recording, P], R]) -> Callable[Concatenate[Recording, P], R]:
    """Keep the last result of a function of a recording: several methods ask the same of one, and a smoother is slow.

    The recording is told by its identity, which is sound because it is read-only; other arguments by equality.
    """
    last: list[tuple[weakref.ref[Recording], tuple[object, ...], R]] = []

    @wraps(function)
    def remembering(recording: Recording, /, *args: P.args, **options: P.kwargs) -> R:
        asked = (args, options)
        if last and last[0][0]() is recording and last[0][1] == asked:
            return last[0][2]
        result = function(recording, *args, **options)
        last[:] = [(weakref.ref(recording), asked, result)]
        return result

    return remembering


@dataclass(frozen=True)
class Usable:
    """A recording with what cannot be used taken out, the sensors that are gone with the reason, and all in words."""

    recording: Recording
    gone: dict[str, str]
    notes: list[str]


@remembered
def usable(recording: Recording) -> Usable:
    """Take out of a recording what no estimator may use, and say what that is.

    Rows without any reading, which a faster log has between a slower sensor's, are no rows of that sensor. Left out are
    sensors that are dead (every reading of every axis is the same, or missing), or whose readings are too few or too
    far apart for a spin; axes of a gyroscope that never change while others do; readings beyond `LARGEST`; single rates
    that no throw has (`discsim.glitches`); and of readings of one instant all but the first. Clipped readings stay, for
    each method to judge: that there was much is all that they say. Raises `InputError` where nothing is left.
    """
    require_type(recording, Recording, "recording", "one Recording: read_recording(FOLDER) returns one")
    kept: dict[str, Samples] = {}
    gone: dict[str, str] = {}
    notes: list[str] = []
    for sensor, samples in recording.samples.items():
        if sensor not in LARGEST:
            kept[sensor] = samples
            continue
        sound, said = _sound(sensor, samples)
        notes += said
        reason = _useless(sensor, sound, recording.sheets[sensor].rate_hz)
        if reason:
            gone[sensor] = reason
        else:
            kept[sensor] = sound
    notes += [f"{sensor} left out: {reason}" for sensor, reason in gone.items()]
    if not set(kept) & set(LARGEST):
        why = "; ".join(f"{sensor}: {reason}" for sensor, reason in gone.items()) or f"none of {', '.join(LARGEST)}"
        path = "; a path tells a spin by how it bends: discsim diagnose" * ("track" in kept)
        raise InputError(f"{recording.path or recording.name}: no sensor that shows a spin ({why}){path}")
    changed = gone or any(kept[sensor] is not recording.samples[sensor] for sensor in kept)
    left = replace(recording, samples=kept) if changed else recording
    if (limit := ceiling(left)) is not None:
        sheet = replace(left.sheets["gyroscope"], range=limit.least)
        left = replace(left, sheets={**left.sheets, "gyroscope": sheet})
        notes.append(
            f"gyroscope z: its readings scatter about {np.degrees(limit.level):.0f} deg/s and do not change: its limit "
            f"with noise or a filter behind it, for it is {limit.why}"
        )
    return Usable(left, gone, notes + clipping_notes(left))


def unclipped(recording: Recording, sensor: str) -> Samples | None:
    """Return a sensor's samples with gaps where it clips, or None where the recording has none."""
    samples = recording.get(sensor)
    if samples is None:
        return None
    at_limit = recording.sheets[sensor].clipped(samples.value)
    return Samples(samples.t, np.where(at_limit, np.nan, samples.value)) if np.any(at_limit) else samples


def _sound(sensor: str, samples: Samples) -> tuple[Samples, list[str]]:
    notes = []
    t, value = samples.t, samples.value
    with np.errstate(invalid="ignore"):
        wild = np.abs(value) > LARGEST[sensor]
    if np.any(wild):
        value = np.where(wild, np.nan, value)
        notes.append(f"{sensor}: {np.count_nonzero(wild)} readings beyond {LARGEST[sensor]:.0e}, which no sensor gives")
    if np.any(alone := glitches(sensor, value)):
        value = np.where(alone, np.nan, value)
        first_at = t[np.flatnonzero(np.any(alone.reshape(t.size, -1), axis=1))[0]]
        notes.append(
            f"{sensor}: readings beyond {FASTEST_SPIN:g} rad/s, apart from those before and after, are left "
            f"out as glitches of the log: {np.count_nonzero(alone)}, the first at {first_at:.3f} s"
        )
    there = np.any(np.isfinite(value.reshape(t.size, -1)), axis=1)
    if not np.all(there):
        t, value = t[there], value[there]
    first = _instants(t)
    if first.size < t.size:
        notes.append(f"{sensor}: {t.size - first.size} of {t.size} readings are of the instant of the one before")
        t, value = t[first], value[first]
    if sensor == "gyroscope" and np.any(dead := dead_axes(value)):
        value = np.where(dead, np.nan, value)
        names = " and ".join("xyz"[axis] for axis in np.flatnonzero(dead))
        notes.append(f"{sensor} {names}: every reading is the same while others change; that axis does not work")
    unchanged = t is samples.t and value is samples.value
    return (samples if unchanged else Samples(t, value)), notes


def _instants(t: FloatArray) -> NDArray[np.int64]:
    """Return the indices of the readings that come at least `SAME_INSTANT` after the last one that counts."""
    close = np.diff(t) < SAME_INSTANT
    if not np.any(close):
        return np.arange(t.size)
    slot = np.floor((t - t[0]) / SAME_INSTANT)
    return np.asarray(np.unique(slot, return_index=True)[1])


def _useless(sensor: str, samples: Samples, stated_hz: float) -> str:
    """Return why nothing can be taken from a sensor of a stated rate; empty where something can."""
    known = np.isfinite(samples.value)
    if not np.any(known):
        return "it has no reading"
    if sensor != "rate_reference" and np.all(constant_axes(samples.value)[np.any(known, axis=0)]):
        return f"all its {len(samples)} readings are the same, as of a sensor that is dead or was not read"
    if sensor == "magnetometer" and not np.any(np.all(known, axis=1)):
        axis = "xyz"[int(np.argmin(np.count_nonzero(known, axis=0)))]
        return f"no reading has all three axes (there is no {axis})"
    if sensor != "rate_reference" and len(samples) > 1 and samples.interval > SLOWEST:
        slow = f"one reading in {samples.interval:.3g} s shows no spin; expected one in {SLOWEST} s at least"
        off = samples.interval * stated_hz > _OTHER_CLOCK
        return slow + (f" (rate_hz says {stated_hz:g} Hz: are its times in seconds?)" if off else "")
    return ""
