"""One call from data sets to an outcome."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from discsim.effects.own import UserEffect
from discsim.recording import Recording
from validation.diagnosis.assemble import assemble
from validation.diagnosis.consistency.early_verdict import Contradiction, contradiction_after, contradiction_in
from validation.diagnosis.consistency.spin_agreement import agreement_of
from validation.diagnosis.contradicted import contradicted_outcome
from validation.diagnosis.datasets import recording_names
from validation.diagnosis.design.next_recording import advise
from validation.diagnosis.inertia import with_inertia
from validation.diagnosis.prepared import prepared
from validation.diagnosis.relaxed_fit import relaxed
from validation.diagnosis.result import Outcome
from validation.diagnosis.selection.found import Search
from validation.diagnosis.selection.stepwise import search
from validation.diagnosis.setup import SetupFindings, find_setup_faults, with_likeliest_fault
from validation.diagnosis.setup_effects import free_parameters, with_reversed_axes, with_setup
from validation.diagnosis.unknown_law.find import find_law
from validation.diagnosis.verdict import verdict_of
from validation.identification.competing_effects import competing, row_of
from validation.identification.gauss_newton import Fit
from validation.identification.plants.plan import Plan
from validation.identification.stated_parameters import stated_parameters

__all__ = ["diagnose"]


def _silent(stage: str, done: int, total: int) -> None:
    del stage, done, total


#: so many effects on the motion may be a bad copy of something that is none of them
_STACK = 2


def _stacked(found: Search) -> bool:
    """Tell whether several effects on the motion were found, so that one law is worth comparing with them."""
    rows = [row_of(trial.id) for trial in found.final.hypothesis.trials]
    return sum(row is not None and row.acts_on == "motion" and not row.brief for row in rows) >= _STACK


@dataclass(frozen=True)
class _Begun:
    """Recordings before a search: as they were ``meant``, what is ``fitted``, the relaxed fit, and what must be known.

    ``contradiction`` is why no search begins, where none does; ``followed`` is there where one does.
    """

    setup: SetupFindings
    meant: list[Recording]
    fitted: list[Recording]
    notes: list[str]
    followed: Fit | None
    contradiction: Contradiction | None


def _begun(setup: SetupFindings, called: Sequence[str], progress: Callable[[str, int, int], None]) -> _Begun:
    """Follow recordings as a setup says that they were meant, or find that their sensors contradict one another."""
    meant, warnings = prepared(list(setup.recordings), called)
    fitted, notes = with_inertia(meant)
    known = (*stated_parameters(fitted), *free_parameters(setup))
    progress("asking whether sensors contradict one another", 0, 5)
    followed, contradiction = None, contradiction_in(fitted, known)
    if contradiction is None:
        progress("following the data", 1, 5)
        followed = relaxed(fitted, known)
        contradiction = contradiction_after(followed)
    return _Begun(setup, meant, fitted, [*warnings, *notes], followed, contradiction)


def _found(begun: _Begun, progress: Callable[[str, int, int], None]) -> Search:
    """Return the search from where recordings are followed."""
    free, hints = free_parameters(begun.setup), begun.setup.hints
    return search(begun.fitted, progress, begun.meant, begun.followed, free, hints)


def diagnose(
    datasets: Sequence[Sequence[Recording]],
    names: Sequence[str],
    *,
    progress: Callable[[str, int, int], None] = _silent,
    seed: int = 0,
    user_effects: Sequence[UserEffect] = (),
    plans: Sequence[Plan] | None = None,
) -> Outcome:
    """Tell whether the baseline explains recordings of one plant, and if not what was left out.

    ``datasets`` are sets of recordings that share their hardware, ``names`` what to call the sets; ``progress`` is
    called with a stage, steps done and steps in all. ``user_effects`` compete with the catalogue's. ``plans`` are the
    recordings that could be made where effects cannot be told apart, by default such as are made easily.
    """
    recordings = [recording for dataset in datasets for recording in dataset]
    called = [name for group in recording_names(datasets, names) for name in group]
    progress("checking the setup", 0, 5)
    setup = find_setup_faults(recordings)
    with competing(user_effects):
        begun = _begun(setup, called, progress)
        if begun.contradiction is not None and (further := with_likeliest_fault(setup)) is not None:
            # a fault that other physics hides from the relations between sensors is told by what follows them then
            again = _begun(further, called, progress)
            begun = again if again.contradiction is None else begun
        setup, meant, fitted = begun.setup, begun.meant, begun.fitted
        if begun.contradiction is not None:
            outcome = contradicted_outcome(begun.contradiction, meant, names, called, seed)
            outcome = with_setup(outcome, setup, recordings, None)
            return _with_notes(outcome, begun.notes, meant, called)
        found = _found(begun, progress)
        if (mirrored := with_reversed_axes(setup, found.final.fit)) is not None:
            again = _begun(mirrored, called, progress)
            if again.contradiction is None:
                begun, found = again, _found(again, progress)
                setup, meant, fitted = begun.setup, begun.meant, begun.fitted
        law = None
        verdict, unexplained = verdict_of(found)
        if unexplained or _stacked(found):
            progress("looking for a law", 4, 5)
            law = find_law(found.loose, found.final, found.own, found.loose_noise, fitted)
        advice = {}
        if verdict == "explained" and law is None:
            progress("asking what to record next", 4, 5)
            advice = advise(found, called, plans)
        outcome = assemble(found, names, called, seed, law, advice)
    outcome = with_setup(outcome, setup, recordings, found.final.fit)
    return _with_notes(outcome, begun.notes, meant, called)


def _with_notes(
    outcome: Outcome, warnings: Sequence[str], recordings: Sequence[Recording], names: Sequence[str]
) -> Outcome:
    """Return an outcome with what the reader must know of the recordings (called ``names``) and their sensors."""
    said = (*outcome.diagnosis.warnings, *warnings)
    agreement = agreement_of(recordings, names)
    return replace(outcome, diagnosis=replace(outcome.diagnosis, warnings=said, agreement=agreement))
