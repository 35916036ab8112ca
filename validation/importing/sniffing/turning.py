"""How well a gyroscope's turning explains a vector's. Takes both sensors' readings; gives axes, worth and how well.

A vector fixed in the room obeys dm/dt = -w x m in the body, so from stamp to stamp m turns by minus the integral of the
rate. An offset fixed in the body (hard iron) is found with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray, IntArray

__all__ = ["PERMUTATIONS", "Fit", "Steps", "best_axes", "best_worth", "left_by", "steps_between"]

#: Steps of 0.02 rad stand above a magnetometer's noise (1 % of the field); one beyond 1.5 rad says little of its axis.
SMALLEST, LARGEST = 0.02, 1.5
#: Fewest steps for an answer: 3 unknowns of the offset, 48 ways of the axes, three components a step.
FEWEST = 30
MOST = 1500
#: An offset is at most what is read and the size of the field, and in a turn by a radian what is read comes to half of
#: that size: three times what is read. Turns that are 57 times too small (deg/s for rad/s) ask for more.
OFFSET = 3.0
#: What a worth that is a quarter off has to leave of the changes, as a multiple of what the best leaves: turns by a
#: radian leave 0.2, beside 0.05 to 0.1 of noise.
SHARP = 1.5
#: What iron makes of the size of what is read, a factor of 1.5 (one sigma), as its logarithm; and how much that counts:
#: as a quarter of the logarithm of what is left, for axes and times that are off leave most of it, and not noise.
OF_SIZE = 0.25 / (2 * np.log(1.5) ** 2)
#: Steps are taken from a reading to the next, and to the 4th and 16th next, where slow turns stand above the noise.
LAGS = (1, 4, 16)
PERMUTATIONS = tuple(
    np.array([[signs[row] if order[row] == column else 0.0 for column in range(3)] for row in range(3)])
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
)


@dataclass(frozen=True)
class Steps:
    """Steps of a vector (n, 3), from the rows ``first`` (k,) to the ``lag``-th next each.

    ``integral`` (n, 3) is that of the gyroscope's readings, ``size`` (k,) the length of its change over each step.
    """

    vector: FloatArray
    integral: FloatArray
    lag: int
    first: IntArray
    size: FloatArray


class Fit(NamedTuple):
    """What is left of the vector's changes (a ratio: 0 all explained, 1 nothing), by which axes, worth, offset.

    ``overall`` is the geometric mean of what is left over all steps of `LAGS`, by which ways are ranked. ``size`` is
    that of the vector without its offset, over that of what is read. ``sharp``: by the turns alone a worth that is a
    quarter larger or smaller explains much less; else it rests on that size.
    """

    ratio: float
    axes: FloatArray
    worth: float
    offset: FloatArray
    overall: float = float("nan")
    size: float = 1.0
    sharp: bool = True

    @property
    def doubt(self) -> float:
        """What is left, and beside it how far the offset takes the vector's size from what is read.

        Small turns tell the product of a worth and of that size alone: half the worth explains as much with twice the
        field. A factor of two counts as half as much again that is left, so that large turns decide by themselves.
        """
        return float(self.ratio * np.exp(OF_SIZE * np.log(self.size) ** 2))


def steps_between(t_gyro: FloatArray, gyro: FloatArray, t_vector: FloatArray, vector: FloatArray) -> list[Steps]:
    """Return the steps of a vector (sampled and held readings once) and the turning between; empty where too few.

    There is one entry for each of `LAGS`. Times are (n,) s, values (n, 3).
    """
    sound = np.isfinite(gyro).all(axis=1) & np.isfinite(t_gyro)
    fresh = np.isfinite(vector).all(axis=1) & np.isfinite(t_vector)
    fresh[1:] &= np.any(np.diff(vector, axis=0) != 0, axis=1)
    if sound.sum() < FEWEST or fresh.sum() < FEWEST:
        return []
    # nothing is copied where all rows count, in their order: a log of hours has hundreds of MB of each
    if not sound.all():
        t_gyro, gyro = t_gyro[sound], gyro[sound]
    if not fresh.all():
        t_vector, vector = t_vector[fresh], vector[fresh]
    if np.any(np.diff(t_gyro) < 0):
        order = np.argsort(t_gyro, kind="stable")
        t_gyro, gyro = t_gyro[order], gyro[order]
    integral = cumulative_trapezoid(gyro, t_gyro, axis=0, initial=0)
    at = np.column_stack([np.interp(t_vector, t_gyro, integral[:, axis]) for axis in range(3)])
    # where it may stand at its range it tells no turn
    extreme = np.abs(gyro) >= 0.999 * np.abs(gyro).max(axis=0)
    clipped = extreme[:, extreme.sum(axis=0) > 5].any(axis=1)
    lost = np.interp(t_vector, t_gyro, np.cumsum(clipped).astype(float))
    found = []
    for lag in LAGS:
        spacing = t_vector[lag:] - t_vector[:-lag]
        whole = (spacing > 0) & (spacing < 3 * np.median(spacing)) & (lost[lag:] == lost[:-lag])
        if whole.sum() >= FEWEST:
            first = np.flatnonzero(whole)
            found.append(Steps(vector, at, lag, first, np.linalg.norm(at[lag:] - at[:-lag], axis=1)[first]))
    return found


def _chosen(steps: Steps, worth: float) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return the vectors before and after some steps that tell, and the integrals over them; None where few do."""
    size = steps.size * worth
    rows = steps.first[(size > SMALLEST) & (size < LARGEST)]
    if rows.size < FEWEST:
        return None
    rows = rows[np.linspace(0, rows.size - 1, min(MOST, rows.size)).astype(int)]
    after = rows + steps.lag
    return steps.vector[rows], steps.vector[after], steps.integral[after] - steps.integral[rows]


