"""Where a fit of short pieces starts: path, attitude and body rates at given instants, from the data alone.

Three steps, each with a fall-back where a sensor is missing. The angle turned about the spin axis, psi, comes from the
field in the disc's plane (`_spin`): hard iron and the ellipse of soft iron are taken out by a conic through the
readings. In the frame S, which does not spin (B turned back by psi), everything is slow: the transverse rates
of the gyroscope make the relative attitude D of S, and field and specific force are smoothed there. They are compared
with the field and with the path's acceleration less gravity in N (Wahba's problem), locally in time, so that sensors
whose clocks differ by some per cent still agree within each comparison.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import solveh_banded
from scipy.ndimage import median_filter

from discsim.arrays import BoolArray, FloatArray
from discsim.compiled import compiled
from discsim.disc import Release
from discsim.errors import InputError
from discsim.frames import attitude_matrix, body_to_ned, multiply, quaternion_from_matrix, rotation_vector, turn
from discsim.recording import Recording
from discsim.trajectory import predict

__all__ = [
    "Fixes",
    "Spin",
    "Starts",
    "field_spin",
    "flight_starts",
    "local_cubics",
    "path_fixes",
    "rig_starts",
    "spin_starts",
]

ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]

#: spacing of the instants at which attitudes are found before they are smoothed, s
GRID = 0.1
#: half a window of the path's fit, s: 9 fixes at 10 Hz
PATH_HALF = 0.45
#: fewest readings of a sensor that is used at all
FEWEST = 12
#: of the smoothing of the spin's phase, s (one sigma)
PHASE_SIGMA = 0.05
#: of the smoothing of the spin rate given, s: lost readings make steps of phase that are no rate
RATE_SIGMA = 0.15
#: of the smoothing of field and specific force in S, s
VECTOR_SIGMA = 0.15
#: slower than this, rad/s, an unclipped gyroscope tells the spin better than the field's phase, which precession
#: bends; up to the second, where the disc wobbles half as fast as it spins
SLOW, TUMBLING = 6.0, 20.0
#: over which a local attitude is averaged after the gyroscope's turning is taken out, s
ATTITUDE_SIGMA = 0.4
#: prior standard deviation of hard iron along the spin axis, uT, and of the field's gain
IRON_SD, GAIN_SD = 8.0, 0.06
#: a throw of which nothing is known: height and speed to the north, m and m/s
GUESSED_HEIGHT, GUESSED_SPEED = 1.3, 20.0
#: sensors that fly with the disc
ON_BOARD = ("magnetometer", "gyroscope", "accelerometer")
#: how much higher a predicted start is flown than it was thrown, m
HIGH = 1e4


class Starts(NamedTuple):
    """States at instants, for a fit to start from.

    ``t`` (k,) s in written time; ``position`` (k, 3) m and ``velocity`` (k, 3) m/s in N; ``attitude`` (k, 4)
    quaternions of C_NB; ``rate`` (k, 3) rad/s in B; ``ambiguous`` holds other attitudes (4,) worth trying at t[0].
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    attitude: FloatArray
    rate: FloatArray
    ambiguous: tuple[FloatArray, ...]


class _Readings(NamedTuple):
    t: FloatArray
    value: FloatArray


class Fixes(NamedTuple):
    """Fixes of a path: t (n,) s, position and velocity (n, 3) in N, the latter NaN where unknown, and their noise."""

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    position_sd: float
    velocity_sd: float


