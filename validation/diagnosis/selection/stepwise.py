"""Stepwise forward selection: from the relaxed fit to the smallest set of effects that leaves nothing but noise.

Takes recordings; gives a `Search`. Score tests about a fit that follows the data screen candidates; each that matters
is refitted with continuity enforced, and believed only if it gains more than its penalty by the likelihood, with the
noise estimated anew (stepwise regression: Efroymson, 1960).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from discsim.effects import Effect
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import Lag
from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.followed import true_noise
from discsim.validation.diagnosis.detectors.all import searched
from discsim.validation.diagnosis.detectors.dropped_samples import Shifted
from discsim.validation.diagnosis.relaxed_fit import clock_of_accelerometer, relaxed, unknowns, without_outliers
from discsim.validation.diagnosis.selection.all_at_once import all_at_once
from discsim.validation.diagnosis.selection.best_refit import Refitted, best_of
from discsim.validation.diagnosis.selection.candidates import (
    CandidateEffect,
    candidates_for,
    in_parameters,
    parameters_of,
)
from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.selection.event_instants import with_best_instant
from discsim.validation.diagnosis.selection.evidence import ONE_SIDED, TURNED, price
from discsim.validation.diagnosis.selection.exchange import (
    eliminated_backward,
    exchanged,
    rivals_of,
    widened,
    without_superfluous,
)
from discsim.validation.diagnosis.selection.hypothesis import Hypothesis, Start, fitted_parameters
from discsim.validation.diagnosis.selection.offers import Offer, in_chi2, in_turn
from discsim.validation.diagnosis.selection.recounting import with_losses_recounted
from discsim.validation.diagnosis.selection.refits import refitting
from discsim.validation.diagnosis.selection.score_tests import (
    ScreenedCandidate,
    hinted,
    one_per_effect,
    pairs,
    pictured_from_above,
    plans_alone,
    screened_candidates,
    start_of,
)
from discsim.validation.diagnosis.selection.screening import NormalEquations, normal_equations_of
from discsim.validation.diagnosis.selection.search_state import (
    Considered,
    Search,
    chi2_in,
    far,
    from_here,
    lost,
    no_nearer,
    on_the_disc,
    possible,
    steady_noise,
    values_of_fit,
)
from discsim.validation.diagnosis.settings import SELECTION, UNKNOWN_LAW
from discsim.validation.diagnosis.uninflated_noise import uninflated_noise
from discsim.validation.identification.competing_effects import CATALOGUED, Competing
from discsim.validation.identification.gauss_newton import Bars, Fit, merit_of
from discsim.validation.identification.noise import NoiseModel, estimate_noise, stated_noise
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.residual_tests import RESIDUAL_TESTS, loudest, unmodelled_residuals
from discsim.validation.identification.stated_parameters import stated_parameters

__all__ = ["joined", "past_hope", "screened", "search", "settled", "without_swallowed"]

Report: TypeAlias = Callable[[str, int, int], None]

#: the lag that holds what was there before a recording began
_HELD = catalogued(Lag, "accelerometer").id


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
    of_use: int | None = None,
) -> Search:
    """Find the effects that explain recordings of one plant; what is given is that of `screened`.

    A search that stands by two more than ``of_use`` effects is given up as it stands: who asked takes no such stack.
    """
    found = screened(recordings, report, as_stated, followed, free, hints, effects)
    report("refitting candidates", 3, 4)
    found = _selected_forward(found, of_use)
    found = found if _of_no_use(found, of_use) else settled(found)
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
    relaxed_fit, left_out = without_outliers(relaxed(recordings, known) if followed is None else followed)
    relaxed_fit = replace(
        relaxed_fit, trajectories=tuple(replace(trajectory, effects=effects) for trajectory in relaxed_fit.trajectories)
    )
    noise = _noise_of(relaxed_fit)
    given = {q.group for q in free}
    if relaxed_fit.plant.held and _HELD not in {hint.id for hint in hints}:
        # of means over turns a lag changes nothing but how what it holds dies away, which was asked before any fit
        given.add(_HELD)
    candidates = tuple(candidate for candidate in candidates_for(recordings, effects) if candidate.id not in given)
    report("asking every effect", 1, 4)
    asked_in = relaxed_fit.noise if relaxed_fit.from_release else noise
    equations = normal_equations_of(relaxed_fit, candidates, asked_in, relaxed_fit.continuous_defects)
    report("fitting the baseline", 2, 4)
    base = _baseline(relaxed_fit, equations, own, noise)
    told = clock_of_accelerometer(relaxed_fit)
    hints = hints if told is None else (*hints, told)
    asked = tuple(hinted(hint) for hint in hints if any(candidate.id == hint.id for candidate in candidates))
    asked += pictured_from_above(recordings, candidates)
    stated = tuple(as_stated or recordings)
    return Search(
        stated,
        own,
        relaxed_fit,
        noise,
        candidates,
        base,
        base,
        equations,
        equations,
        relaxed_fit,
        outliers=tuple(left_out),
        hints=asked,
    )


def _noise_of(relaxed_fit: Fit) -> NoiseModel:
    """Return the noise of readings: what a fit leaves that follows them, else what they show themselves."""
    if relaxed_fit.from_release:
        return true_noise([readings for trajectory in relaxed_fit.trajectories for readings in trajectory.readings])
    return estimate_noise(relaxed_fit.linears, [linear.residual for linear in relaxed_fit.linears])


def _baseline(
    relaxed_fit: Fit, equations: NormalEquations, own: Sequence[Parameter], noise: NoiseModel
) -> ContinuousFit:
    """Return the fit without any effect."""
    plant = relaxed_fit.plant
    start = {**_start(equations, Hypothesis(), own), **_wobbles(relaxed_fit)}
    base = continuous_fit(relaxed_fit, Hypothesis(), own, noise, start, iterations=plant.base_steps)
    if chi2_in(base, noise) < SELECTION.far * base.fit.count and base.fit.iterations >= plant.base_steps:
        # beside the data what the baseline has left to gain would pass for what an effect gains
        again = continuous_fit(
            base.fit,
            Hypothesis(),
            own,
            base.fit.noise,
            values_of_fit(base),
            iterations=plant.base_steps,
            bars=Bars(merit_of(base.fit, base.fit.linears)),
        )
        base = min(base, again, key=lambda one: one.score)
    return base


def _of_no_use(found: Search, of_use: int | None) -> bool:
    """Tell whether a search has come to more effects than elimination is likely to bring down to those of use."""
    return of_use is not None and len(found.final.hypothesis.candidates) >= of_use + 2


def _selected_forward(found: Search, of_use: int | None) -> Search:
    """Return the search with effects added as long as one is worth its price."""
    most = SELECTION.most_effects
    if (begun := all_at_once(found)) is not None:
        if begun.fit.counted:
            # instants that were counted leave more than noise: what is weighed by it would be taken up for ever
            return replace(_with_final(found, begun), at_once=True)
        found = _with_final(found, eliminated_backward(found, begun))
        if far(found, found.final):
            return found
        most += len(found.final.hypothesis.candidates)
    for step in range(len(found.final.hypothesis.candidates), max(most, SELECTION.most_with_sensors)):
        current = found.final
        if step >= _most(found, current, most) or _of_no_use(found, of_use):
            break
        found, better = next_effect(found, current, step)
        if better is None and (told := without_swallowed(found, current)) is not None and not far(found, current):
            found, better = next_effect(found, told, step)
        if (
            step == 0
            and far(found, current)
            and (better is None or far(found, better))
            and not _told(better)
            and _most(found, current, most) > 1
        ):
            found, together = _together(found)
            if together is not None:
                found = _with_final(found, eliminated_backward(found, together))
                continue
        if better is None or len(better.hypothesis.candidates) > _most(found, better, most):
            break
        found, better = with_losses_recounted(found, with_best_instant(found, better))
        if step == 0 and far(found, better) and not _told(better) and no_nearer(found, current, better):
            # neither one effect nor two come near the data, nor does any lead there
            return replace(found, final=better)
        again = _from_there(found, current, better)
        if again is not None:
            # it was not the effect that gained, but where its fit had started: from there the search goes on
            found = replace(found, final=again, base=again if step == 0 else found.base)
            continue
        if step >= 1 and far(found, better) and not _nearing(found, current, better):
            # two effects and still far from the data: none of these
            return replace(found, final=better)
        further = max(most, SELECTION.most_with_sensors) - step - 1
        if step >= 1 and past_hope(found, current, better, further):
            found, next_one = _in_stated_noise(found, better, step + 1)
            if next_one is None or past_hope(found, better, next_one, further - 1):
                return replace(found, final=better)
        found = _with_final(found, eliminated_backward(found, better, kept=better.hypothesis.candidates[-1]))
    return found


def _in_stated_noise(found: Search, current: ContinuousFit, step: int) -> tuple[Search, ContinuousFit | None]:
    """Return the best further effect of a fit whose estimated noise has swallowed some; None where it has not."""
    told = None if far(found, current) else without_swallowed(found, current)
    return (found, None) if told is None else next_effect(found, told, step)


def past_hope(found: Search, before: ContinuousFit, after: ContinuousFit, further: int) -> bool:
    """Tell whether so many ``further`` effects could not take away what an effect leaves.

    The largest comes first, so each takes about as much as the last at best, in noise that no misfit has inflated.
    """
    noise = uninflated_noise(found)
    was, left = (chi2_in(fitted, noise) - fitted.fit.count for fitted in (before, after))
    if before.fit.count != after.fit.count or left < (SELECTION.near - 1.0) * after.fit.count:
        return False
    return left > SELECTION.steps_alike * further * max(was - left, 0.0)


def without_swallowed(found: Search, fitted: ContinuousFit) -> ContinuousFit | None:
    """Return a fit in noise that has swallowed no effect; None where what was estimated has swallowed none.

    A bias is nothing but loud and slow noise: in it no bias is worth its price. Nor is noise that is so loud and leaves
    more than itself: such a group's is as stated. Where recordings have a course in common it is as the relaxed fit
    shows it, which follows the data.
    """
    left = unmodelled_residuals(fitted.fit.linears, fitted.residuals, fitted.fit.noise)
    stated = stated_noise(fitted.fit.linears)
    noise = {item.group: found.relaxed_noise[item.group] for item in left if item.kind == "course"}
    noise |= {
        item.group: stated[item.group]
        for item in left
        if item.kind == "swallowed" or fitted.fit.noise[item.group].sd > loudest(item.group, fitted.fit.linears)
    }
    if not noise:
        return None
    return replace(fitted, fit=replace(fitted.fit, noise={**fitted.fit.noise, **noise}))


def _most(found: Search, fitted: ContinuousFit, most: int) -> int:
    """Return how many effects a search for at most so many may come to from a fit: more of them errors of sensors."""
    if len(found.recordings) == 1 and plans_alone(found.recordings):
        # two curves in a plane take any two effects, and no other recording could bear them out
        return 1
    acting = [candidate.row.acts_on for candidate in fitted.hypothesis.candidates]
    # a stack of one sensor's errors stands for what is none of them
    stacked = acting.count("motion") >= UNKNOWN_LAW.stack or any(acting.count(one) >= most for one in acting)
    return most if stacked else max(most, SELECTION.most_with_sensors)


def _with_final(found: Search, fitted: ContinuousFit) -> Search:
    """Return a search with a fit as the final one so far."""
    return replace(found.with_step(fitted), final=fitted)


def settled(found: Search) -> Search:
    """Return a search whose effects are exchanged for rivals that explain more for their parameters."""
    if found.at_once:
        return found.about(found.final.fit)
    for exchanges in range(SELECTION.exchanges + 1):
        if (wide := widened(found, found.final)) is not found.final:
            found = _with_final(found, wide)
        if found.relaxed_fit.plant.weakly_identified and not lost(found, found.final):
            # what an effect gained upon a fit that stood beside its optimum, others gain without it
            found = without_superfluous(replace(found, final=eliminated_backward(found, found.final)))
        found = found.about(found.final.fit)
        # where the fit is far from the data nothing is named, and nothing need be told apart
        found = replace(found, rivals={} if lost(found, found.final) else rivals_of(found))
        better = exchanged(found)
        if better is None or exchanges == SELECTION.exchanges:
            break
        found = _with_final(found, better)
    return found


def _start(equations: NormalEquations, hypothesis: Hypothesis, own: Sequence[Parameter]) -> Start:
    """Return what algebra expects of a hypothesis's parameters."""
    taken = equations.columns_of(fitted_parameters(hypothesis, own))
    return start_of(taken, equations.solve(taken))


