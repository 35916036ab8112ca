"""A turned magnetometer and soft iron in free spins: which of the two is named, and whether the other stands beside."""

from __future__ import annotations

from dataclasses import replace

import pytest
from support.made import MODULE, throws

from discsim.effects import effect
from discsim.effects.catalogue import Effect
from discsim.validation.diagnosis.candidates.candidate import free_candidate
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.design.next_recording import confusions
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.selection.turned_or_iron import with_iron_weighed

BLIND = MODULE.without("gps").fitted("gyroscope", range=104.72)


def named(hidden: Effect, id: str, *more: Effect) -> Search:
    """Return a search of two free spins that ends with hard iron and an effect, where others are hidden."""
    begun = screened(SearchProblem(throws([], [hidden, *more], module=BLIND, plant="free_spin")))
    base = begun.base
    hypothesis = Hypothesis((free_candidate("mag.hard_iron"), free_candidate(id)))
    final = continuous_fit(base.fit, hypothesis, begun.own, begun.relaxed_noise, values_of_fit(base))
    return replace(begun, final=final)


def ids(found: Search) -> set[str]:
    return {candidate.id for candidate in found.final.hypothesis.candidates}


def test_soft_iron_that_makes_an_ellipse_of_the_circle_takes_the_place_of_a_turned_magnetometer():
    iron = effect("mag.soft_iron", sxx=0.02, sxy=-0.02, sxz=0.02, syy=-0.02, syz=0.01, szz=0.0)
    found = with_iron_weighed(named(iron, "mag.mount"))
    assert ids(found) == {"mag.hard_iron", "mag.soft_iron"}
    values = values_of_fit(found.final)
    assert values[("mag.soft_iron", "sxy"), None] == pytest.approx(-0.02, abs=2e-3)


def test_a_turned_magnetometer_stays_with_soft_iron_beside_it_that_does_as_well():
    found = with_iron_weighed(named(effect("mag.mount", rx_rad=0.01, ry_rad=-0.007, rz_rad=0.0), "mag.mount"))
    assert ids(found) == {"mag.hard_iron", "mag.mount"}
    (rival,) = found.rivals["mag.mount"]
    assert rival.candidate.id == "mag.soft_iron"
    assert confusions(found, found.final.hypothesis.candidates[-1]) == [rival]


@pytest.mark.parametrize("first", ["mag.mount", "mag.soft_iron"])
def test_both_are_named_where_both_are(first):
    iron = effect("mag.soft_iron", sxx=0.03, sxy=-0.02, sxz=0.03, syy=-0.02, syz=0.02, szz=0.0)
    found = with_iron_weighed(named(iron, first, effect("mag.mount", rx_rad=0.06, ry_rad=-0.05, rz_rad=0.0)))
    assert ids(found) == {"mag.hard_iron", "mag.mount", "mag.soft_iron"}
    values = values_of_fit(found.final)
    assert values[("mag.mount", "rx_rad"), None] == pytest.approx(0.06, abs=0.02)


def test_where_neither_is_named_nothing_is_weighed():
    found = named(effect("gyro.bias", bx_rad_s=0.05, by_rad_s=-0.02, bz_rad_s=0.02), "gyro.bias")
    assert with_iron_weighed(found).rivals == found.rivals
