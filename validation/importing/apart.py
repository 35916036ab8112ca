"""Sensors whose times have nothing in common: clocks of two devices. Takes what was read; gives what to say of it."""

from __future__ import annotations

from collections.abc import Mapping

from discsim.validation.rows.readings import Readings

__all__ = ["apart", "zones"]

#: Zones of time lie whole quarters of an hour apart.
QUARTER = 900.0
#: Two devices that were switched on for one throw began within this long of each other, s: a third of a quarter, so
#: that the nearest quarter is the zone's.
TOGETHER = 300.0
#: The widest that two zones are apart, s: UTC-12 and UTC+14.
WIDEST = 26 * 3600.0


def zones(late: float) -> float:
    """Return the difference of two time zones, s, by which one clock may be ``late`` s behind another; 0 for none.

    >>> zones(7201.5), zones(1000.0), zones(-19800.0), zones(1e9)
    (7200.0, 900.0, -19800.0, 0.0)
    """
    found = QUARTER * round(late / QUARTER)
    return found if abs(found) <= WIDEST and abs(late - found) <= TOGETHER else 0.0


def apart(readings: Mapping[str, Readings]) -> list[str]:
    """Return a warning for each sensor that ended before the first one of the map began, or began after its end."""
    notes: list[str] = []
    if not readings:
        return notes
    name, main = next(iter(readings.items()))
    for sensor, found in readings.items():
        late = float(found.time[0] - main.time[0])
        if found.time[0] <= main.time[-1] and found.time[-1] >= main.time[0]:
            continue
        when = f"{sensor} begins {abs(late):.9g} s {'after' if late > 0 else 'before'} the {name}"
        if between := zones(late):
            hours = f"{abs(between) / 3600:g} h, as clocks of two time zones differ"
            why = f"about {hours}: state time_offset_s = {-between:g}"
        else:
            why = "two clocks, or another log's file: state by how much its times are to be moved, as time_offset_s"
        notes.append(f"WARNING: {when} and has no time in common with it: {why} below [sensors.{sensor}] of the map")
    return notes
