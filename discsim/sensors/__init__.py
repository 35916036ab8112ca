"""Sensors: each a parameter type with ``measure(motion, rng)``; errors start at zero, so a bare sensor is ideal."""

from discsim.sensors.accelerometer import Accelerometer
from discsim.sensors.gyroscope import Gyroscope
from discsim.sensors.instruments import Instruments, Sensor, record
from discsim.sensors.magnetometer import Magnetometer
from discsim.sensors.position import Gps, Tracker
from discsim.sensors.rate_reference import RateReference
from discsim.sensors.sampling import Noise, Sampling

__all__ = [
    "Accelerometer",
    "Gps",
    "Gyroscope",
    "Instruments",
    "Magnetometer",
    "Noise",
    "RateReference",
    "Sampling",
    "Sensor",
    "Tracker",
    "record",
]
