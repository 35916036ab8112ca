"""The search: from the relaxed fit to the smallest set of effects that leaves nothing but noise.

Proposals come from algebra about a fit that follows the data; each that matters is refitted with pieces that hang
together, and believed only if it gains more than its price by the likelihood, with the noise estimated anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import TypeAlias

import numpy as np

from discsim.effects import Effect
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import DroppedSamples
from discsim.recording import Recording
from validation.diagnosis.detectors.all import searched
from validation.diagnosis.detectors.dropped_samples import Shifted, Slips
from validation.diagnosis.relaxed_fit import relaxed, unknowns, without_outliers
from validation.diagnosis.selection.candidates import Trial, parameters_of, trials_for
from validation.diagnosis.selection.constrained_fit import Tied, tied_fit
from validation.diagnosis.selection.evidence import ONE_SIDED, price
from validation.diagnosis.selection.exchange import exchanged, pruned, rivals_of, widened
from validation.diagnosis.selection.found import (
    Considered,
    Search,
    chi2_in,
    far,
    from_here,
    lost,
    no_nearer,
    on_the_disc,
    possible,
    values_of_fit,
)
from validation.diagnosis.selection.hypothesis import Hypothesis, Start, fitted_parameters
from validation.diagnosis.selection.proposals import (
    Proposal,
    hinted,
    one_per_effect,
    pairs,
    proposals,
    start_of,
)
from validation.diagnosis.selection.screening import Board, board_of
from validation.diagnosis.settings import SELECTION
from validation.identification.competing_effects import CATALOGUED, Competing
from validation.identification.gauss_newton import Fit, merit_of
from validation.identification.noise import NoiseModel, estimate_noise, robust_noise
from validation.identification.parameters import Parameter
from validation.identification.stated_parameters import stated_parameters

__all__ = ["screened", "search", "tried_without"]

Report: TypeAlias = Callable[[str, int, int], None]
#: what is proposed, the fit whose motion a fit of it starts from, and what choosing lost samples costs
Offer: TypeAlias = tuple[Proposal, Fit, float]

_DROPPED = catalogued(DroppedSamples, "magnetometer").id


# a hypothesis far from the data may send a motion beyond all numbers: such a fit is not finite, and is passed over
@np.errstate(over="ignore", invalid="ignore")
def search(
    recordings: Sequence[Recording],
    report: Report = lambda stage, done, total: None,
    as_stated: Sequence[Recording] | None = None,
    followed: Fit | None = None,
    free: Sequence[Parameter] = (),
    hints: Sequence[Effect] = (),
    effects: Competing = CATALOGUED,
) -> Search:
    """Find the effects that explain recordings of one plant; what is given is that of `screened`."""
    found = screened(recordings, report, as_stated, followed, free, hints, effects)
    report("refitting candidates", 3, 4)
    found = _settled(_grown(found))
    report("done", 4, 4)
    return found


def screened(
    recordings: Sequence[Recording],
    report: Report = lambda stage, done, total: None,
    as_stated: Sequence[Recording] | None = None,
    followed: Fit | None = None,
    free: Sequence[Parameter] = (),
    hints: Sequence[Effect] = (),
    effects: Competing = CATALOGUED,
) -> Search:
    """Return where the search begins: the relaxed fit with all candidates asked about it, and the baseline's fit.

    ``as_stated`` are the same with nothing that stands in for what they do not state, ``followed`` their relaxed fit
    where it is known already; ``free`` are numbers that every fit may move. ``hints`` are effects of about the right
    size that sensors asked of one another before any fit: algebra from far away finds no clock by whose error phases
    run away. ``effects`` are those that compete.
    """
    known = (*stated_parameters(recordings), *free)
    own = (*known, *unknowns(recordings))
    report("following the data", 0, 4)
    loose, left_out = without_outliers(relaxed(recordings, known) if followed is None else followed)
    loose = replace(loose, chains=tuple(replace(chain, effects=effects) for chain in loose.chains))
    noise = estimate_noise(loose.linears, [linear.residual for linear in loose.linears])
    given = {q.group for q in free}
    trials = tuple(trial for trial in trials_for(recordings, effects) if trial.id not in given)
    report("asking every effect", 1, 4)
    board = board_of(loose, trials, noise, loose.plant.sizes.continuous)
    report("fitting the baseline", 2, 4)
    base = _baseline(loose, board, own, noise)
    asked = tuple(hinted(hint) for hint in hints if any(trial.id == hint.id for trial in trials))
    stated = tuple(as_stated or recordings)
    return Search(
        stated, own, loose, noise, trials, base, base, board, board, loose, outliers=tuple(left_out), hints=asked
    )


def _baseline(loose: Fit, board: Board, own: Sequence[Parameter], noise: NoiseModel) -> Tied:
    """Return the fit without any effect."""
    plant = loose.plant
    start = {**_start(board, Hypothesis(), own), **_wobbles(loose)}
    base = tied_fit(loose, Hypothesis(), own, noise, start, iterations=plant.base_steps)
    if chi2_in(base, noise) < SELECTION.far * base.fit.count and base.fit.iterations >= plant.base_steps:
        # beside the data what the baseline has left to gain would pass for what an effect gains
        again = tied_fit(
            base.fit,
            Hypothesis(),
            own,
            base.fit.noise,
            values_of_fit(base),
            iterations=plant.base_steps,
            bar=merit_of(base.fit, base.fit.linears),
        )
        base = min(base, again, key=lambda one: one.score)
    return base


def _grown(found: Search) -> Search:
    """Return the search with effects added as long as one is worth its price."""
    for step in range(SELECTION.most_effects):
        current = found.final
        found, better = next_effect(found, current, step)
        if step == 0 and far(found, current) and (better is None or far(found, better)) and not _told(better):
            found, together = _together(found)
            if together is not None:
                found = _with_final(found, pruned(found, together))
                continue
        if better is None or len(better.hypothesis.trials) > SELECTION.most_effects:
            break
        if step == 0 and far(found, better) and not _told(better) and no_nearer(found, current, better):
            # neither one effect nor two come near the data, nor does any lead there
            return replace(found, final=better)
        again = _from_there(found, current, better)
        if again is not None:
            # it was not the effect that gained, but where its fit had started
            return replace(found, final=again, base=again if step == 0 else found.base)
        if step >= 1 and far(found, better):
            # two effects and still far from the data: none of these
            return replace(found, final=better)
        found = _with_final(found, pruned(found, better, kept=better.hypothesis.trials[-1]))
    return found


def _with_final(found: Search, tied: Tied) -> Search:
    """Return a search with a fit as the final one so far."""
    return replace(found.with_step(tied), final=tied)


def _settled(found: Search) -> Search:
    """Return a search whose effects are exchanged for rivals that explain more for their parameters."""
    for exchanges in range(SELECTION.exchanges + 1):
        if (wide := widened(found, found.final)) is not found.final:
            found = _with_final(found, wide)
        found = found.about(found.final.fit)
        # where the fit is far from the data nothing is named, and nothing need be told apart
        found = replace(found, rivals={} if lost(found, found.final) else rivals_of(found))
        better = exchanged(found)
        if better is None or exchanges == SELECTION.exchanges:
            break
        found = _with_final(found, better)
    return found


def _start(board: Board, hypothesis: Hypothesis, own: Sequence[Parameter]) -> Start:
    """Return what algebra expects of a hypothesis's parameters."""
    taken = board.columns_of(fitted_parameters(hypothesis, own))
    return start_of(taken, board.ask(taken))


