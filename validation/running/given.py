"""Recordings as a caller has them: in memory, as a folder, or several of either."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from discsim.errors import InputError
from discsim.recording import Recording, read_dataset

__all__ = ["Given", "given_recordings", "read_given"]

#: a recording, the folder of one or of a data set, or a sequence of these
Given: TypeAlias = Recording | Path | str | Sequence[Recording | Path | str]


def given_recordings(given: Given) -> list[Recording]:
    """Return the recordings that were given, folders read; raises `InputError` where there is none.

    Warns, as `read_given` says it, where recordings below a folder are not read.
    """
    if isinstance(given, Recording):
        return [given]
    if isinstance(given, Path | str):
        return read_given(Path(given), lambda text: warnings.warn(text, stacklevel=3))
    if not isinstance(given, Sequence):
        raise InputError(
            f"recordings are of type {type(given).__name__}; expected a recording, a folder, or a list of these "
            "(recording_from_arrays makes a recording of arrays)"
        )
    found = [recording for part in given for recording in given_recordings(part)]
    if not found:
        raise InputError("no recordings were given; expected at least one recording or folder")
    return found


def read_given(folder: Path, say: Callable[[str], None]) -> list[Recording]:
    """Return the recordings of a data set, or the recording that a folder is.

    ``say`` is told where such a folder has recordings in its sub-folders: they are no part of it and are not read.
    """
    found = read_dataset(folder)
    if (folder / "recording.toml").exists() and (below := sorted(folder.glob("*/recording.toml"))):
        names = ", ".join(file.parent.name for file in below[:3]) + ", ..." * (len(below) > 3)
        say(
            f"{folder}: is a recording itself, so {len(below)} in its sub-folders ({names}) "
            f"{'are' if len(below) > 1 else 'is'} not read; to read all as one data set, move its own "
            "recording.toml and CSV files into a sub-folder, too"
        )
    return found
