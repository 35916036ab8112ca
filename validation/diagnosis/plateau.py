"""Readings that stand still at one size: an accelerometer that clips below the range its sheet states.

Noise is added before a sensor clips, so readings at a limit are equal to the last digit. Such readings say only that
the motion was beyond the limit, and must be known as such before anything is fitted to them.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.recording import Recording

__all__ = ["plateau", "plateau_of"]

#: fewest equal readings at the top that are taken for a limit, and how many times denser than those below it
FEWEST, DENSER = 6, 4.0


def plateau(recording: Recording) -> float | None:
    """Return the size (m/s^2) at which a recording's accelerometer stands still below its range, or None."""
    samples = recording.get("accelerometer")
    if samples is None or len(samples) == 0:
        return None
    sheet = recording.sheets["accelerometer"]
    limit = plateau_of(samples.value, sheet.resolution or 0.0, sheet.noise_rms)
    if limit is None or bool(np.any(sheet.clipped(np.array([limit])))):
        return None
    return limit


def plateau_of(value: FloatArray, resolution: float, noise: float | None) -> float | None:
    """Return the size at which readings (n, k) stand still, or None.

    The largest readings must be equal, and several times as many as noise would leave there: that is judged by how
    many stand within one noise (or ten steps of resolution) below them.
    """
    counted = _counted(value, resolution, noise)
    if counted is None:
        return None
    top, equal, expected = counted
    return top if equal >= FEWEST and equal > DENSER * expected else None


def equal_beyond_chance(recording: Recording) -> float:
    """Return twice the log likelihood ratio of as many equal largest readings as there are, against chance."""
    samples, sheet = recording.samples["accelerometer"], recording.sheets["accelerometer"]
    counted = _counted(samples.value, sheet.resolution or 0.0, sheet.noise_rms)
    if counted is None:
        return 0.0
    _, equal, expected = counted
    return float(2.0 * (equal * np.log(equal / expected) - (equal - expected))) if equal > expected else 0.0


def _counted(value: FloatArray, resolution: float, noise: float | None) -> tuple[float, int, float] | None:
    """Return the largest size of readings (n, k), how many have it, and how many would by chance."""
    size = np.abs(value[np.isfinite(value)])
    if size.size < FEWEST:
        return None
    top = float(size.max())
    step = max(resolution, 1e-6 * top)
    if noise is not None and step > 2.0 * noise:
        return None  # steps this coarse make readings of any steady motion equal
    width = max(10.0 * step, noise or 0.0)
    equal = int(np.count_nonzero(size > top - 0.25 * step))
    # the clipped value need not be a multiple of the resolution: the step below it is left alone
    below = int(np.count_nonzero((size > top - 1.25 * step - width) & (size <= top - 1.25 * step)))
    return top, equal, max(below * step / width, 0.5)
