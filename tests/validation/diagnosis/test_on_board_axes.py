"""What a fit has found along the axes of a disc, told along those of a board that is turned in it."""

from __future__ import annotations

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
from discsim.validation.diagnosis.setup_effects import on_board_axes
from discsim.validation.identification.gauss_newton import Fit

TURN = np.array([0.3, -0.8, 1.1])
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
