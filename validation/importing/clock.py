"""The clock of a raw file: what its stamps say in seconds, counters that wrapped round, and loggers that started again.

A counter of fixed width starts from its bottom when it is full, a clock time at midnight. Both are seen in the stamps
alone: one of the known widths, added at the step back, gives a step as long as the others. The widths are so much
longer than a step that a clock which was set back would land there in less than one case in a hundred. Where that is
not so (a millisecond of the second, in steps of ten) two steps back by the same width are asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discsim.arrays import FloatArray

__all__ = ["Break", "Clock", "mended"]

#: widths of counters, in counts, and what they are called
WIDTHS = {
    2.0**15: "15 bits",
    2.0**16: "16 bits",
    2.0**24: "24 bits",
    2.0**31: "31 bits",
    2.0**32: "32 bits",
    1e3: "1000",
    1e4: "10 000",
    1e5: "100 000",
    1e6: "1 000 000",
}
#: periods of clock times, s
PERIODS = {86400.0: "24 h", 43200.0: "12 h", 3600.0: "one hour", 60.0: "one minute"}
#: counts a second of a counter that was written in seconds
COUNTS = (1.0, 1e3, 1e6)
#: a step across a wrap is at most this many ordinary steps (rows may be lost there)
LONGEST = 20.0
#: one step back tells a wrap where the width is at least this many times what is left of the step
TELLING = 100.0
#: a step ahead of this many seconds is a clock that was set (from its start to the date), and no row was lost there
SET = 3600.0
#: rows on both sides of a step back that must all lie apart for it to be a new start, and not a stamp that went wrong
APART = 5


@dataclass(frozen=True)
class Break:
    """A step back in time that was mended (``shift`` s added from there on) or begins a new stretch (``shift`` 0).

    ``index`` is the first row after it, among those given.
    """

    index: int
    shift: float
    what: str


@dataclass(frozen=True)
class Clock:
    """Times (n,) s with wraps taken out, the stretch that each row (n,) is of, and where the clock was broken."""

    time: FloatArray
    stretch: FloatArray
    breaks: tuple[Break, ...]


def mended(time: FloatArray, scale: float) -> Clock:
    """Return times (n,) s, written in units of ``scale`` s, with wraps taken out and new starts told apart.

    A single stamp that went wrong is left as it is; so is a small step back of a clock that was set (less than
    `LONGEST` ordinary steps): both are rows out of order, and none of a clock's.
    """
    t = np.array(time, dtype=np.float64)
    stretch = np.zeros(t.size)
    if t.size < 3:
        return Clock(t, stretch, ())
    steps = np.diff(t)
    usual = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    if usual == 0:
        return Clock(t, stretch, ())
    least = max(SET, 50 * LONGEST * usual)
    ahead = [int(k) for k in np.flatnonzero(steps > least) + 1 if _apart(-t, int(k), least)]
    back = [int(k) for k in np.flatnonzero(steps < -LONGEST * usual) + 1 if _apart(t, int(k))]
    widths = {k: _width(t[k - 1] - t[k], usual, scale) for k in back}
    breaks = []
    for k in sorted(ahead + back):
        course = f"time runs from {t[k - 1]:.9g} to {t[k]:.9g} s"
        width = widths.get(k)
        if k in ahead:
            breaks.append(Break(k, 0.0, f"{course}: the clock was set"))
        elif width is None or not _tells(width[0], t[k - 1] - t[k], usual, list(widths.values())):
            breaks.append(Break(k, 0.0, f"{course}: the logger started again"))
        else:
            breaks.append(Break(k, width[0], f"{course}: {width[1]}"))
    whole = t.copy()
    for item in breaks:
        if item.shift:
            whole[item.index :] += item.shift
        else:  # a new stretch has no wraps of the ones before it
            whole[item.index :] = t[item.index :]
            stretch[item.index :] += 1
    return Clock(whole, stretch, tuple(breaks))


def _tells(width: float, fall: float, usual: float, widths: Sequence[tuple[float, str] | None]) -> bool:
    """Tell whether a width is long enough to be no coincidence, or comes twice."""
    twice = sum(other is not None and other[0] == width for other in widths) > 1
    return twice or width > TELLING * max(width - fall, usual)


def _apart(t: FloatArray, k: int, least: float = 0.0) -> bool:
    """Tell whether the rows before and after a step back lie apart: all later ones are earlier, by ``least`` s."""
    before, after = t[max(0, k - APART) : k], t[k : k + APART]
    return min(before.size, after.size) >= 2 and bool(np.max(after) < np.min(before) - least)


def _width(fall: float, usual: float, scale: float) -> tuple[float, str] | None:
    """Return the width (s) that makes a fall of time one ordinary step, and what to call it."""
    known = {
        width / counts: f"a counter of {name} wrapped round" for width, name in WIDTHS.items() for counts in COUNTS
    }
    # a counter in the file's own unit comes first
    known = {width * scale: f"a counter of {name} wrapped round" for width, name in WIDTHS.items()} | known
    known |= {period: f"a clock of {name} began anew" for period, name in PERIODS.items()}
    fitting = [(width, name) for width, name in known.items() if 0 < width - fall <= LONGEST * usual]
    return min(fitting, key=lambda pair: pair[0] - fall, default=None)
