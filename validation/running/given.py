"""Recordings as a caller has them: in memory, as a folder, or several of either."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from discsim.errors import InputError
from discsim.recording import Recording, read_dataset

__all__ = ["Given", "given_recordings"]

#: a recording, the folder of one or of a data set, or a sequence of these
Given: TypeAlias = Recording | Path | str | Sequence[Recording | Path | str]


def given_recordings(given: Given) -> list[Recording]:
    """Return the recordings that were given, folders read; raises `InputError` where there is none."""
    if isinstance(given, Recording):
        return [given]
    if isinstance(given, Path | str):
        return read_dataset(given)
    found = [recording for part in given for recording in given_recordings(part)]
    if not found:
        raise InputError("no recordings were given; expected at least one recording or folder")
    return found
