"""Samples that were lost evenly: a clock that is slow by as much, where no reading tells the two apart.

Takes a fit with a sensor's clock; gives the share of samples whose loss would explain as much. Between two losses the
times of a lossy sensor run as a sawtooth of one sample about those of a slow clock. Where the motion changes little
within one sample that shows less than it costs to choose where each was lost.
"""

from __future__ import annotations

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from discsim.effects.kind import Row
from discsim.effects.sensors import ClockRate, DroppedSamples
from discsim.validation.diagnosis.detectors.dropped_samples import price_of_places
from discsim.validation.diagnosis.selection.candidates import CandidateEffect
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.readings import group_of
from discsim.validation.identification.sensor_model import delay

__all__ = ["lost_as_well"]

#: variance of what is anywhere within one sample, as of a reading that is rounded to it
_SAWTOOTH = 1.0 / 12.0


def lost_as_well(fit: Fit, candidate: CandidateEffect) -> tuple[str, float, float] | None:
    """Return the effect of lost samples that explains as much as a clock of a fit, their share and its error, or None.

    None, too, where a sawtooth of one sample would show: a search can tell losses there.
    """
    row = candidate.row
    lossy = next((one for one in CATALOGUE.values() if one.type is DroppedSamples and one.acts_on == row.acts_on), None)
    if row.type is not ClockRate or lossy is None or fit.plant.name in lossy.unseen_on:
        return None
    place = next(k for k, q in enumerate(fit.parameters) if (q.group, q.recordings) == (row.id, candidate.recordings))
    share = 1.0 - float(fit.at[place])
    if share <= 0.0 or _of_sawtooth(fit, row) > price_of_places(share * _sampled(fit, row), share):
        return None
    return lossy.id, share, float(np.sqrt(fit.covariance[place, place]))


def _sampled(fit: Fit, row: Row) -> int:
    """Return how many samples of a sensor there are."""
    return sum(
        len(one.t) for trajectory in fit.trajectories for one in trajectory.readings if one.sensor == row.acts_on
    )


def _of_sawtooth(fit: Fit, row: Row) -> float:
    """Return the chi-squared that a sawtooth of one sample makes of a sensor's readings."""
    total = 0.0
    for i, trajectory in enumerate(fit.trajectories):
        values, sensor = fit.values(i), row.acts_on
        for readings in (one for one in trajectory.readings if one.sensor == sensor):
            step = 1.0 / trajectory.recording.sheets[sensor].rate_hz
            t = readings.t - delay(values, sensor, readings.t)
            good = readings.good & ((t > 0.0) & (t + step < trajectory.nodes[-1]))[:, None]
            moved = shown(trajectory, values, sensor, t + step) - shown(trajectory, values, sensor, t)
            sd = np.array([fit.noise[group_of(sensor, axis)].sd for axis in range(moved.shape[1])])
            total += _SAWTOOTH * float(np.sum(np.where(good, moved / sd, 0.0) ** 2))
    return total
