"""A magnetometer's own clock behind a logger's rows: which of its samples each row shows, and which rows are means.

Takes recordings whose rows last whole ticks (`row_times`); gives the part's period and, row by row, the number of its
newest sample. A part that free-runs beside the logger's loop hands over the samples that it has: where the loop is
slower, some are never seen, and a row that is the mean of two samples shows one that is not there. The field along a
motion that is flexible (slow turn, wobble, hard iron) and the likeliest samples (Viterbi, 1967) are found in turn. The
motion is linear in its unknowns, so that nothing but whole numbers is chosen, and those never move with a step of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from discsim.arrays import ComplexArray, FloatArray, IntArray
from discsim.compiled import compiled
from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.phase_regression import (
    circle_centre,
    rate_of,
    retimed,
    signal_of,
    slow_columns,
)
from discsim.validation.diagnosis.consistency.skipped_samples import Loop, loop_beside
from discsim.validation.diagnosis.consistency.time_stamp_recovery import Rows

__all__ = ["OwnClock", "SamplesShown", "own_clock_of"]

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
#: least noise of a reading, uT: below it the flexible motion would explain noise
_FLOOR = 0.05
#: how likely it is beforehand that a row shows the 1st, 2nd, ... sample after the one before
_AHEAD = np.array([0.0, 0.6, 0.28, 0.08, 0.02, 0.01, 0.005, 0.003, 0.002])
#: and that the two samples of a mean are not neighbours: the loop has skipped one of them
_SKIPPED = 0.07
#: twice the log likelihood that means of two samples, or a finer tick, must gain beyond their pattern's price
_PRICE = 24.0
#: the field must turn by this many standard deviations of a reading's phase from sample to sample
_PHASE_STEP = 8.0


@dataclass(frozen=True)
class SamplesShown:
    """What the rows of one recording show: newest sample (n,), and how much older the other one of a mean is (n,).

    ``period_of_others_s`` is the period by which they were counted, ``loop_by_skips_s`` the loop's step where rows show
    single samples (``apart`` is zero then), ``left`` what is left of the field, uT rms, along
    a flexible motion: with rows that last whole ticks, and of these samples.
    """

    recording: str
    period_of_others_s: float
    newest: IntArray
    apart: IntArray
    left: tuple[float, float]
    loop_by_skips_s: float | None = None

    @property
    def lost(self) -> float:
        """Share of the logger's own steps that wrote no row, a step being the mean one between skipped samples."""
        steps = np.diff(self.newest).sum() - self._skips
        return float(1.0 - (self.newest.size - 1) / max(steps, 1))

    @property
    def _skips(self) -> int:
        """Samples that the logger's loop has skipped, those within lost rows by their mean spacing."""
        if self.loop_by_skips_s is not None:
            span = float(self.newest[-1] - self.newest[0])
            return round(span * (1.0 - self.period_of_others_s / self.loop_by_skips_s))
        at = self.newest[self.apart == 2]
        if at.size < 2:
            return int(at.size)
        gaps = np.diff(at)
        return round(float(self.newest[-1] - self.newest[0]) / float(np.median(gaps)))

    @property
    def loop_s(self) -> float | None:
        """Duration of a step of the logger's loop, from the samples that it skips; None where it skips too few."""
        at = self.newest[self.apart == 2]
        if self.loop_by_skips_s is not None or at.size < 3:
            return self.loop_by_skips_s
        spacing = float(np.median(np.diff(at)))
        return self.period_of_others_s * spacing / (spacing - 1.0)

    def times(self) -> FloatArray:
        """Return the mean time (n,) s that each row's field is of, from the first row's on."""
        at = (self.newest - 0.5 * self.apart) * self.period_of_others_s
        return np.asarray(at - at[0])

    def averaged(self, first: float) -> tuple[FloatArray, FloatArray]:
        """Return the times (2, n) s and weights (2, n) of the samples of each row, whose first is of time ``first``."""
        middle = first + self.times()
        half = 0.5 * self.apart * self.period_of_others_s
        return np.stack([middle + half, middle - half]), np.full((2, self.newest.size), 0.5)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.recording,
            "period_of_others_s": self.period_of_others_s,
            "loop_s": self.loop_s,
            "rows": int(self.newest.size),
            "means_of_samples_apart": int(np.count_nonzero(self.apart == 2)),
            "lost": self.lost,
            "field_left_uT": dict(zip(("counted_rows", "own_clock"), self.left, strict=True)),
        }


