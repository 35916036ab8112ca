"""The time of each row of a raw file: from its stamps or its count, with every repair of the clock listed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.validation.importing.clock import Break, iso_seconds, mended
from discsim.validation.importing.import_map import ImportMap, TimeBase
from discsim.validation.importing.raw_table import RawRow, RawTable, RepairList, number

__all__ = ["RowClock", "row_clock"]


#: no clock of a logger shows more, s from its zero: microseconds since 1970 that are taken for ms are 1.8e12
FURTHEST = 1e13


@dataclass(frozen=True)
class RowClock:
    """Time (s) and stretch of each row that has a time, by the row's number; lines at which a new stretch begins."""

    time: dict[int, float]
    stretch: dict[int, int]
    starts: tuple[tuple[int, str], ...]

    def longest(self, numbers: list[int]) -> int:
        """Return the stretch that holds most of these rows."""
        found, counts = np.unique([self.stretch[number] for number in numbers], return_counts=True)
        return int(found[np.argmax(counts)])


def row_clock(table: RawTable, import_map: ImportMap, base: TimeBase, repairs: RepairList) -> RowClock:
    """Return the time of each row by ``base``; raises `InputError` for damage that the map does not let repair."""
    decimal = import_map.layout.decimal
    counters = _counters(table, base.counter, decimal, repairs)
    rows: list[RawRow] = []
    times: list[float] = []
    for row in table.rows:
        time = _time(table, row, counters, base, decimal, repairs)
        if time is not None:
            rows.append(row)
            times.append(time)
    clock = mended(times, base.scale if base.step is None else base.step)
    starts = []
    for found in clock.breaks:
        row = rows[found.index]
        repairs.add("time", table.path, row.line, found.what, _action(found))
        if not found.shift:
            starts.append((row.line, found.what))
    numbers = [row.number for row in rows]
    return RowClock(
        dict(zip(numbers, clock.time.tolist(), strict=True)),
        dict(zip(numbers, clock.stretch.astype(int).tolist(), strict=True)),
        tuple(starts),
    )


def _action(found: Break) -> str:
    return f"time goes on: {found.shift:.9g} s added from here" if found.shift else "a new stretch begins here"


def _counters(table: RawTable, name: str | None, decimal: str, repairs: RepairList) -> dict[int, float]:
    """Return the counter of each row (by row number), with its jumps listed."""
    if name is None:
        return {}
    index = table.columns.index(name)
    counters: dict[int, float] = {}
    previous = None
    for row in table.rows:
        count = number(row.cells[index], decimal)
        if count is None or np.isnan(count):
            repairs.add("number", table.path, row.line, f"'{name}' is '{row.cells[index][:40]}'", "row left out")
            continue
        if previous is not None and count > previous + 1:
            lost = f"{count - previous - 1:.0f} missing; time keeps their place"
            repairs.add("counter", table.path, row.line, f"'{name}' jumps from {previous:.0f} to {count:.0f}", lost)
        counters[row.number] = previous = count
    return counters


def _time(
    table: RawTable, row: RawRow, counters: dict[int, float], base: TimeBase, decimal: str, repairs: RepairList
) -> float | None:
    if base.counter is not None and row.number not in counters:
        return None
    if base.column is None:
        assert base.step is not None
        return (counters[row.number] if base.counter is not None else row.number) * base.step
    cell = row.cells[table.columns.index(base.column)]
    time = iso_seconds(cell) if base.iso else number(cell, decimal)
    if time is None or np.isnan(time):
        expected = ", expected an ISO time" if base.iso else ""
        repairs.add("number", table.path, row.line, f"'{base.column}' is '{cell[:40]}'{expected}", "row left out")
        return None
    if not abs(time * base.scale) <= FURTHEST:
        repairs.add("number", table.path, row.line, f"'{base.column}' is '{cell[:40]}', no time", "row left out")
        return None
    return time * base.scale
