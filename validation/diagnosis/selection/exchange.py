"""Backward elimination and exchange in a stepwise selection by likelihood.

Takes what was found; gives fits in which an effect is left out where others make it superfluous, acts in all
recordings instead of one, or gives way to a better rival. Each refit starts from the present fit.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.evidence import IN_PLACE, lead, price
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, fitted_parameters
from discsim.validation.diagnosis.candidates.score_tests import (
    ScreenedCandidate,
    backwards,
    scope_price,
    start_of,
)
from discsim.validation.diagnosis.candidates.screening import free_columns
from discsim.validation.diagnosis.selection.refits import refitting
from discsim.validation.diagnosis.selection.search_state import (
    Rival,
    Search,
    from_here,
    possible,
    unreliable,
    values_of_fit,
)
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.gauss_newton import Bars, merit_of

__all__ = [
    "eliminated_backward",
    "exchanged",
    "in_reach",
    "rival_of",
    "rivals_of",
    "takes_its_place",
    "tried_without",
    "widened",
    "without_superfluous",
]


def in_reach(fitted: ContinuousFit) -> Bars:
    """Return what a refit beside a fit may stay above it and still come near by a price or a tie."""
    return Bars(merit_of(fitted.fit, fitted.fit.linears) + SELECTION.out_of_reach)


def widened(found: Search, final: ContinuousFit) -> ContinuousFit:
    """Return a fit with effects that were proposed for one recording in all, where nothing speaks against that.

    Recordings share their hardware and their air. An effect may be asked about at a shape that is not the true one, as
    a stall's angle. Algebra then may see it in the one recording that shows it, and something else in the others.
    """
    if unreliable(found, final):
        return final
    alone = [one for one in final.hypothesis.candidates if one.recordings is not None and not one.fixed_values]
    for candidate in {one.id: one for one in alone if not one.row.event}.values():
        others = tuple(one for one in final.hypothesis.candidates if one.id != candidate.id)
        present = values_of_fit(final)
        start = {(key, None if key[0] == candidate.id else some): number for (key, some), number in present.items()}
        wide = continuous_fit(
            final.fit,
            Hypothesis((*others, replace(candidate, recordings=None))),
            found.own,
            final.fit.noise,
            start,
            bars=in_reach(final),
        )
        wide = found.with_cost(wide)
        if final.gain_upon(wide) < scope_price(len(found.recordings)) and possible(wide):
            final = wide
    return final


def eliminated_backward(found: Search, current: ContinuousFit, kept: Collection[CandidateEffect] = ()) -> ContinuousFit:
    """Return a fit less the effects that the others have made superfluous, but for those that are ``kept``."""
    while len(current.hypothesis.candidates) > 1:
        weakest: ContinuousFit | None = None
        for number, candidate in enumerate(current.hypothesis.candidates):
            if _in_trajectories(candidate) or candidate in kept:
                continue
            refitting("refitting without", candidate.id, number, len(current.hypothesis.candidates))
            less = continuous_fit(
                current.fit,
                current.hypothesis.without(candidate),
                found.own,
                current.fit.noise,
                values_of_fit(current),
                bars=in_reach(current),
            )
            less = found.with_cost(less)
            if current.gain_upon(less) < price(candidate) and (weakest is None or less.score < weakest.score):
                weakest = less
        if weakest is None:
            return current
        current = weakest
    return current


def tried_without(found: Search, candidate: CandidateEffect) -> ContinuousFit:
    """Return the fit of the final hypothesis without one of its effects."""
    final = found.final
    rest = final.hypothesis.without(candidate)
    if not rest.candidates:
        return found.base
    tried = [step for step in found.steps if set(step.hypothesis.candidates) == set(rest.candidates)]
    if tried:
        return min(tried, key=lambda step: step.score)
    less = continuous_fit(
        found.relaxed_fit, rest, found.own, found.relaxed_noise, values_of_fit(final), iterations=5, polish=1
    )
    # choosing what was found in the readings themselves cost the fit with it, and none without
    return less if _in_trajectories(candidate) else found.with_cost(less)


def _in_trajectories(candidate: CandidateEffect) -> bool:
    """Tell whether an effect was found in the readings themselves, as lost samples are.

    The trajectories hold it whatever the hypothesis says, so that no fit that goes on from them is without it.
    """
    return bool(candidate.fixed_values)


def without_superfluous(found: Search) -> Search:
    """Return a search less the effects without which a fit that is begun anew explains as much.

    A fit that goes on from one with the effect may end beside the optimum, and the effect then seems worth its price.
    """
    # what choosing lost samples cost stands in the score of some fits and not of others
    while not found.cost and len(found.final.hypothesis.candidates) > 1:
        weakest: ContinuousFit | None = None
        for number, candidate in enumerate(found.final.hypothesis.candidates):
            if _in_trajectories(candidate):
                continue
            refitting("beginning anew without", candidate.id, number, len(found.final.hypothesis.candidates))
            less = tried_without(found, candidate)
            found = found if any(step is less for step in found.steps) else found.with_step(less)
            if found.final.gain_upon(less) < price(candidate) and (weakest is None or less.score < weakest.score):
                weakest = less
        if weakest is None:
            return found
        found = replace(found, final=weakest)
    return found


def rivals_of(found: Search) -> dict[str, list[Rival]]:
    """Return the effects that could stand in for a named one, refitted in its place, by its name."""
    named = [one for one in found.final.hypothesis.candidates if not _in_trajectories(one)]
    return {candidate.name: _rivals(found, candidate) for candidate in named}


def _rivals(found: Search, candidate: CandidateEffect) -> list[Rival]:
    """Return the effects that could stand in for one of the final hypothesis, each refitted in its place."""
    rivals: list[Rival] = []
    seen: set[str] = set()
    for worse, screened in _by_algebra(found, candidate):
        other = screened.candidate
        most = SELECTION.alike if worse < SELECTION.confused else SELECTION.rivals
        if other.id in seen or len(seen) >= most:
            continue
        refitting(f"refitting in place of {candidate.id}", other.id, len(seen), most)
        seen.add(other.id)
        rivals.append(_refitted(found, candidate, screened))
    return rivals


def rival_of(found: Search, candidate: CandidateEffect, other: str) -> Rival | None:
    """Return the effect with an id ``other`` refitted in the place of a named one, None where algebra sees it far off.

    Equations are about the final fit.
    """
    near = (screened for _, screened in _by_algebra(found, candidate) if screened.candidate.id == other)
    return next((_refitted(found, candidate, screened) for screened in near), None)


def _refitted(found: Search, candidate: CandidateEffect, screened: ScreenedCandidate) -> Rival:
    """Return an effect refitted in the place of one of the final hypothesis from where algebra has it."""
    final, other = found.final, screened.candidate
    rest, start = final.hypothesis.without(candidate), from_here(screened, final).start
    fitted = continuous_fit(final.fit, rest.plus(other), found.own, final.fit.noise, start, bars=in_reach(final))
    fitted = found.with_cost(fitted)
    return Rival(other, fitted.worse_than(final), fitted)


def _by_algebra(found: Search, candidate: CandidateEffect) -> list[tuple[float, ScreenedCandidate]]:
    """Return the candidates that may do about as well in an effect's place, best first, by the normal equations.

    Beside each stands by how much chi-squared is higher with it than with the effect.
    """
    equations, rest = found.equations, found.final.hypothesis.without(candidate)
    taken = equations.columns_of(fitted_parameters(rest, found.own))
    best = equations.solve(equations.columns_of(fitted_parameters(found.final.hypothesis, found.own))).chi2
    without = equations.solve(taken).chi2
    # of a large effect algebra knows the last percents badly
    worst = max(SELECTION.worst, SELECTION.worst_share * (without - best))
    near = []
    for other in found.candidates:
        if other.id == candidate.id or any(other.id == one.id for one in rest.candidates):
            continue
        scoped = replace(other, recordings=candidate.recordings)
        freed = free_columns(scoped)
        asked = [*taken, *freed]
        answer = equations.solve(asked)
        if backwards(freed, answer):
            continue
        screened = ScreenedCandidate(scoped, without - answer.chi2, start_of(asked, answer, (scoped,)))
        near.append((answer.chi2 - best, screened))
    near.sort(key=lambda item: item[0])
    return [(worse, screened) for worse, screened in near if not worse > worst]


def _merit(worse: float, rival: Rival, candidate: CandidateEffect, final: ContinuousFit) -> float:
    """Return by how much a rival's score is worse than that of an effect.

    Each is charged for what readings tell of it, and for how unlikely the sizes are that all effects have beside it.
    """
    return worse + _charges(rival, candidate, final) + rival.fitted.prior_penalty - final.prior_penalty


def _charges(rival: Rival, candidate: CandidateEffect, final: ContinuousFit) -> float:
    """Return by how much more a rival is charged than an effect.

    Of a turn and the matrix that holds it the turn is the simpler one by as many numbers as readings tell beside it.
    """
    if IN_PLACE.get(rival.candidate.id) == candidate.id:
        return -SELECTION.rival * final.told_beyond_a_turn(candidate)
    if IN_PLACE.get(candidate.id) == rival.candidate.id:
        return SELECTION.rival * rival.fitted.told_beyond_a_turn(rival.candidate)
    return lead(rival.candidate, candidate, rival.fitted.told(rival.candidate), final.told(candidate))


def takes_its_place(worse: float, rival: Rival, candidate: CandidateEffect, final: ContinuousFit) -> bool:
    """Tell whether a rival explains more for its parameters than an effect of a fit, whose score it is ``worse`` than.

    What counts is the parameters that readings tell.
    """
    simpler = rival.fitted.told(rival.candidate) < final.told(candidate)
    return _merit(worse, rival, candidate, final) < -(SELECTION.simpler if simpler else SELECTION.better)


def exchanged(found: Search) -> ContinuousFit | None:
    """Return the fit with a rival in the place of a named effect where that explains more for its parameters.

    An effect that was taken up while another was missing may have been the one that bends most, not the right one; and
    with the right one in its place others may be superfluous, which together with it stood in for that.
    """
    better = []
    size = found.final.hypothesis.size
    for candidate in found.final.hypothesis.candidates:
        for rival in found.rivals.get(candidate.name, []):
            if not possible(rival.fitted):
                continue
            if takes_its_place(rival.worse, rival, candidate, found.final):
                better.append((_merit(rival.worse, rival, candidate, found.final), rival.fitted))
            elif size > 1 and rival.worse < SELECTION.better:
                fewer = eliminated_backward(found, rival.fitted, kept=[rival.candidate])
                merit = fewer.worse_than(found.final) + SELECTION.rival * (fewer.hypothesis.size - size)
                if (
                    len(fewer.hypothesis.candidates) < len(found.final.hypothesis.candidates)
                    and merit < -SELECTION.simpler
                ):
                    better.append((merit, fewer))
    return min(better, key=lambda item: item[0])[1] if better else None
