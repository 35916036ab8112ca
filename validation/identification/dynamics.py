"""Short pieces of motion of each plant, for many neighbouring states and parameters at once: compiled.

A piece starts from a state of 13 numbers (16 in free spin) and yields rows of 19 at given instants: position, velocity
and acceleration in N, attitude (quaternion from B to N), body rates and their derivatives in B.

==========  =======================================================================================================
plant       state
==========  =======================================================================================================
flight      position and velocity in N, attitude, body rates
free spin   transverse angular acceleration that is not rigid-body motion, in B at the piece's start (x, y), and its
            slope; rdot/r and its slope; attitude, body rates; how much faster the wobble turns than by its course; how
            the stiffness of the air bends (x, y)
rigs        yaw angle psi, rate r; the other eleven are not used
==========  =======================================================================================================
"""

from __future__ import annotations

from math import atan2, copysign, cos, sin, sqrt
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled, compiled_nogil
from discsim.effects.body import transverse_inertia
from discsim.effects.events import spin_step
from discsim.effects.rig import axis, coulomb_friction, quadratic_drag, speed_ripple
from discsim.law import LAW_WIDTH, SYMBOLS, law_wrench
from discsim.own_wrench import own_wrench
from discsim.parameters import PARAMETERS, Tables
from discsim.trajectory import derivative, evaluate, in_body, interpolant, step

__all__ = [
    "LAW_PLACES",
    "ROW",
    "SIZE",
    "STATE",
    "flight_pieces",
    "free_spin_pieces",
    "spin_down_pieces",
    "table_pieces",
]

#: numbers of a state, by plant, and of a row of motion
STATE, ROW = {"flight": 13, "free_spin": 16, "spin_down": 13, "rate_table": 13}, 19
#: numbers of the physics; what a row of flats holds beyond are those of the user's own effects and the terms of a law
SIZE = PARAMETERS.itemsize // 8
#: names of the numbers of a law's term: those of a row of `discsim.law`, and per symbol where its power is one
LAW_PLACES = (
    "target",
    "coefficient",
    *(f"power_{symbol}" for symbol in SYMBOLS),
    *(f"odd_{symbol}" for symbol in SYMBOLS),
    "decay",
    "order",
    "phase",
    *(f"at_{symbol}" for symbol in SYMBOLS),
)
_PLACES, _COUNT = len(LAW_PLACES), len(SYMBOLS)


@compiled
def _law(flat: FloatArray, first: int) -> FloatArray:
    """Return the rows (terms, LAW_WIDTH) of the law that stands in a row of flats from place ``first`` on."""
    terms = (flat.size - first) // _PLACES
    rows = np.zeros((terms, LAW_WIDTH))
    for i in range(terms):
        given = flat[first + i * _PLACES : first + (i + 1) * _PLACES]
        rows[i] = given[:LAW_WIDTH]
        for k in range(_COUNT):
            if given[LAW_WIDTH + k] > 0.0:
                rows[i, 1] /= given[LAW_WIDTH + k] ** given[2 + k]
    return rows


@compiled
def _moved(given: Tables, flat: FloatArray) -> Tables:
    """Return tables with a law and the user's own effects as a row of flats has them."""
    own = given.own_sizes.size
    sizes = flat[SIZE : SIZE + own].copy().reshape(given.own_sizes.shape)
    return Tables(given.static, given.rate, given.speed, given.spline, _law(flat, SIZE + own), given.own_calls, sizes)


