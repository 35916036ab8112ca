"""Sensors of one log on clocks that differ: a phone's files that each count from their own start, two loggers.

Takes readings in SI and how they lie; gives which sensor's times are to be moved, and by how much.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from discsim.arrays import FloatArray
from discsim.plain_arrays import recording_from_arrays
from discsim.validation.diagnosis.setup.late_sensor import LateSensor, late_sensor
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.spin_axis import Reading3

__all__ = ["late_clock", "moved"]

#: fewest readings of a sensor by which its clock is judged
FEWEST = 32


def late_clock(readings: Mapping[str, Reading3], matrix: Mapping[str, FloatArray]) -> LateSensor | None:
    """Return which sensor's times are off against the gyroscope's; None where none is, or nothing tells.

    ``matrix`` takes each sensor's axes to the body's. A magnetometer on another clock lies as that misleads: the spin
    axis is the gyroscope's for all.
    """
    if {"gyroscope", "magnetometer"} - set(readings):
        return None
    start = min((float(np.nanmin(one.t)) for one in readings.values() if np.isfinite(one.t).any()), default=0.0)
    arrays = {sensor: _ascending(one, start) for sensor, one in readings.items() if sensor != "accelerometer"}
    if any(t.size < FEWEST for t, _ in arrays.values()):
        return None
    turned = {sensor: (t, value @ matrix["gyroscope"].T) for sensor, (t, value) in arrays.items()}
    return late_sensor(recording_from_arrays(turned))


def _ascending(one: Reading3, start: float) -> tuple[FloatArray, FloatArray]:
    """Return the times (n,) since a start and the readings (n, 3), each time once."""
    known = np.isfinite(one.t)
    t, first = np.unique(one.t[known] - start, return_index=True)
    return t, one.value[known][first]


def moved(late: LateSensor, names: Mapping[str, str]) -> tuple[float, Decision]:
    """Return what is to be added to a sensor's times, s, and the decision; ``names`` are the sensors' files."""
    way = "late" if late.late > 0 else "early"
    which = f"'{names[late.sensor]}' is {late.text} s {way} against '{names[late.against]}'"
    offset = float(f"{-late.late:.3f}")
    return offset, Decision(f"{late.sensor} time", f"{offset:+.3f} s", "likely", f"{which}: {late.why}")
