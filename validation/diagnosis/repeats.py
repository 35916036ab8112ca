"""Sensors whose readings a faster logger wrote again with each of its rows: the readings themselves.

A repeat says that nothing moved between two rows, which noise and a spinning field contradict. Takes the samples of a
recording; gives those of fresh readings, by the rule with which logs are imported.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.recording import Recording, Samples
from discsim.validation.rows import cleaning
from discsim.validation.rows.held import find_held, with_holes_filled
from discsim.validation.rows.readings import Readings

__all__ = ["fresh", "without_held_readings"]


def without_held_readings(recording: Recording) -> tuple[Recording, list[str]]:
    """Return a recording without readings that were written again with the rows of a faster log, and what is said."""
    samples, sheets, said = dict(recording.samples), dict(recording.sheets), []
    for sensor, one in recording.samples.items():
        samples[sensor], rate, note = fresh(sensor, one)
        if rate is not None:
            sheets[sensor] = replace(sheets[sensor], rate_hz=rate)
            said.append(note)
    return (replace(recording, samples=samples, sheets=sheets), said) if said else (recording, [])


def fresh(sensor: str, samples: Samples) -> tuple[Samples, float | None, str]:
    """Return a sensor's samples without repeats, its own rate (Hz) and what to say; None and nothing without repeats.

    A reading has the time at which it was taken, where the rows tell that; rows that are gaps on all axes go, too.
    """
    table = samples.value.reshape(len(samples), -1)
    read = ~np.all(np.isnan(table), axis=1)
    found = Readings(np.flatnonzero(read), samples.t[read], with_holes_filled(table[read]))
    held = find_held(found.value) if np.any(read) else None
    if held is None:
        return samples, None, ""
    readings, period, said = cleaning.without_repeats(sensor, found, held, len(samples), stamped=True)
    # the first may have been taken up to a row before the first row: no motion is known there
    time = np.maximum(readings.time, samples.t[0])
    ascends = np.diff(time, prepend=-np.inf) > 0.0
    value = readings.value[ascends].reshape(-1, *samples.value.shape[1:])
    return Samples(time[ascends], value), 1.0 / period, f"{said}."
