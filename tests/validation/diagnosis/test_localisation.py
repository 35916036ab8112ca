"""An effect is located where it shows; of readings that a limit hides, at the sensor that has it."""

from __future__ import annotations

from support.made import throws

from discsim.effects import effect
from discsim.validation.diagnosis.localisation import located_effect
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.stepwise import search


def test_a_limit_that_every_reading_stands_at_is_located_at_the_sensor_and_its_axis():
    """At 70 and 62 rad/s 16 mm off the axis a force of 62 m/s^2 and more is pulled: no reading of x takes part."""
    recordings = throws(errors=[effect("accel.saturation", limit_m_s2=30.0)], plant="free_spin")
    found = search(SearchProblem(recordings))
    (candidate,) = found.final.hypothesis.candidates
    assert candidate.id == "accel.saturation"
    place = located_effect(found, candidate, ["01", "02"])[0]
    assert (place.recording, place.sensor, place.axis) == ("all", "accelerometer", "x_m_s2")
    assert place.text == "readings stop below the stated range"
