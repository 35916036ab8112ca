"""Effects that stand for nothing: those that recordings disagree about, and what lost samples leave of a clock.

Takes what a search found; gives it without those that gain little, where no more than noise is left without them.
"""

from __future__ import annotations

from dataclasses import replace

from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.candidates.own_sizes import own_sizes
from discsim.validation.diagnosis.detectors.even_losses import lost_as_well, rather_lost
from discsim.validation.diagnosis.selection.all_at_once import worth_of_each
from discsim.validation.diagnosis.selection.exchange import rivals_of, tried_without
from discsim.validation.diagnosis.selection.held_out import choices_without_each, heldout_gain
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.diagnosis.verdict import leaves_more_than_noise
from discsim.validation.identification.gauss_newton import penalty_of

__all__ = ["without_refuted"]


def without_refuted(found: Search) -> Search:
    """Return a search without its effects of little gain that stand for nothing.

    Recordings set aside speak against one: each wants another number of it, and the others' makes it worse. Or each
    wants another by more than its error. Or it is of a sensor whose samples were lost, told as a slow clock: losses
    come at random, and it takes up what the clock leaves of them. Or it gains by what a model of the air is spared, and
    not by readings. It stays where more than noise is left without it.
    """
    for refuted in (_refuted, _of_many_sizes, _left_by_losses, _sparing_the_air):
        while (less := refuted(found)) is not None:
            bare = replace(found.with_step(less), final=less).about(less.fit)
            if leaves_more_than_noise(bare):
                break
            found = replace(bare, rivals=rivals_of(bare))
    return found


def _left_by_losses(found: Search) -> ContinuousFit | None:
    """Return the fit without an effect of a sensor that lost samples, told as a slow clock; None for none.

    A walk of random losses wanders about the line of a clock, and what that leaves may pass for a bias or a drift: one
    of little gain, or of no more than is gained where each recording has a clock of its own.
    """
    final = found.final
    slow = [] if found.at_once else [t for t in final.hypothesis.candidates if lost_as_well(final.fit, t) is not None]
    best: tuple[float, ContinuousFit] | None = None
    for clock in slow:
        lossy = rather_lost(final.fit, clock) is not None
        for t in final.hypothesis.candidates:
            if t.row.acts_on != clock.row.acts_on or t in slow or t.fixed_values:
                continue
            less = tried_without(found, t)
            gain = final.gain_upon(less)
            if (lossy and gain < SELECTION.refuted * price(t)) or _walks(less, clock, gain):
                best = min((gain, less), best or (gain, less), key=lambda item: item[0])
    return None if best is None else best[1]


def _walks(fitted: ContinuousFit, clock: CandidateEffect, gain: float) -> bool:
    """Tell whether recordings with clocks of their own gain most of a ``gain``, as losses at random make them."""
    sizes = own_sizes(fitted.fit, clock)
    return sizes.chance < SELECTION.unlike and sizes.gain > SELECTION.borne_out * gain


def _refuted(found: Search) -> ContinuousFit | None:
    """Return the fit without the effect of little gain that loses most on recordings set aside; None for none."""
    of_little = _of_little_gain(found)
    if not of_little:
        return None
    less = {t.name: tried_without(found, t) for t in of_little}
    choices = choices_without_each(found, less)
    gains = {t.name: heldout_gain(found, t, choices) for t in of_little}
    against = {name: gain for name, gain in gains.items() if gain is not None and gain < 0.0}
    return less[min(against, key=lambda name: against[name])] if against else None


def _of_many_sizes(found: Search) -> ContinuousFit | None:
    """Return the fit without the effect of little gain whose size differs most between recordings; None for none.

    What a part or a disc has it has in all: what each recording asks for in another size stands for something else, as
    for what a wobble across a corner of the air's moments leaves of them.
    """
    chances = [(own_sizes(found.final.fit, t).chance, t) for t in _of_little_gain(found) if t.recordings is None]
    unlike = [(chance, t) for chance, t in chances if chance < SELECTION.unlike]
    return tried_without(found, min(unlike, key=lambda item: item[0])[1]) if unlike else None


def _sparing_the_air(found: Search) -> ContinuousFit | None:
    """Return the fit without an effect on a free spin's motion of which the readings gain least; None for none.

    Nobody knows the air's moments there: a fit is charged for how they wander, by ordinary sizes, and the true ones may
    go together as an effect would have them. What an effect gains of these charges is no evidence; its price must be
    gained by the readings themselves.
    """
    if not found.final.fit.plant.weakly_identified or found.at_once:
        return None
    on_motion = [t for t in found.final.hypothesis.candidates if t.row.acts_on == "motion" and not t.row.event]
    less = [(t, tried_without(found, t)) for t in on_motion]
    gains = [(_by_readings(one) - _by_readings(found.final) - price(t), one) for t, one in less]
    least = min(gains, key=lambda item: item[0], default=None)
    return None if least is None or least[0] > 0.0 else least[1]


def _by_readings(fitted: ContinuousFit) -> float:
    """Return the score of a fit without what it is charged beside its readings."""
    return fitted.score - penalty_of(fitted.fit, fitted.fit.linears)


def _of_little_gain(found: Search) -> list[CandidateEffect]:
    """Return the effects of little gain, where recordings can disagree and no more than noise is left."""
    candidates = found.final.hypothesis.candidates
    if found.at_once or len(found.recordings) < 2 or leaves_more_than_noise(found):
        return []
    worth = worth_of_each(found.equations, candidates, found.own)
    return [t for t in candidates if not t.fixed_values and worth[t.name] < SELECTION.refuted * price(t)]
