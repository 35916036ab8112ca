"""Rows that came late beside a logger's even loop: by how much, how many, and which.

Takes, row by row, when the parts had made what each row shows: a row was asked for within one period after the newest
sample of each part. An even loop whose rows come on time or one tick late must pass through all these windows (linear
programming). Where gyroscope and accelerometer are read as the loop asks, the phase of the wobble tells which rows were
late. A loop that only loses rows is never late: each row is asked for a whole number of steps after the one before, so
that the total falls behind, while late rows are made up by a shorter one after them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.special import xlogy

from discsim.arrays import BoolArray, FloatArray, sd_of_share

__all__ = [
    "MISCOUNTED",
    "FoundLateRows",
    "LateLoops",
    "Loop",
    "Windows",
    "asked_within",
    "even_loop",
    "late_rows_of",
    "loops_with_late_rows",
    "rows_decided",
]

#: share of rows that may have been miscounted: a tick is made no wider for fewer
MISCOUNTED = 0.01
#: times by which all rows may have come late that are tried against some that came a tick late
_TRIED = 301
#: by how much a loop's step may be off from the written one, of how many steps, and how many phases are tried: 300
#: steps slip by a twentieth of a step from one to the next
_LOOP_OFF, _LOOPS, _PHASES = 0.01, 121, 60

#: rows (n,) that are late, and those that are on time
Decided = tuple[BoolArray, BoolArray]


@dataclass(frozen=True)
class Windows:
    """A recording's rows: step of the loop (n,), when a part's newest sample was made (n,) s, and its period, s."""

    step: FloatArray
    made: FloatArray
    period_s: float


@dataclass(frozen=True)
class Loop:
    """An even loop: first instant and step, s."""

    first_s: float
    step_s: float

    def instants(self, step: FloatArray) -> FloatArray:
        """Return when rows of some steps (n,) were due, s."""
        return np.asarray(self.first_s + self.step_s * step)


@dataclass(frozen=True)
class FoundLateRows:
    """By how much rows came late, s, and which share of them, with errors.

    ``agreed`` is twice the log likelihood by which two sensors tell the same rows late, beyond chance.
    """

    tick_s: float
    tick_sd_s: float
    fraction: float
    fraction_sd: float
    agreed: float

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "tick_s": self.tick_s,
            "tick_sd_s": self.tick_sd_s,
            "fraction": self.fraction,
            "fraction_sd": self.fraction_sd,
            "agreed": self.agreed,
        }


def asked_within(windows: Mapping[str, Windows]) -> tuple[float, dict[str, Loop]] | None:
    """Return the least tick, s, with which even loops pass through all windows, and the loop of each recording.

    Rows that were miscounted, one in a hundred, may stay outside. None where the program has no answer.
    """
    count = sum(one.step.size for one in windows.values())
    # unknowns: tick, first instant and step of each loop, how far each row is outside
    head, at = 1 + 2 * len(windows), 0
    rows, limits = [], []
    for i, own in enumerate(windows.values()):
        n = own.step.size
        early = np.zeros((n, head + count))
        early[:, 1 + 2 * i] = 1.0
        early[:, 2 + 2 * i] = own.step
        late = early.copy()
        late[:, 0] = 1.0
        early[:, head + at : head + at + n] = -np.eye(n)
        late[:, head + at : head + at + n] = np.eye(n)
        rows += [early, -late]
        limits += [own.made + own.period_s, -own.made]
        at += n
    cost = np.concatenate([[MISCOUNTED * count], np.zeros(head - 1), np.ones(count)])
    bounds = [(0.0, None)] + [(None, None)] * (head - 1) + [(0.0, None)] * count
    best = linprog(cost, np.vstack(rows), np.concatenate(limits), bounds=bounds)
    if best.x is None:
        return None
    loops = {name: Loop(float(best.x[1 + 2 * i]), float(best.x[2 + 2 * i])) for i, name in enumerate(windows)}
    return float(best.x[0]), loops


def even_loop(own: Windows, step: float) -> FloatArray:
    """Return when an even loop of about a ``step``, s, asked for rows (n,), some of which it lost.

    Each was asked for within a period after the part's newest sample. Where the loop is slower than the part, a window
    of one period holds one of its instants at the most: of loops all over a step that one counts which misses least.
    """
    steps = step * np.linspace(1.0 - _LOOP_OFF, 1.0 + _LOOP_OFF, _LOOPS)[:, None]
    least, found = np.inf, own.made
    for phase in np.linspace(0.0, 1.0, _PHASES, endpoint=False):
        first = own.made[0] + phase * steps
        instants = first + steps * np.ceil((own.made - first) / steps)
        missed = np.sum(np.maximum(instants - own.made - own.period_s, 0.0), axis=1)
        best = int(np.argmin(missed))
        if missed[best] < least:
            least, found = float(missed[best]), instants[best]
    return np.asarray(found)


@dataclass(frozen=True)
class LateLoops:
    """Even loops some of whose rows came a tick late, s, with its error, and when the rows (n,) of each were due, s."""

    tick_s: float
    tick_sd_s: float
    due: Mapping[str, FloatArray]

    def told_by(self, field: Mapping[str, Windows], chip: Mapping[str, Windows]) -> FoundLateRows:
        """Return what the windows of the field's samples say of late rows, and how surely those of a chip say so, too.

        Of a short tick few rows are decided by both. That they do not contradict one another, and each by itself asks
        for rows that came late, tells more.
        """
        told = [(self._decided(name, own), self._decided(name, chip[name])) for name, own in field.items()]
        # which rows were late the field tells best: its samples are counted first
        share, error = _share(by_field for by_field, _ in told)
        agreed = _agreed(told)
        if agreed > 0.0:
            agreed = max(agreed, min(self._gain(one) for one in (field, chip)))
        return FoundLateRows(self.tick_s, self.tick_sd_s, share, error, agreed)

    def _decided(self, name: str, own: Windows) -> Decided:
        return rows_decided(self.due[name], self.tick_s, own.made, own.period_s)

    def _gain(self, windows: Mapping[str, Windows]) -> float:
        """Return what a part's windows gain by late rows, in twice the log likelihood.

        Against a loop whose rows all came as late as suits most of them: a row is outside its window once in a hundred,
        late with the share of the rows that are decided, and free where its window holds both.
        """
        counts = np.sum([[np.count_nonzero(one) for one in self._decided(*item)] for item in windows.items()], axis=0)
        begin = np.concatenate([own.made - self.due[name] for name, own in windows.items()])
        end = np.concatenate([own.made + own.period_s - self.due[name] for name, own in windows.items()])
        outside = int(np.count_nonzero((begin > self.tick_s) | (end < 0.0)))
        more = self.tick_s * np.linspace(-1.0, 2.0, _TRIED)[:, None]
        alike = int(np.min(np.count_nonzero((begin > more) | (end < more), axis=1)))
        told = float(np.sum(xlogy(counts, counts / max(float(np.sum(counts)), 1.0))))
        return 2.0 * (told + (outside - alike) * float(np.log(MISCOUNTED)))


def loops_with_late_rows(field: Mapping[str, Windows]) -> LateLoops | None:
    """Return the even loops that the windows of a part ask for, with late rows; None where no row came late.

    The least tick has left one row in a hundred outside, late ones at one end and those on time at the other: if none
    was miscounted, it is too short by the time in which so many begin.
    """
    begun = asked_within(field)
    if begun is None or not begun[0]:
        return None
    tick, loops = begun
    due = {name: loops[name].instants(own.step) for name, own in field.items()}
    share, _ = _share(rows_decided(due[name], tick, own.made, own.period_s) for name, own in field.items())
    period = max(own.period_s for own in field.values())
    late, on_time = (MISCOUNTED * period / max(one, MISCOUNTED) for one in (share, 1.0 - share))
    alone = [asked_within({name: own}) for name, own in field.items()]
    spread = float(np.std([tick if one is None else one[0] for one in alone], ddof=1) / np.sqrt(len(alone)))
    due = {name: one - on_time for name, one in due.items()}
    return LateLoops(tick + late + on_time, float(np.hypot(spread, late)), due)


def rows_decided(due: FloatArray, tick: float, made: FloatArray, period: float) -> Decided:
    """Return which rows (n,) a part says were late, and which were on time; it is silent on the others.

    ``due`` (n,) is when they were due, ``made`` (n,) when the part's newest sample was made, s.
    """
    late = made > due
    on_time = made + period < due + tick
    return late & ~on_time, on_time & ~late


def late_rows_of(ticks: FloatArray, told: Mapping[str, tuple[Decided, Decided]]) -> FoundLateRows:
    """Return what rows are late by, from each recording's own tick (k,) s, and which rows two sensors tell.

    ``told`` are each recording's rows that are late and on time, by the magnetometer and by another sensor, whose word
    counts where they differ.
    """
    share, error = _share([(b[0] | (a[0] & ~b[1]), b[1] | (a[1] & ~b[0])) for a, b in told.values()])
    spread = float(np.std(ticks, ddof=1) / np.sqrt(ticks.size)) if ticks.size > 1 else float("nan")
    return FoundLateRows(float(np.mean(ticks)), spread, share, error, _agreed(told.values()))


def _share(decided: Iterable[Decided]) -> tuple[float, float]:
    """Return the share of rows that are late, of those that are decided, and its error."""
    late, on_time = np.sum([[np.count_nonzero(one) for one in rows] for rows in decided], axis=0)
    count = max(int(late + on_time), 1)
    share = float(late) / count
    return share, sd_of_share(share, count)


def _agreed(told: Iterable[tuple[Decided, Decided]]) -> float:
    """Return twice the log likelihood by which two sensors tell the same rows late, beyond chance."""
    return _beyond_chance(np.sum([[[np.count_nonzero(a & b) for b in by[1]] for a in by[0]] for by in told], axis=0))


def _beyond_chance(table: FloatArray) -> float:
    """Return twice the log likelihood that a table of counts (2, 2) gains by a dependence, 0 where it is opposite."""
    total = float(table.sum())
    if total == 0.0 or table[0, 0] * table[1, 1] <= table[0, 1] * table[1, 0]:
        return 0.0
    expected = np.outer(table.sum(axis=1), table.sum(axis=0)) / total
    return float(2.0 * np.sum(xlogy(table, table / np.maximum(expected, 1e-300))))
