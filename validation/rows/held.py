"""Readings that stand on several rows of a faster log (sample and hold): found, and told from chance repeats.

A logger that writes a row more often than a sensor updates writes the last reading again. What gives such repeats away:

*All axes repeat together.* Let a row repeat axis j with probability q_j. Where axes repeat by chance (a coarse
resolution, a slow motion, a rest) they do so independently, and all of them repeat with probability prod q_j. Where
readings are held, a share h of the rows repeats on every axis, and only the others by chance. Over N rows of which J
repeat jointly and a_j on axis j, with H(q) = -q log q - (1 - q) log(1 - q) and q'_j = (a_j - J)/(N - J):

    joint evidence = log L(held) - log L(independent)
                   = J log(J/N) + (N - J) [log(1 - J/N) - log(1 - prod q'_j) - sum H(q'_j)] + N sum H(a_j/N) - log(N)/2

The last term is the price of the one number more (h).

*They come evenly.* A sensor's clock passes the log's at a steady ratio, so rows between repeats (or between fresh rows,
whichever are fewer) are the two whole numbers about their mean m, one more or less where the logger stutters. Chance
makes them geometric, p(d) = (1 - 1/m)^(d - 1)/m. The log ratio of the two likelihoods is the evidence of evenness. It
is what tells a hold from axes that repeat together because the whole body comes to rest, and from bursts of vibration.

Both are summed over blocks of rows, since q_j changes along a recording, at several lengths of block: a hold of few
repeats, or of few fresh rows, needs long ones. A sensor is held where both exceed `EVIDENCE` at one length. With one
axis alive there is no joint evidence: the even spacing must then say more, and the changes be no single steps of
resolution (a slow ramp rounded to steps changes as evenly as a held sensor does). Where a logger stutters so much that
no spacing is left, repeats that are joint ones four times in five and come in no clumps do instead.

How often this is right, on 1000 sound and 1000 held logs of each length (python benchmarks/held_rows.py):

    length of the log                    0.6 s    3 s    12 s    60 s
    sound logs called held                   0      0       0       0   of 1000 each: below 0.1 % with 95 % confidence
    held logs found                       56 %   83 %    86 %    87 %
    those with noise above one step       74 %   98 %    98 %    97 %   the others often rest on one reading
    error of the rate found, median      0.8 %  0.3 %   0.1 %   0.1 %
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import BoolArray, FloatArray

__all__ = [
    "Held",
    "come_evenly",
    "evidence",
    "find_held",
    "find_interpolated",
    "fresh_rows",
    "step_of",
    "with_holes_filled",
]

#: log likelihood ratio that each kind of evidence must exceed; e^-10 is 5e-5, and both must err at once
EVIDENCE = 10.0
#: the same of evenness where one axis is alone
ALONE = 25.0
#: axes that a row with a hole and its neighbour must share: noise of many steps hardly ever repeats on two
ALIKE = 2
#: rows per block at which the evidence is summed; the last takes all
BLOCKS = (128, 512, 2048, 1 << 62)
#: fewest repeats (or fresh rows) in a block that tell of their spacing
FEWEST = 6
#: joint evidence of a block above which its spacing is looked at: below it the repeats are chance's
WORTH = 3.0
#: share of spacings that are neither of the two whole numbers, in a log whose rows come evenly and in one that stutters
STUTTER = (0.1, 0.5)
#: a step this much smaller than the readings is that of the digits in the file; 24 bits have 6e-8
WRITTEN = 3e-8
#: fewest stretches over which clumps of repeats are looked for
CLUMPS = 20
#: share of spacings that may be anything (a chance repeat among fresh rows, a lost reading)
ODD = 0.05


@dataclass(frozen=True)
class Held:
    """A sensor whose readings stand on several rows.

    Attributes
    ----------
    rows_per_reading : float
        Rows of the log per reading of the sensor.
    joint, even : float
        The two evidences (log likelihood ratios) by which it was found.
    """

    rows_per_reading: float
    joint: float
    even: float


def find_held(value: FloatArray) -> Held | None:
    """Return how readings (n,) or (n, k), in the order of the log, are held; None where nothing shows that they are.

    Rows with a gap (NaN) are passed over. Axes that never change tell nothing and are left aside.
    """
    same, changes = _repeats(value)
    if same.size == 0:
        return None
    best = None
    for size in BLOCKS:
        joint, even, rows, fresh = evidence(same, size)
        held = Held(rows / max(fresh, 1.0), joint, even)
        alone = same.shape[1] == 1
        enough = even > ALONE and changes > 1.5 if alone else min(joint, even) > EVIDENCE
        if enough and (best is None or min(joint, even) > min(best.joint, best.even)):
            best = held
        if size > len(same):
            break
    if best is None and _scattered(same) and (joint := _joint(same, np.all(same, axis=1))) > EVIDENCE:
        best = Held(1 / (1 - _held_share(same, np.all(same, axis=1))), joint, 0.0)
    return best


def with_holes_filled(value: FloatArray) -> FloatArray:
    """Return readings (n, k) with the holes of a row filled from a neighbour that holds the same reading.

    It is the same where all axes that both rows have are, two at least. Of a held reading a row may lose a cell.
    """
    whole = value.copy()
    for ahead in (1, -1) if len(value) else ():
        other = np.roll(whole, ahead, axis=0)
        other[0 if ahead == 1 else -1] = np.nan
        both = np.isfinite(whole) & np.isfinite(other)
        same = (both.sum(axis=1) >= ALIKE) & np.all(~both | (whole == other), axis=1)
        holes = same[:, None] & np.isnan(whole)
        whole[holes] = other[holes]
    return whole


def evidence(same: BoolArray, size: int) -> tuple[float, float, int, float]:
    """Return joint evidence and evidence of evenness over blocks of ``size`` rows, and the rows and readings in them.

    ``same`` (n, k) tells which axes of a row repeat the row before. Blocks with less joint evidence than `WORTH` are
    left out of all four (with one axis none is).
    """
    joint = even = 0.0
    rows, fresh = 0, 0.0
    for start in range(0, len(same), size):
        block = same[start : start + size]
        if len(block) < size // 2 and start:
            continue
        together = np.all(block, axis=1)
        if block.shape[1] > 1:
            found = _joint(block, together)
            if found < WORTH:
                continue
            joint += found
        spaced = _even(together)
        if spaced is None:
            continue
        even += spaced
        rows += len(block)
        fresh += len(block) * (1 - _held_share(block, together))
    return joint, even, rows, fresh


def come_evenly(rows: BoolArray) -> bool:
    """Tell whether some rows (n,) of a log come as evenly as those without a reading of a slower sensor."""
    for size in BLOCKS:
        spaced = [_even(rows[start : start + size]) for start in range(0, len(rows), size)]
        if sum(found for found in spaced if found is not None) > ALONE:
            return True
        if size > len(rows):
            break
    return False


def _held_share(block: BoolArray, together: BoolArray) -> float:
    """Return the share of rows that are held: those that repeat jointly less those that would by chance.

    Among the rows that do not repeat jointly axis j repeats with q'_j = (q_j - P)/(1 - P), where P = prod q_j is the
    chance that a fresh reading repeats on every axis; P is found by going round.
    """
    share = float(np.mean(together))
    if block.shape[1] == 1 or share in (0.0, 1.0):
        return share
    others = np.mean(block[~together], axis=0)
    chance = 0.0
    for _ in range(50):
        chance = float(np.prod(others * (1 - chance) + chance))
    return max(0.0, (share - chance) / max(1 - chance, 1e-9))


def _scattered(same: BoolArray) -> bool:
    """Tell whether repeats are joint ones almost always and come in no clumps, however unevenly.

    This is a log whose rows stutter. Rests and frozen readings come in clumps: the variance of the number of repeats in
    stretches of equal length is then several times that of independent rows, and below 1.5 times it (over `CLUMPS`
    stretches) it is not: the ratio scatters by 0.25 about 1.
    """
    together = np.all(same, axis=1)
    if same.shape[1] == 1 or not np.any(together) or np.count_nonzero(together) < 0.8 * np.count_nonzero(same.any(1)):
        return False
    share = float(np.mean(together))
    size = int(np.ceil(4 / max(min(share, 1 - share), 1e-9)))
    if len(together) // size < CLUMPS:
        return False
    counts = together[: len(together) // size * size].reshape(-1, size).sum(axis=1)
    return float(np.var(counts)) < 1.5 * size * share * (1 - share)


def _repeats(value: FloatArray) -> tuple[BoolArray, float]:
    """Return which living axes repeat the row before, (n - 1, k), and the median change in steps of resolution."""
    table = value.reshape(len(value), -1)
    seen = ~np.all(np.isnan(table), axis=0)
    table = table[:, seen]
    table = table[np.all(np.isfinite(table), axis=1)]
    if len(table) < 2 * FEWEST or table.shape[1] == 0:
        return np.zeros((0, 1), dtype=np.bool_), 0.0
    change = np.diff(table, axis=0)
    alive = np.any(change != 0, axis=0)
    if not np.any(alive):
        return np.zeros((0, 1), dtype=np.bool_), 0.0
    change = change[:, alive]
    sizes = np.abs(change[:, 0][change[:, 0] != 0])
    return change == 0, float(np.median(sizes) / np.min(sizes))


def _entropy(share: FloatArray) -> FloatArray:
    inside = np.clip(share, 1e-12, 1 - 1e-12)
    return np.asarray(-inside * np.log(inside) - (1 - inside) * np.log1p(-inside))


def _joint(block: BoolArray, together: BoolArray) -> float:
    """Return the joint evidence of one block, see the module's docstring."""
    n, held = len(block), int(np.count_nonzero(together))
    if not 0 < held < n:
        return 0.0
    counts = np.count_nonzero(block, axis=0)
    others = (counts - held) / (n - held)
    independent = -n * float(np.sum(_entropy(counts / n)))
    rest = float(np.log1p(-held / n) - np.log(max(1.0 - np.prod(others), 1e-12)) - np.sum(_entropy(others)))
    return held * float(np.log(held / n)) + (n - held) * rest - independent - 0.5 * float(np.log(n))


