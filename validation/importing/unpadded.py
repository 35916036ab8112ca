"""Seconds and a count of their parts, joined by a point without leading zeros: `12:00:01.5` for 1.005 s.

A logger's program that prints `seconds`, a point and `milliseconds` writes 1.5, 1.10, 1.95, 1.100: as decimals they go
back whenever the count gets another digit. One that cuts such a count to its first digits (`1.9537` for 1.09537 s) goes
back after the first tenth of each second. Takes a column's cells and their times as decimals; gives the times meant.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray, IntArray
from discsim.validation.importing.cell_texts import CellTexts

__all__ = ["Unpadded", "unpadded"]

#: Parts of a second that are counted (hundredths, ms, us); the fewest that hold the largest count are meant.
PARTS = (100, 1000, 1_000_000)
#: A log of a second and more comes to more than this share of them.
FILLED = 0.5
#: Times go back this often at least as decimals, and at most this share as often as counts: a clock that was set is not
#: set again each second.
FEWEST, LEFT = 2, 0.1
#: A count of microseconds that was cut is told by its first digits, as many as these.
CUT = (2, 5)
#: Its first digit's place is known by when the row is due, to this share of the time between two rows.
DUE = 0.5
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
    row = int(back[0])
    seconds = np.round(time[known] - decimals, 6)
    largest = float(np.max(counts))
    parts = next(parts for parts in PARTS if largest < parts)
    of_parts, count = seconds + counts / parts, int(counts[known == row][0])
    if largest >= FILLED * parts and _ascends(of_parts, back.size):
        stands = f"a count of {count} of {parts}"
    else:
        of_parts = _of_cut_counts(seconds, counts.astype(int), time[known])
        if not _ascends(of_parts, back.size):
            return None
        digits = len(str(int(largest)))
        stands = f"the beginning ({digits} digits) of a count of {PARTS[-1]}"
    meant = np.full(time.size, np.nan)
    meant[known] = of_parts
    return Unpadded(meant, row, f"behind the point of '{cells[row][:40]}' stands {stands}, without zeros before it")


def _ascends(meant: FloatArray, back: int) -> bool:
    """Tell whether times (n,) go back at most a share as often as they did before, which is ``back`` times."""
    return bool(np.all(np.isfinite(meant)) and np.count_nonzero(np.diff(meant) < 0) <= LEFT * back)


def _of_cut_counts(seconds: FloatArray, counts: IntArray, decimals: FloatArray) -> FloatArray:
    """Return times (n,), s, of whole ``seconds`` and of microseconds ``counts`` (n,) that were cut to so many digits.

    One with fewer digits than others is a whole count. NaN where a row is due at none of the times that its digits
    may mean, or where there is no such count. ``decimals`` are the times as written.
    """
    texts = [str(count) for count in counts.tolist()]
    digits = max(map(len, texts))
    step = float(np.median(np.diff(decimals)))
    if not CUT[0] <= digits <= CUT[1] or step <= 0.0:
        return np.full(seconds.shape, np.nan)
    found = np.empty(seconds.shape)
    before = decimals[0] - step
    for place, text in enumerate(texts):
        whole = 6 if len(text) == digits else len(text)
        may_be = [
            seconds[place] + int(text) * 10.0 ** (length - len(text) - 6) for length in range(len(text), whole + 1)
        ]
        later = [time for time in may_be if time > before] or may_be
        time = min(later, key=lambda time: abs(time - before - step))
        as_written = time == may_be[-1] and whole == 6
        if not as_written and abs(time - before - step) > DUE * step + 10.0 ** (digits - 6):
            return np.full(seconds.shape, np.nan)
        found[place] = before = time
    return found
