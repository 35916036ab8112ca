"""Which of a free-running part's samples each row of a logger shows, counted along a motion that is flexible.

Takes a magnetometer in its disc's plane; gives, row by row, the number of its newest sample and how much older the
other one of a mean is. The field along a flexible motion (slow turn, wobble, hard iron) and the likeliest samples
(Viterbi, 1967) are found in turn. The motion is linear in its unknowns, so that nothing but whole numbers is chosen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from discsim.arrays import ComplexArray, FloatArray, IntArray
from discsim.compiled import compiled
from discsim.recording import Recording
from discsim.validation.diagnosis.signals.phase_regression import (
    rate_of,
    signal_of,
    slow_columns,
    slow_count,
)
from discsim.validation.identification.circle import circle_centre

__all__ = ["PRICE", "Counted", "Field", "count_samples", "field_of", "followed", "rms", "unslipped"]

#: knots of the field's slow turn and of the wobble's amplitude: one per so many seconds (a
#: wobble halves in 0.3 s or more)
_KNOTS_S = 0.3
#: what a spline's second differences are held to, as a share of the field's size: loosely, so that rows which do not
#: fit yet cannot bend it
_STIFF = 0.2
#: rounds of motion and samples, and reweighted steps of the motion in each (bisquare's cousin: Cauchy weights)
_ROUNDS, _REWEIGHTED = 12, 12
#: beyond so many standard deviations a row counts by its logarithm (Cauchy): one that is off for another reason must
#: not decide, and of two numbers that are both off the nearer one is still the likelier
_ROBUST = 3.0
#: how often a period is made better by the field's drift against the angle turned, and how far that may take it
_REFINED, _NEARLY = 3, 0.03
#: where a recording may be miscounted is looked for at so many places, of so many rows, so many times
_PLACES, _BLOCK, _SLIPS = 2, 15, 5
#: least noise of a reading, uT: below it the flexible motion would explain noise
_FLOOR = 0.05
#: how likely it is beforehand that a row shows the 1st, 2nd, ... sample after the one before
_AHEAD = np.array([0.0, 0.6, 0.28, 0.08, 0.02, 0.01, 0.005, 0.003, 0.002])
#: and that the two samples of a mean are not neighbours: the loop has skipped one of them
_SKIPPED = 0.07
#: the same of a row whose logger loses none: it shows the sample of the row before, the next, or the one after that
_KEPT = np.array([0.1, 0.75, 0.15])
#: a row this many robust scales off the motion is no reading of any sample: normal noise makes none in 1e9 rows
_DOUBTFUL = 6.0
#: twice the log likelihood that means of two samples, or a finer tick, must gain beyond their pattern's price
PRICE = 24.0


@dataclass(frozen=True)
class Field:
    """A magnetometer in its disc's plane: x + i y (n,), uT, the rate at each row (n,) rad/s, and how a wobble turns."""

    value: ComplexArray
    rate: FloatArray
    #: turns of the wobble in the body per turn of the disc, less one; None where no disc is stated
    wobble: float | None
    #: a row as it is written, s
    row_s: float

    def turned(self, t: FloatArray) -> Any:
        """Return the angle turned as a polynomial of time, the rows being at ``t`` (n,): a disc's spin is smooth."""
        return np.polynomial.Polynomial.fit(t, self.rate, 3).integ()


@dataclass(frozen=True)
class _Flexible:
    """The field along a flexible motion: hard iron, a slow turn, a wobble; all but the angle turned is linear."""

    angle: Any
    end: float
    wobble: float | None

    def columns(self, t: FloatArray) -> ComplexArray:
        """Return the columns (n, p) at times (n,)."""
        slow = slow_columns(t, self.end, _KNOTS_S)
        psi = self.angle(t) - self.angle(0.0)
        parts = [np.ones((t.size, 1), dtype=np.complex128), np.exp(-1j * psi)[:, None] * slow]
        if self.wobble is not None:
            parts.append(np.exp(1j * self.wobble * psi)[:, None] * slow)
        return np.hstack(parts)

    def drift(self, x: ComplexArray) -> float:
        """Return how fast, rad/s, the slow turn of coefficients (p,) runs away from the angle turned."""
        t = np.linspace(0.2 * self.end, 0.8 * self.end, 50)
        psi = self.angle(t) - self.angle(0.0)
        slow = np.exp(1j * psi) * (self.columns(t)[:, 1 : 1 + self._count] @ x[1 : 1 + self._count])
        turned = np.unwrap(np.angle(slow))
        return float(np.polynomial.Polynomial.fit(t, turned, 1).convert().coef[1])

    @property
    def _count(self) -> int:
        return slow_count(self.end, _KNOTS_S)

    def held(self, size: float) -> FloatArray:
        """Return the rows (c, p) that hold second differences of the splines' coefficients to a share of ``size``."""
        count = self._count
        second = np.diff(np.eye(count), 2, axis=0) / (_STIFF * size)
        splines = 1 if self.wobble is None else 2
        rows = np.zeros((splines * len(second), 1 + splines * count))
        for i in range(splines):
            rows[i * len(second) : (i + 1) * len(second), 1 + i * count : 1 + (i + 1) * count] = second
        return rows


