"""Which rows become recordings. Takes what was read of a log and its throws; gives the recordings asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from discsim.errors import InputError
from discsim.validation.importing.conversion import Imported, RawReadings, recording_of
from discsim.validation.importing.sniffing.stretches import Stretch

__all__ = ["chosen_recordings"]


def chosen_recordings(
    read: RawReadings, throws: Sequence[Stretch], rows: slice | None, throw: int | None, *, every: bool
) -> list[Imported]:
    """Return the recording of the rows, of the throw numbered from 1, of every throw, or of the whole log.

    Raises `InputError` for a throw that there is not, and where every throw is asked for and none was found.
    """
    if throw is None and not every:
        return [recording_of(read, rows)]
    if not throws:
        raise InputError.at(read.raw, None, "no throw found in it; expected --rows A:B, or neither for the whole log")
    if throw is not None and throw > len(throws):
        raise InputError(f"--throw {throw}: {read.raw.name} has {len(throws)} throws; expected 1 to {len(throws)}")
    numbers = range(1, len(throws) + 1) if throw is None else (throw,)
    return [_numbered(read, throws[number - 1], number) for number in numbers]


def _numbered(read: RawReadings, found: Stretch, number: int) -> Imported:
    result = recording_of(read, slice(found.first, found.stop))
    return replace(result, recording=replace(result.recording, name=f"{result.recording.name}-{number:02d}"))
