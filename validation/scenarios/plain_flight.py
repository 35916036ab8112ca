"""A flight by the paper's equations as they stand, in plain numpy: it shares no code of the air with the engines.

Coefficients, rotations and equations of motion are written a second time, with matrices and Euler angles in B, so that
a slip in the compiled air, which both engines call, is one against this.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from discsim.arrays import FloatArray
from discsim.disc import Disc, Release
from discsim.environment import Environment

__all__ = ["plain_landing"]

#: relative error of a step: touch-downs of the shipped discs are then within 4e-6 m of those at 1e-10
_RTOL = 1e-8


def plain_landing(disc: Disc, environment: Environment, release: Release, duration: float = 30.0) -> FloatArray:
    """Return place and time (4,) m and s of touch-down; NaN where a flight does not land in ``duration`` s.

    The disc has constant coefficients, or static ones tabulated over alpha; tables of rolling and yaw damping are not
    known here. Release as of a throw: position, velocity, roll, pitch, yaw and body rate.
    """
    if disc.aero is None or disc.rolling_table is not None or disc.yaw_damping_table is not None:
        raise ValueError("a plain flight needs [disc.aero], and knows no CR_table nor CNr_table")
    position, velocity, _, rate = release.start()
    angles = [release.roll or 0.0, release.pitch or 0.0, release.yaw or 0.0]
    start = np.concatenate([position, velocity, angles, rate])

    def height(_: float, y: FloatArray) -> float:
        return float(y[2])

    height.terminal = True  # type: ignore[attr-defined]
    flown = solve_ivp(
        lambda _, y: _derivative(disc, environment, y), (0.0, duration), start, "DOP853", events=height, rtol=_RTOL,
        atol=1e-8,
    )  # fmt: skip
    assert flown.t_events is not None
    assert flown.y_events is not None
    if not flown.t_events[0].size:
        return np.full(4, np.nan)
    return np.append(flown.y_events[0][0][:3], flown.t_events[0][0])


def _derivative(disc: Disc, environment: Environment, y: FloatArray) -> FloatArray:
    """Return d/dt of position, velocity in N, roll, pitch, yaw and p, q, r: (18), (22), (19)."""
    V_N, (phi, theta, psi), rate = y[3:6], y[6:9], y[9:12]
    C_BN = _about_z(psi) @ _about_y(theta) @ _about_x(phi)  # (A1)
    force, moment = _air(disc, environment, C_BN @ (V_N - environment.wind), rate)
    acceleration = C_BN.T @ force / disc.mass + np.array([0.0, 0.0, environment.gravity])  # (18), g's sign mended
    # (22): w = [0, 0, psi'] + C3(psi) ([0, theta', 0] + C2(theta) [phi', 0, 0])
    columns = [
        _about_z(psi) @ _about_y(theta) @ np.array([1.0, 0.0, 0.0]),
        _about_z(psi) @ np.array([0.0, 1.0, 0.0]),
        np.array([0.0, 0.0, 1.0]),
    ]
    turning = np.linalg.solve(np.column_stack(columns), rate)
    inertia = np.array([disc.Ixx, disc.Ixx, disc.Izz])
    return np.concatenate([V_N, acceleration, turning, (moment - np.cross(rate, inertia * rate)) / inertia])  # (19)


def _air(disc: Disc, environment: Environment, wind: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return force and moment (3,) in B from the velocity relative to the air in B, (14) to (17), (20), (23), (A2)."""
    a, d = disc.aero, disc.diameter
    assert a is not None
    assert environment.air_density is not None
    V = float(np.linalg.norm(wind))
    into_H = _about_z(np.arctan2(wind[1], wind[0]))
    u, _, w = into_H @ wind
    alpha, (p, q, r) = np.arctan2(w, u), into_H @ rate
    gamma = d * r / (2 * V)
    if disc.aero_table is None:
        CL, CD, CM = a.CL0 + a.CLa * alpha, a.CD0 + a.CDa * (alpha - a.alpha0) ** 2, a.CM0 + a.CMa * alpha
    else:
        known = disc.aero_table
        CL, CD, CM = (np.interp(alpha, known.alpha, column) for column in (known.CL, known.CD, known.CM))
    CM += a.CMq * q * d / (2 * V)
    CR = a.CRr * gamma + a.CRp * p * d / (2 * V)
    push = environment.air_density * V**2 / 2 * np.pi * d**2 / 4
    out_of_W = into_H.T @ _about_y(alpha)
    force = out_of_W @ (push * np.array([-CD, 0.0, -CL]))
    moment = out_of_W @ (push * d * np.array([CR, CM, 0.0])) + np.array([0.0, 0.0, push * d * a.CNr * gamma])
    return force, moment


def _about_x(a: float) -> FloatArray:
    return np.array([[1.0, 0.0, 0.0], [0.0, np.cos(a), np.sin(a)], [0.0, -np.sin(a), np.cos(a)]])


def _about_y(a: float) -> FloatArray:
    return np.array([[np.cos(a), 0.0, -np.sin(a)], [0.0, 1.0, 0.0], [np.sin(a), 0.0, np.cos(a)]])


def _about_z(a: float) -> FloatArray:
    return np.array([[np.cos(a), np.sin(a), 0.0], [-np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
