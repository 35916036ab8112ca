"""Stepwise forward selection: from the relaxed fit to the smallest set of effects that leaves nothing but noise.

Takes recordings; gives a `Search`. Score tests about a fit that follows the data screen candidates; each that matters
is refitted with continuity enforced, and believed only if it gains more than its penalty by the likelihood, with the
noise estimated anew (stepwise regression: Efroymson, 1960).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from discsim.effects.kind import BOARD
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.candidates.score_tests import plans_alone
from discsim.validation.diagnosis.first_trajectory import time_ratio
from discsim.validation.diagnosis.selection.all_at_once import all_at_once
from discsim.validation.diagnosis.selection.each_its_own import with_own_sizes
from discsim.validation.diagnosis.selection.event_instants import with_best_instant
from discsim.validation.diagnosis.selection.exchange import (
    eliminated_backward,
    exchanged,
    rivals_of,
    widened,
    without_superfluous,
)
from discsim.validation.diagnosis.selection.next_effect import next_effect, next_two
from discsim.validation.diagnosis.selection.recounting import with_losses_recounted
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import (
    Search,
    chi2_in,
    far,
    no_nearer,
    possible,
    unreliable,
    values_of_fit,
)
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.selection.uninflated_noise import spoilt_groups, uninflated_noise
from discsim.validation.diagnosis.settings import SELECTION, UNKNOWN_LAW
from discsim.validation.identification.noise import stated_noise
from discsim.validation.identification.residual_tests import loudest

__all__ = ["Anew", "past_hope", "search", "settled", "without_swallowed"]

#: effects that are taken over from one search to the next, at most: two may be hidden
_FEW = 2


class Anew(NamedTuple):
    """How recordings are searched anew in other segments: what was found ``before``, how many effects are ``of_use``.

    The caller takes no stack of more effects than that; None where any number will do.
    """

    of_use: int | None = None
    before: Search | None = None


_FROM_NOTHING = Anew()


# a hypothesis far from the data may send a motion beyond all numbers: such a fit is not finite, and is passed over
@np.errstate(over="ignore", invalid="ignore")
def search(problem: SearchProblem, anew: Anew = _FROM_NOTHING, begun: Search | None = None) -> Search:
    """Find the effects that explain recordings of one plant.

    A search ``anew`` begins with the effects that one before it found, where they are worth their price here, too. It
    is given up as it stands once it has come to two effects more than are of use. ``begun`` is where it begins, where
    that is known (`screened`).
    """
    of_use, before = anew
    found = screened(problem, before) if begun is None else begun
    problem.progress("refitting candidates", 3, 4)
    law = problem.law if before is None else None
    found = _selected_forward(found if before is None else _taken_over(found, before), of_use, law)
    found = found if _of_no_use(found, of_use) else settled(found)
    problem.progress("done", 4, 4)
    return found


def _taken_over(found: Search, before: Search) -> Search:
    """Return a search that begins with the effects of one in other segments, where each is worth its price here, too.

    It begins without any where those are many: a stack that only together stands for something. So it does where
    clocks or lost samples go with them, and where they gain less than their price.
    """
    known = before.final
    retimed = any(time_ratio(known.fit.values(i)) != 1.0 for i in range(len(known.fit.trajectories)))
    told = any(candidate.fixed_values for candidate in known.hypothesis.candidates)
    if not 1 <= len(known.hypothesis.candidates) <= _FEW or retimed or told or before.at_once:
        return found
    cut = known.fit.cut_at([one.nodes for one in found.relaxed_fit.trajectories])
    pairs = zip(found.relaxed_fit.trajectories, cut.trajectories, strict=True)
    start = replace(cut, trajectories=tuple(replace(one, states=other.states) for one, other in pairs))
    fitted = continuous_fit(start, known.hypothesis, found.own, found.relaxed_noise, values_of_fit(known))
    if not possible(fitted) or far(found, fitted):
        return found
    fitted = eliminated_backward(found, fitted)
    worth = fitted.gain_upon(found.base) > sum(map(price, fitted.hypothesis.candidates))
    return _with_final(found, fitted) if worth else found


def _of_no_use(found: Search, of_use: int | None) -> bool:
    """Tell whether a search has come to more effects than elimination is likely to bring down to those of use."""
    return of_use is not None and len(found.final.hypothesis.candidates) >= of_use + 2


def _selected_forward(found: Search, of_use: int | None, law: Callable[[Search], bool] | None = None) -> Search:
    """Return the search with effects added as long as one is worth its price, and no ``law`` explains all at once."""
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
            found, both = next_two(found, better)
            if both is not None:
                found = _with_final(found, eliminated_backward(found, both))
                continue
        if better is None or len(better.hypothesis.candidates) > _most(found, better, most):
            break
        if step == 0 and law is not None and _leaves_much_of_a_sensor(found, better):
            beside = replace(found, final=better)
            if law(beside):
                return beside
        better = with_own_sizes(found, with_best_instant(found, better))
        found, better = with_losses_recounted(found, better)
        if step == 0 and far(found, better) and not _told(better) and no_nearer(found, current, better):
            # neither one effect nor two come near the data, nor does any lead there
            return replace(found, final=better)
        again = _from_there(found, current, better)
        if again is not None:
            # it was not the effect that gained, but where its fit had started: from there the search goes on
            found = replace(_with_final(found, again), base=again if step == 0 else found.base)
            continue
        if step >= 1 and far(found, better) and not _nearing(found, current, better):
            # two effects and still far from the data: none of these
            return replace(found, final=better)
        further = max(most, SELECTION.most_with_sensors) - step - 1
        if step >= 1 and past_hope(found, current, better, further):
            found, next_one = _in_stated_noise(found, better, step + 1)
            if next_one is None or past_hope(found, better, next_one, further - 1):
                return replace(found, final=better)
        found = _with_final(found, eliminated_backward(found, better, kept=better.hypothesis.candidates[-1:]))
    return found


def _leaves_much_of_a_sensor(found: Search, fitted: ContinuousFit) -> bool:
    """Tell whether an error of a sensor leaves much, in noise that no misfit has inflated, of what none explains.

    Even the relaxed fit, in which ordinary errors of sensors stand, misses that sensor's readings then: a play looks
    like a lag, and each further error takes some of it away, for twenty minutes. In free spins a law takes as long.
    """
    acts_on = fitted.hypothesis.candidates[-1].row.acts_on
    if acts_on not in BOARD or found.relaxed_fit.plant.weakly_identified or _told(fitted):
        return False
    spoilt = {group.partition(".")[0] for group in spoilt_groups(found)}
    return spoilt == {acts_on} and chi2_in(fitted, uninflated_noise(found)) > SELECTION.followed * fitted.fit.count


def _in_stated_noise(found: Search, current: ContinuousFit, step: int) -> tuple[Search, ContinuousFit | None]:
    """Return the best further effect of a fit whose estimated noise has swallowed some; None where it has not."""
    told = None if far(found, current) else without_swallowed(found, current)
    return (found, None) if told is None else next_effect(found, told, step)


def past_hope(found: Search, before: ContinuousFit, after: ContinuousFit, further: int) -> bool:
    """Tell whether so many ``further`` effects are too few to take away what an effect leaves.

    The largest comes first, so that each takes at best about as much as the last, in noise that no misfit has inflated.
    """
    noise = uninflated_noise(found)
    was, left = (chi2_in(fitted, noise) - fitted.fit.count for fitted in (before, after))
    if before.fit.count != after.fit.count or left < (SELECTION.near - 1.0) * after.fit.count:
        return False
    return left > SELECTION.steps_alike * further * max(was - left, 0.0)


def without_swallowed(found: Search, fitted: ContinuousFit) -> ContinuousFit | None:
    """Return a fit in noise that has swallowed no effect; None where its estimated noise has swallowed none.

    To a noise model a bias is loud, slow noise, in which no bias is worth its price. The noise of a group that is so
    loud, or louder than any part's, is taken as stated. Where recordings have a trend in common it is as the relaxed
    fit shows it, which follows the data.
    """
    left = fitted.unmodelled()
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
    """Return how many effects a search may come to: ``most``, and more where they are errors of several sensors."""
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
        if found.relaxed_fit.plant.weakly_identified and not unreliable(found, found.final):
            # what an effect gained upon a fit that stood beside its optimum, others gain without it
            found = without_superfluous(replace(found, final=eliminated_backward(found, found.final)))
        found = found.about(found.final.fit)
        # where the fit is far from the data nothing is named, and nothing need be told apart
        found = replace(found, rivals={} if unreliable(found, found.final) else rivals_of(found))
        better = exchanged(found)
        if better is None or exchanges == SELECTION.exchanges:
            break
        found = _with_final(found, better)
    return found


def _nearing(found: Search, before: ContinuousFit, after: ContinuousFit) -> bool:
    """Tell whether a further error of sensors, on none but such, leads much nearer to the data: a module has several.

    What acts on the motion is another matter: a stack of effects upon it stands for what is none of them.
    """
    of_sensors = all(candidate.row.acts_on != "motion" for candidate in after.hypothesis.candidates)
    return of_sensors and not no_nearer(found, before, after)


def _told(fitted: ContinuousFit | None) -> bool:
    """Tell whether a fit's last effect was found in the readings themselves, so that its trajectories hold it."""
    return fitted is not None and bool(fitted.hypothesis.candidates[-1].fixed_values)


def _from_there(found: Search, current: ContinuousFit, better: ContinuousFit) -> ContinuousFit | None:
    """Return the fit without the last effect, begun where the fit with it ended, if that makes the effect superfluous.

    None where the effect is still worth its price. Nor is it asked where no better start could explain the gain: where
    the effect's size in its own standard deviations, squared, is of the order of what it gains.
    """
    candidate = better.hypothesis.candidates[-1]
    if candidate.fixed_values:
        return None
    gain = better.gain_upon(current)
    doubted = found.relaxed_fit.plant.weakly_identified and gain <= SELECTION.doubtful
    if not doubted and better.squared_sizes(candidate) > SELECTION.borne_out * gain:
        return None
    start = values_of_fit(better)
    again = found.with_cost(continuous_fit(better.fit, current.hypothesis, found.own, better.fit.noise, start))
    return again if better.gain_upon(again) < price(candidate) else None
