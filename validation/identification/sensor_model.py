"""What the sensors of a recording would read of a motion, with any effect on them.

The catalogue's forms are those of docs/physics.md; motions come as rows (19,) of
`validation.identification.dynamics`, any number of neighbouring ones at once. Noise, rounding and clipping are the
fit's business.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE
from discsim.effects.sensors import CrossAxis, Scale, sensitivity
from discsim.effects.setup import BoardRotation, SiteField, field_there, on_board
from discsim.motion import State
from discsim.recording import Recording
from discsim.written import PREFIX
from validation.identification.competing_effects import row_of, user_effects_on
from validation.identification.dynamics import to_body
from validation.identification.parameters import Values
from validation.identification.plants import plant_of

__all__ = ["CLOCKS", "Values", "delay", "is_motion", "predicted", "value"]

#: the effects that only move the instants at which samples were taken
CLOCKS = tuple(row.id for row in CATALOGUE.values() if row.moves_time)
_FIELD = ("magnetic_north", "magnetic_east", "magnetic_down")
_BASELINE = {(row.id, name): none for row in CATALOGUE.values() for name, none in row.sizes.items()}


def value(values: Values, group: str, name: str) -> float:
    """Return a parameter of an effect: as given, or its baseline."""
    if (group, name) in values:
        return values[group, name]
    if (group, name) not in _BASELINE and (row := row_of(group)) is not None:
        return float(getattr(row.baseline, name))
    return float(_BASELINE.get((group, name), 0.0))


def is_motion(group: str) -> bool:
    """Tell whether a group of parameters acts on the motion (and not on a sensor)."""
    if (row := row_of(group)) is not None:
        return row.acts_on == "motion"
    return group in ("aero", "disc", "environment", "rig", "law")


def delay(values: Values, sensor: str, written: FloatArray) -> FloatArray:
    """Return by how much earlier (s) than written (n,) the samples of a sensor show the motion."""
    ratio = value(values, "clock.rate", "ratio")
    offset, prefix = 0.0, PREFIX.get(sensor)
    if prefix is not None:
        ratio *= value(values, f"{prefix}.clock_rate", "ratio")
        offset = value(values, f"{prefix}.time_offset", "offset_s")
    late = written - (written - offset) / ratio
    if sensor == "gps":
        late = late + value(values, "gps.latency", "delay_s")
    return late


def predicted(sensor: str, recording: Recording, values: Values, t: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the readings (..., m, k) of a sensor before lag and noise at true times t (m,) for rows (..., m, 19)."""
    readings = _by_catalogue(sensor, recording, values, t, rows)
    for effect in user_effects_on(sensor):
        sizes = [value(values, effect.id, name) for name in effect.row.parameters]
        if sizes != list(effect.row.baseline):
            flat = rows.reshape(-1, rows.shape[-1])
            times = np.broadcast_to(t, rows.shape[:-1]).ravel()
            changed = effect.on_readings(sizes, readings.reshape(-1, readings.shape[-1]), times, _state(times, flat))
            readings = changed.reshape(readings.shape)
    return readings


def _state(t: FloatArray, rows: FloatArray) -> State:
    """Return rows (n, 19) at times t (n,) as a state."""
    return State(t, rows[:, :3], rows[:, 3:6], rows[:, 6:9], rows[:, 9:13], rows[:, 13:16], rows[:, 16:19])


def _by_catalogue(sensor: str, recording: Recording, values: Values, t: FloatArray, rows: FloatArray) -> FloatArray:
    if sensor == "gps":
        return rows[..., :6]
    if sensor == "track":
        return rows[..., :3]
    if sensor == "rate_reference":
        return rows[..., 15:16]
    if sensor == "magnetometer":
        return _magnetometer(recording, values, rows)
    if sensor == "gyroscope":
        return _gyroscope(recording, values, t, rows)
    return _accelerometer(recording, values, t, rows)


def _field(recording: Recording, values: Values) -> FloatArray:
    moved = [values.get(("environment", name)) for name in _FIELD]
    stated = recording.environment.magnetic_field
    meant = np.array([own if new is None else new for own, new in zip(stated, moved, strict=True)])
    return field_there(SiteField(*(value(values, "site.field", name) for name in SiteField._fields)), meant)


def _on_board(values: Values, vector: FloatArray) -> FloatArray:
    """Return vectors (..., 3) of B along the axes of the sensor board."""
    return on_board(BoardRotation(*(value(values, "board.rotation", n) for n in BoardRotation._fields)), vector)


