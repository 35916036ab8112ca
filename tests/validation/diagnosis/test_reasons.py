"""Why a candidate that was refitted is not among the named effects."""

from __future__ import annotations

from dataclasses import replace

import pytest

from discsim.validation.diagnosis.assemble import reason_for
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, free_candidate
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.selection.search_state import Considered

BIAS, IMPULSE = CandidateEffect("gyro.bias", ()), CandidateEffect("event.impulse", ())


def considered(candidate: CandidateEffect, gain: float) -> Considered:
    return Considered(candidate, gain, {})


@pytest.mark.parametrize("candidate", [BIAS, IMPULSE], ids=lambda candidate: candidate.id)
def test_a_candidate_is_dear_or_beaten_by_its_own_price(candidate):
    assert reason_for(considered(candidate, price(candidate) - 1.0), []) == "worth less than its price"
    assert reason_for(considered(candidate, price(candidate) + 1.0), []) == "another explains more"


def test_an_event_costs_more_than_a_bias():
    assert price(IMPULSE) > price(BIAS)


@pytest.mark.parametrize("id", ["gyro.scale", "mag.mount", "accel.lag", "mag.clock_rate", "site.field"])
def test_how_a_part_is_made_in_one_recording_alone_is_dear(id: str):
    """One logger flies: fits that ended beside each other had gained 46 by a scale, or a field, of one throw alone."""
    everywhere = free_candidate(id)
    assert price(replace(everywhere, recordings=frozenset([2]))) > price(everywhere) + 30.0
    assert price(replace(BIAS, recordings=frozenset([2]))) == price(BIAS)


def test_what_is_named_has_no_reason_against_it():
    assert reason_for(considered(BIAS, 100.0), [BIAS]) == "named"


def test_a_clock_that_stands_for_lost_samples_says_so_and_these_are_named():
    clock, lost = CandidateEffect("accel.clock_rate", ()), CandidateEffect("accel.dropped_samples", ())
    told = {clock.id: lost.id}
    assert reason_for(considered(clock, 100.0), [clock], told) == "named as accel.dropped_samples"
    assert reason_for(considered(lost, 1.0), [clock], told) == "named"
