"""How a flight changes with where it starts and with its parameters: neighbours of a motion, flown in long steps.

Takes the motion of a segment and states and parameters beside it; gives the motions from there. What counts of them is
only by how little they part from the first: first and neighbours are flown alike in steps of a quarter turn of the
nutation or so, and their differences are added to the first motion as it was flown exactly. The differences are good
to some parts in a thousand, which moves no end of a fit: it ends where readings and the exact motion agree best.

A step of that length is possible because all that a step adds up is slow. Let H be the angular momentum that the rates
would have if the body were round, (Ixx P, Ixx Q, Izz r). Axes F with z = z_B that turn at H/Ixx see it change by the
moment alone, as axes at rest do; so it is added up in both, by the classical Runge-Kutta steps, and F turns about it at
|H|/Ixx, which is the nutation, exactly (free motion of a symmetric top: Goldstein, Classical Mechanics, 5.6).
"""

from __future__ import annotations

from math import ceil, cos, sin, sqrt
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled, inlined
from discsim.effects.events import EVENT_WIDTH_S
from discsim.flight_equations import body_row, derivative
from discsim.frames import rotate_by_quaternion
from discsim.parameters import Tables
from discsim.validation.identification.dynamics import FASTEST, ROW, acting_tables, physics_of

__all__ = ["SLOWEST", "add_neighbours"]

#: longest step, s, and in radians of nutation: its quadrature, of fourth order, is then good to 1.4^4/2880, 1.3e-3
_STEP, _NUTATION = 0.01, 1.4
#: and where coefficients come from a table, which has corners
_CORNERED = 0.5
#: below this nutation, rad/s, a body has no momentum to speak of: neighbours are flown as the motion itself
SLOWEST = 20.0
#: ends and middles of steps that an instant between them is told by
_NEAR = 6


@compiled
def add_neighbours(
    flats: FloatArray,
    given: Tables,
    states: FloatArray,
    start: float,
    end: float,
    stop: float,
    out: FloatArray,
    rows: FloatArray,
    ends: FloatArray,
) -> None:
    """Write rows (c, m, 19) and ends (c, 13) of all states (c, 13) but the first, whose own are there already.

    ``end`` is where the segment ends and ``stop`` (s) where its motion may; else as `flight_segments`.
    """
    p = physics_of(flats[0])
    # a step of a fit may lead to any spin and inertia; no body has Izz above 2 Ixx, and none that is looked for spins
    # faster
    nutation = min(abs(states[0, 12]) * p.disc.Izz / p.disc.Ixx, 2.0 * FASTEST)
    longest = _NUTATION if given.static.columns.shape[1] == 0 else _CORNERED
    longest = min(_STEP, longest / nutation)
    for c in range(flats.shape[0]):
        if _knocked(physics_of(flats[c]), start, stop):
            longest = min(longest, 0.5 * EVENT_WIDTH_S)
    steps = max(3, ceil((end - start) / longest))
    h = (end - start) / steps
    more = steps + max(0, ceil((stop - end) / h - 1e-9))
    first, other = np.empty((2 * more + 1, ROW)), np.empty((2 * more + 1, ROW))
    places, weights = _between(out, start, 0.5 * h, 2 * more + 1)
    between, work = np.empty(ROW), np.zeros((12, 14))
    for c in range(states.shape[0]):
        p = physics_of(flats[c])
        _fly(p, acting_tables(given, flats[c]), states[c], start, h, work, other if c else first)
        if c == 0:
            continue
        _subtract(first, other)
        for j in range(out.size):
            _add(rows[0, j], other[places[j] : places[j] + _NEAR], weights[j], between, rows[c, j])
        change = other[2 * steps]
        ends[c, :6] = ends[0, :6] + change[:6]
        _turned(ends[0, 6:10], change[10:13], ends[c, 6:10])
        ends[c, 10:13] = ends[0, 10:13] + change[13:16]


@inlined
def _knocked(p: Any, start: float, stop: float) -> bool:
    """Tell whether a knock or a kick falls into a time, s."""
    push, kick = p.event_impulse, p.event_spin_step
    pushed = push.dv_north_m_s != 0.0 or push.dv_east_m_s != 0.0 or push.dv_down_m_s != 0.0
    reach = 6.0 * EVENT_WIDTH_S
    if pushed and start - reach < push.t_s < stop + reach:
        return True
    return bool(kick.dr_rad_s != 0.0 and start - reach < kick.t_s < stop + reach)


@compiled
def _between(out: FloatArray, start: float, apart: float, count: int) -> tuple[Any, FloatArray]:
    """Return place (m,) and weights (m, 6), at instants out (m,), of a quintic through six of a grid from start on."""
    places, weights = np.empty(out.size, dtype=np.int64), np.ones((out.size, _NEAR))
    for j in range(out.size):
        s = (out[j] - start) / apart
        places[j] = min(max(int(s) - 2, 0), count - _NEAR)
        for k in range(_NEAR):
            for other in range(_NEAR):
                if other != k:
                    weights[j, k] *= (s - places[j] - other) / (k - other)
    return places, weights


