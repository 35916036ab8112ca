"""A search in other segments begins with the effects that one before it found, where these are worth their price."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import MODULE, throws

from discsim.effects import effect
from discsim.recording import Recording
from discsim.validation.diagnosis.candidates.candidate import free_candidate
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search, values_of_fit
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.selection.stepwise import Anew, search
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.plants.free_spin import FREE_SPIN

BLIND = MODULE.without("gps").fitted("gyroscope", range=104.72)
BIAS = effect("gyro.bias", bx_rad_s=0.05, by_rad_s=-0.03, bz_rad_s=0.02)


@cache
def spins(*errors) -> tuple[Recording, ...]:
    return tuple(throws([], errors, module=BLIND, plant=FREE_SPIN.name))


@cache
def found() -> Search:
    return search(SearchProblem(spins(BIAS)))


def in_halves(recordings: tuple[Recording, ...]) -> Fit:
    """Return the relaxed fit of recordings with every segment in two."""
    fit = relaxed(recordings)
    return fit.cut_at([np.linspace(0.0, one.nodes[-1], 2 * one.nodes.size - 1) for one in fit.trajectories])


def ids(one: Search) -> list[str]:
    return [candidate.id for candidate in one.final.hypothesis.candidates]


@pytest.mark.slow
def test_what_was_found_is_taken_over_without_asking_for_it_again():
    again = search(SearchProblem(spins(BIAS), followed=in_halves(spins(BIAS))), anew=Anew(before=found()))
    assert ids(found()) == ids(again) == ["gyro.bias"]
    assert "gyro.bias" not in {one.candidate.id for one in again.considered}
    bias = dict(zip([q.key for q in again.final.fit.parameters], again.final.fit.at, strict=True))
    assert bias["gyro.bias", "bx_rad_s"] == pytest.approx(0.05, abs=2e-3)


@pytest.mark.slow
def test_a_baseline_that_is_hopeless_beside_what_was_found_is_that_of_the_search_before():
    again = screened(SearchProblem(spins(BIAS), followed=in_halves(spins(BIAS))), before=found())
    assert again.base is found().base


@pytest.mark.slow
def test_an_effect_that_is_worth_nothing_is_not_taken_over():
    begun = screened(SearchProblem(spins()))
    useless = Hypothesis((free_candidate("accel.bias"),))
    final = continuous_fit(begun.base.fit, useless, begun.own, begun.relaxed_noise, values_of_fit(begun.base))
    again = search(SearchProblem(spins(), followed=in_halves(spins())), anew=Anew(before=replace(begun, final=final)))
    assert ids(again) == []
