"""The standalone model of 12 states, (18)-(23): the same physics as the MuJoCo truth, another integrator.

The 12 states are position and velocity in N, attitude, body rates. The paper writes them in the roll-pitch axes, which
follow the disc but not its spin, with lambda = beta + psi (23). Those axes are singular where the disc stands on edge
(pitch of 90 deg). Here S takes their place: axes with z = z_B that never turn about z_B, so their rate is (P, Q, 0). S
is carried as a quaternion and the spin angle psi as a state of its own, ``C_BS = C3(psi)``; the angle of the relative
wind in S is what lambda is in roll-pitch axes. No attitude is singular, and Euler angles in the paper's order are
given on output. An axisymmetric disc needs no psi, so its spin does not limit the step; its nutation at r Izz/Ixx
stays. With an off-centre mass or unequal inertia psi enters, and the steps follow the spin.

The integrator is Dormand and Prince's explicit Runge-Kutta pair of order 8(5,3) with dense output of order 7
(Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.5 and II.6), compiled.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import cos, nan, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import DOP853

from discsim.aerodynamics import outside_table, total_wrench, wind
from discsim.arrays import FloatArray, readonly
from discsim.compiled import compiled, compiled_nogil, inlined
from discsim.disc import Disc, Release
from discsim.effects.body import centre_of_mass, transverse_inertia
from discsim.effects.catalogue import Effect
from discsim.effects.events import EVENT_WIDTH_S, impulse, spin_step
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.frames import euler_angles, heading_angles, norm3, quaternion_from_matrix, rotate_by_quaternion
from discsim.law import Law
from discsim.limits import FASTEST_SPIN
from discsim.motion import Motion, State
from discsim.parameters import PARAMETERS, Tables, flight_parameters, tables

__all__ = ["ATOL", "RTOL", "Flight", "Landings", "evaluate", "integrate", "predict", "predict_many", "release_state"]

#: places of the state: position and velocity in N, quaternion of S, rates P, Q (in S) and r, spin angle psi
WIDTH = 14
#: default tolerances; docs/trajectory.md says what they are worth
RTOL, ATOL = 1e-8, 1e-8

# coefficients of the pair, as scipy publishes them
_A, _B, _C = np.array(DOP853.A), np.array(DOP853.B), np.array(DOP853.C)
_E3, _E5, _D = np.array(DOP853.E3), np.array(DOP853.E5), np.array(DOP853.D)
_A_EXTRA, _C_EXTRA = np.array(DOP853.A_EXTRA), np.array(DOP853.C_EXTRA)
_STAGES, _EXTENDED, _POWER = 12, 16, 7
_NOTHING = np.zeros(WIDTH)

#: a step this short (s) is taken whatever its error: what is left is a jump of the force, which no step resolves
SHORTEST_STEP = 1e-7
#: nothing in a flight is this fast (s) but a jump that is met again and again: wind along the axis, kept there by the
#: air, has a direction that turns ever faster. Steps below may be short for a while only: the least that is taken
#: whatever its error grows with the time spent, until a long one is taken again, so that a flight ends
CHATTER_STEP, CHATTER_SHARE, CHATTER_END = 1e-4, 1.0 / 32.0, 2e-3
#: a step ends on a kink of the coefficients within this angle of attack, rad: times any slope it is no force
AT_NODE = 1e-7
#: tries to end a step on a kink, and points within a step that tell where its angle of attack turns
KINK_TRIES, KINK_SAMPLES = 8, 5
FIRST_STEP = 5e-3
#: pulses are entered this many widths before their peak: 2e-9 of their area lies outside
PULSE_REACH = 6.0
#: how a flight ended
_LEFT, _TOUCHED, _LOST = 0, 1, 2


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
    wn, we, wd = wind(p, t, h)
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
def _combine(y: FloatArray, h: float, weights: FloatArray, K: FloatArray, stages: int, out: FloatArray) -> None:
    """Write y + h (weights K) into out (14,), of the first stages; weights (16,) or less, K (16, 14).

    One name for each sum, for a loop over the state would go through memory in every one of the 12 stages: that took
    a fifth of a flight's time.
    """
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = s8 = s9 = s10 = s11 = s12 = s13 = 0.0
    for j in range(stages):
        a, k = weights[j], K[j]
        if a == 0.0:
            continue
        s0 += a * k[0]
        s1 += a * k[1]
        s2 += a * k[2]
        s3 += a * k[3]
        s4 += a * k[4]
        s5 += a * k[5]
        s6 += a * k[6]
        s7 += a * k[7]
        s8 += a * k[8]
        s9 += a * k[9]
        s10 += a * k[10]
        s11 += a * k[11]
        s12 += a * k[12]
        s13 += a * k[13]
    out[0] = y[0] + h * s0
    out[1] = y[1] + h * s1
    out[2] = y[2] + h * s2
    out[3] = y[3] + h * s3
    out[4] = y[4] + h * s4
    out[5] = y[5] + h * s5
    out[6] = y[6] + h * s6
    out[7] = y[7] + h * s7
    out[8] = y[8] + h * s8
    out[9] = y[9] + h * s9
    out[10] = y[10] + h * s10
    out[11] = y[11] + h * s11
    out[12] = y[12] + h * s12
    out[13] = y[13] + h * s13


@inlined
def step(p: Any, tables: Tables, t: float, y: FloatArray, h: float, K: FloatArray, new: FloatArray) -> None:
    """One step of order 8 from y (14,) to new (14,); K (16, 14) holds the first stage on entry and 12 on return."""
    for stage in range(1, _STAGES):
        _combine(y, h, _A[stage], K, stage, new)
        derivative(p, tables, t + _C[stage] * h, new, K[stage])
    _combine(y, h, _B, K, _STAGES, new)
    # the attitude stays a rotation
    length = sqrt(new[6] ** 2 + new[7] ** 2 + new[8] ** 2 + new[9] ** 2)
    for i in range(6, 10):
        new[i] /= length


@inlined
def _error(h: float, K: FloatArray, y: FloatArray, rtol: float, atol: float, work: FloatArray) -> float:
    """Estimated error of a step in units of the tolerance, root mean square over the state; K holds 13 stages.

    Velocity, attitude (one) and rates count by their size as vectors, so the steps do not depend on where north is;
    position and spin angle, whose origins mean nothing, count by atol alone.
    """
    velocity = atol + rtol * norm3(y[3], y[4], y[5])
    rate = atol + rtol * norm3(y[10], y[11], y[12])
    fifth, third = work[0], work[1]
    _combine(_NOTHING, 1.0, _E5, K, _STAGES, fifth)
    _combine(_NOTHING, 1.0, _E3, K, _STAGES, third)
    e5 = _size(fifth, atol, velocity, atol + rtol, rate)
    e3 = _size(third, atol, velocity, atol + rtol, rate)
    if e5 == 0.0 and e3 == 0.0:
        return 0.0
    return float(h * e5 / sqrt((e5 + 0.01 * e3) * WIDTH))


@inlined
def _size(e: FloatArray, position: float, velocity: float, attitude: float, rate: float) -> float:
    """Sum of squares of a change of state (14,), each part in units of its own tolerance."""
    return float(
        (e[0] ** 2 + e[1] ** 2 + e[2] ** 2 + e[13] ** 2) / position**2
        + (e[3] ** 2 + e[4] ** 2 + e[5] ** 2) / velocity**2
        + (e[6] ** 2 + e[7] ** 2 + e[8] ** 2 + e[9] ** 2) / attitude**2
        + (e[10] ** 2 + e[11] ** 2 + e[12] ** 2) / rate**2
    )


@inlined
def interpolant(
    p: Any, tables: Tables, t: float, y: FloatArray, h: float, K: FloatArray, new: FloatArray, F: FloatArray
) -> None:
    """Write the dense output of a step into F (7, 14); K (16, 14) holds 13 stages."""
    work = F[0]
    for extra in range(_EXTENDED - _STAGES - 1):
        stage = _STAGES + 1 + extra
        _combine(y, h, _A_EXTRA[extra], K, stage, work)
        derivative(p, tables, t + _C_EXTRA[extra] * h, work, K[stage])
    for i in range(WIDTH):
        change = new[i] - y[i]
        F[0, i] = change
        F[1, i] = h * K[0, i] - change
        F[2, i] = 2.0 * change - h * (K[_STAGES, i] + K[0, i])
    for row in range(_POWER - 3):
        _combine(_NOTHING, h, _D[row], K, _EXTENDED, F[3 + row])


@compiled
def _within(F: FloatArray, y: FloatArray, x: float, i: int) -> float:
    """Component i of the dense output at the share x of a step that starts from y."""
    value = 0.0
    for row in range(_POWER):
        value += F[_POWER - 1 - row, i]
        value *= x if row % 2 == 0 else 1.0 - x
    return float(y[i] + value)


@compiled
def _up_to_pulse(t: float, h: float, t_s: float, width: float) -> float:
    """Cut a step so that a pulse is entered at its edge and crossed in steps no longer than its width."""
    width = max(abs(width), 1e-4)
    start, end = t_s - PULSE_REACH * width, t_s + PULSE_REACH * width
    if t < start - 1e-9:
        return min(h, start - t)
    return min(h, width) if t < end else h


@compiled
def _up_to_events(p: Any, t: float, h: float) -> float:
    """Cut a step so that no event is stepped over: its pulse would be missed by all stages of a long step."""
    push, kick, gust = p.event_impulse, p.event_spin_step, p.air_gust
    if push.dv_north_m_s != 0.0 or push.dv_east_m_s != 0.0 or push.dv_down_m_s != 0.0:
        h = _up_to_pulse(t, h, push.t_s, EVENT_WIDTH_S)
    if kick.dr_rad_s != 0.0:
        h = _up_to_pulse(t, h, kick.t_s, EVENT_WIDTH_S)
    if gust.w_north_m_s != 0.0 or gust.w_east_m_s != 0.0:
        h = _up_to_pulse(t, h, gust.t_s, gust.width_s)
    return h


@compiled
def _land(
    p: Any, tables: Tables, t: float, y: FloatArray, h: float, K: FloatArray, new: FloatArray, work: FloatArray
) -> float:
    """Return the length of the step from y, at most h, that ends on the ground; new (14,) is the state there.

    Whole steps are repeated, Newton's method kept within a bracket, so touch-down is as exact as the steps are.
    """
    low, high = 0.0, h
    trial = h * y[2] / (y[2] - new[2])
    for _ in range(60):
        step(p, tables, t, y, trial, K, work)
        if work[2] < 0.0:
            low = trial
        else:
            high = trial
        correction = -work[2] / work[5] if work[5] != 0.0 else nan
        if abs(correction) < 1e-13 or high - low < 1e-13:
            break
        trial = trial + correction if low < trial + correction < high else 0.5 * (low + high)
    new[:] = work
    return float(trial)


@compiled
def _incidence(p: Any, t: float, y: FloatArray) -> float:
    """Angle of attack at a state (14,), rad."""
    wn, we, wd = wind(p, t, -y[2])
    u, v, w = rotate_by_quaternion(y[6], -y[7], -y[8], -y[9], y[3] - wn, y[4] - we, y[5] - wd)
    return float(heading_angles(u, v, w)[2])


@compiled
def _between(node: float, start: float, end: float) -> bool:
    """Whether a node lies between two angles of attack, and not at either of them."""
    return min(start, end) + AT_NODE < node < max(start, end) - AT_NODE


@compiled
def _kink(p: Any, tables: Tables, start: float, end: float) -> float:
    """Angle of attack, the first one after start, at which the coefficients have a kink before end; NaN: nowhere."""
    nearest = np.nan
    for nodes in (tables.static.columns[0], tables.static.rolling[0, 1:]):
        for node in nodes:
            if _between(node, start, end) and not abs(node - start) >= abs(nearest - start):
                nearest = node
    node = p.aero_stall.alpha_stall_rad
    if p.aero_stall.k != 0.0 and _between(node, start, end) and not abs(node - start) >= abs(nearest - start):
        nearest = node
    return float(nearest)


@compiled
def _incidence_within(
    p: Any, t: float, y: FloatArray, h: float, F: FloatArray, share: float, work: FloatArray
) -> float:
    """Angle of attack at a share of a step by its dense output, rad."""
    for i in range(2, 10):
        work[i] = _within(F, y, share, i)
    return _incidence(p, t + share * h, work)


@compiled
def _share_up_to(
    p: Any,
    t: float,
    y: FloatArray,
    h: float,
    F: FloatArray,
    node: float,
    low: float,
    start: float,
    high: float,
    end: float,
    work: FloatArray,
) -> float:
    """Share of a step, between low and high, at which the angle of attack, from start to end, passes a node.

    Regula falsi after Illinois: it keeps its bracket, and converges faster than linearly.
    """
    below, above = start - node, end - node
    share, side = high, 0
    for _ in range(30):
        share = (low * above - high * below) / (above - below)
        miss = _incidence_within(p, t, y, h, F, share, work) - node
        if abs(miss) < 0.1 * AT_NODE:
            break
        if (miss > 0.0) == (above > 0.0):
            high, above = share, miss
            below *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, below = share, miss
            above *= 0.5 if side == -1 else 1.0
            side = -1
    return share


@compiled
def _share_to_kink(
    p: Any, tables: Tables, t: float, y: FloatArray, h: float, F: FloatArray, start: float, end: float, work: FloatArray
) -> float:
    """Share of a step, from angle of attack start to end, at which it first passes a kink; 1 where it passes none.

    The nutation takes the angle up and down within a step, so its extremes are looked at too: a parabola through
    three points of the dense output says where they are.
    """
    n = KINK_SAMPLES
    low, lower, before = 0.0, start, start
    here = _incidence_within(p, t, y, h, F, 1.0 / n, work)
    for k in range(1, n + 1):
        after = end
        if k < n - 1:
            after = _incidence_within(p, t, y, h, F, (k + 1.0) / n, work)
        if k < n and (here - before) * (after - here) < 0.0:
            top = (k + 0.5 * (before - after) / (before - 2.0 * here + after)) / n
            extreme = _incidence_within(p, t, y, h, F, top, work)
            node = _kink(p, tables, lower, extreme)
            if np.isfinite(node):
                return _share_up_to(p, t, y, h, F, node, low, lower, top, extreme, work)
            low, lower = top, extreme
        elif k == n:
            node = _kink(p, tables, lower, end)
            if np.isfinite(node):
                return _share_up_to(p, t, y, h, F, node, low, lower, 1.0, end, work)
        before, here = here, after
    return 1.0


@compiled
def _lowest(F: FloatArray, y: FloatArray) -> float:
    """Share of a step, falling at its start and rising at its end, at which the disc is lowest."""
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if _within(F, y, middle, 5) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@compiled_nogil
def integrate(
    flat: FloatArray,
    tables: Tables,
    state: FloatArray,
    t_start: float,
    t_end: float,
    rtol: float,
    atol: float,
    keep: bool,
) -> tuple[int, FloatArray, FloatArray, FloatArray]:
    """Fly from a state (14,) at t_start until the ground or t_end.

    Returns how it ended (0 at t_end, 1 on the ground, 2 where the physics gave no finite number, as outside a C_Nr
    table), the times (n,) of the steps, the states (n, 14), and the dense output (n - 1, 7, 14) for `evaluate`. Where
    ``keep`` is false only the first and the last state are returned, and no dense output.
    """
    p = flat.view(PARAMETERS)[0]
    size = 256 if keep else 2
    times, states = np.empty(size), np.empty((size, WIDTH))
    dense = np.empty((size if keep else 0, _POWER, WIDTH))
    K, F = np.empty((_EXTENDED, WIDTH)), np.empty((_POWER, WIDTH))
    y, new, work = state.copy(), np.empty(WIDTH), np.empty(WIDTH)
    t, h, n, ended = t_start, FIRST_STEP, 0, _LEFT
    tabulated = tables.static.columns.shape[1] > 0 or tables.static.rolling.shape[1] > 1
    kinked = tabulated or p.aero_stall.k != 0.0
    alpha, alpha_new, tries = 0.0, 0.0, 0
    shortest, chatter = SHORTEST_STEP, np.inf
    times[0], states[0] = t, y
    derivative(p, tables, t, y, K[0])
    if kinked:
        alpha = _incidence(p, t, y)
    wished = h
    while t < t_end:
        h = min(_up_to_events(p, t, h), t_end - t)
        whole = h >= t_end - t
        step(p, tables, t, y, h, K, new)
        derivative(p, tables, t + h, new, K[_STAGES])
        error = _error(h, K, y, rtol, atol, F)
        if not np.isfinite(error):
            if h <= SHORTEST_STEP:
                ended = _LOST
                break
            h = wished = max(0.2 * h, SHORTEST_STEP)
            continue
        if kinked:
            alpha_new = _incidence(p, t + h, new)
            if tries < KINK_TRIES and h > shortest:
                interpolant(p, tables, t, y, h, K, new, F)
                share = _share_to_kink(p, tables, t, y, h, F, alpha, alpha_new, work)
                if share < 1.0:
                    h = max(h * share, shortest)
                    tries += 1
                    continue
        if error > 1.0 and h > shortest:
            h = wished = max(h * max(0.2, 0.9 * error ** (-1.0 / 8.0)), shortest)
            continue
        tries = 0
        if h < CHATTER_STEP:
            chatter = min(chatter, t)
            shortest = min(max(CHATTER_SHARE * (t + h - chatter), SHORTEST_STEP), CHATTER_STEP)
        elif h > CHATTER_END:
            shortest, chatter = SHORTEST_STEP, np.inf

        if new[2] < 0.0 and y[5] > 0.0 > new[5]:
            # between its ends the step may touch the ground and leave it
            interpolant(p, tables, t, y, h, K, new, F)
            share = _lowest(F, y)
            if _within(F, y, share, 2) >= 0.0:
                h *= share
                step(p, tables, t, y, h, K, new)
        if new[2] >= 0.0:
            h = _land(p, tables, t, y, h, K, new, work)
            derivative(p, tables, t + h, new, K[_STAGES])
            ended = _TOUCHED

        if keep:
            if n + 2 > times.size:
                more = 2 * times.size
                longer_times, longer_states = np.empty(more), np.empty((more, WIDTH))
                longer_dense = np.empty((more, _POWER, WIDTH))
                longer_times[: n + 1], longer_states[: n + 1] = times[: n + 1], states[: n + 1]
                longer_dense[:n] = dense[:n]
                times, states, dense = longer_times, longer_states, longer_dense
            interpolant(p, tables, t, y, h, K, new, dense[n])
            n += 1
        else:
            n = 1
        t = t_end if whole and ended == _LEFT else t + h
        times[n], states[n] = t, new
        if ended == _TOUCHED:
            break
        y[:] = new
        K[0] = K[_STAGES]
        alpha = alpha_new
        grown = max(h * min(5.0, 0.9 * error ** (-1.0 / 8.0)), shortest) if error > 0.0 else 5.0 * h
        # a step cut short for an event or a kink says little about the next one
        h = wished = max(grown, wished) if h < wished else grown
    return ended, times[: n + 1].copy(), states[: n + 1].copy(), dense[: n if keep else 0].copy()


@compiled_nogil
def evaluate(times: FloatArray, states: FloatArray, dense: FloatArray, t: FloatArray) -> FloatArray:
    """Return the state (m, 14) at instants t (m,) by dense output; NaN outside the flight."""
    result = np.full((t.size, WIDTH), np.nan)
    last = times.size - 2
    for k in range(t.size):
        if last < 0 or not times[0] <= t[k] <= times[last + 1]:
            continue
        cell = min(max(np.searchsorted(times, t[k], side="right") - 1, 0), last)
        x = (t[k] - times[cell]) / (times[cell + 1] - times[cell])
        for i in range(WIDTH):
            result[k, i] = _within(dense[cell], states[cell], x, i)
        length = sqrt(result[k, 6] ** 2 + result[k, 7] ** 2 + result[k, 8] ** 2 + result[k, 9] ** 2)
        for i in range(6, 10):
            result[k, i] /= length
    return result


@compiled_nogil
def in_body(flat: FloatArray, tables: Tables, t: FloatArray, states: FloatArray) -> FloatArray:
    """Return motion (m, 19) of states (m, 14): position to acceleration in N, attitude, body rates and theirs in B."""
    p = flat.view(PARAMETERS)[0]
    rows, dy = np.empty((t.size, 19)), np.empty(WIDTH)
    for k in range(t.size):
        y, row = states[k], rows[k]
        derivative(p, tables, t[k], y, dy)
        row[:6] = y[:6]
        row[6:9] = dy[3:6]
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
    return rows


def release_state(release: Release) -> FloatArray:
    """Return the state (14,) of a release; S and B coincide there. Raises `InputError` where something is unknown."""
    position, velocity, C_NB, rate = release.start()
    return np.concatenate([position, velocity, quaternion_from_matrix(C_NB), rate, [0.0]])


@dataclass(frozen=True)
class Flight:
    """A predicted flight: the integrator's own steps and the dense output between them.

    Attributes
    ----------
    t : (n,) array
        Times of the steps, s; the last is touch-down where ``touched_down``.
    state : (n, 14) array
        Position and velocity in N, quaternion of S, rates P, Q in S and r, spin angle psi.
    dense : (n - 1, 7, 14) array
        Dense output of each step, for `evaluate`.
    parameters, tables
        What it was flown with.
    environment : Environment
        Where it happened.
    touched_down : bool
        Whether it ends on the ground.
    """

    t: FloatArray
    state: FloatArray
    dense: FloatArray
    parameters: FloatArray
    tables: Tables
    environment: Environment
    touched_down: bool

    @property
    def end(self) -> float:
        """Last instant, s."""
        return float(self.t[-1])

    @property
    def touch_down(self) -> float:
        """Time at which the centre of mass reaches the ground, s; NaN where it does not."""
        return self.end if self.touched_down else nan

    @property
    def landing(self) -> FloatArray:
        """Position at touch-down, (3,) in N, m; NaN where it does not land."""
        return np.array(self.state[-1, :3]) if self.touched_down else np.full(3, nan)

    def at(self, t: FloatArray | float) -> State:
        """Return the motion at instants t (m,) s, to the order of the dense output; raises ValueError outside."""
        t = np.atleast_1d(np.asarray(t, dtype=np.float64))
        if t.size and not (self.t[0] - 1e-12 <= t.min() and t.max() <= self.end + 1e-12):
            raise ValueError(f"flight runs from {self.t[0]:g} to {self.end:g} s, asked for {t.min():g} to {t.max():g}")
        inside = np.clip(t, self.t[0], self.end)
        rows = in_body(self.parameters, self.tables, inside, evaluate(self.t, self.state, self.dense, inside))
        return State(t, rows[:, :3], rows[:, 3:6], rows[:, 6:9], rows[:, 9:13], rows[:, 13:16], rows[:, 16:19])

    def euler_angles(self, t: FloatArray | float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return roll, pitch, yaw (m,) in rad at instants t, in the paper's order."""
        return euler_angles(self.at(t).attitude)

    def motion(self, timestep: float = 1e-3) -> Motion:
        """Return the motion on a grid of ``timestep`` s, with the end of the flight as its last row."""
        count = max(int(np.ceil((self.end - self.t[0]) / timestep - 1e-6)), 1)
        grid = np.append(self.t[0] + timestep * np.arange(count), self.end)
        at = self.at(grid)
        return Motion(
            t=at.t,
            position=at.position,
            velocity=at.velocity,
            acceleration=at.acceleration,
            attitude=at.attitude,
            rate=at.rate,
            angular_acceleration=at.angular_acceleration,
            environment=self.environment,
            centre_of_mass=readonly(centre_of_mass(self.parameters.view(PARAMETERS)[0]["body_mass_imbalance"])),
            touched_down=self.touched_down,
        )