class _Felt(NamedTuple):
    """Specific force in S at the start, (n, 3) on ``grid`` (n,), and its first and second integral from the start."""

    grid: FloatArray
    force: FloatArray
    gained: FloatArray
    moved: FloatArray

    def integrals_at(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the second and the first integral (k, 3) at t, the force standing still outside the grid."""
        inside = np.clip(t, self.grid[0], self.grid[-1])
        outside = (t - inside)[:, None]
        force, gained, moved = (
            np.column_stack([np.interp(inside, self.grid, column) for column in part.T])
            for part in (self.force, self.gained, self.moved)
        )
        return moved + gained * outside + 0.5 * force * outside**2, gained + force * outside


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


class _Attitude(NamedTuple):
    """The frame that does not spin: ``psi`` and ``r`` on ``grid``; ``D`` (n, 4) turns S into S at the start.

    ``transverse`` (n,) is p + i q of the gyroscope, ``field`` the magnetometer's readings in B less the iron across
    the axis; both None where they are missing. ``tumbling`` tells that all three rates are the gyroscope's.
    """

    grid: FloatArray
    psi: FloatArray
    r: FloatArray
    D: FloatArray
    transverse: ComplexArray | None
    field: _Readings | None
    tumbling: bool = False

    def psi_at(self, t: FloatArray) -> FloatArray:
        """Return psi (k,) at t (k,), which runs on at the last rate outside."""
        inside = np.clip(t, self.grid[0], self.grid[-1])
        ends = np.where(t < self.grid[0], self.r[0], self.r[-1])
        return np.asarray(np.interp(inside, self.grid, self.psi) + ends * (t - inside))

    def D_at(self, t: FloatArray) -> FloatArray:
        """Return the relative attitudes (k, 4) of S at t (k,)."""
        return _between(self.grid, self.D, t)


# ---------------------------------------------------------------------------------------------- the three plants


def flight_starts(recording: Recording, t: FloatArray) -> Starts:
    """Return states at instants t (k,) s of a flight; always finite.

    Without GPS and track the path is dead reckoning from the stated release, or from a guess. Without path or
    accelerometer the attitude's turn about the field is the one that keeps the disc most level, unless the release
    states it; the others are in ``ambiguous``. With no sensor on board at all, the flight that the baseline predicts
    from a stated release is the start.
    """
    t = np.asarray(t, dtype=float)
    if not any(sensor in recording for sensor in ON_BOARD):
        predicted = _predicted(recording, t)
        if predicted is not None:
            return predicted
    frame = _frame(recording)
    grid = _even(t, recording)
    fixes = path_fixes(recording)
    felt = _felt(recording, frame)
    pair = None if fixes is None else _compared(fixes, felt, grid, recording.environment.gravity)
    normals = None if fixes is None or pair is None else _normals(recording, _path(fixes, None, grid)[1], pair[0])
    if fixes is not None and felt is not None and pair is not None and normals is not None:
        slip = _slip(frame, recording.environment.magnetic_field, grid, pair, normals)
        if slip is not None:
            felt = _turned_about_axis(felt, frame, -np.interp(felt.grid, grid, slip))
            pair = _compared(fixes, felt, grid, recording.environment.gravity)
    G, certain = _turned_to_ned(recording, frame, grid, pair, normals)
    attitude, rate = _states(recording, frame, grid, G, t)
    if felt is not None:
        felt = _in_ned(felt, grid, G, recording.environment.gravity)
    if fixes is not None:
        position, velocity = _path(fixes, felt, t)
    else:
        position, velocity = _dead_reckoning(recording, felt, t)
    return _finite(Starts(t, position, velocity, attitude, rate, () if certain else _others(recording, attitude[0])))


def _predicted(recording: Recording, t: FloatArray) -> Starts | None:
    """Return the states (k,) of the flight from a stated release, or None where that does not say enough to fly."""
    release, disc = recording.release, recording.disc
    if release is None or release.position is None or disc is None:
        return None
    # the ground is no end to a start: flown high above it, where the baseline's air is the same
    high = np.array([0.0, 0.0, -HIGH])
    try:
        aloft = replace(release, position=release.position + high)
        flight = predict(disc, recording.environment, aloft, duration=float(np.max(t, initial=0.0)) + GRID)
    except InputError:
        return None
    at = flight.at(np.maximum(t, 0.0))
    return Starts(t, at.position - high, at.velocity, at.attitude, at.rate, ())


def spin_starts(recording: Recording, t: FloatArray) -> Starts:
    """Return attitudes and rates at instants t (k,) s of a free spin; position and velocity are zero.

    The field alone cannot tell a turn about itself: the attitude given is the one that starts most level.
    """
    t = np.asarray(t, dtype=float)
    frame = _frame(recording)
    grid = _even(t, recording)
    G, _ = _turned_to_ned(recording, frame, grid, None, None)
    attitude, rate = _states(recording, frame, grid, G, t)
    nothing = np.zeros((t.size, 3))
    return _finite(Starts(t, nothing, nothing.copy(), attitude, rate, _others(recording, attitude[0])))


def rig_starts(recording: Recording, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the yaw angle psi (k,) rad, unwrapped, and the rate r (k,) rad/s, at instants t (k,) s of a rig run.

    The axis points straight down. Without magnetometer psi counts from zero at the recording's start.
    """
    t = np.asarray(t, dtype=float)
    expected = _expected_rate(recording)
    spin = _spin(recording, "magnetometer", expected, steady=True)
    if spin is None:
        grid = np.arange(0.0, max(recording.end, float(np.max(t, initial=0.0))) + 0.02, 0.01)
        r = np.zeros(grid.size) if expected is None else expected(grid)
        psi = _integral(grid, r)
        return np.interp(t, grid, psi), np.interp(t, grid, r)
    north, east, _ = recording.environment.magnetic_field
    # m_B = C3(psi) B: the complex field in B is that in N times exp(-i psi)
    psi = np.arctan2(east, north) - spin.phase_at(t)
    return psi, -np.interp(t, spin.grid, spin.turning)


def field_spin(recording: Recording, *, steady: bool) -> Spin | None:
    """Return the spin as the magnetometer alone shows it; None where there are too few readings.

    ``steady`` tells that the axis stands still, so that the field's length across it is constant.
    """
    return _spin(replace(recording, samples={"magnetometer": recording.samples["magnetometer"]}), steady=steady)


# ---------------------------------------------------------------------------------------------- readings


def _readings(recording: Recording, sensor: str, columns: slice | int = slice(None)) -> _Readings | None:
    """Return the readings of which every asked column is there and not clipped, or None for too few."""
    samples = recording.get(sensor)
    if samples is None:
        return None
    value = np.where(recording.sheets[sensor].clipped(samples.value), np.nan, samples.value)
    value = value.reshape(len(samples), -1)[:, columns]
    good = np.isfinite(value).reshape(len(samples), -1).all(axis=1)
    if np.count_nonzero(good) < FEWEST:
        return None
    return _Readings(samples.t[good], value[good])


def _even(t: FloatArray, recording: Recording) -> FloatArray:
    start = min(0.0, float(np.min(t, initial=0.0)))
    stop = max(recording.end, float(np.max(t, initial=0.0)), start + GRID)
    return np.linspace(start, stop, int(np.ceil((stop - start) / GRID)) + 1)


def _smoothed(t: FloatArray, value: FloatArray | ComplexArray, at: FloatArray, sigma: float) -> FloatArray:
    """Return values (n, k) smoothed by a Gaussian, evaluated at (m,) instants, linear near the ends of the data.

    A local straight line, so that a drift across an end or a gap does not bias.
    """
    out = np.empty((at.size, *value.shape[1:]), dtype=value.dtype)
    lo = np.searchsorted(t, at - 3.5 * sigma)
    hi = np.searchsorted(t, at + 3.5 * sigma)
    for i, instant in enumerate(at):
        first, last = int(lo[i]), int(hi[i])
        if last - first < 4:  # a gap, or outside: the nearest readings
            nearest = int(np.clip(np.searchsorted(t, instant), 2, max(t.size - 2, 2)))
            out[i] = np.mean(value[max(nearest - 2, 0) : nearest + 2], axis=0)
            continue
        x = (t[first:last] - instant) / sigma
        w = np.exp(-0.5 * x * x)
        w0, w1, w2 = w.sum(), w @ x, w @ (x * x)
        # the slope's ridge keeps one-sided windows from extrapolating noise
        out[i] = (w * (w2 + 0.05 * w0 - w1 * x)) @ value[first:last] / (w0 * (w2 + 0.05 * w0) - w1 * w1)
    return out


def _curve(grid: FloatArray, value: FloatArray, slope: FloatArray, t: FloatArray) -> FloatArray:
    inside = np.clip(t, grid[0], grid[-1])
    ends = np.where(t < grid[0], slope[0], slope[-1])
    return np.asarray(CubicHermiteSpline(grid, value, slope)(inside) + ends * (t - inside))


def _between(grid: FloatArray, q: FloatArray, t: FloatArray) -> FloatArray:
    """Return quaternions at t between neighbours (n, 4) that are close together."""
    k = np.clip(np.searchsorted(grid, t) - 1, 0, grid.size - 2)
    x = np.clip((t - grid[k]) / (grid[k + 1] - grid[k]), 0.0, 1.0)[:, None]
    mixed = (1 - x) * q[k] + x * q[k + 1]
    return np.asarray(mixed / np.linalg.norm(mixed, axis=1, keepdims=True))


# ---------------------------------------------------------------------------------------------- spin


def _expected_rate(recording: Recording) -> Callable[[FloatArray], FloatArray] | None:
    """Return the spin rate as a function of time from a sensor that shows it directly, or None.

    A rate reference, an unclipped gyroscope, a command; each is trusted to a few per cent only.
    """
    for sensor, column in (("rate_reference", 0), ("gyroscope", 2)):
        samples = recording.get(sensor)
        readings = _readings(recording, sensor, column)
        if samples is None or readings is None or readings.t.size < 0.9 * len(samples):
            continue
        return _line(readings.t, readings.value)
    if recording.command is not None:
        return _line(recording.command.t, recording.command.value)
    return None


def _line(t: FloatArray, value: FloatArray) -> Callable[[FloatArray], FloatArray]:
    return lambda at: np.asarray(np.interp(at, t, value))


def _centripetal(recording: Recording) -> Callable[[FloatArray], FloatArray] | None:
    """Return the spin rate without its sign from the accelerometer's mean reading towards the axis, (12)."""
    readings = _readings(recording, "accelerometer", slice(0, 2))
    position = recording.sheets["accelerometer"].position if readings is not None else None
    if readings is None or position is None or np.hypot(*position[:2]) < 1e-3:
        return None
    radius = float(np.hypot(*position[:2]))
    inward = -(readings.value @ position[:2]) / radius
    grid = np.arange(readings.t[0], readings.t[-1] + 0.05, 0.05)
    mean = _smoothed(readings.t, inward, grid, 0.1)
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
    # priors: 15 uT of hard iron, 0.1 of ellipse; the readings' own scatter about the conic is a few per cent
    prior = 0.05 / np.array([15.0 / scale, 15.0 / scale, 0.15, 0.15])
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


def _kernel(sigma: float, step: float) -> FloatArray:
    half = max(1, int(np.ceil(3.5 * sigma / step)))
    return np.asarray(np.exp(-0.5 * (np.arange(-half, half + 1) * step / sigma) ** 2))


def _spread(grid: FloatArray, t: FloatArray, value: ComplexArray, sigma: float) -> tuple[ComplexArray, FloatArray]:
    """Return Gaussian sums of value (n,) and of its weight on an even grid."""
    step = grid[1] - grid[0]
    slot = np.clip(np.rint((t - grid[0]) / step).astype(int), 0, grid.size - 1)
    sums = np.bincount(slot, value.real, grid.size) + 1j * np.bincount(slot, value.imag, grid.size)
    kernel = _kernel(sigma, step)
    if kernel.size > grid.size:
        kernel = kernel[(kernel.size - grid.size) // 2 :][: grid.size - (1 - grid.size % 2)]
    return (
        np.asarray(np.convolve(sums, kernel, "same")),
        np.asarray(np.convolve(np.bincount(slot, minlength=grid.size).astype(float), kernel, "same")),
    )


def _spin(
    recording: Recording,
    sensor: str = "magnetometer",
    expected: Callable[[FloatArray], FloatArray] | None = None,
    *,
    steady: bool,
) -> Spin | None:
    """Follow the phase of a vector that is fixed, or slow, in N: the field, or else the specific force.

    ``steady`` tells that the axis stands still, so that the vector's length across it is constant.
    """
    readings = _readings(recording, sensor, slice(0, 2))
    if readings is None or readings.t[-1] <= readings.t[0]:
        return None
    t, z = readings.t, readings.value[:, 0] + 1j * readings.value[:, 1]
    step = float(np.median(np.diff(t)))
    grid = t[0] + step * np.arange(int(np.ceil((t[-1] - t[0]) / step - 1e-6)) + 1)
    if grid.size < FEWEST:
        return None
    field = float(np.linalg.norm(recording.environment.magnetic_field)) if sensor == "magnetometer" else 10.0
    rough = -expected(grid) if expected is not None else _rough_rate(grid, t, z - np.mean(z), step)
    typical = float(np.median(np.abs(rough)))
    if sensor == "magnetometer":
        knots = t[-1] - t[0] if steady else max(0.5, 4 * np.pi / max(typical, 0.1))
        plane, _ = _conic(t, z, knots, field)
    else:
        # a straight line for what stands still in B: it changes as the spin decays
        coarse = np.arange(grid[0], grid[-1] + 0.05, 0.05)
        still = _smoothed(t, z, coarse, 0.3)
        plane = z - np.interp(t, coarse, still.real) - 1j * np.interp(t, coarse, still.imag)
    rate = rough if expected is not None else _rough_rate(grid, t, plane, step)
    # the rate's course where another reading shows it better than the phase of a force that may vanish
    shape = rough if expected is not None and sensor == "accelerometer" else None
    if expected is None and (centripetal := _centripetal(recording)) is not None:
        own = centripetal(grid)
        if sensor == "magnetometer":
            rate = _unfolded(rate, own, step)
        else:
            # the specific force across the axis may vanish: the shape of the rate is the centripetal one's
            ratio = rate / np.maximum(own, 1e-3)
            sign = np.sign(np.median(ratio)) or 1.0
            rate = own * sign * float(np.clip(np.median(np.abs(ratio)), 0.8, 1.25))
            shape = rate
    smooth = np.zeros(grid.size, dtype=complex)
    phase = np.zeros(grid.size)
    weight = np.ones(grid.size)
    # a force across the axis passes through zero and points the other way after: its square has no sign
    order, sigmas = (1, (3.0, 1.0, 1.0)) if sensor == "magnetometer" else (2, (2.0, 4.0, 6.0))
    for sigma in sigmas:
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * step)])
        base = plane * np.exp(-1j * _curve(grid, turned, rate, t))
        smooth, weight = _spread(grid, t, base**order, max(sigma * PHASE_SIGMA, 1.5 * step))
        delta = np.unwrap(np.angle(np.where(np.abs(smooth) > 0, smooth, 1.0))) / order
        phase = turned + delta
        rate = rate + np.gradient(delta, step)
    amplitude = (np.abs(smooth) / np.maximum(weight, 1e-9)) ** (1 / order)
    if shape is not None and np.all(np.abs(shape) > SLOW):
        rate = shape * _weighted_median(rate / shape, amplitude)
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * step)])
        phase = turned + _weighted_median(phase - turned, amplitude)
        return Spin(grid, phase, rate, rate, amplitude, t, plane)
    return Spin(grid, phase, rate, _without_steps(grid, rate, t, plane, step), amplitude, t, plane)