def _wobbles(fit: Fit) -> Start:
    """Return how the wobble of free spins dies and turns in a fit whose pieces go with it.

    What algebra expects of it is far from linear where turning for a second makes a radian.
    """
    parameters = zip(fit.parameters, fit.at, strict=True)
    return {(q.key, q.recordings): float(v) for q, v in parameters if q.key in fit.plant.own_keys}


def _told(tied: Tied | None) -> bool:
    """Tell whether a fit's last effect was found in the readings themselves and is in its chains."""
    return tied is not None and bool(tied.hypothesis.trials[-1].told)


def _offers(found: Search, current: Tied, step: int) -> tuple[Search, list[Offer]]:
    """Return further effects that may be worth their price, those to be refitted first at the front."""
    distant = far(found, current)
    # what is asked of the relaxed fit, and of the present one
    there: list[Offer] = []
    here: list[Offer] = []
    if distant or step == 0:
        ranked = one_per_effect(proposals(found.loose_board, found.trials, current.hypothesis, found.own))
        # beside the data a refit goes on from the present fit: from the pieces it would have to be tied again
        there += [(p, found.loose, 0.0) if distant else (from_here(p, current), current.fit, 0.0) for p in ranked]
    if not distant or step > 0:
        found = found.about(current.fit)
        here += [
            (from_here(p, current), current.fit, 0.0)
            for p in one_per_effect(proposals(found.board, found.trials, current.hypothesis, found.own))
        ]
    found = _with_slips(found, current)
    for item in searched(found.loose, current, found.own, _steady_noise(found), found.slips.found):
        if isinstance(item, Shifted):
            there.append((item.proposal, replace(found.loose, chains=item.chains), item.cost))
        elif current.hypothesis.trials:
            here.append((item, found.loose if distant else current.fit, 0.0))
        else:
            there.append((item, found.loose, 0.0))
    # far from the data the two are asked in different noise: what they gain does not compare
    there, here = ([offer for offer in some if on_the_disc(found, offer[0].start)] for some in (there, here))
    worth = in_turn(there, here) if distant and step > 0 else in_turn([*there, *here])
    if distant:
        present = {trial.id for trial in current.hypothesis.trials}
        worth = [*((hint, found.loose, 0.0) for hint in found.hints if hint.trial.id not in present), *worth]
    return found, worth