def _rotations(turn: FloatArray) -> FloatArray:
    """Return the matrices (n, 3, 3) that turn a vector by minus these rotation vectors (n, 3)."""
    angle = np.linalg.norm(turn, axis=1)
    axis = -turn / np.maximum(angle, 1e-12)[:, None]
    sine, cosine = np.sin(angle), np.cos(angle)
    found: FloatArray = ((1.0 - cosine)[:, None] * axis)[:, :, None] * axis[:, None, :]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[:, i, i] += cosine
        found[:, i, j] -= sine * axis[:, k]
        found[:, j, i] += sine * axis[:, k]
    return found


@dataclass(frozen=True)
class _Sums:
    """What steps say of some ways W (w) to lay a vector's axes: sums of squares over all steps, by W and an offset.

    A way enters linearly: W a - R W b of vectors a after and b before a rotation R is ``parts`` times W's elements, so
    that sums are taken once for all ways. ``own`` (w,) are the squares without an offset, ``normal`` (3, 3) and
    ``seen_by`` (3, w) what an offset changes of them. ``change`` is the rms change of a component, ``count`` how many
    there are; ``before`` (k, 3) are the vectors before the steps.
    """

    ways: Sequence[FloatArray]
    own: FloatArray
    normal: FloatArray
    seen_by: FloatArray
    change: float
    count: int
    before: FloatArray

    def offset(self) -> FloatArray:
        """Return the offset (3, w) that leaves least by each way, no larger than one can be."""
        return _offset(self.normal, self.seen_by, self.limit)

    @property
    def limit(self) -> float:
        """The largest offset that can be."""
        return OFFSET * float(np.max(np.linalg.norm(self.before, axis=1)))

    def left(self, offset: FloatArray) -> FloatArray:
        """Return what is left of the changes (w,) by each way with its offset (3, w), as a ratio."""
        squares = (
            self.own - 2.0 * np.sum(offset * self.seen_by, axis=0) + np.sum(offset * (self.normal @ offset), axis=0)
        )
        return np.asarray(np.sqrt(np.maximum(squares, 0.0) / self.count) / self.change)

    def size(self, offset: FloatArray) -> FloatArray:
        """Return the size of the vector without an offset (3, w), over that of what is read, by each way (w,)."""
        sizes = np.linalg.norm(self.before, axis=1)
        back = np.stack([way.T @ one for way, one in zip(self.ways, offset.T, strict=True)], axis=1)
        lengths = sizes[:, None] ** 2 - 2.0 * self.before @ back + np.sum(offset**2, axis=0)
        return np.asarray(np.sqrt(np.maximum(np.median(lengths, axis=0), 0.0)) / (float(np.median(sizes)) or 1.0))


def _offset(normal: FloatArray, seen_by: FloatArray, limit: float) -> FloatArray:
    """Return the offsets (3, w) that leave least by some sums, as those of `_Sums`, each at most a ``limit`` long."""
    # squared, what a singular value of 1e-3 of the largest is
    offset = np.linalg.pinv(normal, rcond=1e-6, hermitian=True) @ seen_by
    return np.asarray(offset * np.minimum(1.0, limit / np.maximum(np.linalg.norm(offset, axis=0), 1e-300)))


