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

from discsim.arrays import FloatArray, IntArray
from discsim.recording import Recording, Samples
from discsim.validation.diagnosis.consistency.counted_samples import (
    PRICE,
    Counted,
    Field,
    count_samples,
    field_of,
    followed,
    rms,
    unslipped,
)
from discsim.validation.diagnosis.consistency.skipped_samples import OFF, Loops, loops_beside
from discsim.validation.diagnosis.consistency.time_stamp_recovery import Rows
from discsim.validation.diagnosis.signals.phase_regression import (
    retimed,
    signal_of,
)
from discsim.validation.identification.circle import circle_centre

__all__ = ["MOST_ROWS", "FoundOwnClock", "SamplesShown", "own_clock_of", "too_many"]

#: most rows of a recording whose samples are counted: a count takes seconds for 1000, and grows with their square
MOST_ROWS = 1200
#: a recording that is left with so many times what the best one is may be miscounted somewhere
_SLIPPED = 1.3
#: so many rows that no sample makes read as they do a slip leaves at the most, where a motion bends to what follows it
_FEW = 5
#: by how much the times of rows that show the same sample run on, s
_RUNS_ON = 1e-9
#: how long before the first row a motion begins, in periods: half a mean, and a part that is late by as much
_ROOM = 1.5
#: the field must turn by this many standard deviations of a reading's phase from sample to sample
_PHASE_STEP = 8.0


