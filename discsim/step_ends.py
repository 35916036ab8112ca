"""Where a step of the integrator has to end: at an event, on a kink of the coefficients, on the ground."""

from __future__ import annotations

from math import nan
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled
from discsim.dormand_prince import step, within
from discsim.effects.events import EVENT_WIDTH_S
from discsim.flight_equations import copied, incidence
from discsim.parameters import Tables

__all__ = ["land", "lowest_point", "share_to_kink", "up_to_events"]

#: a step ends on a kink of the coefficients within this angle of attack, rad: times any slope it is no force
AT_NODE = 1e-7
#: points within a step that tell where its angle of attack turns
KINK_SAMPLES = 5
#: pulses are entered this many widths before their peak: 2e-9 of their area lies outside
PULSE_REACH = 6.0


@compiled
def _up_to_pulse(t: float, h: float, t_s: float, width: float) -> float:
    """Cut a step so that a pulse is entered at its edge and crossed in steps no longer than its width."""
    width = max(abs(width), 1e-4)
    start, end = t_s - PULSE_REACH * width, t_s + PULSE_REACH * width
    if t < start - 1e-9:
        return min(h, start - t)
    return min(h, width) if t < end else h


@compiled
def up_to_events(p: Any, t: float, h: float) -> float:
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
def land(
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
    copied(work, new)
    return float(trial)


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
    p: Any, tables: Tables, t: float, y: FloatArray, h: float, F: FloatArray, share: float, work: FloatArray
) -> float:
    """Angle of attack at a share of a step by its dense output, rad."""
    for i in range(10):
        work[i] = within(F, y, share, i)
    return incidence(p, tables, t + share * h, work)


@compiled
def _share_up_to(
    p: Any,
    tables: Tables,
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
        miss = _incidence_within(p, tables, t, y, h, F, share, work) - node
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
def share_to_kink(
    p: Any, tables: Tables, t: float, y: FloatArray, h: float, F: FloatArray, start: float, end: float, work: FloatArray
) -> float:
    """Share of a step, from angle of attack start to end, at which it first passes a kink; 1 where it passes none.

    The nutation takes the angle up and down within a step, so its extremes are looked at too: a parabola through
    three points of the dense output says where they are.
    """
    n = KINK_SAMPLES
    low, lower, before = 0.0, start, start
    here = _incidence_within(p, tables, t, y, h, F, 1.0 / n, work)
    for k in range(1, n + 1):
        after = end
        if k < n - 1:
            after = _incidence_within(p, tables, t, y, h, F, (k + 1.0) / n, work)
        if k < n and (here - before) * (after - here) < 0.0:
            top = (k + 0.5 * (before - after) / (before - 2.0 * here + after)) / n
            extreme = _incidence_within(p, tables, t, y, h, F, top, work)
            node = _kink(p, tables, lower, extreme)
            if np.isfinite(node):
                return _share_up_to(p, tables, t, y, h, F, node, low, lower, top, extreme, work)
            low, lower = top, extreme
        elif k == n:
            node = _kink(p, tables, lower, end)
            if np.isfinite(node):
                return _share_up_to(p, tables, t, y, h, F, node, low, lower, 1.0, end, work)
        before, here = here, after
    return 1.0


@compiled
def lowest_point(F: FloatArray, y: FloatArray) -> float:
    """Share of a step, falling at its start and rising at its end, at which the disc is lowest."""
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if within(F, y, middle, 5) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
