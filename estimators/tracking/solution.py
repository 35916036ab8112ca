"""Gauss-Newton steps of the smoother and the roughness that the data decide (largest marginal likelihood)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from discsim.arrays import FloatArray
from estimators.tracking.problem import Linear, Problem

__all__ = ["adapt", "evidence", "linearise", "solve", "with_roughness"]


#: Spectral densities of r'' tried, (rad/s^3)^2 s. Their prior falls slowly: where the data cannot tell, a
#: steady change of rate is likelier than a rough one.
_GRID = np.logspace(-10, 7, 35)


def linearise(
    problem: Problem, x: FloatArray, noise: float, weights: FloatArray, precision: FloatArray, mean: FloatArray
) -> tuple[Linear, FloatArray, FloatArray]:
    """Linearise readings about unknowns x with their priors; beside it residuals (n, 3) and spin phase (n,), rad."""
    at = problem.evaluate(x)
    error = (at.residual * (weights[:, None] / noise)).ravel()
    information = precision.copy()
    right = -precision @ (x - mean)
    problem.add_field(x, at, weights / noise, information, right)
    cost = float(error @ error + (x - mean) @ precision @ (x - mean))
    for row_error, row_J in problem.evaluate_rows(x):
        # a reading far outside its calibration's reach must not bend the track: Huber's weight at four sigma
        weight = np.minimum(1.0, 4.0 / np.maximum(np.abs(row_error), 1e-12))
        information += row_J.T @ (row_J * weight[:, None])
        right += row_J.T @ (row_error * weight)
        cost += float(np.sum(np.where(weight < 1, 8 * np.abs(row_error) - 16, row_error**2)))
    if problem.strength is not None:
        vector = problem.parts[2]
        m0 = x[vector]
        length = float(np.linalg.norm(m0))
        sd = problem.settings.strength * problem.strength
        gradient = np.zeros(problem.size)
        gradient[vector] = m0 / length / sd
        gap = (problem.strength - length) / sd
        information += np.outer(gradient, gradient)
        right += gradient * gap
        cost += gap**2
    if not (np.isfinite(cost) and np.all(np.isfinite(information))):
        raise np.linalg.LinAlgError("the fit has left the numbers")
    return Linear(information, right, cost), at.residual, at.psi


def with_roughness(
    problem: Problem, linear: Linear, x: FloatArray, target: FloatArray, roughness: float
) -> tuple[FloatArray, FloatArray, float]:
    """Return the information (n, n), right-hand side (n,) and cost of a linearisation with a roughness's rows added."""
    scale = np.sqrt(problem.local)
    rows = scale[:, None] * problem.spline.second_difference()
    spin = problem.parts[0]
    information = linear.information.copy()
    information[spin, spin] += rows.T @ rows / roughness
    gap = scale * target - rows @ x[spin]
    right = linear.right.copy()
    right[spin] += rows.T @ gap / roughness
    return information, right, linear.cost + float(gap @ gap) / roughness


def solve(
    problem: Problem, x: FloatArray, noise: float, weights: FloatArray, roughness: float, precession: float, most: int
) -> tuple[FloatArray, Linear, FloatArray, FloatArray, FloatArray]:
    """Gauss-Newton with damping until a step is worth less than a hundredth of a standard deviation."""
    precision, mean = problem.prior(precession)
    _, target = problem.roughness_rows(x)
    linear, residual, psi = linearise(problem, x, noise, weights, precision, mean)
    damping = 0.0
    for _ in range(most):
        information, right, cost = with_roughness(problem, linear, x, target, roughness)
        diagonal = np.diag(information)
        step = cho_solve(cho_factor(information + np.diag(damping * diagonal)), right)
        trial = x + step
        moved, trial_residual, trial_psi = linearise(problem, trial, noise, weights, precision, mean)
        _, _, trial_cost = with_roughness(problem, moved, trial, target, roughness)
        if trial_cost <= cost + 1e-9:
            x, linear, residual, psi = trial, moved, trial_residual, trial_psi
            _, target = problem.roughness_rows(x)
            damping = 0.0 if damping < 1e-4 else damping * 0.1
            if float(step @ right) < 1e-4:
                break
        else:
            damping = max(1e-4, 10 * damping)
            if damping > 1e6:
                break
    return x, linear, residual, psi, target


