"""`Motion`: the truth, on a time grid and at any instant between; no `Recording` carries one."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np

from discsim.arrays import FloatArray, readonly, vector3
from discsim.environment import Environment
from discsim.files import write_text
from discsim.frames import conjugate, euler_angles, multiply, rotation_vector, to_body, turn
from discsim.result import Result
from discsim.splines import hermite, spline_slopes

__all__ = ["COLUMNS", "JUMP_S", "Motion", "State", "Surroundings"]

#: how far apart the two states are, s, between which an angular acceleration jumps: recordings tell no shorter time
JUMP_S = 1e-6

#: columns of a flight's truth: position and velocity in N, attitude, body rates
COLUMNS = (
    *("time_s", "north_m", "east_m", "down_m", "v_north_m_s", "v_east_m_s", "v_down_m_s"),
    *("roll_rad", "pitch_rad", "yaw_rad", "p_rad_s", "q_rad_s", "r_rad_s"),
)


class Surroundings(NamedTuple):
    """What sensors sense besides the motion: field (3,) uT in N, gravity m/s^2, and the centre of mass.

    That (3,) m is from the geometric centre, in B.
    """

    magnetic_field: FloatArray
    gravity: float
    centre_of_mass: FloatArray


class State(NamedTuple):
    """Motion at instants t (n,) s; vectors (..., n, 3) in SI, position to acceleration in N, rates in B.

    Leading dimensions are those of neighbouring motions; most often there are none.
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    attitude: FloatArray
    rate: FloatArray
    angular_acceleration: FloatArray

    def in_body(self, vector_ned: FloatArray) -> FloatArray:
        """Return an N vector (3,) or (..., n, 3) in B, (..., n, 3)."""
        return to_body(self.attitude, vector_ned)


