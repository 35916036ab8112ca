"""The motion of a free spin, compiled: Euler's equations, what the air does to the wobble, and its neighbours.

Takes states and parameters of segments; gives the motion at instants and at their ends. What a state and the wobble's
numbers mean stands in `discsim.validation.identification.plants.free_spin`.

Nutation turns the transverse rates as a whole, which each step does exactly; what else acts is slow and is added up by
the classical fourth-order steps (integrating factor: Lawson, "Generalized Runge-Kutta processes for stable systems",
1967). What counts of a segment's neighbours is only by how little they part from it: they and the first are run once
more in steps some times as long, and their differences are added to the first motion as it was run in short ones.
"""

from __future__ import annotations

from math import atan2, copysign, cos, sin, sqrt
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled, compiled_nogil
from discsim.effects.body import transverse_inertia
from discsim.effects.events import EVENT_WIDTH_S, spin_step
from discsim.validation.identification.dynamics import physics_of

__all__ = ["free_spin_segments"]


@compiled
def _turned(q: FloatArray, wx: float, wy: float, wz: float, h: float, new: FloatArray) -> None:
    """Write q turned for h s at a constant body rate into new (4,)."""
    angle = sqrt(wx * wx + wy * wy + wz * wz) * h
    c = cos(0.5 * angle)
    s = 0.5 * h if angle < 1e-9 else sin(0.5 * angle) * h / angle
    x, y, z = s * wx, s * wy, s * wz
    new[0] = q[0] * c - q[1] * x - q[2] * y - q[3] * z
    new[1] = q[0] * x + q[1] * c + q[2] * z - q[3] * y
    new[2] = q[0] * y - q[1] * z + q[2] * c + q[3] * x
    new[3] = q[0] * z + q[1] * y - q[2] * x + q[3] * c


#: what tells axes apart by less than the root of this, 1/s^2, says little about where they are
_NO_AXIS = 0.1


@compiled
def _spinning(
    p: Any,
    state: FloatArray,
    wobble: FloatArray,
    t: float,
    t0: float,
    psi: float,
    heading: float,
    w: FloatArray,
    dw: FloatArray,
) -> None:
    """Write the derivative of body rates w (3,) in a free spin into dw (3,): Euler's equations and the nuisances.

    wobble (14,) is how fast the wobble dies, 1/s, how much faster it turns for the stiffness of the air, rad/s, and how
    both differ along the wind and across it (cosine and sine of twice the wind's direction), each with its change over
    the first seconds; then how what damps the rolling acts on the spin, too: the moment stands aslant to the disc by
    the angle of attack, so that rates about axes to the north and to the east make a yaw moment, 1/s, each with its
    change. heading is that of x_B in N where psi is zero. Air is as stiff as the slope of its moment over
    the angle of attack, which need not be smooth: state[13] is what that adds in this segment, rad/s. A moment about
    one axis turns the wobble as much as it tells that axis from the other.

    A moment that is fixed in the body, as the lift's about a centre of mass beside the middle, adds state[16] and
    state[17], rad/s^2.

    How the air's moment bends with the angle of attack drives the wobble at twice its own frequency, by the square of
    the rates: m = (w_x + i w_y)^2 (state[14] + i state[15]), 1/rad, where psi is zero, and its mirror image at that
    axis.
    """
    Ixx, Izz = p.disc.Ixx, p.disc.Izz
    Iyy = transverse_inertia(p.body_inertia_asymmetry, Ixx)
    since = t - t0
    mx, my = state[0] + since * state[2], state[1] + since * state[3]
    c, s = cos(psi), sin(psi)
    later = t / (1.0 + t)  # bounded, or a wobble that is long gone would grow again
    decay = wobble[0] + later * (wobble[1] + later * wobble[8])
    faster = wobble[2] + later * (wobble[3] + later * wobble[9])
    stiffer = 1.0 + state[13] * faster / (1.0 + faster * faster)
    faster += state[13]
    along, across = wobble[4] + later * wobble[5], wobble[6] + later * wobble[7]
    cn, sn = cos(psi + heading), sin(psi + heading)
    c2, s2 = cn * cn - sn * sn, 2.0 * sn * cn
    a, b = along * c2 + across * s2, across * c2 - along * s2
    # the axis: a moment about one at the angle chi tells axes apart by -i k exp(2 i chi), and turns the wobble by k,
    # which has the sign opposite to the spin where the moment grows with the angle of attack
    mirror = copysign(1.0 / sqrt(along * along + across * across + _NO_AXIS), -w[2])
    ux, uy = -b * mirror, a * mirror
    a, b = stiffer * a, stiffer * b
    bx, by = c * state[14] - s * state[15], s * state[14] + c * state[15]
    wx, wy = w[0] * w[0] - w[1] * w[1], 2.0 * w[0] * w[1]
    px, py = bx * wx - by * wy, bx * wy + by * wx
    dw[0] = (Iyy - Izz) / Ixx * w[1] * w[2] + c * mx + s * my + state[16] - decay * w[0] - faster * w[1]
    dw[0] += a * w[0] + b * w[1]
    dw[0] += px + ux * px + uy * py
    # all of these are moments, told by the rates about x_B that they make: about y_B they turn another inertia
    y = Ixx / Iyy
    dw[1] = (Izz - Ixx) / Iyy * w[2] * w[0] + y * c * my - y * s * mx + y * state[17] - y * decay * w[1]
    dw[1] += y * faster * w[0]
    dw[1] += y * b * w[0] - y * a * w[1]
    dw[1] += y * py + y * uy * px - y * ux * py
    dw[2] = (Ixx - Iyy) / Izz * w[0] * w[1] + (state[4] + since * state[5]) * w[2]
    dw[2] += (wobble[10] + later * wobble[11]) * (cn * w[0] - sn * w[1])
    dw[2] += (wobble[12] + later * wobble[13]) * (sn * w[0] + cn * w[1])
    dw[2] += spin_step(p.event_spin_step, t, w[2])


