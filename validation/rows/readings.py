"""The rows of one sensor in a log, as numbers on the file's clock."""

from __future__ import annotations

from typing import NamedTuple

from discsim.arrays import BoolArray, FloatArray, IntArray

__all__ = ["Readings"]


class Readings(NamedTuple):
    """A sensor's sound rows: number (n,), time (n,) s on the file's clock, value (n, k) in recording units and axes."""

    number: IntArray
    time: FloatArray
    value: FloatArray

    def select(self, chosen: BoolArray) -> Readings:
        """Return the chosen (n,) rows."""
        return Readings(self.number[chosen], self.time[chosen], self.value[chosen])
