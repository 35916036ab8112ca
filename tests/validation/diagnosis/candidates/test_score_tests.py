"""What algebra promises of an effect in all recordings, and in one of them alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import pytest

from discsim.validation.diagnosis.candidates.candidate import free_candidate
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.candidates.score_tests import ScoreTest, screened_candidates
from discsim.validation.diagnosis.candidates.screening import NormalEquations


class Promised:
    """Normal equations of three recordings, in which an effect gains what is said for each scope."""

    recordings = 3

    def __init__(self, everywhere: float, alone: Sequence[float]) -> None:
        self._gain = {None: everywhere, **{frozenset([i]): gain for i, gain in enumerate(alone)}}

    def columns_of(self, parameters: object) -> list[Any]:
        return []

    def solve(self, asked: Sequence[Any], only: object = None) -> ScoreTest:
        gain = self._gain[asked[0][1].recordings] if asked else 0.0
        return ScoreTest(1000.0 - gain, np.ones(len(asked)), np.eye(len(asked)))


@pytest.mark.parametrize(
    ("alone", "scope"),
    [
        ([112.0, 118.0, 119.0], {2}),
        ([119.0, 118.0, 112.0], {0}),
        # that it is one recording of three is chosen, which has its price
        ([101.0, 100.5, 90.0], None),
    ],
)
def test_an_effect_acts_where_it_gains_most_in_whatever_order_recordings_come(alone, scope):
    equations = cast("NormalEquations", Promised(100.0, alone))
    (found,) = screened_candidates(equations, [free_candidate("gyro.bias")], Hypothesis(()), [])
    assert found.candidate.recordings == scope
