"""The phase of the spin from the field in the disc's plane.

Takes a recording; gives phase (rad), rate (rad/s) and amplitude on a grid. Hard and soft iron are taken out by a conic
through the readings; the phase that is left is unwrapped about the expected rate and smoothed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import solveh_banded
from scipy.ndimage import median_filter
from scipy.signal import hilbert

from discsim.arrays import BoolArray, ComplexArray, FloatArray
from discsim.recording import Recording
from discsim.validation.identification.initial.smoothing import (
    FEWEST,
    SLOW,
    Readings,
    median_of,
    readings_for,
    smoothed,
)
from discsim.validation.identification.ordinary_errors import ordinary_sigma

__all__ = [
    "Spin",
    "centripetal_rate",
    "direction_of_spin",
    "expected_rate",
    "field_spin",
    "gaussian_kernel",
    "phase_spin",
    "rig_initial_states",
]

#: prior of the centre of the circle that the field runs, uT
_IRON = ordinary_sigma("circle of the field")
#: a sensor of whose readings fewer than this share are whole tells no course of the spin
_MOST = 0.9
#: of the smoothing of the spin's phase, s (one sigma)
PHASE_SIGMA = 0.05


#: of the smoothing of the spin rate given, s: lost readings make steps of phase that are no rate
RATE_SIGMA = 0.15

#: standard deviations of its noise below which a vector's phase says nothing: it is known to a third of a radian there
_TELLS = 3.0
#: standard deviation of a phase's step beyond which it is no rate, rad: one in ten is off by a radian
_STEPS_TELL = 0.6
#: median length of a pair of normal deviates, in standard deviations of one: sqrt(2 ln 2)
_MEDIAN = 1.18


class Spin(NamedTuple):
    """Angle turned by the field in the disc's plane, and what belongs to it.

    ``grid`` (n,) s; ``phase`` and ``rate`` (n,) of the turning vector, rad and rad/s; ``turning`` (n,) the rate
    between readings that were not lost silently, rad/s; ``amplitude`` (n,) its length;
    ``plane`` (m,) the readings' complex x + i y with iron removed, at the times ``t`` (m,).
    """

    grid: FloatArray
    phase: FloatArray
    rate: FloatArray
    turning: FloatArray
    amplitude: FloatArray
    t: FloatArray
    plane: ComplexArray

    def phase_at(self, t: FloatArray) -> FloatArray:
        """Return the phase (k,) at t (k,), which runs on at the last rate outside."""
        return _curve(self.grid, self.phase, self.rate, t)


def rig_initial_states(recording: Recording, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the yaw angle psi (k,) rad, unwrapped, and the rate r (k,) rad/s, at instants t (k,) s of a rig run.

    The axis points straight down. Without magnetometer psi counts from zero at the recording's start, or from where an
    axis that leans shows on board: all recordings of a rig lean the same way.
    """
    t = np.asarray(t, dtype=float)
    expected = expected_rate(recording)
    spin = phase_spin(recording, "magnetometer", expected, steady=True)
    if spin is None:
        grid = np.arange(0.0, max(recording.end, float(np.max(t, initial=0.0))) + 0.02, 0.01)
        r = np.zeros(grid.size) if expected is None else expected(grid)
        psi = cumulative_trapezoid(r, grid, initial=0)
        psi = psi - _lean(recording, grid, psi, r)
        return np.interp(t, grid, psi), np.interp(t, grid, r)
    north, east, _ = recording.environment.magnetic_field
    # m_B = C3(psi) B: the complex field in B is that in N times exp(-i psi)
    psi = np.arctan2(east, north) - spin.phase_at(t)
    return psi, -np.interp(t, spin.grid, spin.turning)


#: standard errors from which gravity that goes round on board is one; noise alone would turn where a run starts, which
#: nothing tells
_LEANS = 5.0