def predict(
    disc: Disc,
    environment: Environment,
    release: Release,
    effects: Sequence[Effect] = (),
    *,
    rtol: float = RTOL,
    atol: float = ATOL,
    duration: float = 30.0,
    law: Law | Sequence[Law] | None = None,
) -> Flight:
    """Fly a disc by the standalone model, until its centre of mass reaches the ground or for ``duration`` s.

    rtol is of the size of velocity, attitude and rates, atol in SI units: estimated errors of one step. Raises
    `InputError` for a release that lacks something, where a C_Nr table does not reach, and above `FASTEST_SPIN`.
    """
    flat, lookup = flight_parameters(disc, environment, effects), tables(disc, law, effects)
    state = release_state(release)
    ended, t, states, dense = integrate(flat, lookup, state, 0.0, float(duration), rtol, atol, True)
    if ended == _LOST:
        raise _lost(flat, lookup, float(t[-1]), states[-1])
    fastest = float(np.sqrt(np.max(np.sum(states[:, 10:13] ** 2, axis=1))))
    if fastest > FASTEST_SPIN:  # its nutation needs steps as short as those that are taken whatever their error
        raise InputError(f"the disc turns at {fastest:.4g} rad/s; expected at most {FASTEST_SPIN:g} rad/s")
    return Flight(t, states, dense, flat, lookup, environment, ended == _TOUCHED)


