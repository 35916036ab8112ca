"""Throws in a long log. Takes what was read of it; gives the stretches of free spin with their rows.

The rule. It spins: faster than a turn a second, about one axis, for 0.3 s and two turns at least. It is free: over
every 0.1 s the rate changes by less than twice its size per second. A hand that spins a disc up, catches or drops it
changes the rate by ten times its size per second and more; air and a bearing by at most half. And no row's specific
force differs from the one before by 0.5 m/s of velocity or more, which no air force does: that is an impact. A stretch
so begins after the hand's acceleration has ended and ends before the impact, 0.05 s clear of both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.signal import savgol_filter

from discsim.arrays import BoolArray, ComplexArray, FloatArray, runs
from discsim.clipping import clipped
from discsim.spin_axis import FAST
from discsim.validation.diagnosis.throw_ends import CHANGE, HALF, SHORTEST
from discsim.validation.importing.conversion import RawReadings

__all__ = ["Stretch", "stretches"]

#: Two turns tell a spin from a swing of the arm.
TURNS = 2.0
#: The mean of the rate's direction has this length where it stays within 25 degrees of one axis.
ONE_AXIS = 0.9
#: Twice the largest air force on a disc, 2 g, over a row at 100 Hz is 0.4 m/s; a ground hit takes some m/s in a row.
IMPACT = 0.5
#: Soft iron and a turn that is not about z make an ellipse of the field's circle; one three times as long is no spin.
LONGEST_ELLIPSE = 3.0
#: ... and one that shows less than this share of a gyroscope's limit is read too seldom: noise, and what is left of the
#: stretch below the limit, come to less.
SLOWER = 0.8
#: A magnetometer alone tells the rate from the field's turning over this span, s.
FIELD_SPAN = 0.25


@dataclass(frozen=True)
class Stretch:
    """A throw: from ``start`` to ``end`` (s, from the log's first sample), rows ``first`` up to ``stop``, and its spin.

    ``spin`` is the median size of the rate, rad/s; ``sensor`` what it was seen by. ``at_least``: that sensor was
    clipped, and the spin is faster.
    """

    start: float
    end: float
    first: int
    stop: int
    spin: float
    sensor: str
    at_least: bool = False

    @property
    def text(self) -> str:
        """One line for a person."""
        size = f"{np.degrees(self.spin):.0f} deg/s by the {self.sensor}"
        size = f"more than {size}, which is clipped" if self.at_least else size
        return f"{self.start:.2f} to {self.end:.2f} s, rows {self.first}:{self.stop}, {size}"


class _Rate(NamedTuple):
    """Who shows the rate, time (n,), its size (n,), where its axis stands still in the body, where it is clipped.

    ``plane`` (n,) is the field across the spin axis, x + i y, as read; empty of a gyroscope.
    """

    sensor: str
    t: FloatArray
    rate: FloatArray
    steady: BoolArray
    clipped: BoolArray
    plane: ComplexArray = np.empty(0, dtype=np.complex128)

    def spin(self, inside: BoolArray) -> float:
        """Return the size of the rate over some rows, rad/s: the median of a gyroscope's, of the field's turns."""
        median = float(np.median(self.rate[inside]))
        return median if self.plane.size == 0 else _turning(self.t[inside], self.plane[inside], median)


def stretches(read: RawReadings) -> list[Stretch]:
    """Return the stretches of free spin in a log, in the order of time; none where no sensor shows a spin."""
    field = _field_rate(read)
    seen = _gyroscope_rate(read) or field
    if seen is None:
        return []
    half = HALF if seen.sensor == "gyroscope" else FIELD_SPAN
    # at its limit a gyroscope of a small range shows a spin, whatever that limit is: by how much the field tells
    free = ((seen.rate > FAST) | seen.clipped) & seen.steady & (_slope(seen.t, seen.rate, half) < CHANGE * seen.rate)
    free &= ~_impacts(read, seen.t)
    zero = min(float(found.time[0]) for found in read.readings.values())
    main = next(iter(read.readings.values()))
    found = []
    for first, stop in runs(free):
        start, end = float(seen.t[first]), float(seen.t[stop - 1])
        if end - start < SHORTEST:
            continue
        told, spin, at_least = _spin(seen, field, start, end)
        rows = main.number[(main.time >= start) & (main.time <= end)]
        if rows.size > 1 and spin * (end - start) >= TURNS * 2 * np.pi:
            found.append(Stretch(start - zero, end - zero, int(rows[0]), int(rows[-1]) + 1, spin, told, at_least))
    return found


def _spin(seen: _Rate, field: _Rate | None, start: float, end: float) -> tuple[str, float, bool]:
    """Return who shows the spin of a stretch, its size (rad/s), and whether it is more than that.

    A gyroscope that stands at its limit for half the stretch gives way to the magnetometer, unless that shows a slower
    spin: read less than twice a turn, a field seems to turn more slowly than it does.
    """
    inside = (seen.t >= start) & (seen.t <= end)
    least = seen.spin(inside)
    if least > 0 and not np.mean(seen.clipped[inside]) > 0.5:
        return seen.sensor, least, False
    if field is not None and (there := (field.t >= start) & (field.t <= end)).any():
        spin = field.spin(there)
        if spin > SLOWER * least:
            return field.sensor, spin, False
    return seen.sensor, least, True


def _gyroscope_rate(read: RawReadings) -> _Rate | None:
    gyro = read.readings.get("gyroscope")
    if gyro is None:
        return None
    # a spin shows without an axis across it
    hollow = np.all(np.isnan(gyro.value), axis=0) & np.array([True, True, False])
    whole = np.where(hollow, 0.0, gyro.value)
    sound = np.isfinite(whole).all(axis=1)
    t, value = gyro.time[sound], whole[sound]
    if t.size < 8 or not value.any():
        return None
    rate = np.linalg.norm(value, axis=1)
    unit = value / np.maximum(rate, 1e-9)[:, None]
    mean = uniform_filter1d(unit, _count(t, SHORTEST), axis=0, mode="nearest")
    limit = read.import_map.sensors["gyroscope"].sheet.range
    at_limit = clipped(value, limit, None).any(axis=1)
    return _Rate("gyroscope", t, rate, np.asarray(np.linalg.norm(mean, axis=1) > ONE_AXIS), np.asarray(at_limit))


def _field_rate(read: RawReadings) -> _Rate | None:
    field = read.readings.get("magnetometer")
    if field is None:
        return None
    fresh = np.array(np.isfinite(field.value).all(axis=1))
    fresh[1:] &= np.any(np.diff(field.value, axis=0) != 0, axis=1)  # sampled and held
    t, value = field.time[fresh], field.value[fresh]
    if t.size < 16:
        return None
    # a mean over a second or more holds no turn, and takes the hard iron off
    centred = value - uniform_filter1d(value, _count(t, 1.0), axis=0, mode="nearest")
    plane = centred[:, 0] + 1j * centred[:, 1]
    turn = np.abs(np.angle(plane[1:] * np.conj(plane[:-1]))) / np.diff(t)
    rate = median_filter(np.append(turn, turn[-1]), _count(t, FIELD_SPAN))
    size = uniform_filter1d(np.abs(plane), _count(t, FIELD_SPAN), mode="nearest")
    # a field that goes round has a steady size; 5 uT is a quarter of the weakest horizontal field of temperate places
    whole = value[:, 0] + 1j * value[:, 1]
    return _Rate("magnetometer", t, rate, np.asarray(size > 5.0), np.zeros(t.size, dtype=np.bool_), whole)


def _turning(t: FloatArray, plane: ComplexArray, rough: float) -> float:
    """Return the size of the rate at which a field (n,) goes round the ellipse through it, rad/s, the median of turns.

    About a centre that is off, or on an ellipse, the turn per row comes and goes with each turn, and its median over
    rows is up to a fifth low. ``rough``, such a median, bridges rows that are further apart, and is the answer where
    readings fit no ellipse.
    """
    level = _levelled(plane)
    if level is None:
        return rough
    step, spacing = np.angle(level[1:] * np.conj(level[:-1])), np.diff(t)
    row = float(np.median(spacing))
    near = spacing < 1.5 * row
    if near.sum() < 3:
        return rough
    mean = float(np.sum(step[near]) / np.sum(spacing[near]))
    expected = mean * spacing  # the turn of each step lies within half a turn of it
    turns = expected + np.angle(np.exp(1j * (step - expected)))
    phase = np.maximum.accumulate(np.concatenate([[0.0], np.cumsum(turns * np.sign(mean))]))
    starts = phase + 2 * np.pi <= phase[-1]
    if not starts.any():
        return rough
    return float(np.median(2 * np.pi / (np.interp(phase[starts] + 2 * np.pi, phase, t) - t[starts])))


def _levelled(plane: ComplexArray) -> ComplexArray | None:
    """Return a field (n,) about the centre of the ellipse through it, stretched to a circle; None without one."""
    scale = float(plane.std())
    if plane.size < 8 or scale == 0:
        return None
    mean = plane.mean()
    x, y = (plane - mean).real / scale, (plane - mean).imag / scale
    a, b, c, d, e = np.linalg.lstsq(np.column_stack([x * x, x * y, y * y, x, y]), np.ones_like(x), rcond=None)[0]
    form = np.array([[a, b / 2], [b / 2, c]])
    size, axes = np.linalg.eigh(form)
    if not (size[0] > 0 and size[1] < LONGEST_ELLIPSE**2 * size[0]):
        return None
    centre = -np.linalg.solve(2 * form, np.array([d, e]))
    round_ = (np.column_stack([x, y]) - centre) @ (axes * np.sqrt(size)) @ axes.T  # stretched without turning it
    return np.asarray(round_[:, 0] + 1j * round_[:, 1])


def _count(t: FloatArray, span: float) -> int:
    """Return how many rows a span is, odd and at least 3."""
    return max(3, min(t.size // 2, round(span / float(np.median(np.diff(t))))) | 1)


def _slope(t: FloatArray, rate: FloatArray, half: float) -> FloatArray:
    """Return the size of the rate's slope over twice ``half`` around each row, rad/s^2."""
    wide = _count(t, 2 * half)
    spacing = float(np.median(np.diff(t)))
    return np.asarray(np.abs(savgol_filter(rate, wide, 1, deriv=1, delta=spacing, mode="nearest")))


def _impacts(read: RawReadings, t: FloatArray) -> BoolArray:
    """Return the rows within `HALF` of an impact, (n,)."""
    hit = np.zeros(t.size, dtype=np.bool_)
    accel = read.readings.get("accelerometer")
    if accel is None:
        return hit
    sound = np.isfinite(accel.value).all(axis=1)
    time, force = accel.time[sound], accel.value[sound]
    if time.size < 2:
        return hit
    # over a gap a disc has turned on, and the force with it
    row = np.minimum(np.diff(time), 1.5 * float(np.median(np.diff(time))))
    jump = np.linalg.norm(np.diff(force, axis=0), axis=1) * row
    for moment in time[1:][jump > IMPACT]:
        hit |= np.abs(t - moment) <= HALF
    return hit
