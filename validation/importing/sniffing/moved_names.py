"""Names that stand beside the wrong columns. Takes sensors by their names; refuses one with a clock among its readings.

A logger that puts a second time in front and no name for it moves all names by a column.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.validation.importing.sniffing.clock import SCALES, Clock, seconds
from discsim.validation.importing.sniffing.groups import Triple

__all__ = ["refuse_moved_names"]

#: Rows of which a clock is told from a reading that happens to rise as fast, at least.
FEWEST = 50
#: Share of the rows at which it goes on: rows that stand twice or in another order are fewer.
RISING = 0.99
#: Two clocks of one board are as fast to this share (crystals to a ten-thousandth, oscillators to a few per cent).
AS_FAST = 0.05
#: ... and a line through one against the other leaves this share of the usual step at most; stamps of a computer that
#: reads a port come late by some of it.
WITHIN = 1.0


def refuse_moved_names(clock: Clock, triples: Iterable[Triple]) -> None:
    """Raise `InputError` where a column that is called a sensor's goes on as the time of the rows does."""
    for triple in triples:
        if clock.column not in triple.numbers.table.columns:
            continue
        for name, value in zip(triple.names, triple.values.T, strict=True):
            # no reading rises in every row: the stamps, which may be dates, are read for one that does alone
            if not _rises(value):
                continue
            if (unit := _unit_of_time(seconds(clock, triple.numbers)[triple.rows], value)) is not None:
                raise InputError.at(
                    triple.numbers.path,
                    None,
                    f"'{name}' is the {triple.sensor}'s by its name and goes on as '{clock.column}' does, in {unit}: "
                    "the names stand a column beside what they name; expected a name for each column: correct the "
                    "header, or state the columns in a map (docs/importing.md)",
                )


def _rises(value: FloatArray) -> bool:
    sound = value[np.isfinite(value)]
    return sound.size >= FEWEST and bool(np.mean(np.diff(sound) > 0.0) >= RISING)


def _unit_of_time(time: FloatArray, value: FloatArray) -> str | None:
    """Return the unit in which a column (n,) goes on as the times of its rows, s, do; None where it does not."""
    sound = np.isfinite(time) & np.isfinite(value)
    if not _rises(value[sound]):
        return None
    t, v = time[sound] - time[sound][0], value[sound]
    slope, start = np.polyfit(t, v, 1) if np.ptp(t) > 0.0 else (0.0, 0.0)
    left = float(np.std(v - slope * t - start))
    if left > WITHIN * abs(slope) * float(np.median(np.diff(t))):
        return None
    return next((unit for unit, scale in SCALES.items() if abs(slope * scale - 1.0) < AS_FAST), None)
