"""A board that is turned while its gyroscope clips about one axis: the pull to the axis tells the rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.made import MODULE, throws

from discsim.effects import effect
from discsim.recording import Recording
from discsim.sensors import Instruments
from discsim.validation.diagnosis.setup import find_setup_faults
from discsim.validation.diagnosis.setup.axis_by_pull import axis_by_pull

BLIND = MODULE.without("magnetometer")
TURNS = [(1.07, 0.50, 0.60), (-0.85, -0.83, 0.29), (0.9, -0.4, 0.1)]


def turned(turn: tuple[float, float, float], module: Instruments = BLIND) -> list[Recording]:
    sizes = dict(zip(("rx_rad", "ry_rad", "rz_rad"), turn, strict=True))
    return throws(errors=[effect("board.rotation", **sizes)], module=module)


@pytest.mark.parametrize("turn", TURNS)
def test_the_axis_is_told_by_the_rates_that_do_not_clip_and_the_length_of_the_pull(turn):
    found = axis_by_pull(turned(turn))
    assert found is not None
    axis = Rotation.from_rotvec(turn).as_matrix()[2]
    assert abs(float(found @ axis)) == pytest.approx(1.0, abs=1e-4)


def test_a_board_that_is_turned_so_is_named_without_a_magnetometer():
    """No motion of a flight followed such throws, and nothing was said of the board."""
    (fault,) = find_setup_faults(turned(TURNS[0])).faults
    assert fault.id == "board.rotation"
    assert tuple(fault.effect.value) == pytest.approx(TURNS[0], abs=0.02)


def test_nothing_is_told_where_nothing_or_all_clips_or_the_board_lies_as_stated():
    assert axis_by_pull(turned(TURNS[0], BLIND.fitted("gyroscope", range=100.0))) is None
    assert axis_by_pull(throws(module=BLIND)) is None
    assert axis_by_pull(turned(TURNS[0], BLIND.fitted("gyroscope", range=3.0))) is None
    assert find_setup_faults(throws(module=BLIND)).faults == ()


def test_without_a_place_off_the_axis_no_pull_has_a_length():
    assert axis_by_pull(turned(TURNS[0], BLIND.fitted("accelerometer", position=np.zeros(3)))) is None
