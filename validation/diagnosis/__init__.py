"""Diagnosis: where recordings part from the baseline, which physics was left out, and its size."""