def _magnetometer(recording: Recording, values: Values, rows: FloatArray) -> FloatArray:
    m = _on_board(values, to_body(rows, np.broadcast_to(_field(recording, values), (*rows.shape[:-1], 3))))
    xx, xy, xz, yy, yz, zz = (
        value(values, "mag.soft_iron", f"s{name}") for name in ("xx", "xy", "xz", "yy", "yz", "zz")
    )
    m = m + m @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    m = m + np.array([value(values, "mag.hard_iron", f"b{axis}_uT") for axis in "xyz"])
    stray = np.array([value(values, "mag.stray_field", f"b{axis}_uT") for axis in "ned"])
    if np.any(stray):
        h = np.maximum(-rows[..., 2], 0.02)
        decay = np.exp(-h / value(values, "mag.stray_field", "height_m"))
        m = m + _on_board(values, to_body(rows, decay[..., None] * stray))
    return np.asarray(m)


def place(recording: Recording, values: Values) -> FloatArray:
    """Return where the accelerometer sits from the geometric centre, (3,) m in B."""
    stated = recording.sheets["accelerometer"].position if "accelerometer" in recording.sheets else None
    offset = [value(values, "accel.position_offset", f"d{axis}_m") for axis in "xyz"]
    return (np.zeros(3) if stated is None else np.array(stated)) + offset


def specific_force(recording: Recording, values: Values, rows: FloatArray) -> FloatArray:
    """Return f_B (..., 3) at the accelerometer, Eq. (1) with g's sign corrected, m/s^2."""
    d = place(recording, values)
    d = d - np.array([value(values, "body.mass_imbalance", "ex_m"), value(values, "body.mass_imbalance", "ey_m"), 0.0])
    gravity = values.get(("environment", "gravity"), recording.environment.gravity)
    if not plant_of(
        recording
    ).path_known:  # turns with the spin, like the translation that nobody knows: left to the means
        gravity = 0.0
    f = to_body(rows, rows[..., 6:9] - np.array([0.0, 0.0, gravity]))
    w, dw = rows[..., 13:16], rows[..., 16:19]
    along = w @ d
    squared = np.sum(w * w, axis=-1)
    f = f + w * along[..., None] - squared[..., None] * d
    f[..., 0] += dw[..., 1] * d[2] - dw[..., 2] * d[1]
    f[..., 1] += dw[..., 2] * d[0] - dw[..., 0] * d[2]
    f[..., 2] += dw[..., 0] * d[1] - dw[..., 1] * d[0]
    return np.asarray(f)


def _accelerometer(recording: Recording, values: Values, t: FloatArray, rows: FloatArray) -> FloatArray:
    f = _on_board(values, specific_force(recording, values, rows))
    scale = Scale(*(value(values, "accel.scale", f"s{axis}") for axis in "xyz"))
    cross = CrossAxis(*(value(values, "accel.cross_axis", name) for name in CrossAxis._fields))
    if any(scale) or any(cross):
        f = f @ sensitivity(scale, cross).T
    f = f + np.array([value(values, "accel.bias", f"b{axis}_m_s2") for axis in "xyz"])
    drift = np.array([value(values, "accel.bias_drift", f"b{axis}_m_s3") for axis in "xyz"])
    if np.any(drift):
        f = f + t[:, None] * drift
    limit = value(values, "accel.saturation", "limit_m_s2")
    return np.asarray(np.clip(f, -limit, limit) if np.isfinite(limit) else f)


def _gyroscope(recording: Recording, values: Values, t: FloatArray, rows: FloatArray) -> FloatArray:
    scale = np.array([value(values, "gyro.scale", f"s{axis}") for axis in "xyz"])
    w = _on_board(values, rows[..., 13:16]) * (1.0 + scale)
    w = w + np.array([value(values, "gyro.bias", f"b{axis}_rad_s") for axis in "xyz"])
    faked = np.array([value(values, "gyro.g_sensitivity", f"k{axis}") for axis in "xyz"])
    if np.any(faked):
        w = w + faked * _felt(recording, values, t, rows)
    return np.asarray(w)


def _felt(recording: Recording, values: Values, t: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the specific force (..., m, 3) that a gyroscope feels along its own axes at true times t (m,).

    Where the path is unknown the motion tells only the part of it that is centripetal; the accelerometer on the same
    chip has measured all of it, with errors of some per cent and so far below those of the gyroscope's faked rate.
    """
    measured = None if plant_of(recording).path_known else recording.get("accelerometer")
    if measured is not None:
        whole = np.all(np.isfinite(measured.value), axis=1)
        if np.count_nonzero(whole) > 1:
            written = t * value(values, "clock.rate", "ratio") * value(values, "accel.clock_rate", "ratio")
            written = written + value(values, "accel.time_offset", "offset_s")
            return np.stack([np.interp(written, measured.t[whole], f) for f in measured.value[whole].T], axis=-1)
    # the stated place: both sit on one chip
    here = {key: v for key, v in values.items() if key[0] != "accel.position_offset"}
    return _on_board(values, specific_force(recording, here, rows))
