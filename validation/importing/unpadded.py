"""Seconds and a count of their parts, joined by a point without leading zeros: `12:00:01.5` for 1.005 s.

A logger's program that prints `seconds`, a point and `milliseconds` writes 1.5, 1.10, 1.95, 1.100: as decimals they go
back whenever the count gets another digit. Takes a column's cells and their times as decimals; gives the times meant.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.cell_texts import CellTexts

__all__ = ["Unpadded", "unpadded"]

#: Parts of a second that are counted (hundredths, ms, us); the fewest that hold the largest count are meant.
PARTS = (100, 1000, 1_000_000)
#: A log of a second and more comes to more than this share of them.
FILLED = 0.5
#: Times go back this often at least as decimals, and at most this share as often as counts: a clock that was set is not
#: set again each second.
FEWEST, LEFT = 2, 0.1
#: Digits behind the last point, with what may follow them in a date or a time of day.
_COUNT = re.compile(r"[.,](\d{1,6})(?=\s*(?:[AaPp]\.?[Mm]\.?)?\s*(?:Z|[+-]\d{2}:?\d{2})?$)")


class Unpadded(NamedTuple):
    """The times meant (n,), in the unit of those given; the first row that went back, and what to say of the column."""

    time: FloatArray
    row: int
    text: str


def unpadded(cells: CellTexts, time: FloatArray) -> Unpadded | None:
    """Return what cells (n,) mean whose times (n,) as decimals go back, NaN where they have none; None if that is it.

    Digits with a zero before them are decimals; so are those of times that go back as counts, too.
    """
    known = np.flatnonzero(np.isfinite(time))
    back = known[1:][np.diff(time[known]) < 0]
    if back.size < FEWEST:
        return None
    counts, decimals = np.zeros(known.size), np.zeros(known.size)
    for place, row in enumerate(known.tolist()):
        found = _COUNT.search(cells[row])
        if found is None:
            continue
        if len(found[1]) > 1 and found[1].startswith("0"):
            return None
        counts[place], decimals[place] = int(found[1]), float(f"0.{found[1]}")
    largest = float(np.max(counts))
    parts = next(parts for parts in PARTS if largest < parts)
    if largest < FILLED * parts:
        return None
    meant = np.full(time.size, np.nan)
    meant[known] = np.round(time[known] - decimals, 6) + counts / parts
    if np.count_nonzero(np.diff(meant[known]) < 0) > LEFT * back.size:
        return None
    row = int(back[0])
    count = int(counts[known == row][0])
    text = f"behind the point of '{cells[row][:40]}' stands a count of {count} of {parts}, without zeros before it"
    return Unpadded(meant, row, text)