def _wobbles(fit: Fit) -> Start:
    """Return how the wobble of free spins dies and turns in a fit whose segments go with it.

    What algebra expects of it is far from linear where turning for a second makes a radian.
    """
    parameters = zip(fit.parameters, fit.at, strict=True)
    return {(q.key, q.recordings): float(v) for q, v in parameters if q.key in fit.plant.own_keys}


def _nearing(found: Search, before: ContinuousFit, after: ContinuousFit) -> bool:
    """Tell whether a further error of sensors, on none but such, leads much nearer to the data: a module has several.

    What acts on the motion is another matter: a stack of effects upon it stands for what is none of them.
    """
    of_sensors = all(candidate.row.acts_on != "motion" for candidate in after.hypothesis.candidates)
    return of_sensors and not no_nearer(found, before, after)


def _told(fitted: ContinuousFit | None) -> bool:
    """Tell whether a fit's last effect was found in the readings themselves and is in its trajectories."""
    return fitted is not None and bool(fitted.hypothesis.candidates[-1].fixed_values)


def _offers(found: Search, current: ContinuousFit, step: int) -> tuple[Search, list[Offer]]:
    """Return further effects that may be worth their price, those to be refitted first at the front."""
    distant = far(found, current)
    # what is asked of the relaxed fit, and of the present one
    there: list[Offer] = []
    here: list[Offer] = []
    if distant or step == 0:
        ranked = one_per_effect(screened_candidates(found.loose_board, found.candidates, current.hypothesis, found.own))
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
    for item in searched(found.relaxed_fit, current, found.own, steady_noise(found), found.lost_samples.found):
        if isinstance(item, Shifted):
            shown.append((item.screened, item.in_place_of(found.relaxed_fit), item.cost))
        elif current.hypothesis.candidates:
            here.append((item, found.relaxed_fit if distant else current.fit, 0.0))
        else:
            shown.append((item, found.relaxed_fit, 0.0))
    if not distant:
        # no more can be gained than is left: about segments that one recording has wrong algebra promises anything.
        # A limit at which readings stand moves nothing in a fit, and these readings are no part of what is left
        left = chi2_in(current, found.relaxed_noise)
        there, shown = ([offer for offer in some if in_chi2(offer) < left] for some in (there, shown))
    # what the two promise does not compare: far from the data they are asked in different noise, and near them the
    # segments of a fit that follows may promise much of a sensor that has nothing to gain
    there, shown, here = (
        [offer for offer in some if on_the_disc(found, offer[0].start)] for some in (there, shown, here)
    )
    # beside the data, where the slopes at hand promise nothing its price, what readings show comes before what other
    # slopes promise
    first = not distant and not in_turn(here)
    worth = in_turn(shown, there, here) if first else in_turn([*there, *shown], here)
    present = {candidate.id for candidate in current.hypothesis.candidates}
    told = [hint for hint in found.hints if hint.candidate.id not in present]
    # what a lag holds dies away too fast for slopes at no lag to tell
    told = [hint for hint in told if distant or hint.candidate.id == _HELD or _swallowed(current, hint)]
    worth = [*((hint, found.relaxed_fit, 0.0) for hint in told), *worth]
    return found, worth


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
        bars = _hopeless(best_chi2, current.fit.count) if distant else Bars(beside)
        refitted = joined(found, current, screened, bars) if distant and not cost else None
        if refitted is None:
            refitted = continuous_fit(
                fit,
                current.hypothesis.plus(screened.candidate),
                found.own,
                noise if distant else beside_noise,
                {**values_of_fit(current), **screened.start, **_wobbles(fit)},
                bars=bars,
            )
        if not distant and not cost and refitted.score > current.score + SELECTION.worse:
            refitted = _begun_again(found, current, screened, beside)
        refitted = replace(refitted, score=refitted.score + found.cost + cost)
        found = _considering(found, (current.score, chi2_now), refitted, screened.candidate)
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


