"""Why a candidate that was refitted is not among the named effects."""

from __future__ import annotations

import pytest

from discsim.validation.diagnosis.assemble import reason_for
from discsim.validation.diagnosis.selection.candidates import CandidateEffect
from discsim.validation.diagnosis.selection.evidence import price
from discsim.validation.diagnosis.selection.search_state import Considered

BIAS, IMPULSE = CandidateEffect("gyro.bias", ()), CandidateEffect("event.impulse", ())


def considered(candidate: CandidateEffect, gain: float) -> Considered:
    return Considered(candidate, gain, gain, {})


@pytest.mark.parametrize("candidate", [BIAS, IMPULSE], ids=lambda candidate: candidate.id)
def test_a_candidate_is_dear_or_beaten_by_its_own_price(candidate):
    assert reason_for(considered(candidate, price(candidate) - 1.0), []) == "worth less than its price"
    assert reason_for(considered(candidate, price(candidate) + 1.0), []) == "another explains more"


def test_an_event_costs_more_than_a_bias():
    assert price(IMPULSE) > price(BIAS)


def test_what_is_named_has_no_reason_against_it():
    assert reason_for(considered(BIAS, 100.0), [BIAS]) == "named"
