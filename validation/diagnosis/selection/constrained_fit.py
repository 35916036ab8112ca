"""From candidates to findings: propose by algebra, refit fairly, accept by likelihood with the noise that is there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import ClockRate
from validation.diagnosis.relaxed_fit import beginning
from validation.diagnosis.selection.evidence import BOUNDS
from validation.diagnosis.selection.hypothesis import Hypothesis, Start, fitted_parameters
from validation.identification.gauss_newton import Fit, penalty_of, refit
from validation.identification.noise import NoiseModel, estimate_noise, likeliest_noise, log_likelihood
from validation.identification.parameters import Parameter, values_of
from validation.identification.segments import Chain
from validation.identification.sensor_model import CLOCKS

__all__ = ["Tied", "tied_fit"]


@dataclass(frozen=True)
class Tied:
    """A fit whose pieces hang together, under a hypothesis.

    ``score`` is -2 log likelihood with the noise estimated from its own residuals, priors included.
    """

    hypothesis: Hypothesis
    fit: Fit
    score: float
    residuals: tuple[FloatArray, ...] = field(default_factory=tuple)


def tied_fit(
    loose: Fit,
    hypothesis: Hypothesis,
    own: Sequence[Parameter],
    noise: NoiseModel,
    start: Start,
    *,
    iterations: int = 8,
    polish: int = 2,
    bar: float = np.inf,
) -> Tied:
    """Fit a hypothesis with pieces that hang together, from the chains of a loose fit.

    ``start`` gives first values of parameters by (key, recordings). The noise is estimated anew from the residuals. A
    fit whose chi-squared in ``noise`` will stay above ``bar`` is given up after a few steps.
    """
    parameters = fitted_parameters(hypothesis, own)
    at = np.array([start.get((q.key, q.recordings), q.stated) for q in parameters])
    plant = loose.plant
    fit = Fit(_retimed(loose, parameters, at), parameters, at, plant.sizes.continuous, noise)
    if not plant.airborne and any(q.group in CLOCKS for q in parameters):
        fit = replace(fit, at=_longer_and_longer(fit))
    begun = fit
    fit = refit(fit, iterations=iterations, bounds=BOUNDS, bar=bar)
    if not np.isfinite(fit.merit):
        # algebra from far away may offer numbers under which no motion lasts
        effects = {trial.id for trial in hypothesis.trials}
        plain = np.array([v if q.group in effects else q.stated for q, v in zip(parameters, at, strict=True)])
        fit = refit(replace(begun, at=plain), iterations=iterations, bounds=BOUNDS, bar=bar)
    for _ in range(polish if fit.merit < bar else 0):
        # a sensor of which a lag or an offset has left no reading keeps the noise that it had: it may come back
        fit = replace(fit, noise={**noise, **noise_of(fit)})
        fit = refit(fit, iterations=2, bounds=BOUNDS, moved_on=False)
    return scored(hypothesis, fit)


#: clocks by which the motion of a relaxed fit goes: it follows the magnetometer's phase
_LEADING = tuple((catalogued(ClockRate, whose).id, "ratio") for whose in ("clock", "magnetometer"))


def _retimed(loose: Fit, parameters: Sequence[Parameter], at: FloatArray) -> tuple[Chain, ...]:
    """Return the chains of a fit with their motion moved to the times that other clocks mean."""
    chains = []
    for i, chain in enumerate(loose.chains):
        before, after = loose.values(i), values_of(parameters, at, i, {})
        ratio = 1.0
        for key in _LEADING:
            ratio *= after.get(key, 1.0) / before.get(key, 1.0)
        if abs(ratio - 1.0) > 1e-5 and 0.5 < ratio < 2.0:
            chain = replace(chain, edges=chain.edges / ratio)
        chains.append(chain)
    return tuple(chains)


#: lengths of the looks by which a clock is found on a rig, each fixing the phase of the next, s
_LOOKS = (5.0, 10.0, 20.0)


def _longer_and_longer(fit: Fit) -> FloatArray:
    """Return parameters (p,) fitted to longer and longer beginnings: a wrong clock's phase never slips by a turn."""
    at = fit.at
    for look in _LOOKS:
        if look < 0.8 * max(float(chain.edges[-1]) for chain in fit.chains):
            short = tuple(beginning(chain, look) for chain in fit.chains)
            at = refit(replace(fit, chains=short, at=at), iterations=5, bounds=BOUNDS).at
    return at


def noise_of(fit: Fit) -> NoiseModel:
    """Return the noise that a fit's residuals show."""
    spent = len(fit.parameters) + 12 * len(fit.chains)
    return estimate_noise(fit.linears, [linear.residual for linear in fit.linears], spent=spent)


def scored(hypothesis: Hypothesis, fit: Fit) -> Tied:
    """Return a fit with its score."""
    residuals = tuple(linear.residual for linear in fit.linears)
    fit = replace(fit, noise=likeliest_noise(fit.linears, residuals, noise_of(fit)))
    score = sum(log_likelihood(linear, fit.noise, e) for linear, e in zip(fit.linears, residuals, strict=True))
    return Tied(hypothesis, fit, score + penalty_of(fit, fit.linears), residuals)
