"""The smoother's unknowns and equations: readings of the field as a motion of splines makes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.estimators.precession import tipping, transverse_rates
from discsim.estimators.spin_spline import SpinSpline
from discsim.estimators.tracking.track import RateRows, TrackingSettings
from discsim.estimators.turning_field import add_normal_equations, integrate
from discsim.recording import Samples

__all__ = ["Linear", "Problem", "Segment", "Turned"]


@dataclass(frozen=True)
class Segment:
    """One stretch of readings, m (n, 3) uT at times t (n,) s, and what is known of it.

    ``strength`` is the field's, uT; ``walk`` what the gyroscope's noise adds to the attitude, rad per root second;
    ``rows`` are other sensors' readings of the rate. ``decaying`` tells that the air slows the spin.
    """

    t: FloatArray
    m: FloatArray
    settings: TrackingSettings
    gyroscope: Samples | None = None
    strength: float | None = None
    fixed_axis: bool = False
    decaying: bool = True
    rows: Sequence[RateRows] = ()
    walk: float = 0.0


class Turned(NamedTuple):
    """What the model makes of the field, at times t (n,) and in the middle of sub-steps (k,).

    ``residual`` (n, 3) uT, ``psi`` (n,) the angle turned, ``field`` (n, 3) in B before the irons, ``attitude``
    (n, 3, 3), ``axes`` (k, 3, 3) of the frame that does not spin, ``turn`` (k, 2) cosine and sine of the angle.
    """

    residual: FloatArray
    psi: FloatArray
    field: FloatArray
    attitude: FloatArray
    axes: FloatArray
    turn: FloatArray


class Problem:
    """The least-squares problem of one segment: parameters, residuals and derivatives.

    Parameters in order: spin spline, transverse rates (bias and gain of p, q, and splines of what they do not show),
    field (3), hard iron (3), soft iron (6), calibrations of other sensors' rows.
    """

    def __init__(self, segment: Segment, top_rate: float, typical_rate: float = 0.0) -> None:
        t, settings, gyroscope = segment.t, segment.settings, segment.gyroscope
        fixed_axis, walk = segment.fixed_axis, segment.walk
        # copies, which may be written: compiled code would be compiled once more for what may not
        self.t, self.m, self.settings, self.rows = np.array(t), np.array(segment.m), settings, segment.rows
        self.strength, self.decaying = segment.strength, segment.decaying
        # a quarter of a radian per sub-step: the midpoint rule then errs by 1 % of the wobble's own share
        finest = min(0.005, 0.25 / max(top_rate, 1.0))
        # knots closer than the readings would be told by the prior alone
        spacing = max(settings.knots, float(np.median(np.diff(t))))
        self.spline = SpinSpline.over(float(t[0]), float(t[-1]), spacing)
        self.despun = gyroscope is None
        if gyroscope is not None:
            finest = max(finest, float(np.median(np.diff(t))) / MOST_SUBSTEPS)
            rates, self.substeps = transverse_rates(gyroscope, t, finest)
            self.w = np.where(np.isfinite(rates), rates, 0.0).ravel()
        else:
            self.substeps = min(max(1, int(np.ceil(float(np.median(np.diff(t))) / finest))), MOST_SUBSTEPS)
            self.w = np.zeros((t.size - 1) * self.substeps, dtype=complex)
        fraction = (np.arange(self.substeps) + 0.5) / self.substeps
        self.h = np.repeat(np.diff(t) / self.substeps, self.substeps)
        self.middle = (t[:-1, None] + np.diff(t)[:, None] * fraction).ravel()
        self.interval = np.repeat(np.arange(t.size - 1), self.substeps)
        self.first, self.weights = self.spline.local(self.middle)
        #: what the gyroscope's noise adds to the attitude, rad per root second; without one the whole rate is unknown
        self.walk = walk
        self.slow: SpinSpline | None = None
        if not fixed_axis and (gyroscope is None or walk > 0):
            self.slow = SpinSpline.over(float(t[0]), float(t[-1]), settings.precession_knots)
            self.slow_first, self.slow_weights = self.slow.local(self.middle)
        self.read = 0 if fixed_axis or gyroscope is None else 4
        transverse = self.read + (0 if self.slow is None else 2 * self.slow.size)
        sizes = [self.spline.size, transverse, 3, 3, 6] + [row.calibration.size for row in segment.rows]
        ends = np.cumsum(sizes)
        self.parts = [slice(int(end - size), int(end)) for size, end in zip(sizes, ends, strict=True)]
        self.size = int(ends[-1])
        self.fixed_axis = fixed_axis
        #: transverse rate that is expected where it is not read, rad/s: more at a slow spin
        self.precession = float(tipping(settings.precession, typical_rate / _EITHER_PART))
        #: least roughness: what a spin-down's time constant changes by may not be laid to an unseen precession
        self.least = 0.0 if self.slow is None or self.read else _CHANGE * typical_rate**2
        #: precision of each interval's roughness over the common one: small at the corner of a ramp or at a knock
        self.local = np.ones(self.spline.size - 2)

    # -------------------------------------------------------------------------------- prior

    def prior(self, precession: float) -> tuple[FloatArray, FloatArray]:
        """Return the precision (size, size) and mean (size,) of everything but the spin's roughness and strength."""
        s = self.settings
        precision = np.zeros((self.size, self.size))
        mean = np.zeros(self.size)
        spin, transverse, _, iron, soft = self.parts[:5]
        # a spline needs some prior where there are no data at all; this one says nothing: 1e4 rad/s
        precision[spin, spin] = np.eye(self.spline.size) * 1e-8
        if self.read:
            sd = np.repeat([s.gyroscope_bias, s.gyroscope_gain], 2)
            read = slice(transverse.start, transverse.start + self.read)
            precision[read, read] = np.diag(1 / sd**2)
        if self.slow is not None and self.read:
            # white noise of density walk^2, averaged over a knot's spacing
            noise = slice(transverse.start + self.read, transverse.stop)
            precision[noise, noise] = np.eye(2 * self.slow.size) * self.slow.spacing / self.walk**2
        elif self.slow is not None:
            distance = np.abs(np.subtract.outer(np.arange(self.slow.size), np.arange(self.slow.size)))
            # precession changes with the air's moment, over a second or two, about a level that stays; an axis that
            # tips faster changes the angle of attack, and so the moment, the sooner
            faster = self.precession / s.precession
            stays = 0.5 / faster
            correlation = stays + (1.0 - stays) * np.exp(-distance * self.slow.spacing * faster / 2.0)
            inverse = np.linalg.inv(correlation) / precession**2
            middle = transverse.start + self.slow.size
            precision[transverse.start : middle, transverse.start : middle] = inverse
            precision[middle : transverse.stop, middle : transverse.stop] = inverse
        precision[iron, iron] = np.eye(3) / s.hard_iron**2
        precision[soft, soft] = np.eye(6) / s.soft_iron**2
        for part, row in zip(self.parts[5:], self.rows, strict=True):
            precision[part, part] = np.diag(1 / row.prior**2)
            mean[part] = row.calibration
        return precision, mean

    def penalty(self) -> FloatArray:
        """Return the precision (spline size, spline size) of the spin for a roughness of one."""
        return self.spline.bend_precision(self.local)

    def bend_expected(self, x: FloatArray) -> FloatArray:
        """Return what second differences are expected to be, (spline size - 2,): r'' is white noise, about r'^2/r."""
        target = np.zeros(self.spline.size - 2)
        if self.decaying:
            c = x[self.parts[0]]
            level = (c[:-2] + c[1:-1] + c[2:]) / 3
            slope = (c[2:] - c[:-2]) / (2 * self.spline.spacing)
            bend = np.where(np.abs(level) > 3.0, slope**2 / np.where(np.abs(level) > 3.0, level, 1.0), 0.0)
            # steeper than a time constant of two seconds is no spin-down in air
            target = np.where(np.abs(slope) < 0.5 * np.abs(level), bend, 0.0) * np.sqrt(self.spline.spacing)
        return target

    # -------------------------------------------------------------------------------- model

    def evaluate(self, x: FloatArray) -> Turned:
        """Return what the model makes of the field at the parameters x."""
        spin, transverse, vector, iron, soft = self.parts[:5]
        nothing = np.zeros(0, dtype=complex)
        # the rates that a gyroscope shows, at no gain and no bias all zero where there is none
        shown, unread = nothing, nothing
        if self.read:
            bias, gain = complex(*x[transverse][:2]), complex(*x[transverse][2:4])
            shown = (1 + gain) * (self.w - bias)
        elif not self.despun:
            shown = self.w
        if self.slow is not None:
            real, imaginary = x[transverse][self.read :].reshape(2, -1)
            PQ = real + 1j * imaginary
            unread = np.einsum("ki,ki->k", self.slow_weights, PQ[self.slow_first[:, None] + np.arange(4)])
        n, k = self.t.size, self.middle.size
        C, psi = np.empty((n, 3, 3)), np.empty(n)
        axes, turn = np.empty((k, 3, 3)), np.empty((k, 2))
        integrate(
            self.t, self.substeps, self.first, self.weights, np.ascontiguousarray(x[spin]), shown, unread,
            C, psi, axes, turn,
        )  # fmt: skip
        turned = C @ x[vector]
        residual = self.m - turned @ (np.eye(3) + _symmetric(x[soft])).T - x[iron]
        return Turned(residual, psi, turned, C, axes, turn)

    def add_field(
        self, x: FloatArray, at: Turned, scale: FloatArray, information: FloatArray, right: FloatArray
    ) -> None:
        """Add the magnetometer's normal equations at x, each reading (n,) times ``scale``."""
        _, transverse, vector, _, soft = self.parts[:5]
        read = self.w - complex(*x[transverse][:2]) if self.read else np.zeros(0, dtype=complex)
        none = self.slow is None
        add_normal_equations(
            self.substeps, self.h, at.axes, at.attitude, np.eye(3) + _symmetric(x[soft]), x[vector], at.field,
            at.residual, scale, self.despun, self.first, self.weights, self.spline.size,
            self.first if none else self.slow_first, self.weights if none else self.slow_weights,
            0 if self.slow is None else self.slow.size, self.read, read, at.turn, information, right,
        )  # fmt: skip

    def evaluate_rows(self, x: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Return the whitened residual and derivative of each other sensor's rows."""
        out = []
        c = x[self.parts[0]]
        for part, row in zip(self.parts[5:], self.rows, strict=True):
            B = self.spline.basis(row.t)
            r = B @ c
            a = x[part]
            if row.kind == "linear":
                J = np.zeros((row.t.size, self.size))
                J[:, self.parts[0]] = (1 + a[0]) * B
                J[:, part.start] = r
                J[:, part.start + 1] = 1.0
                residual = row.value - (1 + a[0]) * r - a[1]
                out.append((residual / row.sd, J / row.sd[:, None]))
            else:
                B1 = self.spline.basis(row.t, 1)
                d = complex(a[0], a[1])
                shape = -(r**2) + 1j * (B1 @ c)
                error = row.value[:, 0] + 1j * row.value[:, 1] - shape * d - complex(a[2], a[3])
                J2 = np.zeros((row.t.size, self.size), dtype=complex)
                J2[:, self.parts[0]] = d * (-2 * r[:, None] * B + 1j * B1)
                J2[:, part.start] = shape
                J2[:, part.start + 1] = 1j * shape
                J2[:, part.start + 2] = 1.0
                J2[:, part.start + 3] = 1j
                sd = np.concatenate([row.sd, row.sd])
                residual = np.concatenate([error.real, error.imag]) / sd
                out.append((residual, np.concatenate([J2.real, J2.imag]) / sd[:, None]))
        return out


def _symmetric(s: FloatArray) -> FloatArray:
    return np.array([[s[0], s[1], s[2]], [s[1], s[3], s[4]], [s[2], s[4], s[5]]])


@dataclass(frozen=True)
class Linear:
    """The problem about its current point: data information, its right side, and the prior beside the roughness."""

    information: FloatArray
    right: FloatArray
    cost: float


#: Most sub-steps between readings: 0.7 s in steps of 5 ms, and at 100 Hz a quarter of a radian at 500 turns a second.
MOST_SUBSTEPS = 140


#: Turning of the axis along the field and across it, rms over six discs' throws from 1200 deg/s on, over that across it
#: alone, which `tipping` states: 7.9 over 6.4 rad^2/s^2 by the spin. An axis near the field turns along it faster.
_EITHER_PART = 1.25

#: Least spectral density of r'', over r^2, where precession is unseen: r'/r changes by a third of 1/18 s in 5 s.
_CHANGE = 5.0 * (0.33 / 18.0 / 5.0) ** 2
