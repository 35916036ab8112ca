"""How a sound recording stands in its files when the setup is at fault, and what the faulty one was meant to say.

The two functions are each other's inverse on everything that a file shows. Sheets stay as they are in both: a data
sheet speaks of the part, in the unit that the column's name states, whatever a logger made of the numbers. So it holds
for the readings once they are right, and not for numbers in another unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects import setup
from discsim.effects.catalogue import Effect, by_id
from discsim.effects.kind import BOARD
from discsim.errors import InputError
from discsim.limits import time_fault
from discsim.recording import Recording, Samples, SensorSheet

__all__ = ["PREFIX", "as_written", "corrected", "require_seconds"]

#: sensor -> prefix of its effects
PREFIX: Mapping[str, str] = MappingProxyType(
    {"magnetometer": "mag", "accelerometer": "accel", "gyroscope": "gyro", "gps": "gps", "track": "track"}
)
#: share of one axis in another below which it is the rounding of a rotation matrix (1e-16) and no reading: of a whole
#: range it is less than a step of a 24-bit converter (6e-8)
_SHARE = 1e-9

_Values = Mapping[str, Any]


def as_written(recording: Recording, effects: Sequence[Effect]) -> Recording:
    """Return a sound recording as it would stand in the files with the setup faults among the effects.

    Other effects are passed over. So is site.field: it changes what is measured and not what is stated, and only a
    simulation knows the readings in another field. A turned board mixes axes that noise, rounding and clipping have
    gone over already; where a clipped reading or a gap would take part, a gap is left. Times may fall below zero.

    Raises `InputError` where an effect is given twice.
    """
    values = by_id(effects)
    samples = {}
    for sensor, sound in recording.samples.items():
        turned = _turned(sensor, sound.value, recording.sheets[sensor], values, to_board=True)
        time = (sound.t + _offset(sensor, values)) * _ticks(values)
        samples[sensor] = Samples(time, _unit(sensor, values) * _permuted(sensor, turned, values))
    return replace(recording, samples=samples)


def corrected(recording: Recording, effects: Sequence[Effect]) -> Recording:
    """Return what a recording with the setup faults among the effects was meant to say; `as_written`'s inverse.

    Other effects are passed over. With site.field the environment's field becomes the one that is there. A command has
    the sensors' unit of time where it would else last far longer than they do: a drive has a clock of its own. Where a
    clipped reading, or a gap, of a turned board takes part in another axis, that axis has a gap.

    Raises `InputError` where an effect is given twice.
    """
    values = by_id(effects)
    samples = {}
    for sensor, faulty in recording.samples.items():
        meant = _permuted(sensor, faulty.value / _unit(sensor, values), values, back=True)
        meant = _turned(sensor, meant, recording.sheets[sensor], values, to_board=False)
        samples[sensor] = Samples(faulty.t / _ticks(values) - _offset(sensor, values), meant)
    environment = recording.environment
    if "site.field" in values:
        there = setup.field_there(values["site.field"], environment.magnetic_field)
        environment = replace(environment, magnetic_field=there)
    command = _command_in_seconds(recording.command, samples, _ticks(values))
    back = recording.turned_back
    if any(rotation := values.get("board.rotation", setup.BoardRotation())):
        back = setup.board_axes(rotation) if back is None else setup.board_axes(rotation) @ back
    return replace(recording, samples=samples, environment=environment, command=command, turned_back=back)


def _command_in_seconds(command: Samples | None, meant: Mapping[str, Samples], ticks: float) -> Samples | None:
    """Return a command's knots in seconds, where sensors' times, now as they were ``meant``, were in ticks a second.

    Written in ticks as well it lasts so many times longer than they do, in seconds about as long: half way between, as
    factors go, is the root.
    """
    end = max((float(one.t[-1]) for one in meant.values() if len(one)), default=0.0)
    if command is None or ticks <= 1.0 or not len(command) or command.t[-1] < np.sqrt(ticks) * end:
        return command
    return Samples(command.t / ticks, command.value)


def _offset(sensor: str, values: _Values) -> float:
    return float(values.get(f"{PREFIX.get(sensor)}.time_offset", setup.TimeOffset()).offset_s)


def _ticks(values: _Values) -> float:
    """Return the number written for one second, by the clock that all sensors share."""
    return setup.written_per_si(values.get("clock.units", setup.ClockUnit()))


def _unit(sensor: str, values: _Values) -> float:
    unit = values.get(f"{PREFIX.get(sensor)}.units")
    return 1.0 if unit is None else setup.written_per_si(unit)


def _permuted(sensor: str, value: FloatArray, values: _Values, *, back: bool = False) -> FloatArray:
    """Return readings (n, 3), or (n, 6) of a gps, along other axes; a gap goes with its axis."""
    axes = values.get(f"{PREFIX.get(sensor)}.axes")
    if axes is None:
        return value
    P = setup.permutation(axes).T if back else setup.permutation(axes)
    source, sign = np.argmax(np.abs(P), axis=1), np.sum(P, axis=1)
    three_by_three = value.reshape(len(value), -1, 3)
    return np.asarray((three_by_three[:, :, source] * sign).reshape(value.shape))


def _turned(sensor: str, value: FloatArray, sheet: SensorSheet, values: _Values, *, to_board: bool) -> FloatArray:
    """Return readings (n, 3) of B along the axes of a turned board, or back."""
    rotation = values.get("board.rotation", setup.BoardRotation())
    if sensor not in BOARD or not any(rotation):
        return value
    C = setup.board_axes(rotation)
    R = np.where(np.abs(C) > _SHARE, C, 0.0)
    R = R.T if to_board else R
    lost = np.isnan(value)
    # a clipped reading that only changes its name or its sign, as after a right angle, stays one
    mixing = np.count_nonzero(R, axis=1) > 1
    spoilt = np.where(mixing, (lost | sheet.clipped(value)) @ (R.T != 0.0), lost @ (R.T != 0.0))
    return np.where(spoilt, np.nan, np.where(lost, 0.0, value) @ R.T)


def require_seconds(recording: Recording) -> None:
    """Raise `InputError` where a recording, its clock's unit put right, still has times that none has."""
    for sensor, samples in recording.samples.items():
        if len(samples) and (fault := time_fault(samples.t)) is not None:
            place = f"{recording.path or recording.name}, {sensor}"
            raise InputError(f"{place}, row {fault[0] + 1}: {fault[1]}")
