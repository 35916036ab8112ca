"""A gyroscope's own clock behind a logger's rows: which of its samples each row shows, told by the wobble's phase.

Takes recordings whose rows are counted by a magnetometer's samples (`own_clock`); gives, row by row, when the chip of
gyroscope and accelerometer made what the row shows. The loop asked for a row within one period after the newest sample
of the field, and the chip's newest sample is at most one of its own periods older than that. Where a wobble turns fast
each reading tells by its phase how old it is; ages that are a sawtooth put the instants on a comb. The wobble along a
flexible motion and the teeth of the comb are found in turn, the comb as that on which the instants gather most
(Rayleigh's statistic, in N. Fisher, "Statistical Analysis of Circular Data", 1993, 4.3), from periods all over the
range; nothing but whole numbers is chosen row by row, and each choice is paid for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import linprog

from discsim.arrays import BoolArray, ComplexArray, FloatArray
from discsim.compiled import compiled
from discsim.recording import Recording, Samples
from discsim.validation.diagnosis.consistency.late_rows import (
    FoundLateRows,
    Windows,
    asked_within,
    even_loop,
    late_rows_of,
    loops_with_late_rows,
    rows_decided,
)
from discsim.validation.diagnosis.consistency.own_clock import FoundOwnClock, SamplesShown
from discsim.validation.diagnosis.signals.phase_regression import (
    retimed,
    signal_of,
    slow_columns,
    slow_count,
    slow_sum,
)

__all__ = ["FoundImuClock", "ImuRows", "imu_clock_of"]

#: knots of the wobble's amplitude, s, a little closer than where the field's samples are counted (it halves in 0.3 s or
#: more), and of what stands still in the body or in the air
_KNOTS_S, _SLOW_S = 0.25, 0.6
#: periods that are tried, as shares of the logger's rows: parts are set to the loop's rate, and their oscillators are
#: off by 10 % and less (ISM330DHCX: the data rate of a sheet of 104 Hz is 94 to 114 Hz)
_SHORTEST, _LONGEST = 0.8, 1.2
#: by how much the period of one recording may differ from that of the others: a slow slip of the parts' oscillators
_ALIKE = 5e-3
#: rounds of wobble and teeth for each range of periods, and for the best one
_FEW_ROUNDS, _ROUNDS = 4, 12
#: combs that are begun with: periods as quantiles of a range, and phases
_STARTS, _PHASES = (0.2, 0.4, 0.6, 0.8), 4
#: periods of which all recordings are tried at each, in the range in which they count as one
_PERIODS = 9
#: where a recording may be miscounted from is looked for in the worst block of so many rows, so many times; there a row
#: counts for no more than so many medians
_BLOCK, _SLIPS, _LOUD = 15, 5, 10.0
#: twice the log likelihood that a recording must gain beyond what its choices cost, as for the samples of the field,
#: and that all must gain beyond what a comb gains whose period is another by more than the next number
_PRICE, _ANOTHER = 24.0, 0.02
#: times that all rows may be off by, of a period, the nearest first: a wobble that turns by 0.5 rad in a period turns
#: by 0.05 from one to the next, a twentieth of its size
_SHIFTS = np.array(sorted(np.linspace(-0.5, 0.5, 11), key=abs))
#: a tick is settled where a round changes it by less, s: a thousandth of one
_SAME_TICK = 1e-6
#: what chooses one of two teeth costs, in twice the log likelihood
_CHOICE = 2.0 * float(np.log(2.0))
#: a comb this near to the logger's loop is the loop itself: the chip is read as it is sampled
_SAME = 0.02


@dataclass(frozen=True)
class ImuRows:
    """When the chip made what the rows of one recording show, s after the newest sample of its first row (n,).

    ``written`` (n,) are the rows' times as they are written, ``left`` what is left of the wobble, rad/s rms of an axis,
    with the times of the field's samples and with these; ``gain`` is in twice the log likelihood, choices paid.
    """

    recording: str
    period_s: float
    written: FloatArray
    times: FloatArray
    left: tuple[float, float]
    gain: float

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.recording,
            "period_s": self.period_s,
            "rows": int(self.times.size),
            "gain": self.gain,
            "wobble_left_rad_s": dict(zip(("as_the_field", "own_clock"), self.left, strict=True)),
        }


@dataclass(frozen=True)
class FoundImuClock:
    """The own period of the chip of gyroscope and accelerometer, s, with its error, and the rows of each recording.

    ``loops`` tells that the chip is read in step with the logger's loop: its comb is the loop's, no clock of its own.
    ``late`` is by how much rows of the loop came late where none is lost.
    """

    period_s: float
    sd_s: float
    shown: tuple[ImuRows, ...]
    loops: bool
    late: FoundLateRows | None = None

    @property
    def gain(self) -> float:
        """Twice the log likelihood that all recordings gain."""
        return sum(one.gain for one in self.shown)

    def counted(
        self, recording: Recording, timed: Recording, name: str, field: SamplesShown, period: float
    ) -> Recording:
        """Return a recording whose rows are counted with gyroscope and accelerometer at the chip's own times.

        ``timed`` is the recording at the mean times of the magnetometer's samples, ``field``, that its rows show, a
        ``period`` apart, s.
        """
        mine = next((one for one in self.shown if one.recording == name), None)
        if mine is None:
            return timed
        first = float(timed.samples["magnetometer"].t[0]) + 0.5 * float(field.apart[0]) * period
        # what the chip made before the field's first sample must not be before the recording began
        early = max(0.0, -(first + float(mine.times[0])))
        # one sample in two rows: what is written must run on
        at = np.maximum.accumulate(mine.times) + 1e-9 * np.arange(mine.times.size)
        chip = retimed(recording, mine.written, first + at).samples
        samples = {}
        for sensor, own in timed.samples.items():
            t = chip[sensor].t if sensor in ("gyroscope", "accelerometer") else own.t
            samples[sensor] = Samples(t + early, own.value)
        averaged = {sensor: (t + early, weights) for sensor, (t, weights) in timed.averaged.items()}
        return replace(timed, samples=samples, averaged=averaged)

    @property
    def sentences(self) -> list[str]:
        """What there is to say, in words."""
        whose = "the logger's own loop" if self.loops else "a clock of its own (imu.own_clock)"
        said = [f"The chip of gyroscope and accelerometer goes by {whose}: a period of {1e3 * self.period_s:.3f} ms."]
        said += [
            f"{one.recording}: along a smooth motion the wobble leaves {one.left[0]:.3f} rad/s with the times of the "
            f"field's samples, {one.left[1]:.3f} at the chip's own."
            for one in self.shown
        ]
        if self.late is not None:
            said.append(
                f"{100.0 * self.late.fraction:.0f} % of the loop's rows came {1e3 * self.late.tick_s:.2f} ms late "
                f"(clock.late_rows); the magnetometer and the chip tell the same ones, by {self.late.agreed:.0f} in "
                "twice the log likelihood."
            )
        return said

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "period_s": self.period_s,
            "period_sd_s": self.sd_s,
            "late_rows": None if self.late is None else self.late.to_json(),
            "rows": [one.to_json() for one in self.shown],
        }


@dataclass(frozen=True)
class _Wobble:
    """A gyroscope across its axis: x + i y (n,) rad/s, when each row was asked for at the earliest (n,) s, its spin."""

    value: ComplexArray
    written: FloatArray
    asked: FloatArray
    turned: Any
    spin: Any
    order: float
    #: period of the field's samples, s: a row was asked for within it
    within: float

    def columns(self, t: FloatArray) -> tuple[ComplexArray, int]:
        """Return the columns (n, p) at times (n,), and how many of them are the wobble's."""
        start, end = self._span
        psi = self._turned_since_first(t)
        fast = np.exp(1j * self.order * psi)[:, None] * slow_columns(t - start, end - start, _KNOTS_S)
        slow = slow_columns(t - start, end - start, _SLOW_S)
        return np.hstack([fast, slow, np.exp(-1j * psi)[:, None] * slow]), fast.shape[1]

    def reads(self, t: FloatArray, x: ComplexArray) -> ComplexArray:
        """Return what the columns with coefficients (p,) are at times of any shape."""
        start, end = self._span
        psi = self._turned_since_first(t)
        fast, still, carried = np.split(x, np.cumsum([slow_count(end - start, knots) for knots in (_KNOTS_S, _SLOW_S)]))
        return np.asarray(
            np.exp(1j * self.order * psi) * slow_sum(t - start, end - start, _KNOTS_S, fast)
            + slow_sum(t - start, end - start, _SLOW_S, still)
            + np.exp(-1j * psi) * slow_sum(t - start, end - start, _SLOW_S, carried)
        )

    def change(self, t: FloatArray, turning: ComplexArray, x: ComplexArray) -> ComplexArray:
        """Return how fast what turns, (n,) at times (n,), of coefficients (p,), changes, 1/s.

        Beside the spin it turns by what its slow amplitude does: air and tilt precess a disc by some per cent of that.
        """
        start, end = self._span
        slope = slow_sum(t - start, end - start, _KNOTS_S, x, slope=True)
        slow = np.exp(1j * self.order * self._turned_since_first(t)) * slope
        return np.asarray(1j * self.order * self.spin(t) * turning + slow)

    @property
    def _span(self) -> tuple[float, float]:
        """Times between which the splines lie, s: a row shows nothing from beyond them."""
        return float(self.asked[0] - 2.0 * self.within), float(self.asked[-1] + 2.0 * self.within)

    def _turned_since_first(self, t: FloatArray) -> FloatArray:
        return np.asarray(self.turned(t) - self.turned(0.0))


