"""From the relative wind to the force and moment on the disc, (14)-(17), (20), (21): called by both engines.

Everything here is compiled and works in any frame F whose z axis is z_B: body axes in MuJoCo, roll-pitch axes in the
12-state model. ``p`` is the record of `discsim.parameters.PARAMETERS`.

One departure from the paper, fixed by docs/physics.md: V is the velocity relative to the air, not to the ground. alpha
is that of the H frame (A2). (21) prints the transpose of C2(-alpha), which is the C2(alpha) of (23).
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled, inlined
from discsim.effects.aero import (
    spin_drag,
    spin_lift,
    spin_pitching_moment,
    spin_side_force,
    stall,
    yaw_alpha,
    yaw_quadratic,
    yaw_reynolds,
)
from discsim.effects.air import ground_effect, gust, wind_shear
from discsim.errors import InputError
from discsim.frames import heading_angles, norm3
from discsim.law import law_wind, law_wrench
from discsim.own_wrench import own_wrench
from discsim.parameters import Tables

__all__ = ["advance_ratio", "air_wrench", "outside_table", "total_wrench", "wind"]

#: below this airspeed (m/s) the air does nothing; d/(2 V) would lose its meaning
STILL_AIR = 1e-6


@compiled
def advance_ratio(d: float, r: float, V: float) -> float:
    """gamma = d r/(2 V), Eq. (15): rim speed over airspeed; positive for r > 0."""
    return d * r / (2.0 * V)


@compiled
def wind(p: Any, tables: Tables, t: float, north: float, east: float, h: float) -> tuple[float, float, float]:
    """Wind in N (m/s) at time t s, a place and height h, m: the known one, and what a baseline leaves out of it."""
    shear, peak = wind_shear(p.air_wind_shear, h), gust(p.air_gust, t)
    wn = p.air_wind.w_north_m_s + shear * p.air_wind_shear.w_north_m_s + peak * p.air_gust.w_north_m_s
    we = p.air_wind.w_east_m_s + shear * p.air_wind_shear.w_east_m_s + peak * p.air_gust.w_east_m_s
    e = p.environment
    wn, we, wd = e.wind_north + wn, e.wind_east + we, e.wind_down
    if tables.law.shape[0] > 0:
        ln, le, ld = law_wind(tables.law, t, h, north, east)
        wn, we, wd = wn + ln, we + le, wd + ld
    return wn, we, wd


@compiled
def _cell(x: float, nodes: FloatArray) -> int:
    """Index of the cell between ascending nodes that holds x; the first or the last where x lies outside."""
    low, high = 0, nodes.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if nodes[middle] <= x:
            low = middle
        else:
            high = middle
    return low


@compiled
def _interpolate(x: float, nodes: FloatArray, values: FloatArray) -> float:
    """Linear between nodes, constant outside."""
    k = _cell(x, nodes)
    share = min(max((x - nodes[k]) / (nodes[k + 1] - nodes[k]), 0.0), 1.0)
    return float(values[k] + (values[k + 1] - values[k]) * share)


# these three are compiled into their caller: to hand them the tables would cost more than all of the air's arithmetic


@inlined
def static_coefficients(p: Any, tables: Tables, alpha: float) -> tuple[float, float, float]:
    """C_L, C_D, C_M of a disc that does not spin: linear and quadratic forms, or the table in their place."""
    columns = tables.static.columns
    if columns.shape[1] > 0:
        nodes = columns[0]
        return (
            _interpolate(alpha, nodes, columns[1]),
            _interpolate(alpha, nodes, columns[2]),
            _interpolate(alpha, nodes, columns[3]),
        )
    a = p.aero
    return a.CL0 + a.CLa * alpha, a.CD0 + a.CDa * (alpha - a.alpha0) ** 2, a.CM0 + a.CMa * alpha


@inlined
def rolling_coefficient(p: Any, tables: Tables, alpha: float, gamma: float, roll: float) -> float:
    """C_R = C_Rr(alpha, gamma) + C_Rp(alpha) roll, Eq. (16), roll being p_H d/(2 V): derivatives, or tables."""
    lookup = tables.static.rolling
    angles = lookup[0, 1:]
    if angles.size == 0:
        return float(p.aero.CRr * gamma + p.aero.CRp * roll)
    CRp = p.aero.CRp if np.isnan(lookup[1, 1]) else _interpolate(alpha, angles, lookup[1, 1:])
    if lookup.shape[0] == 2:
        return float(p.aero.CRr * gamma + CRp * roll)
    ratios = lookup[2:, 0]
    j = _cell(abs(gamma), ratios)
    share = min((abs(gamma) - ratios[j]) / (ratios[j + 1] - ratios[j]), 1.0)
    low, high = _interpolate(alpha, angles, lookup[2 + j, 1:]), _interpolate(alpha, angles, lookup[3 + j, 1:])
    CR = low + (high - low) * share
    return float((CR if gamma >= 0.0 else -CR) + CRp * roll)


@inlined
def yaw_damping(p: Any, tables: Tables, r: float, V: float) -> float:
    """CNr, a constant or the spline of the (r, V) table (28); NaN outside the table."""
    if tables.rate.size == 0:
        return float(p.aero.CNr)
    rate = abs(r)
    nr, nv = tables.rate.size, tables.speed.size
    if rate < tables.rate[0] or rate > tables.rate[nr - 1] or V < tables.speed[0] or V > tables.speed[nv - 1]:
        return np.nan
    i, j = _cell(rate, tables.rate), _cell(V, tables.speed)
    x, y = rate - tables.rate[i], V - tables.speed[j]
    c = tables.spline[i, j]
    value = 0.0
    for m in range(4):
        row = ((c[m, 0] * y + c[m, 1]) * y + c[m, 2]) * y + c[m, 3]
        value = value * x + row
    return value


def outside_table(tables: Tables, t: float, r: float, V: float) -> InputError:
    """Return the error of a flight that leaves its C_Nr table: time s, spin rate rad/s, airspeed m/s."""
    rate = np.degrees(tables.rate)
    return InputError(
        f"at {t:.3f} s the disc spins at {np.degrees(abs(r)):.0f} deg/s and flies at {V:.1f} m/s through the air, "
        f"outside its C_Nr table; expected {rate[0]:.0f} to {rate[-1]:.0f} deg/s and "
        f"{tables.speed[0]:g} to {tables.speed[-1]:g} m/s"
    )


@inlined
def air_wrench(
    p: Any, tables: Tables, h: float, u: float, v: float, w: float, P: float, Q: float, r: float
) -> tuple[float, float, float, float, float, float]:
    """Force (N) and moment (N m) of the air about the geometric centre, in the frame F of the arguments.

    h is the height in m; u, v, w the velocity relative to the air, m/s; P, Q, r the body's angular velocity, rad/s.
    The moment is NaN where a C_Nr table does not reach.
    """
    V = norm3(u, v, w)
    if V < STILL_AIR:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    d = p.disc.d
    A = pi * d * d / 4.0
    cos_beta, sin_beta, alpha = heading_angles(u, v, w)
    p_H, q_H = cos_beta * P + sin_beta * Q, cos_beta * Q - sin_beta * P
    gamma = advance_ratio(d, r, V)
    damping = d / (2.0 * V)

    CL, CD, CM = static_coefficients(p, tables, alpha)
    CL += spin_lift(p.aero_spin_lift, gamma) + stall(p.aero_stall, p.aero.CLa, alpha)
    CL *= ground_effect(p.air_ground_effect, h, d)
    CD += spin_drag(p.aero_spin_drag, gamma)
    CM += p.aero.CMq * q_H * damping + spin_pitching_moment(p.aero_spin_pitching_moment, gamma)
    CY = spin_side_force(p.aero_spin_side_force, gamma)
    CR = rolling_coefficient(p, tables, alpha, gamma, p_H * damping)
    CN = yaw_damping(p, tables, r, V) * yaw_reynolds(p.aero_yaw_reynolds, V) * gamma  # (17)
    CN += yaw_quadratic(p.aero_yaw_quadratic, gamma) + yaw_alpha(p.aero_yaw_alpha, gamma, alpha)

    QA = 0.5 * p.air_density.ratio * p.environment.air_density * V * V * A
    L, D, Y = QA * CL, QA * CD, QA * CY  # (14)
    R, M, N = QA * d * CR, QA * d * CM, QA * d * CN

    # F_H = C2(alpha) [-D, Y, -L], M_H = C2(alpha) [R, M, 0] + [0, 0, N]: (20), (21), (23)
    cos_alpha, sin_alpha = (cos_beta * u + sin_beta * v) / V, w / V
    Fx, Fy, Fz = -D * cos_alpha + L * sin_alpha, Y, -D * sin_alpha - L * cos_alpha
    Mx, My, Mz = R * cos_alpha, M, R * sin_alpha + N
    return (
        cos_beta * Fx - sin_beta * Fy,
        sin_beta * Fx + cos_beta * Fy,
        Fz,
        cos_beta * Mx - sin_beta * My,
        sin_beta * Mx + cos_beta * My,
        Mz,
    )


@inlined
def total_wrench(
    p: Any, tables: Tables, t: float, h: float, u: float, v: float, w: float, P: float, Q: float, r: float
) -> tuple[float, float, float, float, float, float]:
    """Force (N) and moment (N m) of the air, of laws and of effects that are called, at time t; as for `air_wrench`."""
    Fx, Fy, Fz, Mx, My, Mz = air_wrench(p, tables, h, u, v, w, P, Q, r)
    if tables.law.shape[0] > 0:
        Lx, Ly, Lz, Kx, Ky, Kz, share = law_wrench(tables.law, t, h, u, v, w, P, Q, r)
        s = 1.0 + share
        Fx, Fy, Fz, Mx, My, Mz = s * Fx + Lx, s * Fy + Ly, s * Fz + Lz, s * Mx + Kx, s * My + Ky, s * Mz + Kz
    if tables.own_calls.size > 0:
        Lx, Ly, Lz, Kx, Ky, Kz = own_wrench(tables.own_calls, tables.own_sizes, t, h, u, v, w, P, Q, r)
        Fx, Fy, Fz, Mx, My, Mz = Fx + Lx, Fy + Ly, Fz + Lz, Mx + Kx, My + Ky, Mz + Kz
    return Fx, Fy, Fz, Mx, My, Mz
