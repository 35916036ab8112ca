"""Diagnosis: where recordings part from the baseline, which physics was left out, and its size."""

from discsim.validation.diagnosis.pipeline import diagnose

__all__ = ["diagnose"]
