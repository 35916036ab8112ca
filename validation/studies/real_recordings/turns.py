"""Turns that a spinning body makes: by the phase of the field it sees, and by the integral of a rate."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray
from discsim.estimators.rate import YawRate
from discsim.recording import Samples
from discsim.validation.identification.circle import circle_through

__all__ = ["field_phase", "phase_rate", "turned", "turned_by_rate"]


def field_phase(field: FloatArray, shape: Literal["circle", "ellipse"] = "circle") -> FloatArray:
    """Angle of a field's x and y about the centre of a fitted circle or ellipse, (n,) rad, unwrapped.

    ``field`` is (n, 2) or (n, 3), any unit. A circle allows for hard iron, an ellipse for soft iron too: it is
    stretched to a circle first. Both are algebraic least squares. All NaN where the readings fit no ellipse.
    """
    mean = field[:, :2].mean(axis=0)
    scale = field[:, :2].std()
    x, y = (field[:, :2] - mean).T / scale
    if shape == "circle":
        middle, _ = circle_through(x + 1j * y)
        level = np.column_stack((x - middle.real, y - middle.imag))
    else:
        a, b, c, d, e = np.linalg.lstsq(np.column_stack((x * x, x * y, y * y, x, y)), np.ones_like(x), rcond=None)[0]
        form = np.array([[a, b / 2], [b / 2, c]])
        if not np.all(np.linalg.eigvalsh(form) > 0):
            return np.full(len(field), np.nan)
        centre = -np.linalg.solve(2 * form, np.array([d, e]))
        values, axes = np.linalg.eigh(form)
        level = (np.column_stack((x, y)) - centre) @ (axes * np.sqrt(values)) @ axes.T  # stretched without turning it
    return np.unwrap(np.arctan2(level[:, 1], level[:, 0]))


def turned(phase: FloatArray) -> float:
    """Turns of the body from the field's phase: the field turns the other way in it than the body in the field."""
    return float(phase[0] - phase[-1]) / (2 * np.pi)


def turned_by_rate(rate: YawRate, start: float, stop: float) -> float:
    """Turns by the integral of a rate between two times; what is unknown is bridged linearly."""
    known = np.isfinite(rate.rate)
    t, value = rate.t[known], rate.rate[known]
    total = cumulative_trapezoid(value, t, initial=0)
    return float(np.interp(stop, t, total) - np.interp(start, t, total)) / (2 * np.pi)


def phase_rate(magnetometer: Samples, window: float) -> YawRate:
    """Spin rate as the slope of the field's phase (about a circle's centre) over ``window`` s, at every sample.

    The standard deviation is the slope's from the scatter about the line, counted as independent. NaN within half a
    window of the ends. For a body that turns too slowly for a spectrum.
    """
    t, phase = magnetometer.t, field_phase(magnetometer.value)
    rate, sd = np.full(t.size, np.nan), np.full(t.size, np.nan)
    for k in range(t.size):
        near = np.abs(t - t[k]) <= window / 2
        if t[k] - window / 2 < t[0] or t[k] + window / 2 > t[-1] or near.sum() < 4:
            continue
        x = t[near] - t[near].mean()
        slope = x @ phase[near] / (x @ x)
        left = phase[near] - phase[near].mean() - slope * x
        rate[k], sd[k] = -slope, np.sqrt(left @ left / (near.sum() - 2) / (x @ x))
    return YawRate("field's phase", t, rate, sd, signed=True)
