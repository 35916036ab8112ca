"""A gyroscope whose 16-bit register overflows: beyond one end of its range it reads on from the other end.

A spin of 2300 deg/s then reads -1700 on a part of +-2000 deg/s. The one row in which it leaps by the whole span tells,
and so must be looked at before a throw is cut out of a log. `continued` follows the leaps, `without_overflow` asks the
other sensors before it believes that.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from discsim.arrays import BoolArray, ComplexArray, FloatArray, IntArray, runs
from discsim.validation.rows.readings import Readings

__all__ = ["Continued", "continued", "without_overflow"]

_DEG = np.pi / 180
#: Ends of the 16-bit registers of usual parts, deg/s: whole ranges (InvenSense, Bosch), and 32768 steps of 4.375, 8.75,
#: 17.5, 35, 70 and 140 mdeg/s (ST)
ENDS = (125.0, 143.36, 250.0, 286.72, 500.0, 573.44, 1000.0, 1146.88, 2000.0, 2293.76, 4000.0, 4587.52)
#: A leap is more than this many times the largest reading: a spin-up of 4000 deg/s in 0.1 s at 100 Hz, and so a tenth
#: of the span missed at either end, leaves 1.8; no motion that rows resolve has above 1.
LEAP = 1.2
#: Beside a leap a row differs from the next by less than this share of the span (the same spin-up: a tenth).
SMOOTH = 0.2
#: Readings reach at least this share of the way to the ends that their leaps tell, and at most the other one.
REACHED = (0.85, 1.03)
#: A span is one of the known ones to within what the fastest spin-up leaves unknown of it; those lie 14 % apart.
NEAR = 0.04
#: A leap is told from a change of the motion by rows no further apart than this, s.
SLOWEST_ROWS = 0.05
#: What rows are apart where nothing tells, s: a logger of 100 Hz.
USUAL_ROWS = 0.01
#: It lies still where it reads below this share of the end, for this long, s: a spin of exactly one span that decays by
#: 15 % a second is there for a quarter of that.
STILL, REST = 0.02, 0.5
#: What another sensor's spin may differ by, a share: scales of a gyroscope (3 % over parts and temperature), twice.
FIELD_AGREES = 0.06
#: The same of the root of the pull to the centre, beside which the hand pulls: half of a quarter of it.
FORCE_AGREES = 0.2
#: Steps of 0.02 rad stand above a magnetometer's noise (1 % of the field), and so tell which way it goes round.
SEEN = 0.02
#: Parts of a log over which the sum of the two rates is compared with their difference, and how near that sum is to a
#: known span: half the scale of a gyroscope (3 %).
WINDOWS, SUM = 8, 0.015
#: Fewest rows that show a spin.
FEWEST = 8
#: A register's span is this many of the least steps between readings at least: the smallest part (+-125 deg/s) written
#: in whole deg/s has 250. What leaps by a few steps lies at rest.
FEWEST_STEPS = 200.0


class Continued(NamedTuple):
    """Readings (n,) continued over the ends of their register, the span added each time, and how often (n,)."""

    value: FloatArray
    span: float
    turns: IntArray


def continued(column: FloatArray, spacing: float | None = None, unit: float | None = None) -> Continued | None:
    """Return readings (n,) of one axis continued over the leaps of a register that overflows; None without one.

    ``spacing`` is the time between rows, s, where it is known. ``unit`` is the worth of one count where readings are in
    rad/s: then the span is that of a known part, where one is near. Else it is 65536 where that is near. NaN are gaps.
    """
    known = np.flatnonzero(np.isfinite(column))
    if known.size < FEWEST or not 0 < (spacing or USUAL_ROWS) <= SLOWEST_ROWS:
        return None
    v = column[known]
    peak = float(np.max(np.abs(v)))
    step = np.diff(v)
    leap = (np.abs(step) > LEAP * peak) & (np.diff(known) == 1)
    found = _span(v, step, leap, unit) if leap.any() else None
    if found is None:
        return None
    span, real = found
    count = np.concatenate([[0], np.cumsum(np.where(real, -np.sign(step), 0.0).astype(np.int64))])
    count = _at_rest(v, count, step, span, max(FEWEST, round(REST / (spacing or USUAL_ROWS))))
    if not count.any():
        return None
    turns = np.zeros(column.size, dtype=np.int64)
    turns[known] = count
    return Continued(column + span * turns, span, turns)


def _span(v: FloatArray, step: FloatArray, leap: BoolArray, unit: float | None) -> tuple[float, BoolArray] | None:
    """Return the span that leaps have in common and which steps (n - 1,) leap by it; None where they are none."""
    peak = float(np.max(np.abs(v)))
    spans, unknown = np.full(step.size, np.nan), np.full(step.size, np.nan)
    for k in np.flatnonzero(leap).tolist():
        first = max(k - 4, 0)
        beside = first + np.flatnonzero(~leap[first : k + 5])
        near = step[beside[np.argsort(np.abs(beside - k), kind="stable")[:4]]]
        if near.size < 2 or v[k] * v[k + 1] > 0:
            continue
        size = float(np.abs(np.median(near) - step[k]))
        if np.max(np.abs(near)) < SMOOTH * size:
            spans[k], unknown[k] = size, np.max(np.abs(near - np.median(near)))
    if np.all(np.isnan(spans)):
        return None
    best = int(np.nanargmin(unknown))
    span = _of_a_part(float(spans[best]), float(unknown[best]), unit)
    real = np.abs(spans / span - 1) < SMOOTH
    if not real.any() or not REACHED[0] < 2 * peak / span < REACHED[1] or span < FEWEST_STEPS * _unit_of(v):
        return None
    return span, real


def _of_a_part(span: float, unknown: float, unit: float | None) -> float:
    """Return the span of a known part where one is as near as the leap tells, else the span as it is."""
    ends = [32768.0] if unit is None else [32768.0 * unit, *(_DEG * end for end in ENDS)]
    nearest = min((2 * end for end in ends), key=lambda one: abs(np.log(one / span)))
    told = max(3 * unknown, 0.01 * span)
    return nearest if abs(nearest - span) < min(told, NEAR * span) else span


def _at_rest(v: FloatArray, count: IntArray, step: FloatArray, span: float, long: int) -> IntArray:
    """Return the counts (n,) of which every rest has none.

    A log that begins beyond an end has its first rest later; without any rest the spin slows down. Of a return that was
    missed before a rest the place is the largest step there.
    """
    rests = [(first, stop) for first, stop in runs(np.abs(v) < STILL * 0.5 * span) if stop - first >= long]
    begins = int(np.argmax(count != count[0]))
    count = count.copy()
    if rests and rests[0][0] >= begins:
        count -= count[rests[0][0]]
    elif not rests and abs(v[-1] + span * count[-1]) > abs(v[0] + span * count[0]):
        count -= count[-1]
    for first, _ in rests:
        missed = count[first]
        if missed:
            before = np.flatnonzero(count[:first] != missed)
            start = int(before[-1]) + 1 if before.size else 0
            back = start + int(np.argmax(np.abs(step[start:first]))) + 1 if first > start else first
            count[back:] -= missed
    return count


# ------------------------------------------------------------------------------------------------ other sensors


def without_overflow(found: Readings, others: Mapping[str, Readings]) -> tuple[Readings, BoolArray, list[str]]:
    """Return a gyroscope's readings continued over its register's ends, its rows (n,) beyond them, and what to say.

    ``found`` is in rad/s and body axes, as ``others`` are. Where neither the field's turning nor the pull to the centre
    shows the same spin, the readings beyond the ends become gaps. Where the field shows what was written they stay.
    """
    value, notes = found.value.copy(), []
    beyond = np.zeros(found.time.size, dtype=np.bool_)
    spacing = float(np.median(np.diff(found.time))) if found.time.size > 1 else 0.0
    for axis in range(value.shape[1]):
        result = continued(value[:, axis], spacing, _unit_of(value))
        if result is None:
            if (told := _never_within(found, axis, others.get("magnetometer"))) is not None:
                value[:, axis] = np.nan
                beyond[:] = True
                notes.append(told)
            continue
        over = result.turns != 0
        said = _witness(found, result, axis, others)
        if said == "":
            continue
        size = np.degrees(0.5 * result.span)
        largest = np.degrees(float(np.nanmax(np.abs(result.value))))
        what = (
            f"gyroscope {'xyz'[axis]}: its register OVERFLOWS at {size:.0f} deg/s and reads on from the other end: "
            f"{np.count_nonzero(over)} rows, the first row {found.number[np.argmax(over)]}"
        )
        if said is None:
            value[over, axis] = np.nan
            notes.append(f"WARNING: {what}; no other sensor confirms the spin behind them: not to be trusted, now gaps")
        else:
            value[:, axis] = result.value
            notes.append(
                f"WARNING: {what}; continued by {2 * size:.0f} deg/s there, up to {largest:.0f} deg/s, as {said}; "
                "a part of wider range needs no such repair"
            )
        beyond |= over
    return (Readings(found.number, found.time, value) if notes else found), beyond, notes


def _never_within(found: Readings, axis: int, field: Readings | None) -> str | None:
    """Return what to say of an axis that overflowed all through a log, so that no leap shows; None where none did.

    A spin that slows down beyond the end reads ever more the other way: its size and the field's turning have one sum,
    the span of a known part, while each of them changes.
    """
    rate = found.value[:, axis]
    if field is None or not np.isfinite(rate).any() or np.sign(np.nanmin(rate)) != np.sign(np.nanmax(rate)):
        return None
    turned, seen = _steps(found.time, rate, np.ones(rate.size, dtype=np.bool_), axis, field, circle=True)
    parts = min(WINDOWS, turned.size // FEWEST)
    spacing = float(np.median(np.diff(_across(field, axis, circle=True)[1]))) if parts > 2 else 0.0
    if parts < 3 or not np.median(np.abs(turned)) > SEEN:
        return None
    written, true = (
        np.array([abs(float(np.mean(one))) / spacing for one in np.array_split(steps, parts)])
        for steps in (turned, seen)
    )
    total, apart = written + true, true - written
    end = _DEG * min(ENDS, key=lambda one: abs(np.log(2 * _DEG * one / np.median(total))))
    if np.std(total) > 0.25 * np.std(apart) or abs(np.median(total) / (2 * end) - 1) > SUM or np.min(apart) < 0:
        return None
    return (
        f"WARNING: gyroscope {'xyz'[axis]}: its register overflowed all through this log, it seems: it reads up to "
        f"{np.degrees(np.max(written)):.0f} deg/s while the field turns at {np.degrees(np.max(true)):.0f}, and where "
        f"one of them falls the other rises, as beyond a range of {np.degrees(end):.0f} deg/s: not to be trusted, now "
        "gaps"
    )


def _unit_of(value: FloatArray) -> float:
    """Return the smallest spacing of readings (n, k), rad/s: the worth of one count where they are counts."""
    distinct = np.unique(value[np.isfinite(value)])
    spacing = np.diff(distinct)
    return float(np.min(spacing[spacing > 1e-9], initial=np.inf))


def _witness(found: Readings, result: Continued, axis: int, others: Mapping[str, Readings]) -> str | None:
    """Return who shows the continued spin, None where nobody does, "" where the field shows the spin as written."""
    over = result.turns != 0
    if "magnetometer" in others:
        field = others["magnetometer"]
        written = found.value[:, axis]
        sense = _sense(found.time, written, ~over, axis, field)
        off, off_written = (_off(found.time, rate, over, axis, field, sense) for rate in (result.value, written))
        if off < FIELD_AGREES and off < off_written:
            return "the field turns"
        if np.isfinite(off):
            return "" if off_written < FIELD_AGREES else None
    if "accelerometer" in others and _pulls(found, result, axis, others["accelerometer"]):
        return "the pull to the centre grows"
    return None


def _sense(time: FloatArray, rate: FloatArray, rows: BoolArray, axis: int, field: Readings) -> tuple[float, ...]:
    """Return the way the field goes round beside a rate in some rows, -1, or 1 if mirrored; both if unknown."""
    turned, seen = _steps(time, rate, rows, axis, field)
    fast = np.abs(turned) > SEEN
    if fast.sum() < FEWEST:
        return (-1.0, 1.0)
    agree = [float(np.mean(np.cos(seen[fast] - sense * turned[fast]))) for sense in (-1.0, 1.0)]
    return (-1.0,) if agree[0] > agree[1] else (1.0,)


def _off(
    time: FloatArray, rate: FloatArray, rows: BoolArray, axis: int, field: Readings, senses: tuple[float, ...]
) -> float:
    """Return the share by which a rate (n,) rad/s and the field's turning differ in some rows; NaN of too few."""
    turned, seen = _steps(time, rate, rows, axis, field)
    if turned.size < FEWEST:
        return float("nan")
    left = min(abs(float(np.angle(np.mean(np.exp(1j * (seen - sense * turned)))))) for sense in senses)
    return left / max(float(np.median(np.abs(turned))), 1e-9)


