"""Columns of time beside the file's one. Takes the sensors found; gives each one's own column, and what is unclear."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.sniffing.clock import Clock, clocks_of, seconds
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.groups import Numbers, Triple
from discsim.validation.importing.sniffing.names import sensor_of, timeless

__all__ = ["OwnClocks", "clocks_of_files", "own_clocks"]

#: Two columns of time are one clock's where they stay together, but for a constant, within a row of the coarser.
APART = 1.0
#: Share of its span that a sensor's own column has in common with the file's column, if both are on one clock.
COMMON = 0.5
#: What `Dialect` puts behind a name that stands twice.
_AGAIN = re.compile(r"\.\d+$")


class OwnClocks(NamedTuple):
    """By sensor the clock of its own column; decisions on them, and notes on columns that are not used."""

    clocks: Mapping[str, Clock]
    decisions: tuple[Decision, ...]
    notes: tuple[str, ...]

    def beside(self, other: OwnClocks) -> OwnClocks:
        """Return both."""
        return OwnClocks({**self.clocks, **other.clocks}, self.decisions + other.decisions, self.notes + other.notes)


def own_clocks(clock: Clock, found: Mapping[str, Triple]) -> OwnClocks:
    """Return the clocks of sensors that have a column of time stamps for themselves.

    A column is a sensor's own where its name names the sensor (``mag_time``, ``t_gyro``), or where columns of time of
    one name stand in front of each sensor's columns. It has to run in the file's unit and over the same span.
    """
    clocks: dict[str, Clock] = {}
    decisions, notes = [], []
    if clock.column is None:
        return OwnClocks({}, (), ())
    for numbers in {id(triple.numbers): triple.numbers for triple in found.values()}.values():
        columns = numbers.table.columns
        others = [one for one in clocks_of(numbers) if one.column not in (None, clock.column)]
        here = {sensor: triple for sensor, triple in found.items() if triple.numbers is numbers}
        if clock.column not in columns:
            continue
        used = set()
        for sensor, triple in here.items():
            mine, why = _mine(sensor, triple, clock, others)
            if mine is None or mine.column is None or _equal(clock, mine, numbers):
                continue
            problem = _unfit(clock, mine, numbers)
            if problem:
                notes.append(f"{sensor}: '{mine.column}' is not used for its time: {problem}")
            else:
                clocks[sensor] = mine
                decisions.append(Decision(f"{sensor} time", f"'{mine.column}'", "likely", why))
            used.add(mine.column)
        notes += _unused(clock, [one for one in others if one.column not in used], numbers)
    return OwnClocks(clocks, tuple(decisions), tuple(notes))


def clocks_of_files(clock: Clock, found: Mapping[str, Triple]) -> OwnClocks:
    """Return the clocks of sensors whose file calls its time otherwise than the others, in any unit.

    It has to run over the same span as the others' column; a sensor of which it does not is to be left out.
    """
    clocks: dict[str, Clock] = {}
    decisions, notes = [], []
    main = next((t.numbers for t in found.values() if clock.column in t.numbers.table.columns), None)
    for sensor, triple in found.items():
        numbers = triple.numbers
        if clock.column is None or clock.column in numbers.table.columns:
            continue
        mine = clocks_of(numbers)[0]
        plain = mine.decision.sure != "guess" and not mine.spacings and mine.scale == 1.0
        if main is None or mine.column is None or not plain:
            why = f"it has no column '{clock.column}', the others' time; name its own like that, in one unit"
        elif apart := _two_clocks(seconds(clock, main), seconds(mine, numbers)):
            why = f"its time '{mine.column}' {apart.format(clock.column)}"
        else:
            clocks[sensor] = mine
            why = f"that file has no '{clock.column}', and this runs over the same span"
            told = f"'{mine.column}' of {numbers.path.name} in {mine.unit}"
            decisions.append(Decision(f"{sensor} time", told, "likely", why))
            continue
        notes.append(f"WARNING: left out: {sensor} of {numbers.path.name}: {why}")
    return OwnClocks(clocks, tuple(decisions), tuple(notes))


def _mine(sensor: str, triple: Triple, clock: Clock, others: Iterable[Clock]) -> tuple[Clock | None, str]:
    """Return the column of time that is a sensor's, and why."""
    for one in others:
        assert one.column is not None
        if sensor_of(timeless(one.column)) == sensor:
            return one, "its name names the sensor"
    columns = triple.numbers.table.columns
    assert clock.column is not None
    stem = _AGAIN.sub("", clock.column)
    again = {columns.index(one.column): one for one in others if one.column and _AGAIN.sub("", one.column) == stem}
    places = sorted([*again, columns.index(clock.column)])
    before = [place for place in places if place < triple.columns[0]]
    if again and before and before[-1] in again:
        return again[before[-1]], f"of {len(places)} columns of that name it stands before the sensor's"
    return None, ""


def _equal(clock: Clock, mine: Clock, numbers: Numbers) -> bool:
    """Tell a column that says the same as the file's on every row."""
    return np.array_equal(seconds(clock, numbers), seconds(mine, numbers), equal_nan=True)


def _same(clock: Clock, other: Clock, numbers: Numbers) -> bool:
    """Tell two columns of one clock: they stay together within a row of the coarser one."""
    first, second = seconds(clock, numbers), seconds(other, numbers)
    both = np.isfinite(first) & np.isfinite(second)
    if both.sum() < 2:
        return False
    apart = (second - first)[both]
    return bool(np.ptp(apart) <= APART * max(_step(first), _step(second)) and np.array_equal(both, np.isfinite(first)))


def _step(time: FloatArray) -> float:
    steps = np.diff(time[np.isfinite(time)])
    return float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0


def _unfit(clock: Clock, mine: Clock, numbers: Numbers) -> str:
    """Return why a sensor's own column cannot stand beside the file's; empty where it can."""
    if mine.unit != clock.unit:
        return f"it is in {mine.unit} and '{clock.column}' in {clock.unit}; write both in one unit"
    apart = _two_clocks(seconds(clock, numbers), seconds(mine, numbers))
    return f"it {apart.format(clock.column)}" if apart else ""


def _two_clocks(first: FloatArray, second: FloatArray) -> str:
    """Return how a second column of time, s, runs apart from a first one whose name is to be put in; empty if not."""
    low, high = np.nanmax([np.nanmin(first), np.nanmin(second)]), np.nanmin([np.nanmax(first), np.nanmax(second)])
    if high - low >= COMMON * (np.nanmax(second) - np.nanmin(second)):
        return ""
    return (
        f"runs from {np.nanmin(second):.6g} to {np.nanmax(second):.6g} s and '{{}}' from {np.nanmin(first):.6g} to "
        f"{np.nanmax(first):.6g} s: two clocks"
    )


def _unused(clock: Clock, others: Iterable[Clock], numbers: Numbers) -> list[str]:
    """Say which other columns of time run otherwise than the one that is used."""
    return [
        f"another column of time, '{one.column}', is not used, and runs otherwise than '{clock.column}'; where it is a "
        f'sensor\'s own, write time = "{one.column}" under that sensor'
        for one in others
        if one.decision.sure != "guess" and not _same(clock, one, numbers)
    ]
