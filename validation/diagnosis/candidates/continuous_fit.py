"""The fit with continuity enforced: one motion from release to end under a hypothesis.

Takes a fit and a hypothesis; gives it refitted and its score, twice the negative log likelihood in the noise that is
there then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.sensors import CrossAxis, Lag
from discsim.validation.diagnosis.candidates.begun_anew import begun_anew
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, parameters_of
from discsim.validation.diagnosis.candidates.evidence import BOUNDS, charge
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, Start, fitted_parameters
from discsim.validation.diagnosis.first_trajectory import beginning, time_ratio
from discsim.validation.identification.from_afar import fitted_from_afar
from discsim.validation.identification.gauss_newton import NO_BARS, Bars, Fit, merit_of, penalty_of, refit
from discsim.validation.identification.noise import (
    NoiseModel,
    estimate_noise,
    likeliest_noise,
    log_likelihood,
    log_likelihood_of_first,
)
from discsim.validation.identification.ordinary_errors import ordinary_errors
from discsim.validation.identification.parameters import Parameter, values_of
from discsim.validation.identification.residual_tests import UnmodelledResidual, unmodelled_residuals
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import CLOCKS

__all__ = ["ContinuousFit", "continuous_fit", "left_out", "standard_errors", "wider_with"]

#: the numbers of a cross-axis error that a turn has opposite
_PAIRS = (("sxy", "syx"), ("sxz", "szx"), ("syz", "szy"))


@dataclass(frozen=True)
class ContinuousFit:
    """A fit whose segments are continuous, under a hypothesis.

    ``score`` is -2 log likelihood with the noise estimated from its own residuals, ``scored_in``, priors included.
    """

    hypothesis: Hypothesis
    fit: Fit
    score: float
    residuals: tuple[FloatArray, ...] = field(default_factory=tuple)
    scored_in: NoiseModel = field(default_factory=dict)

    def unmodelled(self, settled: float = -np.inf) -> list[UnmodelledResidual]:
        """Return what its residuals hold beside noise, strongest first; ``settled`` as in `unmodelled_residuals`."""
        return unmodelled_residuals(self.fit.linears, self.residuals, self.fit.noise, settled=settled)

    def squared_sizes(self, candidate: CandidateEffect) -> float:
        """Return how far a candidate's numbers are from those of no effect, squared, in the fit's covariance (Wald).

        This is about what the effect gains, where a fit is at its optimum with it and without it. It is infinite where
        the covariance is not known.
        """
        if self.fit.covariance.shape[0] != len(self.fit.parameters):
            return np.inf
        sizes = {q.key for q in parameters_of(candidate, shaped=False)}
        own = [k for k, q in enumerate(self.fit.parameters) if q.key in sizes and q.recordings == candidate.recordings]
        away = self.fit.at[own] - np.array([self.fit.parameters[k].stated for k in own])
        return float(away @ np.linalg.lstsq(self.fit.covariance[np.ix_(own, own)], away, rcond=None)[0])

    def told(self, candidate: CandidateEffect) -> int:
        """Return how many of a candidate's parameters the readings tell, at least one; all where that is not known.

        A parameter is told where readings leave less than half of the variance that it had beforehand: else more than
        half of it is the prior's (the number of well-determined parameters: D. MacKay, Neural Computation 4, 1992, p.
        415). A gyroscope on a rig has rates about one axis, and three scales. What shapes an effect counts in any case.
        """
        sizes = {q.key for q in parameters_of(candidate, shaped=False)}
        count = len(parameters_of(candidate))
        if self.fit.covariance.shape[0] != len(self.fit.parameters):
            return count
        untold = sum(
            q.key in sizes and q.recordings == candidate.recordings and bool(variance > 0.5 * q.sigma**2)
            for q, variance in zip(self.fit.parameters, np.diag(self.fit.covariance), strict=True)
        )
        return max(count - untold, 1)

    def told_beyond_a_turn(self, cross: CandidateEffect) -> int:
        """Return how many of a cross-axis error's numbers the readings tell that no turn has, 0 to 3: sums of pairs.

        What they could be beforehand is what all six are in the root of their mean square: the numbers of one part are
        of one size. Where readings leave more than half of that variance, six numbers are as likely as three.
        """
        place = {q.name: k for k, q in enumerate(self.fit.parameters) if q.group == cross.id}
        if self.fit.covariance.shape[0] != len(self.fit.parameters) or set(CrossAxis._fields) - set(place):
            return len(_PAIRS)
        size2 = float(np.mean([self.fit.at[place[name]] ** 2 for name in CrossAxis._fields]))
        pairs = [[place[one], place[other]] for one, other in _PAIRS]
        left = [0.5 * float(np.sum(self.fit.covariance[np.ix_(pair, pair)])) for pair in pairs]
        return sum(variance < 0.5 * size2 for variance in left)

    def worse_than(self, other: ContinuousFit) -> float:
        """Return by how much its score is higher than another's, on the readings that take part in both.

        A lag remembers what nobody recorded, so that the first readings of its sensor take no part. Whether these
        happen to fit well without it is no evidence.
        """
        return self.score - other.score - float(np.sum(left_out(self, other)))

    def gain_upon(self, other: ContinuousFit) -> float:
        """Return what it gains upon another fit, as upon one without one of its effects, on the readings of both."""
        return other.worse_than(self)

    @property
    def charged(self) -> float:
        """What its effects are charged for the parameters that the readings tell, and for being unusual."""
        return sum(charge(candidate, self.told(candidate)) for candidate in self.hypothesis.candidates)

    @property
    def prior_penalty(self) -> float:
        """What its effects' sizes cost by how large such errors ordinarily are: twice the negative log of that prior.

        It only tells hypotheses apart that readings do not. Of effects that models/priors.toml does not hold any size
        is as likely.
        """
        effects = {candidate.id for candidate in self.hypothesis.candidates}
        ordinary = (*ordinary_errors("relaxed fit"), *ordinary_errors("choice between twins"))
        sigmas = {(error.effect, error.name): error.sigma for error in ordinary}
        sizes = [
            (v - q.stated) / sigmas[q.key]
            for q, v in zip(self.fit.parameters, self.fit.at.tolist(), strict=True)
            if q.group in effects and q.key in sigmas
        ]
        return float(np.dot(sizes, sizes))


#: a fit of which a round in a new noise leaves less than this share of chi-squared is still on its way, and has so many
#: rounds more: a clock that is 1e-4 off after all of its steps leaves corners of a command 2 ms away after 20 s
_ON_ITS_WAY, _FURTHER = 0.99, 4


def continuous_fit(
    relaxed_fit: Fit,
    hypothesis: Hypothesis,
    own: Sequence[Parameter],
    noise: NoiseModel,
    start: Start,
    *,
    iterations: int = 8,
    polish: int = 2,
    bars: Bars = NO_BARS,
) -> ContinuousFit:
    """Fit a hypothesis with segments that are continuous, from the trajectories of a relaxed fit.

    ``start`` gives first values of parameters by (key, recordings). The noise is estimated anew from the residuals. A
    fit whose chi-squared in ``noise`` will stay above its ``bars`` is given up after a few steps.
    """
    parameters = fitted_parameters(hypothesis, own)
    at = _begun(relaxed_fit, parameters, own, start)
    plant = relaxed_fit.plant
    fit = Fit(_retimed(relaxed_fit, parameters, at), parameters, at, relaxed_fit.continuous_defects, noise)
    if not plant.airborne and any(q.group in CLOCKS for q in parameters):
        fit = replace(fit, at=_clocks_of_longer_beginnings(fit))
    begun = fit
    if fit.path_alone:
        return scored(hypothesis, fitted_from_afar(fit, bounds=BOUNDS))
    fit = refit(fit, iterations=iterations, bounds=BOUNDS, bars=bars)
    if not np.isfinite(fit.merit):
        # algebra from far away may offer numbers under which no motion lasts
        effects = {candidate.id for candidate in hypothesis.candidates}
        plain = np.array([v if q.group in effects else q.stated for q, v in zip(parameters, at, strict=True)])
        fit = refit(replace(begun, at=plain), iterations=iterations, bounds=BOUNDS, bars=bars)
    fit = begun_anew(fit, begun.trajectories, relaxed_fit.linears)
    # a free spin, whose readings say little of some numbers, strays on its way
    further = 0 if plant.weakly_identified or not polish else _FURTHER
    for done in range(polish + further if fit.merit < min(bars) else 0):
        # a sensor of which a lag or an offset has left no reading keeps the noise that it had: it may come back
        fit = replace(fit, noise={**noise, **noise_of(fit)})
        before, merit = fit, merit_of(fit, fit.linears)
        fit = refit(fit, iterations=2, bounds=BOUNDS, relinearise=False)
        if fit.linears is before.linears:
            # no step served: the same residuals show the same noise, in which none would serve again
            break
        if done + 1 >= polish and fit.merit > _ON_ITS_WAY * merit:
            break
    return scored(hypothesis, fit)


def _begun(relaxed_fit: Fit, parameters: Sequence[Parameter], own: Sequence[Parameter], start: Start) -> FloatArray:
    """Return parameters (p,) at a start, the ``own`` ones where a relaxed fit has them if it is beyond all sense.

    Far from the data algebra may offer any number, as a clock that runs backwards: the motion begun there never ends
    anywhere, and what the same algebra offers of the others is no better. An effect's number begins within its bounds:
    from beyond them, as of a lag of 14 s, no step that keeps them would serve, and it would stay.
    """
    bounds = [BOUNDS.get(q.key, (-np.inf, np.inf)) for q in parameters]
    offered = [
        v if q in own or np.isinf(high - low) else min(max(v, low), high)
        for q, v, (low, high) in zip(parameters, _offered(parameters, start), bounds, strict=True)
    ]
    limits = [each if q in own else (-np.inf, np.inf) for q, each in zip(parameters, bounds, strict=True)]
    pairs = list(zip(offered, limits, strict=True))
    if all(low <= v <= high or np.isinf(high - low) for v, (low, high) in pairs):
        # a number that is bounded on one side is held there by the first step
        return np.array(offered)
    known = zip(relaxed_fit.parameters, relaxed_fit.at.tolist(), strict=True)
    relaxed = {(q.key, q.recordings): v for q, v in known if q in own}
    return np.array([relaxed.get((q.key, q.recordings), v) for q, v in zip(parameters, offered, strict=True)])


def _offered(parameters: Sequence[Parameter], start: Start) -> list[float]:
    """Return the first values (p,) of parameters, what is stated of those that ``start`` does not have."""
    return [start.get((q.key, q.recordings), q.stated) for q in parameters]


def _retimed(relaxed_fit: Fit, parameters: Sequence[Parameter], at: FloatArray) -> tuple[Trajectory, ...]:
    """Return the trajectories of a fit with their motion moved to the times that other clocks mean."""
    trajectories = []
    for i, trajectory in enumerate(relaxed_fit.trajectories):
        before, after = relaxed_fit.values(i), values_of(parameters, at, i, {})
        ratio = time_ratio(after) / time_ratio(before)
        if abs(ratio - 1.0) > 1e-5 and 0.5 < ratio < 2.0:
            trajectory = replace(trajectory, nodes=trajectory.nodes / ratio)
        trajectories.append(trajectory)
    return tuple(trajectories)


#: lengths of the looks by which a clock is found on a rig, each fixing the phase of the next, s
_LOOKS = (5.0, 10.0, 20.0)


def _clocks_of_longer_beginnings(fit: Fit) -> FloatArray:
    """Return parameters (p,) fitted to longer and longer beginnings, so that no wrong clock's phase slips by a turn."""
    at = fit.at
    for look in _LOOKS:
        if look < 0.8 * max(float(trajectory.nodes[-1]) for trajectory in fit.trajectories):
            short = tuple(beginning(trajectory, look) for trajectory in fit.trajectories)
            at = refit(replace(fit, trajectories=short, at=at), iterations=5, bounds=BOUNDS).at
    return at


