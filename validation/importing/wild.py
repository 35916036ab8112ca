"""Readings that no sensor gave: bytes of another record, or a damaged one, read as numbers, far beyond all others."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.validation.importing.raw_table import RawTable, RepairList
from discsim.validation.rows.readings import Readings

__all__ = ["wild_rows", "without_wild"]

#: Wild is this many times the larger of the two beside it, and of what nine in ten readings stay below. A knock of 200
#: g amid rests is 200 times; random bits read as a number are beyond 1e4, or below 1e-4, nine times in ten.
WILD = 1e4


def wild_rows(value: FloatArray) -> BoolArray:
    """Tell which rows of a sensor's readings (n, k) hold a wild number; a row with a gap tells nothing.

    >>> np.flatnonzero(wild_rows(np.array([*[[9.8]] * 20, [3e21], [9.8], [9.9], [-1.9e36], [9.8]]))).tolist()
    [20, 23]
    """
    wild = np.zeros(len(value), dtype=np.bool_)
    there = np.flatnonzero(np.isfinite(value).all(axis=1))
    if there.size < 3:
        return wild
    size = np.abs(value[there]).max(axis=1)
    padded = np.pad(size, 1)
    beside = np.maximum(padded[:-2], padded[2:])
    wild[there] = size > WILD * np.maximum(beside, np.quantile(size, 0.9))
    return wild


def without_wild(
    readings: Mapping[str, Readings], tables: Mapping[str, RawTable], repairs: RepairList
) -> tuple[dict[str, Readings], list[str]]:
    """Return readings with gaps for those that no sensor gave, and what to say."""
    notes, kept = [], dict(readings)
    for sensor, found in readings.items():
        rows = wild_rows(found.value)
        if not rows.any():
            continue
        for number in found.number[rows]:
            what = f"{sensor}: numbers far beyond all its others"
            repairs.add(None, tables[sensor].path, tables[sensor].line_of(number), what, f"{sensor} made a gap")
        notes.append(
            f"{sensor}: {np.count_nonzero(rows)} of {rows.size} rows hold numbers {WILD:g} times beyond all others, "
            f"the first row {found.number[rows][0]}: bytes of another record; they become gaps"
        )
        kept[sensor] = found._replace(value=np.where(rows[:, None], np.nan, found.value))
    return kept, notes
