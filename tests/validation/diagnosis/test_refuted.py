"""An effect that gains little and loses on recordings set aside is left out, unless more than noise is left then."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
from support.made import FIELD as SITE
from support.made import RIG, coasting

from discsim.effects import effect
from discsim.effects.body import InertiaAsymmetry
from discsim.rig import spin_down
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis import refuted
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.candidates.own_sizes import own_sizes
from discsim.validation.diagnosis.refuted import without_refuted
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.gauss_newton import penalty_of

BIAS = "accel.bias"


@cache
def with_bias(*biases: float) -> Search:
    """A search that stands at one bias of the accelerometer for run-downs that have each its own, m/s^2 along z."""
    runs = []
    for k, bias in enumerate(biases):
        motion = spin_down(RIG, SITE, 40.0 + 5.0 * k, 4.0, yaw=0.5 + k)
        runs.append(coasting(motion, RIG, k, [effect(BIAS, bx_m_s2=0.0, by_m_s2=0.0, bz_m_s2=bias)]))
    found = screened(SearchProblem(runs))
    bias = next(c for c in found.candidates if c.id == BIAS and c.recordings is None)
    final = continuous_fit(
        found.base.fit, Hypothesis((bias,)), found.own, found.base.fit.noise, values_of_fit(found.base)
    )
    return replace(found.with_step(final), final=final).about(final.fit)


def named(found: Search) -> list[str]:
    return [candidate.id for candidate in found.final.hypothesis.candidates]


def test_what_two_recordings_say_and_the_third_denies_is_left_out(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(refuted, "leaves_more_than_noise", lambda found: False)
    assert named(without_refuted(with_bias(0.03, 0.03, -0.03))) == []


def test_what_all_recordings_say_stays(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(refuted, "leaves_more_than_noise", lambda found: False)
    assert named(without_refuted(with_bias(0.03, 0.03, 0.03))) == [BIAS]


def test_sizes_that_agree_are_likely_and_such_as_do_not_are_none():
    """Three biases of 0.03 m/s^2, of which readings tell each to a tenth: as alike as noise makes them, or not."""
    for biases, agree in (((0.03, 0.03, 0.03), True), ((0.03, 0.03, -0.03), False), ((0.01, 0.03, 0.05), False)):
        found = with_bias(*biases)
        chance = own_sizes(found.final.fit, found.final.hypothesis.candidates[0]).chance
        assert (chance > 0.01) == agree == (chance > SELECTION.unlike)


def test_what_each_recording_wants_in_another_size_is_left_out(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(refuted, "leaves_more_than_noise", lambda found: False)
    monkeypatch.setattr(refuted, "heldout_gain", lambda found, candidate, choices: 1.0)
    monkeypatch.setattr(refuted, "worth_of_each", lambda equations, candidates, own: {t.name: 40.0 for t in candidates})
    assert named(without_refuted(with_bias(0.01, 0.03, 0.05))) == []
    assert named(without_refuted(with_bias(0.03, 0.03, 0.03))) == [BIAS]


def test_it_stays_where_more_than_noise_is_left_without_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(refuted, "leaves_more_than_noise", lambda found: not found.final.hypothesis.candidates)
    assert named(without_refuted(with_bias(0.03, 0.03, -0.03))) == [BIAS]


@pytest.mark.slow
def test_what_readings_do_not_tell_but_what_the_air_is_charged_for_names_no_inertia(monkeypatch: pytest.MonkeyPatch):
    """A blind case: it gained 87, of which 60 were charges that the air's stiffness changes from segment to segment."""
    found = screened(SearchProblem(recordings(draw_case(627033))))
    (asymmetry,) = [c for c in found.candidates if c.row.type is InertiaAsymmetry and c.recordings is None]
    final = continuous_fit(
        found.base.fit, Hypothesis((asymmetry,)), found.own, found.base.fit.noise, values_of_fit(found.base)
    )
    found = replace(found.with_step(final), final=final).about(final.fit)
    by_readings = [one.score - penalty_of(one.fit, one.fit.linears) for one in (found.base, final)]
    assert by_readings[0] - by_readings[1] < found.base.score - final.score
    # however much it gains in all
    monkeypatch.setattr(refuted, "worth_of_each", lambda equations, some, own: {t.name: 1e3 for t in some})
    assert without_refuted(found).final.hypothesis.candidates == ()
