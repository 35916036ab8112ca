"""Diagnosis: where recordings part from the baseline, which physics was left out, and its size."""

from validation.diagnosis.diagnosing import diagnose

__all__ = ["diagnose"]
