"""The time of each row of a raw file: from its stamps or its count, with every repair of the clock listed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import BoolArray, FloatArray, IntArray
from discsim.validation.importing.clock import Break, mended
from discsim.validation.importing.import_map import ImportMap, TimeBase
from discsim.validation.importing.raw_table import RawTable, RepairList
from discsim.validation.importing.shared_stamps import evened
from discsim.validation.importing.stamps import stamp_seconds
from discsim.validation.importing.unpadded import unpadded

__all__ = ["RowClock", "added_up", "row_clock"]


#: no clock of a logger shows more, s from its zero: microseconds since 1970 that are taken for ms are 1.8e12
FURTHEST = 1e13


@dataclass(frozen=True)
class RowClock:
    """Time (n,) s of each row of a table, NaN where it has none, its stretch (n,), lines at which a new one begins."""

    time: FloatArray
    stretch: FloatArray
    starts: tuple[tuple[int, str], ...]

    @property
    def known(self) -> BoolArray:
        """Which rows (n,) have a time."""
        return np.isfinite(self.time)

    def longest(self, rows: BoolArray) -> int:
        """Return the stretch that holds most of these rows (n,)."""
        found, counts = np.unique(self.stretch[rows], return_counts=True)
        return int(found[np.argmax(counts)])


def row_clock(table: RawTable, import_map: ImportMap, base: TimeBase, repairs: RepairList) -> RowClock:
    """Return the time of each row by ``base``; raises `InputError` for damage that the map does not let repair."""
    decimal = import_map.layout.decimal
    counters = _counters(table, base.counter, decimal, repairs)
    time = _times(table, counters, base, decimal, repairs)
    known = np.flatnonzero(np.isfinite(time))
    clock = mended(time[known], base.scale if base.step is None else base.step)
    starts = []
    for found in clock.breaks:
        line = int(table.line[known[found.index]])
        repairs.add("time", table.path, line, found.what, _action(found))
        if not found.shift:
            starts.append((line, found.what))
    stretch = np.zeros(len(table))
    time[known], stretch[known] = evened(clock.time) if base.shared else clock.time, clock.stretch
    return RowClock(time, stretch, tuple(starts))


def added_up(spacing: FloatArray, number: IntArray) -> FloatArray:
    """Return the time (n,) of rows by what went by since the row before each (n,), in its unit; ``number`` counts them.

    A row that was left out took the usual (median) spacing. A row without a spacing has no time, and took the usual.

    >>> added_up(np.array([9.0, 5.0, np.nan, 5.0]), np.array([0, 1, 2, 4])).tolist()
    [0.0, 5.0, nan, 20.0]
    """
    usual = float(np.nanmedian(spacing))
    whole = np.where(np.isfinite(spacing), spacing, usual) + usual * (np.diff(number, prepend=number[0] - 1) - 1)
    time = np.cumsum(whole) - whole[0]
    return np.where(np.isfinite(spacing), time, np.nan)


def _action(found: Break) -> str:
    return f"time goes on: {found.shift:.9g} s added from here" if found.shift else "a new stretch begins here"


def _counters(table: RawTable, name: str | None, decimal: str, repairs: RepairList) -> FloatArray:
    """Return the counter (n,) of each row, NaN where it has none, with its jumps listed; row numbers without a name."""
    if name is None:
        return table.number.astype(np.float64)
    column = table.column(name)
    counters, _ = column.numbers(decimal)
    sound = np.flatnonzero(~np.isnan(counters))
    jumps = np.flatnonzero(counters[sound][1:] > counters[sound][:-1] + 1) + 1
    before = dict(zip(sound[jumps].tolist(), counters[sound[jumps - 1]].tolist(), strict=True))
    for row in sorted([*np.flatnonzero(np.isnan(counters)).tolist(), *before]):
        line, count = int(table.line[row]), float(counters[row])
        if row in before:
            lost = f"{count - before[row] - 1:.0f} missing; time keeps their place"
            repairs.add("counter", table.path, line, f"'{name}' jumps from {before[row]:.0f} to {count:.0f}", lost)
        else:
            repairs.add("number", table.path, line, f"'{name}' is '{column[row][:40]}'", "row left out")
    return counters


def _times(table: RawTable, counters: FloatArray, base: TimeBase, decimal: str, repairs: RepairList) -> FloatArray:
    """Return the time (n,) s of each row before any break of the clock is mended, NaN where it has none."""
    if base.column is None:
        assert base.step is not None
        return np.asarray(counters * base.step)
    column = table.column(base.column)
    if base.iso:
        time, bare = stamp_seconds(column)
        if bare.size:
            what = f"'{base.column}' is a time of the day among dates, in {bare.size} rows"
            repairs.add(
                "time", table.path, int(table.line[bare[0]]), what, "they take the date of the rows beside them"
            )
    else:
        time, _ = column.numbers(decimal)
        time = added_up(time, table.number) if base.spacings else time
    if (joined := unpadded(column, time)) is not None:
        action = "read so from the first row on"
        repairs.add("time", table.path, int(table.line[joined.row]), f"'{base.column}': {joined.text}", action)
        time = joined.time
    counted = ~np.isnan(counters)
    with np.errstate(invalid="ignore"):
        sound = np.abs(time * base.scale) <= FURTHEST
    expected = ", expected an ISO time" if base.iso else ""
    for row in np.flatnonzero(counted & ~sound).tolist():
        what = expected if np.isnan(time[row]) else ", no time"
        said = f"'{base.column}' is '{column[row][:40]}'{what}"
        repairs.add("number", table.path, int(table.line[row]), said, "row left out")
    return np.where(counted & sound, time * base.scale, np.nan)
