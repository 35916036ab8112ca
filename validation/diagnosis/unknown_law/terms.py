"""The library of terms from which a law is put together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from discsim.arrays import FloatArray
from discsim.law import WRENCH_TARGETS

__all__ = ["FITTED", "SENSORS", "SHAPES", "Term"]

#: exponents that are tried first; the fit leaves them
_RIG_POWERS = (-1.0, 0.0, 0.5, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0)


_AIR_POWERS = {"V": (0.0, 1.0, 2.0, 3.0), "r": (0.0, 1.0, 2.0), "alpha": (0.0, 1.0, 2.0)}


#: candidates that are fitted, sums of exponents beyond which no physics goes
FITTED, _HIGHEST = 2, 5.0


@dataclass(frozen=True)
class Term:
    """One product of powers about motion: ``target = c |x|^n ...``, keeping the signs of the symbols in ``odd``.

    ``powers`` are pairs of symbol and exponent; ``decay`` (1/s) makes it die away in time.
    """

    target: str
    powers: tuple[tuple[str, float], ...] = ()
    odd: tuple[str, ...] = ()
    decay: float = 0.0

    def weight(self, state: Mapping[str, FloatArray], at: Mapping[str, float]) -> FloatArray:
        """Return the term at states (k,) for a coefficient of one, symbols taken in units of ``at``."""
        value = np.exp(-self.decay * state["t"])
        for symbol, power in self.powers:
            value = value * (np.abs(state[symbol]) / at[symbol]) ** power
        for symbol in self.odd:
            value = value * np.sign(state[symbol])
        return np.asarray(value)


def library(plant: str) -> list[Term]:
    """Return the terms about motion that are asked for first."""
    if plant == "spin_down":
        terms = [Term("moment_z_N_m", (("r", n),) if n else (), ("r",)) for n in _RIG_POWERS]
        # friction that changes with time, as a bearing warms
        return terms + [Term("moment_z_N_m", (("r", 1.0),), ("r",), 1.0 / tau) for tau in (2.0, 4.0, 8.0, 16.0)]
    if plant != "flight":
        return []
    terms = []
    for target in WRENCH_TARGETS:
        for powers in product(*_AIR_POWERS.values()):
            named = tuple((symbol, n) for symbol, n in zip(_AIR_POWERS, powers, strict=True) if n)
            odd = tuple(symbol for symbol, n in named if symbol != "V" and n == 1.0)
            if sum(powers) <= _HIGHEST:
                terms.append(Term(target, named, odd))
        if target == "moment_z_N_m":
            terms += [Term(target, (("r", n),), ("r",)) for n in (1.5, 2.0, 2.5, 3.0, 4.0)]
    return terms


@dataclass(frozen=True)
class SensorTerm:
    """What a sensor's axes read beside the motion, each with coefficients of its own and one ``shape`` in common.

    ==========  ============================================  ======================
    kind        form                                          shape
    ==========  ============================================  ======================
    warming     c - c exp(-t/tau)                             tau in s
    drift       c t^n                                         n
    rate        c |r|^n sign(r)                               n
    reading     c |x|^n sign(x), x the axis's own reading     n
    turning     a cos(k psi) + b sin(k psi)                   k
    ==========  ============================================  ======================
    """

    sensor: str
    kind: str
    shape: float
    #: what powers are taken in units of
    unit: float = 1.0

    @property
    def size(self) -> int:
        """Number of coefficients of an axis."""
        return 2 if self.kind == "turning" else 1

    def basis(self, t: FloatArray, r: FloatArray, psi: FloatArray, x: FloatArray, shape: float) -> FloatArray:
        """Return what coefficients of one add to readings, (n, size), at t, spin r, angle psi, reading x."""
        if self.kind == "warming":
            return np.asarray(-np.expm1(-t / shape))[:, None]
        if self.kind == "turning":
            return np.stack([np.cos(shape * psi), np.sin(shape * psi)], axis=1)
        y = {"drift": t, "rate": r, "reading": x}[self.kind]
        return np.asarray(np.sign(y) * np.abs(y / self.unit) ** shape)[:, None]


#: shapes that are tried first; those of what turns with the disc come from the spectrum of the residuals
SHAPES = {
    "warming": tuple(0.5 * 2.0**k for k in range(6)),
    "drift": (1.0, 2.0),
    "rate": (1.0, 2.0, 3.0),
    "reading": (2.0, 3.0),
}


#: kinds of law that a sensor can have
SENSORS = {
    "magnetometer": ("warming", "drift", "rate", "turning"),
    "accelerometer": ("warming", "drift", "rate", "reading", "turning"),
    "gyroscope": ("warming", "drift", "rate", "reading", "turning"),
}