def _sums(steps: Steps, worth: float, ways: Sequence[FloatArray]) -> _Sums | None:
    """Return what steps say of some ways with a worth of the gyroscope's reading; None where few of them tell."""
    chosen = _chosen(steps, worth)
    if chosen is None:
        return None
    before, after, turn = chosen
    rotation = _rotations(turn * worth)
    design = (np.eye(3) - rotation).reshape(-1, 3)
    change = float(np.sqrt(np.mean((after - before) ** 2))) or 1.0
    elements = np.stack([np.ravel(way) for way in ways], axis=1)
    parts = np.eye(3)[:, :, None] * after[:, None, None, :] - rotation[:, :, :, None] * before[:, None, None, :]
    parts = parts.reshape(-1, 9)
    own = np.sum(elements * (parts.T @ parts @ elements), axis=0)
    return _Sums(ways, own, design.T @ design, design.T @ parts @ elements, change, len(design), before)


def _fits(steps: Steps, worth: float, ways: Sequence[FloatArray]) -> list[Fit]:
    """Return what a worth leaves of the vector's changes, by each of some ways W (3, 3) to lay its axes."""
    sums = _sums(steps, worth, ways)
    if sums is None:
        return []
    offset = sums.offset()
    found = zip(sums.left(offset).tolist(), ways, offset.T, sums.size(offset).tolist(), strict=True)
    return [Fit(ratio, way, worth, one, size=max(size, 1e-6)) for ratio, way, one, size in found]


def best_worth(steps: Sequence[Steps], worths: Sequence[float]) -> Fit | None:
    """Return the best fit over some worths of a gyroscope's reading (rad/s each), refined by golden section."""
    fits = [(fit, one) for one in steps for worth in worths for fit in _fits(one, worth, PERMUTATIONS)]
    if not fits:
        return None
    best, those = min(fits, key=lambda pair: pair[0].doubt)
    low, high = np.log(best.worth) - 0.7, np.log(best.worth) + 0.7
    golden = (np.sqrt(5) - 1) / 2
    for _ in range(12):  # to 0.4 %
        lower, upper = high - golden * (high - low), low + golden * (high - low)
        left = [
            min((fit.doubt for fit in _fits(those, float(np.exp(tried)), [best.axes])), default=2.0)
            for tried in (lower, upper)
        ]
        low, high = (low, upper) if left[0] < left[1] else (lower, high)
    refined = _fits(those, float(np.exp((low + high) / 2)), [best.axes])
    best = min([best, *refined], key=lambda fit: fit.doubt)
    beside = [fit.ratio for factor in (0.8, 1.25) for fit in _fits(those, factor * best.worth, [best.axes])]
    return best._replace(sharp=len(beside) == 2 and min(beside) > SHARP * best.ratio)


def left_by(steps: Sequence[Steps], worth: float) -> float | None:
    """Return what turning by a worth leaves of a vector's changes (a ratio of medians), its axes as the gyroscope's.

    It has no offset: one that is free makes up for a worth that is wrong, where turns are small. None of too few steps,
    and where most change nothing.
    """
    left, change = [], []
    for one in steps:
        chosen = _chosen(one, worth)
        if chosen is not None:
            before, after, turn = chosen
            left.append(np.linalg.norm(after - np.einsum("nij,nj->ni", _rotations(turn * worth), before), axis=1))
            change.append(np.linalg.norm(after - before, axis=1))
    usual = float(np.median(np.concatenate(change))) if left else 0.0
    return float(np.median(np.concatenate(left))) / usual if usual > 0.0 else None


def best_axes(steps: Sequence[Steps], worth: float) -> list[Fit]:
    """Return the fits of all 48 ways to lay the vector's axes on the gyroscope's, the best first.

    Each is the fit of the lag that it explains best; ranks are over all lags, as a slow turn shows in a long one only.
    A lag counts by its steps, for in a fast spin few of a long one are left, those of the hand and of the catch. The
    offset is one for all lags: so few steps alone ask for any.
    """
    each = [sums for one in steps if (sums := _sums(one, worth, PERMUTATIONS)) is not None]
    if not each:
        return []
    # lags count by what the best way leaves of each
    least = [max(float(np.min(sums.left(sums.offset()))) * sums.change, 1e-300) ** -2.0 for sums in each]
    normal = np.sum([w * sums.normal for w, sums in zip(least, each, strict=True)], axis=0)
    seen_by = np.sum([w * sums.seen_by for w, sums in zip(least, each, strict=True)], axis=0)
    offset = _offset(normal, seen_by, min(sums.limit for sums in each))
    left = np.array([sums.left(offset) for sums in each])
    share = np.array([sums.count for sums in each]) / sum(sums.count for sums in each)
    overall = np.exp(share @ np.log(np.maximum(left, 1e-12)))
    ways = [
        Fit(float(np.min(left[:, k])), way, worth, offset[:, k], overall=float(overall[k]))
        for k, way in enumerate(PERMUTATIONS)
    ]
    return sorted(ways, key=lambda fit: fit.overall)
