"""What the sensors of a recording would read of a motion, with any effect on them.

The sensors are those of `discsim.sensors`, their errors as the parameters of a fit have them; motions come as rows
(19,) of `discsim.validation.identification.dynamics`, any number of neighbouring ones at once. Noise, rounding and the
range are the fit's business.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any, TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from discsim.arrays import FloatArray
from discsim.effects.body import MassImbalance, centre_of_mass
from discsim.effects.catalogue import CATALOGUE, catalogued
from discsim.effects.kind import BOARD
from discsim.effects.sensors import AccelerometerSaturation, ClockRate, Lag, Latency
from discsim.effects.setup import BoardRotation, TimeOffset
from discsim.motion import State, Surroundings
from discsim.recording import Recording
from discsim.sensors import Accelerometer, Gps, Gyroscope, Magnetometer
from discsim.sensors.instruments import FIELDS, KINDS, Sensor
from discsim.sensors.position import Tracker
from discsim.sensors.rate_reference import RateReference
from discsim.validation.identification.competing_effects import CATALOGUED, Competing
from discsim.validation.identification.parameters import Values
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.sensitivities import MOTION

__all__ = ["CLOCKS", "Values", "delay", "is_motion", "predicted", "sensed", "sized", "value"]

_Kind = TypeVar("_Kind")

#: the effects that only move the instants at which samples were taken
CLOCKS = tuple(row.id for row in CATALOGUE.values() if row.moves_time)
_FIELD = ("magnetic_north", "magnetic_east", "magnetic_down")
_BASELINE = {(row.id, name): none for row in CATALOGUE.values() for name, none in row.fitted.items()}


def value(values: Values, group: str, name: str) -> float:
    """Return a parameter of the catalogue: as given, or its baseline."""
    return float(values.get((group, name), _BASELINE.get((group, name), 0.0)))


@cache
def _places(kind: type[Any], acts_on: str | None) -> tuple[type[Any], tuple[tuple[tuple[str, str], float], ...]]:
    """Return the type that a fit makes of an effect, and the keys of its numbers with their baselines.

    There are none where a sensor cannot have such an effect.
    """
    try:
        row = catalogued(kind, acts_on)
    except KeyError:
        return kind, ()
    made = kind if row.regular is None else row.regular.type
    return made, tuple(((row.id, name), none) for name, none in row.fitted.items())


def sized(values: Values, kind: type[_Kind], acts_on: str | None = None) -> _Kind:
    """Return an effect of the catalogue by its type as values have it, those that are not given at their baseline.

    ``acts_on`` tells the sensor where several have one of this type.
    """
    asked: Any = kind
    made, places = _places(asked, acts_on)
    effect: _Kind = made(*(values.get(key, none) for key, none in places))
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
    """Return the readings (..., m, k) of a sensor before lag and noise at true times t (m,) for rows (..., m, 19).

    Errors are along the axes of the board; of one that was turned back the readings are then turned back as well.
    """
    back = recording.turned_back if sensor in BOARD else None
    state, model, around = _state(t, rows), _model(sensor, recording, values), _surroundings(recording, values)
    if isinstance(model, Gyroscope):
        felt = _felt(recording, values, t) if any(model.g_sensitivity) else None
        readings = model.reading(state, around, felt if felt is None or back is None else felt @ back)
    else:
        readings = model.reading(state, around)
    limit = sized(values, AccelerometerSaturation).limit_m_s2 if sensor == "accelerometer" else np.inf
    sized_effects = (
        (effect, [values.get((effect.id, name), none) for name, none in effect.row.sizes.items()])
        for effect in effects.called_on(sensor)
    )
    acting = [
        (effect.applied, sizes) for effect, sizes in sized_effects if effect.applied and sizes != list(effect.value)
    ]

    def shown(readings: FloatArray) -> FloatArray:
        """Return readings (..., m, 3) with a limit, and with effects that act on whole readings, turned back."""
        readings = np.clip(readings, -limit, limit) if np.isfinite(limit) else readings
        for applied, sizes in acting:
            times = np.broadcast_to(t, rows.shape[:-1]).ravel()
            flat = _state(times, rows.reshape(-1, rows.shape[-1]))
            changed = applied.on_readings(sizes, readings.reshape(-1, readings.shape[-1]), times, flat)
            readings = changed.reshape(readings.shape)
        return np.asarray(readings if back is None else readings @ back.T)

    if isinstance(model, Accelerometer) and not plant_of(recording).path_known:
        along = model.reading_of(_ALONG_Z)
        shows = along if back is None else back @ along
        if acting or np.any(np.abs(shows[:2]) > _ROUND_OFF):
            return _with_lift(along, readings, shown, lambda: _felt(recording, values, t))
    return shown(readings)


def sensed(sensor: str, recording: Recording, values: Values, effects: Competing = CATALOGUED) -> tuple[str, ...]:
    """Return what of a motion a sensor's readings follow, of `discsim.validation.identification.sensitivities.MOTION`.

    Where the path is unknown its acceleration is no part of the motion, and no direction is told from another.
    """
    if effects.called_on(sensor):
        return MOTION
    model, path = _model(sensor, recording, values), plant_of(recording).path_known
    force = (("acceleration", "attitude") if path else ()) + ("rate", "angular_acceleration")
    match model:
        case Magnetometer():
            return ("position", "attitude") if any(model.stray_field[:3]) else ("attitude",)
        case Accelerometer():
            return force
        case Gyroscope():
            return force if any(model.g_sensitivity) else ("rate",)
        case Gps():
            return ("position", "velocity")
        case Tracker():
            return ("position",)
        case RateReference():
            return ("rate",)
        case _:
            return MOTION


def _state(t: FloatArray, rows: FloatArray) -> State:
    """Return rows (..., n, 19) at times t (n,) as a state."""
    return State(t, *(rows[..., a:b] for a, b in ((0, 3), (3, 6), (6, 9), (9, 13), (13, 16), (16, 19))))


@cache
def _errors(sensor: str) -> tuple[tuple[str, type[Any], str], ...]:
    """Return where errors sit in a sensor, their types and what they act on: those that act on a reading at once."""
    rows = [row for row in CATALOGUE.values() if row.acts_on == sensor and row.id in FIELDS]
    at_once = [row for row in rows if not (row.moves_time or row.hides_readings or row.type is Lag)]
    board = [("board", BoardRotation, "board")] if sensor in BOARD else []
    return (*((FIELDS[row.id], row.type, sensor) for row in at_once), *board)


def _model(sensor: str, recording: Recording, values: Values) -> Sensor:
    """Return a sensor with the errors that values have; both sensors on the accelerometer's chip sit where stated."""
    errors = [(place, sized(values, kind, acts_on)) for place, kind, acts_on in _errors(sensor)]
    if sensor in ("accelerometer", "gyroscope"):
        stated = recording.sheets["accelerometer"].position if "accelerometer" in recording.sheets else None
        errors.append(("position", (0.0, 0.0, 0.0) if stated is None else tuple(stated.tolist())))
    if recording.turned_back is not None and sensor in BOARD:
        errors = [(at, _beyond(one, recording.turned_back.tobytes()) if at == "board" else one) for at, one in errors]
    return _made(sensor, tuple(errors))


