"""Experiments, scores and reports: where the simulated world and the estimators meet; `discsim` starts here."""

import os

# Before numpy is loaded: the matrices here are small, and on busy cores the threads of its linear algebra wait for each
# other a hundred times as long as they work.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
