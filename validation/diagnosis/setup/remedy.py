"""What a person writes into an import map to mend a fault of the setup."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects import setup
from discsim.effects.catalogue import CATALOGUE, Effect, effect
from discsim.recording import Recording
from discsim.validation.diagnosis.answer.named import NamedEffect
from discsim.validation.identification.plants import plant_of

__all__ = ["place_instead", "remedy", "remedy_of"]

#: a map's axes: for each body axis the sensor's column and its sign, None where it was not seen
MapAxes: TypeAlias = tuple[tuple[int, float] | None, ...]

#: sensors of one board, in the order of a map
_BOARD = ("magnetometer", "accelerometer", "gyroscope")
#: units as a map spells them, where it has another word
_MAP_UNITS = {"mG": "mgauss", "G": "gauss"}
#: a rotation within this of right angles (root sum of squares) is one that a map's axes can write
_RIGHT = 0.15
#: an accelerometer nearer to the axis than this is meant to sit on it, m: a part of 3 mm is soldered no better
_ON_AXIS = 0.001


def remedy(fault: Effect, axes: Mapping[str, MapAxes] | None = None) -> str:
    """Return the line of an import map that mends a fault, or what else to do.

    ``axes`` are those that the map has now, by sensor; without them the columns are taken as they stand.
    """
    sensor, value = fault.row.acts_on, fault.value
    if isinstance(value, setup.GpsAxes):
        return "to mend it, swap the columns of the file, or give them in the map in the order north, east, down"
    if isinstance(value, setup.Axes):
        return f"to mend it, write into the import map: {_axes_line(sensor, setup.permutation(value).T, axes)}"
    if isinstance(value, setup.ClockUnit):
        seconds = 1.0 / setup.written_per_si(value)
        return (
            f'to mend it, write into the import map: [time] unit = "{value.written_in}"; without a map multiply time_s '
            f"of every sensor's file by {seconds:g}, and of a command.csv that is in {value.written_in}"
        )
    if type(value) in setup.UNITS:
        unit = _MAP_UNITS.get(value.written_in, value.written_in)
        return f'to mend it, write into the import map: [sensors.{sensor}] unit = "{unit}"'
    if isinstance(value, setup.TimeOffset):
        moved = f"{-value.offset_s:.4g}"
        return (
            f"to mend it, write into the import map: [sensors.{sensor}] time_offset_s = {moved} (or add that to what "
            f"stands there); without a map add {moved} s to the times of {sensor}.csv"
        )
    if isinstance(value, setup.BoardRotation):
        matrix = setup.board_axes(value)
        right = np.round(matrix)
        at_right_angles = np.linalg.norm(matrix - right) < _RIGHT and abs(float(np.linalg.det(right))) > 0.5
        if at_right_angles and not np.array_equal(right, np.eye(3)):
            lines = "; ".join(_axes_line(name, right, axes) for name in _BOARD)
            return f"to mend it, write into the import map: {lines}"
        return "turn the board back, or diagnose with it: the rotation is estimated"
    return "look the field up for the place and the date (--place LAT,LON --date YYYY-MM-DD)"


def remedy_of(named: NamedEffect) -> str:
    """Return the line that mends an effect that an answer names; empty where it is no fault of the setup, or in doubt.

    In doubt is one that is in some recordings, or that these cannot tell from another.
    """
    row = CATALOGUE.get(named.id)
    if row is None or not row.setup or named.recordings is not None or named.confused_with:
        return ""
    sizes = {name: found.value for name, found in named.parameters.items()}
    return remedy(effect(named.id, **sizes, **named.setting))


def place_instead(fault: Effect, recording: Recording) -> tuple[float, float, float] | None:
    """Return where the accelerometer would sit if a board were not turned about z, m; None where it must be turned.

    A disc has no front: a board that is turned about its axis is one that is not, with the accelerometer elsewhere.
    """
    sheet = recording.sheets.get("accelerometer")
    stated = None if sheet is None or "accelerometer" not in recording else sheet.position
    if stated is None or not plant_of(recording).airborne or not isinstance(fault.value, setup.BoardRotation):
        return None
    matrix = setup.board_axes(fault.value)
    if np.linalg.norm(matrix[:, 2] - [0.0, 0.0, 1.0]) > _RIGHT or np.linalg.norm(stated[:2]) < _ON_AXIS:
        return None
    x, y, z = (round(float(axis), 6) + 0.0 for axis in stated @ matrix)
    return x, y, z


def _axes_line(sensor: str, matrix: FloatArray, axes: Mapping[str, MapAxes] | None) -> str:
    """Return the map's line for body axes = matrix (3, 3) times the recording's columns."""
    now = None if axes is None else axes.get(sensor)
    if now is not None and all(item is not None for item in now):
        own = np.zeros((3, 3))
        for body, item in enumerate(now):
            assert item is not None
            own[body, item[0]] = item[1]
        matrix = matrix @ own
    columns = np.argmax(np.abs(matrix), axis=1)
    names = [("-" if matrix[body, column] < 0 else "") + "xyz"[column] for body, column in enumerate(columns)]
    mirrored = " and mirrored = true" if float(np.linalg.det(matrix)) < 0 else ""
    return f"[sensors.{sensor}] axes = {names}{mirrored}".replace("'", '"')