@lru_cache(256)
def _beyond(more: BoardRotation, turned_back: bytes) -> BoardRotation:
    """Return the turn of a board of which the readings were turned back by C (3, 3), and that is turned by more."""
    C = Rotation.from_matrix(np.frombuffer(turned_back).reshape(3, 3))
    return BoardRotation(*(Rotation.from_rotvec(more) * C).as_rotvec().tolist())


@lru_cache(256)
def _made(sensor: str, errors: tuple[tuple[str, Any], ...]) -> Sensor:
    """Return a sensor with errors by field; a fit asks for the same one for each batch of neighbours."""
    return KINDS[sensor](**dict(errors))


def _surroundings(recording: Recording, values: Values) -> Surroundings:
    """Return what the sensors of a recording sense besides its motion."""
    environment = recording.environment
    field = [
        values.get(("environment", name), each) for name, each in zip(_FIELD, environment.magnetic_field, strict=True)
    ]
    # where the path is unknown, gravity turns with the spin as the translation does: both are left to the means
    gravity = values.get(("environment", "gravity"), environment.gravity) if plant_of(recording).path_known else 0.0
    return Surroundings(np.array(field), gravity, np.array(centre_of_mass(sized(values, MassImbalance))))


_ALONG_Z = np.array([0.0, 0.0, 1.0])
#: what turning there and back leaves of 1
_ROUND_OFF = 1e-12
#: least share of the force along z that the z axis reads, for that axis to tell it: one turned by 60 degrees
_SHARE = 0.5


def _with_lift(
    along: FloatArray,
    readings: FloatArray,
    shown: Callable[[FloatArray], FloatArray],
    felt: Callable[[], FloatArray | None],
) -> FloatArray:
    """Return readings (..., m, 3) of a sensor that reads some of the force along z on other axes, with that force.

    Where the path is unknown the motion does not tell lift and gravity along z: the z axis itself has read it, as part
    of what was ``felt`` (m, 3). A force of 1 m/s^2 along z reads ``along`` (3,), before it is ``shown``.
    """
    without = shown(readings)
    slope = shown(readings + along) - without
    # of a motion that ran beyond all numbers there is none
    tells = bool(np.any(np.abs(slope[..., :2]) > _ROUND_OFF)) and bool(np.min(np.abs(slope[..., 2])) >= _SHARE)
    if not tells or (whole := felt()) is None:
        return without
    return shown(readings + ((whole[:, 2] - without[..., 2]) / slope[..., 2])[..., None] * along)


def _felt(recording: Recording, values: Values, t: FloatArray) -> FloatArray | None:
    """Return the specific force (m, 3) that a gyroscope feels along its own axes at true times t (m,), None: as moved.

    Where the path is unknown the motion tells only the part of it that is centripetal; the accelerometer on the same
    chip has measured all of it, with errors of some per cent and so far below those of the gyroscope's faked rate.
    """
    measured = None if plant_of(recording).path_known else recording.get("accelerometer")
    whole = np.empty(0, dtype=np.bool_) if measured is None else np.all(np.isfinite(measured.value), axis=1)
    if measured is None or np.count_nonzero(whole) < 2:
        return None
    ratios = [sized(values, ClockRate, whose).ratio for whose in ("clock", "accelerometer")]
    written = t * ratios[0] * ratios[1] + sized(values, TimeOffset, "accelerometer").offset_s
    return np.stack([np.interp(written, measured.t[whole], f) for f in measured.value[whole].T], axis=-1)
