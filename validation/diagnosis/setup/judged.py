"""The part of a recording by which a setup is judged: where it turns most, of the sensors that can tell anything."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from discsim.effects.kind import BOARD
from discsim.recording import Recording, Samples
from discsim.validation.diagnosis.setup.reference import field_is_folded
from discsim.validation.identification.plants import plant_of

__all__ = ["judgeable"]

#: what is judged of a long recording turns at this share of the fastest rate or more, asked every so many s (half a
#: turn at 6 rad/s), of a slow log every so many readings: one alone scatters about no mean
_QUARTER, _SLOT, _READINGS = 0.25, 0.5, 4


def judgeable(recording: Recording) -> Recording:
    """Return the part of a recording that is judged: where it turns most, if it is long.

    Without its magnetometer where the field is not stated: nothing tells what it should read; nor where the reference
    turns too fast for its readings: a field that is folded seems to go the other way round. Without a sensor of the
    board of which an axis was never read, or every reading is the same: what is dead agrees with any order of axes.
    """
    kept = {name: own for name, own in recording.samples.items() if name not in BOARD or _alive(own)}
    if not recording.environment.field_known or field_is_folded(recording):
        kept.pop("magnetometer", None)
    busiest = _busiest(kept, plant_of(recording).durations.setup)
    if busiest is not None:
        kept = {name: samples.between(*busiest) for name, samples in kept.items()}
    return replace(recording, samples=kept)


def _alive(samples: Samples) -> bool:
    """Tell a sensor that was read on every axis and whose readings are not all the same."""
    value = samples.value if samples.value.ndim == 2 else samples.value[:, None]
    read = np.isfinite(value)
    if not read.any(axis=0).all():
        return False
    first = value[read.argmax(axis=0), np.arange(value.shape[1])]
    return len(samples) == 1 or bool(np.any(read & (value != first)))


def _busiest(samples: Mapping[str, Samples], length: float) -> tuple[float, float] | None:
    """Return from when to when, s, sensors turn on end in a recording longer than ``length`` s, at most that long.

    The longest stretch that turns at a quarter of the fastest rate or more; None of a shorter recording. Where that
    sensor is shorter and another is not, whose clock may have jumped, from its first reading on.
    """
    turning = next((samples[name] for name in ("gyroscope", "magnetometer", "accelerometer") if name in samples), None)
    if turning is None or len(turning) < 2:
        return None
    if turning.t[-1] - turning.t[0] <= length:
        longer = any(len(one) and one.t[-1] - one.t[0] > length for one in samples.values())
        return (float(turning.t[0]), float(turning.t[0]) + length) if longer else None
    width = max(_SLOT, _READINGS * float(turning.t[-1] - turning.t[0]) / (len(turning) - 1))
    slot = ((turning.t - turning.t[0]) / width).astype(int)
    count = np.maximum(np.bincount(slot), 1)
    value = np.nan_to_num(turning.value)
    square = np.bincount(slot, np.sum(value**2, axis=1)) / count
    if turning is not samples.get("gyroscope"):
        # what turns scatters about its mean
        mean = np.stack([np.bincount(slot, column) for column in value.T], axis=1) / count[:, None]
        square = np.maximum(square - np.sum(mean**2, axis=1), 0.0)
    fast = np.concatenate([[False], square > _QUARTER**2 * np.max(square), [False]])
    starts, stops = np.flatnonzero(~fast[:-1] & fast[1:]), np.flatnonzero(fast[:-1] & ~fast[1:])
    if not starts.size:
        # a sensor that steps from one reading to another once shows no turning in any slot
        return float(turning.t[0]), float(turning.t[0]) + length
    longest = int(np.argmax(stops - starts))
    first = float(turning.t[0]) + width * float(starts[longest])
    return first, first + min(length, width * float(stops[longest] - starts[longest]))
