"""Noise as it is: level and correlation of each sensor from residuals, and the whitening that follows.

Each group (a sensor; gps.position and gps.velocity apart) has one level and one first-order correlation for all its
axes and recordings. What a sheet states is a first guess and a thing to compare with.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from validation.diagnosis.trajectory_pieces import Channel, IntArray, Linear

__all__ = ["GroupNoise", "NoiseModel", "estimate_noise", "log_likelihood", "whitened"]

#: slowest noise that is taken for noise: correlation from one sample to the next
MOST_CORRELATED = 0.97
#: correlation this weak is taken for none
LEAST_CORRELATED = 0.04


class GroupNoise(NamedTuple):
    """Level (in the sensor's unit) and correlation from one sample to the next."""

    sd: float
    correlation: float = 0.0


NoiseModel = Mapping[str, GroupNoise]


def whitened(linear: Linear, noise: NoiseModel, columns: FloatArray, piece: IntArray | None = None) -> FloatArray:
    """Return columns (n, c) with rows divided by the noise and freed of its correlation.

    With ``piece`` (n,) rows of different pieces stay apart: the first of a piece keeps its correlated part.
    """
    result = np.empty_like(columns)
    for channel in linear.channels:
        sd, phi = noise[channel.group]
        x = columns[channel.rows] / sd
        if phi:
            gap = phi ** np.diff(channel.index)[:, None].astype(float)
            if piece is not None:
                gap[np.diff(piece[channel.rows]) != 0] = 0.0
            x[1:] = (x[1:] - gap * x[:-1]) / np.sqrt(1.0 - gap**2)
        result[channel.rows] = x
    return result


def log_likelihood(linear: Linear, noise: NoiseModel, residual: FloatArray) -> float:
    """Return -2 log likelihood of residuals (n,), less a constant."""
    white = whitened(linear, noise, residual[:, None])[:, 0]
    total = float(white @ white)
    for channel in linear.channels:
        sd, phi = noise[channel.group]
        total += 2.0 * channel.index.size * float(np.log(sd))
        if phi:
            total += float(np.sum(np.log1p(-(phi ** (2 * np.diff(channel.index))))))
    return total


def estimate_noise(
    linears: Sequence[Linear], residuals: Sequence[FloatArray], *, coloured: bool = True, spent: float = 0.0
) -> dict[str, GroupNoise]:
    """Return level and correlation of each group from residuals, one (n,) per linearisation.

    ``spent`` is how many parameters the residuals were fitted with; it is shared out over the groups by their size.
    """
    squares: dict[str, float] = {}
    counts: dict[str, int] = {}
    products: dict[str, float] = {}
    pairs: dict[str, float] = {}
    for linear, residual in zip(linears, residuals, strict=True):
        for channel in linear.channels:
            x = residual[channel.rows]
            group = channel.group
            squares[group] = squares.get(group, 0.0) + float(x @ x)
            counts[group] = counts.get(group, 0) + x.size
            if x.size > 1:
                next_to = np.diff(channel.index) == 1
                a, b = x[:-1][next_to], x[1:][next_to]
                products[group] = products.get(group, 0.0) + float(a @ b)
                pairs[group] = pairs.get(group, 0.0) + 0.5 * float(a @ a + b @ b)
    total = sum(counts.values())
    share = max(1.0 - spent / total, 0.1) if total else 1.0
    model = {}
    for group, n in counts.items():
        phi = products.get(group, 0.0) / pairs[group] if coloured and pairs.get(group, 0.0) > 0 else 0.0
        # less than three standard errors of a white sequence is white
        if phi < max(LEAST_CORRELATED, 3.0 / np.sqrt(max(n, 1))):
            phi = 0.0
        model[group] = GroupNoise(max(float(np.sqrt(squares[group] / (n * share))), 1e-12), min(phi, MOST_CORRELATED))
    return model


def stated_noise(linears: Sequence[Linear], floor: Mapping[str, float] | None = None) -> dict[str, GroupNoise]:
    """Return what the sheets state, white; a group without a statement takes ``floor``."""
    model: dict[str, GroupNoise] = {}
    for linear in linears:
        for channel in linear.channels:
            sd = float(linear.sd[channel.rows][0])
            if not np.isfinite(sd) or sd <= 0:
                sd = (floor or {}).get(channel.group, DEFAULT[channel.group])
            model[channel.group] = GroupNoise(max(sd, model.get(channel.group, GroupNoise(0.0)).sd))
    return model


#: noise of a sensor whose sheet says nothing, for the first pass only
DEFAULT = {
    "magnetometer": 0.6,
    "accelerometer": 0.08,
    "gyroscope": 0.003,
    "gps.position": 0.5,
    "gps.velocity": 0.1,
    "rate_reference": 0.001,
    "track": 0.05,
}


def channel_of(linear: Linear, sensor: str, axis: str) -> Channel | None:
    """Return a channel by name."""
    return next((c for c in linear.channels if (c.sensor, c.axis) == (sensor, axis)), None)
