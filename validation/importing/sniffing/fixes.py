"""A receiver's fixes, beside the disc's own log or in it. Takes the tables; gives the lines of a map that read them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.recording import SENSORS
from discsim.validation.importing.apart import apart, zones
from discsim.validation.importing.import_map import SPEEDS, UNITS
from discsim.validation.importing.raw_table import Layout
from discsim.validation.importing.sniffing.clock import Clock, clocks_of, seconds
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.groups import Numbers
from discsim.validation.importing.sniffing.names import last_word, read_name, sensor_of, words_of
from discsim.validation.importing.sniffing.units import readings_of, split_unit
from discsim.validation.importing.stamps import DATED, DAY, EPOCH
from discsim.validation.rows.readings import Readings

__all__ = ["ProposedFixes", "fixes_of"]

_HEIGHT = {"alt", "altitude", "ele", "elevation", "height", "hmsl", "msl", "hgt", "heightmsl", "altitudemsl"}
#: Words for a speed and for a heading.
_MOTION = {"speed", "spd", "sog", "gspeed", "groundspeed", "velocity", "vel"} | {
    *("heading", "hdg", "course", "cog", "bearing")
}
#: Names of a velocity's parts, without blanks and unit: vn, vel_n, velN, velocity north, north velocity, velD, velU.
_PART = re.compile(
    r"(?:gps|gnss)?(?:v|vel|velocity)(n|e|d|u|north|east|down|up)|(?:gps|gnss)?(north|east|down|up)(?:vel|velocity)"
)

#: Dates are read as seconds since 2000; other clocks count from 1970, s.
_FROM_1970 = (EPOCH - datetime(1970, 1, 1, tzinfo=UTC)).total_seconds()


class ProposedFixes(NamedTuple):
    """A receiver's table and its columns.

    ``unit``, ``height_unit`` and ``velocity_unit`` are a map's, empty where it states none; ``clock`` that of its own
    column of time, None where it has the log's. ``apart`` says why its clock is another one: the lines then stand in
    the map as comments. ``layout`` is that of its file, where it is laid out otherwise than the log, ``offset`` what is
    to be added to its times, s.
    """

    numbers: Numbers
    columns: tuple[str, ...]
    unit: str
    height_unit: str
    clock: Clock | None
    decision: Decision
    apart: str = ""
    velocity_unit: str = ""
    layout: Layout | None = None
    offset: float = 0.0


def fixes_of(
    tables: Sequence[Numbers], clock: Clock, read: Sequence[Numbers]
) -> tuple[ProposedFixes | None, tuple[str, ...]]:
    """Return the first receiver's fixes among the tables, and what to say of them.

    ``clock`` is the log's and ``read`` the tables of its other sensors, none where fixes are all there is. A receiver's
    own table comes before these; one on another clock is taken where nothing else is there.
    """
    notes: list[str] = []
    aside: ProposedFixes | None = None
    inside = [numbers for numbers in tables if any(numbers is one for one in read)]
    for numbers in [*(one for one in tables if not any(one is other for other in inside)), *inside]:
        found, why = _columns(numbers)
        if why:
            notes.append(f"left out: the fixes in {numbers.path.name}: {why}")
        if found is None:
            continue
        timed, why = _timed(found, clock, read[0] if read else None)
        if why:
            notes.append(f"left out: the fixes in {numbers.path.name}: {why}")
        if timed is not None and not timed.apart:
            return timed, (*notes, *_no_velocity(timed))
        aside = aside or timed
    return aside, (*notes, *(_no_velocity(aside) if aside is not None else ()))


def _columns(numbers: Numbers) -> tuple[ProposedFixes | None, str]:
    """Return the table's fixes by its columns, or why they are none that a map can read (empty: it has none)."""
    names, columns = SENSORS["gps"].columns, numbers.table.columns
    if set(names) <= set(columns):
        told = Decision("gps", ", ".join(names), "certain", "its columns are called as in a recording")
        return ProposedFixes(numbers, names, "", "", None, told), ""
    place = numbers.degrees
    if place is None:
        return None, ""
    heights = [k for k, name in enumerate(numbers.names) if last_word(name) in _HEIGHT]
    if not heights:
        return None, "it has a latitude and a longitude, and no column of a height that a map needs beside them"
    # a barometer's may stand beside the receiver's
    own = words_of(numbers.names[place[0]])
    height = max(heights, key=lambda k: len(own & words_of(numbers.names[k])))
    most = np.nanmax(np.abs(numbers.values[:, list(place)]), axis=0, initial=0.0)
    counted = _counts(numbers.values[:, list(place)])
    if not counted and (most[0] > 90.0 or most[1] > 180.0):
        what = f"'{columns[place[0]]}' goes to {most[0]:.9g} and '{columns[place[1]]}' to {most[1]:.9g}"
        return None, f"{what}, no degrees; write them in degrees"
    fixes = numbers.values[:, [*place, height]]
    fixes = fixes[np.isfinite(fixes).all(axis=1) & np.any(fixes[:, :2] != 0.0, axis=1)]  # zeros: no fix yet
    if not np.any(fixes != fixes[:1]):
        return None, "the same fix stands in every row" if len(fixes) else "no row of it holds a fix"
    unit = read_name(numbers.names[height]).unit.lower()
    unit = "ft" if unit in ("feet", "foot") else unit if unit in UNITS["m"] else ""
    unit = unit or "mm" * counted  # so count u-blox (NAV-PVT) and MAVLink (GPS_RAW_INT), which count degrees so
    why = f"by their names, in degrees{' E7' * counted} and {unit or 'm, as receivers write it'}"
    velocity, speed = _velocity(numbers)
    velocity = velocity if speed or not counted else ()  # mm/s of the one, cm/s of the other
    why += f", the velocity in {speed or 'm/s, as most receivers write it'}" * bool(velocity)
    names = tuple(columns[k] for k in (*place, height, *velocity))
    told = Decision("gps", ", ".join(names), "likely", why)
    units = ("" if unit == "m" else unit, "" if speed == "m/s" else speed)
    return ProposedFixes(
        numbers, names, "degE7" if counted else "deg", units[0], None, told, velocity_unit=units[1]
    ), ""