def _most_refitted(current: ContinuousFit, near_data: bool, gained: bool) -> int:
    """Return how many candidates a step refits: few near the data, where one has gained or nothing but noise is left.

    While none has gained, those few of each of the two fits that are asked. Of noise that the relaxed fit shows too
    loud a small effect is near the data, and many promise more than it.
    """
    if near_data and not gained:
        near_data = not unmodelled_residuals(current.fit.linears, current.residuals, current.fit.noise)
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


def _hopeless(best: float, count: int) -> Bars:
    """Return the chi-squared above which a refit is of no use beside the best so far, of so many readings."""
    times = SELECTION.hopeless_near if best < SELECTION.far * count else SELECTION.hopeless
    return Bars(times * best, SELECTION.hopeless_held * best)


def _begun_again(found: Search, current: ContinuousFit, screened: ScreenedCandidate, bar: float) -> ContinuousFit:
    """Return a refit that begins where the present fit is, the further effect without a size yet.

    Of a direction that hardly shows, as a tilt square to the field, algebra may ask for any number.
    """
    shape_grid = {key: number for key, number in screened.start.items() if key[0][1] in screened.candidate.shape_grid}
    start = {**values_of_fit(current), **shape_grid}
    return continuous_fit(
        current.fit, current.hypothesis.plus(screened.candidate), found.own, current.fit.noise, start, bars=Bars(bar)
    )


