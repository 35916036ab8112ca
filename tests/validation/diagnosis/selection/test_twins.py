"""Effects that recordings hardly tell apart: which of them is named."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import FIELD, RIG

from discsim.effects import Effect, effect
from discsim.recording import Recording
from discsim.rig import spin_down
from discsim.sensors import Instruments, record
from discsim.validation.diagnosis.candidates.candidate import free_candidate
from discsim.validation.diagnosis.candidates.evidence import charge
from discsim.validation.diagnosis.selection.exchange import takes_its_place
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.selection.stepwise import search


@pytest.mark.parametrize("sensor", ["mag", "accel", "gyro"])
@pytest.mark.parametrize(("better", "named"), [(7.0, "lag"), (30.0, "time_offset")])
def test_an_offset_of_time_is_named_before_a_lag_only_where_it_explains_clearly_more(sensor, better, named):
    """At one spin both turn a sensor's phase alike; every part has a filter, and few loggers write wrong times.

    A lag of 3.7 ms on a rate table lost by 7 to an offset: what its starts may have been was charged to it.
    """
    score = {"lag": 0.0, "time_offset": -better}
    assert min(score, key=lambda what: score[what] + charge(free_candidate(f"{sensor}.{what}"))) == named


def coasts_with_gyroscope(*errors: Effect) -> list[Recording]:
    """Return run-downs of a rig with viscous friction alone, recorded by a gyroscope with these errors, unclipped."""
    module = Instruments.from_parts("mpu9250").with_effects(errors)
    return [
        record(
            spin_down(RIG, FIELD, rate, 4.0, yaw=0.5 + k),
            module,
            np.random.default_rng(50 + k),
            plant="spin_down",
            name=f"run-{k}",
            rig=RIG,
        )
        for k, rate in enumerate((30.0, 15.0))
    ]


@cache
def coasted() -> Search:
    """Return what is found where a gyroscope reads 0.3 % too little."""
    return search(SearchProblem(coasts_with_gyroscope(effect("gyro.scale", sz=-0.003))))


def test_what_decays_in_proportion_to_itself_is_read_at_a_wrong_scale_rather_than_late():
    """Late by 80 ms or too small by 0.3 %: no reading tells, and few loggers write wrong times."""
    (named,) = coasted().final.hypothesis.candidates
    assert named.id == "gyro.scale"
    late = {rival.candidate.id: rival.worse for rival in coasted().rivals[named.name]}
    assert abs(late["gyro.time_offset"]) < 1.0


@pytest.mark.parametrize(
    ("error", "other"),
    [(effect("gyro.lag", tau_s=0.012), "gyro.scale"), (effect("gyro.scale", sz=0.003), "gyro.lag")],
    ids=["lag", "scale"],
)
def test_what_decays_in_proportion_to_itself_is_named_late_where_a_part_can_be_so_late(error, other):
    """Late by 12 ms or too large by 0.03 % read alike, and so do 0.11 s and 0.3 %: no low-pass is so slow.

    A lag leaves out the first readings of its sensor. Their chance alone had made it 23 worse than a scale; what they
    say of a motion is worth a parameter or two.
    """
    found = search(SearchProblem(coasts_with_gyroscope(error)))
    (named,) = found.final.hypothesis.candidates
    assert named.id == error.id
    alike = {rival.candidate.id: rival.worse for rival in found.rivals[named.name]}
    assert abs(alike[other]) < 4.0


def test_a_parameter_that_no_reading_shows_is_not_charged():
    """On a rig a gyroscope turns about one axis."""
    final = coasted().final
    (named,) = final.hypothesis.candidates
    assert len(named.columns) == 3
    assert final.told(named) == 1
    assert final.charged == charge(named, 1) < charge(free_candidate("gyro.time_offset")) < charge(named)


def test_of_two_that_readings_do_not_tell_apart_the_one_is_named_whose_size_a_part_can_have():
    """A scale has a sigma of 5 % (models/priors.toml): 0.3 % off is nothing, and half of all is ten of them."""
    final = coasted().final
    (named,) = final.hypothesis.candidates
    (late,) = (one for one in coasted().rivals[named.name] if one.candidate.id == "gyro.time_offset")
    assert final.prior_penalty == pytest.approx((0.003 / 0.05) ** 2, rel=0.05)
    shift = dict(zip((q.key for q in late.fitted.fit.parameters), late.fitted.fit.at.tolist(), strict=True))
    late_s = shift["gyro.time_offset", "offset_s"]
    assert late.fitted.prior_penalty == pytest.approx((late_s / 0.1) ** 2)  # 0.1 s, as a radio link hands on
    assert not takes_its_place(late.worse, late, named, final)
    at = final.fit.at.copy()
    at[[q.key for q in final.fit.parameters].index(("gyro.scale", "sz"))] = -0.5
    absurd = replace(final, fit=replace(final.fit, at=at))
    assert absurd.prior_penalty == pytest.approx(100.0, rel=0.01)
    assert takes_its_place(late.worse, late, named, absurd)
