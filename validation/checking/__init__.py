"""What a recording holds, what is wrong with it and what it can tell: `check_recording` (docs/checking.md).

Each is loaded when it is first asked for: a flight asks what its disc states, and needs no estimator for that.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from discsim.validation.checking.check import Check, SetupFault, check_recording
    from discsim.validation.checking.finding import Finding
    from discsim.validation.checking.sensors import SensorCheck

__all__ = ["Check", "Finding", "SensorCheck", "SetupFault", "check_recording"]

_HOMES = {"Check": "check", "Finding": "finding", "SensorCheck": "sensors", "SetupFault": "check",
          "check_recording": "check"}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Return one of the names above, loaded when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