def _lean(recording: Recording, grid: FloatArray, psi: FloatArray, r: FloatArray) -> float:
    """Return the direction, rad, of the gravity that goes round on board of a rig whose axis leans; 0 without any.

    It is told from what stays on board: a bias, the pull to the axis and what changes of the rate give.
    """
    readings = readings_for(recording, "accelerometer", slice(0, 2))
    if readings is None or np.ptp(psi) < 2.0 * np.pi:
        return 0.0
    z = readings.value[:, 0] + 1j * readings.value[:, 1]
    rate, angle, slope = (np.interp(readings.t, grid, each) for each in (r, psi, np.gradient(r, grid)))
    columns = np.column_stack([np.ones_like(z), rate**2, slope, np.exp(-1j * angle)])
    found, *_ = np.linalg.lstsq(columns, z, rcond=None)
    scatter = float(np.sqrt(np.mean(np.abs(z - columns @ found) ** 2) / z.size))
    return float(np.angle(found[-1])) if abs(found[-1]) > _LEANS * scatter else 0.0


def field_spin(recording: Recording, *, steady: bool) -> Spin | None:
    """Return the spin as the magnetometer alone shows it; None where there are too few readings.

    ``steady`` tells that the axis stands still, so that the field's length across it is constant.
    """
    return phase_spin(replace(recording, samples={"magnetometer": recording.samples["magnetometer"]}), steady=steady)


def _curve(grid: FloatArray, value: FloatArray, slope: FloatArray, t: FloatArray) -> FloatArray:
    inside = np.clip(t, grid[0], grid[-1])
    ends = np.where(t < grid[0], slope[0], slope[-1])
    return np.asarray(CubicHermiteSpline(grid, value, slope)(inside) + ends * (t - inside))


def expected_rate(recording: Recording) -> Callable[[FloatArray], FloatArray] | None:
    """Return the spin rate as a function of time from a sensor that shows it directly, or None.

    A rate reference, an unclipped gyroscope, a command; each is trusted to a few per cent only.
    """
    for sensor, column in (("rate_reference", 0), ("gyroscope", 2)):
        samples = recording.get(sensor)
        readings = readings_for(recording, sensor, column)
        if samples is None or readings is None or readings.t.size < _MOST * len(samples):
            continue
        return _line(readings.t, readings.value)
    if recording.command is not None:
        return _line(recording.command.t, recording.command.value)
    return None


def _line(t: FloatArray, value: FloatArray) -> Callable[[FloatArray], FloatArray]:
    return lambda at: np.asarray(np.interp(at, t, value))


def centripetal_rate(recording: Recording) -> Callable[[FloatArray], FloatArray] | None:
    """Return the spin rate without its sign from the accelerometer's mean reading towards the axis, (12)."""
    readings = readings_for(recording, "accelerometer", slice(0, 2))
    position = recording.sheets["accelerometer"].position if readings is not None else None
    if readings is None or position is None or np.hypot(*position[:2]) < 1e-3:
        return None
    radius = float(np.hypot(*position[:2]))
    inward = -(readings.value @ position[:2]) / radius
    grid = np.arange(readings.t[0], readings.t[-1] + 0.05, 0.05)
    mean = smoothed(readings.t, inward, grid, 0.1)
    r = np.sqrt(np.maximum(mean, 0.0) / radius)
    return _line(grid, r)


