"""What is doubtful before flights are fitted or flown: setup faults, mended, and stated numbers that cannot be."""

from __future__ import annotations

from collections.abc import Sequence

from discsim.recording import Recording
from discsim.validation.checking.paths import path_findings
from discsim.validation.checking.statements import statement_findings
from discsim.validation.diagnosis.setup import find_setup_faults, setup_notes

__all__ = ["mended_flights"]


def mended_flights(
    recordings: Sequence[Recording], *, done: str, passed: Sequence[str] = ()
) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Return flights of one hardware with their setup faults mended, and what a reader must know of them, a line each.

    ``done`` says what is done with the readings (``"fitted"``); findings whose ids are ``passed`` are not told.
    """
    setup = find_setup_faults(recordings)
    notes = setup_notes(setup, f"{done} are")
    told: dict[str, list[str]] = {}
    for one in setup.recordings:
        for finding in (*statement_findings(one), *path_findings(one)):
            if finding.severity != "note" and finding.id not in passed:
                told.setdefault(finding.sentence, []).append(one.name)
    notes += [f"{_named(names, len(recordings))}{sentence}" for sentence, names in told.items()]
    return tuple(setup.recordings), tuple(notes)


def _named(names: Sequence[str], count: int) -> str:
    """Return the names of recordings before a sentence about them; empty where it is about all that there are."""
    return "" if len(names) == count else f"{', '.join(names)}: "