def _steps(
    time: FloatArray, rate: FloatArray, rows: BoolArray, axis: int, field: Readings, *, circle: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Return what a rate turns between the field's readings in some rows, rad, and how far the field went round."""
    plane, t = _across(field, axis, circle=circle)
    sound = np.isfinite(rate)
    if t.size < FEWEST or sound.sum() < FEWEST:
        return np.empty(0), np.empty(0)
    time, rate = time[sound], rate[sound]
    inside = np.interp(t, time, rows[sound].astype(float)) == 1.0
    spacing = np.diff(t)
    both = inside[1:] & inside[:-1] & (spacing < 1.5 * float(np.median(spacing)))
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    turned = np.diff(np.interp(t, time, angle))
    return turned[both], np.asarray(np.angle(plane[1:] * np.conj(plane[:-1])))[both]


def _across(field: Readings, axis: int, *, circle: bool) -> tuple[ComplexArray, FloatArray]:
    """Return the field (m,) across an axis, x + i y, and its times; repeats left out.

    It is taken about its mean over a second, or about the centre of the one circle that all of it goes round.
    """
    fresh = np.array(np.isfinite(field.value).all(axis=1))
    fresh[1:] &= np.any(np.diff(field.value, axis=0) != 0, axis=1)
    t, value = field.time[fresh], field.value[fresh]
    if t.size < FEWEST:
        return np.empty(0, dtype=np.complex128), t
    plane = value[:, (axis + 1) % 3] + 1j * value[:, (axis + 2) % 3]
    if circle:
        design = np.column_stack([2 * plane.real, 2 * plane.imag, np.ones(t.size)])
        x, y, _ = np.linalg.lstsq(design, np.abs(plane) ** 2, rcond=None)[0]
        return plane - complex(x, y), t
    wide = max(3, min(t.size // 2, round(1.0 / max(float(np.median(np.diff(t))), 1e-9))))
    mean = uniform_filter1d(plane.real, wide, mode="nearest") + 1j * uniform_filter1d(plane.imag, wide, mode="nearest")
    return np.asarray(plane - mean), t


def _pulls(found: Readings, result: Continued, axis: int, accel: Readings) -> bool:
    """Tell whether the force across the spin axis grows with the square of the continued rate, and not as written."""
    force = np.hypot(accel.value[:, (axis + 1) % 3], accel.value[:, (axis + 2) % 3])
    sound = np.isfinite(force)
    if sound.sum() < FEWEST:
        return False
    pull = np.interp(found.time, accel.time[sound], force[sound], left=np.nan, right=np.nan)
    rate = np.abs(result.value)
    fast = np.isfinite(pull) & np.isfinite(rate) & (rate > 0.25 * result.span)
    over, below = fast & (result.turns != 0), fast & (result.turns == 0)
    if over.sum() < FEWEST or below.sum() < 3:
        return False
    arms = [float(np.median(np.sqrt(pull[rows]) / rate[rows])) for rows in (over, below)]
    written = float(np.median(np.sqrt(pull[over]) / np.maximum(np.abs(found.value[over, axis]), 1e-9)))
    off, off_written = abs(arms[0] / arms[1] - 1), abs(written / arms[1] - 1)
    return off < FORCE_AGREES and off < 0.5 * off_written