@compiled_nogil
def free_spin_segments(
    flats: FloatArray,
    wobbles: FloatArray,
    states: FloatArray,
    times: FloatArray,
    last: int,
    out: FloatArray,
    rows: FloatArray,
    ends: FloatArray,
) -> None:
    """Spin freely from states (c, 18); wobbles (c, 14) as for `_spinning`. Else as `flight_segments`.

    Neighbours of the first part from it as in long steps: to some thousandths of how far they part.
    """
    _run(flats[0], wobbles[0], states[0], times, last, out, rows[0], ends[0])
    if states.shape[0] == 1:
        return
    steps, end = _long_steps(flats, times, last, states[0, 12])
    if steps.size == times.size:
        for c in range(1, states.shape[0]):
            _run(flats[c], wobbles[c], states[c], times, last, out, rows[c], ends[c])
        return
    row, there = np.empty((out.size, 19)), np.empty(18)
    _run(flats[0], wobbles[0], states[0], steps, end, out, row, there)
    for c in range(1, states.shape[0]):
        _run(flats[c], wobbles[c], states[c], steps, end, out, rows[c], ends[c])
        for j in range(out.size):
            _apart(rows[0, j], row[j], 9, rows[c, j])
            for i in range(13, 19):
                rows[c, j, i] += rows[0, j, i] - row[j, i]
        for i in range(18):
            if i < 6 or i > 9:
                ends[c, i] += ends[0, i] - there[i]
        _apart(ends[0], there, 6, ends[c])


#: longest step of neighbours, s, and in radians of nutation twice over
_LONG_STEP, _LONG_NUTATION = 0.01, 0.66


