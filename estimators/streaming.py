"""Spin rate while the data come in: the likelihood window, moved on by one sample at a time, in bounded memory.

Each magnetometer sample moves the window; the fit starts from the last one, carried on in time, and takes a step or two
of Newton's method. The compiled functions are those of the batch estimator (`discsim.estimators.likelihood`), so where
both fit the same window they give the same numbers. Latency: an answer is for the window's middle, half a window ago;
the rate at the newest sample is given too, from the same polynomial, with the larger standard deviation that it has.
"""

from __future__ import annotations

from dataclasses import replace
from math import copysign, hypot, pi, sqrt
from typing import NamedTuple

import numpy as np

from discsim.arrays import ComplexArray, FloatArray
from discsim.errors import InputError
from discsim.estimators.likelihood import LikelihoodSettings, fit_windows
from discsim.estimators.precession import STRENGTH_SD, tipping
from discsim.estimators.tone import field_shape, fit_tone

__all__ = ["Answer", "StreamingRate"]


class Answer(NamedTuple):
    """Rate at t, the window's middle, and at ``newest``, the last sample; rad/s and s, NaN where unknown."""

    t: float
    rate: float
    sd: float
    newest: float
    rate_newest: float
    sd_newest: float


_SUBSTEPS = 4


class StreamingRate:
    """Spin rate, signed, sample by sample.

    Parameters
    ----------
    rate_hz : float
        The magnetometer's sampling rate; it sizes the memory.
    settings : LikelihoodSettings or None
        Of the window; it does not grow here, so a spin of less than ``turns`` turns in it is NaN.
    strength : float or None
        The field's strength, uT: with a gyroscope it gives the field along the axis and so the precession's share.
    fixed_axis : bool
        True on a rig: no precession.

    Notes
    -----
    Memory is one window. ``latency`` is half of it (0.64 s with the defaults). The two uses of the last estimate, a
    start for the next fit and the gyroscope's interpolation, do not accumulate errors.
    """

    def __init__(
        self,
        rate_hz: float,
        settings: LikelihoodSettings | None = None,
        *,
        strength: float | None = None,
        fixed_axis: bool = False,
    ) -> None:
        settings = settings or LikelihoodSettings()
        if not rate_hz > 0:
            raise InputError(f"streaming rate: got {rate_hz} Hz, expected a positive number")
        self.settings = settings
        self.strength, self.fixed_axis = strength, fixed_axis
        self._interval = 1.0 / rate_hz
        size = max(round(settings.window * rate_hz), settings.degree + 12)
        self._t = np.zeros(size)
        self._m = np.zeros((size, 3))
        self._z = np.zeros(size, dtype=complex)
        self._rates = np.full((size, _SUBSTEPS), complex(np.nan, np.nan))
        self._filled = 0
        self._u = np.ones(size, dtype=complex)
        self._powers = settings.degree + 2
        self._parameters = np.zeros(self._powers + 5)
        self._covariance = np.zeros((self._powers + 5, self._powers + 5))
        self._centre = self._half = 0.0
        self._known = False
        self._wait = 0
        # readings of the gyroscope: as many as three sampling intervals of the magnetometer need
        self._gyroscope: list[tuple[float, complex]] = []
        self._has_gyroscope = False

    @property
    def latency(self) -> float:
        """Age of an answer, s: half the window."""
        return 0.5 * (self._t.size - 1) * self._interval

    @property
    def held_bytes(self) -> int:
        """Memory of the window's arrays, which do not grow."""
        return sum(int(value.nbytes) for value in vars(self).values() if isinstance(value, np.ndarray))

    def update_gyroscope(self, t: float, w: FloatArray) -> None:
        """Take a reading of the gyroscope, (3,) rad/s; before the magnetometer's of the same time or later."""
        self._has_gyroscope = True
        self._gyroscope.append((t, complex(w[0], w[1])))
        if len(self._gyroscope) > 64:
            del self._gyroscope[:32]

    def update(self, t: float, field: FloatArray) -> Answer:
        """Take a reading of the magnetometer, (3,) uT, at time t, later than the last; return what is known now.

        A reading with a gap (NaN) is passed over. Raises `InputError` for time that runs backwards.
        """
        if self._filled and t <= self._t[-1]:
            raise InputError(f"streaming: time {t:.9g} s follows {self._t[-1]:.9g} s; expected ascending time")
        unknown = Answer(t - self.latency, np.nan, np.nan, t, np.nan, np.nan)
        if not (np.isfinite(field[0]) and np.isfinite(field[1]) and np.isfinite(field[2])):
            return unknown
        self._t[:-1] = self._t[1:]
        self._m[:-1] = self._m[1:]
        self._z[:-1] = self._z[1:]
        self._rates[:-1] = self._rates[1:]
        self._t[-1] = t
        self._m[-1] = field
        self._z[-1] = complex(field[0], field[1])
        self._rates[-1] = complex(np.nan, np.nan)
        self._filled += 1
        if self._has_gyroscope:
            self._interpolate()
        span = self.settings.window
        first = int(np.searchsorted(self._t, t - span + 0.5 * self._interval)) if self._filled >= self._t.size else 0
        if self._filled < self._t.size or self._t.size - first < self._t.size // 2:
            self._known = False
            return unknown
        return self._fit(first, unknown)

    def _fit(self, first: int, unknown: Answer) -> Answer:
        t, z = self._t[first:], self._z[first:]
        centre = 0.5 * (t[0] + t[-1])
        half = 0.5 * (t[-1] - t[0])
        if not self._known and not self._acquire(first, centre):
            return unknown
        self._carry(centre, half)
        x = (t - centre) / half
        u = self._u[: t.size]
        powers, parameters, covariance = self._powers, self._parameters, self._covariance
        turning = self._has_gyroscope and not self.fixed_axis
        rates = self._rates[first + 1 :]
        if turning and np.any(np.isnan(rates.real)):
            self._known = False
            return unknown
        u[:] = 1.0
        axial, along = 0.0, 0.0
        # the turning found in the last window starts this one: two rounds are as good as the batch's three
        for _ in range(2 if turning else 1):
            if turning:
                axial = self._axial(first)
                along = field_shape(t, centre, half, parameters, powers, axial, rates, _SUBSTEPS, u)
            variance, steps = fit_tone(x, z, u, parameters, covariance, powers, self.settings.ellipse_sd, 0.0, 12)
            if steps < 0:
                self._known = False
                return unknown
        if parameters[powers] < 0:
            parameters[powers] *= -1
            parameters[0] += pi
        s = self.settings
        amplitude, rate = parameters[powers], parameters[1] / half
        sd = sqrt(covariance[1, 1] * variance) / half
        sure = (
            amplitude > s.significance * sqrt(covariance[powers, powers] * variance)
            and sd < min(s.largest_sd, 0.25 * abs(rate))
            and variance < 0.1 * amplitude**2
            and abs(rate) * 2 * half >= 2 * pi * s.turns
        )
        self._known = bool(sure)
        if not sure:
            return unknown
        slack = 0.0
        if not self.fixed_axis:
            across = abs(self._axial(first)) if self.strength else abs(float(np.mean(self._m[first:, 2])))
            if turning:
                known_to = STRENGTH_SD * (self.strength or 0.0) ** 2 / max(across, 1.0) if self.strength else 20.0
                slack = abs(along) / amplitude * known_to
            else:
                slack = across / amplitude * float(tipping(s.precession_sd, rate))
        # slope of the phase's polynomial at its end, x = 1
        weights = np.zeros(parameters.size)
        weights[:powers] = np.arange(powers)
        rate_end = float(weights @ parameters) / half
        sd_end = sqrt(float(weights @ covariance @ weights) * variance) / half
        return Answer(centre, -rate, hypot(sd, slack), float(t[-1]), -rate_end, hypot(sd_end, slack))

    def _axial(self, first: int) -> float:
        mean = float(np.mean(self._m[first:, 2]))
        if self.strength is None:
            return mean
        return copysign(sqrt(max(self.strength**2 - self._parameters[self._powers] ** 2, 0.0)), mean)

    def _carry(self, centre: float, half: float) -> None:
        """Carry the phase's polynomial on to the new window."""
        if self._half == 0.0 or (centre == self._centre and half == self._half):
            self._centre, self._half = centre, half
            return
        powers = self._powers
        shift = (centre - self._centre) / self._half
        scale = half / self._half
        old = self._parameters[:powers].copy()
        new = np.zeros(powers)
        # p(shift + scale x), by Horner's rule on polynomials
        for coefficient in old[::-1]:
            raised = np.zeros(powers)
            raised[1:] = scale * new[:-1]
            new = raised + shift * new
            new[0] += coefficient
        self._parameters[:powers] = new
        self._centre, self._half = centre, half

    def _acquire(self, first: int, centre: float) -> bool:
        """Search as the batch does, at most every eighth sample while there is nothing to be found."""
        if self._wait > 0:
            self._wait -= 1
            return False
        span = float(self._t[-1] - self._t[first]) + self._interval
        found = fit_windows(
            self._t[first:], self._m[first:], np.array([centre]), _one_window(self.settings, span)
        )  # fmt: skip
        if not np.isfinite(found.phase_rate[0]):
            self._wait = 7
            return False
        half = 0.5 * float(self._t[-1] - self._t[first])
        self._parameters[:] = 0.0
        self._parameters[0] = found.phase[0]
        self._parameters[1] = found.phase_rate[0] * half
        if self._powers > 2:
            self._parameters[2] = 0.5 * found.chirp[0] * half**2
        self._parameters[self._powers] = found.amplitude[0]
        self._parameters[self._powers + 1] = found.offset[0].real
        self._parameters[self._powers + 2] = found.offset[0].imag
        self._centre, self._half = centre, half
        return True

    def _interpolate(self) -> None:
        """Fill p + i q at the middles of the sub-steps of the newest intervals, as far as the gyroscope has come."""
        if len(self._gyroscope) < 4:
            return
        times = np.array([reading[0] for reading in self._gyroscope])
        values = np.array([reading[1] for reading in self._gyroscope])
        for back in (1, 2, 3):
            if self._filled <= back or not np.isnan(self._rates[-back, 0].real):
                continue
            left, right = self._t[-back - 1], self._t[-back]
            at = left + (right - left) * (np.arange(_SUBSTEPS) + 0.5) / _SUBSTEPS
            if at[0] < times[0] or at[-1] > times[-1]:
                continue
            self._rates[-back] = _cubic(times, values, at)


def _cubic(times: FloatArray, values: ComplexArray, at: FloatArray) -> ComplexArray:
    """Lagrange's cubic through the four readings around each time (one-sided at the newest)."""
    first = np.clip(np.searchsorted(times, at) - 2, 0, times.size - 4)
    node = times[first[:, None] + np.arange(4)]
    out = np.zeros(at.size, dtype=complex)
    for i in range(4):
        weight = np.ones(at.size)
        for j in range(4):
            if i != j:
                weight *= (at - node[:, j]) / (node[:, i] - node[:, j])
        out += weight * values[first + i]
    return out


def _one_window(settings: LikelihoodSettings, span: float) -> LikelihoodSettings:
    return replace(settings, window=span, longest_window=span)
