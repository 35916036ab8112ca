"""NMEA 0183 sentences of a satellite receiver as a table of positions and velocities.

Meanings, as u-blox's receiver description lists them (UBX-13003221, "NMEA Protocol"; the standard itself is for sale):
GGA has position, height above the sea and whether there is a fix; RMC position, speed in knots, course over ground and
the date; VTG course and speed without a time. None says how fast it climbs.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from datetime import date as Date
from datetime import time as TimeOfDay
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Any

import numpy as np

from discsim.validation.importing.logs.tables import Log, Rows, chosen, course_velocity
from discsim.validation.importing.stamps import DAY, EPOCH

__all__ = ["SENTENCES", "begins", "read", "read_sentences"]

SENTENCES = ("GGA", "RMC", "VTG")
KNOT = 1852.0 / 3600.0
#: A sentence: what the checksum is of, and the checksum, which one that breaks off has not. Those of VectorNav's units
#: (VN) are no receiver's.
_SENTENCE = re.compile(rb"\$((?!VN)(?:P[A-Z]{3}|[A-Z]{2}[A-Z0-9]{3}),[ -#%-)+-~]*)(?:\*([0-9A-Fa-f]{2}))?")
#: Other sentences of a receiver, and cells without which one holds no readings of two sensors.
_OF_RECEIVERS = ("GSA", "GSV", "GLL", "GNS", "GST", "GBS", "GRS", "ZDA", "DTM", "RMB", "TXT")
_MOTION_CELLS = 6
#: Lines of a file's beginning that are looked at.
_LINES = 50


def begins(head: bytes) -> bool:
    """Tell a text whose lines are sentences, by most of its first lines."""
    lines = [line for line in head.splitlines()[:_LINES] if line.strip()]
    return sum(_SENTENCE.match(line) is not None for line in lines) > len(lines) / 2


def read(raw: Path) -> Log:
    """Return the fixes of a text of sentences; those with a wrong checksum are left out and counted."""
    content = raw.read_bytes()
    log = read_sentences(content)
    other = sum(bool(line.strip()) and not _SENTENCE.search(line) for line in content.splitlines())
    notes = [f"{other} lines are no sentences and are left out"] if other else []
    notes += _unread(content)
    return log._replace(notes=(*log.notes, *notes), damaged=log.damaged or other > 0)


def _unread(content: bytes) -> list[str]:
    """Say which sentences of a maker's own may hold readings of motion: six cells and more, as often as the fixes."""
    cells = Counter(found[1].partition(b",")[0].decode() for found in _SENTENCE.finditer(content) if _wide(found[1]))
    fixes = max((count for name, count in cells.items() if name[2:] in SENTENCES), default=0)
    return [
        f"{name}: {count} sentences that are not read; a table of them: "
        f"sed -n 's/^[$]{name},//p' FILE | sed 's/[*].*//' > imu.csv"
        for name, count in cells.items()
        if name[2:] not in (*SENTENCES, *_OF_RECEIVERS) and count >= max(fixes, 1)
    ]


def _wide(sentence: bytes) -> bool:
    return sentence.count(b",") >= _MOTION_CELLS


def read_sentences(content: bytes) -> Log:
    """Return the fixes of the sentences in ``content``, among which other bytes may stand.

    Times are those since 2000 where an RMC with a fix tells the date, else of the first day.
    """
    epochs: dict[float, dict[str, Any]] = {}
    wrong = total = 0
    day = 0.0
    date: float | None = None  # midnight of the first day, s since 2000
    now: float | None = None
    for sentence in _parsed(content):
        total += 1
        wrong += sentence is None
        kind = "" if sentence is None else sentence.msgID
        if kind == "VTG" and now is not None:  # without a time: receivers send it behind a sentence that has one
            epochs[now].setdefault(kind, sentence)
        if kind not in ("GGA", "RMC") or not isinstance(sentence.time, TimeOfDay):
            continue
        time = _seconds(sentence.time)
        if now is not None and time + day < now - DAY / 2:  # past midnight
            day += DAY
        if (told := _midnight(sentence)) is not None:
            date = told - day if date is None else date
            day = max(day, told - date)  # a receiver that was off for days
        now = time + day
        epochs.setdefault(now, {})[kind] = sentence
    rows = Rows()
    for time, sentences in epochs.items():
        fix = _fix(sentences)
        if fix is not None:
            rows.add("NMEA", "gps", 1e6 * (time + (date or 0.0)), fix)
    tables, _ = chosen(rows.sources())
    notes = [f"{wrong} of {total} NMEA sentences have a wrong checksum or break off; they are left out"] * (wrong > 0)
    notes += ["gps: NMEA sentences hold no velocity downwards; it is a gap"] * bool(tables)
    notes += ["gps: no RMC sentence tells the date; times are of the day alone"] * (bool(tables) and date is None)
    return Log(tables, tuple(notes), wrong > 0, date is not None)


def _midnight(sentence: Any) -> float | None:
    """Return the beginning of the day that an RMC with a fix tells, s since 2000; None for any other sentence."""
    date = getattr(sentence, "date", None)
    if sentence.msgID != "RMC" or sentence.status != "A" or not isinstance(date, Date):
        return None
    return DAY * (date - EPOCH.date()).days


def _parsed(content: bytes) -> Iterator[Any]:
    """Yield the sentences; None for each that is damaged. Those that are not used are checked too."""
    from pynmeagps import NMEAReader
    from pynmeagps.exceptions import NMEAMessageError, NMEAParseError, NMEATypeError

    for found in _SENTENCE.finditer(content):
        if found[2] is None or reduce(xor, found[1]) != int(found[2], 16):
            yield None
        elif found[1][2:5].decode() in SENTENCES:
            try:
                yield NMEAReader.parse(found[0] + b"\r\n")
            except (NMEAMessageError, NMEAParseError, NMEATypeError, ValueError):
                yield None
        else:
            yield _Unused


class _Unused:
    msgID = ""


def _seconds(time: TimeOfDay) -> float:
    return 3600.0 * time.hour + 60.0 * time.minute + time.second + 1e-6 * time.microsecond


def _fix(sentences: dict[str, Any]) -> tuple[float, ...] | None:
    """Return what `positions` takes of the sentences of one time; None where the receiver says that it has no fix."""
    gga, rmc, vtg = (sentences.get(kind) for kind in SENTENCES)
    if (gga is not None and not gga.quality) or (rmc is not None and rmc.status != "A"):
        return None
    place = gga or rmc
    latitude, longitude, height = (_number(place, name) for name in ("lat", "lon", "alt"))
    speed = _number(rmc, "spd") if rmc is not None else _number(vtg, "sogn")
    course = _number(rmc, "cog") if rmc is not None else _number(vtg, "cogt")
    # without a course (it stands nearly still) the velocity's direction is open
    return (latitude, longitude, height, *course_velocity(speed * KNOT, course), np.nan)


def _number(sentence: Any, name: str) -> float:
    value = getattr(sentence, name, "")
    return float(value) if isinstance(value, int | float) else float("nan")
