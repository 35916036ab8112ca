"""Experiments, scores and reports: where the simulated world and the estimators meet; `discsim` starts here."""