def _fitted(columns: ComplexArray, held: FloatArray, value: ComplexArray) -> tuple[ComplexArray, ComplexArray, float]:
    """Return robust coefficients (p,), residuals (n,) and their scale, uT."""
    left, scale = value, np.inf
    x = np.zeros(columns.shape[1], dtype=np.complex128)
    for _ in range(_REWEIGHTED):
        weight = np.ones(value.size) if np.isinf(scale) else 1.0 / (1.0 + (np.abs(left) / (2.0 * scale)) ** 2)
        sd = 1.0 if np.isinf(scale) else scale
        A = np.vstack([columns * np.sqrt(weight)[:, None] / sd, held])
        b = np.concatenate([value * np.sqrt(weight) / sd, np.zeros(len(held))])
        x = np.linalg.lstsq(A, b, rcond=None)[0]
        left = value - columns @ x
        scale = max(float(np.median(np.abs(left))), _FLOOR)
    return x, left, scale


@compiled
def _likeliest_kept(cost: FloatArray, ahead: FloatArray) -> tuple[float, IntArray, IntArray]:
    """Return twice the negative log likelihood, the newest sample of each row and by how much it is ahead.

    The likeliest where no row is lost.

    ``cost`` (k, n, m) is what row n costs that shows sample m where the row before showed m - k; ``ahead`` (k,) are the
    prices of these steps.
    """
    kinds, rows, samples = cost.shape
    best = np.full((rows, samples), np.inf)
    step = np.zeros((rows, samples), np.int64)
    for m in range(min(samples, 2 * kinds)):
        for n in range(kinds):
            if cost[n, 0, m] + ahead[n] < best[0, m]:
                best[0, m] = cost[n, 0, m] + ahead[n]
                step[0, m] = n
    for k in range(1, rows):
        for m in range(samples):
            for n in range(min(kinds, m + 1)):
                total = best[k - 1, m - n] + cost[n, k, m] + ahead[n]
                if total < best[k, m]:
                    best[k, m] = total
                    step[k, m] = n
    newest = np.zeros(rows, np.int64)
    between = np.zeros(rows, np.int64)
    m = int(np.argmin(best[rows - 1]))
    total = best[rows - 1, m]
    for k in range(rows - 1, -1, -1):
        newest[k] = m
        between[k] = step[k, m]
        m -= step[k, m]
    return total, newest, between


@compiled
def _likeliest(cost: FloatArray, ahead: FloatArray, skipped: FloatArray) -> tuple[float, IntArray, IntArray]:
    """Return twice the negative log likelihood and the likeliest newest sample and distance of each row.

    ``cost`` (d, n, m) is what row n costs that shows sample m and, where d is 1, one that is two older; ``ahead`` (k,)
    and ``skipped`` (d,) are the prices of their numbers.
    """
    kinds, rows, samples = cost.shape
    best = np.full((rows, samples, kinds), np.inf)
    step = np.zeros((rows, samples, kinds), np.int64)
    before = np.zeros((rows, samples, kinds), np.int64)
    for m in range(min(samples, 2 * ahead.size)):
        for d in range(kinds):
            best[0, m, d] = cost[d, 0, m] + skipped[d]
    for k in range(1, rows):
        for m in range(k, samples):
            for d in range(kinds):
                mine = cost[d, k, m] + skipped[d]
                for n in range(1 + d, min(ahead.size, m + 1)):
                    for p in range(kinds):
                        total = best[k - 1, m - n, p] + mine + ahead[n]
                        if total < best[k, m, d]:
                            best[k, m, d] = total
                            step[k, m, d] = n
                            before[k, m, d] = p
    newest = np.zeros(rows, np.int64)
    kind = np.zeros(rows, np.int64)
    m, d = 0, 0
    for i in range(samples):
        for j in range(kinds):
            if best[rows - 1, i, j] < best[rows - 1, m, d]:
                m, d = i, j
    total = best[rows - 1, m, d]
    for k in range(rows - 1, -1, -1):
        newest[k] = m
        kind[k] = d
        n, p = step[k, m, d], before[k, m, d]
        m, d = m - n, p
    return total, newest, kind


