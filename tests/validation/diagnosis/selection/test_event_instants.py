"""A fit at a wrong instant of an event is led to the right one, and the answer has an honest error of the instant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import FIELD, MODULE, RIG, throws

from discsim.effects import effect
from discsim.rig import spin_down
from discsim.sensors import record
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.localisation import located_effect
from discsim.validation.diagnosis.selection.event_instants import with_best_instant, with_instants_weighed
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import chi2_in, values_of_fit
from discsim.validation.diagnosis.selection.stepwise import search


@pytest.mark.slow
def test_a_kick_a_turn_beside_its_instant_is_moved_there_and_one_at_its_instant_stays():
    hidden = effect("event.impulse", t_s=0.81, dv_north_m_s=-0.5, dv_east_m_s=-0.6, dv_down_m_s=0.1)
    found = search(SearchProblem(throws([hidden], only=1)))
    final = found.final
    assert [candidate.id for candidate in final.hypothesis.candidates] == ["event.impulse"]
    key = (("event.impulse", "t_s"), frozenset({1}))
    right = values_of_fit(final)
    assert right[key] == pytest.approx(0.81, abs=1e-3)
    assert with_best_instant(found, final) is final
    turn = 2 * np.pi / 62.0
    for turns in (-1.0, 1.0):
        start = {**right, key: right[key] + turns * turn}
        beside = continuous_fit(final.fit, final.hypothesis, found.own, final.fit.noise, start)
        beside = replace(beside, score=beside.score + found.cost)
        assert abs(values_of_fit(beside)[key] - 0.81) > 0.7 * turn, "the fit finds the way by itself"
        moved = with_best_instant(found, beside)
        assert values_of_fit(moved)[key] == pytest.approx(0.81, abs=1e-3)
        assert chi2_in(moved, found.relaxed_noise) == pytest.approx(chi2_in(final, found.relaxed_noise), rel=1e-3)


def test_a_small_step_of_the_spin_in_the_wrong_dip_is_moved_and_has_the_error_of_a_change_point():
    """A gyroscope of 1.8 mrad/s at 250 Hz: chi-squared grows by 200 per second, and a dip is 0.02 s wide."""
    recordings = [
        record(spin_down(RIG, FIELD, rate, 4.0, hidden, yaw=1.0), MODULE, rng, plant="spin_down", name=name, rig=RIG)
        for name, rate, hidden, rng in (
            ("kicked", 25.0, [effect("event.spin_step", t_s=2.03, dr_rad_s=1.6e-3)], np.random.default_rng(0)),
            ("still", 20.0, [], np.random.default_rng(1)),
        )
    ]
    found = search(SearchProblem(recordings))
    final = found.final
    assert [candidate.id for candidate in final.hypothesis.candidates] == ["event.spin_step"]
    key, when = (("event.spin_step", "t_s"), frozenset({0})), [q.name for q in final.fit.parameters].index("t_s")
    right = values_of_fit(final)
    beside = continuous_fit(final.fit, final.hypothesis, found.own, final.fit.noise, {**right, key: right[key] + 0.15})
    beside = replace(beside, score=beside.score + found.cost)
    assert abs(values_of_fit(beside)[key] - right[key]) > 0.05, "the fit finds the way by itself"
    moved = with_best_instant(found, beside)
    assert values_of_fit(moved)[key] == pytest.approx(right[key], abs=5e-3)
    assert moved.score == pytest.approx(final.score, abs=0.1)
    weighed = with_instants_weighed(found)
    curved, own = (float(np.sqrt(one.final.fit.covariance[when, when])) for one in (found, weighed))
    assert own > 1.5 * curved
    assert abs(right[key] - 2.03) < 3.0 * own
    assert weighed.asked is weighed.final.fit, "what is known about the fit would be asked again"
    place = located_effect(weighed, final.hypothesis.candidates[0], ["kicked", "still"])[0]
    assert (place.from_s, place.to_s) == pytest.approx((right[key] - 2.0 * own, right[key] + 2.0 * own))
