"""Rates that a sensor measures directly: a gyroscope's z axis, and a rate reference."""

from __future__ import annotations

import numpy as np

from discsim.arrays import BoolArray, FloatArray, sd_by_median
from discsim.clipping import SAME, step_of
from discsim.estimators.rate import YawRate
from discsim.estimators.readings import require_readings, require_sheet
from discsim.recording import Samples, SensorSheet

__all__ = ["gyroscope", "rate_reference"]


def gyroscope(samples: Samples, sheet: SensorSheet) -> YawRate:
    """Rate about +z_B as the gyroscope gives it, signed; ``samples.value`` is (n, 3) rad/s.

    NaN where z is missing or stands at a limit, stated or not (an MPU-9250 clips at 2000 deg/s), with that in
    ``beyond``. The standard deviation is the noise alone, the larger of stated and observed, and the rounding to the
    resolution, stated or observed: scale and bias, which a data sheet gives as a spread over parts and which need a
    rate table to be known, are not in it.
    """
    require_readings(samples, "gyroscope")
    require_sheet(sheet, "gyroscope")
    return _measured("gyroscope", samples.t, samples.value[:, 2], sheet.clipped(samples.value)[:, 2], sheet)


def rate_reference(samples: Samples, sheet: SensorSheet) -> YawRate:
    """Rate of an encoder, a tachometer or a table's own read-out, signed; ``samples.value`` is (n,) rad/s.

    NaN and standard deviation as in `gyroscope`.
    """
    require_readings(samples, "rate_reference")
    require_sheet(sheet, "rate_reference")
    return _measured("rate_reference", samples.t, samples.value, sheet.clipped(samples.value), sheet)


def _measured(method: str, t: FloatArray, read: FloatArray, clipped: BoolArray, sheet: SensorSheet) -> YawRate:
    rate = np.where(clipped, np.nan, read)
    noise = max(sheet.noise_rms or 0.0, _observed_noise(rate))
    # a number of six digits is rounded, too
    least = SAME * float(np.max(np.abs(rate[np.isfinite(rate)]), initial=0.0))
    sd = np.hypot(noise, max(sheet.resolution or step_of(rate[:, None]), least) / np.sqrt(12))
    beyond = np.where(clipped, read, np.nan) if np.any(clipped) else None
    return YawRate(method, t, rate, np.where(np.isfinite(rate), sd, np.nan), signed=True, beyond=beyond)


def _observed_noise(rate: FloatArray) -> float:
    """Scatter of the second differences, which a steady acceleration leaves alone; 0 for fewer than three in a row.

    The median bears steps and short disturbances; for white noise the second difference has sqrt(6) times its sd.
    """
    second = np.diff(rate, 2)
    second = second[np.isfinite(second)]
    return float(sd_by_median(second) / np.sqrt(6)) if second.size else 0.0