def _lost(flat: FloatArray, lookup: Tables, t: float, state: FloatArray) -> InputError:
    """Return the error of a flight whose physics gave no finite number after time t."""
    if lookup.rate.size == 0:
        return InputError(f"at {t:.3f} s the motion is no longer finite; expected parameters of a disc that can fly")
    w = wind(flat.view(PARAMETERS)[0], t, -float(state[2]))
    return outside_table(lookup, t, float(state[12]), float(np.linalg.norm(state[3:6] - w)))


class Landings(NamedTuple):
    """How many flights ended: end (n,) s, state there (n, 14), touched_down (n,), and track (n, m, 14) if asked for.

    Rows of a track after the end of its flight are NaN, and so is all of a flight that left its C_Nr table.
    """

    end: FloatArray
    state: FloatArray
    touched_down: np.ndarray[Any, np.dtype[np.bool_]]
    track: FloatArray


@compiled_nogil
def _integrate_range(
    flats: FloatArray,
    tables: Tables,
    states: FloatArray,
    duration: float,
    rtol: float,
    atol: float,
    t: FloatArray,
    end: FloatArray,
    last: FloatArray,
    touched: Any,
    track: FloatArray,
) -> None:
    """Fly the rows of states (n, 14), each with its row of flats, and write what became of them."""
    for k in range(states.shape[0]):
        flat = flats[k] if flats.shape[0] > 1 else flats[0]
        ended, times, path, dense = integrate(flat, tables, states[k], 0.0, duration, rtol, atol, t.size > 0)
        if ended == _LOST:
            end[k], last[k], track[k], touched[k] = np.nan, np.nan, np.nan, False
            continue
        end[k], last[k], touched[k] = times[-1], path[-1], ended == _TOUCHED
        if t.size > 0:
            track[k] = evaluate(times, path, dense, t)


