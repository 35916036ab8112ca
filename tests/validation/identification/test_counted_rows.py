"""A free spin whose rows were counted: a magnetometer's zero of its own, and a moment in step with the wobble."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import MODULE, throws

from discsim.recording import Recording
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.identification.linearisation import linearise
from discsim.validation.identification.plants.free_spin import FREE_SPIN
from discsim.validation.identification.prediction import read
from discsim.validation.identification.propagation import Column


def thrown(*, counted: bool) -> Recording:
    made = throws(module=MODULE.without("gps").fitted("gyroscope", range=100.0), plant="free_spin", seconds=1.0)[0]
    t = made.samples["magnetometer"].t
    shown = {"magnetometer": (np.stack([t, t]), np.full((2, t.size), 0.5))}
    return replace(made, averaged=shown) if counted else made


def test_a_zero_of_the_magnetometer_is_read_and_has_its_slope():
    trajectory = first_trajectory(thrown(counted=True))
    field = next(one for one in trajectory.readings if one.sensor == "magnetometer")
    rates = next(one for one in trajectory.readings if one.sensor == "gyroscope")
    off = {key: 0.5 * (1 + k) for k, key in enumerate(FREE_SPIN.zero_keys)}
    assert read(trajectory, off, field) - read(trajectory, {}, field) == pytest.approx(
        np.broadcast_to([0.5, 1.0, 1.5], field.value.shape)
    )
    assert np.array_equal(read(trajectory, off, rates), read(trajectory, {}, rates))
    columns = tuple((q.group, q.name, q.step, ()) for q in FREE_SPIN.zeros)
    linear = linearise(trajectory, off, [Column(*c) for c in columns], FREE_SPIN.sizes.continuous.allowed)
    axis = next(c for c in linear.channels if (c.sensor, c.axis) == ("magnetometer", "y_uT"))
    slopes = linear.common[axis.rows]
    assert slopes == pytest.approx(np.broadcast_to([0.0, 1.0, 0.0], slopes.shape), abs=1e-9)


def test_only_rows_that_were_counted_ask_for_more_than_a_free_spin_does():
    plain, counted = thrown(counted=False), thrown(counted=True)
    more = {q.key for q in unknowns([counted])} - {q.key for q in unknowns([plain])}
    assert more == set(FREE_SPIN.zero_keys)
    assert FREE_SPIN.continuous_defects([plain]) is FREE_SPIN.sizes.continuous
    wider = FREE_SPIN.continuous_defects([counted]).sd - FREE_SPIN.sizes.continuous.sd
    assert np.flatnonzero(wider).tolist() == list(FREE_SPIN.layout.directions_of(FREE_SPIN.layout.rate))[:2]
