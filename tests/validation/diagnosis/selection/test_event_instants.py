"""A fit that stands at a kick's wrong turn is led to the right one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import throws

from discsim.effects import effect
from discsim.validation.diagnosis.selection.continuous_fit import continuous_fit
from discsim.validation.diagnosis.selection.event_instants import with_best_instant
from discsim.validation.diagnosis.selection.search_state import chi2_in, values_of_fit
from discsim.validation.diagnosis.selection.stepwise import search


def test_a_kick_a_turn_beside_its_instant_is_moved_there_and_one_at_its_instant_stays():
    hidden = effect("event.impulse", t_s=0.81, dv_north_m_s=-0.5, dv_east_m_s=-0.6, dv_down_m_s=0.1)
    found = search(throws([hidden], only=1))
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