def _considering(
    found: Search, before: tuple[float, float], refitted: ContinuousFit, candidate: CandidateEffect
) -> Search:
    """Return a search that knows what a candidate gains upon a fit of score and chi-squared ``before``."""
    score, chi2_before = before
    values = {
        q.name: float(v)
        for q, v in zip(refitted.fit.parameters, refitted.fit.at, strict=True)
        if q.group == candidate.id and q.recordings == candidate.recordings
    }
    gained = score - refitted.score, chi2_before - chi2_in(refitted, found.relaxed_noise)
    return replace(
        found, considered=(*found.considered, Considered(candidate, *gained, in_parameters(candidate.row, values)))
    )


def _together(found: Search) -> tuple[Search, ContinuousFit | None]:
    """Return the fit with the best two effects where it comes near the data, else None.

    Far from the data each of two effects alone may be fitted with numbers that serve for both, and a third may do
    better than either; algebra about the fit that follows the data tells both at once.
    """
    base, noise = found.base, found.relaxed_noise
    before = base.score, chi2_in(base, noise)
    ranked = pairs(found.loose_board, found.candidates, found.own)
    sensible = [pair for pair in ranked if on_the_disc(found, pair.start)]
    chosen = sensible[: SELECTION.pairs_refitted]
    for number, pair in enumerate(chosen):
        refitting("refitting with two", " and ".join(c.id for c in pair.hypothesis.candidates), number, len(chosen))
        start = {**pair.start, **_wobbles(found.relaxed_fit)}
        # it counts only where it comes near the data
        both = continuous_fit(
            found.relaxed_fit,
            pair.hypothesis,
            found.own,
            noise,
            start,
            bars=Bars(SELECTION.hopeless * SELECTION.far * found.base.fit.count),
        )
        both = replace(both, score=both.score + found.cost)
        for candidate in pair.hypothesis.candidates:
            found = _considering(found, before, both, candidate)
        worth = base.score - both.score > sum(map(price, pair.hypothesis.candidates))
        if worth and possible(both) and not far(found, both):
            return found, both
    return found, None