def predict_many(
    disc: Disc,
    environment: Environment,
    releases: Sequence[Release] | FloatArray,
    effects: Sequence[Effect] = (),
    *,
    parameters: FloatArray | None = None,
    times: FloatArray | None = None,
    rtol: float = RTOL,
    atol: float = ATOL,
    duration: float = 30.0,
    threads: int | None = None,
) -> Landings:
    """Fly n throws on all cores; the result does not depend on the number of threads.

    releases may be states (n, 14). ``parameters`` (n, k) are flat arrays, one per throw, in the place of those of disc,
    environment and effects (of which the tables remain). ``times`` (m,) s asks for tracks. Raises `InputError` as
    `predict` does, but a flight that leaves its C_Nr table becomes NaN and the others fly on.
    """
    states = releases if isinstance(releases, np.ndarray) else np.array([release_state(each) for each in releases])
    states = np.ascontiguousarray(states, dtype=np.float64).reshape(-1, WIDTH)
    flats = flight_parameters(disc, environment, effects)[None] if parameters is None else parameters
    flats = np.ascontiguousarray(flats, dtype=np.float64)
    n = states.shape[0]
    width = PARAMETERS.itemsize // 8
    if flats.ndim != 2 or flats.shape[0] not in (1, n) or flats.shape[1] != width:
        raise ValueError(f"parameters: got {flats.shape}, expected ({n}, {width})")
    lookup = tables(disc, None, effects)
    t = np.empty(0) if times is None else np.ascontiguousarray(times, dtype=np.float64)
    end, last, touched = np.empty(n), np.empty((n, WIDTH)), np.empty(n, dtype=np.bool_)
    track = np.empty((n, t.size, WIDTH))

    def fly(some: slice) -> None:
        own = flats[some] if flats.shape[0] > 1 else flats
        out = (end[some], last[some], touched[some], track[some])
        _integrate_range(own, lookup, states[some], duration, rtol, atol, t, *out)

    count = threads or len(os.sched_getaffinity(0))
    # a few pieces for each thread, for flights differ in length
    edges = np.linspace(0, n, min(n, 4 * count) + 1).astype(int)
    pieces = [slice(a, b) for a, b in itertools.pairwise(edges) if b > a]
    if count == 1 or len(pieces) == 1:
        fly(slice(0, n))
    else:
        with ThreadPoolExecutor(count) as pool:
            list(pool.map(fly, pieces))
    return Landings(end, last, touched, track)
