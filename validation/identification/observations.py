"""What a recording's sensors observed, in the form that a fit takes: usable readings, noise, limits."""

from __future__ import annotations

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.effects.kind import BOARD
from discsim.recording import SENSORS, Recording
from discsim.validation.identification.clipping import clipping_level
from discsim.validation.identification.coarse_steps import told_by_steps
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.readings import Readings

__all__ = ["readings_of"]


def readings_of(recording: Recording) -> tuple[Readings, ...]:
    """Return the usable readings of all sensors: gaps, and readings that stand at a limit, take no part."""
    found: list[Readings] = []
    for sensor in SENSORS:
        samples = recording.get(sensor)
        if samples is None or len(samples) == 0:
            continue
        sheet = recording.sheets[sensor]
        measured = samples.value if samples.value.ndim == 2 else samples.value[:, None]
        if sensor == "gps":
            sd = np.repeat([_or_nan(sheet.noise_rms or None), _or_nan(sheet.velocity_noise_rms or None)], 3)
            clipped, limit = np.zeros(measured.shape, dtype=np.bool_), None
        else:
            level = np.hypot(_or_nan(sheet.noise_rms), (sheet.resolution or 0.0) / np.sqrt(12.0))
            # a noise of zero is none: nobody knows it
            sd = np.full(measured.shape[1], level if level > 0.0 else np.nan)
            clipped = sheet.clipped(measured)
            limit = _limit(measured, clipped, sheet.range)
            lower = clipping_level(recording) if sensor == "accelerometer" else None
            if lower is not None:
                clipped, limit = np.abs(measured) >= lower - 1e-9 * lower, lower
        # times that were corrected may begin before the motion does
        good = np.isfinite(measured) & ~clipped & (samples.t >= 0.0)[:, None]
        told = told_by_steps(measured, sheet.resolution or 0.0, sheet.noise_rms) if sensor in BOARD else None
        if told is not None:
            measured, there = told
            good, sd = good & there, np.full(measured.shape[1], _or_nan(sheet.noise_rms))
        axes = tuple(SENSORS[sensor].columns)
        taken, weights = recording.averaged.get(sensor, (None, None))
        one = Readings(sensor, samples.t, measured, good, clipped, sd, axes, limit, taken, weights)
        found += plant_of(recording).observed(recording, one)
    return tuple(found)


def _limit(measured: FloatArray, clipped: BoolArray, stated: float | None) -> float | None:
    """Return the size beyond which a sensor shows nothing: its stated range, or where below that its readings stand."""
    sizes = np.abs(measured[clipped & np.isfinite(measured)])
    found = float(np.min(sizes)) if sizes.size else np.inf
    return min(found, np.inf if stated is None else stated) if sizes.size or stated is not None else None


def _or_nan(number: float | None) -> float:
    return np.nan if number is None else number