def _even(together: BoolArray) -> float | None:
    """Return how much likelier the spacing of the rarer kind of row is even than chance; None if they are too few."""
    share = float(np.mean(together))
    rows = np.flatnonzero(together if share <= 0.5 else ~together)
    if rows.size < FEWEST + 1:
        return None
    spacing = np.diff(rows)
    # the block's own mean where that of the spacings does not fill it: a cluster of repeats in a long block is not even
    mean = float(np.mean(spacing))
    if abs(together.size / mean - rows.size) > 1.0:
        mean = together.size / rows.size
    chance = (spacing - 1) * np.log1p(-1 / mean) - np.log(mean)
    likely = [
        float(np.sum(np.log((1 - ODD) * _even_share(spacing, mean, stutter) + ODD * np.exp(chance) + 1e-300)))
        for stutter in STUTTER
    ]
    return max(likely) - float(np.log(2)) - float(np.sum(chance))


def _even_share(spacing: FloatArray, mean: float, stutter: float) -> FloatArray:
    """Return the probability of each spacing where the two whole numbers about ``mean`` are the rule."""
    low = np.floor(mean)
    part = mean - low

    def exact(d: FloatArray) -> FloatArray:
        return np.where(d == low, 1 - part, np.where(d == low + 1, part, 0.0))

    return np.asarray((1 - stutter) * exact(spacing) + stutter / 2 * (exact(spacing - 1) + exact(spacing + 1)))


