"""Evidence on recordings held out: what effects gain where their parameters were not fitted.

Takes what a search found; gives gains and chi-squared of each recording set aside (cross-validation: Stone, 1974).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, left_out
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, fitted_parameters
from discsim.validation.diagnosis.candidates.screening import free_columns
from discsim.validation.diagnosis.selection.exchange import takes_its_place
from discsim.validation.diagnosis.selection.search_state import Search, possible
from discsim.validation.identification.gauss_newton import reduced_each
from discsim.validation.identification.noise import chi_squared, log_likelihood
from discsim.validation.identification.normal_equations import common_step

__all__ = ["Choice", "choices_without_each", "heldout_chi2", "heldout_gain"]

#: what the other recordings choose in the place of each named effect, by its name: itself, a rival or nothing
Choice: TypeAlias = Mapping[str, CandidateEffect | None]


def choices_without_each(found: Search, less: Mapping[str, ContinuousFit]) -> list[Choice]:
    """Return for each recording what the others choose; ``less`` are fits without each named effect, by its name.

    An effect without such a fit is not asked about: it is chosen.
    """
    final, count = found.final, len(found.recordings)
    choices: list[dict[str, CandidateEffect | None]] = [
        {one.name: one for one in final.hypothesis.candidates} for _ in range(count)
    ]
    if count < 2:
        return list(choices)
    here = _scores_without_each(final, final) if final.hypothesis.candidates else np.zeros(count)
    for candidate in final.hypothesis.candidates:
        if candidate.name not in less or not _by_others(candidate):
            continue
        gain = _scores_without_each(less[candidate.name], final) - here
        rivals = [rival for rival in found.rivals.get(candidate.name, ()) if possible(rival.fitted)]
        worse = [_scores_without_each(rival.fitted, final) - here for rival in rivals]
        for i, choice in enumerate(choices):
            better = [
                (w[i], rival.candidate)
                for w, rival in zip(worse, rivals, strict=True)
                if takes_its_place(w[i], rival, candidate, final)
            ]
            if gain[i] <= price(candidate):
                choice[candidate.name] = None
            elif better:
                choice[candidate.name] = min(better, key=lambda item: item[0])[1]
    return list(choices)


def _by_others(candidate: CandidateEffect) -> bool:
    """Tell whether other recordings can speak of an effect that acts in one."""
    return bool(candidate.columns) and (candidate.recordings is None or len(candidate.recordings) > 1)


def _scores_without_each(fitted: ContinuousFit, beside: ContinuousFit) -> FloatArray:
    """Return what the score of a fit (r,) is without each recording, its parameters as the others have them.

    It is that on the readings that take part in the fit ``beside`` it, too.
    """
    fit = fitted.fit
    reduced = reduced_each(fit)
    total = np.sum([r.gram for r in reduced], axis=0)
    whole = common_step(total, fit.parameters, fit.at)[2]
    scores = []
    for linear, residual, own in zip(fit.linears, fitted.residuals, reduced, strict=True):
        others = common_step(total - own.gram, fit.parameters, fit.at)[2]
        level = log_likelihood(linear, fit.noise, residual) - chi_squared(linear, fit.noise, residual)
        scores.append(fitted.score - (whole - others) - level)
    apart = left_out(fitted, beside)
    return np.array(scores) - (np.sum(apart) - apart)


def heldout_gain(found: Search, candidate: CandidateEffect, choices: Sequence[Choice]) -> float | None:
    """Return the log likelihood that recordings gain by what the others choose in an effect's place; None for one."""
    if len(choices) < 2 or not _by_others(candidate):
        return None
    rest = found.final.hypothesis.without(candidate)
    total = 0.0
    for i, choice in enumerate(choices):
        chosen = choice[candidate.name]
        if chosen is not None:
            total += heldout_chi2(found, rest, i) - heldout_chi2(
                found, found.final.hypothesis, i, {candidate.name: chosen}
            )
    return 0.5 * total


def heldout_chi2(found: Search, hypothesis: Hypothesis, i: int, choice: Choice | None = None) -> float:
    """Return chi-squared of a recording with the shared parameters as the other recordings have them.

    Of the candidates of the ``hypothesis`` those in a ``choice`` give way to what it has in their place.
    """
    equations = found.equations
    places = [
        (candidate, candidate if choice is None else choice.get(candidate.name, candidate))
        for candidate in hypothesis.candidates
    ]
    kept = Hypothesis(tuple(candidate for candidate, chosen in places if chosen is candidate))
    own = equations.columns_of(fitted_parameters(kept, found.own))
    for candidate, chosen in places:
        if chosen is not None and chosen is not candidate:
            own += free_columns(chosen)
    others = [j for j in range(equations.recordings) if j != i]
    answer = equations.solve(own, only=others)
    G = equations.grams[i]
    fixed = [
        (equations.place[column], float(v))
        for (column, q), v in zip(own, answer.value, strict=True)
        if q.acts_in(i) and any(q.acts_in(j) for j in others)
    ]
    alone = [(column, q) for column, q in own if q.acts_in(i) and not any(q.acts_in(j) for j in others)]
    at = np.array([place for place, _ in fixed], dtype=int)
    v = np.array([value for _, value in fixed])
    e = G[:, -1].copy()
    chi2 = float(G[-1, -1])
    if at.size:
        chi2 += float(-2.0 * v @ e[at] + v @ G[np.ix_(at, at)] @ v)
        e[:-1] -= G[:-1][:, at] @ v
    if alone:
        free = np.array([equations.place[column] for column, _ in alone])
        H = G[np.ix_(free, free)] + np.diag([q.precision for _, q in alone])
        chi2 -= float(e[free] @ np.linalg.solve(H + 1e-12 * np.diag(np.diag(H)), e[free]))
    return chi2