@inlined
def _turned(q: FloatArray, small: FloatArray, new: FloatArray) -> None:
    """Write a quaternion turned by a small rotation vector in B into new (4,)."""
    x, y, z = 0.5 * small[0], 0.5 * small[1], 0.5 * small[2]
    w = sqrt(max(1.0 - x * x - y * y - z * z, 0.0))
    new[0] = q[0] * w - q[1] * x - q[2] * y - q[3] * z
    new[1] = q[0] * x + q[1] * w + q[2] * z - q[3] * y
    new[2] = q[0] * y - q[1] * z + q[2] * w + q[3] * x
    new[3] = q[0] * z + q[1] * y - q[2] * x + q[3] * w


@inlined
def _add(row: FloatArray, changes: FloatArray, weights: FloatArray, change: FloatArray, new: FloatArray) -> None:
    """Write a row of motion with changes (6, 19) between their instants added to it into new (19,); change is free."""
    for i in range(ROW):
        change[i] = 0.0
    for k in range(_NEAR):
        for i in range(ROW):
            change[i] += weights[k] * changes[k, i]
    for i in range(9):
        new[i] = row[i] + change[i]
    _turned(row[9:13], change[10:13], new[9:13])
    for i in range(13, ROW):
        new[i] = row[i] + change[i]


@inlined
def _subtract(first: FloatArray, other: FloatArray) -> None:
    """Make rows (n, 19) the changes from others: of an attitude its small rotation vector in B, in numbers 10 to 12."""
    for k in range(first.shape[0]):
        a, b = first[k], other[k]
        x = a[9] * b[10] - a[10] * b[9] - a[11] * b[12] + a[12] * b[11]
        y = a[9] * b[11] - a[11] * b[9] - a[12] * b[10] + a[10] * b[12]
        z = a[9] * b[12] - a[12] * b[9] - a[10] * b[11] + a[11] * b[10]
        for i in range(ROW):
            b[i] -= a[i]
        b[9], b[10], b[11], b[12] = 0.0, 2.0 * x, 2.0 * y, 2.0 * z


@inlined
def _turn_to(
    y0: FloatArray, H: FloatArray, ahead: float, larger: float, about: float, body: FloatArray, y: FloatArray
) -> None:
    """Write attitude, rates and angle into y (14,) where H has come to after ``ahead`` s.

    H (4, 4) is the momentum in F before and now and at rest before and now, its size ``larger`` now by a share and
    ``about`` in the mean. ``body`` (6,) is 1/Ixx, 1/Izz, one over the size of H before and over its square, cosine and
    sine of half the angle that F turns about H by then, with H as it was.

    F turns by the least turns that take H before to H now, at rest and in F, and between them about H.
    """
    F0, F, N0, N = H[0], H[1], H[2], H[3]
    more = 0.5 * about * ahead * body[0] / body[2]
    c, s = body[4] - body[5] * more, body[5] + body[4] * more
    ew, ex, ey, ez = c, s * body[2] * F0[0], s * body[2] * F0[1], s * body[2] * F0[2]
    qw, qx, qy, qz = y0[6], y0[7], y0[8], y0[9]
    w, x = qw * ew - qx * ex - qy * ey - qz * ez, qw * ex + qx * ew + qy * ez - qz * ey
    y_, z = qw * ey - qx * ez + qy * ew + qz * ex, qw * ez + qx * ey - qy * ex + qz * ew
    half = 0.5 * body[3] * (1.0 - larger)
    ax = half * (N0[1] * N[2] - N0[2] * N[1])
    ay = half * (N0[2] * N[0] - N0[0] * N[2])
    az = half * (N0[0] * N[1] - N0[1] * N[0])
    vw, vx = w - ax * x - ay * y_ - az * z, x + ax * w + ay * z - az * y_
    vy, vz = y_ + ay * w + az * x - ax * z, z + az * w + ax * y_ - ay * x
    bx = half * (F[1] * F0[2] - F[2] * F0[1])
    by = half * (F[2] * F0[0] - F[0] * F0[2])
    bz = half * (F[0] * F0[1] - F[1] * F0[0])
    w, x = vw - vx * bx - vy * by - vz * bz, vx + vw * bx + vy * bz - vz * by
    y_, z = vy + vw * by + vz * bx - vx * bz, vz + vw * bz + vx * by - vy * bx
    # of unit length but for the square of small turns
    length = 1.5 - 0.5 * (w * w + x * x + y_ * y_ + z * z)
    y[6], y[7], y[8], y[9] = w * length, x * length, y_ * length, z * length
    y[10], y[11], y[12] = F[0] * body[0], F[1] * body[0], F[2] * body[1]
    y[13] = y0[13] + ahead * (1.0 + about) * F0[2] * (body[1] - body[0])


@inlined
def _larger(H: FloatArray, body: FloatArray) -> float:
    """Return by what share the momentum in F is larger now than before."""
    F0, F = H[0], H[1]
    x, y, z = F[0] - F0[0], F[1] - F0[1], F[2] - F0[2]
    return float((F0[0] * x + F0[1] * y + F0[2] * z + 0.5 * (x * x + y * y + z * z)) * body[3])