def _counts(place: FloatArray) -> bool:
    """Tell latitudes and longitudes (n, 2) in whole ten millionths of a degree, as protocols of receivers count."""
    known = place[np.isfinite(place).all(axis=1) & np.any(place != 0.0, axis=1)]
    size = np.max(np.abs(known), axis=0, initial=0.0)
    return bool(np.all(known % 1 == 0) and size.max() > 1e4 and size[0] <= 90e7 and size[1] <= 180e7)


def _velocity(numbers: Numbers) -> tuple[tuple[int, ...], str]:
    """Return the columns of the velocity north, east and down and their unit, where all three are there."""
    parts: dict[str, int] = {}
    for k, name in enumerate(numbers.names):
        if part := _part(name):
            parts.setdefault(part, k)
    if not {"n", "e", "d"} <= set(parts):
        return (), ""
    three = (parts["n"], parts["e"], parts["d"])
    stated = {reading.unit for k in three for reading in readings_of(split_unit(numbers.names[k])[1])}
    return three, stated.pop() if len(stated) == 1 and stated <= set(SPEEDS) else ""


def _part(name: str) -> str:
    """Return which part of a velocity a column is called after: n, e, d or u; empty where it is none.

    >>> [_part(name) for name in ("vel_n_m_s", "velE (mm/s)", "vd", "gps_vel_d", "vx", "north velocity", "even")]
    ['n', 'e', 'd', 'd', '', 'n', '']
    """
    match = _PART.fullmatch(re.sub(r"[\s_.\-]+", "", split_unit(name.strip())[0].lower()))
    return "" if match is None else (match[1] or match[2])[0]


def _timed(found: ProposedFixes, clock: Clock, main: Numbers | None) -> tuple[ProposedFixes | None, str]:
    """Return the fixes with the column of their time, or why that cannot stand beside the log's."""
    if main is None or found.numbers is main:
        return found, ""
    own = clocks_of(found.numbers)[0]
    if own.column is None:
        return None, "no column of it tells a time"
    if clock.column is None:
        return None, "the log of the disc has no time stamps that they could be laid beside"
    same = (own.column, own.unit, own.spacings) == (clock.column, clock.unit, clock.spacings)
    found = found._replace(clock=None if same and clock.counter is None else own)
    log, gps = _times(clock, main), _times(own, found.numbers)
    late = apart({"log": log, "gps": gps})
    if not late:
        return found, ""
    for offset, why in _counted_otherwise(log.time):
        if not apart({"log": log, "gps": gps._replace(time=gps.time + offset)}):
            said = f"{found.decision.why}; {offset:+.0f} s are added to its times: {why}"
            return found._replace(offset=offset, decision=found.decision._replace(why=said)), ""
        if between := zones(float(gps.time[0] + offset - log.time[0])):
            hours = f"{abs(between) / 3600:g} h apart, as clocks of two time zones differ"
            told = f"its clock is another one, {hours}: time_offset_s = {offset - between:.0f} lets both begin together"
            return found._replace(apart=told), f"{told}; its lines stand in the map as comments"
    told = late[0].removeprefix("WARNING: ")
    if clock.unit != "iso":  # a clock that counts from its start is in no zone
        spans = f"it runs from {_span(gps)} s, the log's from {_span(log)} s"
        together = f"time_offset_s = {log.time[0] - gps.time[0]:.3f} lets both begin together"
        told = f"its clock is another one ({spans}): state by how much its times are to be moved ({together})"
    return found._replace(apart=told), f"{told}; its lines stand in the map as comments"


def _counted_otherwise(log: FloatArray) -> list[tuple[float, str]]:
    """Return what turns times of another origin, s, into those of a log (n,), each with why.

    Dates are read as seconds since 2000, and a log may have those since 1970; times of the day lack the log's day.
    """
    counted = [(sign * _FROM_1970, "one clock counts from 1970, and dates are read from 2000") for sign in (1, -1)]
    if log[0] < DATED:
        return counted
    today, why = DAY * (log[0] // DAY), "its times are of the day alone, and the log has the date"
    return [*counted, (today, why), (today - DAY, why)]


def _span(read: Readings) -> str:
    return f"{read.time[0]:.9g} to {read.time[-1]:.9g}"


def _times(clock: Clock, numbers: Numbers) -> Readings:
    time = seconds(clock, numbers)
    time = np.sort(time[np.isfinite(time)])
    return Readings(np.arange(time.size), time, np.zeros((time.size, 1)))


def _no_velocity(found: ProposedFixes) -> list[str]:
    """Say of columns of speed and heading, or of parts of a velocity, why they are left out."""
    names = zip(found.numbers.table.columns, found.numbers.names, strict=True)
    left = [
        f"'{column}'"
        for column, name in names
        if (words_of(name) & _MOTION or _part(name)) and sensor_of(read_name(name).base) != "gyroscope"
    ]
    if not left or len(found.columns) > 3:
        return []
    what = f"left out: {', '.join(left)} of {found.numbers.path.name}"
    if found.unit == "degE7" and _velocity(found.numbers)[0]:
        return [f"{what}: their unit is not in their names; write it there, as vn (cm/s) or vn (mm/s)"]
    return [f"{what}: a recording's gps has the velocity north, east and down, and these are not those three"]
