"""Gauss-Newton steps of the smoother and the roughness that the data decide (largest marginal likelihood)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.lapack import dpotrf, dpotri, dpotrs

from discsim.arrays import FloatArray
from discsim.estimators.tracking.problem import Linear, Problem, Turned

__all__ = ["Mixture", "Point", "adapt", "linearise", "may_reach", "mean_roughness", "solve", "with_roughness"]


#: Spectral densities of r'' tried, (rad/s^3)^2 s. Their prior falls slowly: where the data cannot tell, a
#: steady change of rate is likelier than a rough one.
_GRID = np.logspace(-10, 7, 35)

#: The grid is left where the evidence is this far below the best twice in a row: exp(-25) of it.
FAR = 25.0

#: Most rounds of expectation-maximisation.
_ROUNDS = 12


class Point:
    """Unknowns x, what the model makes of them, and the normal equations there for readings of unit noise.

    Each is worked out when it is first asked for, and once: noise, roughness and priors change more often than x.
    """

    def __init__(self, problem: Problem, x: FloatArray, weights: FloatArray, at: Turned | None = None) -> None:
        self.problem, self.x, self.weights = problem, x, weights
        self.at = problem.evaluate(x) if at is None else at

    def weighed(self, weights: FloatArray) -> Point:
        """Return the same point with other weights (n,) of the readings."""
        same = np.array_equal(weights, self.weights)
        return self if same else Point(self.problem, self.x, weights, self.at)

    @cached_property
    def field(self) -> tuple[FloatArray, FloatArray]:
        """The magnetometer's information (m, m) and right-hand side (m,)."""
        size = self.problem.size
        information, right = np.zeros((size, size)), np.zeros(size)
        self.problem.add_field(self.x, self.at, self.weights, information, right)
        return information, right

    @cached_property
    def rows(self) -> list[tuple[FloatArray, FloatArray]]:
        """The whitened residuals and derivatives of other sensors' rows."""
        return self.problem.evaluate_rows(self.x)


def _huber(error: FloatArray) -> FloatArray:
    """Return Huber's weight at four sigma: a reading far outside its calibration's reach must not bend the track."""
    return np.minimum(1.0, 4.0 / np.maximum(np.abs(error), 1e-12))


def _cost(point: Point, noise: float, precision: FloatArray, mean: FloatArray) -> float:
    """Return twice the negative log posterior of readings of a noise, uT, but for constants and the roughness."""
    problem, x = point.problem, point.x
    error = (point.at.residual * (point.weights[:, None] / noise)).ravel()
    cost = float(error @ error + (x - mean) @ precision @ (x - mean))
    for row_error, _ in point.rows:
        weight = _huber(row_error)
        cost += float(np.sum(np.where(weight < 1, 8 * np.abs(row_error) - 16, row_error**2)))
    if problem.strength is not None:
        length = float(np.linalg.norm(x[problem.parts[2]]))
        cost += ((problem.strength - length) / (problem.settings.strength * problem.strength)) ** 2
    return cost


def linearise(point: Point, noise: float, precision: FloatArray, mean: FloatArray) -> Linear:
    """Linearise readings of a noise, uT, about a point, with the unknowns' priors."""
    problem, x = point.problem, point.x
    information = point.field[0] / noise**2 + precision
    right = point.field[1] / noise**2 - precision @ (x - mean)
    for row_error, row_J in point.rows:
        weight = _huber(row_error)
        information += row_J.T @ (row_J * weight[:, None])
        right += row_J.T @ (row_error * weight)
    if problem.strength is not None:
        vector = problem.parts[2]
        m0 = x[vector]
        length = float(np.linalg.norm(m0))
        sd = problem.settings.strength * problem.strength
        gradient = np.zeros(problem.size)
        gradient[vector] = m0 / length / sd
        information += np.outer(gradient, gradient)
        right += gradient * ((problem.strength - length) / sd)
    cost = _cost(point, noise, precision, mean)
    if not (np.isfinite(cost) and np.all(np.isfinite(information))):
        raise np.linalg.LinAlgError("the fit has left the numbers")
    return Linear(information, right, cost)


