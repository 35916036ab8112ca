"""Samples that were lost evenly: a clock that is slow by as much, where no reading tells the two apart.

Takes a fit with a sensor's clock; gives the share of samples whose loss would explain as much. Between two losses the
times of a lossy sensor run as a sawtooth of one sample about those of a slow clock. Where the motion changes little
within one sample that shows less than it costs to choose where each was lost.
"""

from __future__ import annotations

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from discsim.effects.sensors import ClockRate, DroppedSamples
from discsim.validation.diagnosis.detectors.dropped_samples import price_of_places
from discsim.validation.diagnosis.selection.candidates import CandidateEffect
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.readings import Readings, group_of
from discsim.validation.identification.sensor_model import delay

__all__ = ["lost_as_well"]

#: variance of what is anywhere within one sample, as of a reading that is rounded to it
_SAWTOOTH = 1.0 / 12.0


def lost_as_well(fit: Fit, candidate: CandidateEffect) -> tuple[str, float, float | None] | None:
    """Return the effect of lost samples that explains as much as a clock of a fit, their share and its error, or None.

    None, too, where a sawtooth of one sample would show: a search can tell losses there. The error is None where the
    fit's covariance is not known.
    """
    row = candidate.row
    lossy = next((one for one in CATALOGUE.values() if one.type is DroppedSamples and one.acts_on == row.acts_on), None)
    if row.type is not ClockRate or lossy is None or fit.plant.name in lossy.unseen_on:
        return None
    place = next(k for k, q in enumerate(fit.parameters) if (q.group, q.recordings) == (row.id, candidate.recordings))
    share = 1.0 - float(fit.at[place])
    acting = [i for i in range(len(fit.trajectories)) if candidate.recordings is None or i in candidate.recordings]
    read = [(i, one) for i in acting for one in fit.trajectories[i].readings if one.sensor == row.acts_on]
    samples = sum(len(one.t) for _, one in read)
    if share <= 0.0 or sum(_of_sawtooth(fit, *one) for one in read) > price_of_places(share * samples, share):
        return None
    known = fit.covariance.shape[0] == len(fit.parameters) and bool(fit.covariance[place, place] > 0.0)
    return lossy.id, share, float(np.sqrt(fit.covariance[place, place])) if known else None


def _of_sawtooth(fit: Fit, recording: int, readings: Readings) -> float:
    """Return the chi-squared that a sawtooth of one sample makes of readings; without end where no rate is known."""
    trajectory, values, sensor = fit.trajectories[recording], fit.values(recording), readings.sensor
    rate_hz = trajectory.recording.sheets[sensor].rate_hz
    if rate_hz <= 0.0:
        return np.inf
    t = readings.t - delay(values, sensor, readings.t)
    good = readings.good & ((t > 0.0) & (t + 1.0 / rate_hz < trajectory.nodes[-1]))[:, None]
    moved = shown(trajectory, values, sensor, t + 1.0 / rate_hz) - shown(trajectory, values, sensor, t)
    sd = np.array([fit.noise[group_of(sensor, axis)].sd for axis in range(moved.shape[1])])
    return _SAWTOOTH * float(np.sum(np.where(good, moved / sd, 0.0) ** 2))
