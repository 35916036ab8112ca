"""The examples in docstrings give what they say: what a reader tries first must be true."""

from __future__ import annotations

import doctest
import pkgutil
from importlib import import_module

import discsim

#: these need a disc or a recording at hand; the tests of the Python door run those of recordings
WITH_SOMETHING_AT_HAND = {
    "discsim.engine",
    "discsim.plain_arrays",
    "discsim.estimators.plain_arrays",
    "discsim.validation",
    "discsim.validation.checking.checked",
}


def test_every_example_of_a_docstring_gives_what_it_says():
    run, wrong = 0, []
    names = [module.name for module in pkgutil.walk_packages(discsim.__path__, "discsim.")]
    for name in names:
        if name in WITH_SOMETHING_AT_HAND or name.endswith("__main__"):
            continue
        found = doctest.testmod(import_module(name))
        run += found.attempted
        wrong += [name] * (found.failed > 0)
    assert wrong == []
    assert run > 50
