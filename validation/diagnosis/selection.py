"""From candidates to findings: propose by algebra, refit fairly, accept by likelihood with the noise that is there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from validation.diagnosis.board import Answer, Board, free_columns
from validation.diagnosis.fitting import Fit, Parameter, penalty_of, refit, values_of
from validation.diagnosis.noise import NoiseModel, estimate_noise, likeliest_noise, log_likelihood
from validation.diagnosis.readings import CLOCKS
from validation.diagnosis.relaxed import NO_JUMPS, beginning
from validation.diagnosis.trajectory_pieces import Chain, Column
from validation.diagnosis.trials import Trial, parameters_of

__all__ = ["Hypothesis", "Start", "Tied", "price", "start_of", "tied_fit"]

#: values of parameters by what they are and the recordings that share them
Start: TypeAlias = Mapping[tuple[tuple[str, str], frozenset[int] | None], float]

#: what evidence costs: twice the log likelihood that an effect must gain, and more for each of its parameters
ENTRY, PER_PARAMETER, EVENT_ENTRY = 24.0, 4.0, 42.0
#: a gust may pass at any time, in any recording, at any width: more places to look at
GUST_ENTRY = 60.0
#: what it costs more that a disc's aerodynamics or build should differ in some recordings only
OTHER_DISC = 40.0
#: what a parameter costs when hypotheses are compared with one another
RIVAL = 8.0

BOUNDS: Mapping[tuple[str, str], tuple[float, float]] = {
    ("air.wind_shear", "exponent"): (-0.5, 3.0),
    ("aero.stall", "alpha_stall_rad"): (-0.2, 0.8),
    ("mag.stray_field", "height_m"): (0.05, 100.0),
    ("air.gust", "width_s"): (0.03, 6.0),
    ("air.density", "ratio"): (0.2, 5.0),
    **{(f"{s}.lag", "tau_s"): (0.0, 0.2) for s in ("mag", "accel", "gyro")},
    **{(f"{s}.clock_rate", "ratio"): (0.7, 1.4) for s in ("mag", "accel", "gyro", "gps")},
    ("clock.rate", "ratio"): (0.7, 1.4),
    ("gps.latency", "delay_s"): (0.0, 2.0),
    **{(f"{s}.time_offset", "offset_s"): (-2.0, 2.0) for s in ("mag", "accel", "gyro")},
    ("site.field", "ratio"): (0.2, 5.0),
    ("rig", "viscous"): (0.0, np.inf),
    ("rig.speed_ripple", "order"): (0.02, 200.0),
    ("accel.saturation", "limit_m_s2"): (0.5, np.inf),
}


#: parameters whose sign physics fixes: friction brakes, a lag is late
ONE_SIDED: Mapping[tuple[str, str], float] = {
    ("rig.coulomb_friction", "torque_N_m"): 1.0,
    ("rig.quadratic_drag", "coefficient_N_m_s2"): 1.0,
    ("gps.latency", "delay_s"): 1.0,
    **{(f"{s}.lag", "tau_s"): 1.0 for s in ("mag", "accel", "gyro")},
}


@dataclass(frozen=True)
class Hypothesis:
    """Effects that may act."""

    trials: tuple[Trial, ...] = ()

    def plus(self, trial: Trial) -> Hypothesis:
        """Return it with one more effect."""
        return replace(self, trials=(*self.trials, trial))

    def without(self, trial: Trial) -> Hypothesis:
        """Return it less one of its effects."""
        return replace(self, trials=tuple(t for t in self.trials if t is not trial))

    @property
    def size(self) -> int:
        """Number of parameters it adds."""
        return sum(len(parameters_of(trial)) for trial in self.trials)


@dataclass(frozen=True)
class Tied:
    """A fit whose pieces hang together, under a hypothesis.

    ``score`` is -2 log likelihood with the noise estimated from its own residuals, priors included.
    """

    hypothesis: Hypothesis
    fit: Fit
    score: float
    residuals: tuple[FloatArray, ...] = field(default_factory=tuple)


def price(trial: Trial) -> float:
    """Return what a trial must gain to be believed."""
    count = len(parameters_of(trial))
    if trial.id == "air.gust":
        return GUST_ENTRY + PER_PARAMETER * count
    if trial.id.startswith("event."):
        return EVENT_ENTRY + PER_PARAMETER * count
    odd = trial.recordings is not None and trial.id.startswith(("aero.", "body."))
    return ENTRY + PER_PARAMETER * count + (OTHER_DISC if odd else 0.0)


def fitted_parameters(hypothesis: Hypothesis, own: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Return a recording set's own parameters and those of the hypothesis."""
    taken = [q for trial in hypothesis.trials for q in parameters_of(trial)]
    keys = {(q.key, q.recordings) for q in taken}
    return (*(q for q in own if (q.key, q.recordings) not in keys), *taken)


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
    plant = loose.chains[0].recording.plant
    fit = Fit(_retimed(loose, parameters, at), parameters, at, NO_JUMPS[plant], noise)
    if plant in ("rate_table", "spin_down") and any(q.group in CLOCKS for q in parameters):
        fit = replace(fit, at=_longer_and_longer(fit))
    begun = fit
    fit = refit(fit, iterations=iterations, bounds=BOUNDS, bar=bar)
    if not np.isfinite(fit.merit):
        # algebra from far away may offer numbers under which no motion lasts
        effects = {trial.id for trial in hypothesis.trials}
        plain = np.array([v if q.group in effects else q.stated for q, v in zip(parameters, at, strict=True)])
        fit = refit(replace(begun, at=plain), iterations=iterations, bounds=BOUNDS, bar=bar)
    for _ in range(polish if fit.merit < bar else 0):
        fit = replace(fit, noise=noise_of(fit))
        fit = refit(fit, iterations=2, bounds=BOUNDS, moved_on=False)
    return scored(hypothesis, fit)