def _weighted_median(value: FloatArray, weight: FloatArray) -> float:
    order = np.argsort(value)
    heavy = np.cumsum(weight[order])
    return float(value[order[min(int(np.searchsorted(heavy, 0.5 * heavy[-1])), value.size - 1)]])


def _without_steps(grid: FloatArray, rate: FloatArray, t: FloatArray, z: ComplexArray, step: float) -> FloatArray:
    """Return the turning rate (n,) less the steps of phase where readings were lost and the clock did not show it."""
    gap = np.diff(t)
    middle = 0.5 * (t[1:] + t[:-1])
    usual = median_filter(np.angle(z[1:] * np.conj(z[:-1])) / gap, size=41, mode="nearest")
    odd = np.angle(z[1:] * np.conj(z[:-1]) * np.exp(-1j * usual * gap))
    lost = np.abs(odd) > np.maximum(0.5 * np.abs(usual) * step, 8 * _median(odd) + 1e-9)
    if np.count_nonzero(lost) < 0.005 * lost.size or _median(rate) * step < 0.15:
        return rate
    return _smoothed(middle[~lost], (usual + odd / gap)[~lost], grid, RATE_SIGMA)


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


# ---------------------------------------------------------------------------------------------- the slow frame


@compiled
def _composed(step: FloatArray) -> FloatArray:
    """Return attitudes (n + 1, 4) after rotation vectors (n, 3), each in the frame reached, from the identity."""
    out = np.empty((step.shape[0] + 1, 4))
    w, x, y, z = 1.0, 0.0, 0.0, 0.0
    out[0] = np.array([w, x, y, z])
    for i in range(step.shape[0]):
        a, b, c = step[i, 0], step[i, 1], step[i, 2]
        angle = sqrt(a * a + b * b + c * c)
        f = sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
        s, a, b, c = cos(0.5 * angle), f * a, f * b, f * c
        w, x, y, z = (
            w * s - x * a - y * b - z * c,
            w * a + x * s + y * c - z * b,
            w * b - x * c + y * s + z * a,
            w * c + x * b - y * a + z * s,
        )
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2], out[i + 1, 3] = w, x, y, z
    return out