def _conic(t: FloatArray, z: ComplexArray, knots: float, scale: float) -> tuple[ComplexArray, complex]:
    """Remove hard iron and the ellipse of soft iron from x + i y; return what is left (n,) and the centre.

    The conic ``z^T Q z - 2 b^T z = c(t)`` is linear in Q (trace 2), b and c; c changes slowly as the axis tilts.
    """
    x, y = z.real / scale, z.imag / scale
    count = max(1, round((t[-1] - t[0]) / knots))
    place = np.clip((t - t[0]) / max(t[-1] - t[0], 1e-9) * count, 0, count - 1e-9)
    k = place.astype(int)
    share = place - k
    A = np.column_stack([2 * x, 2 * y, -(x * x - y * y), -2 * x * y])
    target = x * x + y * y
    # priors of the centre and of the ellipse; the readings' own scatter about the conic is a few per cent
    prior = 0.05 / np.array([_IRON / scale, _IRON / scale, 0.15, 0.15])
    weight = np.ones(t.size)
    solution: FloatArray = np.zeros(4)

    def on_knots(value: FloatArray) -> FloatArray:
        """Return the sums of values (n,) over the hat function of each knot."""
        sums = np.bincount(k, value * (1 - share), count + 1) + np.bincount(k + 1, value * share, count + 1)
        return np.asarray(sums, dtype=float)

    for _ in range(4):
        # the hats meet their neighbours alone: their equations have three diagonals, and four columns beside
        band = np.zeros((2, count + 1))
        band[1] = np.bincount(k, weight * (1 - share) ** 2, count + 1) + 1e-6
        band[1] += np.bincount(k + 1, weight * share**2, count + 1)
        band[0, 1:] = np.bincount(k, weight * share * (1 - share), count)
        beside = np.stack([on_knots(weight * column) for column in A.T], axis=1)
        each = solveh_banded(band, np.column_stack([beside, on_knots(weight * target)]))
        normal = (A * weight[:, None]).T @ A + np.diag(prior**2) - beside.T @ each[:, :4]
        solution = np.asarray(np.linalg.solve(normal, A.T @ (weight * target) - beside.T @ each[:, 4]), dtype=float)
        level = each[:, 4] - each[:, :4] @ solution
        misfit = np.abs(target - A @ solution - (1 - share) * level[k] - share * level[k + 1])
        spread = 3.0 * float(np.median(misfit)) + 1e-6
        weight = 1 / (1 + (misfit / spread) ** 2)
    e = float(np.clip(solution[2], -0.6, 0.6)), float(np.clip(solution[3], -0.6, 0.6))
    Q = np.array([[1 + e[0], e[1]], [e[1], 1 - e[0]]])
    if np.linalg.det(Q) < 0.2:
        Q = np.eye(2)
    centre = np.linalg.solve(Q, solution[:2]) * scale
    values, vectors = np.linalg.eigh(Q / sqrt(np.linalg.det(Q)))
    root = vectors @ np.diag(np.sqrt(values)) @ vectors.T
    X, Y = z.real - centre[0], z.imag - centre[1]
    return (root[0, 0] * X + root[0, 1] * Y) + 1j * (root[1, 0] * X + root[1, 1] * Y), complex(*centre)


def gaussian_kernel(sigma: float, step: float) -> FloatArray:
    """Return a Gaussian (2 half + 1,) of height 1 on a grid, out to 3.5 sigma; both in s."""
    half = max(1, int(np.ceil(3.5 * sigma / step)))
    return np.asarray(np.exp(-0.5 * (np.arange(-half, half + 1) * step / sigma) ** 2))


