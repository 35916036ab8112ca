"""Dormand and Prince's explicit Runge-Kutta pair of order 8(5,3) with dense output of order 7, compiled.

One step of the equations of motion, its estimated error, and its dense output (Hairer, Norsett, Wanner, Solving
Ordinary Differential Equations I, II.5 and II.6).
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
from scipy.integrate import DOP853

from discsim.arrays import FloatArray
from discsim.compiled import compiled, compiled_nogil, inlined
from discsim.flight_equations import WIDTH, derivative
from discsim.frames import norm3
from discsim.parameters import Tables

__all__ = ["EXTENDED", "POWER", "STAGES", "evaluate", "interpolant", "step", "step_error", "within"]

# coefficients of the pair, as scipy publishes them
_A, _B, _C = np.array(DOP853.A), np.array(DOP853.B), np.array(DOP853.C)
_E3, _E5, _D = np.array(DOP853.E3), np.array(DOP853.E5), np.array(DOP853.D)
_A_EXTRA, _C_EXTRA = np.array(DOP853.A_EXTRA), np.array(DOP853.C_EXTRA)
#: stages of a step, those of its dense output too, and the power of that
STAGES, EXTENDED, POWER = 12, 16, 7
_NOTHING = np.zeros(WIDTH)


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
    for stage in range(1, STAGES):
        _combine(y, h, _A[stage], K, stage, new)
        derivative(p, tables, t + _C[stage] * h, new, K[stage])
    _combine(y, h, _B, K, STAGES, new)
    # the attitude stays a rotation
    length = sqrt(new[6] ** 2 + new[7] ** 2 + new[8] ** 2 + new[9] ** 2)
    for i in range(6, 10):
        new[i] /= length


@inlined
def step_error(h: float, K: FloatArray, y: FloatArray, rtol: float, atol: float, work: FloatArray) -> float:
    """Estimated error of a step in units of the tolerance, root mean square over the state; K holds 13 stages.

    Velocity, attitude (one) and rates count by their size as vectors, so the steps do not depend on where north is;
    position and spin angle, whose origins mean nothing, count by atol alone.
    """
    velocity = atol + rtol * norm3(y[3], y[4], y[5])
    rate = atol + rtol * norm3(y[10], y[11], y[12])
    fifth, third = work[0], work[1]
    _combine(_NOTHING, 1.0, _E5, K, STAGES, fifth)
    _combine(_NOTHING, 1.0, _E3, K, STAGES, third)
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
    for extra in range(EXTENDED - STAGES - 1):
        stage = STAGES + 1 + extra
        _combine(y, h, _A_EXTRA[extra], K, stage, work)
        derivative(p, tables, t + _C_EXTRA[extra] * h, work, K[stage])
    for i in range(WIDTH):
        change = new[i] - y[i]
        F[0, i] = change
        F[1, i] = h * K[0, i] - change
        F[2, i] = 2.0 * change - h * (K[STAGES, i] + K[0, i])
    for row in range(POWER - 3):
        _combine(_NOTHING, h, _D[row], K, EXTENDED, F[3 + row])


@compiled
def within(F: FloatArray, y: FloatArray, x: float, i: int) -> float:
    """Component i of the dense output at the share x of a step that starts from y."""
    value = 0.0
    for row in range(POWER):
        value += F[POWER - 1 - row, i]
        value *= x if row % 2 == 0 else 1.0 - x
    return float(y[i] + value)


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
            result[k, i] = within(dense[cell], states[cell], x, i)
        length = sqrt(result[k, 6] ** 2 + result[k, 7] ** 2 + result[k, 8] ** 2 + result[k, 9] ** 2)
        for i in range(6, 10):
            result[k, i] /= length
    return result