#: clocks by which the motion of a relaxed fit goes: it follows the magnetometer's phase
_LEADING = (("clock.rate", "ratio"), ("mag.clock_rate", "ratio"))


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


@dataclass(frozen=True)
class Proposal:
    """A trial and what algebra expects of it, with values of its columns to start from."""

    trial: Trial
    gain: float
    start: Start


def proposals(
    board: Board,
    trials: Sequence[Trial],
    hypothesis: Hypothesis,
    own: Sequence[Parameter],
) -> list[Proposal]:
    """Return what each trial would gain upon a hypothesis, in all recordings and in each alone, best first."""
    taken = board.columns_of(fitted_parameters(hypothesis, own))
    base = board.ask(taken).chi2
    found = []
    present = {(trial.id, trial.recordings) for trial in hypothesis.trials}
    for trial in trials:
        scopes: list[frozenset[int] | None] = [None]
        if board.recordings > 1:
            scopes += [frozenset([i]) for i in range(board.recordings)]
        best: Proposal | None = None
        for scope in scopes:
            if (trial.id, scope) in present or (trial.id, None) in present:
                continue
            scoped = replace(trial, recordings=scope)
            columns = free_columns(scoped)
            rest = [(c, q) for c, q in taken if q.key not in {p.key for _, p in columns} or scope is not None]
            answer = board.ask([*rest, *columns])
            gain = base - answer.chi2
            if _backwards(columns, answer):
                continue
            proposal = Proposal(scoped, gain, start_of([*rest, *columns], answer, (scoped,)))
            # one recording alone must do better than all by what choosing it costs
            if best is None or gain > best.gain + (2.0 * np.log(board.recordings) + 6.0 if scope is not None else 0.0):
                best = proposal
        if best is not None:
            found.append(best)
    return sorted(found, key=lambda p: RIVAL * len(parameters_of(p.trial)) - p.gain)


def _backwards(freed: Sequence[tuple[Column, Parameter]], answer: Answer) -> bool:
    """Tell whether algebra wants, of the columns that were asked for last, a friction that drives or an early lag."""
    values = answer.value[len(answer.value) - len(freed) :]
    return any(q.key in ONE_SIDED and ONE_SIDED[q.key] * float(v) < 0 for (_, q), v in zip(freed, values, strict=True))


def start_of(asked: Sequence[tuple[Column, Parameter]], answer: Answer, trials: Sequence[Trial] = ()) -> Start:
    """Return the values of an answer, and those at which its trials are shaped."""
    start = {(q.key, q.recordings): q.stated + float(v) for (_, q), v in zip(asked, answer.value, strict=True)}
    for trial in trials:
        start |= {((trial.id, name), trial.recordings): value for name, value in trial.shapes.items()}
    return start


def one_per_effect(found: Sequence[Proposal]) -> list[Proposal]:
    """Keep the best shape of each effect."""
    seen: dict[str, Proposal] = {}
    for proposal in found:
        seen.setdefault(proposal.trial.id, proposal)
    return list(seen.values())


@dataclass(frozen=True)
class Pair:
    """Two effects, what is left with both by algebra, charged for parameters, and values to start from."""

    hypothesis: Hypothesis
    merit: float
    start: Start


def pairs(board: Board, trials: Sequence[Trial], own: Sequence[Parameter]) -> list[Pair]:
    """Return what algebra expects of every two effects in all recordings, the best shapes of each, best pair first."""
    taken = board.columns_of(fitted_parameters(Hypothesis(), own))
    found: dict[tuple[str, str], Pair] = {}
    for both in combinations(trials, 2):
        ids = both[0].id, both[1].id
        if ids[0] == ids[1]:
            continue
        freed = [item for trial in both for item in free_columns(trial)]
        asked = [*((c, q) for c, q in taken if q.key not in {p.key for _, p in freed}), *freed]
        answer = board.ask(asked)
        hypothesis = Hypothesis(both)
        merit = answer.chi2 + RIVAL * hypothesis.size
        if merit < (found[ids].merit if ids in found else np.inf) and not _backwards(freed, answer):
            found[ids] = Pair(hypothesis, merit, start_of(asked, answer, both))
    return sorted(found.values(), key=lambda pair: pair.merit)
