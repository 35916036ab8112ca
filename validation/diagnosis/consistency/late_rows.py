"""Rows that came late beside a logger's even loop: by how much, how many, and which.

Takes, row by row, when the parts had made what each row shows: a row was asked for within one period after the newest
sample of each part. An even loop whose rows come on time or one tick late must pass through all these windows (linear
programming). Where gyroscope and accelerometer are read as the loop asks, the phase of the wobble tells which rows were
late. A loop that only loses rows is never late: each row is asked for a whole number of steps after the one before, so
that the total falls behind, while late rows are made up by a shorter one after them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.special import xlogy

from discsim.arrays import BoolArray, FloatArray

__all__ = [
    "MISCOUNTED",
    "LateRows",
    "Loop",
    "Windows",
    "asked_within",
    "late_all_along",
    "late_needed",
    "late_rows_of",
    "rows_decided",
]

#: share of rows that may have been miscounted: a tick is made no wider for fewer
MISCOUNTED = 0.01
#: times that a part may be off by which are tried, within a period to either side
_TRIED = 201


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
class LateRows:
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


def late_all_along(due: FloatArray, tick: float, own: Windows) -> float:
    """Return by how much a part's samples were made later, s, so that as few rows as can be are outside their windows.

    Its times are known but for one time that all of a recording are off by. ``due`` (n,) is when rows were due, s.
    """

    def outside(more: float) -> float:
        made = own.made + more
        late, early = made - due - tick, due - made - own.period_s
        return float(np.sum(np.maximum(late, 0.0)) + np.sum(np.maximum(early, 0.0)))

    return float(min(np.linspace(-own.period_s, own.period_s, _TRIED), key=outside))


def late_needed(windows: Mapping[str, Windows]) -> tuple[float, float]:
    """Return the tick, s, by which a part's own windows say that rows came late, and what they gain by it.

    In twice the log likelihood, against a loop whose rows all came as late as suits most of them: a row is outside its
    window once in a hundred, late with the share of the rows that are decided, and free where its window holds both.
    """
    begun = asked_within(windows)
    if begun is None or not begun[0]:
        return 0.0, 0.0
    tick, loops = begun
    first, last, counts = [], [], np.zeros(2)
    for name, own in windows.items():
        due = loops[name].instants(own.step)
        counts += [np.count_nonzero(one) for one in rows_decided(due, tick, own.made, own.period_s)]
        first.append(own.made - due)
        last.append(own.made + own.period_s - due)
    begin, end = np.concatenate(first), np.concatenate(last)
    outside = int(np.count_nonzero((begin > tick) | (end < 0.0)))
    alike = min(int(np.count_nonzero((begin > more) | (end < more))) for more in np.linspace(0.0, tick, _TRIED))
    told = float(np.sum(xlogy(counts, counts / max(float(np.sum(counts)), 1.0))))
    return tick, 2.0 * (told + (outside - alike) * float(np.log(MISCOUNTED)))


def rows_decided(due: FloatArray, tick: float, made: FloatArray, period: float) -> tuple[BoolArray, BoolArray]:
    """Return which rows (n,) a part says were late, and which were on time; it is silent on the others.

    ``due`` (n,) is when they were due, ``made`` (n,) when the part's newest sample was made, s.
    """
    late = made > due
    on_time = made + period < due + tick
    return late & ~on_time, on_time & ~late


def late_rows_of(
    ticks: FloatArray, told: Mapping[str, tuple[tuple[BoolArray, BoolArray], tuple[BoolArray, BoolArray]]]
) -> LateRows:
    """Return what rows are late by, from each recording's own tick (k,) s, and which rows two sensors tell.

    ``told`` are each recording's rows that are late and on time, by the magnetometer and by another sensor, whose word
    counts where they differ.
    """
    late = on_time = 0
    table = np.zeros((2, 2))
    for field, other in told.values():
        late += int(np.count_nonzero(other[0] | (field[0] & ~other[1])))
        on_time += int(np.count_nonzero(other[1] | (field[1] & ~other[0])))
        table += [[np.count_nonzero(a & b) for b in other] for a in field]
    count = max(late + on_time, 1)
    share = late / count
    error = float(np.sqrt(max(share * (1.0 - share), 1.0 / count) / count))
    spread = float(np.std(ticks, ddof=1) / np.sqrt(ticks.size)) if ticks.size > 1 else float("nan")
    return LateRows(float(np.mean(ticks)), spread, share, error, _beyond_chance(table))


def _beyond_chance(table: FloatArray) -> float:
    """Return twice the log likelihood that a table of counts (2, 2) gains by a dependence, 0 where it is opposite."""
    total = float(table.sum())
    if total == 0.0 or table[0, 0] * table[1, 1] <= table[0, 1] * table[1, 0]:
        return 0.0
    expected = np.outer(table.sum(axis=1), table.sum(axis=0)) / total
    return float(2.0 * np.sum(xlogy(table, table / np.maximum(expected, 1e-300))))
