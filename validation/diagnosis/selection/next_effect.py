"""The next effect of a search: what is offered in its turn, each offer refitted, the best one that is worth its price.

Score tests about the fit that follows the data, about the present fit, and detectors offer candidates. Each is refitted
with continuity enforced from where the present fit stands, or from the segments that follow the data while it is far.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, in_parameters, parameters_of
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.evidence import ONE_SIDED, TURNED, price
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, Start
from discsim.validation.diagnosis.candidates.score_tests import (
    ScreenedCandidate,
    one_per_effect,
    pairs,
    screened_candidates,
)
from discsim.validation.diagnosis.detectors.all import searched
from discsim.validation.diagnosis.detectors.dropped_samples import Shifted
from discsim.validation.diagnosis.selection.best_refit import Refitted, best_of
from discsim.validation.diagnosis.selection.offers import Offer, begun_as_tried, in_chi2, in_turn
from discsim.validation.diagnosis.selection.refits import refitting
from discsim.validation.diagnosis.selection.search_state import (
    Considered,
    Search,
    chi2_in,
    far,
    from_here,
    hopeless,
    on_the_disc,
    possible,
    steady_noise,
    values_of_fit,
    wobbles,
)
from discsim.validation.diagnosis.selection.starting_point import HELD
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.gauss_newton import Bars, Fit, merit_of
from discsim.validation.identification.noise import NoiseModel, stated_noise
from discsim.validation.identification.residual_tests import RESIDUAL_TESTS

__all__ = ["joined", "next_effect", "next_two"]


def next_effect(found: Search, current: ContinuousFit, step: int) -> tuple[Search, ContinuousFit | None]:
    """Return the fit with the best further effect, or None where none is worth its price."""
    found, offers = _offers(found, current, step)
    noise = found.relaxed_noise
    chi2_now = chi2_in(current, noise)
    distant = far(found, current)
    fits: list[Refitted] = []
    seen: set[tuple[str, frozenset[int] | None]] = set()
    different = len({(offer[0].candidate.id, offer[0].candidate.recordings) for offer in offers})
    near_data, usual = chi2_now < SELECTION.near * current.fit.count, 0
    best_chi2, merit_now = chi2_now, merit_of(current.fit, current.fit.linears)
    for screened, fit, cost in offers:
        key = (screened.candidate.id, screened.candidate.recordings)
        if key in seen:
            continue
        most = _most_refitted(current, near_data, bool(fits))
        if usual >= most:
            break
        refitting(f"effect {step + 1}, refitting with", screened.candidate.id, len(seen), min(most, different))
        seen.add(key)
        usual += screened.candidate.id not in TURNED
        if screened.candidate.row.hides_readings:
            # readings at the limit take no part in a fit: what the motion asks for beyond it is the evidence
            cost = -screened.gain
        # beside the data it must gain half its price, as algebra said it would; where other readings take part that
        # cannot be seen
        told = not distant and any(screened is hint for hint in found.hints)
        beside = np.inf if cost or told else merit_now - 0.5 * price(screened.candidate)
        beside_noise = _with_stated(current, screened) if told else current.fit.noise
        bars = hopeless(best_chi2, current.fit.count) if distant else Bars(beside)
        refitted = joined(found, current, screened, bars) if distant and not cost else None
        if refitted is None:
            refitted = continuous_fit(
                fit,
                current.hypothesis.plus(screened.candidate),
                found.own,
                noise if distant else beside_noise,
                {**values_of_fit(current), **screened.start, **wobbles(fit)},
                bars=bars,
            )
        if not distant and not cost and refitted.score > current.score + SELECTION.worse:
            refitted = _begun_again(found, current, screened, beside)
        refitted = found.with_cost(refitted, cost)
        found = _considering(found, current, refitted, screened.candidate)
        gain, chi2 = found.considered[-1].gain, chi2_in(refitted, noise)
        if gain > price(screened.candidate) and possible(refitted):
            charged = refitted.charged + refitted.prior_penalty
            charged -= SELECTION.right_sign * any(q.key in ONE_SIDED for q in parameters_of(screened.candidate))
            fits.append(Refitted(refitted, fit, cost, chi2 + cost, charged))
            best_chi2 = min(best_chi2, chi2)
            near_data |= chi2 < SELECTION.near * refitted.fit.count
    if not fits:
        return found, None
    chosen = best_of(fits, distant, [far(found, one.fitted) for one in fits])
    best, fit, cost = chosen.fitted, chosen.about, chosen.cost
    if cost > 0:
        found = replace(found, relaxed_fit=fit)
    return replace(found, cost=found.cost + cost), best


def next_two(found: Search, alone: ContinuousFit | None = None) -> tuple[Search, ContinuousFit | None]:
    """Return the fit with the best two effects where it comes near the data, else None.

    Far from the data each of two effects alone may be fitted with numbers that serve for both. A third may do better
    than either. Algebra about the fit that follows the data tells both at once, but a delay and a lag alike: pairs are
    refitted until one leaves nothing but noise. Lost samples are counted and stand in no algebra: they are tried beside
    the effect that is best ``alone``, lest a clock stands for them.
    """
    ranked = pairs(found.relaxed_equations, found.candidates, found.own)
    sensible = [pair for pair in ranked if on_the_disc(found, pair.start)]
    chosen = sensible[: SELECTION.pairs_refitted]
    best: ContinuousFit | None = None
    for number, pair in enumerate(chosen):
        refitting("refitting with two", " and ".join(c.id for c in pair.hypothesis.candidates), number, len(chosen))
        both = _fit_of_two(found, found.relaxed_fit, pair.hypothesis, {**pair.start, **wobbles(found.relaxed_fit)})
        for candidate in pair.hypothesis.candidates:
            found = _considering(found, found.base, both, candidate)
        if not _counts(found, both):
            continue
        best = both if best is None or both.worse_than(best) < 0.0 else best
        if not both.unmodelled():
            break
    return (found, best) if alone is None else _beside_losses(found, alone, best)


def _fit_of_two(found: Search, about: Fit, hypothesis: Hypothesis, start: Start, cost: float = 0.0) -> ContinuousFit:
    """Return a fit of two effects from a relaxed fit, which counts only where it comes near the data."""
    bars = Bars(SELECTION.hopeless * SELECTION.far * found.base.fit.count)
    both = continuous_fit(about, hypothesis, found.own, found.relaxed_noise, start, bars=bars)
    return found.with_cost(both, cost)


def _counts(found: Search, both: ContinuousFit) -> bool:
    """Tell whether a fit of two effects is worth their price and comes near the data."""
    worth = both.gain_upon(found.base) > sum(map(price, both.hypothesis.candidates))
    return worth and possible(both) and not far(found, both)


def _beside_losses(
    found: Search, alone: ContinuousFit, best: ContinuousFit | None
) -> tuple[Search, ContinuousFit | None]:
    """Return the ``best`` fit of two effects, or one of lost samples beside the effect that is best ``alone``."""
    chosen: Shifted | None = None
    for item in found.lost_samples.found:
        if item.screened.candidate.id in {candidate.id for candidate in alone.hypothesis.candidates}:
            continue
        hypothesis, start = (
            alone.hypothesis.plus(item.screened.candidate),
            {**values_of_fit(alone), **item.screened.start},
        )
        both = _fit_of_two(found, item.in_place_of(found.relaxed_fit), hypothesis, start, item.cost)
        if _counts(found, both) and (best is None or both.worse_than(best) < 0.0):
            best, chosen = both, item
    if chosen is None:
        return found, best
    relaxed_fit = chosen.in_place_of(found.relaxed_fit)
    return replace(found, relaxed_fit=relaxed_fit, cost=found.cost + chosen.cost), best


def _offers(found: Search, current: ContinuousFit, step: int) -> tuple[Search, list[Offer]]:
    """Return further effects that may be worth their price, those to be refitted first at the front."""
    distant = far(found, current)
    # what is asked of the relaxed fit, and of the present one
    there: list[Offer] = []
    here: list[Offer] = []
    if distant or step == 0:
        ranked = one_per_effect(
            screened_candidates(found.relaxed_equations, found.candidates, current.hypothesis, found.own)
        )
        # beside the data a refit goes on from the present fit: from the segments it would have to be tied again
        there += [(p, found.relaxed_fit, 0.0) if distant else (from_here(p, current), current.fit, 0.0) for p in ranked]
    if not distant or step > 0:
        found = found.about(current.fit)
        here += [
            (from_here(p, current), current.fit, 0.0)
            for p in one_per_effect(
                screened_candidates(found.equations, found.candidates, current.hypothesis, found.own)
            )
        ]
    found = _with_lost_samples(found, current)
    shown: list[Offer] = []
    tried: list[Offer] = []
    steady = steady_noise(found)
    for item in searched(found.relaxed_fit, current, found.own, steady, found.lost_samples.found):
        if isinstance(item, Shifted):
            shown.append((item.screened, item.in_place_of(found.relaxed_fit), item.cost))
            continue
        beside = bool(current.hypothesis.candidates)
        tried.append((item, current.fit if beside and not distant else found.relaxed_fit, 0.0))
        (here if beside else shown).append(tried[-1])
    if not distant:
        # no more can be gained than is left, each in the noise in which it was asked: about segments that one recording
        # has wrong algebra promises anything. A limit at which readings stand moves nothing in a fit, and these
        # readings are no part of what is left
        left, left_steady = (chi2_in(current, noise) for noise in (found.relaxed_noise, steady))
        there = [offer for offer in there if in_chi2(offer) < left]
        shown = [offer for offer in shown if in_chi2(offer) < left_steady]
    # what the two promise does not compare: far from the data they are asked in different noise, and near them the
    # segments of a fit that follows may promise much of a sensor that has nothing to gain
    there, shown, here = (
        [offer for offer in some if on_the_disc(found, offer[0].start)] for some in (there, shown, here)
    )
    # beside the data, where the slopes at hand promise nothing its price, what readings show comes before what other
    # slopes promise
    first = not distant and not in_turn(here)
    worth = in_turn(shown, there, here) if first else in_turn([*there, *shown], here)
    worth = begun_as_tried(worth, tried)
    present = {candidate.id for candidate in current.hypothesis.candidates}
    told = [hint for hint in found.hints if hint.candidate.id not in present]
    # what a lag holds dies away too fast for slopes at no lag to tell
    told = [hint for hint in told if distant or hint.candidate.id == HELD or _swallowed(current, hint)]
    worth = [*((hint, found.relaxed_fit, 0.0) for hint in told), *worth]
    return found, worth


def _most_refitted(current: ContinuousFit, near_data: bool, gained: bool) -> int:
    """Return how many candidates a step refits: few near the data, where one has gained or nothing but noise is left.

    While none has gained, those few of each of the two fits that are asked. Of noise that the relaxed fit shows too
    loud a small effect is near the data, and many promise more than it.
    """
    if near_data and not gained:
        near_data = not current.unmodelled()
    if not near_data:
        return SELECTION.refitted_at_most
    return SELECTION.refitted if gained else 2 * SELECTION.refitted


def joined(found: Search, current: ContinuousFit, screened: ScreenedCandidate, bars: Bars) -> ContinuousFit | None:
    """Return a refit of a weakly identified motion from the present fit, however far; None where it comes not near.

    Its segments are joined already. To join those that follow the data takes short steps, which end beside the optimum.
    """
    if not found.relaxed_fit.plant.weakly_identified or screened.candidate.fixed_values:
        return None
    start, hypothesis = from_here(screened, current).start, current.hypothesis.plus(screened.candidate)
    fitted = continuous_fit(current.fit, hypothesis, found.own, found.relaxed_noise, start, bars=bars)
    return None if far(found, fitted) else fitted


def _swallowed(current: ContinuousFit, hint: ScreenedCandidate) -> bool:
    """Tell whether a sensor's noise on a rig is so loud that it has swallowed what was told of it before any fit."""
    own, stated = hint.candidate.row.acts_on, stated_noise(current.fit.linears)
    if current.fit.plant.airborne or own not in stated:
        return False
    return current.fit.noise[own].sd > RESIDUAL_TESTS.loud * stated[own].sd