@inlined
def _moved(
    y0: FloatArray, ahead: float, K: FloatArray, square: FloatArray, weights: FloatArray, H: FloatArray, y: FloatArray
) -> None:
    """Write place and velocity into y and the momentum into H after ``ahead`` s, by weights (4,) of what acts.

    K (4, 9) is that, acceleration and moment in F and at rest; ``square`` (4,) are the weights in the place.
    """
    for i in range(3):
        place = speed = in_F = at_rest = 0.0
        for k in range(4):
            place += square[k] * K[k, i]
            speed += weights[k] * K[k, i]
            in_F += weights[k] * K[k, 3 + i]
            at_rest += weights[k] * K[k, 6 + i]
        y[i] = y0[i] + ahead * (y0[3 + i] + ahead * place)
        y[3 + i] = y0[3 + i] + ahead * speed
        H[1, i] = H[0, i] + ahead * in_F
        H[3, i] = H[2, i] + ahead * at_rest


#: weights of what acts in the stages: of the classical steps to the second, third and fourth stage, of the middle by
#: the parabola through the start, it and the end, and of the whole step; then those of accelerations in the place
_WEIGHTS = np.array([[12, 0, 0, 0], [0, 12, 0, 0], [0, 0, 12, 0], [5, 0, 8, -1], [2, 4, 4, 2]]) / 12.0
_SQUARES = np.array([[12, 0, 0, 0], [12, 0, 0, 0], [0, 0, 12, 0], [5, 0, 2, -1], [4, 4, 4, 0]]) / 24.0


@inlined
def _fly(p: Any, tables: Tables, state: FloatArray, start: float, h: float, work: FloatArray, rows: FloatArray) -> None:
    """Fly from a state (13,) and write a row of motion (2 n + 1, 19) at the ends and in the middle of n steps of h s.

    ``work`` (12, 14) is free.
    """
    Ixx, Izz = p.disc.Ixx, p.disc.Izz
    # x_N, v_N, quaternion of F, rates P, Q in F and r, angle from F to B: as a state of `discsim.flight_equations`
    y0, y, dy, body, H, K = work[0], work[1], work[2], work[3, :6], work[4:8], work[8:12]
    for i in range(13):
        y0[i] = state[i]
    y0[13] = 0.0
    body[0], body[1] = 1.0 / Ixx, 1.0 / Izz
    steps = rows.shape[0] // 2
    for step in range(steps + 1):
        H[0, 0], H[0, 1], H[0, 2] = Ixx * y0[10], Ixx * y0[11], Izz * y0[12]
        H[2, 0], H[2, 1], H[2, 2] = rotate_by_quaternion(y0[6], y0[7], y0[8], y0[9], H[0, 0], H[0, 1], H[0, 2])
        size = sqrt(H[0, 0] * H[0, 0] + H[0, 1] * H[0, 1] + H[0, 2] * H[0, 2])
        body[2] = 1.0 / size
        body[3] = body[2] * body[2]
        c, s = cos(0.25 * size * h * body[0]), sin(0.25 * size * h * body[0])
        body[4], body[5] = c, s
        middle = 0.0
        for i in range(14):
            y[i] = y0[i]
        for stage in range(4):
            share = 0.0 if stage == 0 else 1.0 if stage == 3 else 0.5
            derivative(p, tables, start + (step + share) * h, y, dy)
            k, P, Q, r = K[stage], y[10], y[11], y[12]
            k[0], k[1], k[2] = dy[3], dy[4], dy[5]
            k[3], k[4], k[5] = Ixx * dy[10] + Izz * r * Q, Ixx * dy[11] - Izz * r * P, Izz * dy[12]
            k[6], k[7], k[8] = rotate_by_quaternion(y[6], y[7], y[8], y[9], k[3], k[4], k[5])
            if stage == 0:
                body_row(y, dy, rows[2 * step])
                if step == steps:
                    return
            if stage == 3:
                continue
            ahead = h if stage == 2 else 0.5 * h
            if stage == 2:
                body[4], body[5] = c * c - s * s, 2.0 * c * s
            _moved(y0, ahead, K, _SQUARES[stage], _WEIGHTS[stage], H, y)
            larger = _larger(H, body)
            _turn_to(y0, H, ahead, larger, (4.0 * middle + larger) / 6.0 if stage == 2 else 0.5 * larger, body, y)
            middle = larger
        body[4], body[5] = c, s
        _moved(y0, 0.5 * h, K, _SQUARES[3], _WEIGHTS[3], H, y)
        middle = _larger(H, body)
        _turn_to(y0, H, 0.5 * h, middle, 0.5 * middle, body, y)
        derivative(p, tables, start + (step + 0.5) * h, y, dy)
        body_row(y, dy, rows[2 * step + 1])
        body[4], body[5] = c * c - s * s, 2.0 * c * s
        _moved(y0, h, K, _SQUARES[4], _WEIGHTS[4], H, y)
        larger = _larger(H, body)
        _turn_to(y0, H, h, larger, (4.0 * middle + larger) / 6.0, body, y)
        for i in range(14):
            y0[i] = y[i]
