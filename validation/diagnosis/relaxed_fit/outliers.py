"""Single readings far from everything else, as bad GPS fixes are: left out of a relaxed fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.arrays import sd_by_median
from discsim.validation.diagnosis.relaxed_fit.further_steps import TOLERANCE
from discsim.validation.diagnosis.settings import RELAXED_FIT
from discsim.validation.identification.gauss_newton import Fit, refit

__all__ = ["without_outliers"]


def without_outliers(fit: Fit) -> tuple[Fit, list[tuple[int, str, str, float, float]]]:
    """Leave out single readings far from everything else, as bad GPS fixes are, and fit again.

    Returns the fit and what was left out: (recording, sensor, axis, time s, standard deviations).
    """
    found: list[tuple[int, str, str, float, float]] = []
    trajectories = []
    for index, (current, linear) in enumerate(zip(fit.trajectories, fit.linears, strict=True)):
        kept = {readings.sensor: readings.good.copy() for readings in current.readings}
        for channel in linear.channels:
            x = linear.residual[channel.rows]
            if x.size < 8:
                continue
            sd = max(float(sd_by_median(x)), 1e-12)
            z = np.abs(x) / sd
            padded = np.concatenate([[0.0], z, [0.0]])
            alone = (z > RELAXED_FIT.outlier) & (
                np.maximum(padded[:-2], padded[2:]) < np.maximum(RELAXED_FIT.neighbour, 0.2 * z)
            )
            if not 0 < np.count_nonzero(alone) <= max(2, RELAXED_FIT.most_outliers * x.size):
                continue
            readings = next(r for r in current.readings if r.sensor == channel.sensor)
            axis = readings.axes.index(channel.axis)
            for k in np.flatnonzero(alone):
                kept[channel.sensor][channel.index[k], axis] = False
                found.append((index, channel.sensor, channel.axis, float(linear.t[channel.rows][k]), float(z[k])))
        trajectories.append(replace(current, readings=tuple(replace(r, good=kept[r.sensor]) for r in current.readings)))
    if not found:
        return fit, found
    return refit(replace(fit, trajectories=tuple(trajectories)), iterations=4, tolerance=TOLERANCE * fit.count), found
