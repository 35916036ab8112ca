"""Two effects: what algebra expects of every pair, and the search where no effect alone comes near the data."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import tables, throws

from discsim.effects import Effect, effect
from discsim.recording import Samples
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, candidates_for
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, fitted_parameters
from discsim.validation.diagnosis.candidates.score_tests import Pair, ScreenedCandidate, pairs
from discsim.validation.diagnosis.candidates.screening import normal_equations_of
from discsim.validation.diagnosis.design.next_recording import confusions
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.diagnosis.selection import next_effect as searching
from discsim.validation.diagnosis.selection.exchange import exchanged, rivals_of
from discsim.validation.diagnosis.selection.next_effect import next_effect, next_two
from discsim.validation.diagnosis.selection.offers import in_turn
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Rival, Search, possible
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.selection.stepwise import search
from discsim.validation.identification.noise import estimate_noise
from discsim.validation.identification.plants.flight import FLIGHT
from discsim.validation.identification.stated_parameters import stated_parameters

YAW, CLOCK = effect("aero.yaw_reynolds", exponent=0.3), effect("mag.clock_rate", ratio=0.9996)


@cache
def ranked() -> list[Pair]:
    """Return the pairs for throws with a yaw damping that grows with speed and a magnetometer's clock that is slow."""
    recordings = throws([YAW], [CLOCK])
    known = stated_parameters(recordings)
    relaxed_fit = relaxed(recordings, known)
    noise = estimate_noise(relaxed_fit.linears, [linear.residual for linear in relaxed_fit.linears])
    candidates = candidates_for(recordings)
    board = normal_equations_of(relaxed_fit, candidates, noise, FLIGHT.sizes.continuous)
    return pairs(board, candidates, (*known, *unknowns(recordings)))


def ids_of(hypothesis: Hypothesis) -> set[str]:
    return {candidate.id for candidate in hypothesis.candidates}


def named(hidden: list[Effect], errors: list[Effect]) -> list[str]:
    """Return what a search names in throws."""
    return sorted(
        candidate.id for candidate in search(SearchProblem(throws(hidden, errors))).final.hypothesis.candidates
    )


def test_the_first_pair_is_the_right_one_and_starts_near_its_numbers():
    best = ranked()[0]
    assert ids_of(best.hypothesis) == {YAW.id, CLOCK.id}
    assert best.start[(YAW.id, "exponent"), None] == pytest.approx(0.3, rel=0.3)
    assert best.start[(CLOCK.id, "ratio"), None] - 1.0 == pytest.approx(-4e-4, rel=0.3)


def test_every_two_effects_are_asked_once_at_their_best_shape():
    asked = [frozenset(candidate.id for candidate in pair.hypothesis.candidates) for pair in ranked()]
    assert all(len(ids) == 2 for ids in asked)
    assert len(set(asked)) == len(asked)
    assert [pair.merit for pair in ranked()] == sorted(pair.merit for pair in ranked())


def test_a_start_holds_what_shapes_an_effect():
    for pair in ranked():
        kept = {q.key for q in fitted_parameters(pair.hypothesis, ())}
        assert kept <= {key for key, _ in pair.start}


@pytest.fixture
def none_alone(monkeypatch):
    """Leave the search no effect alone that it could find worth its price."""
    monkeypatch.setattr(searching, "SELECTION", replace(searching.SELECTION, refitted=0, refitted_at_most=0))


@pytest.mark.usefixtures("none_alone")
def test_where_no_effect_alone_is_worth_its_price_two_are_found_at_once():
    assert named([YAW], [CLOCK]) == [YAW.id, CLOCK.id]


@pytest.mark.slow
def test_a_pair_that_comes_near_the_data_and_leaves_more_than_noise_ends_no_search_for_two(monkeypatch):
    """Algebra about fits that follow the data tells a delay and a lag alike, and may rank another pair before both."""
    found = search(SearchProblem(throws([YAW], [effect("mag.clock_rate", ratio=0.997)])))

    def delay_first(*asked):
        return sorted(pairs(*asked), key=lambda pair: ids_of(pair.hypothesis) != {YAW.id, "mag.time_offset"})

    monkeypatch.setattr(searching, "pairs", delay_first)
    _, best = searching.next_two(found)
    assert best is not None
    assert ids_of(best.hypothesis) == {YAW.id, CLOCK.id}


@pytest.mark.usefixtures("none_alone")
def test_of_two_at_once_the_superfluous_one_goes():
    assert named([YAW], []) == [YAW.id]


@pytest.mark.usefixtures("none_alone")
def test_two_at_once_are_not_asked_for_near_the_data(monkeypatch):
    monkeypatch.setattr(searching, "pairs", lambda *_: pytest.fail("asked"))
    assert named([], []) == []


@cache
def windy() -> Search:
    """Return what is found in throws through a wind that is the same at every height."""
    return search(SearchProblem(throws([effect("air.wind", w_north_m_s=-1.4, w_east_m_s=-1.0)], seconds=2.0)))


