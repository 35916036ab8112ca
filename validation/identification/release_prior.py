"""What a recording states of its release, as rows of a Gaussian prior upon the first state (maximum a posteriori)."""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.frames import euler_angles
from discsim.validation.identification.segments import Trajectory

__all__ = []


def release_rows(current: Trajectory) -> tuple[FloatArray, FloatArray]:
    """Return what a recording states of its release: residuals (m,) in sigmas and rows (m, d) upon the first state."""
    release, layout, d = current.recording.release, current.plant.layout, current.plant.layout.directions
    if release is None or layout.attitude is None or layout.rate is None:
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
    for stated, places, key in (
        (release.position, layout.position, "position_ned_m"),
        (release.velocity, layout.velocity, "velocity_ned_m_s"),
        (release.body_rate, layout.rate, "body_rate_rad_s"),
    ):
        if stated is not None and places is not None:
            for axis, direction in enumerate(layout.directions_of(places)):
                add(stated[axis] - state[places][axis], unit[direction], sigma_of(key, 1e-4)[axis])
    angles = np.array([float(a[0]) for a in euler_angles(state[None, layout.attitude])])
    turns = layout.directions_of(layout.attitude)
    h = 1e-6
    for place, (stated_angle, key) in enumerate(
        ((release.roll, "roll_rad"), (release.pitch, "pitch_rad"), (release.yaw, "yaw_rad"))
    ):
        if stated_angle is None:
            continue
        row = np.zeros(d)
        for axis in range(3):
            tangent = np.zeros(d)
            tangent[turns[axis]] = h
            turned = layout.moved(state, tangent)
            changed = float(euler_angles(turned[None, layout.attitude])[place][0]) - angles[place]
            row[turns[axis]] = (np.remainder(changed + np.pi, 2 * np.pi) - np.pi) / h
        off = float(np.remainder(stated_angle - angles[place] + np.pi, 2 * np.pi) - np.pi)
        add(off, row, float(sigma_of(key, 1e-5)[0]))
    return np.array(residual), np.array(rows).reshape(-1, d)
