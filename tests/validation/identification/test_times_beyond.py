"""Times beyond a recording: those that were corrected to before its motion, and those of a clock that ran away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from support.made import throws

from discsim.recording import Samples
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.identification.linearisation import linearise
from discsim.validation.identification.observations import readings_of
from discsim.validation.identification.propagation import Column


def test_readings_before_the_motion_take_no_part():
    """A magnetometer 0.14 s early had its first readings compared with where the motion begins: 33 sd each."""
    recording = throws(seconds=1.0)[0]
    field = recording.samples["magnetometer"]
    early = replace(recording, samples={**recording.samples, "magnetometer": Samples(field.t - 0.1405, field.value)})
    (readings,) = (one for one in readings_of(early) if one.sensor == "magnetometer")
    assert not readings.good[readings.t < 0.0].any()
    assert readings.good[readings.t >= 0.0].all()
    assert np.count_nonzero(readings.t < 0.0) > 5


def test_a_clock_that_ran_away_does_not_run_the_motion_for_ever():
    """Fits of a stack of effects tried a time offset beyond all sense: the diagnosis ended in a traceback."""
    one = first_trajectory(throws(seconds=1.0)[0])
    values = {("gyro.time_offset", "offset_s"): -1e13}
    column = Column("gyro.bias", "bz_rad_s", 1e-4)
    linear = linearise(one, values, [column], one.plant.sizes.continuous.allowed)
    assert linear.residual.size > 0
