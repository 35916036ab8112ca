"""One call from data sets to an outcome, through the stages of `discsim.validation.diagnosis.stages`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discsim.effects.own import UserEffect
from discsim.errors import InputError
from discsim.recording import Recording
from discsim.validation.diagnosis.assemble import outcome_of
from discsim.validation.diagnosis.bent_segments import with_bends_followed
from discsim.validation.diagnosis.candidates.candidate import stand_ins
from discsim.validation.diagnosis.consistency.spin_agreement import agreement_of, compared
from discsim.validation.diagnosis.datasets import recording_names, recordings_of
from discsim.validation.diagnosis.detectors.row_times import row_times
from discsim.validation.diagnosis.early_verdict import contradiction_after, contradiction_in
from discsim.validation.diagnosis.inertia import with_inertia
from discsim.validation.diagnosis.misstated import reconciling
from discsim.validation.diagnosis.prepared import prepared
from discsim.validation.diagnosis.progress import Progress, silent
from discsim.validation.diagnosis.refuted import without_refuted
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.relaxed_fit.out_of_balance import moves_out
from discsim.validation.diagnosis.result import Outcome
from discsim.validation.diagnosis.selection.event_instants import with_instants_weighed
from discsim.validation.diagnosis.selection.one_board import with_one_board
from discsim.validation.diagnosis.selection.refits import told_to
from discsim.validation.diagnosis.selection.refitted_out_of_balance import refitted_out_of_balance
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.selection.stepwise import Anew, search
from discsim.validation.diagnosis.selection.turned_or_iron import with_iron_weighed
from discsim.validation.diagnosis.setup import SetupFindings, find_setup_faults, with_turned_board
from discsim.validation.diagnosis.setup_effects import free_parameters
from discsim.validation.diagnosis.stages import Prepared, Question, Tried
from discsim.validation.diagnosis.suppositions import SUPPOSITIONS, Supposition
from discsim.validation.diagnosis.unknown_law.find import FoundLaw, LawOfAll, find_law, one_more_does_as_well
from discsim.validation.diagnosis.verdict import judged, leaves_more_than_noise
from discsim.validation.identification.competing_effects import Competing
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.plants.plan import Plan
from discsim.validation.identification.stated_parameters import stated_parameters

__all__ = ["diagnose", "prepared_under", "tried_under", "tried_with", "under_suppositions"]


# far from the data a motion may run beyond all numbers, in a search and in what is told of its answer
@np.errstate(over="ignore", invalid="ignore")
def diagnose(
    datasets: Sequence[Sequence[Recording]],
    names: Sequence[str],
    *,
    progress: Progress = silent,
    seed: int = 0,
    user_effects: Sequence[UserEffect] = (),
    plans: Sequence[Plan] | None = None,
) -> Outcome:
    """Tell whether the baseline explains recordings of one plant, and if not what was left out.

    ``datasets`` are sets of recordings that share their hardware, ``names`` what to call the sets; ``progress`` is
    called with a stage, steps done and steps in all. ``user_effects`` compete with the catalogue's. ``plans`` are the
    recordings that could be made where effects cannot be told apart, by default such as are made easily. Raises
    `InputError` where recordings cannot be diagnosed, which names what is wrong with which.
    """
    recordings = recordings_of(datasets)
    called = tuple(name for group in recording_names(datasets, names) for name in group)
    question = Question(recordings, called, tuple(names), Competing(tuple(user_effects)), plans, seed, progress)
    with told_to(progress):
        progress("checking the setup", 0, 5)
        tried = tried_with(_prepared_first(question), question)
        tried = under_suppositions(tried, question)
        tried = _with_numbers(_with_law_of_one(tried, question), question)
        if tried.found is not None and tried.law is None:
            tried = replace(tried, found=with_instants_weighed(without_refuted(tried.found)))
        return outcome_of(judged(tried, progress), question)


def tried_under(setup: SetupFindings, question: Question) -> Tried:
    """Return recordings tried under a setup: effects are searched, unless their sensors contradict one another."""
    return tried_with(prepared_under(setup, question), question)


def under_suppositions(tried: Tried, question: Question, suppositions: Sequence[Supposition] = SUPPOSITIONS) -> Tried:
    """Return what was tried, or tried anew under what it lets one suppose of the setup where that stands.

    Recordings of which nothing is left under a supposition are no ground to give up what was found without it.
    """
    for suppose, stands in suppositions:
        supposed = suppose(tried, question)
        if supposed is None:
            continue
        try:
            again = tried_under(supposed, question)
        except InputError:
            continue
        tried = again if stands(again, tried) else tried
    return tried


def _with_law_of_one(tried: Tried, question: Question) -> Tried:
    """Return what was tried with a law where that is all by which one sensor contradicts the others.

    A strong magnet that turns, or the field of a mains cable, is many times a magnetometer's noise; a wrong column, or
    a sensor of another throw, follows no formula.
    """
    contradiction, ready = tried.contradiction, tried.prepared
    if contradiction is None or contradiction.lost or len(contradiction.against) != 1:
        return tried
    question.progress("looking for a law", 4, 5)
    begun, law = _law_before_effects(_without_hints(ready, question))
    if law is None or law.law.target.partition(".")[0] not in contradiction.against:
        return tried
    return Tried(ready, None, begun, law) if law.explains_all else tried


def _without_hints(ready: Prepared, question: Question) -> SearchProblem:
    """Return the problem of recordings of which no sensor has told anything before a fit."""
    free = free_parameters(ready.setup)
    return SearchProblem(ready.fitted, as_stated=ready.meant, free=free, effects=question.effects)


def _with_numbers(tried: Tried, question: Question) -> Tried:
    """Return what was tried with the stated numbers under which sensors would not contradict one another."""
    ready = tried.prepared
    if tried.contradiction is None or "gyroscope" not in tried.contradiction.blamed or ready.rows is not None:
        return tried
    numbers = reconciling(_without_hints(ready, question), lambda found: not leaves_more_than_noise(found))
    return replace(tried, misstated=(numbers,)) if numbers else tried


def _prepared_first(question: Question) -> Prepared:
    """Return recordings as they were meant by the faults of their setup.

    Where rows must be counted no relation tells that a board is turned: it is where its spin is seen aslant and rows
    are counted along its axes. On a rig, whose axis stands still, a spin that is seen aslant is enough. Raises
    `InputError` for a rate reference that the sensors beside it contradict.
    """
    setup = find_setup_faults(question.recordings)
    if setup.doubts:
        raise InputError(setup.doubts[0])
    turned = with_turned_board(setup)
    try:
        ready = None if turned is None else prepared_under(turned, question)
        if ready is not None and (ready.rows is not None or not plant_of(ready.meant[0]).airborne):
            return ready
        return prepared_under(setup, question)
    except InputError as error:
        if not setup.faults:
            raise
        told = "; ".join(fault.sentence for fault in setup.faults)
        raise InputError(f"{str(error).rstrip('.')}. Found before, and allowed for in this: {told}") from None


def tried_with(ready: Prepared, question: Question) -> Tried:
    """Return recordings that are ready for a fit as tried: as `tried_under`, which prepares them."""
    progress, setup = question.progress, ready.setup
    free = free_parameters(setup)
    if ready.rows is not None:
        free += tuple(q for q in ready.rows.free if q.key not in {known.key for known in free})
    known = (*stated_parameters(ready.fitted), *free)
    progress("asking whether sensors contradict one another", 0, 5)
    contradiction = contradiction_in(ready.fitted, known)
    if contradiction is not None:
        return Tried(ready, contradiction)
    progress("following the data", 1, 5)
    followed = relaxed(ready.fitted, known, agreeing=ready.agreeing, supposed=ready.supposed)
    contradiction = contradiction_after(followed)
    if contradiction is not None:
        return Tried(ready, contradiction)
    law_of_all = LawOfAll()
    problem = SearchProblem(
        ready.fitted,
        as_stated=ready.meant,
        followed=followed,
        free=free,
        hints=(*ready.supposed, *setup.hints),
        effects=question.effects,
        progress=progress,
        law=law_of_all,
    )
    begun: Search | None = None
    if ready.rows is None and moves_out(followed):
        begun, law = _law_before_effects(problem, moving=True)
        if law is not None and not one_more_does_as_well(begun, law):
            return Tried(ready, None, begun, law)
    found = search(problem, begun=begun)
    if law_of_all.found is not None:
        return Tried(ready, None, found.at_base(), law_of_all.found)
    if ready.rows is not None:  # no bent segments there: defects of continuity are wide, and the pure error is known
        found = with_iron_weighed(with_one_board(refitted_out_of_balance(found)))
    elif followed.plant.weakly_identified:
        found = _with_bends(found, followed, problem)
    return Tried(ready, None, found)


def _law_before_effects(problem: SearchProblem, *, moving: bool = False) -> tuple[Search, FoundLaw | None]:
    """Return where a search would begin, and the law found there without searching effects; None where none holds.

    ``moving`` is whether something moves out in the bodies: but for a drift no effect of the catalogue does.
    """
    begun = screened(problem)
    problem.progress("looking for a law", 4, 5)
    return begun, find_law(begun, moves_out=moving)


#: rounds in which segments are halved where the air's moment bends within them
_BENDS = 2


def _with_bends(found: Search, followed: Fit, problem: SearchProblem) -> Search:
    """Return the search of free spins with bent segments halved, where it named effects or leaves more than noise.

    ``followed`` is the relaxed fit that it began with. A search in halved segments begins with the effects of the one
    before, where these leave no more than noise. Bends may stand in for what a search named, or hide one thing more: a
    stack of effects beside them copies what nobody knows. Effects that stand for what is not stated are no such stack.
    """
    unstated = {candidate.id for candidate in stand_ins(found.recordings)}

    def errors(of: Search) -> int:
        return sum(candidate.id not in unstated for candidate in of.final.hypothesis.candidates)

    for _ in range(_BENDS):
        left = leaves_more_than_noise(found)
        bent = with_bends_followed(found, followed) if left or found.final.hypothesis.candidates else None
        if bent is None:
            break
        most = 1 if left else errors(found)
        again = search(replace(problem, followed=bent), Anew(most + len(unstated), None if left else found))
        if errors(again) > most or (leaves_more_than_noise(again) and not left):
            break
        followed, found = bent, again
    return found


def prepared_under(setup: SetupFindings, question: Question) -> Prepared:
    """Return recordings as a setup says that they were meant, as a fit can use them."""
    meant, warnings = prepared(setup.recordings, question.names)
    agreeing = compared(meant, question.names)
    agreement = agreement_of(meant, question.names, agreeing)
    rows = row_times(meant, question.names, agreement)
    timed = meant
    if rows is not None:
        # rates of the times as written would have the fit undo what was counted
        timed = rows.applied(meant)
        agreeing = compared(timed, question.names)
    fitted, notes = with_inertia(timed)
    return Prepared(setup, tuple(meant), tuple(fitted), (*warnings, *notes), agreeing, agreement, rows)
