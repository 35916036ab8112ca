"""Spin rate of one stretch of readings: `track_spin`, and the bound that no estimator beats, `track_bound`."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from estimators.precession import AxialField
from estimators.spin_spline import SpinSpline
from estimators.tracking.problem import Linear, Problem, Segment
from estimators.tracking.solution import adapt, evidence, linearise, solve, with_roughness
from estimators.tracking.track import Track

__all__ = ["track_bound", "track_spin"]


def track_bound(segment: Segment, rate: FloatArray, noise: float, at: float) -> float:
    """Return the Bayesian Cramer-Rao bound of the rate at one instant, rad/s, of the whole model of `track_spin`.

    The inverse Fisher matrix for a rate that changes steadily (r'' = 0) with field, hard and soft iron, and the
    gyroscope's bias and gain unknown within their priors. The segment's readings and ``rate`` (n,) are true ones.
    """
    problem = Problem(segment, top_rate=float(np.max(np.abs(rate))))
    ones, precession = np.ones(segment.t.size), segment.settings.precession
    x, linear, *_ = solve(problem, _start(problem, rate, None), noise, ones, 1e-6, precession, 20)
    information, _, _ = with_roughness(problem, linear, x, np.zeros(problem.spline.size - 2), 1e-10)
    B = np.zeros(problem.size)
    B[problem.parts[0]] = problem.spline.basis(np.array([at]))[0]
    return float(np.sqrt(B @ np.linalg.solve(information, B)))


def track_spin(
    segment: Segment, start_rate: FloatArray, *, axial: AxialField | None = None, noise: float | None = None
) -> Track:
    """Smooth one segment of n readings, from a first guess ``start_rate`` (n,) rad/s.

    ``axial`` is a first guess of the hard iron along z; ``noise`` the data sheet's, uT, taken as a floor.
    """
    size = np.abs(start_rate)
    problem = Problem(segment, top_rate=float(np.max(size)), typical_rate=float(np.median(size)))
    fit = _fitted(problem, _start(problem, start_rate, axial), floor=0.7 * noise if noise else 1e-6)
    return _track(problem, fit)


class _Fit(NamedTuple):
    """The most likely parameters x, the problem about them, residuals (n, 3), phase (n,), and both sizes found.

    ``sigma`` is the readings' noise, uT; ``roughness`` the spectral density of r''; ``target`` (k,) its mean.
    """

    x: FloatArray
    linear: Linear
    residual: FloatArray
    phase: FloatArray
    target: FloatArray
    sigma: float
    roughness: float


def _fitted(problem: Problem, x: FloatArray, floor: float) -> _Fit:
    """Fit the parameters, and in turn noise, roughness, precession and the weights of bad readings, in 4 rounds."""
    settings, precession = problem.settings, problem.settings.precession
    weights, roughness = np.ones(problem.t.size), 100.0
    sigma = max(float(np.sqrt(np.mean(problem.evaluate(x).residual ** 2))), floor)
    for outer in range(4):
        x, linear, residual, psi, target = solve(problem, x, sigma, weights, roughness, precession, 15)
        length = np.sqrt(np.mean(residual**2, axis=1))
        sigma = max(_noise(residual, weights, problem, linear, roughness), floor)
        # Huber's weight for single bad readings
        weights = np.sqrt(np.minimum(1.0, 4.0 * sigma / np.maximum(length, 1e-12)))
        precision, mean = problem.prior(precession)
        linear, residual, psi = linearise(problem, x, sigma, weights, precision, mean)
        previous, roughness = roughness, adapt(problem, linear, x, target)
        if problem.slow is not None and problem.despun:
            # the part of the precession that the field shows tells the size of the part that it does not
            PQ = x[problem.parts[1]]
            shown = 1 - np.diag(np.linalg.inv(linear.information))[problem.parts[1]] / precession**2
            weight = np.clip(shown, 0, 1)
            seen = float(np.sum(weight * PQ**2) + 2 * settings.precession**2) / (float(np.sum(weight)) + 2)
            precession = max(settings.precession, float(np.sqrt(seen)))
        if outer > 0 and abs(np.log(roughness / previous)) < 0.2:
            break
    return _Fit(x, linear, residual, psi, target, sigma, roughness)


def _track(problem: Problem, fit: _Fit) -> Track:
    """Return the rate on the grid of answers, integrated over the roughness, with all that is told of the fit."""
    x, step = fit.x, problem.settings.step
    mixture = evidence(problem, fit.linear, x, fit.target)
    first = int(np.ceil(problem.t[0] / step - 1e-9))
    count = int(np.floor(problem.t[-1] / step + 1e-9)) + 1 - first
    grid = step * (first + np.arange(count, dtype=np.float64))
    B = problem.spline.basis(grid)
    rate_covariance = B @ (mixture.covariance * _correlation(problem, fit.residual, x)) @ B.T
    blur = _blur(problem.spline, mixture.mean, grid)
    everything = np.linalg.inv(with_roughness(problem, fit.linear, x, fit.target, fit.roughness)[0])
    calibrations = problem.parts[5:]
    return Track(
        t=grid,
        rate=B @ mixture.mean,
        sd=np.hypot(np.sqrt(np.diag(rate_covariance)), blur),
        blur=blur,
        covariance=rate_covariance,
        times=problem.t,
        phase=fit.phase,
        residual=fit.residual,
        noise=fit.sigma,
        hard_iron=x[problem.parts[3]],
        field=x[problem.parts[2]],
        spline=problem.spline,
        coefficients=mixture.mean,
        roughness=fit.roughness,
        calibration=[x[part] for part in calibrations],
        calibration_sd=[np.sqrt(np.diag(everything)[part]) for part in calibrations],
        chi2=[float(np.mean(error**2)) for error, _ in problem.evaluate_rows(x)],
        gyroscope_gain=complex(*x[problem.parts[1]][2:4]) if problem.read else 0j,
    )


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
    B = problem.spline.basis(problem.t)
    rows = problem.spline.second_difference()
    x[problem.parts[0]] = np.linalg.solve(B.T @ B + 1e-4 * rows.T @ rows, B.T @ start_rate)
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


def _noise(residual: FloatArray, weights: FloatArray, problem: Problem, linear: Linear, roughness: float) -> float:
    rows = np.sqrt(problem.local)[:, None] * problem.spline.second_difference()
    information = linear.information.copy()
    information[problem.parts[0], problem.parts[0]] += rows.T @ rows / roughness
    # parameters that the data and not the prior decide
    precision, _ = problem.prior(problem.settings.precession)
    precision[problem.parts[0], problem.parts[0]] += rows.T @ rows / roughness
    freedom = problem.size - float(np.trace(np.linalg.solve(information, precision)))
    count = 3 * float(np.sum(weights**2))
    square = float(np.sum((weights[:, None] * residual) ** 2))
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
