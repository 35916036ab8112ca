"""What is explained in part: effects that take most of a mismatch away on recordings set aside, and leave more.

Takes a search whose verdict is unexplained; gives the effects, their numbers by the jackknife, and what they leave. An
answer names nothing then: a wrong effect, too, may take most of a mismatch away where all recordings are alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.diagnosis.answer.named import ParameterValue
from discsim.validation.diagnosis.answer.partly import PartlyExplained
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, in_parameters
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, fitted_parameters
from discsim.validation.diagnosis.leftovers import heldout_fits
from discsim.validation.diagnosis.selection.held_out import heldout_chi2
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.diagnosis.settings import UNKNOWN_LAW
from discsim.validation.identification.gauss_newton import refit
from discsim.validation.identification.noise import chi_squared

__all__ = ["partly_explained"]

#: steps of a fit from the baseline's: what tells attitude by a path alone comes down slowly
_STEPS = 20


def partly_explained(found: Search, names: Sequence[str]) -> tuple[PartlyExplained, ...]:
    """Return the effects of the best fit that take most away from the recordings (called ``names``), or none.

    They act in all recordings; each is tried with its numbers as the others have them. All together must keep half of
    their mismatch at most, and none may be worse off.
    """
    if len(names) < 2:
        return ()
    for fitted, before in _tried(found):
        candidates = fitted.hypothesis.candidates
        about = replace(found, final=fitted, base=before).about(fitted.fit)
        if fitted.fit.path_alone:
            each = _heldout_of_paths(before, fitted)
        else:
            each = [_heldout(about, i) for i in range(len(names))]
        total, left = np.sum(each, axis=0)
        if left <= (1.0 - UNKNOWN_LAW.share) * total and all(after < before for before, after in each):
            heldout = dict(zip(names, each, strict=True))
            return tuple(PartlyExplained(one.id, _jackknifed(about, fitted, one), heldout) for one in candidates)
    return ()


def _tried(found: Search) -> Iterator[tuple[ContinuousFit, ContinuousFit]]:
    """Yield the final fit and those of the effects that were hinted at, of such as act in all recordings alike.

    Beside each stands a fit without it that is as far down: hints go on from the fit of the baseline, and that from
    where they end.
    """
    shared = [bool(one.columns) and one.recordings is None for one in found.final.hypothesis.candidates]
    if shared and all(shared):
        yield found.final, found.base
    base, noise = found.base, found.relaxed_noise
    for one in (hint.candidate for hint in found.hints if hint.candidate.columns and hint.candidate.recordings is None):
        start, hypothesis = values_of_fit(base), Hypothesis((one,))
        fitted = continuous_fit(base.fit, hypothesis, found.own, noise, start, iterations=_STEPS)
        start = values_of_fit(fitted)
        plain = continuous_fit(fitted.fit, Hypothesis(), found.own, noise, start, iterations=_STEPS)
        if np.isfinite(fitted.score):
            yield fitted, plain if plain.score < base.score else base


def _heldout(found: Search, i: int) -> tuple[float, float]:
    """Return chi-squared per reading of a recording for the baseline, and with effects as the others have them.

    Both are in the noise of the fit with the effects, without its memory.
    """
    level = {group: noise._replace(correlation=0.0) for group, noise in found.final.fit.noise.items()}
    before = chi_squared(found.base.fit.linears[i], level, found.base.residuals[i])
    after = max(heldout_chi2(found, found.final.hypothesis, i), 0.0)
    return before / found.base.residuals[i].size, after / found.final.fit.linears[i].raw.size


def _heldout_of_paths(before: ContinuousFit, fitted: ContinuousFit) -> list[tuple[float, float]]:
    """Return what `_heldout` does for flights seen from outside alone, by fits of each alone.

    What a fit moves stated numbers by is counted with what it leaves, both in the noise that the baseline leaves: in
    that of the readings any release would serve the path.
    """
    level = {group: noise._replace(correlation=0.0) for group, noise in before.fit.noise.items()}
    merits = []
    for one in (before, fitted):
        fit = refit(replace(one.fit, noise=level), iterations=_STEPS)
        merits.append([alone.merit / alone.count for alone in heldout_fits(replace(one, fit=fit))])
    return list(zip(*merits, strict=True))


def _jackknifed(found: Search, fitted: ContinuousFit, candidate: CandidateEffect) -> dict[str, ParameterValue]:
    """Return an effect's parameters as all recordings have them, with standard deviations from leaving each out."""
    equations = found.equations
    own = equations.columns_of(fitted_parameters(fitted.hypothesis, found.own))
    every = range(equations.recordings)

    def sizes(some: Sequence[int]) -> FloatArray:
        value = equations.solve(own, only=some).value
        numbers = {q.name: q.stated + float(v) for (_, q), v in zip(own, value, strict=True) if q.group == candidate.id}
        return np.array([*in_parameters(candidate.row, numbers).values()])

    without = np.stack([sizes([j for j in every if j != i]) for i in every])
    spread = without - without.mean(axis=0)
    sd = np.sqrt(np.sum(spread**2, axis=0) * (equations.recordings - 1.0) / equations.recordings)
    fit = {
        q.name: float(v) for q, v in zip(fitted.fit.parameters, fitted.fit.at, strict=True) if q.group == candidate.id
    }
    value = in_parameters(candidate.row, fit)
    return {name: ParameterValue(v, float(s)) for (name, v), s in zip(value.items(), sd, strict=True)}
