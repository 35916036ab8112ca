"""Sensors whose times have nothing in common: clocks of two devices. Takes what was read; gives what to say of it."""

from __future__ import annotations

from collections.abc import Mapping

from discsim.validation.importing.cleaning import Readings

__all__ = ["apart"]

#: Zones of time lie whole quarters of an hour apart.
QUARTER = 900.0
#: Two devices that were switched on for one throw began within this long of each other, s: a third of a quarter, so
#: that the nearest quarter is the zone's.
TOGETHER = 300.0
#: The widest that two zones are apart, s: UTC-12 and UTC+14.
WIDEST = 26 * 3600.0


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
        zones = QUARTER * round(late / QUARTER)
        if 0 < abs(zones) <= WIDEST and abs(late - zones) <= TOGETHER:
            why = f"about {abs(zones) / 3600:g} h, as clocks of two time zones differ: state time_offset_s = {-zones:g}"
        else:
            why = "two clocks, or another log's file: state by how much its times are to be moved, as time_offset_s"
        notes.append(f"WARNING: {when} and has no time in common with it: {why} below [sensors.{sensor}] of the map")
    return notes