def _frame(recording: Recording) -> _Attitude:
    """Return psi, r and the relative attitude of the frame that does not spin over the whole recording."""
    expected = _expected_rate(recording)
    gyroscope = _readings(recording, "gyroscope", slice(0, 2))
    if gyroscope is not None and expected is not None:
        own = expected(gyroscope.t)
        wobble = _median(np.hypot(*gyroscope.value.T))
        if _median(own) < SLOW or _median(own) < min(2 * wobble, TUMBLING):
            return _slow_frame(recording, gyroscope, own)
    spin = _spin(recording, "magnetometer", expected, steady=False)
    field = None
    if spin is not None:
        full = _readings(recording, "magnetometer")
        if full is not None:
            across = np.interp(full.t, spin.t, spin.plane.real), np.interp(full.t, spin.t, spin.plane.imag)
            field = _Readings(full.t, np.column_stack([*across, full.value[:, 2]]))
    else:
        spin = _spin(recording, "accelerometer", expected, steady=False)
    if gyroscope is not None:
        grid = gyroscope.t
    else:
        grid = spin.grid if spin is not None else np.arange(0.0, max(recording.end, 1.0), 0.01)
    if spin is None:
        r = np.zeros(grid.size) if expected is None else expected(grid)
        if expected is None and (centripetal := _centripetal(recording)) is not None:
            r = _sign(recording) * centripetal(grid)
        psi = _integral(grid, r)
    else:
        psi, r = -spin.phase_at(grid), -np.interp(grid, spin.grid, spin.turning)
    if gyroscope is None:
        identity = np.tile([1.0, 0.0, 0.0, 0.0], (grid.size, 1))
        return _Attitude(grid, psi, _calm(grid, r), identity, None, field)
    w = gyroscope.value[:, 0] + 1j * gyroscope.value[:, 1]
    if abs(psi[-1] - psi[0]) > 10 * np.pi:
        w = w - np.mean(w)  # over many turns p and q average to the sensor's bias
    if field is not None and spin is not None:
        psi, r = _without_precession(recording, spin, grid, psi, r, w)
        if expected is not None:
            # what the field adds to the gyroscope's own angle is slow: its gain and its clock
            coarse, own = np.linspace(grid[0], grid[-1], max(2, int((grid[-1] - grid[0]) / 0.05))), expected(grid)
            added = _smoothed(grid, psi - _integral(grid, own), coarse, 0.3)
            psi = _integral(grid, own) + np.interp(grid, coarse, added)
            r = own + np.interp(grid, coarse, np.gradient(added, coarse))
    return _Attitude(grid, psi, _calm(grid, r), _despun(grid, psi, w), w, field)


def _slow_frame(recording: Recording, gyroscope: _Readings, r: FloatArray) -> _Attitude:
    """Return the frame of a disc that turns slowly, from the gyroscope alone; iron from a field that stands still."""
    grid, w = gyroscope.t, gyroscope.value[:, 0] + 1j * gyroscope.value[:, 1]
    psi = _integral(grid, r)
    frame = _Attitude(grid, psi, r, _despun(grid, psi, w), w, None, tumbling=True)
    readings = _readings(recording, "magnetometer")
    if readings is None:
        return frame
    strength = float(np.linalg.norm(recording.environment.magnetic_field))
    about = frame.psi_at(readings.t)[:, None] * np.array([0.0, 0.0, 1.0])
    C = body_to_ned(multiply(frame.D_at(readings.t), turn(about)))
    # C (m - b) = m_0: linear in b and m_0, whose length is drawn to the field's
    iron, still = np.zeros(3), np.mean(np.einsum("nij,nj->ni", C, readings.value), axis=0)
    rows = np.concatenate([C, np.broadcast_to(np.eye(3), C.shape)], axis=2).reshape(-1, 6)
    target = np.einsum("nij,nj->ni", C, readings.value).ravel()
    share = len(rows) / 60.0  # the gyroscope's drift makes errors of readings nearby the same
    for _ in range(5):
        n = still / max(float(np.linalg.norm(still)), 1e-9)
        information = rows.T @ rows / (share * (0.06 * strength) ** 2)
        pull = rows.T @ target / (share * (0.06 * strength) ** 2)
        information[:3, :3] += np.eye(3) / IRON_SD**2
        information[3:, 3:] += np.outer(n, n) / (0.05 * strength) ** 2 + 1e-9 * np.eye(3)
        pull[3:] += n * strength / (0.05 * strength) ** 2
        solution = np.linalg.solve(information, pull)
        iron, still = solution[:3], solution[3:]
    return frame._replace(field=_Readings(readings.t, readings.value - iron))


def _median(value: FloatArray) -> float:
    return float(np.median(np.abs(value)))


def _integral(grid: FloatArray, r: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] + r[:-1]) * np.diff(grid))])


def _calm(grid: FloatArray, r: FloatArray) -> FloatArray:
    """Return a rate (n,) without its changes within a tenth of a second."""
    coarse = np.linspace(grid[0], grid[-1], max(2, int((grid[-1] - grid[0]) / 0.05)))
    return np.asarray(np.interp(grid, coarse, _smoothed(grid, r, coarse, RATE_SIGMA)))


def _despun(grid: FloatArray, psi: FloatArray, w: ComplexArray) -> FloatArray:
    """Return the relative attitudes (n, 4) of S from p + i q (n,)."""
    W = w * np.exp(1j * psi)
    middle = 0.5 * (W[1:] + W[:-1]) * np.diff(grid)
    return _composed(np.column_stack([middle.real, middle.imag, np.zeros(middle.size)]))


def _sign(recording: Recording) -> float:
    """Return the direction of spin: of the gyroscope's clipped z, or of the stated release."""
    gyroscope = recording.get("gyroscope")
    if gyroscope is not None and np.any(np.isfinite(gyroscope.value[:, 2])):
        return 1.0 if float(np.nanmedian(gyroscope.value[:, 2])) >= 0 else -1.0
    if recording.release is not None and recording.release.body_rate is not None:
        return 1.0 if recording.release.body_rate[2] >= 0 else -1.0
    return 1.0


