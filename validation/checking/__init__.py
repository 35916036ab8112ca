"""What a recording holds, what is wrong with it and what it can tell: `check_recording` (docs/checking.md)."""

from validation.checking.check import Check, SetupFault, check_recording
from validation.checking.finding import Finding
from validation.checking.sensors import SensorCheck

__all__ = ["Check", "Finding", "SensorCheck", "SetupFault", "check_recording"]