def _with_stated(current: ContinuousFit, hint: ScreenedCandidate) -> NoiseModel:
    """Return a fit's noise with the stated one of the sensor whose own has swallowed what was told of it."""
    own = hint.candidate.row.acts_on
    return {**current.fit.noise, own: stated_noise(current.fit.linears)[own]}


def _begun_again(found: Search, current: ContinuousFit, screened: ScreenedCandidate, bar: float) -> ContinuousFit:
    """Return a refit that begins where the present fit is, the further effect without a size yet.

    Of a direction that hardly shows, as a tilt square to the field, algebra may ask for any number.
    """
    shape_grid = {key: number for key, number in screened.start.items() if key[0][1] in screened.candidate.shape_grid}
    start = {**values_of_fit(current), **shape_grid}
    return continuous_fit(
        current.fit, current.hypothesis.plus(screened.candidate), found.own, current.fit.noise, start, bars=Bars(bar)
    )


def _considering(found: Search, before: ContinuousFit, refitted: ContinuousFit, candidate: CandidateEffect) -> Search:
    """Return a search that knows what a candidate gains upon the fit ``before``."""
    values = {
        q.name: float(v)
        for q, v in zip(refitted.fit.parameters, refitted.fit.at, strict=True)
        if q.group == candidate.id and q.recordings == candidate.recordings
    }
    one = Considered(candidate, refitted.gain_upon(before), in_parameters(candidate.row, values))
    return replace(found, considered=(*found.considered, one))


def _with_lost_samples(found: Search, current: ContinuousFit) -> Search:
    """Return a search that knows what samples were lost as its relaxed fit tells them, but for those that are taken."""
    known = [q for q in found.own if q.key not in found.relaxed_fit.plant.own_keys]
    taken = {candidate.id for candidate in current.hypothesis.candidates}
    lost = found.lost_samples.about(found.relaxed_fit, known, lambda: steady_noise(found), taken)
    return replace(found, lost_samples=lost)
