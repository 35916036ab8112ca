"""Which refit of a step is taken."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from discsim.validation.diagnosis.selection.best_refit import Refitted, best_of


def refit(name: str, chi2: float, cost: float = 0.0) -> Refitted:
    return Refitted(cast(Any, SimpleNamespace(name=name)), cast(Any, None), cost, chi2 + cost, 0.0)


def test_what_tells_why_readings_are_out_waits_where_another_comes_near_the_data():
    """Beyond a limit a motion asks for anything while nothing says that it was kicked."""
    kick, limit = refit("kick", 3e3), refit("limit", 2e6, cost=-6e8)
    assert best_of([kick, limit], True, [False, True]) is kick
    assert best_of([kick, limit], True, [True, True]) is limit
    assert best_of([kick, limit], True, [False, False]) is limit


def test_far_from_the_data_the_least_chi_squared_is_taken():
    fits = [refit("one", 5e5), refit("two", 4e5), refit("three", 6e5)]
    assert best_of(fits, True, [True] * 3) is fits[1]
