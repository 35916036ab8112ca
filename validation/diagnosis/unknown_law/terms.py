"""The terms from which an unknown law about a sensor is put together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import FloatArray
from discsim.law import behind_play

__all__ = ["SENSORS", "SHAPES", "SensorTerm"]


@dataclass(frozen=True)
class SensorTerm:
    """What a sensor's axes read beside the motion, each with coefficients of its own and one ``shape`` in common.

    ==========  ============================================  ======================
    kind        form                                          shape
    ==========  ============================================  ======================
    warming     c - c exp(-t/tau)                             tau in s
    drift       c t^n                                         n
    rate        c |r|^n sign(r)                               n
    settling    c r^2 - c r^2 exp(-t/tau)                     tau in s
    reading     c |x|^n sign(x), x the axis's own reading     n
    play        c play(x, w) - c x, Prandtl's operator        w in the sensor's unit
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
        if self.kind == "settling":
            return np.asarray(-np.expm1(-t / shape) * (r / self.unit) ** 2)[:, None]
        if self.kind == "play":
            return np.asarray(behind_play(np.ascontiguousarray(x), shape) - x)[:, None]
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
    "settling": tuple(0.25 * 2.0**k for k in range(6)),
    # of the spread of the readings
    "play": tuple(0.5**k for k in range(1, 9)),
}


#: kinds of law that a sensor can have
SENSORS = {
    "magnetometer": ("warming", "drift", "rate", "turning"),
    "accelerometer": ("warming", "drift", "rate", "settling", "reading", "play", "turning"),
    "gyroscope": ("warming", "drift", "rate", "reading", "play", "turning"),
}