def _spread(grid: FloatArray, t: FloatArray, value: ComplexArray, sigma: float) -> tuple[ComplexArray, FloatArray]:
    """Return Gaussian sums of value (n,) and of its weight on an even grid."""
    step = grid[1] - grid[0]
    slot = np.clip(np.rint((t - grid[0]) / step).astype(int), 0, grid.size - 1)
    sums = np.bincount(slot, value.real, grid.size) + 1j * np.bincount(slot, value.imag, grid.size)
    kernel = gaussian_kernel(sigma, step)
    if kernel.size > grid.size:
        kernel = kernel[(kernel.size - grid.size) // 2 :][: grid.size - (1 - grid.size % 2)]
    return (
        np.asarray(np.convolve(sums, kernel, "same")),
        np.asarray(np.convolve(np.bincount(slot, minlength=grid.size).astype(float), kernel, "same")),
    )


def phase_spin(
    recording: Recording,
    sensor: str = "magnetometer",
    expected: Callable[[FloatArray], FloatArray] | None = None,
    *,
    steady: bool,
) -> Spin | None:
    """Follow the phase of a vector that is fixed, or slow, in N: the field, or else the specific force.

    ``steady`` tells that the axis stands still, so that the vector's length across it is constant.
    """
    vector = _across_axis(recording, sensor)
    if vector is None or vector[0][-1] <= vector[0][0]:
        return None
    t, z, lone = vector
    step = float(np.median(np.diff(t)))
    grid = t[0] + step * np.arange(int(np.ceil((t[-1] - t[0]) / step - 1e-6)) + 1)
    if grid.size < FEWEST:
        return None
    field = float(np.linalg.norm(recording.environment.magnetic_field)) if sensor == "magnetometer" else 10.0
    rough = -expected(grid) if expected is not None else _rough_rate(grid, t, z - np.mean(z), step)
    if sensor == "magnetometer":
        typical = float(np.median(np.abs(rough)))
        knots = t[-1] - t[0] if steady else max(0.5, 4 * np.pi / max(typical, 0.1))
        plane, _ = _conic(t, z, knots, field)
    else:
        plane = _less_what_stands(t, z)
    rate = rough if expected is not None else _rough_rate(grid, t, plane, step)
    may_vanish = sensor == "magnetometer" and not steady
    if may_vanish and expected is None:
        rate = _bridged(grid, rate, _noise_of_steps(grid, rate, t, plane, step) < _STEPS_TELL)
    # the rate's course where another reading shows it better than the phase of a force that may vanish
    shape = rough if expected is not None and sensor == "accelerometer" else None
    if expected is None and not lone and (centripetal := centripetal_rate(recording)) is not None:
        own = centripetal(grid)
        if sensor == "magnetometer":
            rate = _unfolded(rate, own, step)
        else:
            rate = shape = _shaped(rate, own)
    # a force across the axis passes through zero and points the other way after: its square has no sign
    order, sigmas = (1, (3.0, 1.0, 1.0)) if sensor == "magnetometer" else (2, (2.0, 4.0, 6.0))
    phase, rate, amplitude = _followed(grid, rate, t, plane, order, sigmas, may_vanish)
    if lone and expected is None:
        # where the force vanishes, the phase of one axis is another's
        shape = np.polyval(np.polyfit(grid, rate, 2, w=amplitude), grid)
    if shape is not None and np.all(np.abs(shape) > SLOW):
        rate = shape * _weighted_median(rate / shape, amplitude)
        turned = cumulative_trapezoid(rate, dx=step, initial=0)
        phase = turned + _weighted_median(phase - turned, amplitude)
        return Spin(grid, phase, rate, rate, amplitude, t, plane)
    turning = _turning(grid, phase, rate, t, plane, step) if may_vanish else _without_steps(grid, rate, t, plane, step)
    return Spin(grid, phase, rate, turning, amplitude, t, plane)


def _followed(
    grid: FloatArray,
    rate: FloatArray,
    t: FloatArray,
    plane: ComplexArray,
    order: int,
    sigmas: tuple[float, ...],
    may_vanish: bool,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return phase, rate and length (n,) of a vector ``plane`` (m,) at t (m,), from a rough rate (n,).

    It is turned back, averaged over ``sigmas`` times `PHASE_SIGMA` in turn, and what it turns by still is added; of its
    power ``order``.
    """
    step = float(grid[1] - grid[0])
    smooth, phase, weight = np.zeros(grid.size, dtype=complex), np.zeros(grid.size), np.ones(grid.size)
    for sigma in sigmas:
        turned = cumulative_trapezoid(rate, dx=step, initial=0)
        base = plane * np.exp(-1j * _curve(grid, turned, rate, t))
        smooth, weight = _spread(grid, t, base**order, max(sigma * PHASE_SIGMA, 1.5 * step))
        told = _tells(grid, smooth, weight, t, base) if may_vanish else np.full(grid.size, fill_value=True)
        delta = _bridged(grid, np.angle(np.where(np.abs(smooth) > 0, smooth, 1.0)), told, np.unwrap) / order
        phase = turned + delta
        rate = rate + np.gradient(delta, step)
    return phase, rate, (np.abs(smooth) / np.maximum(weight, 1e-9)) ** (1 / order)


def _across_axis(recording: Recording, sensor: str) -> tuple[FloatArray, ComplexArray, bool] | None:
    """Return times (n,) and x + i y (n,) of a sensor, and if one axis alone tells them; None where none does."""
    readings = readings_for(recording, sensor, slice(0, 2))
    if sensor == "accelerometer":
        axes = [(alone, k) for k in (0, 1) if (alone := readings_for(recording, sensor, k)) is not None]
        alone, k = max(axes, key=lambda one: one[0].t.size, default=(None, 0))
        if alone is not None and (readings is None or readings.t.size < _MOST * alone.t.size):
            return (*_by_one_axis(alone, k, direction_of_spin(recording)), True)
    return None if readings is None else (readings.t, readings.value[:, 0] + 1j * readings.value[:, 1], False)


def _by_one_axis(alone: Readings, axis: int, direction: float) -> tuple[FloatArray, ComplexArray]:
    """Return times (n,) and x + i y (n,) of an accelerometer from its x (``axis`` 0) or y, and the sign of the spin.

    The pull to the axis may clip the other all along. A force that is slow in N turns once per turn, the way that the
    disc spins, so the swing of one axis tells both.
    """
    t = np.linspace(alone.t[0], alone.t[-1], alone.t.size)
    swings = _less_what_stands(t, np.asarray(np.interp(t, alone.t, alone.value), dtype=np.complex128)).real
    swing = np.asarray(hilbert(swings), dtype=np.complex128)
    # seen from the disc the force turns against the spin
    return t, np.asarray(1j**axis * (swing if direction < 0 else np.conj(swing)))


def direction_of_spin(recording: Recording) -> float:
    """Return the sign of the spin: of the gyroscope's clipped z, or of the stated release."""
    gyroscope = recording.get("gyroscope")
    if gyroscope is not None and np.any(np.isfinite(gyroscope.value[:, 2])):
        return 1.0 if float(np.nanmedian(gyroscope.value[:, 2])) >= 0 else -1.0
    if recording.release is not None and recording.release.body_rate is not None:
        return 1.0 if recording.release.body_rate[2] >= 0 else -1.0
    return 1.0


def _turning(
    grid: FloatArray, phase: FloatArray, rate: FloatArray, t: FloatArray, z: ComplexArray, step: float
) -> FloatArray:
    """Return the rate (n,) between readings that were not lost, of a vector z (m,) that may vanish for a while.

    Where steps tell no rate, what the phase turned by in the meantime does.
    """
    noise = _noise_of_steps(grid, rate, t, z, step)
    told = noise < _STEPS_TELL
    between = np.gradient(_bridged(grid, phase, told), step)
    return np.where(told, _without_steps(grid, rate, t, z, step, noise), between)


def _shaped(rate: FloatArray, own: FloatArray) -> FloatArray:
    """Return the course of the centripetal rate (n,), as fast as one of a force that may vanish across the axis."""
    ratio = rate / np.maximum(own, 1e-3)
    sign = np.sign(np.median(ratio)) or 1.0
    return np.asarray(own * sign * float(np.clip(np.median(np.abs(ratio)), 0.8, 1.25)))


def _tells(grid: FloatArray, smooth: ComplexArray, weight: FloatArray, t: FloatArray, base: ComplexArray) -> BoolArray:
    """Tell where (n,) a vector that turns no more, ``base`` (m,), is above its noise: its sums are ``smooth`` (n,).

    A field along the spin's axis leaves nothing in the disc's plane, and the phase of noise there.
    """
    mean = smooth / np.maximum(weight, 1e-9)
    noise = median_of(base - np.interp(t, grid, mean.real) - 1j * np.interp(t, grid, mean.imag)) / _MEDIAN
    # a Gaussian's square is a Gaussian narrower by the root of two
    return np.abs(smooth) > _TELLS * noise * np.sqrt(weight / sqrt(2.0))


def _noise_of_steps(grid: FloatArray, rate: FloatArray, t: FloatArray, z: ComplexArray, step: float) -> FloatArray:
    """Return the standard deviation (n,) rad that noise gives the phase from one reading to the next.

    Of a vector z (m,) that turns at a rate (n,); infinite where its length is nothing but noise.
    """
    gap = np.diff(t)
    turned = np.exp(1j * np.interp(0.5 * (t[1:] + t[:-1]), grid, rate) * gap)
    variance = 0.5 * (median_of((z[1:] - z[:-1] * turned)[gap < 1.5 * step]) / _MEDIAN) ** 2
    squares, weight = _spread(grid, t, np.abs(z) ** 2 + 0j, RATE_SIGMA)
    length = np.maximum(squares.real / np.maximum(weight, 1e-9) - 2.0 * variance, 0.0)
    return np.asarray(np.sqrt(np.divide(2.0 * variance, length, out=np.full(grid.size, np.inf), where=length > 0.0)))


def _bridged(
    grid: FloatArray,
    value: FloatArray,
    told: BoolArray,
    joined: Callable[[FloatArray], FloatArray] = lambda known: known,
) -> FloatArray:
    """Return values (n,), with straight lines across what is not ``told`` (n,), where that is not most of it."""
    if 2 * np.count_nonzero(told) < told.size or np.all(told):
        return joined(value)
    return np.asarray(np.interp(grid, grid[told], joined(value[told])))


def _less_what_stands(t: FloatArray, z: ComplexArray) -> ComplexArray:
    """Return what turns of a vector z (n,), less what stands still in B: that changes as the spin decays."""
    coarse = np.arange(t[0], t[-1] + 0.05, 0.05)
    still = smoothed(t, z, coarse, 0.3)
    return np.asarray(z - np.interp(t, coarse, still.real) - 1j * np.interp(t, coarse, still.imag))


def _weighted_median(value: FloatArray, weight: FloatArray) -> float:
    order = np.argsort(value)
    heavy = np.cumsum(weight[order])
    return float(value[order[min(int(np.searchsorted(heavy, 0.5 * heavy[-1])), value.size - 1)]])


def _without_steps(
    grid: FloatArray, rate: FloatArray, t: FloatArray, z: ComplexArray, step: float, noise: FloatArray | None = None
) -> FloatArray:
    """Return the turning rate (n,) less the steps of phase where readings were lost and the clock did not show it.

    ``noise`` (n,) rad is a step's standard deviation: steps within it are none, and where it is large all are noise.
    """
    gap, middle, turned = np.diff(t), 0.5 * (t[1:] + t[:-1]), z[1:] * np.conj(z[:-1])
    noise = np.zeros(grid.size) if noise is None else noise
    own = noise[np.clip(np.rint((middle - grid[0]) / step).astype(int), 0, grid.size - 1)]
    known = own < _STEPS_TELL
    if 2 * np.count_nonzero(known) > known.size:
        gap, middle, turned, own = gap[known], middle[known], turned[known], own[known]
    else:
        own = np.zeros(own.size)
    usual = median_filter(np.angle(turned) / gap, size=41, mode="nearest")
    odd = np.angle(turned * np.exp(-1j * usual * gap))
    lost = np.abs(odd) > np.maximum(np.maximum(0.5 * np.abs(usual) * step, 8 * median_of(odd) + 1e-9), _TELLS * own)
    if np.count_nonzero(lost) < 0.005 * lost.size or median_of(rate) * step < 0.15:
        return rate
    return smoothed(middle[~lost], (usual + odd / gap)[~lost], grid, RATE_SIGMA)


def _rough_rate(grid: FloatArray, t: FloatArray, z: ComplexArray, step: float) -> FloatArray:
    """Return the turning rate (n,) on the grid from the mean phase step of neighbours."""
    gap = np.diff(t)
    near = gap < 1.5 * step
    if np.count_nonzero(near) < 4:
        return np.zeros(grid.size)
    sums, _ = _spread(grid, 0.5 * (t[1:] + t[:-1])[near], (z[1:] * np.conj(z[:-1]))[near], 0.15)
    return np.asarray(np.angle(sums) / step)


def _unfolded(rate: FloatArray, expected: FloatArray, step: float) -> FloatArray:
    """Return the rate, by whole turns per sample nearest to what the accelerometer expects, of either sign.

    Only where the expectation is beyond the fold: a quarter less than half a turn per sample.
    """
    if float(np.median(expected)) * step < 0.75 * np.pi:
        return rate
    fold = 2 * np.pi / step
    both = []
    for sign in (1.0, -1.0):
        shifted = rate + fold * np.rint((sign * expected - rate) / fold)
        both.append((float(np.median(np.abs(shifted - sign * expected))), shifted))
    return min(both, key=lambda pair: pair[0])[1]
