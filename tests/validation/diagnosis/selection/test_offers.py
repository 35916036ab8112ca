"""What a search refits first, and at which sizes: what readings show before what the slopes of another fit promise."""

from __future__ import annotations

from typing import cast

import pytest

from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.candidates.candidate import free_candidate
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.diagnosis.selection.offers import Offer, begun_as_tried
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.stepwise import search
from discsim.validation.identification.gauss_newton import Fit

ABOUT_ONE, ABOUT_OTHER = cast("Fit", "one fit"), cast("Fit", "another")


@pytest.mark.slow
def test_a_touch_of_six_times_the_noise_is_refitted_before_the_budget_is_spent():
    """A free spin touched by 0.019 rad/s: slopes of the relaxed fit promised nine other effects up to 2000 each."""
    case = draw_case(596002, "free_spin", ("event.spin_step",), "one")
    (named,) = search(SearchProblem(recordings(case))).final.hypothesis.candidates
    (concealed,) = case.concealed
    assert named.id == "event.spin_step"
    assert named.recordings == {concealed.recording}


def offer(id: str, name: str, value: float, gain: float, about: Fit = ABOUT_ONE) -> Offer:
    return ScreenedCandidate(free_candidate(id), gain, {((id, name), None): value}), about, 0.0


def test_an_effect_that_a_detector_has_tried_begins_at_its_size_in_the_turn_that_it_has():
    linear = offer("accel.time_offset", "offset_s", -0.012, 1300.0)
    other = offer("accel.lag", "tau_s", 0.03, 1000.0)
    tried = offer("accel.time_offset", "offset_s", -0.025, 60000.0, ABOUT_OTHER)
    assert begun_as_tried([linear, other], [tried]) == [tried, other]


def test_numbers_that_no_detector_has_tried_stay_as_they_are():
    linear = offer("accel.time_offset", "offset_s", -0.012, 1300.0)
    assert begun_as_tried([linear], [offer("gyro.time_offset", "offset_s", -0.025, 60000.0)]) == [linear]
    assert begun_as_tried([linear], []) == [linear]
