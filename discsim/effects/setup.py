"""Faults of the setup: sensors whose axes, units, times or place in the disc are not those that are stated.

A setting is a text, such as the axes that the written columns hold; a parameter is a number. Settings and times are
faults of what is written, a turned board and another field are faults of what is measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.frames import body_to_ned, turn

__all__ = [
    "UNITS",
    "AccelerometerUnit",
    "Axes",
    "BoardRotation",
    "ClockUnit",
    "GpsAxes",
    "GyroscopeUnit",
    "MagnetometerUnit",
    "SiteField",
    "TimeOffset",
    "axes_of",
    "board_axes",
    "checked",
    "field_there",
    "on_board",
    "permutation",
    "written_per_si",
]


class Axes(NamedTuple):
    """Written columns x, y, z hold other axes of the body: a signed permutation (mag.axes, accel.axes, gyro.axes).

    ``"y x -z"``: column x holds body y, column y holds body x, column z holds minus body z.
    """

    axes: str = "x y z"


class GpsAxes(NamedTuple):
    """Columns north, east, down and their velocities hold other directions, as "east north up" (gps.axes)."""

    axes: str = "north east down"


class MagnetometerUnit(NamedTuple):
    """Fields are in another unit than the column's name says: mG, G, nT or T (mag.units)."""

    written_in: str = "uT"


class AccelerometerUnit(NamedTuple):
    """Specific forces are in another unit than the column's name says: g or mg (accel.units)."""

    written_in: str = "m/s2"


class GyroscopeUnit(NamedTuple):
    """Rates are in another unit than the column's name says: deg/s or rpm (gyro.units)."""

    written_in: str = "rad/s"


class ClockUnit(NamedTuple):
    """Times of all sensors are in ms or us where seconds are due (clock.units)."""

    written_in: str = "s"


class TimeOffset(NamedTuple):
    """A sensor's times are shifted, ``written time = true time + offset_s``."""

    offset_s: float = 0.0


class BoardRotation(NamedTuple):
    """The sensor board is turned in the disc by a rotation vector: readings = C^T (true vector) (board.rotation).

    C is the rotation by (rx, ry, rz), of any size. It acts first of all in a sensor's chain: iron, sensitivity and
    bias sit on the board and are in its axes. Places of sensors stay as stated.
    """

    rx_rad: float = 0.0
    ry_rad: float = 0.0
    rz_rad: float = 0.0


class SiteField(NamedTuple):
    """The field that is there is the stated one turned about down, dipped further, and times ratio (site.field)."""

    declination_rad: float = 0.0
    inclination_rad: float = 0.0
    ratio: float = 1.0


#: standard gravity, of which "g" in an accelerometer's log is one
_G = 9.80665
#: kind of setting -> numbers written for one SI unit (of a field, for one uT), by the unit that they are in
UNITS: Mapping[type[Any], Mapping[str, float]] = MappingProxyType(
    {
        MagnetometerUnit: MappingProxyType({"uT": 1.0, "mG": 10.0, "G": 1e-2, "nT": 1e3, "T": 1e-6}),
        AccelerometerUnit: MappingProxyType({"m/s2": 1.0, "g": 1.0 / _G, "mg": 1e3 / _G}),
        GyroscopeUnit: MappingProxyType({"rad/s": 1.0, "deg/s": 180.0 / pi, "rpm": 30.0 / pi}),
        ClockUnit: MappingProxyType({"s": 1.0, "ms": 1e3, "us": 1e6}),
    }
)
#: kind of setting -> what a word of it stands for: (axis, sign)
_WORDS: Mapping[type[Any], Mapping[str, tuple[int, float]]] = MappingProxyType(
    {
        Axes: {sign + name: (k, s) for k, name in enumerate("xyz") for sign, s in (("", 1.0), ("-", -1.0), ("+", 1.0))},
        GpsAxes: {
            name: (k, s)
            for k, pair in enumerate((("north", "south"), ("east", "west"), ("down", "up")))
            for name, s in zip(pair, (1.0, -1.0), strict=True)
        },
    }
)


def checked(value: Any) -> Any:
    """Return a value with its settings in their one spelling, any other value as it is; raises `InputError`."""
    kind = type(value)
    if kind in _WORDS:
        return kind(" ".join(_words(kind, value.axes)))
    if kind in UNITS and value.written_in not in UNITS[kind]:
        raise InputError(f"written_in is '{value.written_in}', expected one of {', '.join(UNITS[kind])}")
    return value


def _words(kind: type[Any], axes: str) -> list[str]:
    words, known = axes.split(), _WORDS[kind]
    if len(words) != 3 or not all(word in known for word in words) or len({known[word][0] for word in words}) != 3:
        example = "'x -y z' or 'y x -z'" if kind is Axes else "'east north up'"
        raise InputError(
            f"axes is '{axes}', expected {'x, y and z' if kind is Axes else 'three directions'} once each, such as "
            f"{example}"
        )
    return [word.removeprefix("+") for word in words]


def permutation(effect: Axes | GpsAxes) -> FloatArray:
    """Return P (3, 3), written columns = P (body's axes, or north, east, down)."""
    P = np.zeros((3, 3))
    for row, word in enumerate(_words(type(effect), effect.axes)):
        axis, sign = _WORDS[type(effect)][word]
        P[row, axis] = sign
    return P


def axes_of(P: FloatArray, sensor: str = "") -> str:
    """Return the setting of a signed permutation P (3, 3), in a gps's words where ``sensor`` is "gps"."""
    words = _WORDS[GpsAxes if sensor == "gps" else Axes]
    spelt = {pair: word for word, pair in words.items() if not word.startswith("+")}
    places = [(int(np.argmax(np.abs(line))), float(np.sum(line))) for line in P]
    return " ".join(spelt[place] for place in places)


def written_per_si(effect: MagnetometerUnit | AccelerometerUnit | GyroscopeUnit | ClockUnit) -> float:
    """Return the number written for one SI unit, of a field for one uT."""
    return UNITS[type(effect)][effect.written_in]


def board_axes(effect: BoardRotation) -> FloatArray:
    """Return C (3, 3), a vector on the board's axes to body axes: readings = C^T (vector in B)."""
    return body_to_ned(turn(np.array(effect, dtype=np.float64)))


def on_board(effect: BoardRotation, vector: FloatArray) -> FloatArray:
    """Return vectors (..., 3) of B along the axes of the turned board."""
    return np.asarray(vector @ board_axes(effect)) if any(effect) else vector


def field_there(effect: SiteField, stated: FloatArray) -> FloatArray:
    """Return the field (3,) in N that is there, where ``stated`` (3,) is stated.

    Its declination atan2(east, north) and its dip below the horizon are the stated field's plus those of the effect;
    a dip beyond the vertical comes down on the other side.
    """
    if tuple(effect) == (0.0, 0.0, 1.0):
        return stated
    north, east, down = (float(part) for part in stated)
    level = np.hypot(north, east)
    size = effect.ratio * np.hypot(level, down)
    azimuth = np.arctan2(east, north) + effect.declination_rad
    dip = np.arctan2(down, level) + effect.inclination_rad
    return np.array([size * np.cos(dip) * np.cos(azimuth), size * np.cos(dip) * np.sin(azimuth), size * np.sin(dip)])
