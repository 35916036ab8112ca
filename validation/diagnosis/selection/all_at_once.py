"""All effects at once that a relaxed fit asks for, where what sensors tell of one another has begun it.

Takes a search that is far from its data; gives the fit with continuity enforced of every ordinary error of the relaxed
fit that its normal equations cannot do without. Where several effects are large each of them alone leaves so much that
no step by step selection comes nearer; beside the data algebra knows what each of them is worth beside the others
(backward elimination by the drop in chi-squared: Draper and Smith, "Applied Regression Analysis", 1998, 15.3).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

from discsim.effects.catalogue import CATALOGUE
from discsim.effects.sensors import Lag
from discsim.validation.diagnosis.held_out import heldout_chi2
from discsim.validation.diagnosis.selection.candidates import CandidateEffect, free_candidate
from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.selection.evidence import TURNED, price
from discsim.validation.diagnosis.selection.hypothesis import Hypothesis, fitted_parameters
from discsim.validation.diagnosis.selection.screening import NormalEquations
from discsim.validation.diagnosis.selection.search_state import Search, far, on_the_disc, possible
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.parameters import Parameter

__all__ = ["all_at_once", "worth_of_each"]

#: most effects at once: those of the consistency stage and the ordinary errors of three sensors that it goes with
_MOST = 8
#: most steps of their fit: it begins where the relaxed fit has them, and closes segments that this let part
_STEPS = 20


def all_at_once(found: Search) -> ContinuousFit | None:
    """Return the fit of all effects that a relaxed fit asks for together, None where they are not worth their price."""
    relaxed_fit = found.relaxed_fit
    free = dict.fromkeys(q.group for q in relaxed_fit.parameters if q.recordings is None)
    lags = [hint for hint in found.hints if hint.candidate.row.type is Lag and hint.candidate.id in free]
    if not lags or not far(found, found.base):
        return None
    competing = {candidate.id for candidate in found.candidates}
    every = [free_candidate(id) for id in free if id in CATALOGUE and id in competing and not CATALOGUE[id].grid]
    # what sensors told before any fit stays until a fit has it: about the relaxed fit algebra weighs it against itself
    told = {hint.candidate.id for hint in lags}
    asked = _held_out(found, _pruned(found.loose_board, every, found.own, told), told)
    fitted = _fitted(found, asked)
    if fitted is None:
        return None
    about = found.about(fitted.fit)
    fewer = _held_out(about, _pruned(about.equations, asked, found.own))
    if len(fewer) < len(asked):
        # what two effects shared that are one in these recordings, one of them cannot have: again from the relaxed fit
        fitted = _fitted(found, fewer)
    if fitted is None:
        return None
    worth = found.base.score - fitted.score > sum(map(price, fewer))
    return fitted if worth and possible(fitted) else None


def _fitted(found: Search, candidates: tuple[CandidateEffect, ...]) -> ContinuousFit | None:
    """Return the fit of some effects from where the relaxed fit has them, None where it has them off the disc."""
    relaxed_fit, ids = found.relaxed_fit, {one.id for one in candidates}
    start = {
        (q.key, q.recordings): float(v)
        for q, v in zip(relaxed_fit.parameters, relaxed_fit.at, strict=True)
        if q.group in ids or q.key in relaxed_fit.plant.own_keys
    }
    if not candidates or not on_the_disc(found, start):
        return None
    return continuous_fit(
        relaxed_fit, Hypothesis(candidates), found.own, found.relaxed_noise, start, iterations=_STEPS, polish=2
    )


def _held_out(
    found: Search, candidates: tuple[CandidateEffect, ...], told: Collection[str] = ()
) -> tuple[CandidateEffect, ...]:
    """Return the effects less those by whose numbers, as the others have them, recordings set aside fit worse.

    Those whose ids are ``told`` already stay.

    Of throws that all spin one way a bias and a cross-axis error are one: apart they are told by none of these, and
    go wrong on one that spins the other way.
    """
    some = range(len(found.recordings))

    def left(hypothesis: Hypothesis) -> float:
        return sum(heldout_chi2(found, hypothesis, i) for i in some)

    return _eliminated(candidates, told, lambda kept: _rises(left, kept))


def worth_of_each(
    equations: NormalEquations, candidates: Sequence[CandidateEffect], own: Sequence[Parameter]
) -> dict[str, float]:
    """Return by how much chi-squared rises without each of some effects, by its name, as algebra has it."""

    def left(hypothesis: Hypothesis) -> float:
        return equations.solve(equations.columns_of(fitted_parameters(hypothesis, own))).chi2

    return _rises(left, candidates)


def _rises(left: Callable[[Hypothesis], float], candidates: Sequence[CandidateEffect]) -> dict[str, float]:
    """Return by how much what is ``left`` of readings rises without each of some effects, by its name."""
    every = Hypothesis(tuple(candidates))
    whole = left(every)
    return {one.name: left(every.without(one)) - whole for one in candidates}


def _pruned(
    equations: NormalEquations,
    candidates: Sequence[CandidateEffect],
    own: Sequence[Parameter],
    kept: Collection[str] = (),
) -> tuple[CandidateEffect, ...]:
    """Return the effects that are each worth their price beside the others, at most as many as may be at once.

    Those whose ids are ``kept`` stay.
    """

    def spare(left: Sequence[CandidateEffect]) -> dict[str, float]:
        worth = worth_of_each(equations, left, own)
        return {one.name: worth[one.name] - price(one) - SELECTION.turned * (one.id in TURNED) for one in left}

    return _eliminated(candidates, kept, spare)


def _eliminated(
    candidates: Sequence[CandidateEffect],
    kept: Collection[str],
    gains: Callable[[Sequence[CandidateEffect]], Mapping[str, float]],
) -> tuple[CandidateEffect, ...]:
    """Return the effects less, one by one, that by which those left gain least, until each gains and they are few.

    Those whose ids are ``kept`` stay.
    """
    left = list(candidates)
    while loose := [one for one in left if one.id not in kept]:
        gain = gains(left)
        least = min(loose, key=lambda one: gain[one.name])
        if len(left) <= _MOST and gain[least.name] > 0.0:
            break
        left.remove(least)
    return tuple(left)