def _wobble_of(recording: Recording, shown: SamplesShown, period: float) -> _Wobble | None:
    """Return the wobble of a recording at the samples of the field that its rows show, None where none is told.

    These samples are a ``period`` apart, s.
    """
    field, wobble = signal_of(recording, "field"), signal_of(recording, "wobble")
    if field is None or wobble is None or field.t.size != shown.newest.size:
        return None
    both = np.isin(field.t, wobble.t)
    here = np.isin(wobble.t, field.t)
    rate = recording.samples["gyroscope"]
    spin = np.interp(
        wobble.t[here], rate.t[np.isfinite(rate.value[:, 2])], rate.value[np.isfinite(rate.value[:, 2]), 2]
    )
    asked = (shown.newest[both] - shown.newest[0]) * period
    if asked.size < 8 * slow_count(float(asked[-1]), _KNOTS_S):
        return None
    smooth = np.polynomial.Polynomial.fit(asked, spin, 4)
    return _Wobble(wobble.value[here], wobble.t[here], asked, smooth.integ(), smooth, wobble.order, period)


@dataclass(frozen=True)
class _Fitted:
    """The wobble's coefficients (p,), what they leave (n,), its rms of an axis, and when the wobble says rows were."""

    x: ComplexArray
    left: ComplexArray
    rms: float
    told: FloatArray
    weight: FloatArray