@dataclass(frozen=True, repr=False)
class Motion(Result):
    """True motion of a disc or a rig.

    Attributes
    ----------
    t : (n,) array
        Ascending times, s; the last is touch-down where ``touched_down``.
    position, velocity, acceleration : (n, 3) arrays
        Of the centre of mass, in N.
    attitude : (n, 4) array
        Quaternion that turns B components into N.
    rate, angular_acceleration : (n, 3) arrays
        Body rates p, q, r in B and their derivatives.
    environment : Environment
        Where it happened.
    centre_of_mass : (3,) array
        From the geometric centre, in B, m.
    touched_down : bool
        Whether the motion ends on the ground.
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    attitude: FloatArray
    rate: FloatArray
    angular_acceleration: FloatArray
    environment: Environment
    centre_of_mass: FloatArray = field(default_factory=lambda: readonly([0.0, 0.0, 0.0]))
    touched_down: bool = False

    def __post_init__(self) -> None:
        n = np.size(self.t)
        widths = {"t": (), "attitude": (4,)}
        for name in ("t", "position", "velocity", "acceleration", "attitude", "rate", "angular_acceleration"):
            array = readonly(getattr(self, name))
            expected = (n, *widths.get(name, (3,)))
            if array.shape != expected:
                raise ValueError(f"motion {name}: got {array.shape}, expected {expected}")
            object.__setattr__(self, name, array)
        object.__setattr__(self, "centre_of_mass", vector3(self.centre_of_mass, "centre of mass (m)"))
        if n < 2 or np.any(np.diff(self.t) <= 0):
            raise ValueError(f"motion: got {n} times, expected at least two, ascending")

    _dimension: ClassVar[str] = "time_s"

    def __repr__(self) -> str:
        return f"<Motion: {self.summary()}>"

    def summary(self) -> str:
        """Return how long it lasts, how far it goes, and the spin at both ends: one line."""
        first, last = np.degrees(self.rate[[0, -1], 2])
        far = float(np.hypot(*(self.position[-1] - self.position[0])[:2]))
        ending = ", to the ground" if self.touched_down else ""
        return f"{self.end - self.start:.4g} s, {far:.4g} m{ending}, spin {first:.5g} to {last:.5g} deg/s"

    def table(self) -> dict[str, FloatArray]:
        """Return every step: time, position and velocity in N, roll, pitch, yaw, and body rates."""
        values = (self.t, *self.position.T, *self.velocity.T, *self.euler_angles, *self.rate.T)
        return dict(zip(COLUMNS, values, strict=True))

    def report(self, folder: Path | str) -> Path:
        """Write ``truth.csv``, every step of the motion, into ``folder``; return its path."""
        file, columns = Path(folder) / "truth.csv", self.table()
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        write_text(file, "\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows), ""]))
        return file

    @property
    def start(self) -> float:
        """First instant, s."""
        return float(self.t[0])

    @property
    def end(self) -> float:
        """Last instant, s."""
        return float(self.t[-1])

    @property
    def euler_angles(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Roll, pitch, yaw (n,) in rad."""
        return euler_angles(self.attitude)

    @property
    def surroundings(self) -> Surroundings:
        """What sensors sense besides the motion."""
        return Surroundings(self.environment.magnetic_field, self.environment.gravity, self.centre_of_mass)

    @cached_property
    def _jerk(self) -> FloatArray:
        return spline_slopes(self.t, self.acceleration)

    @cached_property
    def _angular_jerk(self) -> FloatArray:
        # what jumps between two states a moment apart is smooth before it and after it
        jumps = np.flatnonzero(np.diff(self.t) < 1.5 * JUMP_S) + 1
        pieces = zip(np.split(self.t, jumps), np.split(self.angular_acceleration, jumps), strict=True)
        return np.concatenate([spline_slopes(t, a) if t.size > 1 else np.zeros((1, 3)) for t, a in pieces])

    def at(self, t: FloatArray) -> State:
        """Return the motion at instants t (m,) s between start and end.

        Fourth order in the grid's spacing; attitude is a cubic in the rotation vector of each step that meets both
        its attitudes and its rates. Raises ValueError outside.
        """
        t = np.asarray(t, dtype=float)
        if t.size and (t.min() < self.start - 1e-12 or t.max() > self.end + 1e-12):
            raise ValueError(f"motion runs from {self.start:g} to {self.end:g} s, asked for {t.min():g} to {t.max():g}")
        # a rig stays where it is: nothing is interpolated of it
        moves = any(values.any() for values in (self.position, self.velocity, self.acceleration))
        still = np.zeros((t.size, 3))
        return State(
            t,
            hermite(self.t, self.position, self.velocity, t) if moves else still,
            hermite(self.t, self.velocity, self.acceleration, t) if moves else still,
            hermite(self.t, self.acceleration, self._jerk, t) if moves else still,
            self._attitude(t),
            hermite(self.t, self.rate, self.angular_acceleration, t),
            hermite(self.t, self.angular_acceleration, self._angular_jerk, t),
        )

    def _attitude(self, t: FloatArray) -> FloatArray:
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, self.t.size - 2)
        h = (self.t[k + 1] - self.t[k])[:, None]
        s = (t - self.t[k])[:, None] / h
        first, second = self.attitude[k], self.attitude[k + 1]
        whole = rotation_vector(multiply(conjugate(first), second))
        # slopes of the rotation vector: the rate at its start, J_r^-1(whole) rate at its end
        slope0, slope1 = h * self.rate[k], h * _right_jacobian_inverse(whole, self.rate[k + 1])
        vector = s * (1 - s) ** 2 * slope0 + s**2 * (3 - 2 * s) * whole - s**2 * (1 - s) * slope1
        return multiply(first, turn(vector))


def _right_jacobian_inverse(phi: FloatArray, w: FloatArray) -> FloatArray:
    """Return d(phi)/dt (n, 3) of a rotation vector phi (n, 3) whose body rate is w (n, 3)."""
    angle2 = np.sum(phi * phi, axis=-1, keepdims=True)
    half = np.sqrt(angle2) / 2
    small = angle2 < 1e-4
    safe = np.where(small, 1.0, half)
    # (1 - (a/2) cot(a/2))/a^2, with its series near zero
    factor = np.where(small, 1 / 12 + angle2 / 720, (1 - safe / np.tan(safe)) / np.where(small, 1.0, angle2))
    cross = np.cross(phi, w)
    return np.asarray(w + 0.5 * cross + factor * np.cross(phi, cross))
