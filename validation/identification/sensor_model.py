"""What the sensors of a recording would read of a motion, with any effect on them.

Errors of sensors act by the functions of `discsim.effects`, as in `discsim.sensors`; motions come as rows (19,) of
`validation.identification.dynamics`, any number of neighbouring ones at once. Noise, rounding and clipping are the
fit's business.
"""

from __future__ import annotations

from functools import cache
from typing import Any, TypeVar

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.body import MassImbalance
from discsim.effects.catalogue import CATALOGUE, catalogued
from discsim.effects.sensors import (
    AccelerometerBias,
    AccelerometerSaturation,
    BiasDrift,
    ClockRate,
    CrossAxis,
    GSensitivity,
    GyroscopeBias,
    HardIron,
    Latency,
    PositionOffset,
    Scale,
    SoftIron,
    StrayField,
    bias_drift,
    g_sensitivity,
    hard_iron,
    sensitivity,
    soft_iron,
    stray_field,
)
from discsim.effects.setup import BoardRotation, SiteField, TimeOffset, field_there, on_board
from discsim.motion import State
from discsim.recording import Recording
from validation.identification.competing_effects import CATALOGUED, Competing
from validation.identification.dynamics import to_body
from validation.identification.parameters import Values
from validation.identification.plants import plant_of

__all__ = ["CLOCKS", "Values", "delay", "is_motion", "predicted", "sized", "value"]

_Kind = TypeVar("_Kind")

#: the effects that only move the instants at which samples were taken
CLOCKS = tuple(row.id for row in CATALOGUE.values() if row.moves_time)
_FIELD = ("magnetic_north", "magnetic_east", "magnetic_down")
_BASELINE = {(row.id, name): none for row in CATALOGUE.values() for name, none in row.sizes.items()}


def value(values: Values, group: str, name: str) -> float:
    """Return a parameter of the catalogue: as given, or its baseline."""
    return float(values.get((group, name), _BASELINE.get((group, name), 0.0)))


@cache
def _places(kind: type[Any], acts_on: str | None) -> tuple[tuple[tuple[str, str], float], ...]:
    """Return the keys of an effect's parameters and their baselines; none where a sensor cannot have such an effect."""
    try:
        row = catalogued(kind, acts_on)
    except KeyError:
        return ()
    return tuple(((row.id, name), none) for name, none in row.sizes.items())


def sized(values: Values, kind: type[_Kind], acts_on: str | None = None) -> _Kind:
    """Return an effect of the catalogue by its type as values have it, those that are not given at their baseline.

    ``acts_on`` tells the sensor where several have one of this type.
    """
    made: Any = kind
    effect: _Kind = made(*(values.get(key, none) for key, none in _places(made, acts_on)))
    return effect


def is_motion(group: str, effects: Competing = CATALOGUED) -> bool:
    """Tell whether a group of parameters acts on the motion (and not on a sensor)."""
    if (row := effects.row(group)) is not None:
        return row.acts_on == "motion"
    return group in ("aero", "disc", "environment", "rig", "law")


def delay(values: Values, sensor: str, written: FloatArray) -> FloatArray:
    """Return by how much earlier (s) than written (n,) the samples of a sensor show the motion."""
    ratio = sized(values, ClockRate, "clock").ratio * sized(values, ClockRate, sensor).ratio
    late = written - (written - sized(values, TimeOffset, sensor).offset_s) / ratio
    return late + sized(values, Latency, sensor).delay_s


def predicted(
    sensor: str,
    recording: Recording,
    values: Values,
    t: FloatArray,
    rows: FloatArray,
    effects: Competing = CATALOGUED,
) -> FloatArray:
    """Return the readings (..., m, k) of a sensor before lag and noise at true times t (m,) for rows (..., m, 19)."""
    readings = _by_catalogue(sensor, recording, values, t, rows)
    for effect in effects.called_on(sensor):
        sizes = [values.get((effect.id, name), none) for name, none in effect.row.sizes.items()]
        if sizes != list(effect.value) and effect.applied is not None:
            flat = rows.reshape(-1, rows.shape[-1])
            times = np.broadcast_to(t, rows.shape[:-1]).ravel()
            changed = effect.applied.on_readings(
                sizes, readings.reshape(-1, readings.shape[-1]), times, _state(times, flat)
            )
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
    return field_there(sized(values, SiteField), meant)


def _on_board(values: Values, vector: FloatArray) -> FloatArray:
    """Return vectors (..., 3) of B along the axes of the sensor board."""
    return on_board(sized(values, BoardRotation), vector)


def _magnetometer(recording: Recording, values: Values, rows: FloatArray) -> FloatArray:
    m = _on_board(values, to_body(rows, np.broadcast_to(_field(recording, values), (*rows.shape[:-1], 3))))
    m = hard_iron(sized(values, HardIron), soft_iron(sized(values, SoftIron), m))
    stray = sized(values, StrayField)
    if any(stray[:3]):
        m = m + _on_board(values, to_body(rows, stray_field(stray, -rows[..., 2])))
    return np.asarray(m)


def place(recording: Recording, values: Values) -> FloatArray:
    """Return where the accelerometer sits from the geometric centre, (3,) m in B."""
    stated = recording.sheets["accelerometer"].position if "accelerometer" in recording.sheets else None
    return np.asarray((np.zeros(3) if stated is None else np.array(stated)) + sized(values, PositionOffset))


def specific_force(recording: Recording, values: Values, rows: FloatArray) -> FloatArray:
    """Return f_B (..., 3) at the accelerometer, Eq. (1) with g's sign corrected, m/s^2."""
    d = place(recording, values) - np.array([*sized(values, MassImbalance), 0.0])
    gravity = values.get(("environment", "gravity"), recording.environment.gravity)
    if not plant_of(recording).path_known:
        # it turns with the spin, like the translation that nobody knows: left to the means
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
    scale, cross = sized(values, Scale, "accelerometer"), sized(values, CrossAxis)
    if any(scale) or any(cross):
        f = f @ sensitivity(scale, cross).T
    f = f + np.array(sized(values, AccelerometerBias))
    drift = sized(values, BiasDrift)
    if any(drift):
        f = f + bias_drift(drift, t)
    limit = sized(values, AccelerometerSaturation).limit_m_s2
    return np.asarray(np.clip(f, -limit, limit) if np.isfinite(limit) else f)


def _gyroscope(recording: Recording, values: Values, t: FloatArray, rows: FloatArray) -> FloatArray:
    w = _on_board(values, rows[..., 13:16]) * (1.0 + np.array(sized(values, Scale, "gyroscope")))
    w = w + np.array(sized(values, GyroscopeBias))
    faked = sized(values, GSensitivity)
    if any(faked):
        w = w + g_sensitivity(faked, _felt(recording, values, t, rows))
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
            ratios = [sized(values, ClockRate, whose).ratio for whose in ("clock", "accelerometer")]
            written = t * ratios[0] * ratios[1] + sized(values, TimeOffset, "accelerometer").offset_s
            return np.stack([np.interp(written, measured.t[whole], f) for f in measured.value[whole].T], axis=-1)
    # the stated place: both sit on one chip
    moved = catalogued(PositionOffset).id
    here = {key: v for key, v in values.items() if key[0] != moved}
    return _on_board(values, specific_force(recording, here, rows))
