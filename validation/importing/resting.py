"""What a log shows while it lies still: a gyroscope's bias, an accelerometer whose sign is that of gravity.

Both change every spin of the log, and a throw that is cut out of it shows neither.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from discsim.arrays import FloatArray
from discsim.environment import Environment
from discsim.validation.rows.readings import Readings

__all__ = ["dip_at_rest", "rest_notes"]

#: It lies still over this long, s, where the force scatters by less than this share, and is gravity to this share
#: (zero-g offsets of cheap parts are 0.08 g, scales 3 %).
WINDOW, STEADY, GRAVITY = 0.5, 0.03, 0.12
#: Meanwhile a gyroscope scatters by less than this (rad/s: ten times the noise of cheap parts), the field by less (uT:
#: the cheapest parts have 1 an axis).
EVEN_RATE, EVEN_FIELD = 0.05, 2.0
#: A bias is told from this on, rad/s: data sheets allow 1 to 10 deg/s at zero rate. What is more than this share of the
#: fastest rate may be a slow turn.
BIAS, SLOW_TURN = 10.0 * np.pi / 180, 0.2
#: Sines of the field's dip that tell up from down: 30 degrees, more than a hard iron of 20 uT turns a field of 45.
TELLING = 0.5


def rest_notes(readings: Mapping[str, Readings], environment: Environment) -> list[str]:
    """Return what to say of the readings of a whole log (by sensor, in body axes) where it lies still.

    The field of the place tells the accelerometer's sign, where it is known.
    """
    accel = readings.get("accelerometer")
    if accel is None or accel.time.size < 2:
        return []
    means = _still(readings, environment.gravity)
    return [*_bias(means, readings), *_sign(means, environment)]


def dip_at_rest(readings: Mapping[str, Readings], gravity: float) -> float | None:
    """Return the field's dip below the horizon while the log lies still, degrees; None where it does not show.

    ``readings`` are those of a whole log by sensor in body axes, ``gravity`` m/s^2.
    """
    accel = readings.get("accelerometer")
    if accel is None or accel.time.size < 2 or "magnetometer" not in readings:
        return None
    means = _still(readings, gravity)
    return float(np.degrees(np.arcsin(_down(means)))) if "magnetometer" in means else None


def _down(means: Mapping[str, FloatArray]) -> float:
    """Return the sine of the field's dip by the means at rest."""
    force, field = means["accelerometer"], means["magnetometer"]
    sizes = np.linalg.norm(force, axis=1) * np.linalg.norm(field, axis=1)
    return -float(np.median(np.sum(force * field, axis=1) / np.maximum(sizes, 1e-9)))


def _still(readings: Mapping[str, Readings], gravity: float) -> dict[str, FloatArray]:
    """Return each sensor's means (k, 3) over the windows in which it lies still."""
    accel = readings["accelerometer"]
    limits = {"accelerometer": STEADY * gravity, "gyroscope": EVEN_RATE, "magnetometer": EVEN_FIELD}
    shown = [sensor for sensor in limits if sensor in readings]
    means: dict[str, list[FloatArray]] = {sensor: [] for sensor in shown}
    for start in np.arange(accel.time[0], accel.time[-1] - 0.99 * WINDOW, WINDOW).tolist():
        sound = {}
        for sensor in shown:
            first, stop = np.searchsorted(readings[sensor].time, [start, start + WINDOW]).tolist()
            value = readings[sensor].value[first:stop]
            sound[sensor] = value[np.isfinite(value).all(axis=1)]
        if any(len(value) < 3 or np.linalg.norm(value.std(axis=0)) > limits[s] for s, value in sound.items()):
            continue
        if abs(float(np.linalg.norm(sound["accelerometer"].mean(axis=0))) / gravity - 1) < GRAVITY:
            for sensor, value in sound.items():
                means[sensor].append(value.mean(axis=0))
    return {sensor: np.array(found) for sensor, found in means.items() if found}


def _bias(means: Mapping[str, FloatArray], readings: Mapping[str, Readings]) -> list[str]:
    if "gyroscope" not in means:
        return []
    bias = np.median(means["gyroscope"], axis=0)
    fastest = float(np.nanmax(np.linalg.norm(readings["gyroscope"].value, axis=1)))
    if not BIAS < np.linalg.norm(bias) < SLOW_TURN * fastest:
        return []
    shown = ", ".join(f"{axis:.3g}" for axis in np.degrees(bias))
    return [
        f"WARNING: gyroscope: while the log lies still it reads {shown} deg/s (x, y, z); expected 0 to 10 deg/s: a "
        "bias, which is in every spin: take it off the columns"
    ]


def _sign(means: Mapping[str, FloatArray], environment: Environment) -> list[str]:
    if "magnetometer" not in means or not environment.field_known:
        return []
    down = _down(means)
    expected = float(environment.magnetic_field[2] / np.linalg.norm(environment.magnetic_field))
    if min(abs(down), abs(expected)) < TELLING or down * expected > 0:
        return []
    seen, dip = np.degrees(np.arcsin([down, expected]))
    return [
        f"WARNING: accelerometer and magnetometer contradict one another while the log lies still: the field dips by "
        f"{seen:.0f} deg; expected {dip:.0f} deg at this place: the accelerometer's sign is that of gravity (then turn "
        "the sign of its scale in the map, and up and down of all axes), or the magnetometer's is reversed, and the "
        "spin may be of the other sense; or the place is on the other side of the equator: southern latitudes are "
        "negative"
    ]