@dataclass(frozen=True)
class OwnClock:
    """A magnetometer's own period, s, with its error, and what each recording's rows show of its samples."""

    period_s: float
    sd_s: float
    gain: float
    shown: tuple[SamplesShown, ...]
    #: how far rows are means of two samples: 0.5, or not at all
    weight: float = 0.5

    def counted(self, recording: Recording, name: str) -> Recording | None:
        """Return a recording with its samples at the times that its rows' samples give, None where there is none."""
        mine = next((item for item in self.shown if item.recording == name), None)
        field = signal_of(recording, "field")
        if mine is None or field is None:
            return None
        if not np.array_equal(field.t, recording.samples["magnetometer"].t):
            return retimed(
                recording, field.t, field.t[0] + mine.times()
            )  # a row without a field: its sample is unknown
        timed = retimed(recording, field.t, field.t[0] + mine.times())
        return replace(timed, averaged={"magnetometer": mine.averaged(float(field.t[0]))})

    @property
    def sentences(self) -> list[str]:
        """What there is to say, in words."""
        how = (
            "and every row shows the mean of its last two samples (mag.average, weight 0.5). Where the logger's loop "
            "skips a sample the two are further apart: that mean turns by half a period less, and is smaller, so that "
            "the tick looks half as long."
            if self.weight
            else "and the logger's slower loop skips samples at even distances, which no row ever shows."
        )
        said = [
            f"The magnetometer has a clock of its own (mag.own_clock): a period of {1e3 * self.period_s:.3f} ± "
            f"{1e3 * self.sd_s:.3f} ms, {how} Twice the log likelihood gains {self.gain:.0f}."
        ]
        for item in self.shown:
            counted, here = item.left
            loop = "" if item.loop_s is None else f", a loop of {1e3 * item.loop_s:.2f} ms"
            said.append(
                f"{item.recording}, with the period of the others: along a smooth motion the field leaves "
                f"{counted:.1f} µT with counted rows, {here:.2f} with the samples that they show{loop}; "
                f"{100.0 * item.lost:.0f} % of the loop's steps wrote no row (clock.lost_rows)."
            )
        return said

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "period_s": self.period_s,
            "period_sd_s": self.sd_s,
            "weight": self.weight,
            "gain": self.gain,
            "heldout": [item.to_json() for item in self.shown],
        }


@dataclass(frozen=True)
class _Field:
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
        return 4 + int(self.end / _KNOTS_S)

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
class _Found:
    """The samples that rows show, twice the negative log likelihood, residuals and their scale, and a better period."""

    newest: IntArray
    apart: IntArray
    total: float
    left: ComplexArray
    scale: float
    period: float


def _first_samples(field: _Field, centre: complex, period: float, *, means: bool) -> tuple[IntArray, IntArray]:
    """Return first guesses of newest samples (n,) and distances (n,) from how far the field turns row by row."""
    z = field.value - centre
    rate = 0.5 * (field.rate[1:] + field.rate[:-1])
    turned = -np.angle(z[1:] * np.conj(z[:-1])) * np.sign(rate)
    turned = np.where(turned < -0.5, turned + 2.0 * np.pi, turned) / np.abs(rate) / period
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


def _followed(field: _Field, newest: IntArray, apart: IntArray, period: float, *, means: bool) -> _Found:
    """Return the likeliest samples of a recording's rows, found with the motion in turn from first guesses."""
    ahead = np.full(_AHEAD.size, np.inf)
    ahead[1:] = -2.0 * np.log(_AHEAD[1:])
    skipped = -2.0 * np.log(np.array([1.0 - _SKIPPED, _SKIPPED] if means else [1.0]))
    middle = np.median(field.value.real) + 1j * np.median(field.value.imag)
    size = float(np.median(np.abs(field.value - middle)))
    found: _Found | None = None
    for _ in range(_ROUNDS):
        t = np.asarray((newest - (0.5 * apart if means else 0.0)) * period, dtype=np.float64)
        motion = _Flexible(field.turned(t), float(t[-1]) + 0.2, field.wobble)
        columns = motion.columns(np.asarray(newest * period))
        if means:
            columns = np.asarray(0.5 * (columns + motion.columns(np.asarray((newest - apart) * period))))
        x, left, scale = _fitted(columns, motion.held(size), field.value)
        every = motion.columns(np.arange(-2.0, newest[-1] + 12.0) * period) @ x
        shown = [0.5 * (every[2:] + every[1:-1]), 0.5 * (every[2:] + every[:-2])] if means else [every[2:]]
        off = [_ROBUST**2 * np.log1p((np.abs(field.value[:, None] - one) / (_ROBUST * scale)) ** 2) for one in shown]
        total, now, kind = _likeliest(np.stack(off), ahead, skipped)
        same = np.array_equal(now, newest) and np.array_equal(kind + 1, apart)
        better = period * (1.0 - motion.drift(x) / float(np.median(field.rate)))
        found = _Found(now, kind + 1, float(total) + 4.0 * newest.size * np.log(scale), left, scale, better)
        newest, apart = now, kind + 1
        if same:
            break
    assert found is not None
    return found


