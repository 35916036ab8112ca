"""A lagging gyroscope on a rate table: a command that bends is remembered as it is, wherever between readings."""

from __future__ import annotations

import numpy as np
import pytest
from support.made import FIELD

from discsim.arrays import FloatArray
from discsim.recording import Samples
from discsim.rig import turn_table
from discsim.sensors import Instruments, record
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.identification.linearisation import linearise
from discsim.validation.identification.plants.rate_table import RATE_TABLE
from discsim.validation.identification.prediction import read
from discsim.validation.identification.propagation import Column

#: a rate that grows by 40 rad/s in a second, its corners between readings of 100 Hz
COMMAND = Samples(np.array([0.0, 1.00225, 2.00225, 3.0]), np.array([5.0, 5.0, 45.0, 45.0]))
SLOPES = (40.0, -40.0)


def behind_a_lag(t: FloatArray, tau: float) -> FloatArray:
    """Return the commanded rate (n,) behind a first-order lag, in closed form."""
    rate = np.interp(t, COMMAND.t, COMMAND.value)
    for corner, slope in zip(COMMAND.t[1:3], SLOPES, strict=True):
        since = np.maximum(t - corner, 0.0)
        rate -= slope * tau * (1.0 - np.exp(-since / tau))
    return rate


@pytest.mark.parametrize("tau", [0.002, 0.016, 0.15])
def test_a_lag_of_a_rate_that_bends_is_that_of_the_closed_form(tau: float) -> None:
    """Eight nodes of a rule for smooth signals missed 3.7 % of what the rate grows by in a time constant."""
    motion = turn_table(COMMAND, FIELD)
    module = Instruments.from_parts("mpu9250").fitted("gyroscope", range=104.72)
    made = record(motion, module, np.random.default_rng(1), plant="rate_table", name="table", command=COMMAND)
    current = first_trajectory(made)
    readings = next(one for one in current.readings if one.sensor == "gyroscope")
    late = readings.t > 0.2  # by then nothing is left of what came before the recording
    shown = read(current, {("gyro.lag", "tau_s"): tau}, readings)[:, -1]
    np.testing.assert_allclose(
        shown[late], behind_a_lag(readings.t, tau)[late], atol=5e-5 * 40.0
    )  # a corner before the last leaves 3e-5

    step = 1e-4 * tau
    columns = [Column("gyro.lag", "tau_s", step)]
    linear = linearise(current, {("gyro.lag", "tau_s"): tau}, columns, RATE_TABLE.sizes.continuous.allowed)
    channel = next(one for one in linear.channels if one.sensor == "gyroscope" and one.axis.startswith("z"))
    slope = linear.common[channel.rows, 0]
    t = linear.t[channel.rows]
    expected = (behind_a_lag(t, tau + step) - behind_a_lag(t, tau - step)) / (2.0 * step)
    np.testing.assert_allclose(slope[t > 1.0], expected[t > 1.0], atol=0.015 * 40.0)  # there 1 %
