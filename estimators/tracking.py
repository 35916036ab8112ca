"""Spin rate over a whole recording: a smoother of the field vector with precession, hard and soft iron estimated.

The readings are modelled as vectors, ``m_k = (I + S) C(t_k) m_0 + b + noise``, where the attitude C integrates the
body rates (p, q, r): p and q from the gyroscope, r(t) a spline with a smoothness prior whose strength the data decide
(largest marginal likelihood). So precession drops out exactly and not to first order. Maximum a posteriori by
Gauss-Newton; standard deviations from the inverse Hessian. Without a gyroscope p and q are smooth unknown functions
in the frame that does not spin, and what the field cannot show of them stays in the standard deviation.
Derivation, and what is unobservable: docs/spin-phase.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from discsim.arrays import BoolArray, FloatArray
from discsim.errors import InputError
from discsim.recording import Recording, Samples
from estimators.likelihood import LEAST, LikelihoodSettings, ToneFit, fit_windows, span_of, usable_field, window_centres
from estimators.precession import STRENGTH_SD, AxialField, axial_field, transverse_gyroscope, transverse_rates
from estimators.rate import YawRate
from estimators.spin_spline import SpinSpline
from estimators.turning_field import add_normal_equations, integrate
from estimators.usable import remembered, unclipped

__all__ = [
    "RateRows",
    "Track",
    "TrackingSettings",
    "joined",
    "plain_tracks",
    "track_bound",
    "track_spin",
    "tracking",
    "tracks_of",
]


@dataclass(frozen=True)
class TrackingSettings:
    """Settings of `tracking`; the priors are standard deviations.

    Attributes
    ----------
    knots : float
        Spacing of the spin rate's knots, s.
    step : float
        Spacing of the answers, s.
    segment, overlap : float
        A longer recording is cut into segments, s, that share ``overlap`` s with each neighbour: memory stays bounded.
    hard_iron, soft_iron : float
        uT, and relative.
    gyroscope_bias, gyroscope_gain : float
        Of p and q: rad/s, and relative (scale and turning about z; lag shows as turning).
    strength : float
        Relative, of the field's strength.
    precession, precession_knots : float
        Where no gyroscope shows p and q: transverse rate in the frame that does not spin, rad/s, and its knots, s.
    largest_sd : float
        Answers less certain than this, rad/s, are NaN.
    misfit : float
        Answers are NaN where the residual over half a second exceeds this many times the recording's own noise.
    window : float
        Of the likelihood windows that start the search, s.
    """

    knots: float = 0.1
    step: float = 0.05
    segment: float = 16.0
    overlap: float = 2.0
    hard_iron: float = 100.0
    soft_iron: float = 0.03
    gyroscope_bias: float = 0.2
    gyroscope_gain: float = 0.02
    strength: float = STRENGTH_SD
    precession: float = 0.15
    precession_knots: float = 0.4
    largest_sd: float = np.radians(60.0)
    misfit: float = 4.0
    window: float = 0.8

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InputError(f"tracking {name}: got {value}, expected a positive number")
        if self.segment < 2 * self.overlap:
            raise InputError(f"tracking segment: got {self.segment} s, expected at least twice the overlap")


@dataclass(frozen=True)
class RateRows:
    """Another sensor's say on the spin rate: readings ``value`` (n,) = r-dependent model, with unknown calibration.

    ``kind`` is "linear" for ``(1 + a) r + b`` (a gyroscope) and "centripetal" for complex ``(-r^2 + i r') d + b``
    (an accelerometer averaged over turns). ``calibration`` is the prior mean, ``prior`` its standard deviations.
    """

    kind: str
    t: FloatArray
    value: FloatArray
    sd: FloatArray
    calibration: FloatArray
    prior: FloatArray


@dataclass(frozen=True)
class Track:
    """One segment's answer.

    ``t`` (n,) s, ``rate`` and ``sd`` (n,) rad/s; ``blur`` (n,) the share of sd that the knots' spacing makes at a
    corner; ``covariance`` (n, n) of the rate; ``phase`` (k,) rad, the angle turned at the magnetometer's times
    ``times`` (k,); ``residual`` (k, 3) uT; ``noise`` per axis, uT; ``hard_iron`` (3,) uT; ``field`` (3,) uT at the
    start; ``calibration`` of other sensors; ``chi2`` of their rows per degree of freedom; ``spline``,
    ``coefficients``; ``roughness`` the spectral density of r'' found.
    """

    t: FloatArray
    rate: FloatArray
    sd: FloatArray
    blur: FloatArray
    covariance: FloatArray
    times: FloatArray
    phase: FloatArray
    residual: FloatArray
    noise: float
    hard_iron: FloatArray
    field: FloatArray
    spline: SpinSpline
    coefficients: FloatArray
    roughness: float
    calibration: list[FloatArray] = dataclass_field(default_factory=list)
    calibration_sd: list[FloatArray] = dataclass_field(default_factory=list)
    chi2: list[float] = dataclass_field(default_factory=list)
    gyroscope_gain: complex = 0j


def _segments(t: FloatArray, settings: TrackingSettings) -> list[tuple[float, float]]:
    """Cut start..stop into pieces of at most ``segment`` that share ``overlap`` with their neighbours."""
    start, stop = float(t[0]), float(t[-1])
    count = max(1, int(np.ceil((stop - start - settings.overlap) / (settings.segment - settings.overlap))))
    length = (stop - start + (count - 1) * settings.overlap) / count
    return [
        (start + i * (length - settings.overlap), start + i * (length - settings.overlap) + length)
        for i in range(count)
    ]


class _Turned(NamedTuple):
    """What the model makes of the field, at times t (n,) and in the middle of sub-steps (k,).

    ``residual`` (n, 3) uT, ``psi`` (n,) the angle turned, ``field`` (n, 3) in B before the irons, ``attitude``
    (n, 3, 3), ``axes`` (k, 3, 3) of the frame that does not spin, ``psi_middle`` (k,).
    """

    residual: FloatArray
    psi: FloatArray
    field: FloatArray
    attitude: FloatArray
    axes: FloatArray
    psi_middle: FloatArray


class _Problem:
    """The least-squares problem of one segment: parameters, residuals and derivatives.

    Parameters in order: spin spline, transverse rates (bias and gain of p, q, and splines of what they do not show),
    field (3), hard iron (3), soft iron (6), calibrations of other sensors' rows.
    """

    def __init__(
        self,
        t: FloatArray,
        m: FloatArray,
        settings: TrackingSettings,
        *,
        gyroscope: Samples | None,
        strength: float | None,
        fixed_axis: bool,
        decaying: bool,
        rows: list[RateRows],
        top_rate: float,
        typical_rate: float = 0.0,
        walk: float = 0.0,
    ) -> None:
        self.t, self.m, self.settings, self.rows = t, m, settings, rows
        self.strength, self.decaying = strength, decaying
        # a quarter of a radian per sub-step: the midpoint rule then errs by 1 % of the wobble's own share
        finest = min(0.005, 0.25 / max(top_rate, 1.0))
        # knots closer than the readings would be told by the prior alone
        spacing = max(settings.knots, float(np.median(np.diff(t))))
        self.spline = SpinSpline.over(float(t[0]), float(t[-1]), spacing)
        self.despun = gyroscope is None
        if gyroscope is not None:
            finest = max(finest, float(np.median(np.diff(t))) / MOST_SUBSTEPS)
            rates, self.substeps = transverse_rates(gyroscope, t, finest)
            self.w = np.where(np.isfinite(rates), rates, 0.0).ravel()
        else:
            self.substeps = min(max(1, int(np.ceil(float(np.median(np.diff(t))) / finest))), MOST_SUBSTEPS)
            self.w = np.zeros((t.size - 1) * self.substeps, dtype=complex)
        fraction = (np.arange(self.substeps) + 0.5) / self.substeps
        self.h = np.repeat(np.diff(t) / self.substeps, self.substeps)
        self.middle = (t[:-1, None] + np.diff(t)[:, None] * fraction).ravel()
        self.interval = np.repeat(np.arange(t.size - 1), self.substeps)
        self.first, self.weights = self.spline.local(self.middle)
        #: what the gyroscope's noise adds to the attitude, rad per root second; without one the whole rate is unknown
        self.walk = walk
        self.slow: SpinSpline | None = None
        if not fixed_axis and (gyroscope is None or walk > 0):
            self.slow = SpinSpline.over(float(t[0]), float(t[-1]), settings.precession_knots)
            self.slow_first, self.slow_weights = self.slow.local(self.middle)
        self.read = 0 if fixed_axis or gyroscope is None else 4
        transverse = self.read + (0 if self.slow is None else 2 * self.slow.size)
        sizes = [self.spline.size, transverse, 3, 3, 6] + [row.calibration.size for row in rows]
        ends = np.cumsum(sizes)
        self.parts = [slice(int(end - size), int(end)) for size, end in zip(sizes, ends, strict=True)]
        self.size = int(ends[-1])
        self.fixed_axis = fixed_axis
        #: least roughness: what a spin-down's time constant changes by may not be laid to an unseen precession
        self.least = 0.0 if self.slow is None or self.read else _CHANGE * typical_rate**2
        #: precision of each interval's roughness over the common one: small at the corner of a ramp or at a knock
        self.local = np.ones(self.spline.size - 2)

    # -------------------------------------------------------------------------------- prior

    def prior(self, precession: float) -> tuple[FloatArray, FloatArray]:
        """Return the precision (size, size) and mean (size,) of everything but the spin's roughness and strength."""
        s = self.settings
        precision = np.zeros((self.size, self.size))
        mean = np.zeros(self.size)
        spin, transverse, _, iron, soft = self.parts[:5]
        # a spline needs some prior where there are no data at all; this one says nothing: 1e4 rad/s
        precision[spin, spin] = np.eye(self.spline.size) * 1e-8
        if self.read:
            sd = np.repeat([s.gyroscope_bias, s.gyroscope_gain], 2)
            read = slice(transverse.start, transverse.start + self.read)
            precision[read, read] = np.diag(1 / sd**2)
        if self.slow is not None and self.read:
            # white noise of density walk^2, averaged over a knot's spacing
            noise = slice(transverse.start + self.read, transverse.stop)
            precision[noise, noise] = np.eye(2 * self.slow.size) * self.slow.spacing / self.walk**2
        elif self.slow is not None:
            distance = np.abs(np.subtract.outer(np.arange(self.slow.size), np.arange(self.slow.size)))
            # precession changes with the air's moment, over a second or two, about a level that stays
            correlation = 0.5 + 0.5 * np.exp(-distance * self.slow.spacing / 2.0)
            inverse = np.linalg.inv(correlation) / precession**2
            middle = transverse.start + self.slow.size
            precision[transverse.start : middle, transverse.start : middle] = inverse
            precision[middle : transverse.stop, middle : transverse.stop] = inverse
        precision[iron, iron] = np.eye(3) / s.hard_iron**2
        precision[soft, soft] = np.eye(6) / s.soft_iron**2
        for part, row in zip(self.parts[5:], self.rows, strict=True):
            precision[part, part] = np.diag(1 / row.prior**2)
            mean[part] = row.calibration
        return precision, mean

    def roughness_rows(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rows (k, spline size) and their targets (k,): r'' is white noise, about r'^2/r for a decay."""
        rows = self.spline.second_difference()
        target = np.zeros(rows.shape[0])
        if self.decaying:
            c = x[self.parts[0]]
            level = (c[:-2] + c[1:-1] + c[2:]) / 3
            slope = (c[2:] - c[:-2]) / (2 * self.spline.spacing)
            bend = np.where(np.abs(level) > 3.0, slope**2 / np.where(np.abs(level) > 3.0, level, 1.0), 0.0)
            # steeper than a time constant of two seconds is no spin-down in air
            target = np.where(np.abs(slope) < 0.5 * np.abs(level), bend, 0.0) * np.sqrt(self.spline.spacing)
        return rows, target

    # -------------------------------------------------------------------------------- model

    def evaluate(self, x: FloatArray) -> _Turned:
        """Return what the model makes of the field at the parameters x."""
        spin, transverse, vector, iron, soft = self.parts[:5]
        c = x[spin]
        r = np.einsum("ki,ki->k", self.weights, c[self.first[:, None] + np.arange(4)])
        w, unread = self.w, np.zeros(self.middle.size, dtype=complex)
        if self.read:
            bias, gain = complex(*x[transverse][:2]), complex(*x[transverse][2:4])
            w = (1 + gain) * (self.w - bias)
        if self.slow is not None:
            real, imaginary = x[transverse][self.read :].reshape(2, -1)
            PQ = real + 1j * imaginary
            unread = np.einsum("ki,ki->k", self.slow_weights, PQ[self.slow_first[:, None] + np.arange(4)])
        n, k = self.t.size, self.middle.size
        C, psi = np.empty((n, 3, 3)), np.empty(n)
        axes, psi_middle = np.empty((k, 3, 3)), np.empty(k)
        integrate(
            self.t, self.substeps, r, np.ascontiguousarray(w.real), np.ascontiguousarray(w.imag),
            np.ascontiguousarray(unread.real), np.ascontiguousarray(unread.imag), C, psi, axes, psi_middle,
        )  # fmt: skip
        turned = C @ x[vector]
        residual = self.m - turned @ (np.eye(3) + _symmetric(x[soft])).T - x[iron]
        return _Turned(residual, psi, turned, C, axes, psi_middle)

    def add_field(
        self, x: FloatArray, at: _Turned, scale: FloatArray, information: FloatArray, right: FloatArray
    ) -> None:
        """Add the magnetometer's normal equations at x, each reading (n,) times ``scale``."""
        _, transverse, vector, _, soft = self.parts[:5]
        n, k = self.t.size, self.middle.size
        total = np.zeros((n, self.read, 3))
        if self.read:
            cm, sm = np.cos(at.psi_middle)[:, None], np.sin(at.psi_middle)[:, None]
            ex = cm * at.axes[:, 0] + sm * at.axes[:, 1]
            ey = -sm * at.axes[:, 0] + cm * at.axes[:, 1]
            read = self.w - complex(*x[transverse][:2])
            p, q = read.real[:, None], read.imag[:, None]
            moment = np.stack([-ex, -ey, p * ex + q * ey, p * ey - q * ex], 1) * self.h[:, None, None]
            total[1:] = np.cumsum(np.add.reduceat(moment, np.arange(0, k, self.substeps), axis=0), axis=0)
        none = self.slow is None
        add_normal_equations(
            self.substeps, self.h, at.axes, at.attitude, np.eye(3) + _symmetric(x[soft]), x[vector], at.field,
            at.residual, scale, self.despun, self.first, self.weights, self.spline.size,
            self.first if none else self.slow_first, self.weights if none else self.slow_weights,
            0 if self.slow is None else self.slow.size, total, information, right,
        )  # fmt: skip

    def evaluate_rows(self, x: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Return the whitened residual and derivative of each other sensor's rows."""
        out = []
        c = x[self.parts[0]]
        for part, row in zip(self.parts[5:], self.rows, strict=True):
            B = self.spline.basis(row.t)
            r = B @ c
            a = x[part]
            if row.kind == "linear":
                J = np.zeros((row.t.size, self.size))
                J[:, self.parts[0]] = (1 + a[0]) * B
                J[:, part.start] = r
                J[:, part.start + 1] = 1.0
                residual = row.value - (1 + a[0]) * r - a[1]
                out.append((residual / row.sd, J / row.sd[:, None]))
            else:
                B1 = self.spline.basis(row.t, 1)
                d = complex(a[0], a[1])
                shape = -(r**2) + 1j * (B1 @ c)
                error = row.value[:, 0] + 1j * row.value[:, 1] - shape * d - complex(a[2], a[3])
                J2 = np.zeros((row.t.size, self.size), dtype=complex)
                J2[:, self.parts[0]] = d * (-2 * r[:, None] * B + 1j * B1)
                J2[:, part.start] = shape
                J2[:, part.start + 1] = 1j * shape
                J2[:, part.start + 2] = 1.0
                J2[:, part.start + 3] = 1j
                sd = np.concatenate([row.sd, row.sd])
                residual = np.concatenate([error.real, error.imag]) / sd
                out.append((residual, np.concatenate([J2.real, J2.imag]) / sd[:, None]))
        return out


def _symmetric(s: FloatArray) -> FloatArray:
    return np.array([[s[0], s[1], s[2]], [s[1], s[3], s[4]], [s[2], s[4], s[5]]])


# ---------------------------------------------------------------------------------------------- solution


@dataclass
class _Linear:
    """The problem about its current point: data information, its right side, and the prior beside the roughness."""

    information: FloatArray
    right: FloatArray
    cost: float


#: Spectral densities of r'' tried, (rad/s^3)^2 s. Their prior falls slowly: where the data cannot tell, a
#: steady change of rate is likelier than a rough one.
_GRID = np.logspace(-10, 7, 35)

#: Most sub-steps between readings: 0.7 s in steps of 5 ms, and at 100 Hz a quarter of a radian at 500 turns a second.
MOST_SUBSTEPS = 140

#: Longest span, s, of which every step has an answer, be it that nothing is known: a day, which is 1.7 million.
LONGEST = 86400.0

#: Least spectral density of r'', over r^2, where precession is unseen: r'/r changes by a third of 1/18 s in 5 s.
_CHANGE = 5.0 * (0.33 / 18.0 / 5.0) ** 2


def _linearise(
    problem: _Problem, x: FloatArray, noise: float, weights: FloatArray, precision: FloatArray, mean: FloatArray
) -> tuple[_Linear, FloatArray, FloatArray]:
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
    return _Linear(information, right, cost), at.residual, at.psi


def _with_roughness(
    problem: _Problem, linear: _Linear, x: FloatArray, target: FloatArray, roughness: float
) -> tuple[FloatArray, FloatArray, float]:
    scale = np.sqrt(problem.local)
    rows = scale[:, None] * problem.spline.second_difference()
    spin = problem.parts[0]
    information = linear.information.copy()
    information[spin, spin] += rows.T @ rows / roughness
    gap = scale * target - rows @ x[spin]
    right = linear.right.copy()
    right[spin] += rows.T @ gap / roughness
    return information, right, linear.cost + float(gap @ gap) / roughness


def _solve(
    problem: _Problem, x: FloatArray, noise: float, weights: FloatArray, roughness: float, precession: float, most: int
) -> tuple[FloatArray, _Linear, FloatArray, FloatArray, FloatArray]:
    """Gauss-Newton with damping until a step is worth less than a hundredth of a standard deviation."""
    precision, mean = problem.prior(precession)
    _, target = problem.roughness_rows(x)
    linear, residual, psi = _linearise(problem, x, noise, weights, precision, mean)
    damping = 0.0
    for _ in range(most):
        information, right, cost = _with_roughness(problem, linear, x, target, roughness)
        diagonal = np.diag(information)
        step = cho_solve(cho_factor(information + np.diag(damping * diagonal)), right)
        trial = x + step
        moved, trial_residual, trial_psi = _linearise(problem, trial, noise, weights, precision, mean)
        _, _, trial_cost = _with_roughness(problem, moved, trial, target, roughness)
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


def _evidence(problem: _Problem, linear: _Linear, x: FloatArray, target: FloatArray) -> _Mixture:
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


def track_bound(
    t: FloatArray,
    m: FloatArray,
    rate: FloatArray,
    noise: float,
    at: float,
    settings: TrackingSettings,
    *,
    gyroscope: Samples | None,
    strength: float | None,
    walk: float = 0.0,
) -> float:
    """Return the Bayesian Cramer-Rao bound of the rate at one instant, rad/s, of the whole model of `track_spin`.

    The inverse Fisher matrix for a rate that changes steadily (r'' = 0) with field, hard and soft iron, and the
    gyroscope's bias and gain unknown within their priors. ``m`` (n, 3), ``rate`` (n,) and ``gyroscope`` are true ones;
    ``walk`` is what the gyroscope's noise adds to the attitude, rad per root second.
    """
    problem = _Problem(
        t, m, settings, gyroscope=gyroscope, strength=strength, fixed_axis=False, decaying=False, rows=[],
        top_rate=float(np.max(np.abs(rate))), walk=walk,
    )  # fmt: skip
    x, linear, *_ = _solve(problem, _start(problem, rate, None), noise, np.ones(t.size), 1e-6, settings.precession, 20)
    information, _, _ = _with_roughness(problem, linear, x, np.zeros(problem.spline.size - 2), 1e-10)
    B = np.zeros(problem.size)
    B[problem.parts[0]] = problem.spline.basis(np.array([at]))[0]
    return float(np.sqrt(B @ np.linalg.solve(information, B)))


def _adapt(problem: _Problem, linear: _Linear, x: FloatArray, target: FloatArray) -> float:
    """Find the roughness, and where it is larger than elsewhere: Student's t with one degree of freedom for r''.

    A flight is alike smooth throughout; a rate table is quiet between the corners of its ramps. Which of both it is,
    the evidence says. Expectation-maximisation with the posterior variance of r'', so that intervals without data
    keep the common roughness.
    """
    rows = problem.spline.second_difference()
    problem.local = np.ones(problem.spline.size - 2)
    best = mixture = _evidence(problem, linear, x, target)
    kept, needed = problem.local, best.log + 10.0  # corners must be plain
    for _ in range(12):
        roughness = _mean_roughness(mixture)
        bend = rows @ mixture.mean - target
        square = bend**2 + np.sum((rows @ mixture.covariance) * rows, axis=1)
        # corners fall between knots: neighbours share them
        smooth = np.maximum(square, 0.5 * np.maximum(np.roll(square, 1), np.roll(square, -1)))
        problem.local = 2.0 / (1.0 + smooth / roughness)
        mixture = _evidence(problem, linear, x, target)
        if mixture.log < max(best.log, needed - 10.0):
            break  # without end it would gather all roughness in ever fewer intervals
        if mixture.log > max(best.log, needed):
            best, kept = mixture, problem.local
    problem.local = kept
    return _mean_roughness(best)


def _mean_roughness(mixture: _Mixture) -> float:
    return float(np.exp(np.sum(mixture.weight * np.log(_GRID))))


def track_spin(
    t: FloatArray,
    m: FloatArray,
    start_rate: FloatArray,
    settings: TrackingSettings,
    *,
    gyroscope: Samples | None = None,
    strength: float | None = None,
    fixed_axis: bool = False,
    decaying: bool = True,
    axial: AxialField | None = None,
    rows: list[RateRows] | None = None,
    noise: float | None = None,
    walk: float = 0.0,
) -> Track:
    """Smooth one segment: field m (n, 3) uT at times t (n,), from a first guess ``start_rate`` (n,) rad/s.

    ``strength`` is the field's, uT; ``axial`` a first guess of the hard iron along z; ``noise`` the data sheet's,
    uT, taken as a floor; ``walk`` what the gyroscope's noise adds to the attitude, rad per root second. ``rows``
    are other sensors' readings of the rate.
    """
    rows = rows or []
    problem = _Problem(
        t, m, settings, gyroscope=gyroscope, strength=strength, fixed_axis=fixed_axis, decaying=decaying,
        rows=rows, top_rate=float(np.max(np.abs(start_rate))), typical_rate=float(np.median(np.abs(start_rate))),
        walk=walk,
    )  # fmt: skip
    x = _start(problem, start_rate, axial)
    precession = settings.precession
    weights = np.ones(t.size)
    residual = problem.evaluate(x).residual
    floor = 0.7 * noise if noise else 1e-6
    sigma = max(float(np.sqrt(np.mean(residual**2))), floor)
    roughness = 100.0
    target = np.zeros(0)
    for outer in range(4):
        x, linear, residual, psi, target = _solve(problem, x, sigma, weights, roughness, precession, 15)
        length = np.sqrt(np.mean(residual**2, axis=1))
        sigma = max(_noise(residual, weights, problem, linear, roughness), floor)
        # Huber's weight for single bad readings
        weights = np.sqrt(np.minimum(1.0, 4.0 * sigma / np.maximum(length, 1e-12)))
        precision, mean = problem.prior(precession)
        linear, residual, psi = _linearise(problem, x, sigma, weights, precision, mean)
        previous = roughness
        roughness = _adapt(problem, linear, x, target)
        if problem.slow is not None and problem.despun:
            # the part of the precession that the field shows tells the size of the part that it does not
            PQ = x[problem.parts[1]]
            shown = 1 - np.diag(np.linalg.inv(linear.information))[problem.parts[1]] / precession**2
            weight = np.clip(shown, 0, 1)
            seen = float(np.sum(weight * PQ**2) + 2 * settings.precession**2) / (float(np.sum(weight)) + 2)
            precession = max(settings.precession, float(np.sqrt(seen)))
        if outer > 0 and abs(np.log(roughness / previous)) < 0.2:
            break
    mixture = _evidence(problem, linear, x, target)
    coefficients, covariance = mixture.mean, mixture.covariance
    first = int(np.ceil(t[0] / settings.step - 1e-9))
    count = int(np.floor(t[-1] / settings.step + 1e-9)) + 1 - first
    grid = settings.step * (first + np.arange(count, dtype=np.float64))
    B = problem.spline.basis(grid)
    inflation = _correlation(problem, residual, x)
    covariance *= inflation
    blur = _blur(problem.spline, coefficients, grid)
    rate_covariance = B @ covariance @ B.T
    everything = np.linalg.inv(_with_roughness(problem, linear, x, target, roughness)[0])
    parts = problem.parts[5:]
    return Track(
        t=grid,
        rate=B @ coefficients,
        sd=np.hypot(np.sqrt(np.diag(rate_covariance)), blur),
        blur=blur,
        covariance=rate_covariance,
        times=t,
        phase=psi,
        residual=residual,
        noise=sigma,
        hard_iron=x[problem.parts[3]],
        field=x[problem.parts[2]],
        spline=problem.spline,
        coefficients=coefficients,
        roughness=roughness,
        calibration=[x[part] for part in parts],
        calibration_sd=[np.sqrt(np.diag(everything)[part]) for part in parts],
        chi2=[float(np.mean(error**2)) for error, _ in problem.evaluate_rows(x)],
        gyroscope_gain=complex(*x[problem.parts[1]][2:4]) if not problem.despun and not fixed_axis else 0j,
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


def _start(problem: _Problem, start_rate: FloatArray, axial: AxialField | None) -> FloatArray:
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


def _noise(residual: FloatArray, weights: FloatArray, problem: _Problem, linear: _Linear, roughness: float) -> float:
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


def _correlation(problem: _Problem, residual: FloatArray, x: FloatArray) -> float:
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


def tracking(recording: Recording, settings: TrackingSettings | None = None) -> YawRate:
    """Spin rate, signed, of a whole recording from its magnetometer, and p, q of its gyroscope where it has one.

    Raises `InputError` if the recording has no magnetometer.
    """
    settings = settings or TrackingSettings()
    span = span_of(recording)
    return joined("tracking", plain_tracks(recording, settings, 0), settings, span)


@remembered
def plain_tracks(recording: Recording, settings: TrackingSettings, unfold: int) -> list[Track]:
    """Return `tracks_of` the magnetometer, without other sensors' readings of the rate."""
    return tracks_of(recording, settings, unfold=unfold)


def tracks_of(
    recording: Recording, settings: TrackingSettings, rows: list[RateRows] | None = None, unfold: int = 0
) -> list[Track]:
    """Return the segments' tracks, in time order; none where no window shows a spin.

    ``rows`` are other sensors' readings of the rate. ``unfold`` turns more per sampling interval than the field shows
    are made by a spin faster than half the sampling rate; only another sensor can tell (`estimators.fusion`).
    """
    magnetometer = recording.need("magnetometer")
    sheet = recording.sheets.get("magnetometer")
    t, m = usable_field(magnetometer, sheet)
    gyroscope = transverse_gyroscope(recording)
    fixed_axis = recording.plant in ("rate_table", "spin_down")
    strength = recording.environment.field_strength
    if t.size < LEAST:
        return []
    fits, axial = _window_fits(recording, settings.window, turning=unfold == 0)
    fold = 2 * np.pi / float(np.median(np.diff(t))) * unfold
    size = float(np.median(np.linalg.norm(m, axis=1))) if strength is None else strength
    noise = None
    if sheet is not None and sheet.noise_rms is not None:
        noise = float(np.hypot(sheet.noise_rms, (sheet.resolution or 0.0) / np.sqrt(12)))
    tracks = []
    for first, last, rate in _runs(
        t, replace(fits, phase_rate=fits.phase_rate - fold), unclipped(recording, "gyroscope")
    ):
        for start, stop in _segments(t[first:last], settings):
            chosen = slice(
                first + int(np.searchsorted(t[first:last], start - 1e-9)),
                first + int(np.searchsorted(t[first:last], stop + 1e-9)),
            )
            if chosen.stop - chosen.start < LEAST:
                continue
            track = _tracked(
                t[chosen],
                m[chosen],
                rate[chosen.start - first : chosen.stop - first],
                settings,
                gyroscope=None if fixed_axis else gyroscope,
                strength=strength,
                fixed_axis=fixed_axis,
                decaying=recording.plant != "rate_table",
                axial=axial,
                rows=_between(rows or [], float(t[chosen][0]), float(t[chosen][-1])),
                noise=noise,
                walk=_walk(recording, noise, size, stop - start),
            )
            if track is not None:
                tracks.append(track)
    return tracks


@remembered
def _window_fits(recording: Recording, window: float, *, turning: bool) -> tuple[ToneFit, AxialField]:
    """Fit the field's tone in windows, s, that start the search, and the hard iron along z that they show.

    With ``turning`` the gyroscope's p and q, where they are there, are part of the model.
    """
    t, m = usable_field(recording.need("magnetometer"), recording.sheets.get("magnetometer"))
    gyroscope = transverse_gyroscope(recording)
    windows = LikelihoodSettings(window=window, step=window / 8, degree=1)
    centres = window_centres(t, windows)
    fits = fit_windows(t, m, centres, windows)
    axial = axial_field(fits.amplitude, fits.axial, recording.environment.field_strength)
    if gyroscope is not None and recording.plant not in ("rate_table", "spin_down") and turning:
        turned = fit_windows(t, m, centres, windows, gyroscope=gyroscope, axial=axial, start=fits)
        fits = turned if np.any(np.isfinite(turned.phase_rate)) else fits
    return fits, axial


def _walk(recording: Recording, noise: float | None, strength: float, length: float) -> float:
    """Return what the gyroscope's noise adds to the attitude, rad per root second; 0 where it cannot matter.

    It is left out where, summed over ``length`` s, it stays below a third of the magnetometer's own noise: the usual.
    """
    sheet = recording.sheets.get("gyroscope")
    if sheet is None or sheet.noise_rms is None or noise is None:
        return 0.0
    walk = sheet.noise_rms / sqrt(sheet.rate_hz)
    return walk if walk * strength * sqrt(length) > noise / 3 else 0.0


def _tracked(t: FloatArray, *arguments: Any, **options: Any) -> Track | None:
    """Return the track, or None where the readings are so unlike a turning field that nothing can be solved."""
    try:
        return track_spin(t, *arguments, **options)
    except np.linalg.LinAlgError:
        return None


def _between(rows: list[RateRows], start: float, stop: float) -> list[RateRows]:
    """Return what each sensor has to say from start to stop, leaving out those that say nothing."""
    out = []
    for row in rows:
        chosen = (row.t >= start) & (row.t <= stop)
        if np.any(chosen):
            out.append(replace(row, t=row.t[chosen], value=row.value[chosen], sd=row.sd[chosen]))
    return out


def _runs(t: FloatArray, fits: ToneFit, gyroscope: Samples | None) -> list[tuple[int, int, FloatArray]]:
    """Return stretches of the readings, as index ranges, over which the turns can be counted, with a first rate.

    Between windows that are less than a second apart, or where the gyroscope's z is within its range, the rate is
    known well enough to carry the phase; elsewhere the turns are lost and a new stretch begins.
    """
    known = np.isfinite(fits.phase_rate)
    times, rates = fits.t[known], -fits.phase_rate[known]
    lengths = fits.length[known]
    if gyroscope is not None:
        z = gyroscope.value[:, 2]
        good = np.isfinite(z)
        smooth = np.interp(t, gyroscope.t[good], z[good]) if np.count_nonzero(good) > 1 else np.full(t.size, np.nan)
        near = np.zeros(t.size, dtype=bool)
        if np.count_nonzero(good) > 1:
            index = np.clip(np.searchsorted(gyroscope.t[good], t), 1, np.count_nonzero(good) - 1)
            near = np.diff(gyroscope.t[good])[index - 1] < 0.1
            near &= (t >= gyroscope.t[good][0] - 0.02) & (t <= gyroscope.t[good][-1] + 0.02)
    else:
        smooth, near = np.full(t.size, np.nan), np.zeros(t.size, dtype=bool)
    covered = near.copy()
    reach = 0.5 * lengths + 0.25
    for first, last in zip(np.searchsorted(t, times - reach), np.searchsorted(t, times + reach, "right"), strict=True):
        covered[first:last] = True
    rate = np.interp(t, times, rates) if times.size else np.where(near, smooth, 0.0)
    distance = np.full(t.size, np.inf)
    if times.size:
        after = (
            np.clip(np.searchsorted(times, t), 1, max(times.size - 1, 1)) if times.size > 1 else np.zeros(t.size, int)
        )
        distance = np.minimum(np.abs(t - times[after]), np.abs(t - times[np.maximum(after - 1, 0)]))
    # where no window tells, the gyroscope does; where both do, it tells how many turns a slow sampling missed
    fold = 2 * np.pi / float(np.median(np.diff(t)))
    missed = np.where(near, np.rint((np.nan_to_num(smooth) - rate) / fold), 0.0)
    rate = np.where(near & (distance > 0.5), smooth, rate + fold * missed)
    runs = []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], covered, [False]]).astype(int)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        # a hole in the time stamps loses the turns as well
        holes = first + 1 + np.flatnonzero(np.diff(t[first:last]) > 1.0)
        for a, b in zip([first, *holes], [*holes, last], strict=True):
            runs.append((int(a), int(b), rate[a:b]))
    return runs


def joined(method: str, tracks: list[Track], settings: TrackingSettings, span: tuple[float, float]) -> YawRate:
    """Join segments where they overlap, each up to the middle of the overlap; NaN between them and where they misfit.

    ``span`` is the recording's first and last time, s; the answers stand at whole steps within it.
    """
    steps = _answers(tracks, settings, span)
    grid = settings.step * steps
    rate, sd = np.full(grid.size, np.nan), np.full(grid.size, np.nan)
    for index, track in enumerate(tracks):
        good = _trusted(track, settings)
        if index > 0:
            good &= track.t > 0.5 * (tracks[index - 1].times[-1] + track.times[0])
        if index + 1 < len(tracks):
            good &= track.t <= 0.5 * (track.times[-1] + tracks[index + 1].times[0])
        place = np.searchsorted(steps, np.rint(track.t[good] / settings.step))
        rate[place], sd[place] = track.rate[good], track.sd[good]
    return YawRate(method, grid, rate, sd, signed=True)


def _answers(tracks: list[Track], settings: TrackingSettings, span: tuple[float, float]) -> FloatArray:
    """Return which whole steps are answered: all of the span, or, where that is longer than `LONGEST`, the tracks'."""
    first, last = np.ceil(span[0] / settings.step - 1e-9), np.floor(span[1] / settings.step + 1e-9)
    if span[1] - span[0] <= LONGEST:
        return np.asarray(np.arange(first, last + 1, dtype=np.float64))
    # a clock that jumps by years: no answers by the billion that say nothing
    told = [np.rint(track.t / settings.step) for track in tracks]
    return np.unique(np.concatenate([[first, last], *told]))


def _trusted(track: Track, settings: TrackingSettings) -> BoolArray:
    good = (track.sd <= settings.largest_sd) & np.isfinite(track.rate)
    square = np.mean(track.residual**2, axis=1)
    # a single wild reading, which had no weight, is no misfit
    square = np.minimum(square, 40 * float(np.median(square)))
    cumulative = np.concatenate([[0.0], np.cumsum(square)])
    lo = np.searchsorted(track.times, track.t - 0.25)
    hi = np.searchsorted(track.times, track.t + 0.25)
    local = (cumulative[hi] - cumulative[lo]) / np.maximum(hi - lo, 1)
    usual = float(np.median(square)) * 1.27  # the mean of chi-square of three is 1.27 times its median
    good &= (local <= settings.misfit**2 * max(usual, 1e-12)) & (hi - lo >= 3)
    field = float(np.linalg.norm(track.field))
    if track.noise > 0.2 * field:
        good[:] = False
    return np.asarray(good)
