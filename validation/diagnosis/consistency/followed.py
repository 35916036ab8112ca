"""Whether a fit follows the readings: what it leaves of each sensor, in noise that no misfit has inflated.

A relaxed fit that misses everything takes what it leaves for noise, and then looks well. Here the noise is as stated,
or where nothing is stated, as the readings' own high-frequency content shows it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import comb

import numpy as np
from scipy.signal import lfilter

from discsim.arrays import FloatArray, sd_by_median
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import DEFAULT, GroupNoise
from discsim.validation.identification.prediction import shiftable
from discsim.validation.identification.readings import Readings, group_of
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import Values

__all__ = ["left_of", "left_when_shifted", "left_when_turned", "true_noise"]

#: orders of the differences by which a signal that turns is told from noise
_ORDERS = range(1, 9)
#: fewest readings of one axis whose differences are looked at
_FEWEST = 24


def true_noise(sensors: Sequence[Readings]) -> dict[str, GroupNoise]:
    """Return the noise of each group, white: as stated, else by the readings' differences, else as usual parts have."""
    stated: dict[str, list[float]] = {}
    seen: dict[str, list[float]] = {}
    for readings in sensors:
        value = np.where(readings.good, readings.value, np.nan)
        for axis in range(value.shape[1]):
            group = group_of(readings.sensor, axis)
            stated.setdefault(group, []).append(float(readings.sd[axis]))
            seen.setdefault(group, []).append(_by_differences(value[:, axis]))
    noise = {}
    for group, levels in stated.items():
        told = [level for level in levels if np.isfinite(level) and level > 0.0]
        found = [level for level in seen[group] if np.isfinite(level) and level > 0.0]
        level = max(told) if told else float(np.median(found)) if found else DEFAULT[group]
        noise[group] = GroupNoise(level)
    return noise


def _by_differences(value: FloatArray) -> float:
    """Return the noise of readings (n,) by the order of differences that leaves least; NaN for too few.

    The k-th difference of white noise of level s has the level s sqrt(C(2k, k)), while that of a signal that turns by
    a radians from one reading to the next is (2 sin a/2)^k times the signal.
    """
    found = []
    for order in _ORDERS:
        x = np.diff(value, order)
        x = np.sort(np.abs(x[np.isfinite(x)]))
        if x.size < _FEWEST:
            break
        # the mean size of a normal deviate is sqrt(2/pi) sigma; a median would be zero where readings are held
        found.append(float(np.mean(x)) * np.sqrt(np.pi / 2.0) / np.sqrt(comb(2 * order, order)))
    return min(found, default=np.nan)


def left_of(fit: Fit, noise: Mapping[str, GroupNoise]) -> list[dict[str, float]]:
    """Return per recording what a fit leaves of each sensor: a robust root mean square in noise.

    By the median of the sizes, so that an event, a gap or a few bad fixes do not count.
    """
    found = []
    for linear in fit.linears:
        sizes: dict[str, list[FloatArray]] = {}
        for channel in linear.channels:
            left = linear.residual[channel.rows] / noise[channel.group].sd
            sizes.setdefault(channel.sensor, []).append(np.nan_to_num(left, nan=1e9))
        found.append({sensor: float(sd_by_median(np.concatenate(each))) for sensor, each in sizes.items()})
    return found


#: times by which a sensor may be off in the middle of a window, s: a turn of a slow spin; how wrong its clock may be
#: within, as a share: lost samples and clocks that are worth the name stay below it
_SHIFTS, _STRETCHED = np.arange(-0.16, 0.161, 0.002), np.linspace(-0.04, 0.04, 9)
#: so many windows, and so many readings of each, are enough to tell
_WINDOWS, _READINGS = 5, 60
#: time constants of a lag that a sensor may have, s, and the spacing of the motion that it is taken of
_LAGS, _GRID = (0.0, 0.001, 0.002, 0.004, 0.008, 0.016, 0.03, 0.06, 0.12, 0.25, 0.5), 0.001


def left_when_shifted(
    trajectory: Trajectory, values: Values, readings: Readings, noise: Mapping[str, GroupNoise]
) -> float:
    """Return what a motion leaves of a sensor that lags, and is late by anything in each window, in its noise.

    A wrong clock, a delay, a lag and lost samples do that; a sensor of another motion they do not reconcile. A robust
    root mean square in the median window, each at the shift that leaves least, with the best lag; NaN without readings.
    """
    at, value, grid, told = shiftable(trajectory, values, readings, noise, _GRID)
    start, end = float(trajectory.nodes[0]), float(trajectory.nodes[-1])
    used = np.flatnonzero((at >= start) & (at < end) & np.isfinite(value).any(axis=1))
    if grid.size < 2 or used.size < 4:
        return np.nan
    window = np.floor((at[used] - start) / trajectory.plant.durations.window).astype(int)
    parts = [part for k in np.unique(window) if (part := used[window == k]).size >= 4]
    parts = [part[:: 1 + part.size // _READINGS] for part in parts[:: 1 + len(parts) // _WINDOWS]]
    levels = []
    for tau in _LAGS:
        gain = 1.0 - np.exp(-_GRID / tau) if tau > 0.0 else 1.0
        # as if it had stood at its first reading for long
        late = lfilter([gain], [1.0, gain - 1.0], told, axis=0, zi=(1.0 - gain) * told[:1])[0]
        left = dict[int, float]()
        for part in parts:
            middle = at[part].mean()
            for stretch in _STRETCHED:
                there = middle + (1.0 + stretch) * (at[part] - middle) + _SHIFTS[:, None]
                place = np.clip(((there - start) / _GRID).round().astype(int), 0, grid.size - 1)
                off = np.nanmedian(np.abs(value[part] - late[place]).reshape(_SHIFTS.size, -1), axis=1)
                left[part[0]] = min(left.get(part[0], np.inf), float(np.min(off)))
        levels.append(float(np.median(list(left.values()))) if left else np.nan)
    return float(sd_by_median(np.nanmin(levels))) if np.any(np.isfinite(levels)) else np.nan


#: rounds in which readings far off lose their weight, and how far that is, in what half of them leave
_ROUNDS, _FAR_OFF = 3, 4.0


def left_when_turned(
    trajectory: Trajectory, values: Values, readings: Readings, noise: Mapping[str, GroupNoise]
) -> tuple[float, float]:
    """Return what a motion leaves of a sensor of three axes as it is, and turned in its board by a small angle.

    Both as robust root mean squares in its noise; NaN without readings.
    """
    at, value, grid, told = shiftable(trajectory, values, readings, noise, _GRID)
    inside = (at >= grid[0]) & (at <= grid[-1]) if grid.size > 1 else np.zeros(at.size, dtype=bool)
    if value.shape[1] != 3 or np.count_nonzero(np.isfinite(value[inside])) < _FEWEST:
        return np.nan, np.nan
    y = np.stack([np.interp(at[inside], grid, told[:, axis]) for axis in range(3)], axis=1)
    off, columns = value[inside] - y, np.stack([np.cross(y, axis) for axis in np.eye(3)], axis=2)
    known = np.isfinite(off)  # an axis at its range says nothing
    off, columns = off[known], columns[known]
    left, kept = off, np.ones(off.size, dtype=bool)
    for _ in range(_ROUNDS):
        left = off - columns @ np.linalg.lstsq(columns[kept], off[kept], rcond=None)[0]
        kept = np.abs(left) <= _FAR_OFF * np.median(np.abs(left))
    return float(sd_by_median(off)), float(sd_by_median(left))