def left_out(fitted: ContinuousFit, beside: ContinuousFit) -> FloatArray:
    """Return what of a fit's score (r,) are readings of each recording that a lag of another leaves out, less its own.

    A lag remembers what came before the first reading.
    """
    return _left_out(fitted, beside) - _left_out(beside, fitted)


def _left_out(fitted: ContinuousFit, beside: ContinuousFit) -> FloatArray:
    lags = {candidate.row.acts_on for candidate in beside.hypothesis.candidates if candidate.row.type is Lag}
    total = np.zeros(len(fitted.fit.linears))
    if not lags:
        return total
    each = zip(fitted.fit.linears, fitted.residuals, beside.fit.linears, strict=True)
    for i, (linear, residual, less) in enumerate(each):
        begun = {(c.sensor, c.axis): int(c.index[0]) for c in less.channels if c.sensor in lags}
        counts = {
            (c.sensor, c.axis): int(np.searchsorted(c.index, begun[c.sensor, c.axis]))
            for c in linear.channels
            if (c.sensor, c.axis) in begun
        }
        if any(counts.values()):
            total[i] = log_likelihood_of_first(linear, fitted.scored_in, residual, counts)
    return total


def noise_of(fit: Fit) -> NoiseModel:
    """Return the noise that a fit's residuals show."""
    spent = len(fit.parameters) + 12 * len(fit.trajectories)
    return estimate_noise(fit.linears, [linear.residual for linear in fit.linears], spent=spent)


