"""A receiver's fixes beside the disc's own log. Takes the tables; gives the lines of a map that read them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from discsim.recording import SENSORS
from discsim.validation.importing.apart import apart
from discsim.validation.importing.cleaning import Readings
from discsim.validation.importing.import_map import UNITS
from discsim.validation.importing.sniffing.clock import Clock, clocks_of, seconds
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.groups import Numbers
from discsim.validation.importing.sniffing.names import last_word, read_name, words_of

__all__ = ["ProposedFixes", "fixes_of"]

_HEIGHT = {"alt", "altitude", "ele", "elevation", "height", "hmsl", "msl", "hgt", "heightmsl", "altitudemsl"}
#: Words for a speed and for a heading.
_MOTION = {"speed", "spd", "sog", "gspeed", "groundspeed", "velocity", "vel"} | {
    *("heading", "hdg", "course", "cog", "bearing")
}


class ProposedFixes(NamedTuple):
    """A receiver's table and its columns.

    ``unit`` and ``height_unit`` are a map's, empty where it states none; ``clock`` that of its own column of time, None
    where it has the log's. ``apart`` says why its clock is another one: the lines then stand in the map as comments.
    """

    numbers: Numbers
    columns: tuple[str, ...]
    unit: str
    height_unit: str
    clock: Clock | None
    decision: Decision
    apart: str = ""


def fixes_of(
    tables: Sequence[Numbers], clock: Clock, read: Sequence[Numbers]
) -> tuple[ProposedFixes | None, tuple[str, ...]]:
    """Return the first receiver's fixes among the tables, and what to say of them.

    ``clock`` is the log's and ``read`` the tables of its other sensors, none where fixes are all there is: fixes in
    these are not looked for.
    """
    notes: list[str] = []
    for numbers in tables:
        if any(numbers is one for one in read):
            continue
        found, why = _columns(numbers)
        if why:
            notes.append(f"left out: the fixes in {numbers.path.name}: {why}")
        if found is None:
            continue
        timed, why = _timed(found, clock, read[0] if read else None)
        if why:
            notes.append(f"left out: the fixes in {numbers.path.name}: {why}")
        if timed is not None:
            return timed, (*notes, *_no_velocity(timed))
    return None, tuple(notes)


def _columns(numbers: Numbers) -> tuple[ProposedFixes | None, str]:
    """Return the table's fixes by its columns, or why they are none that a map can read (empty: it has none)."""
    names, columns = SENSORS["gps"].columns, numbers.table.columns
    if set(names) <= set(columns):
        told = Decision("gps", ", ".join(names), "certain", "its columns are called as in a recording")
        return ProposedFixes(numbers, names, "", "", None, told), ""
    place = numbers.degrees
    if place is None:
        return None, ""
    height = next((k for k, name in enumerate(numbers.names) if last_word(name) in _HEIGHT), None)
    if height is None:
        return None, "it has a latitude and a longitude, and no column of a height that a map needs beside them"
    most = np.nanmax(np.abs(numbers.values[:, list(place)]), axis=0, initial=0.0)
    if most[0] > 90.0 or most[1] > 180.0:
        what = f"'{columns[place[0]]}' goes to {most[0]:.9g} and '{columns[place[1]]}' to {most[1]:.9g}"
        return None, f"{what}, no degrees; write them in degrees"
    three = tuple(columns[k] for k in (*place, height))
    unit = read_name(numbers.names[height]).unit.lower()
    unit = "ft" if unit in ("feet", "foot") else unit if unit in UNITS["m"] else ""
    why = f"by their names, in degrees and {unit or 'm, as receivers write it'}"
    told = Decision("gps", ", ".join(three), "likely", why)
    return ProposedFixes(numbers, three, "deg", "" if unit == "m" else unit, None, told), ""


def _timed(found: ProposedFixes, clock: Clock, main: Numbers | None) -> tuple[ProposedFixes | None, str]:
    """Return the fixes with the column of their time, or why that cannot stand beside the log's."""
    if main is None:
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
    told = late[0].removeprefix("WARNING: ")
    if clock.unit != "iso":  # a clock that counts from its start is in no zone
        spans = f"it runs from {_span(gps)} s, the log's from {_span(log)} s"
        together = f"time_offset_s = {log.time[0] - gps.time[0]:.3f} lets both begin together"
        told = f"its clock is another one ({spans}): state by how much its times are to be moved ({together})"
    return found._replace(apart=told), f"{told}; its lines stand in the map as comments"


def _span(read: Readings) -> str:
    return f"{read.time[0]:.9g} to {read.time[-1]:.9g}"


def _times(clock: Clock, numbers: Numbers) -> Readings:
    time = seconds(clock, numbers)
    time = np.sort(time[np.isfinite(time)])
    return Readings(np.arange(time.size), time, np.zeros((time.size, 1)))


def _no_velocity(found: ProposedFixes) -> list[str]:
    """Say of columns of speed and heading why they are left out."""
    names = zip(found.numbers.table.columns, found.numbers.names, strict=True)
    left = [f"'{column}'" for column, name in names if words_of(name) & _MOTION]
    if not left:
        return []
    what = f"left out: {', '.join(left)} of {found.numbers.path.name}"
    return [f"{what}: a recording's gps has the velocity north, east and down, and none of these is one of them"]
