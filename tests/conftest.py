"""Settings of all tests."""

import os

# before numpy is loaded, as in `validation`: many small matrices, and often fewer idle cores than threads
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

# the first example of a test may compile a function, which takes seconds on a busy machine; a gate tries the same
# examples each time, so that it fails for the change at hand, while everybody else's runs go on looking for new ones
settings.register_profile("discsim", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("discsim")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the slow tests of whole folders and files, unless ``-m`` or ``-k`` says which are meant."""
    if config.option.markexpr or config.option.keyword or any("::" in name for name in config.args):
        return
    slow = [item for item in items if item.get_closest_marker("slow")]
    if slow:
        config.hook.pytest_deselected(items=slow)
        items[:] = [item for item in items if item not in set(slow)]