def scored(hypothesis: Hypothesis, fit: Fit) -> ContinuousFit:
    """Return a fit with its score."""
    residuals = tuple(linear.residual for linear in fit.linears)
    # of a sensor that has no reading left the noise stays: it has some again under a rival of this hypothesis
    fit = replace(fit, noise={**fit.noise, **likeliest_noise(fit.linears, residuals, noise_of(fit))})
    score = sum(log_likelihood(linear, fit.noise, e) for linear, e in zip(fit.linears, residuals, strict=True))
    return ContinuousFit(hypothesis, fit, score + penalty_of(fit, fit.linears) + _of_starts(fit), residuals, fit.noise)


def _of_starts(fit: Fit) -> float:
    """Return what it costs that a lag's start is told by the readings: twice the log of how far that narrows it.

    A lag has two numbers more for each recording, which nothing but their width beforehand keeps from serving noise
    (Laplace's approximation of the evidence; D. MacKay, Neural Computation 4, 1992, p. 415).
    """
    if fit.covariance.shape[0] != len(fit.parameters):
        return 0.0
    told = zip(fit.parameters, np.diag(fit.covariance), strict=True)
    shares = [variance / q.sigma**2 for q, variance in told if q.key in fit.plant.held_keys]
    return float(-np.sum(np.log(np.clip(shares, 1e-12, 1.0))))


