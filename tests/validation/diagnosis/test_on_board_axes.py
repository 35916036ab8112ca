"""What a fit has found along the axes of a disc, told along those of a board that is turned in it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.made import MODULE, throws

from discsim.effects import effect
from discsim.effects.sensors import SoftIron
from discsim.validation.diagnosis.answer.named import Evidence, NamedEffect, ParameterValue
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.setup import SetupFindings
from discsim.validation.diagnosis.setup.faults import told_fault
from discsim.validation.diagnosis.setup_effects import answer_of_setup, on_board_axes
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.parameters import Parameter

TURN = np.array([0.3, -0.8, 1.1])
NAMES = ("rx_rad", "ry_rad", "rz_rad")
SIZES = (0.02, -0.01, 0.015, -0.004, 0.008, 0.01)


@cache
def fit() -> Fit:
    board = MODULE.without("gps").fitted("gyroscope", range=104.72)
    return screened(SearchProblem(throws(module=board, plant="free_spin", seconds=0.5)[:1])).base.fit


def told(id: str, values: dict[str, float]) -> dict[str, float]:
    """Return an effect's numbers along the axes of a board that is turned by `TURN`."""
    fault = told_fault(effect("board.rotation", rx_rad=TURN[0], ry_rad=TURN[1], rz_rad=TURN[2]))
    one = NamedEffect(
        id, {name: ParameterValue(value, 0.01) for name, value in values.items()}, Evidence(1.0, None, 0.1)
    )
    (turned,) = on_board_axes([one], SetupFindings((fault,), ()), fit())
    return {name: item.value for name, item in turned.parameters.items()}


def matrix(sizes: tuple[float, ...]) -> np.ndarray:
    xx, xy, xz, yy, yz, zz = sizes
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def test_soft_iron_is_that_of_the_readings_and_not_of_the_disc():
    C = Rotation.from_rotvec(TURN).as_matrix()
    in_disc = C @ matrix(SIZES) @ C.T
    found = told("mag.soft_iron", dict(zip(SoftIron._fields, in_disc[np.triu_indices(3)], strict=True)))
    assert tuple(found.values()) == pytest.approx(SIZES)


def test_hard_iron_is_that_of_the_readings_too():
    C = Rotation.from_rotvec(TURN).as_matrix()
    iron = np.array([3.0, -7.0, 12.0])
    found = told("mag.hard_iron", dict(zip(("bx_uT", "by_uT", "bz_uT"), C @ iron, strict=True)))
    assert tuple(found.values()) == pytest.approx(iron)


def test_what_has_no_axes_stays():
    assert told("accel.lag", {"tau_s": 0.1}) == {"tau_s": 0.1}


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
