"""Samples that were lost evenly: a clock that is slow by as much, where no reading tells the two apart.

Takes a fit with a sensor's clock; gives the share of samples whose loss would explain as much. Between two losses the
times of a lossy sensor run as a sawtooth of one sample about those of a slow clock. Where the motion changes little
within one sample that shows less than it costs to choose where each was lost.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE
from discsim.effects.sensors import ClockRate, DroppedSamples
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.continuous_fit import wider_with
from discsim.validation.diagnosis.candidates.own_sizes import own_sizes
from discsim.validation.diagnosis.detectors.dropped_samples import price_of_places
from discsim.validation.diagnosis.detectors.walk_of_losses import (
    by_one_sample,
    evidence_of_walk,
    place_of,
    sd_of_axes,
)
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.readings import Readings
from discsim.validation.identification.sensor_model import delay

__all__ = ["beside_losses", "lost_as_well", "rather_lost"]

#: variance of what is anywhere within one sample, as of a reading that is rounded to it
_SAWTOOTH = 1.0 / 12.0
#: a clock that is slower than by this share is none: data sheets of inertial sensors state their output rate within 1 %
#: (BMI160, MPU-9250), and loggers that lose some per cent of the samples are common
_OUT_OF_TOLERANCE = 0.01
#: twice the logarithm of odds that are positive evidence (R. Kass and A. Raftery, Bayes factors, J. Am. Stat. Assoc.
#: 90, 1995, p. 777): what is named must be likelier, and the other is listed beside it
_POSITIVE = 2.0
#: twice the logarithm of odds that are very strong evidence, in the same table: odds of 150 to one
_VERY_STRONG = 10.0


def lost_as_well(fit: Fit, candidate: CandidateEffect) -> tuple[str, float, float | None] | None:
    """Return the effect of lost samples that explains as much as a clock of a fit, their share and its error, or None.

    None, too, where a sawtooth of one sample would show: a search can tell losses there. The error is None where the
    fit's covariance is not known.
    """
    row = candidate.row
    lossy = next((one for one in CATALOGUE.values() if one.type is DroppedSamples and one.acts_on == row.acts_on), None)
    if row.type is not ClockRate or lossy is None or fit.plant.name in lossy.unseen_on:
        return None
    place = place_of(fit, candidate)
    if place is None:
        return None  # of a clock that is no part of the fit nothing is known
    share = 1.0 - float(fit.at[place])
    acting = [i for i in range(len(fit.trajectories)) if candidate.recordings is None or i in candidate.recordings]
    read = [(i, one) for i in acting for one in fit.trajectories[i].readings if one.sensor == row.acts_on]
    shown_by = [_of_one_sample(fit, *one) for one in read]
    samples = sum(w.size for w in shown_by)
    sawtooth = _SAWTOOTH * sum(float(np.sum(w)) for w in shown_by)
    if share <= 0.0 or sawtooth > price_of_places(share * samples, share):
        return None
    if fit.covariance.shape[0] != len(fit.parameters) or not fit.covariance[place, place] > 0.0:
        return lossy.id, share, None
    return lossy.id, share, float(np.sqrt(fit.covariance[place, place] + share * (1.0 - share) * _of_walk(shown_by)))


def _of_walk(shown_by: Sequence[FloatArray]) -> float:
    """Return the variance of a clock's rate less the share that was lost, for losses of unit variance at each sample.

    ``shown_by`` is the chi-squared that one sample makes at each reading (n,), by recording. A clock weighs the counts
    J_k there by k; the share is the last count over all samples.
    """
    each = 1.0 / sum(w.size for w in shown_by)
    moments = [w * np.arange(1, w.size + 1) for w in shown_by]
    total = sum(float(moment @ np.arange(1, moment.size + 1)) for moment in moments)
    weights = [np.cumsum(moment[::-1])[::-1] / max(total, 1e-300) for moment in moments]
    return sum(float(np.sum((weight - each) ** 2)) for weight in weights)


def rather_lost(fit: Fit, candidate: CandidateEffect) -> tuple[str, float, float | None] | None:
    """Return lost samples as `lost_as_well` does where they are likelier than a clock of a fit, else None.

    Where no reading tells the two apart, what a part may be tells: a clock of all recordings is within its tolerance,
    and the same in all. Losses come at random, each recording has had its own, and they walk about the line of a clock.
    Where that would show, and nothing walks, it is a clock, however slow. Where a fit holds a walk, it has gained more
    than it costs.
    """
    lost = lost_as_well(fit, candidate) if candidate.recordings is None else None
    if lost is None or any(candidate.row.acts_on in one.lost for one in fit.trajectories):
        return lost
    if lost[1] > _OUT_OF_TOLERANCE and evidence_of_walk(fit, candidate) > -_VERY_STRONG:
        return lost
    return lost if _evidence_of_unlike_sizes(fit, candidate, lost[2]) > _POSITIVE else None


def beside_losses(fit: Fit, candidates: Sequence[CandidateEffect], errors: FloatArray) -> FloatArray:
    """Return the errors (p,) of a fit's numbers, wider by what the walk of lost samples does to each.

    ``candidates`` are the effects of the fit. Each number goes with a clock that stands for losses as their covariance
    says, and the walk takes that clock elsewhere than the motion would.
    """
    for candidate in candidates:
        lost = rather_lost(fit, candidate)
        if lost is not None and lost[2] is not None:
            place = place_of(fit, candidate)
            assert place is not None
            errors = wider_with(errors, fit.covariance, place, lost[2])
    return errors


def _evidence_of_unlike_sizes(fit: Fit, candidate: CandidateEffect, sd: float | None) -> float:
    """Return twice the logarithm by which a clock's sizes in each recording are likelier of random losses than of one.

    ``sd`` is the error of the share that was lost. One clock makes sizes as unlike as their errors, of a variance v;
    losses add the variance r v of their walk. Sizes that gain G by k freed numbers then have the likelihood of
    ``G r/(1 + r) - k log(1 + r)`` beside those of one clock. Nothing speaks for losses where no error is known.
    """
    sizes, place = own_sizes(fit, candidate), place_of(fit, candidate)
    if sd is None or place is None or not sizes.freed:
        return -np.inf
    ratio = sd**2 / float(fit.covariance[place, place]) - 1.0
    return float(sizes.gain * ratio / (1.0 + ratio) - sizes.freed * np.log1p(ratio))


def _of_one_sample(fit: Fit, recording: int, readings: Readings) -> FloatArray:
    """Return the chi-squared (n,) that one sample makes at each reading; without end where no rate is known."""
    trajectory, values, sensor = fit.trajectories[recording], fit.values(recording), readings.sensor
    rate_hz = trajectory.recording.sheets[sensor].rate_hz
    if rate_hz <= 0.0:
        return np.full(len(readings.t), np.inf)
    moved, good = by_one_sample(trajectory, values, readings, readings.t - delay(values, sensor, readings.t))
    return np.asarray(np.sum(np.where(good, moved / sd_of_axes(fit.noise, readings), 0.0) ** 2, axis=1))
