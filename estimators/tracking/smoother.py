"""Spin rate of one stretch of readings: `track_spin`, and the bound that no estimator beats, `track_bound`."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from discsim.arrays import FloatArray, IntArray
from discsim.estimators.precession import AxialField
from discsim.estimators.spin_spline import SpinSpline
from discsim.estimators.tracking.problem import Linear, Problem, Segment
from discsim.estimators.tracking.solution import Mixture, Point, adapt, linearise, mean_roughness, solve, with_roughness
from discsim.estimators.tracking.track import Track

__all__ = ["track_bound", "track_spin"]


def track_bound(segment: Segment, rate: FloatArray, noise: float, at: float) -> float:
    """Return the Bayesian Cramer-Rao bound of the rate at one instant, rad/s, of the whole model of `track_spin`.

    The inverse Fisher matrix for a rate that changes steadily (r'' = 0) with field, hard and soft iron, and the
    gyroscope's bias and gain unknown within their priors. The segment's readings and ``rate`` (n,) are true ones.
    """
    size = np.abs(rate)
    problem = Problem(segment, top_rate=float(np.max(size)), typical_rate=float(np.median(size)))
    ones, precession = np.ones(segment.t.size), problem.precession
    start = Point(problem, _start(problem, rate, None), ones)
    point, linear, _ = solve(problem, start, noise, 1e-6, precession, 20)
    information, _, _ = with_roughness(problem, linear, point.x, np.zeros(problem.spline.size - 2), 1e-10)
    B = np.zeros(problem.size)
    B[problem.parts[0]] = problem.spline.basis(np.array([at]))[0]
    return float(np.sqrt(B @ np.linalg.solve(information, B)))


def track_spin(
    segment: Segment,
    start_rate: FloatArray,
    *,
    axial: AxialField | None = None,
    noise: float | None = None,
    near: Track | None = None,
) -> Track:
    """Smooth one segment of n readings, from a first guess ``start_rate`` (n,) rad/s.

    ``axial`` is a first guess of the hard iron along z; ``noise`` the data sheet's, uT, taken as a floor. ``near`` is
    the same segment's track without other sensors' rows, from which the fit goes on: it saves half of the steps.
    """
    size = np.abs(start_rate)
    problem = Problem(segment, top_rate=float(np.max(size)), typical_rate=float(np.median(size)))
    floor = 0.7 * noise if noise else 1e-6
    # where the precession is not read its size is found in several rounds, which begin anew
    if near is None or (problem.slow is not None and problem.despun):
        return _track(problem, _fitted(problem, _start(problem, start_rate, axial), floor))
    x = np.concatenate([near.point[: problem.parts[4].stop], *(row.calibration for row in segment.rows)])
    problem.local = near.local
    return _track(problem, _fitted(problem, x, floor, near))


class _Fit(NamedTuple):
    """The most likely parameters, the problem about them, and both sizes found.

    ``sigma`` is the readings' noise, uT; ``mixture`` the spectral densities of r'' and the spin by them; ``target``
    (k,) the mean of r''.
    """

    point: Point
    linear: Linear
    target: FloatArray
    sigma: float
    mixture: Mixture


def _fitted(problem: Problem, x: FloatArray, floor: float, near: Track | None = None) -> _Fit:
    """Fit the parameters, and in turn noise, roughness, precession and the weights of bad readings, in 4 rounds.

    It ends where a round hardly changes the roughness; the first, which begins anywhere, tells that of a near track.
    """
    expected = precession = problem.precession
    roughness, point = 100.0, Point(problem, x, np.ones(problem.t.size) if near is None else near.weights)
    sigma = max(float(np.sqrt(np.mean(point.at.residual**2))), floor)
    if near is not None:
        roughness, sigma = near.roughness, max(near.noise, floor)
    for outer in range(4):
        point, linear, target = solve(problem, point, sigma, roughness, precession, 15)
        length = np.sqrt(np.mean(point.at.residual**2, axis=1))
        sigma = max(_noise(point, linear, roughness), floor)
        # Huber's weight for single bad readings
        point = point.weighed(np.sqrt(np.minimum(1.0, 4.0 * sigma / np.maximum(length, 1e-12))))
        linear = linearise(point, sigma, *problem.prior(precession))
        mixture = adapt(problem, linear, point.x, target, None if outer == 0 and near is None else roughness)
        previous, roughness = roughness, mean_roughness(mixture)
        if problem.slow is not None and problem.despun:
            # the part of the precession that the field shows tells the size of the part that it does not
            PQ = point.x[problem.parts[1]]
            shown = 1 - np.diag(np.linalg.inv(linear.information))[problem.parts[1]] / precession**2
            weight = np.clip(shown, 0, 1)
            seen = float(np.sum(weight * PQ**2) + 2 * expected**2) / (float(np.sum(weight)) + 2)
            precession = max(expected, float(np.sqrt(seen)))
        if (outer > 0 or near is not None) and abs(np.log(roughness / previous)) < 0.2:
            break
    return _Fit(point, linear, target, sigma, mixture)


def _track(problem: Problem, fit: _Fit) -> Track:
    """Return the rate on the grid of answers, integrated over the roughness, with all that is told of the fit."""
    x, step, residual = fit.point.x, problem.settings.step, fit.point.at.residual
    mixture, roughness = fit.mixture, mean_roughness(fit.mixture)
    first = int(np.ceil(problem.t[0] / step - 1e-9))
    count = int(np.floor(problem.t[-1] / step + 1e-9)) + 1 - first
    grid = step * (first + np.arange(count, dtype=np.float64))
    B = problem.spline.basis(grid)
    variance = np.sum((B @ mixture.covariance) * B, axis=1) * _correlation(problem, residual, x)
    blur = _blur(problem.spline, mixture.mean, grid)
    everything = np.linalg.inv(with_roughness(problem, fit.linear, x, fit.target, roughness)[0])
    calibrations = problem.parts[5:]
    left, many, usual = _left(problem.t, residual, grid)
    return Track(
        t=grid,
        rate=B @ mixture.mean,
        sd=np.hypot(np.sqrt(variance), blur),
        blur=blur,
        start=float(problem.t[0]),
        stop=float(problem.t[-1]),
        left=left,
        count=many,
        usual=usual,
        noise=fit.sigma,
        hard_iron=x[problem.parts[3]],
        field=x[problem.parts[2]],
        roughness=roughness,
        calibration=[x[part] for part in calibrations],
        calibration_sd=[np.sqrt(np.diag(everything)[part]) for part in calibrations],
        chi2=[float(np.mean(error**2)) for error, _ in fit.point.rows],
        gyroscope_gain=complex(*x[problem.parts[1]][2:4]) if problem.read else 0j,
        point=x,
        weights=fit.point.weights,
        local=problem.local,
    )


def _left(t: FloatArray, residual: FloatArray, grid: FloatArray) -> tuple[FloatArray, IntArray, float]:
    """Return the mean square per axis, uT^2, of residuals (k, 3) over half a second about each instant of a grid (n,).

    Beside it the number of readings there (n,), and the mean square of most readings.
    """
    square = np.mean(residual**2, axis=1)
    # a single wild reading, which had no weight, is no misfit
    square = np.minimum(square, 40 * float(np.median(square)))
    cumulative = np.concatenate([[0.0], np.cumsum(square)])
    lo, hi = np.searchsorted(t, grid - 0.25), np.searchsorted(t, grid + 0.25)
    # the mean of chi-square of three is 1.27 times its median
    return (cumulative[hi] - cumulative[lo]) / np.maximum(hi - lo, 1), hi - lo, 1.27 * float(np.median(square))


def _blur(spline: SpinSpline, coefficients: FloatArray, t: FloatArray) -> FloatArray:
    """Return what the knots' spacing hides at t, rad/s, one sigma.

    A cubic spline through the corner of a ramp, where the slope jumps by s, errs by up to s h/6 within a knot's spacing
    h; the second difference of its coefficients there is about s h.
    """
    bend = np.abs(np.diff(coefficients, 2))
    centres = spline.start + spline.spacing * np.arange(bend.size)
    # a corner between two knots shows in both
    wide = np.maximum(bend, np.maximum(np.roll(bend, 1), np.roll(bend, -1)))
    return np.asarray(np.interp(t, centres, wide) / 6)


def _start(problem: Problem, start_rate: FloatArray, axial: AxialField | None) -> FloatArray:
    """Return a first point: the spline through the rates, then field and hard iron by linear least squares."""
    x = np.zeros(problem.size)
    first, weights = problem.spline.local(problem.t)
    places = (first[:, None] + np.arange(4)).ravel()
    B = csr_array((weights.ravel(), places, np.arange(0, places.size + 1, 4)), shape=(first.size, problem.spline.size))
    smooth = 1e-4 * problem.spline.bend_precision(np.ones(problem.spline.size - 2))
    x[problem.parts[0]] = np.linalg.solve((B.T @ B).toarray() + smooth, B.T @ start_rate)
    for part, row in zip(problem.parts[5:], problem.rows, strict=True):
        x[part] = row.calibration
    at = problem.evaluate(x)  # the field is zero: residual = m, derivative by field = C
    vector, iron = problem.parts[2], problem.parts[3]
    steady = np.broadcast_to(np.eye(3), at.attitude.shape)
    columns = np.concatenate([at.attitude, steady], axis=2).reshape(-1, 6)
    # along z field and hard iron are nearly the same column: draw the latter to its first guess
    guess = np.array([0.0, 0.0, 0.0, 0.0, 0.0, axial.offset if axial is not None else 0.0])
    weight = np.diag([1e-9, 1e-9, 1e-9, 1e-6, 1e-6, 10.0])
    x[vector.start : iron.stop] = np.linalg.solve(
        columns.T @ columns + weight, columns.T @ at.residual.ravel() + weight @ guess
    )
    return x


def _noise(point: Point, linear: Linear, roughness: float) -> float:
    problem, penalty = point.problem, point.problem.penalty() / roughness
    information = linear.information.copy()
    information[problem.parts[0], problem.parts[0]] += penalty
    # parameters that the data and not the prior decide
    precision, _ = problem.prior(problem.precession)
    precision[problem.parts[0], problem.parts[0]] += penalty
    freedom = problem.size - float(np.trace(np.linalg.solve(information, precision)))
    count = 3 * float(np.sum(point.weights**2))
    square = float(np.sum((point.weights[:, None] * point.at.residual) ** 2))
    return sqrt(square / max(count - freedom, 0.2 * count))


def _correlation(problem: Problem, residual: FloatArray, x: FloatArray) -> float:
    """Return how much the phase's error correlates: its spectral density at low frequency over a white one's, >= 1.

    The residual across the field's direction, in turns of the spin; faster than the spin's own spline follows.
    """
    iron = problem.parts[3]
    z = (problem.m[:, 0] - x[iron][0]) + 1j * (problem.m[:, 1] - x[iron][1])
    error = (residual[:, 0] + 1j * residual[:, 1]) * np.exp(-1j * np.angle(z))
    across = error.imag - np.mean(error.imag)
    variance = float(np.mean(across**2))
    if variance <= 0 or across.size < 60:
        return 1.0
    lags = min(10, across.size // 20)
    total = sum(
        float(np.mean(across[lag:] * across[:-lag])) / variance * (1 - lag / (lags + 1)) for lag in range(1, lags + 1)
    )
    # white noise alone gives a scatter of about this size
    scatter = 2 * np.sqrt(lags / 3 / across.size)
    return float(max(1.0, 1 + 2 * (total - scatter)))
