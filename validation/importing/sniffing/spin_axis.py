"""Which axis a body spins about, by each of its sensors. Takes readings in SI; gives the axis, and who stands alone.

A gyroscope reads the spin on that axis, the field stands still along it, and a disc at rest lies on it. A sensor that
says otherwise than the two others has its axes swapped, in its columns or on the board.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.spin_axis import ONE_AXIS, axis_shares, fast_rows
from discsim.validation.importing.import_map import G0
from discsim.validation.importing.sniffing.decision import Decision, Sureness

__all__ = ["Odd", "Reading3", "along_spin", "lying_axis", "odd_one", "resting", "spin_axis", "while_spinning"]

#: Largest specific force along the axis for most of a flight, m/s^2: at two g a disc would gain 10 m/s of climb in a
#: second. What reads more is the pull away from the axis.
MOST_LIFT = 2 * G0
#: The field stands still along an axis where it moves this many times as much along both others (power).
STILL, CLEARLY_STILL = 4.0, 10.0
#: Said where two sensors have different axes and no third one tells which is right.
_OPEN = (
    "the axes of gyroscope or accelerometer are swapped, and which is open; look at their columns and at how the chips "
    "lie, and state the axes in a map"
)


@dataclass(frozen=True)
class Reading3:
    """A sensor's time (n,) s and values (n, 3) in SI (field in uT), in the axes that the log has."""

    t: FloatArray
    value: FloatArray


@dataclass(frozen=True)
class Odd:
    """A sensor whose spin axis is not that of the others: its name, its axis and theirs, and what to say.

    Where only two differ it is open which one is wrong, and ``sensor`` is None.
    """

    sensor: str | None
    axis: int
    others: int
    note: str

    def straightened(self, sensors: Mapping[str, Reading3]) -> dict[str, Reading3]:
        """Return the sensors with the two axes of the odd one swapped."""
        return {name: Reading3(one.t, one.value @ self.matrix(name).T) for name, one in sensors.items()}

    def matrix(self, sensor: str) -> FloatArray:
        """Return the swap of its axes for the odd sensor, and the identity for another."""
        rows = [0, 1, 2]
        if sensor == self.sensor:
            rows[self.axis], rows[self.others] = self.others, self.axis
        return np.eye(3)[rows]


def spin_axis(sensors: Mapping[str, Reading3]) -> tuple[int | None, Decision]:
    """Return the axis of the spin by the gyroscope, or without one by the magnetometer; None where there is no spin."""
    gyro, field = sensors.get("gyroscope"), sensors.get("magnetometer")
    if gyro is not None:
        return _turning_axis(gyro)
    return _none("neither gyroscope nor magnetometer to show an axis") if field is None else _still_axis(field)


def lying_axis(sensors: Mapping[str, Reading3], why: str = "") -> tuple[int | None, Decision]:
    """Return the axis along gravity at rest: a disc lies on its axis, a rocket stands on it. ``why``: of no spin."""
    accel = sensors.get("accelerometer")
    if accel is None:
        return _none(why)
    norm = np.linalg.norm(accel.value, axis=1)
    still = resting(accel, sensors.get("gyroscope"))
    upright = np.abs(accel.value[still]) > 0.9 * norm[still, None]  # within 25 degrees
    share = upright.mean(axis=0) if len(upright) >= 10 else np.zeros(3)
    axis = int(np.argmax(share))
    if share[axis] < 0.5:
        return _none(why)
    return axis, _said(axis, "guess", f"{why}; gravity lies along it at rest")


def odd_one(sensors: Mapping[str, Reading3]) -> Odd | None:
    """Return the sensor whose spin axis is not that of the others, None where all agree or too little is there to tell.

    A disc may also rest on its rim, so that an accelerometer is odd only where it reads more than `MOST_LIFT` along
    the axis of the spin.
    """
    gyro, field = sensors.get("gyroscope"), sensors.get("magnetometer")
    turns = None if gyro is None else _turning_axis(gyro)[0]
    if gyro is None or turns is None:
        return None
    stands = None
    if field is not None:
        axis, decision = _still_axis(while_spinning(field, gyro))
        stands = axis if decision.sure == "likely" else None
    lies, _ = lying_axis(sensors)
    said = f"the gyroscope turns about {'xyz'[turns]}"
    if stands is not None:
        said += f", the field stands still along {'xyz'[stands]}"
    if lies is not None:
        said += f", gravity at rest lies along {'xyz'[lies]}"
    if stands is not None and stands != turns:
        if lies == stands:
            return Odd("gyroscope", turns, stands, _swap("gyroscope", turns, stands, said))
        return Odd("magnetometer", stands, turns, _swap("magnetometer", stands, turns, said))
    if lies is None or lies == turns:
        return None
    pull = abs(along_spin(turns, sensors))
    if pull <= MOST_LIFT:
        return Odd(None, lies, turns, f"{said}: it rests on its rim, or {_OPEN}")
    said += f", but {pull:.2g} m/s^2 along {'xyz'[turns]} are no lift"
    if stands is not None:
        return Odd("accelerometer", lies, turns, _swap("accelerometer", lies, turns, said))
    return Odd(None, lies, turns, f"{said}: {_OPEN}")