@dataclass(frozen=True)
class _Mixture:
    """Weights of the grid of roughness, the spin's mean coefficients and covariance, and the best log evidence."""

    weight: FloatArray
    mean: FloatArray
    covariance: FloatArray
    log: float


def evidence(problem: Problem, linear: Linear, x: FloatArray, target: FloatArray) -> _Mixture:
    """Integrate over the roughness, each value of a grid weighed by its marginal likelihood (Laplace).

    What is not spin is eliminated first; then only the prior of the second differences changes over the grid.
    """
    count = problem.spline.size - 2
    spin = problem.parts[0]
    size = spin.stop
    A, B, C = linear.information[:size, :size], linear.information[:size, size:], linear.information[size:, size:]
    inner = cho_factor(C)
    reduced = A - B @ cho_solve(inner, B.T)
    right0 = linear.right[:size] - B @ cho_solve(inner, linear.right[size:])
    rows = np.sqrt(problem.local)[:, None] * problem.spline.second_difference()
    penalty = rows.T @ rows
    gap = np.sqrt(problem.local) * target - rows @ x[spin]
    pull = rows.T @ gap

    def solved(roughness: float) -> tuple[float, FloatArray, tuple[FloatArray, bool]]:
        factor = cho_factor(reduced + penalty / roughness, check_finite=False)
        right = right0 + pull / roughness
        step = cho_solve(factor, right, check_finite=False)
        determinant = 2 * float(np.sum(np.log(np.diag(factor[0]))))
        cost = float(gap @ gap) / roughness - float(step @ right)
        return -0.5 * (cost + determinant + count * np.log(roughness)), step, factor

    results = [solved(roughness) for roughness in _GRID]
    log = np.array([result[0] for result in results]) - 0.18 * np.log(_GRID)
    log = np.where(_GRID >= problem.least, log, -np.inf)
    weight = np.exp(log - np.max(log))
    weight = np.where(weight < 1e-3, 0.0, weight)
    weight /= np.sum(weight)
    steps = np.array([result[1] for result in results])
    mean = weight @ steps
    covariance = np.zeros((size, size))
    for share, (_, step, factor) in zip(weight, results, strict=True):
        if share > 0:
            spread = step - mean
            covariance += share * (cho_solve(factor, np.eye(size), check_finite=False) + np.outer(spread, spread))
    # Student's t with one degree of freedom: a normal law whose precision is Gamma(1/2, 1/2), by its logarithm
    own = float(np.sum(np.log(problem.local) - 0.5 * problem.local + 0.5))
    return _Mixture(weight, x[spin] + mean, covariance, float(np.max(log)) + own)


def adapt(problem: Problem, linear: Linear, x: FloatArray, target: FloatArray) -> float:
    """Find the roughness, and where it is larger than elsewhere: Student's t with one degree of freedom for r''.

    A flight is alike smooth throughout; a rate table is quiet between the corners of its ramps. Which of both it is,
    the evidence says. Expectation-maximisation with the posterior variance of r'', so that intervals without data
    keep the common roughness.
    """
    rows = problem.spline.second_difference()
    problem.local = np.ones(problem.spline.size - 2)
    best = mixture = evidence(problem, linear, x, target)
    kept, needed = problem.local, best.log + 10.0  # corners must be plain
    for _ in range(12):
        roughness = _mean_roughness(mixture)
        bend = rows @ mixture.mean - target
        square = bend**2 + np.sum((rows @ mixture.covariance) * rows, axis=1)
        # corners fall between knots: neighbours share them
        smooth = np.maximum(square, 0.5 * np.maximum(np.roll(square, 1), np.roll(square, -1)))
        problem.local = 2.0 / (1.0 + smooth / roughness)
        mixture = evidence(problem, linear, x, target)
        if mixture.log < max(best.log, needed - 10.0):
            break  # without end it would gather all roughness in ever fewer intervals
        if mixture.log > max(best.log, needed):
            best, kept = mixture, problem.local
    problem.local = kept
    return _mean_roughness(best)


def _mean_roughness(mixture: _Mixture) -> float:
    return float(np.exp(np.sum(mixture.weight * np.log(_GRID))))
