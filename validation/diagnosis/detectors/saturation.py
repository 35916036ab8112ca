"""Saturation: an accelerometer that stops below its stated range."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import AccelerometerSaturation
from validation.diagnosis.selection.candidates import Trial
from validation.diagnosis.selection.proposals import Proposal
from validation.identification.clipping import equal_beyond_chance, plateau
from validation.identification.gauss_newton import Fit
from validation.identification.noise import NoiseModel
from validation.identification.prediction import shown
from validation.identification.segments import Chain
from validation.identification.sensor_model import delay

__all__ = ["saturation"]

_ID = catalogued(AccelerometerSaturation).id


def saturation(fit: Fit, noise: NoiseModel, taken: Sequence[Trial] = ()) -> list[Proposal]:
    """Return an accelerometer's limit below its range as a proposal where readings stand still at it.

    Such readings take no part in any fit. Gained is what the fit's motion asks for beyond the limit: readings that
    should have been larger, and that noise alone would have had to hold at one size. On a disc whose path is unknown
    the motion asks for nothing, and what counts is how many readings are equal.
    """
    if any(trial.id == _ID for trial in taken):
        return []
    gain, limits = 0.0, {}
    steps = [0.0]
    for i, chain in enumerate(fit.chains):
        readings = next((r for r in chain.readings if r.sensor == "accelerometer"), None)
        limit = plateau(chain.recording)
        if readings is None or limit is None:
            continue
        limits[i] = limit
        steps.append(chain.recording.sheets["accelerometer"].resolution or 0.0)
        if not chain.plant.path_known:
            gain += equal_beyond_chance(chain.recording)
            continue
        at, axis = np.nonzero(readings.clipped)
        values = {key: v for key, v in fit.values(i).items() if key[0] != _ID}
        moved = readings.t - _lateness(chain, values, readings.t)
        expected = shown(chain, values, "accelerometer", moved)[at, axis]
        beyond = expected * np.sign(readings.value[at, axis]) - limit
        sd = np.where(np.isfinite(readings.sd), readings.sd, noise["accelerometer"].sd)[axis]
        gain += float(np.sum((np.maximum(beyond, 0.0) / sd) ** 2))
    if not limits:
        return []
    limit = float(np.median(list(limits.values())))
    above = [i for i, chain in enumerate(fit.chains) if i not in limits and _largest(chain) > limit + max(steps)]
    recordings = None if not above else frozenset(limits)
    # the readings are the limit, to within a step of the converter
    trial = Trial(_ID, (), recordings, (("limit_m_s2", limit, max(max(steps), 1e-6) / 12.0**0.5),))
    return [Proposal(trial, gain, {})]


def _lateness(chain: Chain, values: Mapping[tuple[str, str], float], written: FloatArray) -> FloatArray:
    late = delay(values, "accelerometer", written)
    lost = chain.lost.get("accelerometer")
    return late if lost is None else late - lost / chain.recording.sheets["accelerometer"].rate_hz


def _largest(chain: Chain) -> float:
    samples = chain.recording.get("accelerometer")
    return 0.0 if samples is None else float(np.nanmax(np.abs(samples.value), initial=0.0))