def fresh_rows(value: FloatArray, held: Held) -> BoolArray:
    """Tell which rows (n,) of a held sensor show a fresh reading.

    Those are the rows that differ from the row before. A reading can stand no longer than the sensor's period: where
    one stands longer and the next is within two steps of resolution of it, the sensor read the same again, and the row
    at which each such reading was due counts as fresh. Rows with a gap are kept: the gap is told apart elsewhere.
    """
    table = value.reshape(len(value), -1)
    changed = np.any((table[1:] != table[:-1]) & ~(np.isnan(table[1:]) & np.isnan(table[:-1])), axis=1)
    fresh = np.concatenate([[True], changed])
    first = np.flatnonzero(fresh)
    steps = np.array([step_of(column) or 0.0 for column in table.T])
    period = held.rows_per_reading
    for start, stop in zip(first, [*first[1:], len(fresh)], strict=True):
        due = int(np.round((stop - start) / period))
        if due < 2 or stop - start <= np.ceil(period):
            continue
        after = table[min(stop, len(table) - 1)] - table[start]
        if np.all(np.isnan(after) | (np.abs(after) <= 2.01 * steps)):
            again = start + np.round(np.arange(1, due) * (stop - start) / due).astype(int)
            fresh[again] = True
    return fresh


def find_interpolated(value: FloatArray, largest: int = 12) -> tuple[int, int] | None:
    """Return (m, p) where only rows p, p + m, p + 2 m, ... were read and the rest lie on straight lines between them.

    Readings of resolution q that were interpolated and rounded again lie within q of the line. No sensor does that by
    itself: the chance that noise of a few q puts a reading so near is below one half a row, and it must hold for 98 %
    of the rows between and for fewer than 80 % of the rows read, over 50 rows that move by more than 4 q.
    """
    table = value.reshape(len(value), -1)
    table = table[:, ~np.any(np.isnan(table), axis=0)]
    if len(table) < 64 or table.shape[1] == 0:
        return None
    steps = np.array([step_of(column) or 0.0 for column in table.T])
    bent = np.abs(table[2:] - 2 * table[1:-1] + table[:-2])
    moving = np.any(np.abs(table[2:] - table[:-2]) > 8 * steps, axis=1)
    straight = np.all(bent <= 2.01 * steps, axis=1)
    number = np.arange(1, len(table) - 1)
    if np.count_nonzero(moving) < 50:
        return None
    for m in range(largest, 1, -1):
        for p in range(m):
            read = number % m == p
            between = straight[moving & ~read]
            if between.size >= 25 and np.mean(between) > 0.98 and np.mean(straight[moving & read]) < 0.8:
                return m, p
    return None


