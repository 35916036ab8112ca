"""The clock of a raw file: what its stamps say in seconds, counters that wrapped round, and loggers that started again.

A counter of fixed width starts from its bottom when it is full, a clock time at midnight. Both are seen in the stamps
alone: one of the known widths, added at the step back, gives a step as long as the others. The widths are so much
longer than a step that a clock which was set back would land there in less than one case in a hundred. Where that is
not so (a millisecond of the second, in steps of ten) two steps back by the same width are asked for.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from discsim.arrays import FloatArray, IntArray

__all__ = ["DATED", "DAY", "EPOCH", "Break", "Clock", "is_stamp", "iso_seconds", "mended", "stamp_seconds"]

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
#: seconds from 1970 to 2000: stamps count from 2000, so that a double holds them to a tenth of a microsecond
EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
DAY = 86400.0
#: ... and stamps above a year are a date's: no log counts from its start for so long
DATED = 365 * DAY
#: A time of day: the fraction stands behind a point, a comma, or (as milliseconds) behind a third colon.
_TIME_OF_DAY = re.compile(
    r"T?(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d+)|:(\d{1,3}))?\s*([AaPp])?(?(6)\.?[Mm]\.?)\s*(?:Z|[+-]\d{2}:?\d{2})?"
)
#: Minutes and seconds, as spreadsheets shorten a time of day.
_MINUTES = re.compile(r"(\d{1,3}):(\d{2})[.,](\d+)")
#: Days and a time behind them, as pandas and Python write what went by: 0 days 00:00:05.25, 1 day, 0:00:05.
_DAYS = re.compile(r"(\d+) days?,?\s+(\d.*)")
#: A date with the month in letters and the time behind it, as MATLAB and loggers in C write it: 10-Jun-2024 06:13:20.
_MONTH_DATE = re.compile(r"(\d{1,2})[-./\s]([A-Za-z]{3})[a-z]*[-./\s](\d{4}|\d{2})[T,\s]\s*(\d.*)")
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
#: A date as spreadsheets and phones write it, and the time behind it: 01.06.2025, 6/1/2025 or 2025/6/1.
_DATE = re.compile(r"(?:(\d{4})[-./](\d{1,2})[-./](\d{1,2})|(\d{1,2})[-./](\d{1,2})[-./](\d{4}|\d{2}))[T,\s]\s*(\d.*)")


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


def iso_seconds(cell: str) -> float | None:
    """Return the seconds of a date and time since 2000 (UTC where no zone is given), or of a time of the day.

    Dates are ISO's or as spreadsheets write them. Of 01/06/2025 the day comes first, but for a time with AM or PM the
    month; a number above twelve is the day. That matters where a log runs past midnight alone. What went by has days
    before the time, as pandas writes it (``0 days 00:00:05.25``).

    >>> iso_seconds("2000-01-01T00:01:00.5Z"), iso_seconds("12:00:00.123"), iso_seconds("01/01/2000 12:01:00.5 AM")
    (60.5, 43200.123, 60.5)
    """
    text = cell.strip().strip('"')
    if _TIME_OF_DAY.fullmatch(text):
        return _time_of_day(text)
    if minutes := _MINUTES.fullmatch(text):
        return 60.0 * int(minutes[1]) + float(f"{minutes[2]}.{minutes[3]}") if int(minutes[2]) < 60 else None
    if days := _DAYS.fullmatch(text):
        time = _time_of_day(days[2])
        return None if time is None else DAY * int(days[1]) + time
    # the fraction is taken by itself: datetime drops what is below a microsecond
    head, dot, tail = text.replace(",", ".").partition(".")
    digits = re.match(r"\d+", tail)
    zone = tail[digits.end() :] if digits else tail
    try:
        moment = datetime.fromisoformat(head + zone.replace(" ", ""))
    except ValueError:
        return _dated(text)
    if "T" not in head and ":" not in head:
        return None  # a day without a time, or a number such as 20250601
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    whole = (moment - EPOCH).total_seconds()
    return whole + (float(f"0.{digits.group()}") if dot and digits else 0.0)


def stamp_seconds(cells: Iterable[str]) -> tuple[FloatArray, IntArray]:
    """Return the seconds (n,) of dates and times as `iso_seconds` does, NaN where one is neither.

    Of times of the day among dates the day is that of the dated cell before (the first: behind) that is nearest; the
    second array are their rows.

    >>> stamp_seconds(["2001-06-01 23:59:59", "00:00:01", "x"])[0] - 517 * 86400
    array([86399., 86401.,    nan])
    """
    found = [iso_seconds(cell) for cell in cells]
    time = np.array([np.nan if one is None else one for one in found], dtype=np.float64)
    dated = np.flatnonzero(np.abs(time) > DATED)
    bare = np.flatnonzero((time >= 0.0) & (time <= DAY))
    if not dated.size or not bare.size:
        return time, bare[:0]
    beside = time[dated[np.maximum(np.searchsorted(dated, bare) - 1, 0)]]
    time[bare] += DAY * np.round((beside - time[bare]) / DAY)
    return time, bare


def is_stamp(cell: str) -> bool:
    """Tell whether a cell is a date with a time, or a time of day."""
    return ":" in cell and iso_seconds(cell) is not None


def _time_of_day(text: str) -> float | None:
    match = _TIME_OF_DAY.fullmatch(text)
    if match is None:
        return None
    hours, minutes, seconds, fraction, thousandths, half = match.groups()
    hour = int(hours) if half is None else int(hours) % 12 + 12 * (half in "Pp")
    if hour > 24 or int(minutes) > 59 or int(seconds) > 60:
        return None
    fraction = fraction or (thousandths or "").zfill(3)
    return 3600.0 * hour + 60.0 * int(minutes) + float(f"{int(seconds)}.{fraction}")


def _dated(text: str) -> float | None:
    """Return the seconds since 2000 of a date that is not written as ISO does, with a time behind it."""
    if (named := _MONTH_DATE.fullmatch(text)) and named[2].lower() in _MONTHS:
        day, name, year, rest = named.groups()
        text = f"{year if len(year) > 2 else f'20{year}'}-{_MONTHS.index(name.lower()) + 1}-{day} {rest}"
    match = _DATE.fullmatch(text)
    time = None if match is None else _time_of_day(match[7])
    if match is None or time is None:
        return None
    if match[1]:
        year, month, day = (int(part) for part in match.groups()[:3])
    else:
        day, month, year = (int(part) for part in match.groups()[3:6])
        american = re.search(r"[AaPp]\.?[Mm]\.?$", text) is not None
        day, month = (month, day) if month > 12 or (american and day <= 12) else (day, month)
        year += 2000 * (year < 100)
    try:
        return (datetime(year, month, day, tzinfo=UTC) - EPOCH).total_seconds() + time
    except ValueError:
        return None


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