@compiled_nogil
def flight_pieces(
    flats: FloatArray,
    tables: Tables,
    states: FloatArray,
    times: FloatArray,
    last: int,
    out: FloatArray,
    rows: FloatArray,
    ends: FloatArray,
) -> None:
    """Fly from states (c, 13), each with its row of flats (c, k), in the steps ``times`` (n,).

    Writes rows (c, m, 19) at instants out (m,) and ends (c, 13), the states at ``times[last]``.
    """
    n = times.size
    path, dense, K = np.empty((n, 14)), np.empty((n - 1, 7, 14)), np.empty((16, 14))
    given = tables
    for c in range(states.shape[0]):
        flat = flats[c, :SIZE].copy()
        p = flat.view(PARAMETERS)[0]
        tables = _moved(given, flats[c])
        path[0, :10] = states[c, :10]
        path[0, 10:13] = states[c, 10:13]
        path[0, 13] = 0.0
        derivative(p, tables, times[0], path[0], K[0])
        for k in range(n - 1):
            h = times[k + 1] - times[k]
            step(p, tables, times[k], path[k], h, K, path[k + 1])
            derivative(p, tables, times[k + 1], path[k + 1], K[12])
            interpolant(p, tables, times[k], path[k], h, K, path[k + 1], dense[k])
            K[0] = K[12]
        rows[c] = in_body(flat, tables, out, evaluate(times, path, dense, out))
        end = in_body(flat, tables, times[last : last + 1], path[last : last + 1])[0]
        ends[c, :6] = end[:6]
        ends[c, 6:10] = end[9:13]
        ends[c, 10:13] = end[13:16]


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

    wobble (10,) is how fast the wobble dies, 1/s, how much faster it turns for the stiffness of the air, rad/s, and how
    both differ along the wind and across it (cosine and sine of twice the wind's direction), each with its change
    over the first seconds. heading is that of x_B in N where psi is zero. Air is as stiff as the slope of its moment
    over the angle of attack, which need not be smooth: state[13] is what that adds in this piece, rad/s. A moment about
    one axis turns the wobble as much as it tells that axis from the other.

    How that moment bends with the angle of attack drives the wobble at twice its own frequency, by the square of the
    rates: m = (w_x + i w_y)^2 (state[14] + i state[15]), 1/rad, where psi is zero, and its mirror image at that axis.
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
    c2, s2 = cos(2.0 * (psi + heading)), sin(2.0 * (psi + heading))
    a, b = along * c2 + across * s2, across * c2 - along * s2
    # the axis: a moment about one at the angle chi tells axes apart by -i k exp(2 i chi), and turns the wobble by k,
    # which has the sign opposite to the spin where the moment grows with the angle of attack
    mirror = copysign(1.0 / sqrt(along * along + across * across + _NO_AXIS), -w[2])
    ux, uy = -b * mirror, a * mirror
    a, b = stiffer * a, stiffer * b
    bx, by = c * state[14] - s * state[15], s * state[14] + c * state[15]
    wx, wy = w[0] * w[0] - w[1] * w[1], 2.0 * w[0] * w[1]
    px, py = bx * wx - by * wy, bx * wy + by * wx
    dw[0] = (Iyy - Izz) / Ixx * w[1] * w[2] + c * mx + s * my - decay * w[0] - faster * w[1]
    dw[0] += a * w[0] + b * w[1]
    dw[1] = (Izz - Ixx) / Iyy * w[2] * w[0] + c * my - s * mx - decay * w[1] + faster * w[0]
    dw[1] += b * w[0] - a * w[1]
    dw[0] += px + ux * px + uy * py
    dw[1] += py + uy * px - ux * py
    dw[2] = (Ixx - Iyy) / Izz * w[0] * w[1] + (state[4] + since * state[5]) * w[2]
    dw[2] += spin_step(p.event_spin_step, t, w[2])


@compiled_nogil
def free_spin_pieces(
    flats: FloatArray,
    wobbles: FloatArray,
    states: FloatArray,
    times: FloatArray,
    last: int,
    out: FloatArray,
    rows: FloatArray,
    ends: FloatArray,
) -> None:
    """Spin freely from states (c, 16); wobbles (c, 10) as for `_spinning`. Else as `flight_pieces`.

    Rates by the classical fourth-order steps, attitude by the fourth-order Magnus step through them.
    """
    n = times.size
    rate, slope, attitude, psis = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 4)), np.empty(n)
    k1, k2, k3, k4, w = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for c in range(states.shape[0]):
        flat = flats[c, :SIZE].copy()
        p = flat.view(PARAMETERS)[0]
        state = states[c]
        attitude[0], rate[0], psis[0] = state[6:10], state[10:13], 0.0
        heading = atan2(
            2.0 * (state[6] * state[9] + state[7] * state[8]), 1.0 - 2.0 * (state[8] * state[8] + state[9] * state[9])
        )
        for k in range(n - 1):
            t, h, psi = times[k], times[k + 1] - times[k], psis[k]
            w0 = rate[k]
            _spinning(p, state, wobbles[c], t, times[0], psi, heading, w0, k1)
            for i in range(3):
                w[i] = w0[i] + 0.5 * h * k1[i]
            middle = psi + 0.5 * h * w0[2] + 0.125 * h * h * k1[2]
            _spinning(p, state, wobbles[c], t + 0.5 * h, times[0], middle, heading, w, k2)
            for i in range(3):
                w[i] = w0[i] + 0.5 * h * k2[i]
            _spinning(p, state, wobbles[c], t + 0.5 * h, times[0], middle, heading, w, k3)
            for i in range(3):
                w[i] = w0[i] + h * k3[i]
            _spinning(p, state, wobbles[c], t + h, times[0], psi + h * w0[2] + 0.5 * h * h * k2[2], heading, w, k4)
            slope[k] = k1
            for i in range(3):
                rate[k + 1, i] = w0[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
            psis[k + 1] = psi + 0.5 * h * (w0[2] + rate[k + 1, 2]) + h * h / 12.0 * (k1[2] - k4[2])
            _magnus(attitude[k], w0, rate[k + 1], k1, k4, h, attitude[k + 1])
        _spinning(p, state, wobbles[c], times[n - 1], times[0], psis[n - 1], heading, rate[n - 1], slope[n - 1])
        for j in range(out.size):
            k = min(max(np.searchsorted(times, out[j], side="right") - 1, 0), n - 2)
            h, x = times[k + 1] - times[k], out[j] - times[k]
            row = rows[c, j]
            row[:9] = 0.0
            s = x / h
            for i in range(3):
                a, b = rate[k, i], rate[k + 1, i]
                da, db = h * slope[k, i], h * slope[k + 1, i]
                w[i] = a + s * (da + s * (3.0 * (b - a) - 2.0 * da - db + s * (2.0 * (a - b) + da + db)))
                row[13 + i] = w[i]
                row[16 + i] = (
                    da + s * (2.0 * (3.0 * (b - a) - 2.0 * da - db) + 3.0 * s * (2.0 * (a - b) + da + db))
                ) / h
            _magnus(attitude[k], rate[k], w, slope[k], row[16:19], x, row[9:13])
        end = ends[c]
        psi, span = psis[last], times[last] - times[0]
        cosine, sine = cos(psi), sin(psi)
        mx, my = state[0] + span * state[2], state[1] + span * state[3]
        end[0], end[1] = cosine * mx + sine * my, cosine * my - sine * mx
        end[2], end[3] = cosine * state[2] + sine * state[3], cosine * state[3] - sine * state[2]
        end[4], end[5] = state[4] + span * state[5], state[5]
        end[6:10], end[10:13], end[13] = attitude[last], rate[last], state[13]
        end[14], end[15] = cosine * state[14] - sine * state[15], sine * state[14] + cosine * state[15]


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


@compiled
def _rig_row(p: Any, psi: float, r: float, dr: float, row: FloatArray) -> None:
    """Write a row (19,) of a rig at yaw psi, rate r: z along the axis, turned the short way from straight down."""
    n, e, d = axis(p.rig_axis_tilt)
    row[:9] = 0.0
    # the short way from (0, 0, 1) to the axis: (1 + d, -e, n, 0)
    length = sqrt((1.0 + d) ** 2 + e * e + n * n)
    w, x, y = (1.0 + d) / length, -e / length, n / length
    c, s = cos(0.5 * psi), sin(0.5 * psi)
    row[9], row[10], row[11], row[12] = w * c, x * c + y * s, y * c - x * s, w * s
    row[13], row[14], row[15] = 0.0, 0.0, r
    row[16], row[17], row[18] = 0.0, 0.0, dr


@compiled
def _friction(p: Any, tables: Tables, t: float, r: float) -> float:
    """Angular acceleration of a rig that runs down, rad/s^2."""
    torque = -p.rig.viscous * r + coulomb_friction(p.rig_coulomb_friction, r)
    torque += quadratic_drag(p.rig_quadratic_drag, r)
    if tables.law.shape[0] > 0:
        torque += law_wrench(tables.law, t, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, r)[5]
    if tables.own_calls.size > 0:
        torque += own_wrench(tables.own_calls, tables.own_sizes, t, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, r)[5]
    return float(torque / p.rig.Izz + spin_step(p.event_spin_step, t, r))


@compiled_nogil
def spin_down_pieces(
    flats: FloatArray,
    tables: Tables,
    states: FloatArray,
    times: FloatArray,
    last: int,
    out: FloatArray,
    rows: FloatArray,
    ends: FloatArray,
) -> None:
    """Let a rig run down from states (c, 13) of which psi and r count; else as `flight_pieces`."""
    n = times.size
    psi, r, slope = np.empty(n), np.empty(n), np.empty(n)
    for c in range(states.shape[0]):
        flat = flats[c, :SIZE].copy()
        p, acting = flat.view(PARAMETERS)[0], _moved(tables, flats[c])
        psi[0], r[0] = states[c, 0], states[c, 1]
        slope[0] = _friction(p, acting, times[0], r[0])
        for k in range(n - 1):
            t, h = times[k], times[k + 1] - times[k]
            k1 = slope[k]
            k2 = _friction(p, acting, t + 0.5 * h, r[k] + 0.5 * h * k1)
            k3 = _friction(p, acting, t + 0.5 * h, r[k] + 0.5 * h * k2)
            k4 = _friction(p, acting, t + h, r[k] + h * k3)
            r[k + 1] = r[k] + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            psi[k + 1] = psi[k] + h * r[k] + h * h / 6.0 * (k1 + k2 + k3)
            slope[k + 1] = _friction(p, acting, times[k + 1], r[k + 1])
        _between(p, times, psi, r, slope, out, rows[c])
        ends[c] = 0.0
        ends[c, 0], ends[c, 1] = psi[last], r[last]


@compiled
def _between(
    p: Any, times: FloatArray, psi: FloatArray, r: FloatArray, slope: FloatArray, out: FloatArray, rows: FloatArray
) -> None:
    """Write rows (m, 19) at instants out by Hermite's cubics through the steps."""
    for j in range(out.size):
        k = min(max(np.searchsorted(times, out[j], side="right") - 1, 0), times.size - 2)
        h, x = times[k + 1] - times[k], out[j] - times[k]
        s = x / h
        a, b, da, db = r[k], r[k + 1], h * slope[k], h * slope[k + 1]
        second, third = 3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db
        rate = a + s * (da + s * (second + s * third))
        angle = psi[k] + x * (a + s * (da / 2.0 + s * (second / 3.0 + s * third / 4.0)))
        _rig_row(p, angle, rate, (da + s * (2.0 * second + 3.0 * s * third)) / h, rows[j])


@compiled
def _commanded(p: Any, knots: FloatArray, t: float, psi: float) -> tuple[float, float]:
    """Rate (rad/s) and angular acceleration of a table at time t that has turned by psi; knots (2, n)."""
    n = knots.shape[1]
    k = min(max(np.searchsorted(knots[0], t, side="right") - 1, 0), n - 2)
    slope = (knots[1, k + 1] - knots[1, k]) / (knots[0, k + 1] - knots[0, k])
    command = knots[1, k] + (min(max(t, knots[0, 0]), knots[0, n - 1]) - knots[0, k]) * slope
    if t < knots[0, 0] or t > knots[0, n - 1]:
        slope = 0.0
    if command == 0.0 and slope == 0.0:
        return 0.0, 0.0
    ripple, _ = speed_ripple(p.rig_speed_ripple, psi, 0.0)
    r = command + ripple
    return r, slope + speed_ripple(p.rig_speed_ripple, psi, r)[1]


@compiled_nogil
def table_pieces(
    flats: FloatArray,
    knots: FloatArray,
    states: FloatArray,
    times: FloatArray,
    last: int,
    out: FloatArray,
    rows: FloatArray,
    ends: FloatArray,
) -> None:
    """Turn a table along its command knots (2, n); of states (c, 13) the yaw and the angle turned so far count.

    ``times`` should hold the knots within the piece. Else as `flight_pieces`.
    """
    n = times.size
    turned, r, slope = np.empty(n), np.empty(n), np.empty(n)
    for c in range(states.shape[0]):
        flat = flats[c, :SIZE].copy()
        p = flat.view(PARAMETERS)[0]
        turned[0] = states[c, 1]
        yaw = states[c, 0] - states[c, 1]
        for k in range(n - 1):
            h = times[k + 1] - times[k]
            inside = 1e-9 * h  # a step that starts on a knot belongs to the segment after it
            first, slope[k] = _commanded(p, knots, times[k] + inside, turned[k])
            r[k] = first
            middle, _ = _commanded(p, knots, times[k] + 0.5 * h, turned[k] + 0.5 * h * first)
            middle, _ = _commanded(p, knots, times[k] + 0.5 * h, turned[k] + 0.5 * h * middle)
            end, _ = _commanded(p, knots, times[k + 1] - inside, turned[k] + h * middle)
            turned[k + 1] = turned[k] + h / 6.0 * (first + 4.0 * middle + end)
        r[n - 1], slope[n - 1] = _commanded(p, knots, times[n - 1] + 1e-12, turned[n - 1])
        for j in range(out.size):
            k = min(max(np.searchsorted(times, out[j], side="right") - 1, 0), n - 2)
            x = out[j] - times[k]
            h = times[k + 1] - times[k]
            # the end's rate as this step sees it: a ramp may end there
            end, end_slope = _commanded(p, knots, times[k + 1] - 1e-9 * h, turned[k + 1])
            s = x / h
            a, b, da, db = r[k], end, h * slope[k], h * end_slope
            second, third = 3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db
            rate = a + s * (da + s * (second + s * third))
            angle = turned[k] + x * (a + s * (da / 2.0 + s * (second / 3.0 + s * third / 4.0)))
            _rig_row(p, yaw + angle, rate, (da + s * (2.0 * second + 3.0 * s * third)) / h, rows[c, j])
        ends[c] = 0.0
        ends[c, 0], ends[c, 1] = yaw + turned[last], turned[last]