def _without_precession(
    recording: Recording, spin: Spin, grid: FloatArray, psi: FloatArray, r: FloatArray, w: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Return psi and r without the turning of the field's phase by p and q: m_z (p m_x + q m_y)/(m_x^2 + m_y^2)."""
    axial = _readings(recording, "magnetometer", 2)
    if axial is None:
        return psi, r
    across = np.interp(grid, spin.grid, spin.amplitude)
    strength = float(np.linalg.norm(recording.environment.magnetic_field))
    along = _smoothed(axial.t, axial.value, spin.grid[::10], 0.1)
    m_z = np.clip(np.interp(grid, spin.grid[::10], along), -strength, strength)
    # below a tenth of the field the phase is noise and the term has a pole
    eta = (w * np.exp(1j * psi)).real * m_z / np.maximum(across, 0.1 * strength)
    added = np.concatenate([[0.0], np.cumsum(0.5 * (eta[1:] + eta[:-1]) * np.diff(grid))])
    step = float(np.median(np.diff(grid)))
    kernel = _kernel(PHASE_SIGMA, step)
    if kernel.size < grid.size:
        eta = np.convolve(eta, kernel, "same") / np.convolve(np.ones(eta.size), kernel, "same")
    return psi + added, r + eta


# ---------------------------------------------------------------------------------------------- attitude


def _turned_to_ned(
    recording: Recording,
    frame: _Attitude,
    grid: FloatArray,
    pair: tuple[FloatArray, FloatArray | None] | None,
    normals: FloatArray | None,
) -> tuple[FloatArray, bool]:
    """Return C (n, 3, 3) from S at the start to N, found locally at the instants of ``grid``, and if it is unique.

    With a perfect gyroscope all would be the same matrix. ``pair`` holds the specific force in N and in S at the start,
    ``normals`` (n, 3) what the path says of the spin axis, which stands in for a sensor that is missing.
    """
    field = recording.environment.magnetic_field
    force, felt = (None, None) if pair is None else pair
    # a turn or so, except that at a slow spin nothing needs to average out
    fast = _median(frame.r)
    sigma = float(np.clip(3.0 / max(fast, 0.1), VECTOR_SIGMA, 0.4)) if fast > SLOW else VECTOR_SIGMA
    axis = body_to_ned(frame.D_at(grid))[:, :, 2]
    magnetic = None if frame.field is None else _field_in_start(frame.field, frame, grid, sigma)
    if magnetic is not None:
        wandering = frame.transverse is None
        magnetic = _without_axial_iron(magnetic, axis, field, felt, force, wandering=wandering)
    sigma = ATTITUDE_SIGMA if frame.transverse is not None else GRID
    if felt is not None and force is not None:
        if magnetic is None and normals is not None:
            return _fitted_turns(axis, felt, normals, force, sigma), False
        return _fitted_turns(magnetic, felt, field, force, sigma), magnetic is not None
    if normals is not None:
        # the lift's size on both sides weighs its direction
        lift = np.linalg.norm(normals, axis=1, keepdims=True)
        return _fitted_turns(magnetic, axis * lift, field, normals, sigma), False
    if magnetic is None:
        return _level(recording, frame, grid), False
    # one direction: in S at the start the field stands still, so all instants share it
    turns = np.array([_level_about(mean, field, axis[0]) for mean in _windowed(magnetic, 1.0)])
    return _stated_turn(recording, frame, _connected(turns, field), field), False


def _fitted_turns(
    m: FloatArray | None, f: FloatArray, field: FloatArray, force: FloatArray, sigma: float
) -> FloatArray:
    """Return the rotations (n, 3, 3) that take m and f to field and force, each averaged over ``sigma`` s.

    An instant whose force departs from its neighbours' rotation (a knock, an end of the path) loses its say.
    """
    say = np.ones(len(f))
    turns = np.empty((0, 3, 3))
    for width in (3 * sigma, 2 * sigma, sigma):
        K = _pairs(m, f, field, force, say)
        whole = _rotations(np.sum(K, axis=0, keepdims=True))
        # the force alone leaves a turn about itself, which only its motion over the whole flight tells
        turns = _rotations(_windowed(K, width) + (0.05 * whole if m is None else 1e-6 * whole))
        turned = np.einsum("nij,nj->ni", turns, f)
        apart = np.linalg.norm(np.cross(turned, force), axis=1) / np.maximum(
            np.linalg.norm(f, axis=1) * np.linalg.norm(force, axis=1), 1e-9
        )
        say = 1 / (1 + (apart / max(0.05, 2 * float(np.median(apart)))) ** 2)
    return turns


def _slip(
    frame: _Attitude,
    field: FloatArray,
    grid: FloatArray,
    pair: tuple[FloatArray, FloatArray | None],
    normals: FloatArray,
) -> FloatArray | None:
    """Return by how much (n,) rad the accelerometer's phase runs ahead of the magnetometer's, or None where it is not.

    Where clocks differ, or readings were lost, one slips against the other. The angle from field to force in the
    disc's plane, which path and lift foretell, shows it; what changes by less than half a radian is left alone, for
    wind and iron make as much.
    """
    force, felt = pair
    if frame.field is None or felt is None or grid.size < 5:
        return None
    m = _field_in_start(frame.field, frame, grid, VECTOR_SIGMA)
    axis = body_to_ned(frame.D_at(grid))[:, :, 2]
    a, b = _from_to(m, felt, axis), _from_to(np.broadcast_to(field, m.shape), force, normals)
    product, level = a * np.conj(b), np.abs(a * b)
    # a steady slip first: 7 rad/s are 2 % of the fastest spin, or 10 % of readings lost at an ordinary one
    trial = np.linspace(-7.0, 7.0, 281)
    sums = np.abs(np.exp(-1j * trial[:, None] * grid) @ product)
    steady = float(trial[np.argmax(sums)]) * grid
    rest = _windowed(product * np.exp(-1j * steady), 0.5)
    if np.median(np.abs(rest)) < 0.7 * np.median(_windowed(level, 0.5)):
        return None
    angle = np.asarray(steady + np.unwrap(np.angle(np.where(np.abs(rest) > 0, rest, 1.0))))
    # by whole turns nearest to none at the start, where no time has passed to slip in
    angle -= 2 * np.pi * np.rint(angle[0] / (2 * np.pi))
    return angle if float(np.ptp(angle)) > 0.5 else None


def _turned_about_axis(felt: _Felt, frame: _Attitude, angle: FloatArray) -> _Felt:
    """Return a force felt turned about the spin axis by an angle (n,) rad on its grid."""
    axis = body_to_ned(frame.D_at(felt.grid))[:, :, 2]
    return _integrated(felt.grid, np.einsum("nij,nj->ni", body_to_ned(turn(angle[:, None] * axis)), felt.force))


def _from_to(m: FloatArray, f: FloatArray, axis: FloatArray) -> ComplexArray:
    """Return the components of f (n, 3) along and to the right of m across the axis, as one complex number (n,)."""
    z = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-9)
    x = m - np.sum(m * z, axis=1, keepdims=True) * z
    x = x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-9)
    return np.asarray(np.sum(x * f, axis=1) + 1j * np.sum(np.cross(z, x) * f, axis=1))


def _normals(recording: Recording, velocity: FloatArray, force: FloatArray) -> FloatArray | None:
    """Return the spin axis in N (n, 3), as long as the lift's share of the specific force (n, 3), from a path alone.

    Lift is across the airspeed, in its plane with the axis, and its size tells the angle of attack, (20), (21). Lift
    is taken to point away from z_B. None where the disc's aerodynamics are unknown.
    """
    disc, density = recording.disc, recording.environment.air_density
    if disc is None or disc.aero is None or density is None:
        return None
    relative = velocity - recording.environment.wind
    speed = np.maximum(np.linalg.norm(relative, axis=1, keepdims=True), 1.0)
    along = relative / speed
    across = force - np.sum(force * along, axis=1, keepdims=True) * along
    lift = np.linalg.norm(across, axis=1, keepdims=True)
    alpha = np.linspace(-0.3, 0.6, 181)
    CL = disc.aero.CL0 + disc.aero.CLa * alpha
    if disc.aero_table is not None:
        CL = np.interp(alpha, disc.aero_table.alpha, disc.aero_table.CL)
    needed = lift * disc.mass / (0.5 * density * speed**2 * disc.area)
    found = alpha[np.argmin(np.abs(CL[None, :] - needed), axis=1)][:, None]
    z = -np.cos(found) * across / np.maximum(lift, 1e-6) + np.sin(found) * along
    return np.asarray(z * np.minimum(lift, 20.0))


def _field_in_start(field: _Readings, frame: _Attitude, grid: FloatArray, sigma: float) -> FloatArray:
    """Return the field, smoothed, in S at the start, (n, 3)."""
    t, value = field
    plane = (value[:, 0] + 1j * value[:, 1]) * np.exp(1j * frame.psi_at(t))
    C = body_to_ned(frame.D_at(t))
    vector = np.einsum("nij,nj->ni", C, np.column_stack([plane.real, plane.imag, value[:, 2]]))
    return _smoothed(t, vector, grid, sigma)


