"""What is doubtful before flights are fitted or flown: setup faults, mended, and stated numbers that cannot be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from discsim.recording import Recording
from discsim.validation.checking.failed_readings import failed_findings
from discsim.validation.checking.finding import Finding, doubts_of
from discsim.validation.checking.paths import path_findings
from discsim.validation.checking.statements import statement_findings
from discsim.validation.diagnosis.setup import find_setup_faults, setup_notes
from discsim.validation.diagnosis.setup.units import clock_unit
from discsim.written import corrected

__all__ = ["mended_flights", "reading_doubts"]


def mended_flights(
    recordings: Sequence[Recording], *, done: str, passed: Sequence[str] = ()
) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Return flights of one hardware with their setup faults mended, and what a reader must know of them, a line each.

    ``done`` says what is done with the readings (``"fitted"``); findings whose ids are ``passed`` are not told.
    """
    setup = find_setup_faults(recordings)
    notes = setup_notes(setup, f"{done} are")
    found = [[finding for finding in _findings(one) if finding.id not in passed] for one in setup.recordings]
    notes += _told_once([doubts_of(own) for own in found], [one.name for one in setup.recordings])
    return tuple(setup.recordings), tuple(notes)


def reading_doubts(recordings: Sequence[Recording], names: Sequence[str]) -> tuple[str, ...]:
    """Return what is doubtful about stated numbers, positions and failed readings of recordings, as `check` says it.

    A line each, with the ``names`` of those recordings that it is about. Seconds are what their clock's unit makes of
    the times: in another unit every path looks wrong.
    """
    unit = clock_unit(recordings)
    meant = [corrected(one, [] if unit is None else [unit]) for one in recordings]
    return tuple(_told_once([doubts_of(_findings(one)) for one in meant], names))


def _findings(recording: Recording) -> Iterator[Finding]:
    """Yield what a check finds about stated numbers, failed readings and positions of a recording."""
    yield from statement_findings(recording)
    yield from failed_findings(recording)
    yield from path_findings(recording)


def _told_once(sentences: Sequence[Sequence[str]], names: Sequence[str]) -> list[str]:
    """Return the sentences about recordings, each once with the names of those that it is about."""
    told: dict[str, list[str]] = {}
    for own, name in zip(sentences, names, strict=True):
        for sentence in own:
            told.setdefault(sentence, []).append(name)
    return [f"{_named(about, len(names))}{sentence}" for sentence, about in told.items()]


def _named(names: Sequence[str], count: int) -> str:
    """Return the names of recordings before a sentence about them; empty where it is about all that there are."""
    return "" if len(names) == count else f"{', '.join(names)}: "
