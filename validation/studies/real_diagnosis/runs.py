"""Diagnoses of measured recordings: made once, kept as ``discsim diagnose`` writes them, and read from there."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import discsim
from discsim.files import digest, write_text
from discsim.model_file import Model, read_model
from discsim.recording import Recording, write_recording
from discsim.validation.diagnosis import diagnose
from discsim.validation.diagnosis.datasets import read_datasets
from discsim.validation.diagnosis.report.files import write_outcome
from discsim.validation.reporting.run import source_digest

__all__ = ["Found", "diagnosed", "diagnosis_digest"]


@dataclass(frozen=True)
class Found:
    """A diagnosis as its files hold it.

    ``answer`` is the content of ``diagnosis.json``, ``names`` the recordings that it was made from, ``folder`` where
    its figures are.
    """

    names: tuple[str, ...]
    answer: Mapping[str, Any]
    model: Model
    folder: Path

    @property
    def verdict(self) -> str:
        """The verdict."""
        return str(self.answer["verdict"])

    def chi2(self, which: str) -> float:
        """Return chi-squared per reading of the "baseline" or "final" model."""
        return float(self.answer["fit"][which]["chi2_per_sample"])


def diagnosed(
    recordings: Mapping[str, Recording], folder: Path, say: Callable[[str], None] = lambda text: None, seed: int = 0
) -> Found:
    """Diagnose recordings into ``folder``, or read what an earlier run of the same code left there on the same data.

    ``made-of.json``, which tells, is written last: a run that was broken off is made again.
    """
    names = tuple(recordings)
    data, note = folder / "data", folder / "made-of.json"
    for name, recording in recordings.items():
        write_recording(recording, data / name)
    made_of = {"recordings": digest(data), "diagnosis": diagnosis_digest(), "seed": seed}
    if not note.is_file() or json.loads(note.read_text(encoding="utf-8")) != made_of:
        say(f"diagnosing {folder.name}")
        note.unlink(missing_ok=True)
        read, called = read_datasets([data])
        outcome = diagnose(read, called, seed=seed)
        write_outcome(outcome, folder, {"recordings": ", ".join(names), "seed": str(seed)})
        write_text(note, json.dumps(made_of, indent=2) + "\n")
    answer = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    return Found(names, answer, read_model(folder / "model.toml"), folder)


def diagnosis_digest() -> str:
    """Return the SHA-256 of the code of models and diagnosis."""
    here = Path(__file__).parents[2]
    folders = (Path(discsim.__file__).parent, here / "identification", here / "diagnosis")
    return source_digest(*folders, here / "commands" / "diagnose.py")
