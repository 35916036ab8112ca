"""Bodies that turn about an axis straight down, in closed form, for sensors to measure."""

from __future__ import annotations

import numpy as np

from discsim.environment import Environment
from discsim.motion import Motion

DOWN = np.array([0.0, 0.0, 1.0])


def turning(
    rate: float,
    duration: float = 1.0,
    acceleration: float = 0.0,
    environment: Environment | None = None,
    step: float = 1e-3,
) -> Motion:
    """Turn at ``rate`` + ``acceleration`` t (rad/s) about the vertical through the origin, yaw zero at t = 0.

    Between its grid points `Motion` is exact for it: yaw is quadratic in time.
    """
    t = np.linspace(0.0, duration, round(duration / step) + 1)
    still = np.zeros((t.size, 3))
    yaw = rate * t + acceleration * t**2 / 2
    attitude = np.column_stack((np.cos(yaw / 2), still[:, :2], np.sin(yaw / 2)))
    return Motion(
        t,
        still,
        still,
        still,
        attitude,
        (rate + acceleration * t)[:, None] * DOWN,
        np.full(t.size, acceleration)[:, None] * DOWN,
        environment or Environment(),
    )


def field_at(yaw: np.ndarray, field: np.ndarray) -> np.ndarray:
    """The field (n, 3) in a level body turned clockwise by yaw (n,): C3(yaw) B_N, (A1)."""
    north, east, down = field
    return np.column_stack(
        (np.cos(yaw) * north + np.sin(yaw) * east, -np.sin(yaw) * north + np.cos(yaw) * east, np.full(yaw.size, down))
    )
