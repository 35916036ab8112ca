"""Saturation: an accelerometer that stops below its stated range.

Takes a fit; gives a candidate with the level at which equal readings pile up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import AccelerometerSaturation
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.identification.clipping import clipping_level, equal_beyond_chance
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import delay

__all__ = ["saturation"]

_ID = catalogued(AccelerometerSaturation).id


def saturation(fit: Fit, noise: NoiseModel, taken: Sequence[CandidateEffect] = ()) -> list[ScreenedCandidate]:
    """Return an accelerometer's limit below its range as a screened candidate where readings stand still at it.

    Such readings take no part in any fit. Gained is what the fit's motion asks for beyond the limit: readings that
    should have been larger, and that noise alone would have had to hold at one size. On a disc whose path is unknown
    the motion asks for nothing, and what counts is how many readings are equal.
    """
    if any(candidate.id == _ID for candidate in taken):
        return []
    gain, limits = 0.0, {}
    steps = [0.0]
    for i, trajectory in enumerate(fit.trajectories):
        readings = next((r for r in trajectory.readings if r.sensor == "accelerometer"), None)
        limit = clipping_level(trajectory.recording)
        if readings is None or limit is None:
            continue
        limits[i] = limit
        steps.append(trajectory.recording.sheets["accelerometer"].resolution or 0.0)
        if not trajectory.plant.path_known:
            gain += equal_beyond_chance(trajectory.recording)
            continue
        at, axis = np.nonzero(readings.clipped)
        values = {key: v for key, v in fit.values(i).items() if key[0] != _ID}
        moved = readings.t - _lateness(trajectory, values, readings.t)
        expected = shown(trajectory, values, "accelerometer", moved)[at, axis]
        beyond = expected * np.sign(readings.value[at, axis]) - limit
        sd = np.where(np.isfinite(readings.sd), readings.sd, noise["accelerometer"].sd)[axis]
        gain += float(np.sum((np.maximum(beyond, 0.0) / sd) ** 2))
    if not limits:
        return []
    limit = float(np.median(list(limits.values())))
    above = [
        i
        for i, trajectory in enumerate(fit.trajectories)
        if i not in limits and _largest(trajectory) > limit + max(steps)
    ]
    recordings = None if not above else frozenset(limits)
    # the readings are the limit, to within a step of the converter
    candidate = CandidateEffect(_ID, (), recordings, (("limit_m_s2", limit, max(max(steps), 1e-6) / 12.0**0.5),))
    return [ScreenedCandidate(candidate, gain, {})]


def _lateness(trajectory: Trajectory, values: Mapping[tuple[str, str], float], written: FloatArray) -> FloatArray:
    late = delay(values, "accelerometer", written)
    lost = trajectory.lost.get("accelerometer")
    return late if lost is None else late - lost / trajectory.recording.sheets["accelerometer"].rate_hz


def _largest(trajectory: Trajectory) -> float:
    samples = trajectory.recording.get("accelerometer")
    return 0.0 if samples is None else float(np.nanmax(np.abs(samples.value), initial=0.0))
