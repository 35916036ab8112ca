"""Settings of all tests."""

import os

# before numpy is loaded, as in `validation`: many small matrices, and often fewer idle cores than threads
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from hypothesis import settings

# the first example of a test may compile a function, which takes seconds on a busy machine; a gate tries the same
# examples each time, so that it fails for the change at hand, while everybody else's runs go on looking for new ones
settings.register_profile("discsim", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("discsim")
