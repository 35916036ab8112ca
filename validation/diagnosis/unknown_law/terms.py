"""The terms from which an unknown law about a sensor is put together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import FloatArray
from discsim.law import behind_play

__all__ = ["SENSORS", "SHAPES", "SIDES", "SensorTerm"]


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
    swinging    lines at w + spin, w - spin and w             w in rad/s
    ==========  ============================================  ======================

    What swings is a field that alternates outside, as that of a mains cable: fixed in N, it stands in B at w beside the
    spin. Its phase is another one in each recording, and so are its coefficients.
    """

    sensor: str
    kind: str
    shape: float
    #: what powers are taken in units of
    unit: float = 1.0

    @property
    def size(self) -> int:
        """Number of coefficients of an axis."""
        return {"turning": 2, "swinging": 6}.get(self.kind, 1)

    @property
    def own(self) -> bool:
        """Whether each recording has coefficients of its own."""
        return self.kind == "swinging"

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
        if self.kind == "swinging":
            angles = [shape * t + order * psi for order in SIDES]
            return np.stack([wave(angle) for angle in angles for wave in (np.cos, np.sin)], axis=1)
        y = {"drift": t, "rate": r, "reading": x}[self.kind]
        return np.asarray(np.sign(y) * np.abs(y / self.unit) ** shape)[:, None]


#: times the spin by which the lines of what swings outside lie beside its own: across the spin axis, and along it
SIDES = (1, -1, 0)

#: shapes that are tried first; those of what turns or swings come from the spectrum of the residuals
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
    "magnetometer": ("warming", "drift", "rate", "turning", "swinging"),
    "accelerometer": ("warming", "drift", "rate", "settling", "reading", "play", "turning"),
    "gyroscope": ("warming", "drift", "rate", "reading", "play", "turning"),
}
