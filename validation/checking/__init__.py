"""What a recording holds, what is wrong with it and what it can tell: `check_recording` (docs/checking.md)."""

from discsim.validation.checking.check import Check, SetupFault, check_recording
from discsim.validation.checking.finding import Finding
from discsim.validation.checking.sensors import SensorCheck

__all__ = ["Check", "Finding", "SensorCheck", "SetupFault", "check_recording"]
