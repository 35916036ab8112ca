"""The turn of a board as an answer has it: what was corrected, and what the fit has found beside it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.made import MODULE, throws

from discsim.effects import effect
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.setup import SetupFindings
from discsim.validation.diagnosis.setup.faults import told_fault
from discsim.validation.diagnosis.setup_effects import answer_of_setup
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.parameters import Parameter

TURN = np.array([0.3, -0.8, 1.1])
NAMES = ("rx_rad", "ry_rad", "rz_rad")


@cache
def fit() -> Fit:
    board = MODULE.without("gps").fitted("gyroscope", range=104.72)
    return screened(SearchProblem(throws(module=board, plant="free_spin", seconds=0.5)[:1])).base.fit


def test_errors_of_a_turn_that_goes_on_from_a_large_one_are_those_of_the_whole():
    """Of the turn beside the corrected board one axis is known a hundred times better than another."""
    written = throws(module=MODULE.without("gps").fitted("gyroscope", range=104.72), plant="free_spin", seconds=0.5)[:1]
    fault = told_fault(effect("board.rotation", **dict(zip(NAMES, TURN, strict=True))))
    own = np.array([1e-4, 1e-5, 1e-3])
    more = tuple(Parameter("board.rotation", name, 0.0, 1e-5, 0.2) for name in NAMES)
    moved = np.array([0.002, -0.001, 0.003])
    found = replace(fit(), parameters=more, at=moved, covariance=np.diag(own**2))
    (named,) = answer_of_setup(SetupFindings((fault,), tuple(written)), written, found, "explained").effects
    drawn = moved + own * np.random.default_rng(1).normal(size=(20000, 3))
    whole = (Rotation.from_rotvec(drawn) * Rotation.from_rotvec(TURN)).as_rotvec()
    assert [one.value for one in named.parameters.values()] == pytest.approx(np.mean(whole, axis=0), abs=3e-5)
    # of so many draws an error is known to 0.5 %
    assert [one.sd for one in named.parameters.values()] == pytest.approx(np.std(whole, axis=0), rel=0.025)
    assert min(one.sd for one in named.parameters.values()) > 5 * min(own)
