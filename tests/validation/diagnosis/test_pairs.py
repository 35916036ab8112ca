"""Two effects at once: what algebra expects of every pair, and the search where no effect alone comes near the data."""

from __future__ import annotations

from functools import cache

import pytest
from made import throws

from discsim.effects import Effect, effect
from validation.diagnosis import search as searching
from validation.diagnosis.board import board_of
from validation.diagnosis.noise import estimate_noise
from validation.diagnosis.relaxed import NO_JUMPS, relaxed, unknowns
from validation.diagnosis.selection import Pair, fitted_parameters, pairs
from validation.diagnosis.stated import stated_parameters
from validation.diagnosis.trials import trials_for

YAW, CLOCK = effect("aero.yaw_reynolds", exponent=0.3), effect("mag.clock_rate", ratio=0.9996)


@cache
def ranked() -> list[Pair]:
    """Return the pairs for throws with a yaw damping that grows with speed and a magnetometer's clock that is slow."""
    recordings = throws([YAW], [CLOCK])
    known = stated_parameters(recordings)
    loose = relaxed(recordings, known)
    noise = estimate_noise(loose.linears, [linear.residual for linear in loose.linears])
    trials = trials_for(recordings)
    board = board_of(loose, trials, noise, NO_JUMPS["flight"])
    return pairs(board, trials, (*known, *unknowns(recordings)))


def named(hidden: list[Effect], errors: list[Effect]) -> list[str]:
    """Return what a search names in throws."""
    return sorted(trial.id for trial in searching.search(throws(hidden, errors)).final.hypothesis.trials)


def test_the_first_pair_is_the_right_one_and_starts_near_its_numbers():
    best = ranked()[0]
    assert {trial.id for trial in best.hypothesis.trials} == {YAW.id, CLOCK.id}
    assert best.start[(YAW.id, "exponent"), None] == pytest.approx(0.3, rel=0.3)
    assert best.start[(CLOCK.id, "ratio"), None] - 1.0 == pytest.approx(-4e-4, rel=0.3)


def test_every_two_effects_are_asked_once_at_their_best_shape():
    asked = [frozenset(trial.id for trial in pair.hypothesis.trials) for pair in ranked()]
    assert all(len(ids) == 2 for ids in asked)
    assert len(set(asked)) == len(asked)
    assert [pair.merit for pair in ranked()] == sorted(pair.merit for pair in ranked())


def test_a_start_holds_what_shapes_an_effect():
    for pair in ranked():
        kept = {q.key for q in fitted_parameters(pair.hypothesis, ())}
        assert kept <= {key for key, _ in pair.start}


def test_where_no_effect_alone_is_worth_its_price_two_are_found_at_once(monkeypatch):
    monkeypatch.setattr(searching, "_next", lambda *_: None)
    assert named([YAW], [CLOCK]) == [YAW.id, CLOCK.id]


def test_of_two_at_once_the_superfluous_one_goes(monkeypatch):
    monkeypatch.setattr(searching, "_next", lambda *_: None)
    assert named([YAW], []) == [YAW.id]


def test_two_at_once_are_not_named_where_there_is_nothing(monkeypatch):
    monkeypatch.setattr(searching, "_next", lambda *_: None)
    assert named([], []) == []
