"""Axes that stand still between two steps of a sensor's resolution: their mean is off, however many readings there are.

Noise of half a step and more spreads readings over steps, and their mean is the true value. Less noise leaves it by the
side of it: the mean of readings in steps q of a value m in noise sigma is off by
``q/pi exp(-2 pi^2 sigma^2/q^2) sin(2 pi m/q)``, and by higher harmonics (Widrow and Kollar, Quantization Noise, 2008).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.validation.identification.linear import Channel, Linear
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.readings import Readings
from discsim.validation.identification.segments import Trajectory

__all__ = ["as_far_as_steps_tell"]


def as_far_as_steps_tell(current: Trajectory, linear: Linear, noise: NoiseModel) -> Trajectory:
    """Return a trajectory with as many readings of each axis as tell its mean no better than steps let them.

    ``linear`` tells what a fit expects of the readings, ``noise`` the level of them, rounding and all. Where nothing is
    stated of a resolution, and where an axis crosses a whole step, all of them remain.
    """
    kept = {readings.sensor: readings for readings in current.readings}
    for channel in linear.channels:
        step = current.recording.sheets[channel.sensor].resolution
        if step and channel.worth == 1.0:
            readings = kept[channel.sensor]
            kept[channel.sensor] = _thinned(readings, linear, channel, step, noise[channel.group].sd)
    return replace(current, readings=tuple(kept[readings.sensor] for readings in current.readings))


def _thinned(readings: Readings, linear: Linear, channel: Channel, step: float, level: float) -> Readings:
    """Return readings of which, of the axis of one channel, no more count than their mean is known by."""
    axis = readings.axes.index(channel.axis)
    expected = readings.value[channel.index, axis] - linear.residual[channel.rows]
    if expected.size == 0 or np.ptp(expected) >= step:
        return readings
    before_rounding = max(level**2 - step**2 / 12.0, 0.0)
    standing = float(np.abs(np.mean(np.exp(2j * np.pi * expected / step))))
    off = step / np.pi * np.exp(-2.0 * np.pi**2 * before_rounding / step**2) * standing
    # a mean of so many readings is as uncertain as that
    every = min(int(np.ceil(expected.size * (off / level) ** 2)), expected.size)
    if every <= 1:
        return readings
    good = readings.good.copy()
    good[np.delete(channel.index, np.s_[every // 2 :: every]), axis] = False
    return replace(readings, good=good)