def _fit(wobble: _Wobble, t: FloatArray) -> _Fitted:
    """Fit the flexible wobble at the times (n,) of the rows, and say when its phase puts them."""
    columns, fast = wobble.columns(t)
    gram = columns.conj().T @ columns
    gram[np.diag_indices_from(gram)] += 1e-9 * np.trace(gram).real / len(gram)
    x = np.asarray(np.linalg.solve(gram, columns.conj().T @ wobble.value), dtype=np.complex128)
    left = wobble.value - columns @ x
    rms = float(np.sqrt(np.sum(np.abs(left) ** 2) / (2.0 * (t.size - x.size))))
    change = wobble.change(t, columns[:, :fast] @ x[:fast], x[:fast])
    size = np.abs(change) ** 2
    late = np.real(np.conj(change) * left) / (size + np.mean(np.abs(left) ** 2))
    told = np.clip(t + late, wobble.asked - 1.2 * wobble.within, wobble.asked + 1.2 * wobble.within)
    return _Fitted(x, left, rms, told, size / (size + np.median(size)))


def _strength(told: FloatArray, weight: FloatArray, periods: FloatArray) -> FloatArray:
    """Return how much instants (n,) gather on combs of periods (k,)."""
    total = np.exp(2j * np.pi * told[None, :] / periods[:, None]) @ weight
    return np.asarray(np.abs(total) ** 2 / np.sum(weight**2))


