"""What a sensor's data sheet states of it: rate, noise, resolution, range, place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Real
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from discsim.arrays import BoolArray, FloatArray, readonly
from discsim.clipping import at_range, clipped
from discsim.errors import InputError, require_type

__all__ = ["SensorSheet"]


@dataclass(frozen=True)
class SensorSheet:
    """What a sensor's data sheet states, in the sensor's unit; None where it states nothing.

    ``noise_rms`` for gps is that of position (m), ``velocity_noise_rms`` that of velocity (m/s). ``position`` is
    the accelerometer's place in the body frame, (3,) m.
    """

    rate_hz: float
    noise_rms: float | None = None
    resolution: float | None = None
    range: float | None = None
    velocity_noise_rms: float | None = None
    position: FloatArray | None = None
    sigma: Mapping[str, float | FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_type(self.rate_hz, Real, "rate_hz", "a number, Hz")
        for name in ("noise_rms", "resolution", "range", "velocity_noise_rms"):
            if (stated := getattr(self, name)) is not None:
                require_type(stated, Real, name, "a number in the sensor's unit, or None where nothing is stated")
        if self.position is not None:
            object.__setattr__(self, "position", _place(self.position))
        require_type(self.sigma, Mapping, "sigma", "a mapping from a field's name to its standard deviation")
        object.__setattr__(self, "sigma", MappingProxyType(dict(self.sigma)))

    @property
    def rate_uncertainty(self) -> float:
        """What share of itself the rate is stated to be off by, one sigma; 0 where nothing is."""
        return float(np.max(self.sigma.get("rate_hz", 0.0))) / self.rate_hz if self.rate_hz else 0.0

    def clipped(self, value: FloatArray) -> BoolArray:
        """Tell which of the sensor's readings, (n, k) or (n,), stand at a limit, stated or found in them."""
        return clipped(value, self.range, self.resolution)

    def at_range(self, value: FloatArray) -> BoolArray:
        """Tell which readings stand at the stated range."""
        return at_range(value, self.range, self.resolution or 0.0)


def _place(position: ArrayLike) -> FloatArray:
    """Return a sensor's place (3,) m, read-only; raises `InputError` for what is none."""
    try:
        place = readonly(position)
    except (TypeError, ValueError):
        place = None
    if place is None or place.shape != (3,):
        raise InputError(f"position is {position!r}; expected three numbers in the body frame, m")
    return place