def next_effect(found: Search, current: Tied, step: int) -> tuple[Search, Tied | None]:
    """Return the fit with the best further effect, or None where none is worth its price."""
    found, offers = _offers(found, current, step)
    noise = found.loose_noise
    chi2_now = chi2_in(current, noise)
    distant = far(found, current)
    fits: list[tuple[float, Tied, Fit, float]] = []
    seen: set[tuple[str, frozenset[int] | None]] = set()
    near_data = chi2_now < SELECTION.near * current.fit.count
    best_chi2, merit_now = chi2_now, merit_of(current.fit, current.fit.linears)
    for proposal, fit, cost in offers:
        key = (proposal.trial.id, proposal.trial.recordings)
        if key in seen:
            continue
        if len(seen) >= (SELECTION.refitted if near_data else SELECTION.refitted_at_most):
            break
        seen.add(key)
        if proposal.trial.row.hides_readings:
            # readings at the limit take no part in a fit: what the motion asks for beyond it is the evidence
            cost = -proposal.gain
        # beside the data it must gain half its price, as algebra said it would; where other readings take part that
        # cannot be seen
        beside = np.inf if cost else merit_now - 0.5 * price(proposal.trial)
        refitted = tied_fit(
            fit,
            current.hypothesis.plus(proposal.trial),
            found.own,
            noise if distant else current.fit.noise,
            {**values_of_fit(current), **proposal.start, **_wobbles(fit)},
            bar=(SELECTION.hopeless_near if near_data else SELECTION.hopeless) * best_chi2 if distant else beside,
        )
        if not distant and not cost and refitted.score > current.score + SELECTION.worse:
            refitted = _begun_again(found, current, proposal, beside)
        refitted = replace(refitted, score=refitted.score + found.cost + cost)
        found = _considering(found, (current.score, chi2_now), refitted, proposal.trial)
        gain, chi2 = found.considered[-1].gain, chi2_in(refitted, noise)
        if gain > price(proposal.trial) and possible(refitted):
            # far from the data chi-squared says more than a likelihood that has swallowed the mismatch as noise
            merit = (chi2 + cost if distant else refitted.score) + SELECTION.rival * refitted.hypothesis.size
            merit -= SELECTION.right_sign * any(q.key in ONE_SIDED for q in parameters_of(proposal.trial))
            fits.append((merit, refitted, fit, cost))
            best_chi2 = min(best_chi2, chi2)
            near_data |= chi2 < SELECTION.near * refitted.fit.count
    if not fits:
        return found, None
    _, best, fit, cost = min(fits, key=lambda item: item[0])
    if cost > 0:
        found = replace(found, loose=replace(found.loose, chains=fit.chains))
    return replace(found, cost=found.cost + cost), best


def _begun_again(found: Search, current: Tied, proposal: Proposal, bar: float) -> Tied:
    """Return a refit that begins where the present fit is, the further effect without a size yet.

    Of a direction that hardly shows, as a tilt square to the field, algebra may ask for any number.
    """
    shapes = {key: number for key, number in proposal.start.items() if key[0][1] in proposal.trial.shapes}
    start = {**values_of_fit(current), **shapes}
    return tied_fit(current.fit, current.hypothesis.plus(proposal.trial), found.own, current.fit.noise, start, bar=bar)