def _on_teeth(wobble: _Wobble, fitted: _Fitted, period: float) -> FloatArray:
    """Return the tooth (n,), of those that a row may show, at which the wobble is most as it reads.

    But for one time that all are off by, which the wobble's phase makes up for: taken is the one, of some in a period
    about none, that has most rows read as they do within the samples that they may show.
    """
    middle = np.sum(fitted.weight * np.exp(2j * np.pi * fitted.told / period))
    phase = float(np.angle(middle)) / (2.0 * np.pi) * period
    first = phase + period * np.floor((wobble.asked - phase) / period)
    teeth = np.stack([first + k * period for k in (-2, -1, 0, 1, 2)])
    off = np.abs(wobble.value - wobble.reads(teeth, fitted.x)) ** 2
    best, least = first, np.inf
    for shift in _SHIFTS * period:
        # the newest sample is at most a period older than the instant of asking, which is within one of the field's
        late = teeth + shift - wobble.asked
        chosen, total = _in_order(teeth, np.where((late > -period) & (late < wobble.within), off, np.inf))
        if total < least:
            best, least = chosen + shift, total
    return best


@compiled
def _in_order(teeth: FloatArray, off: FloatArray) -> tuple[FloatArray, float]:
    """Return for each row the one of its teeth (k, n) that together cost least, none before the row ahead of it.

    And what they cost.
    """
    kinds, rows = off.shape
    total = off[:, 0].copy()
    before = np.zeros((kinds, rows), np.int64)
    for i in range(1, rows):
        reached = np.full(kinds, np.inf)
        for k in range(kinds):
            for ahead in range(kinds):
                # a slow chip shows one sample in two rows, to within rounding of its instant
                if teeth[ahead, i - 1] <= teeth[k, i] + 1e-6 and total[ahead] < reached[k]:
                    reached[k] = total[ahead]
                    before[k, i] = ahead
        total = reached + off[:, i]
    chosen = np.empty(rows)
    k = int(np.argmin(total))
    least = total[k]
    for i in range(rows - 1, -1, -1):
        chosen[i] = teeth[k, i]
        k = before[k, i]
    return chosen, least


@dataclass(frozen=True)
class _Comb:
    """When the rows of a recording were made (n,), s, its period, what is left of the wobble, and what that gains."""

    times: FloatArray
    period: float
    rms: float
    gain: float


def _followed(
    wobble: _Wobble, first: _Fitted, periods: FloatArray, rounds: int, begun: FloatArray | None = None
) -> _Comb:
    """Return the best comb of some periods (k,) in rounds from times (n,), by default those of the field's samples.

    ``first`` is the fit at these, beyond which a comb gains.
    """
    t = wobble.asked if begun is None else begun
    fitted = first if begun is None else _fit(wobble, begun)
    best = _Comb(wobble.asked, float(periods[0]), first.rms, 0.0)
    for _ in range(rounds):
        period = float(periods[int(np.argmax(_strength(fitted.told, fitted.weight, periods)))])
        new = _on_teeth(wobble, fitted, period)
        same = np.array_equal(new, t)
        t, fitted = new, _fit(wobble, new)
        if fitted.rms < best.rms:
            gain = 4.0 * t.size * float(np.log(first.rms / fitted.rms)) - _CHOICE * t.size
            best = _Comb(t, period, fitted.rms, gain)
        if same:
            break
    return best


def _from_all_phases(wobble: _Wobble, first: _Fitted, periods: FloatArray) -> _Comb:
    """Return the best comb of some periods (k,) from combs all over them.

    Of a slight wobble many are nearly as good as their neighbours.
    """
    begun: list[FloatArray | None] = [None]
    for period in np.unique(np.quantile(periods, _STARTS)):
        for phase in period * np.arange(_PHASES) / _PHASES:
            begun.append(phase + period * np.rint((wobble.asked - phase) / period))
    found = [_followed(wobble, first, periods, _FEW_ROUNDS, one) for one in begun]
    best = max(found, key=lambda one: one.gain)
    return max(best, _followed(wobble, first, periods, _ROUNDS, best.times), key=lambda one: one.gain)