@compiled
def _long_steps(flats: FloatArray, times: FloatArray, last: int, spin: float) -> tuple[FloatArray, int]:
    """Return some of the instants (n,) of steps, far apart, and the place of the one that was the ``last``.

    All of them where a kick falls into these times.
    """
    reach = 6.0 * EVENT_WIDTH_S
    for c in range(flats.shape[0]):
        kick = physics_of(flats[c]).event_spin_step
        if kick.dr_rad_s != 0.0 and times[0] - reach < kick.t_s < times[-1] + reach:
            return times, last
    longest = min(_LONG_STEP, _LONG_NUTATION / max(2.0 * abs(spin), 1.0))
    chosen, end = [times[0]], 0
    k = 0
    while k < times.size - 1:
        stop = last if k < last else times.size - 1
        following = k + 1
        while following < stop and times[following + 1] - times[k] <= longest:
            following += 1
        chosen.append(times[following])
        k = following
        if k == last:
            end = len(chosen) - 1
    return np.array(chosen), end


@compiled
def _apart(exact: FloatArray, first: FloatArray, at: int, other: FloatArray) -> None:
    """Write the attitude that parts from an exact one as another from the first, all from a place on, into other."""
    aw, ax, ay, az = first[at], -first[at + 1], -first[at + 2], -first[at + 3]
    bw, bx, by, bz = other[at], other[at + 1], other[at + 2], other[at + 3]
    w, x = aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by
    y, z = aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw
    cw, cx, cy, cz = exact[at], exact[at + 1], exact[at + 2], exact[at + 3]
    other[at], other[at + 1] = cw * w - cx * x - cy * y - cz * z, cw * x + cx * w + cy * z - cz * y
    other[at + 2], other[at + 3] = cw * y - cx * z + cy * w + cz * x, cw * z + cx * y - cy * x + cz * w


