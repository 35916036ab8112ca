"""Dates and times as loggers, phones, spreadsheets and shells write them. Takes cells; gives seconds."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime

import numpy as np

from discsim.arrays import FloatArray, IntArray

__all__ = ["DATED", "DAY", "EPOCH", "is_stamp", "iso_seconds", "stamp_seconds"]

#: seconds from 1970 to 2000: stamps count from 2000, so that a double holds them to a tenth of a microsecond
EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
DAY = 86400.0
#: ... and stamps above a year are a date's: no log counts from its start for so long
DATED = 365 * DAY
#: A time of day: the fraction stands behind a point, a comma, or (as milliseconds) behind a third colon; a zone may
#: follow, in letters as `date` prints it.
_TIME_OF_DAY = re.compile(
    r"T?(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d+)|:(\d{1,3}))?\s*([AaPp])?(?(6)\.?[Mm]\.?)"
    r"\s*(?:Z|[+-]\d{2}:?\d{2}|[A-Z]{3,4})?"
)
#: Digits behind a third colon; a video's count of frames there ends below the frames of a second, 60 at most.
_THIRD = re.compile(r"\d:\d{2}:\d{2}:(\d{1,3})(?!\d)")
_NO_FRAMES = "60"
#: Minutes and seconds, as spreadsheets shorten a time of day.
_MINUTES = re.compile(r"(\d{1,3}):(\d{2})[.,](\d+)")
#: Days and a time behind them, as pandas and Python write what went by: 0 days 00:00:05.25, 1 day, 0:00:05.
_DAYS = re.compile(r"(\d+) days?,?\s+(\d.*)")
#: The name of a day before a date.
_WEEKDAY = re.compile(r"(?:mon|tue|wed|thu|fri|sat|sun)[a-z]*\.?,?\s+", re.IGNORECASE)
#: A date with the month in letters and the time behind it, as MATLAB and loggers in C write it: 10-Jun-2024 06:13:20.
_MONTH_DATE = re.compile(r"(\d{1,2})[-./\s]([A-Za-z]{3})[a-z]*\.?[-./\s](\d{4}|\d{2})(?:[T,\s]|\s+@)\s*(\d.*)")
#: The month first, as C's asctime (`Wed Dec 22 21:09:46 2021`), `ts` (without a year) and log viewers write it
#: (`Dec 22, 2021 @ 21:09:46.210`).
_MONTH_FIRST = re.compile(
    r"([A-Za-z]{3})[a-z]*\.?\s+(\d{1,2}),?\s+(?:(\d{4})(?:,|\s+@)?\s+)?(\d.*?)(?:\s+(?:[A-Z]{3,4}\s+)?(\d{4}))?"
)
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
#: The year of a date that tells none.
_NO_YEAR = "2000"
#: A date as spreadsheets and phones write it, and the time behind it: 01.06.2025, 6/1/2025 or 2025/6/1.
_DATE = re.compile(r"(?:(\d{4})[-./](\d{1,2})[-./](\d{1,2})|(\d{1,2})[-./](\d{1,2})[-./](\d{4}|\d{2}))[T,\s]\s*(\d.*)")
#: A time of day before its date: 11:47:22 07/04/2014.
_TIME_FIRST = re.compile(
    r"(\d{1,2}:\d{2}:\d{2}[.,:\d]*?(?:\s*[AaPp]\.?[Mm]\.?)?)(?:,\s*|\s+)(\d{1,4}[-./]\d{1,2}[-./]\d{1,4})"
)
#: A date and time of digits alone, or parted by dashes as the names of files are: 20211222_210946_210.
_DIGITS = re.compile(
    r"((?:19|20)\d{2})[-_]?(0[1-9]|1[0-2])[-_]?(0[1-9]|[12]\d|3[01])[-_T\s]?"
    r"([01]\d|2[0-3])[-_]?([0-5]\d)[-_]?([0-5]\d)(?:[-_.,]?(\d{1,9}))?Z?"
)
#: The same without leading zeros, milliseconds behind the last dash: 2024-3-23--13-41-39-25.
_DASHES = re.compile(
    r"((?:19|20)\d{2})-(\d{1,2})-(\d{1,2})[-_T\s]{1,3}(\d{1,2})-(\d{1,2})-(\d{1,2})(?:-(\d{1,3})|[.,](\d{1,9}))?Z?"
)


def iso_seconds(cell: str) -> float | None:
    """Return the seconds of a date and time since 2000 (UTC where no zone is given), or of a time of the day.

    Dates are ISO's or as spreadsheets write them. Of 01/06/2025 the day comes first, but for a time with AM or PM the
    month; a number above twelve is the day. That matters where a log runs past midnight alone. What went by has days
    before the time, as pandas writes it (``0 days 00:00:05.25``). A date without a year is one of 2000.

    >>> iso_seconds("2000-01-01T00:01:00.5Z"), iso_seconds("12:00:00.123"), iso_seconds("01/01/2000 12:01:00.5 AM")
    (60.5, 43200.123, 60.5)
    >>> iso_seconds("Sat Jan  1 00:01:00 2000"), iso_seconds("Jan 1, 2000 @ 00:01:00"), iso_seconds("20000101000100500")
    (60.0, 60.0, 60.5)
    >>> iso_seconds("2000-1-1--0-1-0-25"), iso_seconds("00:01:00.5 01/01/2000"), iso_seconds("0:01:00 AM, 2000-01-01")
    (60.025, 60.5, 60.0)
    """
    text = cell.strip().strip('"')
    if _TIME_OF_DAY.fullmatch(text):
        return _time_of_day(text)
    if first := _TIME_FIRST.fullmatch(text):
        text = f"{first[2]} {first[1]}"
    if minutes := _MINUTES.fullmatch(text):
        return 60.0 * int(minutes[1]) + float(f"{minutes[2]}.{minutes[3]}") if int(minutes[2]) < 60 else None
    if days := _DAYS.fullmatch(text):
        time = _time_of_day(days[2])
        return None if time is None else DAY * int(days[1]) + time
    if digits := _DIGITS.fullmatch(text):
        year, month, day, *clock, fraction = digits.groups()
        return _since_2000(year, month, day, _time_of_day(f"{':'.join(clock)}.{fraction or 0}"))
    if dashes := _DASHES.fullmatch(text):
        year, month, day, *clock, thousandths, fraction = dashes.groups()
        padded = ":".join(part.zfill(2) for part in clock)
        return _since_2000(year, month, day, _time_of_day(f"{padded}.{fraction or (thousandths or '').zfill(3)}"))
    # the fraction is taken by itself: datetime drops what is below a microsecond
    head, dot, tail = text.replace(",", ".").partition(".")
    behind = re.match(r"\d+", tail)
    zone = tail[behind.end() :] if behind else tail
    try:
        moment = datetime.fromisoformat(head + zone.replace(" ", ""))
    except ValueError:
        return _dated(_WEEKDAY.sub("", text, count=1))
    if "T" not in head and ":" not in head:
        return None  # a day without a time, or a number such as 20250601
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    whole = (moment - EPOCH).total_seconds()
    return whole + (float(f"0.{behind.group()}") if dot and behind else 0.0)


def stamp_seconds(cells: Iterable[str]) -> tuple[FloatArray, IntArray]:
    """Return the seconds (n,) of dates and times as `iso_seconds` does, NaN where one is neither.

    Of times of the day among dates the day is that of the dated cell before (the first: behind) that is nearest; the
    second array are their rows. Behind a third colon stand hundredths, as Kinovea writes them, where all cells have two
    digits there, `01` as well as 60 and more: milliseconds have one to three.

    >>> stamp_seconds(["2001-06-01 23:59:59", "00:00:01", "x"])[0] - 517 * 86400
    array([86399., 86401.,    nan])
    >>> stamp_seconds(["0:00:01:04", "0:00:01:96"])[0], stamp_seconds(["0:00:01:4", "0:00:01:96"])[0]
    (array([1.04, 1.96]), array([1.004, 1.096]))
    """
    texts = list(cells)
    found = [iso_seconds(cell) for cell in texts]
    time = np.array([np.nan if one is None else one for one in found], dtype=np.float64) + _as_hundredths(texts)
    dated = np.flatnonzero(np.abs(time) > DATED)
    bare = np.flatnonzero((time >= 0.0) & (time <= DAY))
    if not dated.size or not bare.size:
        return time, bare[:0]
    beside = time[dated[np.maximum(np.searchsorted(dated, bare) - 1, 0)]]
    time[bare] += DAY * np.round((beside - time[bare]) / DAY)
    return time, bare


def _as_hundredths(texts: Sequence[str]) -> FloatArray:
    """Return what cells (n,) have more, s, where they hold hundredths and were read as milliseconds."""
    none = np.zeros(len(texts))
    if not texts or _THIRD.search(texts[0]) is None:
        return none
    behind = ["" if (match := _THIRD.search(text)) is None else match[1] for text in texts]
    two = all(len(digits) in (0, 2) for digits in behind)
    if not two or max(behind) < _NO_FRAMES or not any(digits.startswith("0") for digits in behind):
        return none
    return np.array([0.009 * int(digits or 0) for digits in behind])


def is_stamp(cell: str) -> bool:
    """Tell whether a cell is a date with a time, or a time of day."""
    text = cell.strip().strip('"')
    told = ":" in cell or _DASHES.fullmatch(text) is not None
    return (told and iso_seconds(cell) is not None) or _DIGITS.fullmatch(text) is not None


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
    if named := _MONTH_DATE.fullmatch(text):
        day, name, year, rest = named.groups()
        return _since_2000(year, _month(name), day, _time_of_day(rest))
    if named := _MONTH_FIRST.fullmatch(text):
        name, day, before, rest, behind = named.groups()
        return _since_2000(before or behind or _NO_YEAR, _month(name), day, _time_of_day(rest))
    match = _DATE.fullmatch(text)
    if match is None:
        return None
    time = _time_of_day(match[7])
    if match[1]:
        year, month, day = match.groups()[:3]
    else:
        day, month, year = match.groups()[3:6]
        american = re.search(r"[AaPp]\.?[Mm]\.?$", text) is not None
        day, month = (month, day) if int(month) > 12 or (american and int(day) <= 12) else (day, month)
    return _since_2000(year, month, day, time)


def _month(name: str) -> int:
    """Return the number of a month by three letters; zero where they are none's."""
    return _MONTHS.index(name.lower()) + 1 if name.lower() in _MONTHS else 0


def _since_2000(year: str, month: str | int, day: str, time: float | None) -> float | None:
    """Return the seconds since 2000 of a date in numbers and a time of that day, s; None where there is no such day."""
    whole = int(year) + 2000 * (int(year) < 100)
    try:
        start = (datetime(whole, int(month), int(day), tzinfo=UTC) - EPOCH).total_seconds()
    except ValueError:
        return None
    return None if time is None else start + time