def _with_lost_samples(found: Search, current: ContinuousFit) -> Search:
    """Return a search that knows what samples were lost as its relaxed fit tells them, but for those that are taken."""
    known = [q for q in found.own if q.key not in found.relaxed_fit.plant.own_keys]
    taken = {candidate.id for candidate in current.hypothesis.candidates}
    lost = found.lost_samples.about(found.relaxed_fit, known, lambda: steady_noise(found), taken)
    return replace(found, lost_samples=lost)


def _from_there(found: Search, current: ContinuousFit, better: ContinuousFit) -> ContinuousFit | None:
    """Return the fit without the last effect from where that with it stands, if then the effect is not worth its price.

    None where it is, or where it gains so much that no start could: then its size in its own standard deviations,
    squared, is of the order of what it gains.
    """
    candidate = better.hypothesis.candidates[-1]
    if candidate.fixed_values:
        return None
    gain = current.score - better.score
    doubted = found.relaxed_fit.plant.weakly_identified and gain <= SELECTION.doubtful
    if not doubted and better.squared_sizes(candidate) > SELECTION.borne_out * gain:
        return None
    start = values_of_fit(better)
    again = continuous_fit(better.fit, current.hypothesis, found.own, better.fit.noise, start)
    again = replace(again, score=again.score + found.cost)
    return again if again.score - better.score < price(candidate) else None
