"""A second axis under a rate table: it turns the table as a whole, which the table's encoder does not see."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from discsim.arrays import FloatArray, readonly, vector3
from discsim.errors import InputError
from discsim.frames import multiply, to_body, turn
from discsim.motion import Motion
from discsim.recording import Samples

__all__ = ["SecondAxis"]


@dataclass(frozen=True)
class SecondAxis:
    """An axis fixed in N along ``direction`` (3,) that turns a rate table by ``profile``: t (n,) s, rate (n,) rad/s.

    The rate is linear between the profile's knots and stays at its last one. At t = 0 the centre of the table stands
    at ``arm`` (3,) m from the axis in N, zero where the axes meet there.
    """

    direction: FloatArray
    profile: Samples
    arm: FloatArray = field(default_factory=lambda: readonly([0.0, 0.0, 0.0]))

    def __post_init__(self) -> None:
        direction = vector3(self.direction, "second axis")
        if not (length := float(np.linalg.norm(direction))) > 0.0:
            raise InputError("the second axis has no direction; expected three numbers, not all of them zero")
        object.__setattr__(self, "direction", readonly(direction / length))
        object.__setattr__(self, "arm", vector3(self.arm, "arm of the second axis (m)"))

    def turned(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return angle (rad), rate and angular acceleration, each (n,), at times t (n,) s."""
        knots, rates = self.profile.t, self.profile.value
        slopes = np.append(np.diff(rates) / np.diff(knots), 0.0)
        until = np.append(0.0, np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(knots)))
        k = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, knots.size - 1)
        x = t - knots[k]
        return until[k] + x * (rates[k] + 0.5 * slopes[k] * x), rates[k] + slopes[k] * x, slopes[k]

    def carry(self, motion: Motion) -> Motion:
        """Return the motion of a table, of which ``motion`` is the one on an axis that stands, turned by this one.

        With R the table's own attitude and e the direction, in B: w = w_table + R^T e rate, and its derivative has
        (R^T e rate) x w_table beside those of the two rates, for R^T e turns against the table.
        """
        e = self.direction
        angle, rate, acceleration = self.turned(motion.t)
        in_table = to_body(motion.attitude, e)
        extra = rate[:, None] * in_table
        arm = self.with_it(self.arm, motion.t)
        speed = np.cross(e, arm)
        return replace(
            motion,
            attitude=multiply(turn(angle[:, None] * e), motion.attitude),
            rate=motion.rate + extra,
            angular_acceleration=motion.angular_acceleration
            + acceleration[:, None] * in_table
            + np.cross(extra, motion.rate),
            position=motion.position + arm,
            velocity=motion.velocity + rate[:, None] * speed,
            acceleration=motion.acceleration + acceleration[:, None] * speed + (rate**2)[:, None] * np.cross(e, speed),
        )

    def with_it(self, vector: FloatArray, t: FloatArray) -> FloatArray:
        """Return vectors of N, (3,) or (n, 3), turned as far as this axis has turned by times t (n,) s, (n, 3)."""
        angle, _, _ = self.turned(t)
        return to_body(turn(-angle[:, None] * self.direction), vector)

    def unseen(self, readings: FloatArray, t: FloatArray, motion: Motion) -> FloatArray:
        """Return rates about z_B (n, 1) at times t (n,) less what this axis adds: what the table's encoder tells."""
        _, rate, _ = self.turned(t)
        along = motion.at(t).in_body(self.direction)[:, 2]
        return readings - (rate * along)[:, None]
