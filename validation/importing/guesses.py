"""What an import guessed, beside the recording that it wrote. Takes its decisions; gives lines, and reads them again.

A recording says nothing of how sure its columns, units and axes are. Whoever reads a rate from it has to know.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from discsim.files import write_text
from discsim.recording import Recording
from discsim.validation.importing.sniffing.decision import Decision

__all__ = ["guesses_of", "write_guesses"]

#: the file in a recording's folder, a line for each guess
_FILE = "guesses.txt"


def write_guesses(folder: Path, decisions: Sequence[Decision]) -> None:
    """Write those of an import's decisions that are guesses beside its recording; take an earlier import's away."""
    lines = [decision.text for decision in decisions if decision.sure == "guess"]
    if lines:
        write_text(folder / _FILE, "\n".join(lines) + "\n")
    else:
        (folder / _FILE).unlink(missing_ok=True)


def guesses_of(recording: Recording) -> list[str]:
    """Return a line for each guess by which a recording of a folder was imported; none of other recordings."""
    if recording.path is None or not (file := recording.path / _FILE).is_file():
        return []
    lines = file.read_text(encoding="utf-8").splitlines()
    return [f"guessed by the import, to be checked in its map: {line}" for line in lines if line.strip()]