@dataclass(frozen=True)
class Counted:
    """The samples that rows show, twice the negative log likelihood, residuals and their scale, and a better period."""

    newest: IntArray
    apart: IntArray
    total: float
    left: ComplexArray
    scale: float
    period: float

    @property
    def doubtful(self) -> tuple[int, ...]:
        """Rows that no sample makes read as they do."""
        return tuple(np.flatnonzero(np.abs(self.left) > _DOUBTFUL * self.scale).tolist())


def _first_samples(
    field: Field, centre: complex, period: float, *, means: bool, kept: bool = False
) -> tuple[IntArray, IntArray]:
    """Return first guesses of newest samples (n,) and distances (n,) from how far the field turns row by row.

    ``kept`` tells that no row is lost.
    """
    z = field.value - centre
    rate = 0.5 * (field.rate[1:] + field.rate[:-1])
    turned = -np.angle(z[1:] * np.conj(z[:-1])) * np.sign(rate)
    turned = np.where(turned < -0.5, turned + 2.0 * np.pi, turned) / np.abs(rate) / period
    if kept:
        steps = _steps_of_means(turned) if means else np.clip(np.rint(turned), 0, 2).astype(np.int64)
        steps = np.concatenate([[1], steps[-(z.size - 1) :]])
        return 1 + np.cumsum(steps), steps
    ahead = np.rint(turned).astype(np.int64)
    apart = np.ones(z.size, dtype=np.int64)
    if means:
        halves = np.rint(2.0 * turned) / 2.0
        odd = np.abs(halves - np.rint(halves)) > 0.25
        k = 0
        while k < odd.size - 1:
            # half a sample more or less on both sides: the mean of two that are not neighbours stands between
            if odd[k] and odd[k + 1]:
                apart[k + 1] = 2
                ahead[k], ahead[k + 1] = round(halves[k] + 0.5), round(halves[k + 1] - 0.5)
                k += 1
            k += 1
    newest = 2 + np.concatenate([[0], np.cumsum(np.maximum(ahead, 1))])
    return newest.astype(np.int64), apart


def _steps_of_means(turned: FloatArray) -> IntArray:
    """Return by how many samples (n + 1,) rows are ahead whose means of two turn by ``turned`` (n,) periods.

    The mean of a row's sample and the one of the row before turns by half of what both rows are ahead by; which of them
    took the odd sample the rows beside them tell (Viterbi).
    """
    price = -2.0 * np.log(_KEPT)
    total, before = price.copy(), np.zeros((turned.size, _KEPT.size), dtype=np.int64)
    here = np.arange(_KEPT.size)
    for k, both in enumerate(2.0 * turned):
        offered = total[:, None] + (both - here[:, None] - here[None, :]) ** 2 / 0.25**2 + price[None, :]
        before[k], total = np.argmin(offered, axis=0), np.min(offered, axis=0)
    steps = np.zeros(turned.size + 1, dtype=np.int64)
    steps[-1] = int(np.argmin(total))
    for k in range(turned.size - 1, -1, -1):
        steps[k] = before[k, steps[k + 1]]
    return steps