def _rms(left: ComplexArray) -> float:
    return float(np.sqrt(np.mean(np.abs(left) ** 2)))


def _field_of(recording: Recording) -> _Field | None:
    """Return the field in a recording's plane, None where it or the rate is not told."""
    signal = signal_of(recording, "field")
    known = rate_of(recording)
    if signal is None or known is None:
        return None
    disc = recording.disc
    wobble = None if disc is None or disc.Ixx <= 0.0 else disc.Izz / disc.Ixx - 1.0
    rate = np.interp(signal.t, known[1], known[2])
    return _Field(signal.value, rate, wobble, float(np.median(np.diff(signal.t))))


def own_clock_of(recordings: Sequence[Recording], names: Sequence[str], rows: Rows) -> OwnClock | None:
    """Return the magnetometer's own clock, None where rows that are counted in whole ticks do as well.

    Takes recordings, what to call them and the ticks that they come in. Where many rows are means of samples that are
    no neighbours the tick is half a period, else it is a period.
    """
    every = {name: _field_of(recording) for recording, name in zip(recordings, names, strict=True)}
    fields = {name: field for name, field in every.items() if field is not None and name in rows.own}
    if not fields:
        return None
    single = {name: _counted(field, rows.tick_s, means=False) for name, field in fields.items()}
    tried = [
        {name: _counted(field, ticks * rows.tick_s, means=True) for name, field in fields.items()}
        for ticks in (1.0, 2.0)
    ]
    means = min(tried, key=lambda found: sum(one.total for one in found.values()))
    gain = sum(single[name].total - means[name].total for name in fields)
    rest = {name: _rms(one.left) for name, one in single.items()}
    if gain >= _PRICE * len(fields):
        return _clock(fields, means, rest, rows, gain)
    loops = {name: loop_beside(one.newest, one.period, fields[name].row_s) for name, one in single.items()}
    told = {name: loop for name, loop in loops.items() if loop is not None}
    if len(told) < len(fields) or sum(loop.gain for loop in told.values()) < _PRICE:
        return None
    return _clock(fields, single, rest, rows, sum(loop.gain for loop in told.values()), told)


def _clock(
    fields: Mapping[str, _Field],
    counted: Mapping[str, _Found],
    rest: Mapping[str, float],
    rows: Rows,
    gain: float,
    loops: Mapping[str, Loop] | None = None,
) -> OwnClock | None:
    """Return the clock that counted samples tell, None where they are too close to be told apart.

    Takes what is left of each field, ``rest``, where rows last whole ticks. Rows show means of two samples unless
    ``loops`` tell the clock by what they skip.
    """
    means = loops is None
    periods = {name: one.period for name, one in counted.items()}
    shown = []
    for name, field in fields.items():
        others = [period for other, period in periods.items() if other != name] or [periods[name]]
        before, period = counted[name], float(np.mean(others))
        found = _followed(field, before.newest, before.apart, period, means=means)
        turned = found.period * float(np.median(np.abs(field.rate)))
        if turned < _PHASE_STEP * found.scale / float(np.median(np.abs(field.value - circle_centre(field.value)))):
            return None
        apart, step = (found.apart, None) if loops is None else (np.zeros_like(found.apart), loops[name].step_s)
        left = (rest[name], _rms(found.left))
        shown.append(SamplesShown(name, period, found.newest, apart, left, step))
    mean = float(np.mean(list(periods.values())))
    scatter = float(np.std(list(periods.values()), ddof=1)) if len(periods) > 1 else rows.sd_s
    return OwnClock(mean, scatter / np.sqrt(len(periods)), gain, tuple(shown), 0.5 if means else 0.0)


def _counted(field: _Field, period: float, *, means: bool) -> _Found:
    """Return the samples that rows show at a period, which is made better where it is only nearly right."""
    centre = circle_centre(field.value)
    found = _followed(field, *_first_samples(field, centre, period, means=means), period, means=means)
    for _ in range(_REFINED):
        if abs(found.period / period - 1.0) > _NEARLY:
            break
        period = found.period
        better = _followed(field, *_first_samples(field, centre, period, means=means), period, means=means)
        if better.total >= found.total:
            break
        found = better
    return found
