"""Terms from which an unknown law about motion is put together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from discsim.arrays import FloatArray

__all__ = ["Term"]


@dataclass(frozen=True)
class Term:
    """One product of powers about motion: ``target = c |x|^n ...``, keeping the signs of the symbols in ``odd``.

    ``powers`` are pairs of symbol and exponent; ``decay`` (1/s) makes it die away in time. What repeats ``order`` times
    in a turn of a rig is ``c cos(order yaw + phase)``. ``place`` are north, east and size (m) of a place that it is
    about: ``c exp(-((north - a)^2 + (east - b)^2) / (2 s^2))``.
    """

    target: str
    powers: tuple[tuple[str, float], ...] = ()
    odd: tuple[str, ...] = ()
    decay: float = 0.0
    order: int = 0
    phase: float = 0.0
    place: tuple[float, float, float] | None = None

    def weight(self, state: Mapping[str, FloatArray], at: Mapping[str, float]) -> FloatArray:
        """Return the term at states (k,) for a coefficient of one, symbols taken in units of ``at``."""
        value = np.exp(-self.decay * state["t"])
        for symbol, power in self.powers:
            value = value * (np.abs(state[symbol]) / at[symbol]) ** power
        for symbol in self.odd:
            value = value * np.sign(state[symbol])
        if self.place is not None:
            north, east, size = self.place
            value = value * np.exp(-0.5 * ((state["north"] - north) ** 2 + (state["east"] - east) ** 2) / size**2)
        return np.asarray(value)