def _swap(sensor: str, axis: int, others: int, said: str) -> str:
    return (
        f"{said}: the {sensor}'s {'xyz'[axis]} and {'xyz'[others]} are taken as swapped; look at its columns and at "
        "how the chip lies, and state its axes in a map"
    )


def while_spinning(reading: Reading3, gyro: Reading3) -> Reading3:
    """Return the rows of a sensor at which the gyroscope shows the fast spin."""
    fast = np.interp(reading.t, gyro.t, fast_rows(gyro.value).astype(float)) > 0.99
    return Reading3(reading.t[fast], reading.value[fast])


def along_spin(axis: int, sensors: Mapping[str, Reading3]) -> float:
    """Return the median specific force along an axis while the body spins fast, m/s^2; 0 where it is not known."""
    gyro = sensors.get("gyroscope")
    if gyro is None:
        return 0.0
    value = while_spinning(sensors["accelerometer"], gyro).value[:, axis]
    return float(np.nanmedian(value)) if value.size >= 20 else 0.0


def resting(accel: Reading3, gyro: Reading3 | None) -> BoolArray:
    """Return the rows (n,) that read gravity alone: no jump (5 % of g from the row before), no turning, about g."""
    step = np.linalg.norm(np.diff(accel.value, axis=0, prepend=accel.value[:1]), axis=1)
    still = (step < 0.05 * G0) & (np.abs(np.linalg.norm(accel.value, axis=1) - G0) < 0.15 * G0)
    if gyro is not None:
        rate = np.interp(accel.t, gyro.t, np.nan_to_num(np.linalg.norm(gyro.value, axis=1), nan=np.inf))
        still &= rate < 1.0  # rad/s: centripetal pull at 0.1 m is then 1 % of g
    return np.asarray(still)


def _turning_axis(gyro: Reading3) -> tuple[int | None, Decision]:
    """Return the axis that has most of the rate where the body spins fast."""
    share = axis_shares(gyro.value)
    if share is None:
        return _none("no spin of a turn a second in it")
    axis = int(np.argmax(share))
    if share[axis] < ONE_AXIS:
        return _none(f"its fast motion has no one axis ({100 * share[axis]:.0f} % of the rate in the largest)")
    sure: Sureness = "certain" if share[axis] > 0.9 else "likely"
    return axis, _said(axis, sure, f"{100 * share[axis]:.0f} % of the rate's square is on it where it spins")


def _still_axis(field: Reading3) -> tuple[int | None, Decision]:
    """Return the axis along which the field stands still while it goes round in the other two."""
    why = "the field stands still along no axis while it turns"
    value = field.value[np.isfinite(field.value).all(axis=1)]
    if len(value) < 2:
        return _none(why)
    size = max(16, len(value) // 200)
    windows = value[: len(value) // size * size].reshape(-1, size, 3)
    spread = windows.var(axis=1) if len(windows) else value.var(axis=0)[None]
    # the windows where the field turns most, which a swing alone does not fill in two axes
    turning = np.sort(spread, axis=1)[:, 1]
    busy = spread[turning >= 0.5 * turning.max()].mean(axis=0)
    axis = int(np.argmin(busy))
    others = np.delete(busy, axis).min()
    if others < STILL * busy[axis]:
        return _none(why)
    sure: Sureness = "likely" if others > CLEARLY_STILL * busy[axis] else "guess"
    return axis, _said(axis, sure, "the field goes round in the other two and moves least along it")


def _none(why: str) -> tuple[None, Decision]:
    return None, Decision("spin axis", "none, axes stay as written", "guess", why)


def _said(axis: int, sure: Sureness, why: str) -> Decision:
    return Decision("spin axis", f"the board's {'xyz'[axis]}", sure, why)