def _gap(problem: Problem, x: FloatArray, target: FloatArray) -> FloatArray:
    """Return by how much second differences miss their means, (spline size - 2,), for a roughness of one."""
    return np.asarray(np.sqrt(problem.local) * (target - problem.spline.bend(x[problem.parts[0]])))


def with_roughness(
    problem: Problem, linear: Linear, x: FloatArray, target: FloatArray, roughness: float
) -> tuple[FloatArray, FloatArray, float]:
    """Return the information (n, n), right-hand side (n,) and cost of a linearisation with a roughness's rows added."""
    spin, gap = problem.parts[0], _gap(problem, x, target)
    information = linear.information.copy()
    information[spin, spin] += problem.penalty() / roughness
    right = linear.right.copy()
    right[spin] += problem.spline.pulled(np.sqrt(problem.local) * gap) / roughness
    return information, right, linear.cost + float(gap @ gap) / roughness


def solve(
    problem: Problem, point: Point, noise: float, roughness: float, precession: float, most: int
) -> tuple[Point, Linear, FloatArray]:
    """Gauss-Newton with damping until a step is worth less than a hundredth of a standard deviation.

    What second differences are expected to be follows the spin, and a step is judged by what they are after it: where
    they hold closely (a decay that is exponential all but exactly) others lead away for good. The linearisation
    returned is the one from which the last step was taken.
    """
    precision, mean = problem.prior(precession)
    target = problem.bend_expected(point.x)
    linear = linearise(point, noise, precision, mean)
    damping = 0.0
    for _ in range(most):
        information, right, cost = with_roughness(problem, linear, point.x, target, roughness)
        information[np.diag_indices_from(information)] *= 1.0 + damping
        step = cho_solve(cho_factor(information), right)
        trial = Point(problem, point.x + step, point.weights)
        expected = problem.bend_expected(trial.x)
        gap = _gap(problem, trial.x, expected)
        if _cost(trial, noise, precision, mean) + float(gap @ gap) / roughness <= cost + 1e-9:
            point, target = trial, expected
            damping = 0.0 if damping < 1e-4 else damping * 0.1
            if float(step @ right) < 1e-4:
                break
            linear = linearise(point, noise, precision, mean)
        else:
            damping = max(1e-4, 10 * damping)
            if damping > 1e6:
                break
    return point, linear, target


@dataclass(frozen=True)
class Mixture:
    """Weights of the grid of roughness, the spin's mean coefficients and covariance, and the best log evidence."""

    weight: FloatArray
    mean: FloatArray
    covariance: FloatArray
    log: float


