"""Sensors read many neighbouring motions at once, as a fit asks them to."""

from __future__ import annotations

import numpy as np
import pytest
from flights import DRIVER, FIELD, throw

from discsim.effects.sensors import BiasDrift, CrossAxis, GSensitivity, PositionOffset, SoftIron, StrayField
from discsim.effects.setup import BoardRotation, SiteField
from discsim.engine import fly
from discsim.motion import State
from discsim.sensors import Accelerometer, Gps, Gyroscope, Magnetometer, RateReference, Tracker


@pytest.fixture(scope="module")
def motions():
    return [fly(DRIVER, FIELD, throw(wobble=wobble), duration=0.1) for wobble in ((3.0, -2.0), (1.0, 5.0))]


@pytest.mark.parametrize(
    "sensor",
    [
        Accelerometer(offset=PositionOffset(1e-3), drift=BiasDrift(0.1, 0.0, -0.2), cross_axis=CrossAxis(0.01)),
        Gyroscope(g_sensitivity=GSensitivity(1e-3, 0.0, 1e-3), board=BoardRotation(0.1, 0.2, 0.3)),
        Magnetometer(stray_field=StrayField(4.0), soft_iron=SoftIron(0.05), site=SiteField(0.1, 0.2, 1.1)),
        Gps(),
        RateReference(scale=0.01),
        Tracker(),
    ],
    ids=lambda sensor: type(sensor).__name__,
)
def test_readings_of_neighbouring_motions_are_those_of_each_alone(sensor, motions):
    around, t = motions[0].surroundings, motions[0].t
    alone = [motion.at(t) for motion in motions]
    together = State(t, *(np.stack(parts) for parts in list(zip(*alone, strict=True))[1:]))
    expected = np.stack([sensor.reading(state, around) for state in alone])
    assert not np.allclose(expected[0], expected[1], rtol=1e-9)
    # the same sums, which a library may take in another order
    np.testing.assert_allclose(sensor.reading(together, around), expected, rtol=1e-13, atol=1e-12)