def _force_in_start(recording: Recording, frame: _Attitude, grid: FloatArray, sigma: float) -> FloatArray | None:
    """Return the specific force of the centre, smoothed, in S at the start, (n, 3); None where it cannot be told.

    Around each instant, by least squares, f_x + i f_y = c + F exp(-i psi): c is what the sensor's place and bias make
    and stands still in B, F what stands still in S. So a clipped axis leaves the other one to tell F.
    """
    samples = recording.get("accelerometer")
    if samples is None:
        return None
    sheet = recording.sheets["accelerometer"]
    lost = sheet.clipped(samples.value) | ~np.isfinite(samples.value) | _stuck(samples.value, sheet.resolution or 0.0)
    x, y, z = np.where(lost, 0.0, samples.value).T
    seen = (~lost).astype(float)
    if np.count_nonzero(seen[:, 2]) < FEWEST or np.count_nonzero(seen[:, 0] + seen[:, 1]) < FEWEST:
        return None
    t = samples.t
    c, s = np.cos(frame.psi_at(t)), np.sin(frame.psi_at(t))
    one, zero = np.ones(t.size), np.zeros(t.size)
    rows = (np.stack([one, zero, c, s], axis=1), np.stack([zero, one, -s, c], axis=1))
    products = [
        np.concatenate([(a[:, :, None] * a[:, None, :]).reshape(-1, 16), a * value[:, None]], axis=1) * weight[:, None]
        for a, value, weight in zip(rows, (x, y), (seen[:, 0], seen[:, 1]), strict=True)
    ]
    sums = _sums(t, np.column_stack([products[0] + products[1], z, seen[:, 2]]), grid, sigma)
    r = np.interp(grid, frame.grid, frame.r)
    place = np.zeros(2) if sheet.position is None else sheet.position[:2]
    still = -(r**2)[:, None] * place
    # prior of c: a sixth of the centripetal share (1.5 mm in 16) and a bias of 1 m/s^2; of F: 20 m/s^2
    precision = 1 / (1.0 + 0.15 * np.linalg.norm(still, axis=1)) ** 2
    information = sums[:, :16].reshape(-1, 4, 4) + 1e-3 * np.eye(4)
    information[:, 0, 0] += precision
    information[:, 1, 1] += precision
    pull = sums[:, 16:20].copy()
    pull[:, :2] += precision[:, None] * still
    solution = np.linalg.solve(information, pull[:, :, None])[:, :, 0]
    along = sums[:, 20] / np.maximum(sums[:, 21], 1e-9)
    vector = np.column_stack([solution[:, 2:], along])
    vector[sums[:, 21] < 2.0] = 0.0  # nothing read here: a vector without length has no weight
    return np.asarray(np.einsum("nij,nj->ni", body_to_ned(frame.D_at(grid)), vector))


def _felt(recording: Recording, frame: _Attitude) -> _Felt | None:
    """Return the specific force in S at the start and its integrals over the recording."""
    if frame.tumbling:
        return _felt_tumbling(recording, frame)
    # as local as a turn allows: the integrals average it anyway
    sigma = float(np.clip(3.0 / max(_median(frame.r), 0.1), 0.03, VECTOR_SIGMA))
    grid = np.arange(0.0, recording.end + sigma, sigma)
    force = _force_in_start(recording, frame, grid, sigma)
    return None if force is None else _integrated(grid, force)


def _felt_tumbling(recording: Recording, frame: _Attitude) -> _Felt | None:
    """Return the force of a disc whose three rates are known: each reading less what the sensor's place makes."""
    readings = _readings(recording, "accelerometer")
    if readings is None or frame.transverse is None:
        return None
    place = recording.sheets["accelerometer"].position
    d = np.zeros(3) if place is None else np.asarray(place)
    w = np.column_stack([frame.transverse.real, frame.transverse.imag, frame.r])
    w = np.column_stack([np.interp(readings.t, frame.grid, column) for column in w.T])
    # (1): what is left of the reading at the centre
    force = readings.value - np.cross(w, np.cross(w, d)) - np.cross(np.gradient(w, readings.t, axis=0), d)
    about = frame.psi_at(readings.t)[:, None] * np.array([0.0, 0.0, 1.0])
    C = body_to_ned(multiply(frame.D_at(readings.t), turn(about)))
    return _integrated(readings.t, np.einsum("nij,nj->ni", C, force))


def _integrated(grid: FloatArray, force: FloatArray) -> _Felt:
    step = np.diff(grid)[:, None]
    gained = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (force[1:] + force[:-1]) * step, axis=0)])
    # trapezoids of the first integral, with the parabola that a straight force makes
    steps = gained[:-1] * step + (2 * force[:-1] + force[1:]) * step**2 / 6
    return _Felt(grid, force, gained, np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]))


def _in_ned(felt: _Felt, grid: FloatArray, G: FloatArray, gravity: float) -> _Felt:
    """Return the acceleration in N, and its integrals, that attitudes G (n, 3, 3) on ``grid`` make of a force felt."""
    nearest = np.clip(np.rint((felt.grid - grid[0]) / (grid[1] - grid[0])).astype(int), 0, grid.size - 1)
    # a wrong reading must not carry the disc away: the specific force of a throw is below 4 g
    size = np.linalg.norm(felt.force, axis=1, keepdims=True)
    force = felt.force * np.minimum(1.0, 40.0 / np.maximum(size, 1e-9))
    return _integrated(felt.grid, np.einsum("nij,nj->ni", G[nearest], force) + np.array([0.0, 0.0, gravity]))


def _stuck(value: FloatArray, resolution: float) -> BoolArray:
    """Tell which readings (n, k) stand at an axis's own extreme again and again: it clips below its stated range."""
    top = np.nanmax(np.where(np.isfinite(value), np.abs(value), 0.0), axis=0)
    at_top = np.abs(value) >= top - 0.5 * resolution - 1e-9
    # of noisy readings that are rounded only a few share the largest value
    return np.asarray(at_top & (np.count_nonzero(at_top, axis=0) > max(8, 0.02 * len(value))))


def _sums(t: FloatArray, columns: FloatArray, at: FloatArray, sigma: float) -> FloatArray:
    """Return sums (m, k) of columns (n, k) with Gaussian weights around the instants (m,)."""
    lo, hi = np.searchsorted(t, at - 3.5 * sigma), np.searchsorted(t, at + 3.5 * sigma)
    out = np.zeros((at.size, columns.shape[1]))
    for i, instant in enumerate(at):
        x = (t[lo[i] : hi[i]] - instant) / sigma
        out[i] = np.exp(-0.5 * x * x) @ columns[lo[i] : hi[i]]
    return out


def _without_axial_iron(
    m: FloatArray,
    axis: FloatArray,
    field: FloatArray,
    felt: FloatArray | None,
    force: FloatArray | None,
    *,
    wandering: bool,
) -> FloatArray:
    """Return the field (n, 3) without the hard iron along the axis, which no turning shows.

    Least squares over that iron and a gain: the field has its stated length, makes its stated angle with the specific
    force, and stands still (not where the frame wanders for want of a gyroscope).
    """
    strength = float(np.linalg.norm(field))
    x = np.array([0.0, 1.0])
    known = None
    if felt is not None and force is not None:
        f = felt / np.maximum(np.linalg.norm(felt, axis=1, keepdims=True), 1e-6)
        g = force / np.maximum(np.linalg.norm(force, axis=1, keepdims=True), 1e-6)
        # a small force has no direction worth the name
        known = f, g @ field, np.minimum(np.linalg.norm(force, axis=1) / 5.0, 1.0)
    scale = 1 / sqrt(len(m) / 8.0)  # neighbours share their errors: about eight are independent

    def errors(x: FloatArray) -> FloatArray:
        u = x[1] * (m - x[0] * axis)
        parts = [(np.linalg.norm(u, axis=1) - strength) / (0.04 * strength) * scale]
        if known is not None:
            parts.append((np.einsum("ni,ni->n", u, known[0]) - known[1]) / (0.08 * strength) * known[2] * scale)
        if not wandering:
            parts.append(((u - np.mean(u, axis=0)) / (0.06 * strength) * scale).ravel())
        parts.append(np.array([x[0] / IRON_SD, (x[1] - 1.0) / GAIN_SD]))
        return np.concatenate(parts)

    for _ in range(6):
        e = errors(x)
        J = np.column_stack([(errors(x + h) - e) / np.sum(h) for h in (np.array([1e-3, 0.0]), np.array([0.0, 1e-5]))])
        x = x - np.linalg.solve(J.T @ J, J.T @ e)
        x = np.clip(x, [-0.8 * strength, 0.5], [0.8 * strength, 2.0])
    return np.asarray(x[1] * (m - x[0] * axis))