def imu_clock_of(recordings: Sequence[Recording], names: Sequence[str], clock: FoundOwnClock) -> FoundImuClock | None:
    """Return the own clock of gyroscope and accelerometer, None where the times of the field's samples do as well.

    Takes recordings, what to call them, and the magnetometer's samples that their rows show. Each recording must gain
    with its period within half a per cent of what the others tell, and all together more than with any other period.
    """
    wobbles = {}
    for recording, name in zip(recordings, names, strict=True):
        shown = next((one for one in clock.shown if one.recording == name), None)
        wobble = None if shown is None else _wobble_of(recording, shown, clock.period_s)
        if wobble is not None:
            wobbles[name] = wobble
    if len(wobbles) < 2:
        return None
    found = _own_comb(wobbles, clock)
    return found if not clock.none_lost else _with_late_rows(wobbles, clock, found)


def _own_comb(wobbles: Mapping[str, _Wobble], clock: FoundOwnClock) -> FoundImuClock | None:
    """Return the clock whose samples the wobbles show, None where the times of the field's samples do as well."""
    row = float(np.median([np.median(np.diff(wobble.written)) for wobble in wobbles.values()]))
    longest = max(float(wobble.asked[-1]) for wobble in wobbles.values())
    periods = np.arange(_SHORTEST * row, _LONGEST * row, 0.1 * row**2 / longest)
    middles = np.exp(np.arange(np.log(_SHORTEST * row), np.log(_LONGEST * row), 1.6 * _ALIKE))
    near = [periods[np.abs(periods / middle - 1.0) <= _ALIKE] for middle in middles]
    first = {name: _fit(wobble, wobble.asked) for name, wobble in wobbles.items()}
    gains = {
        name: np.array([_followed(wobble, first[name], some, _FEW_ROUNDS).gain for some in near])
        for name, wobble in wobbles.items()
    }
    total = np.sum(list(gains.values()), axis=0)
    another = np.abs(middles / middles[int(np.argmax(total))] - 1.0) > _ANOTHER
    if np.max(total) - np.max(total[another]) < _PRICE:
        return None
    about = np.abs(periods / middles[int(np.argmax(total))] - 1.0) <= 2.0 * _ALIKE
    rough = {name: _from_all_phases(wobble, first[name], periods[about]) for name, wobble in wobbles.items()}
    combs = _at_one_period(wobbles, first, rough)
    found = []
    for name, wobble in wobbles.items():
        others = [one for other, one in combs.items() if other != name]
        told = np.average([one.period for one in others], weights=[max(one.gain, 1.0) for one in others])
        best = combs[name]
        if abs(best.period / told - 1.0) > _ALIKE:
            best = _from_all_phases(wobble, first[name], periods[np.abs(periods / told - 1.0) <= _ALIKE])
        if best.gain < _PRICE:
            return None
        found.append(ImuRows(name, best.period, wobble.written, best.times, (first[name].rms, best.rms), best.gain))
    loops = [one.loop_s for one in clock.shown if one.loop_s is not None]
    period = float(np.mean([one.period_s for one in found]))
    same = bool(loops) and abs(period / float(np.median(loops)) - 1.0) < _SAME
    placed = _asked_between if same else _beside_the_loop
    found = [placed(one, wobbles[one.recording]) for one in found]
    return _clock_of(found, same)


def _amid(wobble: _Wobble, times: FloatArray, period: float) -> FloatArray:
    """Return rows' times (n,) with the one time that all are off by, which puts them amid what they may be.

    A wobble's phase tells that time roughly or not at all: each sample is the newest of its part, which tells more.
    """
    late = times - wobble.asked
    room = np.array([-period - np.min(late), wobble.within - np.max(late)])
    return np.asarray(times + np.mean(room))


def _asked_between(rows: ImuRows, wobble: _Wobble) -> ImuRows:
    """Return rows of the loop's own instants, between a row's newest sample of the field and the next."""
    placed = _evenly_between(rows, wobble.asked, wobble.asked + wobble.within)
    return replace(placed, period_s=rows.period_s)


