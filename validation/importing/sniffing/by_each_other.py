"""Units that two sensors of a log show of each other: by lift, by the pull to the centre, by how far gravity turned.

Takes readings as written, their times and the units that sizes show; gives the units.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from discsim.arrays import FloatArray
from discsim.recording import SENSORS
from discsim.validation.importing.sniffing.groups import Triple
from discsim.validation.importing.sniffing.lift import along, unit_by_lift
from discsim.validation.importing.sniffing.magnitudes import Unit
from discsim.validation.importing.sniffing.pull import arm, steady_arm, unit_by_pull
from discsim.validation.importing.sniffing.rests import unit_by_rests
from discsim.validation.importing.sniffing.spin_axis import Reading3
from discsim.validation.importing.sniffing.swings import unit_by_swings
from discsim.validation.importing.sniffing.units import COUNTS

__all__ = ["by_each_other", "in_si"]

#: A log rests on gravity where its rate is below this, rad/s, in more than this share of its rows: `gravity_norm` looks
#: for what most windows share, and a rest of a twentieth of a spin is what `rest_norm` takes.
SLOW, RESTS = 1.0, 0.05


def by_each_other(
    found: Mapping[str, Triple], times: Mapping[str, FloatArray], units: Mapping[str, Unit], *, timed: bool
) -> tuple[Mapping[str, Unit], float | None]:
    """Return the units as the sensors show them of each other, and the accelerometer's arm by the gyroscope, m.

    ``timed`` is whether the rows' times are no guess. The arm is None where it does not show, or has mended a unit.
    """
    if "gyroscope" not in found:
        return units, None
    if timed:
        units = _by_swings(found, times, units)
    if "accelerometer" not in found:
        return units, None
    units = _by_lift(found, times, units)
    gyro, accel = (_reading(times[sensor], found[sensor].values) for sensor in ("gyroscope", "accelerometer"))
    if timed and (unit := unit_by_rests(units["gyroscope"], gyro, accel)) is not None:
        units = {**units, "gyroscope": unit}
    return _by_pull(found, times, units)


def in_si(sensor: str, triple: Triple, time: FloatArray, unit: Unit) -> Reading3:
    """Return a sensor's readings in the recording's unit."""
    return _reading(time, triple.values * unit.factor(SENSORS[sensor].unit))


def _by_swings(
    found: Mapping[str, Triple], times: Mapping[str, FloatArray], units: Mapping[str, Unit]
) -> Mapping[str, Unit]:
    """Return the units, a gyroscope's by how often it swings where that refutes deg/s."""
    gyro, by_radians = _reading(times["gyroscope"], found["gyroscope"].values), None
    if "accelerometer" in found:
        accel = in_si("accelerometer", found["accelerometer"], times["accelerometer"], units["accelerometer"])
        if arm(gyro, accel) is not None:
            return units  # the pull tells more than a swing
        by_radians = steady_arm(gyro, accel)
    unit = unit_by_swings(units["gyroscope"], gyro, by_radians)
    return units if unit is None else {**units, "gyroscope": unit}


def _by_lift(
    found: Mapping[str, Triple], times: Mapping[str, FloatArray], units: Mapping[str, Unit]
) -> Mapping[str, Unit]:
    """Return the units, an accelerometer's by lift where nothing in the log rests on gravity."""
    gyro = in_si("gyroscope", found["gyroscope"], times["gyroscope"], units["gyroscope"])
    if np.mean(np.linalg.norm(gyro.value, axis=1) < SLOW) > RESTS:
        return units
    triple, unit = found["accelerometer"], units["accelerometer"]
    stated = bool(triple.units) and triple.units[0].unit != COUNTS
    counts = np.array_equal(sound := triple.values[np.isfinite(triple.values).all(axis=1)], np.round(sound))
    by_lift = unit_by_lift(unit, along(gyro, times["accelerometer"], triple.values), stated=stated, counts=counts)
    return units if by_lift is None else {**units, "accelerometer": by_lift}


def _by_pull(
    found: Mapping[str, Triple], times: Mapping[str, FloatArray], units: Mapping[str, Unit]
) -> tuple[Mapping[str, Unit], float | None]:
    """Return the units, a gyroscope's by the pull to the centre where that refutes header or guess, and the arm, m."""
    if not found["gyroscope"].units and units["gyroscope"].decision.sure != "guess":
        return units, None
    gyro, accel = (
        in_si(sensor, found[sensor], times[sensor], units[sensor]) for sensor in ("gyroscope", "accelerometer")
    )
    seen = arm(gyro, accel)
    shown = steady_arm(gyro, accel) if seen is None and units["gyroscope"].decision.sure == "guess" else seen
    unit = unit_by_pull(units["gyroscope"], shown)
    return (units, seen) if unit is None else ({**units, "gyroscope": unit}, None)


def _reading(t: FloatArray, value: FloatArray) -> Reading3:
    """Return the rows with a time, in its order."""
    if np.all(np.diff(t) >= 0):
        return Reading3(t, value)
    order = np.argsort(t, kind="stable")
    order = order[np.isfinite(t[order])]
    return Reading3(t[order], value[order])
