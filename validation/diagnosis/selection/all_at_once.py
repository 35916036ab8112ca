"""All effects at once that a relaxed fit asks for, where what sensors tell of one another has begun it.

Takes a search that is far from its data; gives the fit with continuity enforced of every ordinary error of the relaxed
fit that its normal equations cannot do without. Where several effects are large each of them alone leaves so much that
no step by step selection comes nearer; beside the data algebra knows what each of them is worth beside the others
(backward elimination by the drop in chi-squared: Draper and Smith, "Applied Regression Analysis", 1998, 15.3).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

from discsim.effects.catalogue import CATALOGUE, catalogued
from discsim.effects.mount_rows import Mount
from discsim.effects.sensors import CrossAxis, HardIron, Lag
from discsim.effects.setup import BoardRotation
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, free_candidate
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.evidence import NESTED, TURNED, lead, price
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, Start, fitted_parameters
from discsim.validation.diagnosis.candidates.screening import NormalEquations, normal_equations_of
from discsim.validation.diagnosis.selection.held_out import heldout_chi2
from discsim.validation.diagnosis.selection.search_state import (
    Search,
    chi2_in,
    far,
    on_the_disc,
    possible,
    values_of_fit,
)
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.gauss_newton import Fit, penalty_of
from discsim.validation.identification.parameters import Parameter

__all__ = ["all_at_once", "turn_of", "worth_of_each"]

#: the whole board turned
_BOARD = catalogued(BoardRotation).id
#: most effects at once: those of the consistency stage and the ordinary errors of three sensors that it goes with
_MOST = 8
#: most steps of their fit: it begins where the relaxed fit has them, and closes segments that this let part
_STEPS = 20
#: rounds in which effects are added and left out by algebra about a fit, each refitted: one mostly does
_ROUNDS = 3


def all_at_once(found: Search) -> ContinuousFit | None:
    """Return the fit of all effects that a relaxed fit asks for together, None where they are not worth their price."""
    relaxed_fit = found.relaxed_fit
    free = dict.fromkeys(q.group for q in relaxed_fit.parameters if q.recordings is None)
    lags = [hint for hint in found.hints if hint.candidate.row.type is Lag and hint.candidate.id in free]
    if not lags or not far(found, found.base):
        return None
    competing = {candidate.id for candidate in found.candidates}
    if any(q.group == _BOARD for q in found.own):
        # beside a board that is turned a chip that is turned in it, too, is a row or two that were miscounted
        competing -= TURNED
    every = [free_candidate(id) for id in free if id in CATALOGUE and id in competing and not CATALOGUE[id].grid]
    # what sensors told before any fit stays until a fit has it: about the relaxed fit algebra weighs it against itself
    told = {hint.candidate.id for hint in lags}
    turns = [free_candidate(id) for id in sorted(TURNED & competing) if CATALOGUE[id].type is Mount]
    fits = _few(found, every, turns, told)
    if all(one.unmodelled() and far(found, one) for one in fits):
        # beside the data the few leave what no ordinary error stands for
        fits += _many(found, every, told)
    fits = [one for one in fits if possible(one)]
    if not fits:
        return None
    fitted = _simpler(found, min(fits, key=lambda one: _charged(found, one)), competing)
    return fitted if fitted.gain_upon(found.base) > sum(map(price, fitted.hypothesis.candidates)) else None


def _many(found: Search, every: Sequence[CandidateEffect], told: Collection[str]) -> list[ContinuousFit]:
    """Return the fit of all effects that the relaxed fit cannot do without, less those that it then can."""
    asked = _held_out(found, _pruned(found, found.relaxed_equations, every, told), told)
    fitted = _fitted(found, asked)
    if fitted is None:
        return []
    about = found.about(fitted.fit)
    fewer = _held_out(about, _pruned(found, about.equations, asked))
    if len(fewer) < len(asked):
        # what two effects shared that are one in these recordings, one of them cannot have: again from the relaxed fit
        fitted = _fitted(found, fewer)
    return [] if fitted is None else [fitted]


def _fitted(found: Search, candidates: tuple[CandidateEffect, ...], known: Start | None = None) -> ContinuousFit | None:
    """Return the fit of some effects from where the relaxed fit has them, None where it has them off the disc.

    What is ``known`` better begins there.
    """
    relaxed_fit, ids = found.relaxed_fit, {one.id for one in candidates}
    start = {
        (q.key, q.recordings): float(v)
        for q, v in zip(relaxed_fit.parameters, relaxed_fit.at, strict=True)
        if q.group in ids or q.key in relaxed_fit.plant.own_keys or q in found.own
    }
    for turned, matrix in NESTED.items():
        if turned in ids and matrix not in ids:
            pairs = zip(relaxed_fit.parameters, relaxed_fit.at.tolist(), strict=True)
            everything = {(q.key, q.recordings): v for q, v in pairs}
            start |= turn_of(everything, matrix, turned)
    start |= {key: value for key, value in (known or {}).items() if key in start}
    if not candidates or not on_the_disc(found, start):
        return None
    return continuous_fit(
        relaxed_fit, Hypothesis(candidates), found.own, found.relaxed_noise, start, iterations=_STEPS, polish=2
    )


def _charged(found: Search, fitted: ContinuousFit) -> float:
    """Return chi-squared of a fit with its priors and what its effects cost, in the noise of the relaxed fit.

    In the noise that it has left itself a sensor that it misses would be a noisy one.
    """
    return _left(found, fitted) + sum(_cost(found, one) for one in fitted.hypothesis.candidates)


def _left(found: Search, fitted: ContinuousFit) -> float:
    """Return chi-squared of a fit with its priors in the noise of the relaxed fit."""
    return chi2_in(fitted, found.relaxed_noise) + penalty_of(fitted.fit, fitted.fit.linears)


def _simpler(found: Search, fitted: ContinuousFit, competing: Collection[str]) -> ContinuousFit:
    """Return a fit with a chip that is turned in the place of a matrix where that explains as much for its parameters.

    Fits of the few may have ended beside their optimum, so that a matrix is left; from where it stands its turn begins.
    What rows that were miscounted leave may be worth the further numbers of a matrix, as it is any effect.
    """
    for turned, matrix in NESTED.items():
        present = {candidate.id: candidate for candidate in fitted.hypothesis.candidates}
        if matrix not in present or turned in present or turned not in competing:
            continue
        turn, values = free_candidate(turned), values_of_fit(fitted)
        few = Hypothesis(tuple(turn if one.id == matrix else one for one in fitted.hypothesis.candidates))
        start = {**values, **turn_of(values, matrix, turned)}
        simpler = continuous_fit(fitted.fit, few, found.own, found.relaxed_noise, start, iterations=_STEPS)
        worse = _left(found, simpler) - _left(found, fitted) + lead(turn, present[matrix])
        if possible(simpler) and worse < SELECTION.miscounted * found.relaxed_fit.counted:
            fitted = simpler
    return fitted


def _cost(found: Search, candidate: CandidateEffect) -> float:
    """Return what an effect must gain beside others: more where rows were counted, of which some are miscounted."""
    odd = SELECTION.turned * (candidate.id in TURNED) + SELECTION.miscounted * found.relaxed_fit.counted
    return price(candidate) + odd


def _few(
    found: Search, every: Sequence[CandidateEffect], turns: Sequence[CandidateEffect], told: Collection[str]
) -> list[ContinuousFit]:
    """Return fits in which chips that are turned take the place of matrices and scales; none where they run away.

    A turn is nested in a matrix: its numbers are opposite in pairs, to first order. Beside each other neither is worth
    its price, the one with more numbers is the last to go, and scales make up for the squares of the turn. So the fit
    begins anew with the few: what was ``told``, hard iron, and the ``turns`` of each chip. Of ``every`` other effect
    that counts which is worth its price beside them.
    """
    few = tuple(one for one in every if one.id in told or one.row.type is HardIron)
    fits: list[ContinuousFit] = []
    fitted = _fitted(found, (*few, *turns))
    for _ in range(_ROUNDS):
        if fitted is None or not possible(fitted):
            break
        fits.append(fitted)
        if len(fits) == _ROUNDS:
            break
        about, present = _about(found, fitted.fit), fitted.hypothesis.candidates
        chosen = _held_out(about, _chosen(found, about.equations, present, every, told), told)
        if any(set(chosen) == set(one.hypothesis.candidates) for one in fits):
            # what algebra offers about one fit it takes back about another: the better of both counts
            break
        fitted = _fitted(found, chosen, values_of_fit(fitted))
    return fits


def _about(found: Search, fit: Fit) -> Search:
    """Return the search with its normal equations about a fit, in the noise of the relaxed fit."""
    equations = normal_equations_of(fit, found.candidates, found.relaxed_noise, fit.continuous_defects)
    return replace(found, equations=equations, asked=fit)


def _chosen(
    found: Search,
    equations: NormalEquations,
    present: Sequence[CandidateEffect],
    every: Sequence[CandidateEffect],
    told: Collection[str],
) -> tuple[CandidateEffect, ...]:
    """Return the effects that are worth their price as algebra has it, added and left out one by one from a fit's."""
    chosen = _pruned(found, equations, present, told)
    while len(chosen) < _MOST:
        more = [one for one in every if one.id not in {item.id for item in chosen}]
        gains = {one: worth_of_each(equations, (*chosen, one), found.own)[one.name] - _cost(found, one) for one in more}
        best = max(gains, key=lambda one: gains[one], default=None)
        if best is None or gains[best] <= 0.0:
            break
        chosen = (*chosen, best)
    return _pruned(found, equations, chosen, told)


def turn_of(values: Start, matrix: str, turned: str) -> Start:
    """Return the rotation vector that does about what a cross-axis matrix does: v - r x v is (I + S) v."""
    S = {name: values.get(((matrix, name), None), 0.0) for name in CrossAxis._fields}
    turn = (0.5 * (S["syz"] - S["szy"]), 0.5 * (S["szx"] - S["sxz"]), 0.5 * (S["sxy"] - S["syx"]))
    return {((turned, name), None): r for name, r in zip(CATALOGUE[turned].parameters, turn, strict=True)}


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
    found: Search,
    equations: NormalEquations,
    candidates: Sequence[CandidateEffect],
    kept: Collection[str] = (),
) -> tuple[CandidateEffect, ...]:
    """Return the effects that are each worth their price beside the others, at most as many as may be at once.

    Those whose ids are ``kept`` stay.
    """

    def spare(left: Sequence[CandidateEffect]) -> dict[str, float]:
        worth = worth_of_each(equations, left, found.own)
        return {one.name: worth[one.name] - _cost(found, one) for one in left}

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
