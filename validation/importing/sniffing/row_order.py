"""Rows that stand in another order than their times: an export with the newest first, or what several threads wrote.

Takes a table in which no column ascends as a clock does, or with rows beside their place as a sort by letters leaves
them; gives the column of time in whose order its rows belong.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.sniffing.clock import Clock, seconds
from discsim.validation.importing.sniffing.groups import Numbers
from discsim.validation.importing.sniffing.names import is_time_name
from discsim.validation.importing.stamps import is_stamp, stamp_seconds

__all__ = ["RowOrder", "order_of"]

#: Share of steps back by which a log runs backwards, but for where its clock was set.
BACK = 0.99
#: Share of steps within half of the usual one, once rows are in order, by which these are one log's. Stamps of a
#: counter that begins anew lie between one another then: the steps of such are as those of chance, and 35 % within.
EVEN = 0.9
#: Two stretches of one log that lie in one another have steps of half the length, or less.
SHORTER = 0.75
#: Rows of which an order is asked, at least.
FEWEST = 20


class RowOrder(NamedTuple):
    """The column of time that rows are put in the order of, and what to say."""

    column: str
    remark: str


def order_of(numbers: Numbers, clock: Clock) -> RowOrder | None:
    """Return the column of time in whose order a table's rows belong; None where none tells one.

    Where the table has a ``clock``, its rows belong in another order only if they fill the gaps that they left.
    """
    if clock.column is not None:
        time = seconds(clock, numbers)
        told = _told(time[np.isfinite(time)], fills=True)
        return None if told is None else _by(clock.column, told)
    for k, name in enumerate(numbers.table.columns):
        if not is_time_name(numbers.names[k]):
            continue
        value = numbers.values[:, k]
        if not np.isfinite(value).any() and any(map(is_stamp, numbers.cells(k))):
            value, _ = stamp_seconds(numbers.cells(k))
        if (told := _told(value[np.isfinite(value)], fills=False)) is not None:
            return _by(name, told)
    return None


def _by(column: str, told: str) -> RowOrder:
    return RowOrder(column, f"rows {told}: they are put in the order of '{column}'")


def _told(value: FloatArray, *, fills: bool) -> str | None:
    """Return how times (n,) stand that belong in another order; None where their order is another matter.

    ``fills``: once in order fewer steps are uneven than went back, and they are as long as they were. A wild stamp
    leaves a gap and parts a step in two; a clock that began anew parts them all.
    """
    steps = np.diff(value)
    if value.size < FEWEST or not np.any(steps < 0.0):
        return None
    if np.mean(steps <= 0.0) > BACK:
        return "run BACKWARDS, the newest first"
    ordered = np.diff(np.sort(value))
    usual = float(np.median(ordered))
    if usual <= 0.0:
        return None
    uneven = np.count_nonzero(np.abs(ordered - usual) >= 0.5 * usual)
    if uneven > (1.0 - EVEN) * ordered.size or (fills and uneven >= np.count_nonzero(steps < 0.0)):
        return None
    if fills and usual < SHORTER * float(np.median(steps[steps > 0.0])):
        return None
    return f"stand out of order ({100.0 * np.mean(steps < 0.0):.2g} % of them are earlier than the one above)"
