"""An accelerometer that clips below the range its sheet states, as a hypothesis to be weighed.

Takes a recording; gives the clipping level, or None. Readings that are equal more often than rounding and noise allow
are the evidence (a test of runs against chance).
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.clipping import equal_largest, limits
from discsim.recording import Recording

__all__ = ["clipping_level", "clipping_level_of", "equal_beyond_chance"]


def clipping_level(recording: Recording) -> float | None:
    """Return the size (m/s^2) at which a recording's accelerometer stands still below its range, or None."""
    samples = recording.get("accelerometer")
    if samples is None or len(samples) == 0:
        return None
    sheet = recording.sheets["accelerometer"]
    limit = clipping_level_of(samples.value, sheet.resolution)
    if limit is None or sheet.at_range(np.array([limit]))[0]:
        return None
    return limit


def clipping_level_of(value: FloatArray, resolution: float | None) -> float | None:
    """Return the size at which readings (n, k) stand still, or None."""
    limit = limits(value, resolution).largest
    return limit if np.isfinite(limit) else None


def equal_beyond_chance(recording: Recording) -> float:
    """Return twice the log likelihood ratio of as many equal largest readings as there are, against chance."""
    samples, sheet = recording.samples["accelerometer"], recording.sheets["accelerometer"]
    equal, expected = equal_largest(samples.value, sheet.resolution)
    return float(2.0 * (equal * np.log(equal / expected) - (equal - expected))) if equal > expected else 0.0
