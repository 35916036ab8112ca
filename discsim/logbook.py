"""The states of a flight as MuJoCo steps it, written down by compiled code: in Python it would cost half a step."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled
from discsim.frames import rotate_by_quaternion
from discsim.native import at, carray

__all__ = ["Logbook", "height"]

#: places of the record that `_note` reads: the log's address, the rows written and those there is room for, the
#: lengths of qpos and qvel, and the addresses of qpos, qvel, qacc and of the centre of mass
_LOG, _ROWS, _SIZE, _NQ, _NV, _QPOS, _QVEL, _QACC, _CENTRE, _RECORD = range(10)
#: what it answers
_ABOVE, _BELOW, _DIVERGED, _FULL = range(4)
#: beyond this MuJoCo itself calls a number bad
_LARGEST = float(mujoco.mjMAXVAL)


@compiled
def height(qpos: FloatArray, ex: float, ey: float, ez: float) -> float:
    """Height of the centre of mass, m, from the pose of a free joint and its place in B."""
    _, _, down = rotate_by_quaternion(qpos[3], qpos[4], -qpos[5], -qpos[6], ex, ey, ez)
    return float(qpos[2] - down)


@compiled
def _note(record: int, t: float) -> int:
    """Write time, qpos, qvel and qacc into the next row; say whether the disc is below ground or beyond all bounds."""
    word = carray(at(record), (_RECORD,), np.int64)
    if word[_ROWS] == word[_SIZE]:
        return _FULL
    nq, nv = word[_NQ], word[_NV]
    width = 1 + nq + 2 * nv
    row = carray(at(word[_LOG] + 8 * width * word[_ROWS]), (width,), np.float64)
    qpos = carray(at(word[_QPOS]), (nq,), np.float64)
    row[0] = t
    row[1 : 1 + nq] = qpos
    row[1 + nq : 1 + nq + nv] = carray(at(word[_QVEL]), (nv,), np.float64)
    row[1 + nq + nv :] = carray(at(word[_QACC]), (nv,), np.float64)
    word[_ROWS] += 1
    for number in row:
        if not abs(number) <= _LARGEST:
            return _DIVERGED
    e = carray(at(word[_CENTRE]), (3,), np.float64)
    return _BELOW if height(qpos, e[0], e[1], e[2]) <= 0.0 else _ABOVE


class Logbook:
    """Rows of time, qpos, qvel and qacc of one MjData whose first joint is the disc's.

    ``centre`` (3,) is the place of the centre of mass in B, m.
    """

    def __init__(self, model: Any, data: Any, centre: FloatArray) -> None:
        self._data, self._centre = data, np.array(centre)
        self._log = np.empty((1024, 1 + model.nq + 2 * model.nv))
        views = (data.qpos, data.qvel, data.qacc, self._centre)
        places = [view.ctypes.data for view in views]
        self._record = np.array([self._log.ctypes.data, 0, len(self._log), model.nq, model.nv, *places], dtype=np.int64)
        self._address = int(self._record.ctypes.data)

    def note(self) -> bool:
        """Write down what is in the data now; return whether the centre of mass is below the ground.

        Raises FloatingPointError where a number of the state or its rate is not finite, or beyond MuJoCo's bounds.
        """
        answer = _note(self._address, self._data.time)
        if answer == _FULL:
            self._log = np.concatenate([self._log, np.empty_like(self._log)])
            self._record[_LOG], self._record[_SIZE] = self._log.ctypes.data, len(self._log)
            answer = _note(self._address, self._data.time)
        if answer == _DIVERGED:
            raise FloatingPointError
        return bool(answer)

    def strike(self) -> None:
        """Take the last row out."""
        self._record[_ROWS] -= 1

    @property
    def rows(self) -> FloatArray:
        """What is written, (n, 1 + nq + 2 nv)."""
        return self._log[: self._record[_ROWS]]
