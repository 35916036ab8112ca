"""What sensors read in half a second of one flight, for tests of sensors."""

from __future__ import annotations

from typing import Any

import numpy as np

from discsim.engine import fly
from discsim.frames import body_to_ned
from discsim.motion import Motion
from discsim.recording import Samples
from discsim.sensors import Accelerometer, Gyroscope, Sampling
from support.flights import DRIVER, FIELD, throw

#: readings are written with nine decimals
WRITTEN = 0.6e-9
IMU = np.array([-0.0161, 0.0, 0.0])


def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def measured(sensor: Any, motion: Motion) -> Samples:
    samples = sensor.measure(motion, rng())
    assert isinstance(samples, Samples)
    return samples


def in_body(motion: Motion, v_ned: np.ndarray) -> np.ndarray:
    """C_BN v, (n, 3)."""
    rows = np.broadcast_to(v_ned, (motion.t.size, 3))
    return np.array([C.T @ v for C, v in zip(body_to_ned(motion.attitude), rows, strict=True)])


WOBBLING = throw(wobble=(3.0, -2.0))
FLIGHT = fly(DRIVER, FIELD, WOBBLING, duration=0.4)
#: bare readings of a wobbling flight at 1 kHz, the x of every form below
MAG = in_body(FLIGHT, FIELD.magnetic_field)
FAST = Sampling(1000.0)
SPECIFIC = measured(Accelerometer(FAST), FLIGHT).value
RATE = measured(Gyroscope(FAST), FLIGHT).value