def _beside_the_loop(rows: ImuRows, wobble: _Wobble) -> ImuRows:
    """Return rows of the chip's newest samples before the instants of the even loop that asked for both parts."""
    due = even_loop(_windows(wobble), float(np.median(np.diff(wobble.written))))
    return _evenly_between(rows, due - rows.period_s, due)


def _evenly_between(rows: ImuRows, early: FloatArray, late: FloatArray) -> ImuRows:
    """Return rows of evenly spaced instants that stay farthest within bounds (n,), s.

    A wobble's phase tells instants roughly, and but for one time that all are off by. Beside a part that free-runs they
    are of every age from none to a period of it, which tells that time and the spacing: they are found by linear
    programming, a row that was miscounted paying for how far it is outside.
    """
    step = np.rint((rows.times - rows.times[0]) / rows.period_s)
    count, one = step.size, np.ones((step.size, 1))
    own = -np.eye(count)
    # unknowns: first instant, spacing, least distance from a bound, how far each row is outside
    sides = [np.hstack([sign * one, sign * step[:, None], one, own]) for sign in (-1.0, 1.0)]
    cost = np.concatenate([[0.0, 0.0, -1.0], np.ones(count)])
    bounds = [(None, None)] * 3 + [(0.0, None)] * count
    best = linprog(cost, np.vstack(sides), np.concatenate([-early, late]), bounds=bounds)
    if best.x is None:
        return rows
    return replace(rows, times=best.x[0] + best.x[1] * step, period_s=float(best.x[1]))


def _at_one_period(
    wobbles: Mapping[str, _Wobble], first: Mapping[str, _Fitted], own: Mapping[str, _Comb]
) -> Mapping[str, _Comb]:
    """Return the combs of all recordings at one period, where that tells more than each its ``own``.

    They are of one chip. A recording that was miscounted has another period; tried are those that they found and some
    all over the range. What counts is samples: the best of a recording, wherever it was found, is tried at each period.
    """
    found = [one.period for one in own.values()]
    middle = float(np.median(found))
    ends = middle * (1.0 - _ALIKE), middle * (1.0 + _ALIKE)
    best, samples = own, dict(own)
    for period in {*found, middle, *np.linspace(*ends, _PERIODS).tolist()}:
        for name, one in wobbles.items():
            tried = _from_all_phases(one, first[name], np.array([period]))
            samples[name] = max(samples[name], tried, key=lambda comb: comb.gain)
    samples = {name: _unslipped(one, first[name], samples[name]) for name, one in wobbles.items()}
    for period in {*found, middle, *np.linspace(*ends, 4 * _PERIODS - 3).tolist()}:
        combs = {name: _at_period(one, first[name], samples[name], period) for name, one in wobbles.items()}
        best = max(best, combs, key=lambda tried: sum(comb.gain for comb in tried.values()))
    return best