def of(id: str) -> CandidateEffect:
    return next(candidate for candidate in windy().candidates if candidate.id == id)


@cache
def as_shear() -> ContinuousFit:
    """Return the fit of that wind as one that grows with height."""
    return continuous_fit(
        windy().relaxed_fit, Hypothesis((of("air.wind_shear"),)), windy().own, windy().relaxed_noise, {}
    )


def test_an_effect_gives_way_to_one_that_explains_as_much_with_fewer_parameters():
    sheared = as_shear()
    found = replace(windy(), final=sheared).about(sheared.fit)
    found = replace(found, rivals=rivals_of(found))
    assert next(rival.candidate.id for rival in found.rivals["air.wind_shear"]) == "air.wind"
    better = exchanged(found)
    assert better is not None
    assert [candidate.id for candidate in better.hypothesis.candidates] == ["air.wind"]


def test_an_effect_does_not_give_way_to_one_that_needs_more_parameters_for_the_same():
    assert [candidate.id for candidate in windy().final.hypothesis.candidates] == ["air.wind"]
    assert exchanged(windy()) is None


def test_a_shear_that_is_known_to_have_none_is_not_confused_with_the_wind():
    (wind,) = windy().final.hypothesis.candidates
    sheared = as_shear()
    place = [q.name for q in sheared.fit.parameters].index("exponent")
    assert sheared.fit.covariance[place, place] ** 0.5 < 0.05
    found = replace(windy(), rivals={wind.name: [Rival(of("air.wind_shear"), 0.0, sheared)]})
    assert confusions(found, wind) == []
    # where the exponent is not known, nobody can tell
    wide = replace(sheared, fit=replace(sheared.fit, covariance=1e4 * sheared.fit.covariance))
    found = replace(windy(), rivals={wind.name: [Rival(of("air.wind_shear"), 0.0, wide)]})
    assert [rival.candidate.id for rival in confusions(found, wind)] == ["air.wind_shear"]


def test_a_sensor_far_off_the_disc_is_impossible():
    candidate = of("accel.position_offset")
    places = ((candidate.id, name) for name in ("dx_m", "dy_m", "dz_m"))
    values = dict.fromkeys(((key, None) for key in places), 1e-4)
    fit = continuous_fit(
        windy().relaxed_fit,
        Hypothesis((candidate,)),
        windy().own,
        windy().relaxed_noise,
        values,
        iterations=0,
        polish=0,
    )

    def with_offset(x: float) -> ContinuousFit:
        at = fit.fit.at.copy()
        at[[q.name for q in fit.fit.parameters].index("dx_m")] = x
        return replace(fit, fit=replace(fit.fit, at=at, covariance=1e-6 * np.eye(at.size)))

    assert possible(with_offset(0.1))
    assert not possible(with_offset(0.2))


def test_a_turned_accelerometer_beside_the_cross_axis_error_that_holds_it_is_impossible():
    found = windy()
    for ids, sensible in ((("accel.mount", "accel.scale"), True), (("accel.cross_axis", "accel.mount"), False)):
        hypothesis = Hypothesis(tuple(map(of, ids)))
        assert possible(replace(found.final, hypothesis=hypothesis)) is sensible


def test_offers_from_two_fits_come_in_turn_and_lost_samples_first():
    big, small = of("air.wind"), of("aero.stall")
    there = [
        (ScreenedCandidate(candidate, gain, {}), windy().relaxed_fit, 0.0)
        for candidate, gain in ((big, 1e6), (small, 9e5), (big, 1.0))
    ]
    here = [
        (ScreenedCandidate(small, 5e3, {}), windy().relaxed_fit, 0.0),
        (ScreenedCandidate(big, 1e4, {}), windy().relaxed_fit, 30.0),
    ]
    gains = [offer[0].gain for offer in in_turn(there, here)]
    assert gains == [1e6, 1e4, 9e5, 5e3]


def test_lost_samples_are_tried_beside_the_best_effect_before_a_clock_stands_for_them():
    """On tables, a place of the accelerometer beside lost samples of the magnetometer were a clock and more."""
    turns = (
        Samples(np.array([0.0, 0.5, 2.0, 4.0, 5.0, 8.0]), np.array([0.0, 0.0, 30.0, 30.0, 55.0, 55.0])),
        Samples(np.array([0.0, 1.0, 3.0, 5.0, 6.5, 8.0]), np.array([20.0, 20.0, -40.0, -40.0, 10.0, 10.0])),
    )
    errors = [effect("accel.position_offset", dx_m=0.002, dy_m=-0.0016), effect("mag.dropped_samples", fraction=0.01)]
    begun = screened(SearchProblem(tables((), errors, turns)))
    found, alone = next_effect(begun, begun.final, 0)
    assert alone is not None
    assert ids_of(alone.hypothesis) == {"accel.position_offset"}
    found, both = next_two(found, alone)
    assert both is not None
    assert ids_of(both.hypothesis) == {one.id for one in errors}
    assert found.cost > begun.cost
    assert "magnetometer" in found.relaxed_fit.trajectories[0].lost