def _pairs(m: FloatArray | None, f: FloatArray, field: FloatArray, force: FloatArray, say: FloatArray) -> FloatArray:
    """Return the matrices (n, 3, 3) of Wahba's problem for m and f (n, 3) to be taken to field and force.

    The specific force counts where felt and path agree on its size, and is large enough to have a direction, times
    ``say`` (n,).
    """

    def unit(v: FloatArray) -> FloatArray:
        return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9))

    size, other = np.linalg.norm(force, axis=1), np.linalg.norm(f, axis=1)
    agreement = 1 / (1 + ((size - other) / (1.0 + 0.1 * size)) ** 2)
    strong = say * np.minimum(np.minimum(size, other) / 5.0, 1.0) ** 2 * agreement**2 + 1e-3 * (other > 0)
    K = np.einsum("n,ni,nj->nij", strong, unit(force), unit(f))
    if m is not None:
        K += 0.3 * np.einsum("ni,nj->nij", unit(np.broadcast_to(field, m.shape)), unit(m))
        K += np.einsum("n,ni,nj->nij", 0.1 * strong, unit(np.cross(field, force)), unit(np.cross(m, f)))
    return np.asarray(K)


def _rotations(K: FloatArray) -> FloatArray:
    U, _, Vt = np.linalg.svd(K)
    U[:, :, 2] *= np.linalg.det(U @ Vt)[:, None]
    return np.asarray(U @ Vt)


def _weights(n: int, sigma: float) -> FloatArray:
    index = GRID * np.arange(n)
    W = np.exp(-0.5 * ((index[:, None] - index[None, :]) / sigma) ** 2)
    return np.asarray(W / W.sum(axis=1, keepdims=True))


def _windowed(value: FloatArray | ComplexArray, sigma: float) -> FloatArray:
    return np.asarray(np.tensordot(_weights(len(value), sigma), value, axes=1))


def _level_about(v: FloatArray, reference: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) that takes v to reference and, of all those, ``axis`` nearest to straight down."""
    down = np.array([0.0, 0.0, 1.0])
    K = np.outer(reference, v) / (np.linalg.norm(reference) * max(float(np.linalg.norm(v)), 1e-9))
    # the cross products decide the turn about v and leave v itself alone
    a, b = np.cross(reference, down), np.cross(v, axis)
    K = K + 1e-3 * np.outer(a, b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-9)
    return np.asarray(_rotations(K[None] + 1e-9 * np.eye(3))[0])


def _connected(turns: FloatArray, field: FloatArray) -> FloatArray:
    """Return rotations that change from instant to instant by no turn about the field."""
    out = turns.copy()
    n = np.asarray(field / np.linalg.norm(field))
    for i in range(1, len(out)):
        q = quaternion_from_matrix(out[i - 1] @ out[i].T)
        angle = 2 * np.arctan2(q[1:] @ n, q[0])
        out[i] = body_to_ned(turn(angle * n)) @ out[i]
    return out


def _stated_turn(recording: Recording, frame: _Attitude, turns: FloatArray, field: FloatArray) -> FloatArray:
    """Return the rotations turned about the field so that they meet a stated release as well as they can."""
    stated = _stated_attitude(recording.release)
    if stated is None:
        return turns
    found = turns[0] @ body_to_ned(frame.D_at(np.zeros(1)))[0] @ _z_turn(float(frame.psi_at(np.zeros(1))[0]))
    n = np.asarray(field / np.linalg.norm(field))
    q = quaternion_from_matrix(stated @ found.T)
    angle = 2 * np.arctan2(q[1:] @ n, q[0])
    return np.asarray(body_to_ned(turn(angle * n)) @ turns)


def _stated_attitude(release: Release | None) -> FloatArray | None:
    if release is None or release.roll is None or release.pitch is None or release.yaw is None:
        return None
    return attitude_matrix(release.roll, release.pitch, release.yaw).T


def _z_turn(angle: float) -> FloatArray:
    return np.array([[cos(angle), -sin(angle), 0.0], [sin(angle), cos(angle), 0.0], [0.0, 0.0, 1.0]])


def _level(recording: Recording, frame: _Attitude, grid: FloatArray) -> FloatArray:
    """Return the rotation of a disc that starts as its release states, or level."""
    stated = _stated_attitude(recording.release)
    first = np.eye(3) if stated is None else stated @ _z_turn(float(-frame.psi_at(np.zeros(1))[0]))
    return np.tile(first, (grid.size, 1, 1))


def _states(
    recording: Recording, frame: _Attitude, grid: FloatArray, G: FloatArray, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return attitudes (k, 4) and body rates (k, 3) at t."""
    turns = np.array([quaternion_from_matrix(C) for C in G])
    for i in range(1, len(turns)):
        if turns[i] @ turns[i - 1] < 0:
            turns[i] = -turns[i]
    psi = frame.psi_at(t)
    slow = multiply(_between(grid, turns, t), frame.D_at(t))
    attitude = multiply(slow, turn(psi[:, None] * np.array([0.0, 0.0, 1.0])))
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    r = np.interp(t, frame.grid, frame.r)
    if frame.transverse is not None:
        # in the frame that does not spin p and q change least between readings
        W = frame.transverse * np.exp(1j * frame.psi)
        w = (np.interp(t, frame.grid, W.real) + 1j * np.interp(t, frame.grid, W.imag)) * np.exp(-1j * psi)
    else:
        reach = 2 * GRID
        before, after = _between(grid, turns, t - reach), _between(grid, turns, t + reach)
        inverse = before * np.array([1.0, -1.0, -1.0, -1.0])
        W3 = rotation_vector(multiply(inverse, after)) / (2 * reach)
        w = (W3[:, 0] + 1j * W3[:, 1]) * np.exp(-1j * psi)
        # at the ends half of the span is missing and the rate comes out half as large: no harm to a start
    rate = np.column_stack([w.real, w.imag, r])
    return attitude, rate


def _others(recording: Recording, attitude: FloatArray) -> tuple[FloatArray, ...]:
    field = recording.environment.magnetic_field
    n = np.asarray(field / max(float(np.linalg.norm(field)), 1e-9))
    return tuple(multiply(turn(angle * n), attitude) for angle in (np.pi / 2, -np.pi / 2, np.pi))


# ---------------------------------------------------------------------------------------------- path


