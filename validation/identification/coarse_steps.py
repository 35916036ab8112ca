"""Readings rounded to steps far coarser than their noise: what they say where they go on by a step.

Rounding errors of white noise are white, and part of the stated noise. Where the noise is a small part of a step, a
reading stands for a while, and its error is a saw's: half a step at most, and the same from row to row. But when it
goes on by a step, the true value is between the two, to within the noise. Takes readings; gives those instants.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from discsim.arrays import BoolArray, FloatArray

__all__ = ["at_steps", "stands", "told_by_steps"]

#: steps of so many noises are coarse: at two a rounded Gaussian's error still changes from row to row (B. Widrow and
#: I. Kollar, "Quantization Noise", 2008, ch. 11: with a noise of half a step it is white to 1 %)
COARSE = 3.0
#: ... where this share of the rows repeat the one before on all axes
STANDING = 0.5
#: fewest rows that stand before and after a step: the step's own instant is known to a row, a third of one of those
FEWEST = 3
#: fewest instants that are looked at, as of readings of a sensor at all
LEAST = 12


def stands(value: FloatArray, step: float, noise: float | None) -> bool:
    """Tell whether readings (n, k) stand on steps that are coarse beside their noise, and go on by some."""
    return told_by_steps(value, step, noise) is not None


def told_by_steps(value: FloatArray, step: float, noise: float | None) -> tuple[FloatArray, BoolArray] | None:
    """Return what `at_steps` does of readings (n, k) that stand on steps coarse beside their noise; None of others.

    Of a noise that nobody states (None) they tell themselves: on all axes at once only a small one stands so. One that
    is stated as zero is left alone, and so is what never goes on, as on a table at one rate.
    """
    if not (step > 0.0 if noise is None else step > COARSE * noise > 0.0) or len(value) < 2:
        return None
    known = np.all(np.isfinite(value), axis=1)
    both = known[1:] & known[:-1]
    same = np.all(np.abs(np.diff(value, axis=0)) < 0.5 * step, axis=1)
    if not np.count_nonzero(same & both) > STANDING * np.count_nonzero(both):
        return None
    found, good = at_steps(value, step, noise)
    return (found, good) if np.count_nonzero(good) >= LEAST else None


def at_steps(value: FloatArray, step: float, noise: float | None) -> tuple[FloatArray, BoolArray]:
    """Return the true values (n, k) where readings (n, k) go on by a step, and which (n, k) these are.

    Their errors are the noise at most. Between two stands of an axis there may be rows that toggle between both, as
    noise makes them: the step is where it would be if those were in order. Of a noise that nobody states (None) only
    what it is at most is taken.
    """
    least = max(FEWEST, int(np.ceil(step / (noise * np.sqrt(12.0)))) if noise else 0)
    found, good = np.full(value.shape, np.nan), np.zeros(value.shape, dtype=np.bool_)
    for axis, column in enumerate(value.T):
        level = np.where(np.isfinite(column), np.round(column / step), np.nan)
        edges = np.flatnonzero(~(level[1:] == level[:-1])) + 1
        first, after = np.append(0, edges), np.append(edges, level.size)
        long = np.flatnonzero((after - first >= least) & np.isfinite(level[first]))
        stood = list(zip(first[long].tolist(), after[long].tolist(), strict=True))
        for (start, left), (came, end) in pairwise(stood):
            if (row := _of_step(level, left, came)) is None:
                continue
            offset = float(np.median(column[start:left])) - step * level[start]
            on = level[came] - level[left - 1]
            # the reading of the row itself: half a row's motion behind the boundary
            apart = 0.5 * (left - start + end - came) + came - left
            found[row, axis] = offset + step * (level[left - 1] + 0.5 * on + 0.5 * on / apart)
            good[row, axis] = True
    return found, good


def _of_step(level: FloatArray, left: int, came: int) -> int | None:
    """Return the first row behind a step by one between two stands, which end before ``left`` and begin at ``came``."""
    before, behind = level[left - 1], level[came]
    between = level[left:came]
    if abs(behind - before) != 1.0 or not np.all((between == before) | (between == behind)):
        return None
    return left + int(np.count_nonzero(between == before))
