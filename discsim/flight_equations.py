"""Equations of motion of the disc in 12 states, (18)-(23), as the standalone model integrates them.

The 12 states are position and velocity in N, attitude, body rates. The paper writes them in the roll-pitch axes, which
follow the disc but not its spin, with lambda = beta + psi (23). Those axes are singular where the disc stands on edge
(pitch of 90 deg). Here S takes their place: axes with z = z_B that never turn about z_B, so their rate is (P, Q, 0). S
is carried as a quaternion and the spin angle psi as a state of its own, ``C_BS = C3(psi)``; the angle of the relative
wind in S is what lambda is in roll-pitch axes. No attitude is singular, and Euler angles in the paper's order are
given on output. An axisymmetric disc needs no psi, so its spin does not limit the step; its nutation at r Izz/Ixx
stays. With an off-centre mass or unequal inertia psi enters, and the steps follow the spin.
"""

from __future__ import annotations

from math import cos, sin
from typing import Any

import numpy as np

from discsim.aerodynamics import total_wrench, wind
from discsim.arrays import FloatArray
from discsim.compiled import compiled, compiled_nogil, inlined
from discsim.effects.body import centre_of_mass, transverse_inertia
from discsim.effects.events import impulse, spin_step
from discsim.frames import heading_angles, rotate_by_quaternion
from discsim.parameters import PARAMETERS, Tables

__all__ = ["WIDTH", "body_row", "copied", "derivative", "in_body", "incidence"]

#: places of the state: position and velocity in N, quaternion of S, rates P, Q (in S) and r, spin angle psi
WIDTH = 14


@inlined
def copied(state: FloatArray, to: FloatArray) -> None:
    """Write a state (14,) into another.

    For ``to[:] = state`` the compiler writes the text of an error that cannot be, which takes it seconds.
    """
    for i in range(WIDTH):
        to[i] = state[i]


@inlined
def derivative(p: Any, tables: Tables, t: float, y: FloatArray, dy: FloatArray) -> None:
    """Write the time derivative of the state y (14,) into dy (14,): (18), (19), (22), (23).

    (18) is written with m (dV/dt - g) for F, against the paper's sign of g. (22) takes the form of the quaternion of
    S, whose rate is (P, Q, 0), and psi' = r.
    """
    qw, qx, qy, qz = y[6], y[7], y[8], y[9]
    P, Q, r = y[10], y[11], y[12]
    c, s = 1.0, 0.0
    imbalance, asymmetry = p.body_mass_imbalance, p.body_inertia_asymmetry
    if imbalance.ex_m != 0.0 or imbalance.ey_m != 0.0 or asymmetry.dIyy_kg_m2 != 0.0:
        c, s = cos(y[13]), sin(y[13])

    h = -y[2]
    wn, we, wd = wind(p, tables, t, y[0], y[1], h)
    u, v, w = rotate_by_quaternion(qw, -qx, -qy, -qz, y[3] - wn, y[4] - we, y[5] - wd)
    Fx, Fy, Fz, Mx, My, Mz = total_wrench(p, tables, t, h, u, v, w, P, Q, r)

    # from the geometric centre to the centre of mass, whose place e turns with psi: M - e x F
    ex_B, ey_B, _ = centre_of_mass(p.body_mass_imbalance)
    ex, ey = c * ex_B - s * ey_B, s * ex_B + c * ey_B
    Mx, My, Mz = Mx - ey * Fz, My + ex * Fz, Mz - (ex * Fy - ey * Fx)

    # (18): m dV/dt = m g + F
    Fn, Fe, Fd = rotate_by_quaternion(qw, qx, qy, qz, Fx, Fy, Fz)
    an, ae, ad = impulse(p.event_impulse, t)
    m = p.disc.mass
    dy[0], dy[1], dy[2] = y[3], y[4], y[5]
    dy[3] = Fn / m + an
    dy[4] = Fe / m + ae
    dy[5] = Fd / m + ad + p.environment.gravity

    # (19) in B: I dw/dt = M - w x I w
    Ixx, Izz = p.disc.Ixx, p.disc.Izz
    Iyy = transverse_inertia(p.body_inertia_asymmetry, Ixx)
    p_B, q_B = c * P + s * Q, c * Q - s * P
    dp = (c * Mx + s * My - (Izz - Iyy) * q_B * r) / Ixx
    dq = (c * My - s * Mx - (Ixx - Izz) * r * p_B) / Iyy
    dr = (Mz - (Iyy - Ixx) * p_B * q_B) / Izz + spin_step(p.event_spin_step, t, r)
    # and back into S, against which B turns at r
    dy[10] = c * dp - s * dq - r * Q
    dy[11] = s * dp + c * dq + r * P
    dy[12] = dr

    # (22)
    dy[6] = -0.5 * (qx * P + qy * Q)
    dy[7] = 0.5 * (qw * P - qz * Q)
    dy[8] = 0.5 * (qw * Q + qz * P)
    dy[9] = 0.5 * (qx * Q - qy * P)
    dy[13] = r


@inlined
def body_row(y: FloatArray, dy: FloatArray, row: FloatArray) -> None:
    """Write a state (14,) and its derivative as a row of motion (19,), as `in_body` gives them."""
    for i in range(6):
        row[i] = y[i]
    for i in range(3):
        row[6 + i] = dy[3 + i]
    # C_NB = C_NS C3(psi)^T
    c, s = cos(0.5 * y[13]), sin(0.5 * y[13])
    row[9], row[10] = y[6] * c - y[9] * s, y[7] * c + y[8] * s
    row[11], row[12] = y[8] * c - y[7] * s, y[9] * c + y[6] * s
    c, s, r = cos(y[13]), sin(y[13]), y[12]
    p_B, q_B = c * y[10] + s * y[11], c * y[11] - s * y[10]
    row[13], row[14], row[15] = p_B, q_B, r
    row[16] = c * dy[10] + s * dy[11] + r * q_B
    row[17] = c * dy[11] - s * dy[10] - r * p_B
    row[18] = dy[12]


@compiled_nogil
def in_body(flat: FloatArray, tables: Tables, t: FloatArray, states: FloatArray) -> FloatArray:
    """Return motion (m, 19) of states (m, 14): position to acceleration in N, attitude, body rates and theirs in B."""
    p = flat.view(PARAMETERS)[0]
    rows, dy = np.empty((t.size, 19)), np.empty(WIDTH)
    for k in range(t.size):
        derivative(p, tables, t[k], states[k], dy)
        body_row(states[k], dy, rows[k])
    return rows


@compiled
def incidence(p: Any, tables: Tables, t: float, y: FloatArray) -> float:
    """Angle of attack at a state (14,), rad."""
    wn, we, wd = wind(p, tables, t, y[0], y[1], -y[2])
    u, v, w = rotate_by_quaternion(y[6], -y[7], -y[8], -y[9], y[3] - wn, y[4] - we, y[5] - wd)
    return float(heading_angles(u, v, w)[2])