def standard_errors(fitted: ContinuousFit) -> FloatArray:
    """Return the standard errors (p,) of a fit's parameters, NaN where it has no covariance."""
    fit, covariance = fitted.fit, fitted.fit.covariance
    if covariance.shape[0] != len(fit.parameters):
        return np.full(len(fit.parameters), np.nan)
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    for place in _untold_clocks(fit):
        errors = wider_with(errors, covariance, place, fit.parameters[place].sigma)
    return errors


def wider_with(errors: FloatArray, covariance: FloatArray, place: int, sd: float) -> FloatArray:
    """Return errors (p,) as one number at ``place`` makes them that is known to ``sd`` only, and not to its covariance.

    Every other number goes with it as their covariance (p, p) says.
    """
    variance = float(covariance[place, place])
    beyond = max(sd**2 - variance, 0.0)
    return np.asarray(np.hypot(errors, np.abs(covariance[:, place]) / variance * np.sqrt(beyond)))


def _untold_clocks(fit: Fit) -> list[int]:
    """Return the places of clocks that stand for rates of rows which nobody knows, where no sensor tells the time.

    A free spin without a gyroscope is the same in slow motion: lengths and the air's moments go with its time. Nobody
    knows those moments, and that a fit finds them of an ordinary size at one time rather than another tells nothing.
    """
    if not fit.plant.weakly_identified or any("gyroscope" in one.recording for one in fit.trajectories):
        return []
    stated = any(sheet.rate_uncertainty for sheet in fit.trajectories[0].recording.sheets.values())
    clocks = [k for k, q in enumerate(fit.parameters) if q.group in CLOCKS and q.name == "ratio" and stated]
    return [k for k in clocks if fit.covariance[k, k] > 0.0]
