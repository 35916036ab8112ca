"""What a wobble leaves where the air's moments have a corner is no physics left out; more than that is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import MODULE, throws

from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.verdict import may_be_the_air
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import GroupNoise
from discsim.validation.identification.residual_tests import UnmodelledResidual

SD = 0.004
WINDOW = UnmodelledResidual("gyroscope", 0, "window", 14.0, 0.6, 0.7, "y_rad_s")


def wobbling(rate: float, plant: str = "free_spin") -> Fit:
    """Return a fit in which every segment begins with a transverse rate (rad/s)."""
    module = MODULE.without("gps") if plant == "free_spin" else MODULE
    one = first_trajectory(throws(plant=plant, module=module, seconds=1.2)[0])
    states = one.states.copy()
    states[:, one.plant.layout.rate] = np.array([rate, 0.0, 70.0])
    one = replace(one, states=states)
    return Fit((one,), (), np.zeros(0), one.plant.sizes.relaxed, {"gyroscope": GroupNoise(SD)})


def test_a_window_that_leaves_a_hundredth_of_the_wobble_is_the_air():
    # z = 14 is 2.0 standard deviations beyond noise, 8 mrad/s
    assert may_be_the_air(WINDOW, wobbling(0.8))
    assert not may_be_the_air(WINDOW, wobbling(0.2))


@pytest.mark.parametrize(
    "item",
    [
        replace(WINDOW, axis="z_rad_s"),
        replace(WINDOW, kind="band 3", recording=None, axis="all"),
        replace(WINDOW, group="magnetometer", axis="x_uT"),
    ],
    ids=lambda item: f"{item.kind} {item.axis}",
)
def test_of_anything_but_a_wobble_nothing_is_left_to_the_air(item: UnmodelledResidual):
    assert not may_be_the_air(item, wobbling(0.8))


def test_in_a_flight_the_air_is_modelled():
    assert not may_be_the_air(WINDOW, wobbling(0.8, "flight"))