def _unslipped(wobble: _Wobble, first: _Fitted, comb: _Comb) -> _Comb:
    """Return a comb whose rows from some row on are a sample off, which bends the wobble, counted rightly there."""
    period = np.array([comb.period])
    for _ in range(_SLIPS):
        tried = [comb]
        left = np.abs(_fit(wobble, comb.times).left)
        block = np.convolve(np.minimum(left, _LOUD * np.median(left)), np.ones(_BLOCK), "same")
        worst = int(np.argmax(block))
        for row in range(max(worst - _BLOCK // 2, 1), min(worst + _BLOCK // 2 + 1, left.size)):
            for more in (-comb.period, comb.period):
                times = comb.times + more * (np.arange(comb.times.size) >= row)
                tried.append(_followed(wobble, first, period, _FEW_ROUNDS, _amid(wobble, times, comb.period)))
        better = max(tried, key=lambda one: one.gain)
        if better.gain < comb.gain + _PRICE:
            break
        comb = better
    return comb


def _at_period(wobble: _Wobble, first: _Fitted, comb: _Comb, period: float) -> _Comb:
    """Return a comb followed on from its samples at another period, amid what they may be.

    Parts that are nearly as fast slip by less than a sample in a throw: many periods tell the same samples.
    """
    count = np.rint((comb.times - comb.times[0]) / comb.period)
    times = _amid(wobble, comb.times[0] + period * count, period)
    return _followed(wobble, first, np.array([period]), _ROUNDS, times)


def _with_late_rows(
    wobbles: Mapping[str, _Wobble], clock: FoundOwnClock, comb: FoundImuClock | None
) -> FoundImuClock | None:
    """Return the chip's clock beside a loop some of whose rows are late, or that loop itself where it tells more.

    None where neither does as well as the times of the field's samples.
    """
    looped = _looped(wobbles, clock)
    if comb is not None and not comb.loops and (looped is None or comb.gain > looped.gain):
        return _beside_a_late_loop(wobbles, comb)
    return looped if looped is not None and looped.gain >= _PRICE else None


def _windows(wobble: _Wobble) -> Windows:
    step = np.rint((wobble.written - wobble.written[0]) / float(np.median(np.diff(wobble.written))))
    return Windows(step, wobble.asked, wobble.within)


def _looped(wobbles: Mapping[str, _Wobble], clock: FoundOwnClock) -> FoundImuClock | None:
    """Return the rows of a chip that is read when the loop asks for them, on time or late; None without such a loop."""
    windows = {name: _windows(wobble) for name, wobble in wobbles.items()}
    begun = asked_within(windows)
    if begun is None or not begun[0]:
        return None
    tick, loops = begun
    rows, ticks, told = [], [], {}
    for name, wobble in wobbles.items():
        first, due = _fit(wobble, wobble.asked), loops[name].instants(windows[name].step)
        late, own = _late_by_phase(wobble, due, tick)
        times = due + own * late
        fitted = _fit(wobble, times)
        gain = 4.0 * times.size * float(np.log(first.rms / fitted.rms)) - _CHOICE * times.size
        again = asked_within({name: replace(windows[name], made=wobble.asked - own * late)})
        if again is not None:
            due = again[1][name].instants(windows[name].step)
        rows.append(ImuRows(name, loops[name].step_s, wobble.written, due + own * late, (first.rms, fitted.rms), gain))
        ticks.append(own)
        told[name] = (rows_decided(due, own, wobble.asked, wobble.within), (late, ~late))
    return _clock_of(rows, True, late_rows_of(np.array(ticks), told))


def _late_by_phase(wobble: _Wobble, due: FloatArray, tick: float) -> tuple[BoolArray, float]:
    """Return which rows (n,) the wobble reads as late, and their tick, s, begun with when they were due (n,)."""
    late = wobble.asked > due
    for _ in range(_ROUNDS):
        fitted = _fit(wobble, due + tick * late)
        reads = [wobble.reads(due + tick * one, fitted.x) for one in (0.0, 1.0)]
        now = np.abs(wobble.value - reads[1]) < np.abs(wobble.value - reads[0])
        off, weight = fitted.told - due - tick * late, fitted.weight
        more = 0.0
        if 0 < np.count_nonzero(now) < now.size:
            more = float(np.average(off[now], weights=weight[now]) - np.average(off[~now], weights=weight[~now]))
        tick += more
        if np.array_equal(now, late) and abs(more) < _SAME_TICK:
            break
        late = now
    return late, tick


def _beside_a_late_loop(wobbles: Mapping[str, _Wobble], comb: FoundImuClock) -> FoundImuClock:
    """Return the clock of a chip's own with what the windows of the field's samples say of the loop's late rows."""
    field = {name: _windows(wobble) for name, wobble in wobbles.items()}
    loops = loops_with_late_rows(field)
    if loops is None:
        return comb
    shown = [
        _evenly_between(one, loops.due[one.recording] - one.period_s, loops.due[one.recording] + loops.tick_s)
        for one in comb.shown
    ]
    chip = {one.recording: Windows(field[one.recording].step, one.times, one.period_s) for one in shown}
    return _clock_of(shown, False, loops.told_by(field, chip))


def _clock_of(shown: Sequence[ImuRows], loops: bool, late: FoundLateRows | None = None) -> FoundImuClock:
    """Return the clock that the rows of recordings tell, its error by how much their own periods scatter."""
    own = np.array([one.period_s for one in shown])
    sd = float(np.std(own, ddof=1) / np.sqrt(own.size))
    return FoundImuClock(float(np.mean(own)), sd, tuple(shown), loops, late)
