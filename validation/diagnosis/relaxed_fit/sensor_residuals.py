"""What a fit leaves of one sensor's readings, as one number to compare fits by."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.linear import Channel, Linear

__all__ = ["left_across", "misfit"]


def _channels(fit: Fit, sensor: str) -> Iterator[tuple[Linear, Channel]]:
    """Yield the channels of a sensor in all recordings, each with its linearisation."""
    for linear in fit.linears:
        for channel in linear.channels:
            if channel.sensor == sensor:
                yield linear, channel


def misfit(fit: Fit, sensor: str) -> float:
    """Return the root mean square of a sensor's residuals over its stated noise; NaN where nothing is stated."""
    left = [linear.residual[c.rows] / linear.sd[c.rows] for linear, c in _channels(fit, sensor)]
    return float(np.sqrt(np.mean(np.concatenate(left) ** 2))) if left else np.nan


def left_across(fit: Fit) -> float:
    """Return the mean square of the residuals of a gyroscope's x and y over the fit's noise; NaN without one."""
    across = [(linear, c) for linear, c in _channels(fit, "gyroscope") if c.axis[0] in "xy"]
    left = [linear.residual[c.rows] / fit.noise[c.group].sd for linear, c in across]
    return float(np.mean(np.concatenate(left) ** 2)) if left else np.nan