@dataclass(frozen=True)
class SamplesShown:
    """What the rows of one recording show: newest sample (n,), and how much older the other one of a mean is (n,).

    ``period_of_others_s`` is the period by which they were counted, ``loop_by_skips_s`` the loop's step where rows show
    single samples (``apart`` is zero then), ``none_lost`` that each step wrote a row, ``left`` what is left of the
    field, uT rms, along a flexible motion: with rows that last whole ticks, and of these samples. ``doubtful`` are rows
    that no sample makes read as they do.
    """

    recording: str
    period_of_others_s: float
    newest: IntArray
    apart: IntArray
    left: tuple[float, float]
    loop_by_skips_s: float | None = None
    none_lost: bool = False
    doubtful: tuple[int, ...] = ()

    @property
    def lost(self) -> float:
        """Share of the logger's own steps that wrote no row, a step being the mean one between skipped samples."""
        if self.none_lost:
            return 0.0
        steps = np.diff(self.newest).sum() - self._skips
        # steps are counted by a mean spacing, so that there may seem to be fewer of them than rows
        return max(float(1.0 - (self.newest.size - 1) / max(steps, 1)), 0.0)

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
        if self.none_lost:
            return float(self.newest[-1] - self.newest[0]) / (self.newest.size - 1) * self.period_of_others_s
        at = self.newest[self.apart == 2]
        if self.loop_by_skips_s is not None or at.size < 3:
            return self.loop_by_skips_s
        spacing = float(np.median(np.diff(at)))
        return self.period_of_others_s * spacing / (spacing - 1.0)

    def times(self, period: float) -> FloatArray:
        """Return the mean time (n,) s that each row's field is of, from the first row's on, by a ``period``, s."""
        at = (self.newest - 0.5 * self.apart) * period
        if self.none_lost:
            # one sample in two rows: what is written must run on
            at = at + _RUNS_ON * np.arange(at.size)
        return np.asarray(at - at[0])

    def averaged(self, first: float, period: float) -> tuple[FloatArray, FloatArray]:
        """Return the times (2, n) s and weights (2, n) of the samples of each row, whose first is of time ``first``.

        The samples are a ``period`` apart, s.
        """
        middle = first + self.times(period)
        half = 0.5 * self.apart * period
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
class FoundOwnClock:
    """A magnetometer's own period, s, with its error, and what each recording's rows show of its samples."""

    period_s: float
    sd_s: float
    gain: float
    shown: tuple[SamplesShown, ...]
    #: how far rows are means of two samples: 0.5, or not at all
    weight: float = 0.5

    @property
    def none_lost(self) -> bool:
        """Whether the logger wrote a row in each of its steps, some of them late."""
        return all(one.none_lost for one in self.shown)

    def counted(self, recording: Recording, name: str) -> Recording | None:
        """Return a recording with its samples at the times that its rows' samples give, None where there is none.

        All recordings are of one part, and so of one period: precession bends the phase of the field of each by its
        own, which makes periods differ that do not.
        """
        mine = next((item for item in self.shown if item.recording == name), None)
        field = signal_of(recording, "field")
        if mine is None or field is None:
            return None
        if not np.array_equal(field.t, recording.samples["magnetometer"].t):
            # a row without a field: its sample is unknown
            return retimed(recording, field.t, field.t[0] + mine.times(self.period_s))
        # neither the older sample of a mean nor what a fit finds to be late may come before the motion begins
        first = float(field.t[0]) + _ROOM * self.period_s
        timed = retimed(recording, field.t, first + mine.times(self.period_s))
        if mine.doubtful:
            own = timed.samples["magnetometer"]
            value = own.value.copy()
            value[list(mine.doubtful)] = np.nan
            timed = replace(timed, samples={**timed.samples, "magnetometer": Samples(own.t, value)})
        return replace(timed, averaged={"magnetometer": mine.averaged(first, self.period_s)})

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
        if self.none_lost:
            how += (
                " No row is lost: some come late (clock.late_rows), show a newer sample than they should, and the row "
                "after them the same one once more."
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
                + ("none" if item.none_lost else f"{100.0 * item.lost:.0f} %")
                + " of the loop's steps wrote no row (clock.lost_rows)."
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


def too_many(rows: Rows) -> bool:
    """Tell whether rows are too many for their samples to be counted."""
    return max((own.t.size for own in rows.durations), default=0) > MOST_ROWS


def own_clock_of(recordings: Sequence[Recording], names: Sequence[str], rows: Rows) -> FoundOwnClock | None:
    """Return the magnetometer's own clock, None where rows that are counted in whole ticks do as well.

    Takes recordings, what to call them and the ticks that they come in. Where many rows are means of samples that are
    no neighbours the tick is half a period, else it is a period. Rows that are `too_many` are not asked.
    """
    if too_many(rows):
        return None
    every = {name: field_of(recording) for recording, name in zip(recordings, names, strict=True)}
    fields = {name: field for name, field in every.items() if field is not None and name in rows.own}
    if not fields:
        return None
    single = {name: count_samples(field, rows.tick_s, means=False) for name, field in fields.items()}
    rest = {name: rms(one.left) for name, one in single.items()}
    means = min(
        ({n: count_samples(f, ticks * rows.tick_s, means=True) for n, f in fields.items()} for ticks in (1.0, 2.0)),
        key=_total,
    )
    # a slip in one recording weighs as much as what tells means from single samples
    single, means = _unslipped(fields, single, means=False), _unslipped(fields, means, means=True)
    gain = _total(single) - _total(means)
    kept = _kept_rows(fields, rows)
    if kept is not None and (gains := min(_total(single), _total(means)) - _total(kept[1])) >= PRICE * len(fields):
        right = _unslipped(fields, kept[1], means=kept[0], kept=True)
        return _clock(fields, right, rest, rows, gains, means=kept[0], kept=True)
    newest, periods = ({n: one.newest for n, one in single.items()}, {n: one.period for n, one in single.items()})
    loops = loops_beside(newest, periods, float(np.median([field.row_s for field in fields.values()])))
    skips = 0.0 if loops is None else loops.gain
    if gain >= max(PRICE * len(fields), skips):
        return _clock(fields, means, rest, rows, gain, means=True)
    return _clock(fields, single, rest, rows, skips, means=False, loops=loops) if skips >= PRICE else None


def _total(found: Mapping[str, Counted]) -> float:
    """Return twice the negative log likelihood of counted samples over all recordings."""
    return sum(one.total for one in found.values())


def _kept_rows(fields: Mapping[str, Field], rows: Rows) -> tuple[bool, dict[str, Counted]] | None:
    """Return the samples of rows of which none is lost, and whether they are means; None where more would be skipped.

    The loop's step is as it is written to within its oscillator's error: it may skip a sample, and a row that came late
    is followed by a short one.
    """
    tried = []
    for means, ticks in ((False, 1.0), (True, 1.0), (True, 2.0)):
        period = ticks * rows.tick_s
        found = {n: count_samples(field, period, means=means, kept=True) for n, field in fields.items()}
        steps = [(one.newest[-1] - one.newest[0]) * one.period / (one.newest.size - 1) for one in found.values()]
        off = [abs(step / field.row_s - 1.0) for step, field in zip(steps, fields.values(), strict=True)]
        if max(off) < OFF:
            tried.append((means, found))
    return min(tried, key=lambda one: _total(one[1]), default=None)


def _unslipped(
    fields: Mapping[str, Field], counted: Mapping[str, Counted], *, means: bool, kept: bool = False
) -> dict[str, Counted]:
    """Return counted samples of which those are counted again that leave more than others, or few rows off any sample.

    Where many rows are off, nothing is counted wrongly: they show something else.
    """
    least = min(rms(one.left) for one in counted.values())
    middle = float(np.median([one.period for one in counted.values()]))
    return {
        name: unslipped(fields[name], one, middle, means=means, kept=kept)
        if 0 < len(one.doubtful) <= _FEW or rms(one.left) > _SLIPPED * least
        else one
        for name, one in counted.items()
    }


def _clock(
    fields: Mapping[str, Field],
    counted: Mapping[str, Counted],
    rest: Mapping[str, float],
    rows: Rows,
    gain: float,
    *,
    means: bool,
    loops: Loops | None = None,
    kept: bool = False,
) -> FoundOwnClock | None:
    """Return the clock that counted samples tell, None where they are too close to be told apart.

    Takes what is left of each field, ``rest``, where rows last whole ticks. Rows show ``means`` of two samples, or
    ``loops`` may tell the clock by what they skip; ``kept`` tells that none is lost.
    """
    periods = {name: one.period for name, one in counted.items()}
    shown = []
    for name, field in fields.items():
        others = [period for other, period in periods.items() if other != name] or [periods[name]]
        before, period = counted[name], float(np.mean(others))
        found = followed(field, before.newest, before.apart, period, means=means, kept=kept)
        turned = found.period * float(np.median(np.abs(field.rate)))
        if turned < _PHASE_STEP * found.scale / float(np.median(np.abs(field.value - circle_centre(field.value)))):
            return None
        apart, step = (
            found.apart if means else np.zeros_like(found.apart),
            None if loops is None else loops.step_s[name],
        )
        left = (rest[name], rms(np.delete(found.left, found.doubtful)))
        shown.append(SamplesShown(name, period, found.newest, apart, left, step, kept, found.doubtful))
    mean = float(np.mean(list(periods.values())))
    scatter = float(np.std(list(periods.values()), ddof=1)) if len(periods) > 1 else rows.sd_s
    return FoundOwnClock(mean, scatter / np.sqrt(len(periods)), gain, tuple(shown), 0.5 if means else 0.0)
