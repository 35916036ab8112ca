"""Chips that are turned alike are one board that is turned; chips that are turned otherwise are not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from support.made import MODULE, throws

from discsim.effects import effect
from discsim.effects.catalogue import Effect
from discsim.validation.diagnosis.candidates.candidate import free_candidate, parameters_of
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.selection.one_board import with_one_board
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.diagnosis.selection.starting_point import screened

BLIND = MODULE.without("gps").fitted("gyroscope", range=104.72)
#: where a search has the chips of a board that is turned so
CHIPS = {"gyro.mount": (0.05, -0.03, 0.0), "mag.mount": (0.05, -0.03, 0.0), "accel.position_offset": (0.0, 0.0, 0.0)}
TURN = {"rx_rad": 0.05, "ry_rad": -0.03, "rz_rad": 0.1}


def named(hidden: list[Effect], start: Mapping[str, tuple[float, float, float]]) -> Search:
    """Return a search of two free spins that ends with some effects from a ``start``, where others are hidden."""
    begun = screened(SearchProblem(throws([], hidden, module=BLIND, plant="free_spin")))
    base, candidates = begun.base, tuple(free_candidate(id) for id in start)
    sizes = {(one.id, q.name): v for one in candidates for q, v in zip(parameters_of(one), start[one.id], strict=True)}
    values = {**values_of_fit(base), **{(key, None): value for key, value in sizes.items()}}
    final = continuous_fit(base.fit, Hypothesis(candidates), begun.own, begun.relaxed_noise, values, iterations=20)
    return replace(begun, final=final)


def ids(found: Search) -> set[str]:
    return {candidate.id for candidate in found.final.hypothesis.candidates}


def test_two_chips_that_are_turned_alike_and_an_accelerometer_elsewhere_are_a_turned_board():
    found = named([effect("board.rotation", **TURN)], start=CHIPS)
    merged = with_one_board(found)
    assert ids(merged) == {"board.rotation"}
    values = values_of_fit(merged.final)
    np.testing.assert_allclose(
        [values[("board.rotation", name), None] for name in TURN], list(TURN.values()), atol=3e-3
    )


def test_an_accelerometer_that_sits_elsewhere_on_a_turned_board_stays():
    shifted = effect("accel.position_offset", dx_m=0.004, dy_m=0.0, dz_m=0.0)
    board = effect("board.rotation", rx_rad=0.05, ry_rad=-0.03, rz_rad=0.0)
    found = named([board, shifted], start=CHIPS)
    assert ids(with_one_board(found)) == {"board.rotation", "accel.position_offset"}


def test_chips_that_are_turned_otherwise_stay():
    turns = {"gyro.mount": (0.05, -0.03, 0.0), "mag.mount": (-0.02, 0.03, 0.0)}
    hidden = [effect(id, rx_rad=rx, ry_rad=ry, rz_rad=rz) for id, (rx, ry, rz) in turns.items()]
    found = named(hidden, start=turns)
    assert with_one_board(found) is found


def test_one_chip_alone_is_no_board():
    turn = {"gyro.mount": (0.05, -0.03, 0.0)}
    found = named([effect("gyro.mount", rx_rad=0.05, ry_rad=-0.03, rz_rad=0.0)], start=turn)
    assert with_one_board(found) is found
