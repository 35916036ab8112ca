"""What a recording states of its release, as rows of a prior upon the first state."""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.frames import euler_angles
from validation.identification.segments import Chain, shifted

__all__ = []


def release_rows(current: Chain) -> tuple[FloatArray, FloatArray]:
    """Return what a recording states of its release: residuals (m,) in sigmas and rows (m, d) upon the first state."""
    release, d = current.recording.release, current.tangent
    if release is None or current.recording.plant not in ("flight", "free_spin"):
        return np.empty(0), np.empty((0, d))
    residual: list[float] = []
    rows: list[FloatArray] = []
    state = current.states[0]

    def add(difference: float, row: FloatArray, sigma: float) -> None:
        residual.append(difference / sigma)
        rows.append(row / sigma)

    def sigma_of(key: str, exact: float) -> FloatArray:
        given = release.sigma.get(key)
        return np.broadcast_to(exact if given is None else np.maximum(np.asarray(given, dtype=float), exact), 3)

    unit = np.eye(d)
    if current.recording.plant == "flight":
        for stated, first, key, exact in (
            (release.position, 0, "position_ned_m", 1e-4),
            (release.velocity, 3, "velocity_ned_m_s", 1e-4),
        ):
            if stated is not None:
                for axis in range(3):
                    add(stated[axis] - state[first + axis], unit[first + axis], sigma_of(key, exact)[axis])
    if release.body_rate is not None:
        for axis in range(3):
            add(
                release.body_rate[axis] - state[10 + axis],
                unit[9 + axis],
                sigma_of("body_rate_rad_s", 1e-4)[axis],
            )
    angles = np.array([float(a[0]) for a in euler_angles(state[None, 6:10])])
    h = 1e-6
    for place, (stated_angle, key) in enumerate(
        ((release.roll, "roll_rad"), (release.pitch, "pitch_rad"), (release.yaw, "yaw_rad"))
    ):
        if stated_angle is None:
            continue
        row = np.zeros(d)
        for axis in range(3):
            tangent = np.zeros(d)
            tangent[6 + axis] = h
            turned = shifted(current.recording.plant, state, tangent)
            changed = float(euler_angles(turned[None, 6:10])[place][0]) - angles[place]
            row[6 + axis] = (np.remainder(changed + np.pi, 2 * np.pi) - np.pi) / h
        off = float(np.remainder(stated_angle - angles[place] + np.pi, 2 * np.pi) - np.pi)
        add(off, row, float(sigma_of(key, 1e-5)[0]))
    return np.array(residual), np.array(rows).reshape(-1, d)
