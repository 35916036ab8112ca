"""Backward elimination and exchange in a stepwise selection by likelihood.

Takes what was found; gives fits in which effects give way: to none where others make them superfluous, to all
recordings, or to a better rival. Each refit starts from the present fit.
"""

from __future__ import annotations

from dataclasses import replace

from discsim.validation.diagnosis.selection.candidates import CandidateEffect
from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.selection.evidence import lead, price
from discsim.validation.diagnosis.selection.hypothesis import fitted_parameters
from discsim.validation.diagnosis.selection.refits import refitting
from discsim.validation.diagnosis.selection.score_tests import ScreenedCandidate, scope_price, start_of
from discsim.validation.diagnosis.selection.screening import free_columns
from discsim.validation.diagnosis.selection.search_state import Rival, Search, from_here, lost, possible, values_of_fit
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.gauss_newton import Bars, merit_of

__all__ = [
    "eliminated_backward",
    "exchanged",
    "rivals_of",
    "takes_its_place",
    "tried_without",
    "widened",
    "without_superfluous",
]


def _in_reach(fitted: ContinuousFit) -> Bars:
    """Return what a refit beside a fit may stay above it and still come near by a price or a tie."""
    return Bars(merit_of(fitted.fit, fitted.fit.linears) + SELECTION.out_of_reach)


def widened(found: Search, final: ContinuousFit) -> ContinuousFit:
    """Return a fit with effects that were proposed for one recording in all, where nothing speaks against that.

    Recordings share their hardware and their air. Algebra at a shape that is not the true one, as a stall's angle, may
    see an effect in the one recording that shows it and something else in the others.
    """
    if lost(found, final):
        return final
    for candidate in final.hypothesis.candidates:
        if candidate.recordings is None or candidate.fixed_values or candidate.row.event:
            continue
        everywhere = replace(candidate, recordings=None)
        present = values_of_fit(final)
        start = {(key, None if key[0] == candidate.id else some): number for (key, some), number in present.items()}
        wide = continuous_fit(
            final.fit,
            final.hypothesis.without(candidate).plus(everywhere),
            found.own,
            final.fit.noise,
            start,
            bars=_in_reach(final),
        )
        wide = replace(wide, score=wide.score + found.cost)
        if wide.score - final.score < scope_price(len(found.recordings)) and possible(wide):
            final = wide
    return final


def eliminated_backward(found: Search, current: ContinuousFit, kept: CandidateEffect | None = None) -> ContinuousFit:
    """Leave out effects that the others have made superfluous, but for one that is ``kept``."""
    while len(current.hypothesis.candidates) > 1:
        weakest: ContinuousFit | None = None
        for number, candidate in enumerate(current.hypothesis.candidates):
            if (
                candidate.fixed_values or candidate is kept
            ):  # what is told is kept in the trajectories whatever the hypothesis says
                continue
            refitting("refitting without", candidate.id, number, len(current.hypothesis.candidates))
            less = continuous_fit(
                current.fit,
                current.hypothesis.without(candidate),
                found.own,
                current.fit.noise,
                values_of_fit(current),
                bars=_in_reach(current),
            )
            less = replace(less, score=less.score + found.cost)
            if less.score - current.score < price(candidate) and (weakest is None or less.score < weakest.score):
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
    for step in found.steps:
        if set(step.hypothesis.candidates) == set(rest.candidates):
            return step
    less = continuous_fit(
        found.relaxed_fit, rest, found.own, found.relaxed_noise, values_of_fit(final), iterations=5, polish=1
    )
    # choosing what was found in the readings themselves cost the fit with it, and none without
    return less if candidate.fixed_values else replace(less, score=less.score + found.cost)


def without_superfluous(found: Search) -> Search:
    """Leave out effects without which a fit that is begun anew explains as much.

    A fit that goes on from one with the effect may end beside the optimum, and the effect then seems worth its price.
    """
    # what choosing lost samples cost stands in the score of some fits and not of others
    while not found.cost and len(found.final.hypothesis.candidates) > 1:
        weakest: ContinuousFit | None = None
        for number, candidate in enumerate(found.final.hypothesis.candidates):
            if candidate.fixed_values:
                continue
            refitting("beginning anew without", candidate.id, number, len(found.final.hypothesis.candidates))
            less = tried_without(found, candidate)
            found = found if any(step is less for step in found.steps) else found.with_step(less)
            worse = less.worse_than(found.final)
            if worse < price(candidate) and (weakest is None or less.score < weakest.score):
                weakest = less
        if weakest is None:
            return found
        found = replace(found, final=weakest)
    return found


def rivals_of(found: Search) -> dict[str, list[Rival]]:
    """Return the effects that could stand in for a named one, by its name."""
    final = found.final
    equations = found.equations
    rivals: dict[str, list[Rival]] = {}
    for candidate in final.hypothesis.candidates:
        if (
            candidate.fixed_values
        ):  # found in the readings themselves, and kept in the trajectories: nothing else could do it from there
            continue
        rest = final.hypothesis.without(candidate)
        taken = equations.columns_of(fitted_parameters(rest, found.own))
        best = equations.solve(equations.columns_of(fitted_parameters(final.hypothesis, found.own))).chi2
        # of a large effect algebra knows the last percents badly
        without = equations.solve(taken).chi2
        worst = max(SELECTION.worst, SELECTION.worst_share * (without - best))
        near = []
        for other in found.candidates:
            if other.id == candidate.id or any(other.id == t.id for t in rest.candidates):
                continue
            scoped = replace(other, recordings=candidate.recordings)
            asked = [*taken, *free_columns(scoped)]
            answer = equations.solve(asked)
            near.append(
                (
                    answer.chi2 - best,
                    ScreenedCandidate(scoped, without - answer.chi2, start_of(asked, answer, (scoped,))),
                )
            )
        near.sort(key=lambda item: item[0])
        rivals[candidate.name] = []
        seen: set[str] = set()
        for worse, screened in near:
            scoped = screened.candidate
            most = SELECTION.alike if worse < SELECTION.confused else SELECTION.rivals
            if scoped.id in seen or worse > worst or len(seen) >= most:
                continue
            refitting(f"refitting in place of {candidate.id}", scoped.id, len(seen), most)
            seen.add(scoped.id)
            other_fit = continuous_fit(
                final.fit,
                rest.plus(scoped),
                found.own,
                final.fit.noise,
                from_here(screened, final).start,
                bars=_in_reach(final),
            )
            other_fit = replace(other_fit, score=other_fit.score + found.cost)
            rivals[candidate.name].append(Rival(scoped, other_fit.worse_than(final), other_fit))
    return rivals


def _merit(worse: float, rival: Rival, candidate: CandidateEffect, final: ContinuousFit) -> float:
    """Return by how much a rival's score is worse than that of an effect.

    Each is charged for what readings tell of it, and for how unlikely the sizes are that all effects have beside it.
    """
    charges = lead(rival.candidate, candidate, rival.fitted.told(rival.candidate), final.told(candidate))
    return worse + charges + rival.fitted.prior_penalty - final.prior_penalty


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
                fewer = eliminated_backward(found, rival.fitted, kept=rival.candidate)
                merit = fewer.worse_than(found.final) + SELECTION.rival * (fewer.hypothesis.size - size)
                if (
                    len(fewer.hypothesis.candidates) < len(found.final.hypothesis.candidates)
                    and merit < -SELECTION.simpler
                ):
                    better.append((merit, fewer))
    return min(better, key=lambda item: item[0])[1] if better else None
