"""Rows that come evenly behind stamps that do not: a host's times of arrival, a loop that stamps them late.

At 66 rad/s a stamp that is 0.4 ms off shifts the field by its noise, and one of a serial port that is 3 ms off by a
fifth of a radian. Takes the readings of sensors that stand on the rows of one table; gives them even times where their
field turns more evenly by these than by the stamps. Rows that came unevenly, by stamps that are true, keep them.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping

import numpy as np

from discsim.arrays import FloatArray, IntArray, sd_by_median
from discsim.validation.rows.held import find_held, fresh_rows
from discsim.validation.rows.own_times import LESS, STRETCH, left_by_turning
from discsim.validation.rows.readings import Readings

__all__ = ["at_even_times", "even_times", "left_beside_stamps"]

#: fewest rows of a line, as many as tell that a field turns evenly: three stretches
FEWEST = 3 * STRETCH
#: stamps nearer to even ones than this share of a step (rms) are left: their rounding to a fiftieth of it is, too
LEAST = 0.01
#: rows over which a usual step is taken, and over which a line must serve: a loop whose pace wanders leaves one
SPAN = 32
#: rows were lost where a step is longer than the usual one by so many of their scatter (one of 1e9 is, by chance), and
#: the rows behind it are late by a whole row at least; so many rows tell it
SURE, BEHIND = 6.0, 15
#: stamps are late alone, and never early, where they are skewed by so much: by 1 and 2 where delays are the sizes of
#: normal ones or those of a queue; of normal ones it is 0.1 over 600 rows
SKEWED = 0.5
#: a line serves where means over `SPAN` rows leave it by less than this share of what the rows do: of rows that are
#: late by themselves it is 0.18, where each delays the next four 0.4, of a loop whose pace wanders nearly all
COURSE = 0.5


def at_even_times(
    readings: Mapping[str, Readings], tables: Mapping[str, Hashable]
) -> tuple[dict[str, Readings], list[str]]:
    """Return readings whose rows came evenly, at even times, and what to say.

    ``tables`` tells which table's rows a sensor stands on. Of a table without a magnetometer nothing is told.
    """
    field = readings.get("magnetometer")
    if field is None:
        return dict(readings), []
    beside = {name: one for name, one in readings.items() if tables[name] == tables["magnetometer"]}
    number, first = np.unique(np.concatenate([one.number for one in beside.values()]), return_index=True)
    stamps = np.concatenate([one.time for one in beside.values()])[first]
    even = even_times(number, stamps)
    if even is None or not left_beside_stamps(field, even[np.searchsorted(number, field.number)]) < LESS:
        return dict(readings), []
    mended = {name: one._replace(time=even[np.searchsorted(number, one.number)]) for name, one in beside.items()}
    off = 1e3 * float(np.sqrt(np.mean((stamps - even) ** 2)))
    said = (
        f"{', '.join(beside)}: the stamps are {off:.2g} ms (rms) early or late of even rows, and the field turns "
        "more evenly by those: the rows are taken as even"
    )
    return {**readings, **mended}, [said]


def left_beside_stamps(field: Readings, even: FloatArray) -> float:
    """Return what steady turnings leave of fresh readings at times ``even`` (n,) s, over what they leave at the stamps.

    One where readings are too few to tell.
    """
    if np.any(np.isnan(field.value)):
        whole = np.all(np.isfinite(field.value), axis=1)
        field, even = field.select(whole), even[whole]
    held = find_held(field.value) if field.time.size else None
    if held is not None:
        fresh = fresh_rows(field.value, held)
        field, even = field.select(fresh), even[fresh]
    if field.time.size < FEWEST:
        return 1.0
    return left_by_turning(even, field) / max(left_by_turning(field.time, field), 1e-300)


def even_times(number: IntArray, stamps: FloatArray) -> FloatArray | None:
    """Return the even times (n,) s of rows called ``number`` (n,) by their stamps (n,) s, ascending.

    Rows that were lost keep their place. None where the stamps are even, or the rows of no line.
    """
    if stamps.size < FEWEST:
        return None
    place = (number - number[0]).astype(np.float64)
    step = float(np.median((stamps[SPAN:] - stamps[:-SPAN]) / (place[SPAN:] - place[:-SPAN])))
    if not step > 0.0:
        return None
    steps = np.diff(stamps) - step * np.diff(place)
    late = stamps - step * place
    lost = np.zeros(stamps.size)
    for row in (np.flatnonzero(steps > max(0.5 * step, SURE * float(sd_by_median(steps)))) + 1).tolist():
        first = max(row - BEHIND, 0)
        nearby = slice(first, row + BEHIND)
        before, after = np.split(late[nearby] - step * np.cumsum(lost[nearby]), [row - first])
        # a stamp that is late by itself moves neither the middle nor the earliest of so many
        behind = min(np.median(after) - np.median(before), np.min(after) - np.min(before))
        lost[row] = max(round(float(behind) / step), 0)
    place += np.cumsum(lost)
    slope, start = _line(place, stamps)
    even = start + slope * place
    off = stamps - even
    if np.sqrt(np.mean(off**2)) < LEAST * slope or not _serves(off, slope):
        return None
    return np.asarray(even)


def _line(place: FloatArray, stamps: FloatArray) -> tuple[float, float]:
    """Return slope and start of a line through stamps (n,): of those that are only late, through the earliest."""
    slope, start = np.polyfit(place, stamps, 1)
    for _ in range(5):
        off = stamps - start - slope * place
        scatter = max(float(sd_by_median(off - np.median(off))), 1e-12)
        slope, start = np.polyfit(place, stamps, 1, w=1.0 / np.hypot(1.0, off / (3.0 * scatter)))
    off = stamps - start - slope * place
    if off.size >= 3 * SPAN and np.mean((off - np.mean(off)) ** 3) > SKEWED * np.std(off) ** 3:
        count = off.size // SPAN
        earliest = SPAN * np.arange(count) + np.argmin(off[: count * SPAN].reshape(count, SPAN), axis=1)
        slope, start = np.polyfit(place[earliest], stamps[earliest], 1)
    return float(slope), float(start)


def _serves(off: FloatArray, step: float) -> bool:
    """Tell whether what a line leaves of stamps, off (n,) s, has no course: a loop that waits less or more has one."""
    count = off.size // SPAN
    means = np.mean(off[: count * SPAN].reshape(count, SPAN), axis=1)
    return bool(np.std(means) < max(LEAST * step, COURSE * float(np.std(off))))
