"""Where and when a log says that it was made. Takes the tables; gives the place and the day, and what to say of them.

The magnetic field of a place is asked for (``--place``, ``--date``), and a log with a receiver's columns knows the
place itself, one whose stamps are dates also the day.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, date, datetime, timedelta
from math import cos, hypot, radians
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.environment import world_magnetic_field
from discsim.errors import InputError
from discsim.validation.importing.sniffing.groups import Numbers

__all__ = ["OwnPlace", "own_place"]

#: whole numbers as receivers of u-blox give them: of 1e-7 degrees
_COUNTS = 1e-7
#: km in a degree of latitude (a quarter of the meridian is 10 002 km), and how far apart is another place: over 20 km a
#: component of the field changes by up to 0.32 uT, twice its model's error (the same model, from 60 deg S to 60 deg N)
_DEGREE_KM, _APART_KM = 111.1, 20.0


#: what clocks of dates count from
_FIRST = datetime(1970, 1, 1, tzinfo=UTC)
_ANY_DAY = date(2025, 1, 1)


class OwnPlace(NamedTuple):
    """Latitude and longitude, degrees north and east, and the names of their columns; the day where that is known.

    It is the day of a log whose stamps are dates, where a model tells the ``field`` of that day, of so many uT.
    """

    latitude: float
    longitude: float
    names: tuple[str, str]
    day: date | None = None
    field: float | None = None

    @property
    def text(self) -> str:
        """The place as ``--place`` takes it."""
        return f"{self.latitude:.4f},{self.longitude:.4f}"

    def on(self, moment: float | None) -> OwnPlace:
        """Return the place on the day of a moment, s since 1970; without it where no model tells that day's field."""
        if moment is None:
            return self
        day = (_FIRST + timedelta(seconds=moment)).date()
        try:
            there = world_magnetic_field(self.latitude, self.longitude, day)
        except InputError:
            return self
        return self._replace(day=day, field=float(np.linalg.norm(there)))

    @property
    def down(self) -> float:
        """The share of the field that points down there: of the day, or of any, for it is slow to change its sign."""
        there = world_magnetic_field(self.latitude, self.longitude, self.day or _ANY_DAY)
        return float(there[2] / np.linalg.norm(there))

    @property
    def note(self) -> str:
        """Where the log was made, in a sentence."""
        said = f"made at {self.text} (degrees north, east) by its own '{self.names[0]}', '{self.names[1]}'"
        return said if self.day is None else f"{said}, on {self.day} by its stamps: the field is that of the model"

    def doubt(self, place: str) -> str | None:
        """Return what to say of a ``--place`` that is well formed and another one; None where it is this."""
        latitude, longitude = (float(part) for part in place.split(","))
        east = cos(radians(self.latitude)) * ((longitude - self.longitude + 180.0) % 360.0 - 180.0)
        apart = _DEGREE_KM * hypot(latitude - self.latitude, east)
        if apart < _APART_KM:
            return None
        return f"warning: --place {place} is {apart:.0f} km from where the log says that it was made, {self.text}"


def own_place(tables: Sequence[Numbers]) -> OwnPlace | None:
    """Return where the first table with a latitude and a longitude says that it was made, by their medians."""
    for numbers in tables:
        if numbers.degrees is None:
            continue
        latitude, longitude = numbers.degrees
        both = numbers.values[:, [latitude, longitude]]
        both = both[np.all(np.isfinite(both), axis=1) & np.any(both != 0.0, axis=1)]  # zeros: no fix yet
        if not both.size:
            continue
        north, east = _degrees(np.median(both, axis=0))
        if abs(north) <= 90.0 and abs(east) <= 180.0:
            return OwnPlace(north, east, (numbers.table.columns[latitude], numbers.table.columns[longitude]))
    return None


def _degrees(place: FloatArray) -> tuple[float, float]:
    scale = _COUNTS if np.all(place == np.round(place)) and np.max(np.abs(place)) > 180.0 else 1.0
    return float(scale * place[0]), float(scale * place[1])
