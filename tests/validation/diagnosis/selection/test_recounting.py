"""Lost samples that the motion tells once an effect was added."""

from __future__ import annotations

import pytest

from discsim.validation.challenge.blind import Request
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.diagnosis.pipeline import diagnose


@pytest.mark.slow
def test_a_sample_that_was_lost_before_the_first_is_lost_and_shifts_no_times():
    """A recording whose times were all early by a sample had an offset beside the losses of the others."""
    found = diagnose([recordings(Request(643166).draw())], ["throws"]).diagnosis
    assert [effect.id for effect in found.effects] == ["mag.dropped_samples"]
    fraction = found.effects[0].parameters["fraction"]
    assert fraction.value == pytest.approx(0.0483, abs=2.0 * fraction.sd)


@pytest.mark.slow
def test_a_slow_clock_that_is_far_off_is_found_by_the_losses_that_stand_for_it():
    """A clock 0.4 % slow brings corners of a table's motion 0.2 s late; samples lost between them explained that."""
    found = diagnose([recordings(Request(643293).draw())[:3]], ["runs"]).diagnosis
    assert {effect.id for effect in found.effects} == {"accel.clock_rate", "rig.axis_tilt"}
    (clock,) = [effect.parameters["ratio"] for effect in found.effects if effect.id == "accel.clock_rate"]
    assert clock.value == pytest.approx(0.99602, abs=2e-5)
