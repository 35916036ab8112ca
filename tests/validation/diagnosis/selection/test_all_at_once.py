"""All effects at once: a turned chip in the place of the matrix of its sensor, and what a real logger did, by name."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from discsim.effects.sensors import CrossAxis
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.candidates.candidate import free_candidate, parameters_of
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.selection.all_at_once import turn_of


def test_a_matrix_whose_numbers_are_opposite_in_pairs_is_the_turn_that_it_begins_with():
    turn = np.array([0.02, -0.01, 0.015])
    seen = Rotation.from_rotvec(turn).as_matrix().T - np.eye(3)
    places = {"x": 0, "y": 1, "z": 2}
    matrix = {name: float(seen[places[name[1]], places[name[2]]]) for name in CrossAxis._fields}
    start = turn_of(
        {(("gyro.cross_axis", name), None): v for name, v in matrix.items()}, "gyro.cross_axis", "gyro.mount"
    )
    # the squares of the turn are left out
    assert np.array(list(start.values())) == pytest.approx(turn, abs=np.max(np.abs(turn)) ** 2)
    assert list(start) == [(("gyro.mount", name), None) for name in ("rx_rad", "ry_rad", "rz_rad")]


def test_two_chips_that_are_turned_alike_about_the_axis_do_not_wander_off():
    for id in ("gyro.mount", "mag.mount"):
        assert {q.sigma for q in parameters_of(free_candidate(id))} == {0.1}


@pytest.mark.slow
def test_all_that_a_real_logger_did_is_named_and_nothing_else():
    case = draw_case(31003, kind="like_real")
    made = recordings(case)
    found = diagnose([made], ["throws"]).diagnosis
    assert found.verdict == "explained"
    concealed = {item.effect.id: item.effect for item in case.concealed}
    named = {one.id: one for one in found.effects}
    assert named.keys() == concealed.keys()
    for id in ("gyro.mount", "mag.hard_iron"):
        true = np.array(list(concealed[id].sizes.values()))
        value = np.array([one.value for one in named[id].parameters.values()])
        # along the axis iron is as sure as the field that is stated, a turn about it shows less than a tilt
        assert value[:2] == pytest.approx(true[:2], abs=1.0 if id == "mag.hard_iron" else 1e-3)
    for id in ("mag.own_clock", "imu.own_clock"):
        assert named[id].parameters["period_s"].value == pytest.approx(concealed[id].sizes["period_s"], rel=1e-3)
    assert found.final.chi2_per_sample < 1.0