def path_fixes(recording: Recording) -> Fixes | None:
    """Return the fixes of GPS, or else of a track, or None where there are fewer than four."""
    for sensor in ("gps", "track"):
        samples = recording.get(sensor)
        if samples is None:
            continue
        good = np.asarray(np.all(np.isfinite(samples.value[:, :3]), axis=1))
        if np.count_nonzero(good) < 4:
            continue
        sheet, value = recording.sheets[sensor], samples.value[good]
        velocity = value[:, 3:6] if value.shape[1] >= 6 else np.full((len(value), 3), np.nan)
        return Fixes(samples.t[good], value[:, :3], velocity, sheet.noise_rms or 0.2, sheet.velocity_noise_rms or 0.1)
    return None


def local_cubics(fixes: Fixes, t: FloatArray) -> FloatArray:
    """Fit a cubic to the fixes around each instant t (m,); return its value and three derivatives, (m, 4, 3)."""
    nothing = np.zeros((fixes.t.size, 0))
    return _local_cubics(fixes, t, nothing, nothing)


def _local_cubics(fixes: Fixes, t: FloatArray, moved: FloatArray, gained: FloatArray) -> FloatArray:
    """Fit a cubic to the fixes around each instant t (m,); return its value and three derivatives, (m, 4, 3 + k).

    ``moved`` and ``gained`` (n, k) are positions and velocities of something else at the times of the fixes, to which
    the very same fit is made; the fixes alone decide the weights, and outliers lose theirs step by step.
    """
    moving = np.asarray(np.all(np.isfinite(fixes.velocity), axis=1))
    x, v = np.concatenate([fixes.position, moved], axis=1), np.concatenate([fixes.velocity, gained], axis=1)
    out = np.empty((t.size, 4, x.shape[1]))
    # a throw's acceleration is below 3 g, its change a few g per second: keeps few fixes from inventing more
    ridge = np.diag([1e-9, 1e-9, 1.0 / 30.0**2, 1.0 / 40.0**2])
    for i, instant in enumerate(t):
        centre = float(np.clip(instant, fixes.t[0] + PATH_HALF, max(fixes.t[-1] - PATH_HALF, fixes.t[0] + PATH_HALF)))
        half = PATH_HALF + 1e-9
        while np.count_nonzero(np.abs(fixes.t - centre) <= half) < min(7, fixes.t.size):
            half *= 1.3
        chosen = np.abs(fixes.t - centre) <= half
        quick = moving[chosen]
        tau = fixes.t[chosen] - instant
        one, zero = np.ones(tau.size), np.zeros(tau.size)
        A = np.concatenate(
            [
                np.column_stack([one, tau, tau**2 / 2, tau**3 / 6]) / fixes.position_sd,
                np.column_stack([zero, one, tau, tau**2 / 2])[quick] / fixes.velocity_sd,
            ]
        )
        y = np.concatenate([x[chosen] / fixes.position_sd, v[chosen][quick] / fixes.velocity_sd])
        weighted = A
        solution = np.linalg.solve(A.T @ A + ridge, A.T @ y)
        for scale in (30.0, 10.0, 4.0, 3.0):
            misfit = np.linalg.norm(y[:, :3] - A @ solution[:, :3], axis=1)
            # noise may be larger than stated: outliers are told by the others' median
            usual = max(1.0, float(np.median(misfit)) / 1.5)
            if float(np.max(misfit)) < usual * 4.0:
                break
            weighted = A * (1 / (1 + (misfit / (scale * usual)) ** 2) ** 2)[:, None]
            solution = np.linalg.solve(weighted.T @ A + ridge, weighted.T @ y)
        out[i] = solution
    return out


def _compared(
    fixes: Fixes, felt: _Felt | None, grid: FloatArray, gravity: float
) -> tuple[FloatArray, FloatArray | None]:
    """Return the specific force (n, 3) in N from the path, and that felt in S at the start, over the same windows.

    Both go through the same cubics: as path and velocity that the force felt would make. So a force that changes
    within a window does not turn one against the other. A delay of the fixes is looked for where the sizes of both
    disagree, for it would.
    """
    inside = np.clip(grid, fixes.t[0], fixes.t[-1])
    down = np.array([0.0, 0.0, gravity])
    if felt is None:
        return local_cubics(fixes, inside)[:, 2, :] - down, None
    found = []
    for delay in (0.0, 0.1, 0.2, 0.3):
        both = _local_cubics(fixes, inside[::3] if delay else inside, *felt.integrals_at(fixes.t - delay))[:, 2, :]
        force, other = both[:, :3] - down, both[:, 3:]
        apart = np.linalg.norm(force, axis=1) - np.linalg.norm(other, axis=1)
        # whatever both differ in all the time is a bias
        misfit = float(np.median(np.abs(apart - np.median(apart))))
        found.append((misfit, delay, force, other))
        if delay == 0.0 and misfit < 0.5:
            break
    best = min(found, key=lambda entry: entry[0])
    if best[1] == 0.0 or best[0] > 0.5 * found[0][0]:
        return found[0][2], found[0][3]
    both = _local_cubics(fixes, inside, *felt.integrals_at(fixes.t - best[1]))[:, 2, :]
    return both[:, :3] - down, both[:, 3:]


def _path(fixes: Fixes, felt: _Felt | None, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity (k, 3) at t: what the acceleration in N makes, and local cubics for the rest."""
    nothing = np.zeros((fixes.t.size, 0))
    inside = np.clip(t, fixes.t[0], fixes.t[-1])
    outside = (t - inside)[:, None]
    if felt is None:
        cubic = local_cubics(fixes, inside)
        x, v, a = cubic[:, 0], cubic[:, 1], cubic[:, 2]
        return x + v * outside + 0.5 * a * outside**2, v + a * outside
    moved, gained = felt.integrals_at(fixes.t)
    rest = fixes._replace(position=fixes.position - moved, velocity=fixes.velocity - gained)
    cubic = _local_cubics(rest, inside, nothing, nothing)
    moved, gained = felt.integrals_at(t)
    return cubic[:, 0] + cubic[:, 1] * outside + moved, cubic[:, 1] + gained


def _dead_reckoning(recording: Recording, felt: _Felt | None, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity (k, 3) at t from the stated release, or a guess, and the acceleration in N."""
    release = recording.release
    position = np.array([0.0, 0.0, -GUESSED_HEIGHT])
    velocity = np.array([GUESSED_SPEED, 0.0, 0.0])
    if release is not None and release.position is not None:
        position = np.array(release.position)
    if release is not None and release.velocity is not None:
        velocity = np.array(release.velocity)
    if felt is None:
        return position + velocity * t[:, None], np.tile(velocity, (t.size, 1))
    moved, gained = felt.integrals_at(t)
    return position + velocity * t[:, None] + moved, velocity + gained


def _finite(starts: Starts) -> Starts:
    """Return the starts with anything that is not finite replaced by what a level, resting disc has."""
    level = np.array([1.0, 0.0, 0.0, 0.0])
    lost = np.asarray(~np.all(np.isfinite(starts.attitude), axis=1))
    return starts._replace(
        position=np.nan_to_num(starts.position, nan=0.0, posinf=0.0, neginf=0.0),
        velocity=np.nan_to_num(starts.velocity, nan=0.0, posinf=0.0, neginf=0.0),
        attitude=np.where(lost[:, None], level, starts.attitude),
        rate=np.nan_to_num(starts.rate, nan=0.0, posinf=0.0, neginf=0.0),
    )