@compiled
def _run(
    flat: FloatArray,
    wobble: FloatArray,
    state: FloatArray,
    times: FloatArray,
    last: int,
    out: FloatArray,
    rows: FloatArray,
    end: FloatArray,
) -> None:
    """Spin from one state (18,) and write its rows (m, 19) at instants out (m,) and its end (18,)."""
    n = times.size
    rate, slope, attitude, psis = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 4)), np.empty(n)
    k1, k2, k3, k4, w = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    p = physics_of(flat)
    nutation = (p.disc.Izz - p.disc.Ixx) / p.disc.Ixx
    attitude[0], rate[0], psis[0] = state[6:10], state[10:13], 0.0
    heading = atan2(
        2.0 * (state[6] * state[9] + state[7] * state[8]), 1.0 - 2.0 * (state[8] * state[8] + state[9] * state[9])
    )
    for k in range(n - 1):
        t, h, psi = times[k], times[k + 1] - times[k], psis[k]
        w0, new = rate[k], rate[k + 1]
        turning = nutation * w0[2]  # rad/s, of the transverse rates in B
        c, s = cos(0.5 * turning * h), sin(0.5 * turning * h)
        whole_c, whole_s = c * c - s * s, 2.0 * c * s
        _spinning(p, state, wobble, t, times[0], psi, heading, w0, k1)
        slope[k] = k1
        _slow(k1, w0, turning)
        x, y = w0[0] + 0.5 * h * k1[0], w0[1] + 0.5 * h * k1[1]
        w[0], w[1], w[2] = c * x - s * y, s * x + c * y, w0[2] + 0.5 * h * k1[2]
        middle = psi + 0.5 * h * w0[2] + 0.125 * h * h * k1[2]
        _spinning(p, state, wobble, t + 0.5 * h, times[0], middle, heading, w, k2)
        _slow(k2, w, turning)
        w[0] = c * w0[0] - s * w0[1] + 0.5 * h * k2[0]
        w[1] = s * w0[0] + c * w0[1] + 0.5 * h * k2[1]
        w[2] = w0[2] + 0.5 * h * k2[2]
        _spinning(p, state, wobble, t + 0.5 * h, times[0], middle, heading, w, k3)
        _slow(k3, w, turning)
        w[0] = whole_c * w0[0] - whole_s * w0[1] + h * (c * k3[0] - s * k3[1])
        w[1] = whole_s * w0[0] + whole_c * w0[1] + h * (s * k3[0] + c * k3[1])
        w[2] = w0[2] + h * k3[2]
        _spinning(p, state, wobble, t + h, times[0], psi + h * w0[2] + 0.5 * h * h * k2[2], heading, w, k4)
        yaw = k4[2]
        _slow(k4, w, turning)
        x, y = w0[0] + h / 6.0 * k1[0], w0[1] + h / 6.0 * k1[1]
        both_x, both_y = k2[0] + k3[0], k2[1] + k3[1]
        new[0] = whole_c * x - whole_s * y + h / 6.0 * (2.0 * (c * both_x - s * both_y) + k4[0])
        new[1] = whole_s * x + whole_c * y + h / 6.0 * (2.0 * (s * both_x + c * both_y) + k4[1])
        new[2] = w0[2] + h / 6.0 * (k1[2] + 2.0 * k2[2] + 2.0 * k3[2] + k4[2])
        psis[k + 1] = psi + 0.5 * h * (w0[2] + new[2]) + h * h / 12.0 * (k1[2] - yaw)
        k4[0], k4[1], k4[2] = k4[0] - turning * new[1], k4[1] + turning * new[0], yaw
        _magnus(attitude[k], w0, new, slope[k], k4, h, attitude[k + 1])
    _spinning(p, state, wobble, times[n - 1], times[0], psis[n - 1], heading, rate[n - 1], slope[n - 1])
    for j in range(out.size):
        k = min(max(np.searchsorted(times, out[j], side="right") - 1, 0), n - 2)
        h, x = times[k + 1] - times[k], out[j] - times[k]
        row = rows[j]
        row[:9] = 0.0
        s = x / h
        for i in range(3):
            a, b = rate[k, i], rate[k + 1, i]
            da, db = h * slope[k, i], h * slope[k + 1, i]
            w[i] = a + s * (da + s * (3.0 * (b - a) - 2.0 * da - db + s * (2.0 * (a - b) + da + db)))
            row[13 + i] = w[i]
            row[16 + i] = (da + s * (2.0 * (3.0 * (b - a) - 2.0 * da - db) + 3.0 * s * (2.0 * (a - b) + da + db))) / h
        _magnus(attitude[k], rate[k], w, slope[k], row[16:19], x, row[9:13])
    psi, span = psis[last], times[last] - times[0]
    cosine, sine = cos(psi), sin(psi)
    mx, my = state[0] + span * state[2], state[1] + span * state[3]
    end[0], end[1] = cosine * mx + sine * my, cosine * my - sine * mx
    end[2], end[3] = cosine * state[2] + sine * state[3], cosine * state[3] - sine * state[2]
    end[4], end[5] = state[4] + span * state[5], state[5]
    end[6:10], end[10:13], end[13] = attitude[last], rate[last], state[13]
    end[14], end[15] = cosine * state[14] - sine * state[15], sine * state[14] + cosine * state[15]
    end[16], end[17] = state[16], state[17]


@compiled
def _slow(dw: FloatArray, w: FloatArray, turning: float) -> None:
    """Take the turning of the transverse rates w (3,) at one rate, rad/s, out of their derivative dw (3,)."""
    dw[0] += turning * w[1]
    dw[1] -= turning * w[0]


@compiled
def _magnus(
    q: FloatArray, a: FloatArray, b: FloatArray, da: FloatArray, db: FloatArray, h: float, new: FloatArray
) -> None:
    """Turn q for h s by rates that run from a to b (3,) with slopes da and db there; fourth order."""
    x = 0.5 * (a[0] + b[0]) + h / 12.0 * (da[0] - db[0])
    y = 0.5 * (a[1] + b[1]) + h / 12.0 * (da[1] - db[1])
    z = 0.5 * (a[2] + b[2]) + h / 12.0 * (da[2] - db[2])
    # body rates: the commutator enters with this sign
    x += h / 12.0 * (a[1] * b[2] - a[2] * b[1])
    y += h / 12.0 * (a[2] * b[0] - a[0] * b[2])
    z += h / 12.0 * (a[0] * b[1] - a[1] * b[0])
    _turned(q, x, y, z, h, new)
