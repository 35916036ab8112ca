"""What relations between sensors cost where they hold, and axes of one sensor that are found twice."""

from __future__ import annotations

import numpy as np
import pytest
from support.made import FIELD

from discsim.disc import Rig
from discsim.effects import effect
from discsim.rig import spin_down
from discsim.sensors import Instruments, record
from discsim.sensors.sampling import Noise
from discsim.validation.diagnosis.setup import SetupFault, with_fault
from discsim.validation.diagnosis.signals.relations import Columns, misfits
from discsim.validation.diagnosis.signals.spin_signals import spin_signals


def test_a_ramp_that_noise_hides_costs_what_chance_makes_of_it():
    """It cost ten times that: a bias beside it came out as an accelerometer whose y is reversed."""
    rig = Rig(1.1e-3, 2.4e-5)
    part = Instruments.from_parts("mpu9250", "ac1120s")
    part = part.fitted("accelerometer", position=np.array([-0.0161, 0.0, 0.0]), noise=Noise(0.15))
    motion = spin_down(rig, FIELD, 47.0, 24.0, yaw=0.5)
    costs = []
    for seed in range(20):
        signals = spin_signals(
            record(motion, part, np.random.default_rng(seed), plant="spin_down", name="noisy", rig=rig)
        )
        assert signals is not None
        (ramps,) = [item for item in misfits(signals, Columns()) if item.relation == "ramps"]
        costs.append(ramps.cost)
    # chi-squared of one degree of freedom has a mean of 1, and of 20 of them the mean exceeds 2 once in 300
    assert np.mean(costs) < 2.0


def fault(axes: str, sensor: str = "accel") -> SetupFault:
    return SetupFault(effect(f"{sensor}.axes", axes=axes), 40.0, 20.0)


@pytest.mark.parametrize(
    ("first", "second", "both"),
    [("x -y z", "x y -z", "x -y -z"), ("y x z", "-x y z", "y -x z"), ("y z x", "y z x", "z x y")],
)
def test_axes_of_one_sensor_found_twice_are_one_fault(first, second, both):
    """Two made an answer of which no report could be written."""
    (found,) = with_fault([fault(first)], fault(second))
    assert found.effect == effect("accel.axes", axes=both)


def test_what_the_second_puts_back_is_no_fault():
    other = fault("x y -z", "gyro")
    assert with_fault([fault("x -y z"), other], fault("x -y z")) == [other]
    assert with_fault([other], fault("x -y z")) == [other, fault("x -y z")]