def step_of(column: FloatArray) -> float | None:
    """Return the step of resolution of readings (n,), found from the data; None where they show none.

    All differences of the readings are whole numbers of it. It is the smallest difference if the others are multiples
    of that within a tenth of a step (digits cut off in the file blur them), refined along the ladder of values.
    """
    seen = np.unique(column[np.isfinite(column)])
    if seen.size < 3:
        return float(seen[1] - seen[0]) if seen.size == 2 else None
    ladder = np.diff(seen)
    ladder = ladder[ladder > 1e-9 * max(abs(seen[0]), abs(seen[-1]))]
    if ladder.size == 0:
        return None  # they differ by rounding alone
    # the smallest differences, averaged, bear less of the blur than the smallest alone
    smallest = float(np.min(ladder))
    step = float(np.mean(ladder[ladder < 1.5 * smallest]))
    span = np.cumsum(ladder)
    for reach in (8, 64, 512, 4096, 32768):
        near = span <= reach * step
        if np.count_nonzero(near) < 2:
            continue
        whole = np.round(span[near] / step)
        step = float(whole @ span[near] / (whole @ whole))
    if step < WRITTEN * max(abs(seen[0]), abs(seen[-1])):
        return None
    whole = np.round(ladder / step)
    blur = np.abs(ladder / step - whole)
    return step if np.quantile(blur, 0.9) < 0.1 and np.min(whole) >= 1 else None
