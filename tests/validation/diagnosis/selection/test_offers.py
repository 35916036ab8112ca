"""What a search refits first: beside the data, what readings show before what the slopes of another fit promise."""

from __future__ import annotations

import pytest

from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.stepwise import search


@pytest.mark.slow
def test_a_touch_of_six_times_the_noise_is_refitted_before_the_budget_is_spent():
    """A free spin touched by 0.019 rad/s: slopes of the relaxed fit promised nine other effects up to 2000 each."""
    case = draw_case(596002, "free_spin", ("event.spin_step",), "one")
    (named,) = search(SearchProblem(recordings(case))).final.hypothesis.candidates
    (concealed,) = case.concealed
    assert named.id == "event.spin_step"
    assert named.recordings == {concealed.recording}