class _Reduced:
    """The spin's normal equations, what is not spin eliminated; only the prior of the second differences changes."""

    def __init__(self, problem: Problem, linear: Linear, x: FloatArray, target: FloatArray) -> None:
        size = problem.parts[0].stop
        A, B, C = linear.information[:size, :size], linear.information[:size, size:], linear.information[size:, size:]
        inner = cho_factor(C)
        self.problem, self.coefficients = problem, x[problem.parts[0]]
        self.information = A - B @ cho_solve(inner, B.T)
        self.right = linear.right[:size] - B @ cho_solve(inner, linear.right[size:])
        self.gap = target - problem.spline.bend(self.coefficients)

    def evidence(self, near: int | None = None) -> Mixture:
        """Integrate over the roughness, each value of a grid weighed by its marginal likelihood (Laplace).

        All of the grid is looked at, or what matters of it about the place ``near``.
        """
        problem = self.problem
        count, size, local = problem.spline.size - 2, self.right.size, problem.local
        penalty, pull = problem.penalty(), problem.spline.pulled(local * self.gap)
        squares = float(local @ self.gap**2)
        # the penalty has five diagonals, and a factor needs those on and below the middle
        whole = np.asfortranarray(self.information.T)
        below = [(slice(d, (size - d) * size, size + 1), np.diagonal(penalty, -d)) for d in range(3)]
        log, solved = np.full(_GRID.size, -np.inf), {}

        def look(place: int) -> float:
            roughness = _GRID[place]
            # columns one after another, in which LAPACK works without a copy
            matrix = whole.copy(order="F")
            entries = matrix.ravel(order="F")
            for places, values in below:
                entries[places] += values / roughness
            factor, failed = dpotrf(matrix, lower=1, clean=0, overwrite_a=1)
            if failed:
                raise np.linalg.LinAlgError("the spin's normal equations are not positive")
            right = self.right + pull / roughness
            step = dpotrs(factor, right, lower=1)[0]
            determinant = 2 * float(np.sum(np.log(np.diag(factor))))
            cost = squares / roughness - float(step @ right)
            solved[place] = step, factor
            if roughness >= problem.least:
                log[place] = -0.5 * (cost + determinant + count * np.log(roughness)) - 0.18 * np.log(roughness)
            return float(log[place])

        if near is None:
            best = max(look(place) for place in range(_GRID.size))
        else:
            best = look(near)
            for places in (range(near + 1, _GRID.size), range(near - 1, -1, -1)):
                far = 0
                for place in places:
                    found = look(place)
                    best, far = max(best, found), far + 1 if found < best - FAR else 0
                    if far == 2:
                        break
        weight = np.exp(log - best)
        weight = np.where(weight < 1e-3, 0.0, weight)
        weight /= np.sum(weight)
        likely = [int(place) for place in np.flatnonzero(weight)]
        mean = np.sum([weight[place] * solved[place][0] for place in likely], axis=0)
        covariance = np.zeros((size, size))
        for place in likely:
            step, factor = solved[place]
            spread = step - mean
            covariance += weight[place] * (dpotri(factor, lower=1)[0] + np.outer(spread, spread))
        covariance = np.tril(covariance) + np.tril(covariance, -1).T
        # Student's t with one degree of freedom: a normal law whose precision is Gamma(1/2, 1/2), by its logarithm
        own = float(np.sum(np.log(local) - 0.5 * local + 0.5))
        return Mixture(weight, self.coefficients + mean, covariance, best + own)


def adapt(problem: Problem, linear: Linear, x: FloatArray, target: FloatArray, about: float | None = None) -> Mixture:
    """Find the roughness, and where it is larger than elsewhere: Student's t with one degree of freedom for r''.

    A flight is alike smooth throughout; a rate table is quiet between the corners of its ramps. Which of both it is,
    the evidence says. Expectation-maximisation with the posterior variance of r'', so that intervals without data
    keep the common roughness. ``about`` is the roughness where it is roughly known: the grid is looked at from there.
    """
    reduced = _Reduced(problem, linear, x, target)
    problem.local = np.ones(problem.spline.size - 2)
    near = None if about is None else int(np.argmin(np.abs(np.log(_GRID / about))))
    best = mixture = reduced.evidence(near)
    kept, needed = problem.local, best.log + 10.0  # corners must be plain
    for left in range(_ROUNDS - 1, -1, -1):
        roughness = mean_roughness(mixture)
        bend = problem.spline.bend(mixture.mean) - target
        square = bend**2 + problem.spline.bend_variance(mixture.covariance)
        # corners fall between knots: neighbours share them
        smooth = np.maximum(square, 0.5 * np.maximum(np.roll(square, 1), np.roll(square, -1)))
        problem.local = 2.0 / (1.0 + smooth / roughness)
        before = mixture.log
        mixture = reduced.evidence(near=int(np.argmax(mixture.weight)))
        if mixture.log < max(best.log, needed - 10.0):
            break  # without end it would gather all roughness in ever fewer intervals
        if mixture.log > max(best.log, needed):
            best, kept = mixture, problem.local
        elif not may_reach(needed, mixture.log, mixture.log - before, left):
            break
    problem.local = kept
    return best


def may_reach(height: float, log: float, gain: float, left: int) -> bool:
    """Tell whether a log evidence may rise to a height in ``left`` rounds of expectation-maximisation.

    Rounds gain less and less: they will not where as much as the last one gained, in each, would not do.
    """
    return log + left * abs(gain) >= height


def mean_roughness(mixture: Mixture) -> float:
    """Return the geometric mean of the roughness, (rad/s^3)^2 s."""
    return float(np.exp(np.sum(mixture.weight * np.log(_GRID))))
