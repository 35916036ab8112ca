"""A gyroscope's unit by how far gravity turned between two rests. Takes both sensors' readings; gives a unit.

A body turns by no more than the integral of its rate. Where gravity has turned by more between two rests than a
gyroscope in deg/s says in all, its readings are rad/s.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray, IntArray
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.magnitudes import Unit, gravity_norm
from discsim.validation.importing.sniffing.spin_axis import Reading3

__all__ = ["unit_by_rests"]

#: Rows that make a rest, and by what share each may be off what all have in common: noise and a hand's trembling.
ROWS, STEADY = 5, 0.03
#: What two directions at rest may be apart without a turn, rad: 80 mg of offset an axis (MPU-9250), and noise.
APART = 0.2
#: By how much gravity must have turned beyond the integral: rows at 10 Hz miss peaks of a hand's turn by a fifth.
BEYOND = 2.0
#: A step of the stamps that is so many times the usual one hides a turn.
GAP = 10.0
#: Most rests that are compared with each other.
MOST = 200


def unit_by_rests(unit: Unit, gyro: Reading3, accel: Reading3) -> Unit | None:
    """Return rad/s in place of a guess where gravity turns by more between two rests than a gyroscope in deg/s in all.

    Readings (n, 3) are as written, times in s. None where it does not.
    """
    if unit.decision.sure != "guess" or unit.scale != 1.0:
        return None
    told = np.isfinite(gyro.value).all(axis=1)
    if told.sum() < ROWS:
        return None
    t, size = gyro.t[told], np.linalg.norm(gyro.value[told], axis=1)
    at = _rests(accel)
    at = at[:: max(1, len(at) // MOST)]
    if len(at) < 2:
        return None
    directions = np.array([accel.value[k : k + ROWS].mean(axis=0) for k in at])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    turned = np.arccos(np.clip(directions @ directions.T, -1.0, 1.0)) - APART
    middle = accel.t[at + ROWS // 2]
    whole = np.interp(middle, t, cumulative_trapezoid(size, t, initial=0))
    steps = np.diff(t)
    unseen = np.interp(middle, t[1:], np.cumsum(steps > GAP * np.median(steps)))
    between = np.abs(np.subtract.outer(whole, whole))
    seen = (np.subtract.outer(unseen, unseen) == 0.0) & (turned > 0.0)
    asked = np.where(seen, turned, 0.0) / np.maximum(between, 1e-12)
    most = float(np.max(asked))
    worth = np.pi / 180.0
    if not BEYOND * worth < most < BEYOND:
        return None
    i, j = np.unravel_index(int(np.argmax(asked)), asked.shape)
    why = (
        f"between two rests gravity turns by {np.degrees(turned[i, j] + APART):.0f} deg; readings in deg/s would have "
        f"turned by {between[i, j]:.2g} deg in all"
    )
    return Unit("rad/s", 1.0, Decision("gyroscope unit", "rad/s", "likely", why))


def _rests(accel: Reading3) -> IntArray:
    """Return the first rows (k,) of stretches of `ROWS` in which an accelerometer lies still, gravity all it reads."""
    sound = np.isfinite(accel.value).all(axis=1)
    if sound.sum() < ROWS:
        return np.zeros(0, dtype=np.intp)
    size = gravity_norm(accel.value[sound])
    windows = np.lib.stride_tricks.sliding_window_view(accel.value, ROWS, axis=0)
    middle: FloatArray = windows.mean(axis=-1)
    off = np.linalg.norm(windows - middle[..., None], axis=1).max(axis=-1)
    still = (off < STEADY * size) & (np.abs(np.linalg.norm(middle, axis=1) / size - 1.0) < STEADY)
    return np.flatnonzero(still)
