"""Readings that failed and stand in a recording as a number (-1, -999, 65535): which, what to say, and without them.

`discsim import` makes them gaps; a folder that was written otherwise still holds them, as they were or in SI.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.effects.setup import UNITS, AccelerometerUnit, GyroscopeUnit, MagnetometerUnit
from discsim.recording import SENSORS, Recording, Samples
from discsim.validation.checking.finding import Finding
from discsim.validation.rows.failed import failed_on_one_axis, failed_rows, on_all_axes

__all__ = ["failed_findings", "without_failed"]

#: numbers that a log may have written for a sensor's readings, over those in SI
_WRITTEN = {
    "magnetometer": tuple(UNITS[MagnetometerUnit].values()),
    "accelerometer": tuple(UNITS[AccelerometerUnit].values()),
    "gyroscope": tuple(UNITS[GyroscopeUnit].values()),
}
#: the body's axes on a board that lies any way round; all three reversed are one number again
_SIGNS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])


def failed_findings(recording: Recording) -> Iterator[Finding]:
    """Yield, of each sensor and number, the readings of a recording that stand for failed ones."""
    for sensor, cells in _failed(recording).items():
        samples = recording.samples[sensor]
        seen = np.where(cells, samples.value, np.nan)
        whole = np.abs(on_all_axes(np.abs(seen)))
        for number in np.unique(whole[np.isfinite(whole)]):
            rows = whole == number
            shown = seen[int(np.argmax(rows))]
            said = f"{shown[0]:.9g}" if np.all(shown == shown[0]) else ", ".join(f"{one:.9g}" for one in shown)
            yield _finding(recording, sensor, f"{said} on all axes", rows)
        single = np.where(np.isfinite(whole)[:, None], np.nan, seen)
        for axis, column in enumerate(SENSORS[sensor].columns):
            for number in np.unique(single[:, axis][np.isfinite(single[:, axis])]):
                yield _finding(recording, sensor, f"{number:.9g} in {column}", single[:, axis] == number)


def without_failed(recording: Recording) -> Recording:
    """Return a recording with gaps for readings that failed; the same one where none did."""
    failed = _failed(recording)
    if not failed:
        return recording
    mended = {
        sensor: Samples(recording.samples[sensor].t, np.where(cells, np.nan, recording.samples[sensor].value))
        for sensor, cells in failed.items()
    }
    return replace(recording, samples={**recording.samples, **mended})


def _failed(recording: Recording) -> dict[str, BoolArray]:
    """Return which cells (n, 3) of each sensor hold a number for a failed reading, of those in which any does."""
    found = {}
    for sensor, factors in _WRITTEN.items():
        if sensor in recording:
            cells = _cells(sensor, recording.samples[sensor].value, factors)
            if cells.any():
                found[sensor] = cells
    return found


def _cells(sensor: str, value: FloatArray, factors: Sequence[float]) -> BoolArray:
    """Return which cells of readings (n, 3) failed, in any unit and with any signs that a log may have."""
    cells = np.zeros(value.shape, dtype=np.bool_)
    for signs in _SIGNS:
        for factor in factors:
            cells |= failed_rows(sensor, value * signs * factor)[:, None]
    sound = np.where(cells, np.nan, value)
    for factor in factors:
        for sign in (1.0, -1.0):
            cells |= failed_on_one_axis(sign * factor * sound)
    return cells


def _finding(recording: Recording, sensor: str, shown: str, rows: BoolArray) -> Finding:
    """Return what is said of the rows (n,) in which a sensor shows a number for a failed reading."""
    count, first = int(np.count_nonzero(rows)), int(np.argmax(rows))
    line = "" if recording.path is None else f" (line {first + 2} of {sensor}.csv)"
    where = f"leave these cells of {sensor}.csv empty" if line else "make them NaN"
    return Finding(
        f"{sensor}.failed",
        "error",
        sensor,
        f"{shown} in {count} of {rows.size} rows amid other readings, the first at "
        f"{recording.samples[sensor].t[first]:.3f} s{line}",
        "a gap where a sensor was not read",
        f"this number stands for no reading: {where}, or import the raw log with `discsim import`, which makes gaps",
    )
