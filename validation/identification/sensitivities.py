"""How what a sensor reads follows the motion, and with it the neighbours of a motion.

Takes a way to read a sensor and rows of motion, those of neighbours beside them; gives ideal readings and their slopes.
Where neighbours are many, as those of a throw, a reading is asked once for each of the few numbers of the motion that
its sensor senses, and all neighbours follow by the chain rule; where they are few, as those of a rig, each is read.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from discsim.arrays import FloatArray, IntArray
from discsim.compiled import compiled_nogil
from discsim.frames import multiply

__all__ = [
    "MOTION",
    "add_weighted",
    "followed",
    "readings_and_slopes",
    "readings_of_neighbours",
    "write_slopes",
]

#: the numbers of a row of motion by what they are: three each, of the attitude its small turns in B
MOTION = ("position", "velocity", "acceleration", "attitude", "rate", "angular_acceleration")
#: where they stand in a row, but for the attitude, whose quaternion stands in 9 to 12
_PLACES = {"position": 0, "velocity": 3, "acceleration": 6, "attitude": 9, "rate": 13, "angular_acceleration": 16}
#: the step of a difference in each, SI: small beside what bends a reading, large beside its rounding
_STEPS = {
    "position": 1e-4,
    "velocity": 1e-4,
    "acceleration": 1e-4,
    "attitude": 1e-6,
    "rate": 1e-4,
    "angular_acceleration": 1e-2,
}


def readings_and_slopes(
    read: Callable[[FloatArray], FloatArray], senses: Sequence[str], rows: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return readings (m, w) of rows (m, 19) and their slopes (m, w, 3 n) by the n things of `MOTION` a sensor senses.

    ``read`` gives the readings (c, m, w) of rows (c, m, 19).
    """
    asked = np.repeat(rows[None], 1 + 3 * len(senses), axis=0)
    steps = np.repeat([_STEPS[name] for name in senses], 3)
    for k, name in enumerate(senses):
        for axis in range(3):
            row = asked[1 + 3 * k + axis]
            if name == "attitude":
                turned = np.array([1.0, 0.0, 0.0, 0.0])
                turned[1 + axis] = 0.5 * _STEPS[name]
                row[:, 9:13] = multiply(row[:, 9:13], turned)
            else:
                row[:, _PLACES[name] + axis] += _STEPS[name]
    shown = read(asked)
    return shown[0], np.moveaxis((shown[1:] - shown[0]) / steps[:, None, None], 0, 2)


def readings_of_neighbours(
    read: Callable[[FloatArray], FloatArray],
    senses: Sequence[str],
    rows: FloatArray,
    place: IntArray,
    spans: FloatArray,
    central: bool,
) -> tuple[FloatArray, FloatArray]:
    """Return readings (m, w) of a motion and how they follow its n neighbours, (m, w, n) per unit of what tells these.

    ``read`` and ``senses`` are as for `readings_and_slopes`, the others as for `followed`.
    """
    if rows.shape[0] > 1 + 3 * len(senses):
        ideal, slopes = readings_and_slopes(read, senses, rows[0, place])
        return ideal, followed(slopes, senses, rows, place, spans, central)
    shown = read(rows[:, place])
    n = spans.size
    behind = shown[1 + n :] if central else shown[:1]
    return shown[0], np.moveaxis((shown[1 : 1 + n] - behind) / spans[:, None, None], 0, 2)


def followed(
    slopes: FloatArray, senses: Sequence[str], rows: FloatArray, place: IntArray, spans: FloatArray, central: bool
) -> FloatArray:
    """Return how readings (m, w, n) follow n neighbours, per unit of what tells these from the motion.

    ``slopes`` (m, w, 3 k) are those by the k things it ``senses``, ``place`` (m,) the rows of each among those of all
    (c, r, 19): of the motion, its neighbours ahead, and those behind where differences are ``central``. ``spans`` (n,)
    are the differences.
    """
    out = np.empty((*slopes.shape[:2], spans.size))
    starts = np.array([_PLACES[name] for name in senses], dtype=np.int64)
    _follow(np.ascontiguousarray(slopes), starts, rows, place.astype(np.int64), spans, central, out)
    return out


@compiled_nogil
def _follow(
    slopes: FloatArray,
    starts: IntArray,
    rows: FloatArray,
    place: IntArray,
    spans: FloatArray,
    central: bool,
    out: FloatArray,
) -> None:
    """Write what `followed` returns; ``starts`` (k,) are the places in a row of what is sensed."""
    n = spans.size
    change = np.empty(3 * starts.size)
    for i in range(place.size):
        base = rows[0, place[i]]
        for j in range(n):
            ahead = rows[1 + j, place[i]]
            behind = rows[1 + n + j, place[i]] if central else base
            for k in range(starts.size):
                at = starts[k]
                if at == 9:
                    _turn_between(base, ahead, behind, change, 3 * k)
                else:
                    for axis in range(3):
                        change[3 * k + axis] = ahead[at + axis] - behind[at + axis]
            for w in range(slopes.shape[1]):
                total = 0.0
                for k in range(change.size):
                    total += slopes[i, w, k] * change[k]
                out[i, w, j] = total / spans[j]


@compiled_nogil
def _turn_between(base: FloatArray, ahead: FloatArray, behind: FloatArray, change: FloatArray, at: int) -> None:
    """Write the small turn in B from the attitude of one row to that of another into change (at to at + 2).

    Both are beside a third, ``base``.
    """
    aw, ax, ay, az = base[9], -base[10], -base[11], -base[12]
    for sign, row in ((1.0, ahead), (-1.0, behind)):
        bw, bx, by, bz = row[9], row[10], row[11], row[12]
        w = aw * bw - ax * bx - ay * by - az * bz
        size = 2.0 * sign if w > 0.0 else -2.0 * sign
        if sign > 0.0:
            change[at] = change[at + 1] = change[at + 2] = 0.0
        change[at] += size * (aw * bx + ax * bw + ay * bz - az * by)
        change[at + 1] += size * (aw * by - ax * bz + ay * bw + az * bx)
        change[at + 2] += size * (aw * bz + ax * by - ay * bx + az * bw)


@compiled_nogil
def write_slopes(follows: FloatArray, rows: IntArray, columns: IntArray, slopes: FloatArray) -> None:
    """Write slopes (m, width, n) into some rows (m,) and columns (n,) of all."""
    for i in range(rows.size):
        for w in range(follows.shape[1]):
            for j in range(columns.size):
                slopes[rows[i], w, columns[j]] = follows[i, w, j]


@compiled_nogil
def add_weighted(M: FloatArray, weights: FloatArray, mine: IntArray, place: IntArray, said: FloatArray) -> None:
    """Add the first slopes of some rows (m,) of M (n, width, c), each by its weight, to their places in said."""
    for j in range(mine.size):
        weight = weights[mine[j]]
        for w in range(said.shape[1]):
            for c in range(said.shape[2]):
                said[place[j], w, c] += weight * M[mine[j], w, c]