def in_turn(*offers: Sequence[Offer]) -> list[Offer]:
    """Return offers that may be worth their price, from each list the best in turn."""

    def later(offer: Offer) -> tuple[bool, float]:
        # lost samples first: they bend what algebra says of everything else
        return offer[2] <= 0.0, SELECTION.rival * len(parameters_of(offer[0].trial)) - offer[0].gain

    worth = [sorted((o for o in some if o[0].gain > 0.5 * price(o[0].trial)), key=later) for some in offers]
    return [offer for turn in zip_longest(*worth) for offer in turn if offer is not None]


def _considering(found: Search, before: tuple[float, float], refitted: Tied, trial: Trial) -> Search:
    """Return a search that knows what a trial gains upon a fit of score and chi-squared ``before``."""
    score, chi2_before = before
    values = {
        q.name: float(v)
        for q, v in zip(refitted.fit.parameters, refitted.fit.at, strict=True)
        if q.group == trial.id and q.recordings == trial.recordings
    }
    gained = score - refitted.score, chi2_before - chi2_in(refitted, found.loose_noise)
    return replace(found, considered=(*found.considered, Considered(trial, *gained, values)))


def _together(found: Search) -> tuple[Search, Tied | None]:
    """Return the fit with the best two effects where it comes near the data, else None.

    Far from the data each of two effects alone may be fitted with numbers that serve for both, and a third may do
    better than either; algebra about the fit that follows the data tells both at once.
    """
    base, noise = found.base, found.loose_noise
    before = base.score, chi2_in(base, noise)
    ranked = pairs(found.loose_board, found.trials, found.own)
    sensible = [pair for pair in ranked if on_the_disc(found, pair.start)]
    for pair in sensible[: SELECTION.pairs_refitted]:
        start = {**pair.start, **_wobbles(found.loose)}
        # it counts only where it comes near the data
        both = tied_fit(
            found.loose,
            pair.hypothesis,
            found.own,
            noise,
            start,
            bar=SELECTION.hopeless * SELECTION.far * found.base.fit.count,
        )
        both = replace(both, score=both.score + found.cost)
        for trial in pair.hypothesis.trials:
            found = _considering(found, before, both, trial)
        worth = base.score - both.score > sum(map(price, pair.hypothesis.trials))
        if worth and possible(both) and not far(found, both):
            return found, both
    return found, None


def _with_slips(found: Search, current: Tied) -> Search:
    """Return a search that knows the magnetometer's lost samples, unless they are among the present effects already."""
    if any(trial.id == _DROPPED for trial in current.hypothesis.trials):
        return replace(found, slips=Slips())
    known = [q for q in found.own if q.key not in found.loose.plant.own_keys]
    return replace(found, slips=found.slips.about(found.loose, known))


def _steady_noise(found: Search) -> NoiseModel:
    """Return the noise in which events are looked for: without what a short one adds, where most readings are well."""
    linears = found.loose.linears
    steady = robust_noise(linears, [linear.residual for linear in linears])
    stated = {c.group: float(linear.sd[c.rows][0]) for linear in linears for c in linear.channels}
    well = all(
        not np.isfinite(stated[group]) or noise.sd < SELECTION.short * stated[group] for group, noise in steady.items()
    )
    return steady if well else found.loose_noise


def tried_without(found: Search, trial: Trial) -> Tied:
    """Return the fit of the final hypothesis without one of its effects."""
    final = found.final
    rest = final.hypothesis.without(trial)
    if not rest.trials:
        return found.base
    for step in found.steps:
        if set(step.hypothesis.trials) == set(rest.trials):
            return step
    return tied_fit(found.loose, rest, found.own, found.loose_noise, values_of_fit(final), iterations=5, polish=1)


def _from_there(found: Search, current: Tied, better: Tied) -> Tied | None:
    """Return the fit without the last effect from where that with it stands, if then the effect is not worth its price.

    None where it is, or where it gains so much that no start could.
    """
    trial = better.hypothesis.trials[-1]
    if current.score - better.score > SELECTION.doubtful or not found.loose.plant.weakly_identified:
        return None
    start = values_of_fit(better)
    again = tied_fit(better.fit, current.hypothesis, found.own, better.fit.noise, start)
    again = replace(again, score=again.score + found.cost)
    return again if again.score - better.score < price(trial) else None
