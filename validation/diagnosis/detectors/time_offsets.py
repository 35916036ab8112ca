"""Offsets of time on a rig, found by shifting a sensor's readings along the motion that the others tell.

Takes a fit of rigs; gives screened candidates of ``accel.time_offset`` and ``gyro.time_offset``, and of the lag that
looks alike where a sensor is late. A linear question finds small offsets; a ramp and its corners are not linear over
tens of milliseconds. In the air, where all sensors turn, phases tell the same before anything is fitted
(`discsim.validation.diagnosis.setup`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import Lag
from discsim.effects.setup import TimeOffset
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, free_candidate
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.diagnosis.settings import DETECTORS
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.prediction import shiftable
from discsim.validation.identification.segments import Trajectory

__all__ = ["time_offsets"]

#: offsets that are tried, s: up to twice the longest of a first setup, at the spacing of an ordinary sensor's samples;
#: and the spacing of the motion that readings are compared with
_TRIED, _GRID = np.arange(-0.3, 0.3001, 0.005), 0.002
#: an offset smaller than this is found by a linear question
_LEAST = 0.01
#: a lag is looked for up to this, s: a low-pass of 1 Hz
_LONGEST_LAG = 0.15


def time_offsets(
    fit: Fit, noise: NoiseModel, taken: Sequence[CandidateEffect] = (), least: float = DETECTORS.least
) -> list[ScreenedCandidate]:
    """Return offsets of time, and lags, of the sensors of a rig whose readings do not turn with the field.

    What is gained is in chi-squared in ``noise``; effects that are ``taken`` already are not proposed.
    """
    if fit.plant.airborne:
        return []
    found = []
    for sensor in ("accelerometer", "gyroscope"):
        late, lag = catalogued(TimeOffset, sensor).id, catalogued(Lag, sensor).id
        if any(candidate.id in (late, lag) for candidate in taken):
            continue
        left = sum(
            (_left(trajectory, fit.values(i), sensor, noise) for i, trajectory in enumerate(fit.trajectories)),
            np.zeros(1),
        )
        best = int(np.argmin(left))
        offset = float(_TRIED[best]) if left.size > 1 else 0.0
        gain = float(left[int(np.argmin(np.abs(_TRIED)))] - left[best]) if offset else 0.0
        if abs(offset) < _LEAST or gain < least:
            continue
        found.append(_screened(late, "offset_s", offset, gain))
        if 0.0 < offset <= _LONGEST_LAG:
            found.append(_screened(lag, "tau_s", offset, gain))
    return found


def _screened(id: str, name: str, value: float, gain: float) -> ScreenedCandidate:
    """Return an effect as a screened candidate whose one parameter starts at a value."""
    return ScreenedCandidate(free_candidate(id), gain, {((id, name), None): value})


def _left(trajectory: Trajectory, values: dict[tuple[str, str], float], sensor: str, noise: NoiseModel) -> FloatArray:
    """Return what a motion leaves of a sensor (tried,) at each offset, in chi-squared; (1,) without readings."""
    readings = next((r for r in trajectory.readings if r.sensor == sensor), None)
    if readings is None or readings.taken is not None:
        return np.zeros(1)
    at, value, grid, told = shiftable(trajectory, values, readings, noise, _GRID)
    used = np.flatnonzero(np.isfinite(value).any(axis=1))
    if used.size == 0 or grid.size < 2:
        return np.zeros(1)
    at, value = at[used], value[used]
    left = np.empty(_TRIED.size)
    for k, offset in enumerate(_TRIED):
        there = at - offset
        inside = (there >= grid[0]) & (there <= grid[-1])
        shifted = np.column_stack([np.interp(there, grid, column) for column in told.T])
        # where the motion is not known readings count as they do on the whole; no offset takes most of them there
        squares, count = np.nansum((value - shifted) ** 2, axis=1), int(np.count_nonzero(inside))
        left[k] = float(np.sum(squares[inside])) * used.size / count if 2 * count >= used.size else np.inf
    return left
