"""The files of a diagnosis: takes an outcome; writes the answer, the report, the figures and the improved model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from discsim.files import write_text
from discsim.model_file import write_model
from discsim.validation.diagnosis.report.page import draw_figures, write_diagnosis_report
from discsim.validation.diagnosis.result import Outcome
from discsim.validation.reporting.run import json_text

__all__ = ["write_outcome"]


def write_outcome(outcome: Outcome, out: Path, settings: Mapping[str, str]) -> None:
    """Write all files of a diagnosis into ``out``, each whole or not at all, ``diagnosis.json`` last."""
    figures = draw_figures(outcome, out)
    write_diagnosis_report(out / "report.html", outcome, figures, settings)
    write_model(outcome.model, out / "model.toml")
    write_text(out / "diagnosis.json", json_text(outcome.diagnosis.to_json()))