def followed(
    field: Field,
    newest: IntArray,
    apart: IntArray,
    period: float,
    *,
    means: bool,
    kept: bool = False,
    rounds: int = _ROUNDS,
) -> Counted:
    """Return the likeliest samples of a recording's rows, found with the motion in turn from first guesses.

    Rows show means of two samples or single ones; ``kept`` tells that none is lost.
    """
    ahead = np.full(_AHEAD.size, np.inf)
    ahead[1:] = -2.0 * np.log(_AHEAD[1:])
    skipped = -2.0 * np.log(np.array([1.0 - _SKIPPED, _SKIPPED] if means else [1.0]))
    middle = np.median(field.value.real) + 1j * np.median(field.value.imag)
    size = float(np.median(np.abs(field.value - middle)))
    found: Counted | None = None
    for _ in range(rounds):
        t = np.asarray((newest - (0.5 * apart if means else 0.0)) * period, dtype=np.float64)
        motion = _Flexible(field.turned(t), float(t[-1]) + 0.2, field.wobble)
        columns = motion.columns(np.asarray(newest * period))
        if means:
            columns = np.asarray(0.5 * (columns + motion.columns(np.asarray((newest - apart) * period))))
        x, left, scale = _fitted(columns, motion.held(size), field.value)
        every = motion.columns(np.arange(-2.0, newest[-1] + 12.0) * period) @ x
        shown = [0.5 * (every[2:] + every[1:-1]), 0.5 * (every[2:] + every[:-2])] if means else [every[2:]]
        if kept:
            shown = [every[2:], *shown] if means else 3 * shown
        off = [_ROBUST**2 * np.log1p((np.abs(field.value[:, None] - one) / (_ROBUST * scale)) ** 2) for one in shown]
        if kept:
            total, now, between = _likeliest_kept(np.stack(off), -2.0 * np.log(_KEPT))
        else:
            total, now, kind = _likeliest(np.stack(off), ahead, skipped)
            between = kind + 1
        same = np.array_equal(now, newest) and np.array_equal(between, apart)
        better = period * (1.0 - motion.drift(x) / float(np.median(field.rate)))
        found = Counted(now, between, float(total) + 4.0 * newest.size * np.log(scale), left, scale, better)
        newest, apart = now, between
        if same:
            break
    assert found is not None
    return found


def rms(left: ComplexArray) -> float:
    """Return the rms of what is left of a field (n,), uT."""
    return float(np.sqrt(np.mean(np.abs(left) ** 2)))


def field_of(recording: Recording) -> Field | None:
    """Return the field in a recording's plane, None where it or the rate is not told."""
    signal = signal_of(recording, "field")
    known = rate_of(recording)
    if signal is None or known is None:
        return None
    disc = recording.disc
    wobble = None if disc is None or disc.Ixx <= 0.0 else disc.Izz / disc.Ixx - 1.0
    rate = np.interp(signal.t, known[1], known[2])
    return Field(signal.value, rate, wobble, float(np.median(np.diff(signal.t))))


def unslipped(field: Field, found: Counted, period: float, *, means: bool, kept: bool) -> Counted:
    """Return the samples of rows that were miscounted somewhere: all later ones are a sample off, which bends a motion.

    Where most is left, and at rows that no sample makes read as they do, what comes after is counted one more or one
    less; the best of these is gone on from.
    """

    def again(newest: IntArray, apart: IntArray, rounds: int = _ROUNDS) -> Counted:
        return followed(field, newest, apart, period, means=means, kept=kept, rounds=rounds)

    first = _first_samples(field, circle_centre(field.value), period, means=means, kept=kept)
    found = min(again(found.newest, found.apart), again(*first), key=lambda one: one.total)
    for _ in range(_SLIPS):
        block = np.convolve(np.minimum(np.abs(found.left), 10.0 * found.scale), np.ones(_BLOCK), "same")
        places: list[int] = []
        for _ in range(_PLACES):
            k = int(np.argmax(block))
            block[max(k - _BLOCK, 0) : k + _BLOCK] = 0.0
            places += [k - _BLOCK // 2, k, k + _BLOCK // 2]
        for k in found.doubtful:
            places += [k, k + 1]
        tried = []
        for k in np.unique(np.clip(places, 1, found.newest.size - 1)):
            for more in (-1, 1):
                newest = found.newest.copy()
                newest[k:] += more
                if newest[k] >= newest[k - 1] + (0 if kept else 1):
                    tried.append(again(newest, np.diff(newest, prepend=newest[0] - 1) if kept else found.apart, 2))
        best = min(tried, key=lambda one: one.total)
        best = again(best.newest, best.apart)
        if best.total > found.total - PRICE:
            break
        found = best
    return found


def count_samples(field: Field, period: float, *, means: bool, kept: bool = False) -> Counted:
    """Return the samples that rows show at a period, which is made better where it is only nearly right."""

    def begun(period: float) -> Counted:
        first = _first_samples(field, centre, period, means=means, kept=kept)
        return followed(field, *first, period, means=means, kept=kept)

    centre = circle_centre(field.value)
    found = begun(period)
    for _ in range(_REFINED):
        if abs(found.period / period - 1.0) > _NEARLY:
            break
        period = found.period
        better = begun(period)
        if better.total >= found.total:
            break
        found = better
    return found
