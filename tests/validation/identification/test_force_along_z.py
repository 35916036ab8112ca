"""Where the path is unknown, what an accelerometer's z axis has read tells the force that its other axes read of z."""

from __future__ import annotations

import numpy as np
import pytest
from support.made import DRIVER, MODULE, flight, noiseless, rows_of

from discsim.effects import effect
from discsim.sensors import record
from discsim.validation.identification.sensor_model import predicted

TURNED = {"rx_rad": -0.02, "ry_rad": -0.07, "rz_rad": 0.03}
CROSS = {"sxy": 0.01, "sxz": 0.05, "syx": -0.02, "syz": -0.03, "szx": 0.0, "szy": 0.02}


@pytest.mark.parametrize(("id", "sizes"), [("accel.mount", TURNED), ("accel.cross_axis", CROSS)])
def test_what_other_axes_read_of_lift_and_gravity_along_z_is_predicted(id, sizes):
    """Lift and gravity along z were left out: a turned accelerometer came out as one in another place with a bias."""
    motion = flight(seconds=1.0)
    module = noiseless(MODULE.without("gps")).with_effects([effect(id, **sizes)])
    recording = record(motion, module, np.random.default_rng(4), plant="free_spin", name="turned", disc=DRIVER)
    samples = recording.samples["accelerometer"]
    values = {(id, name): size for name, size in sizes.items()}
    rows = rows_of(motion, samples.t)
    rows[..., 6:9] = 0.0  # what a free spin does not know of a path
    shown = predicted("accelerometer", recording, values, samples.t, rows)
    np.testing.assert_allclose(shown[:, 2], samples.value[:, 2], atol=1e-6)
    left = samples.value - shown
    # translation turns with the spin and averages out; what x and y read of 8 m/s^2 along z does not
    without = samples.value - predicted("accelerometer", recording, {}, samples.t, rows)
    assert np.all(np.abs(left[:, :2].mean(axis=0)) < 0.2 * np.abs(without[:, :2].mean(axis=0)))
