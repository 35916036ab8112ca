"""Spin rate from centripetal acceleration: (12), with known error terms (8), and its worst-case envelope (11)."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from types import NoneType

import numpy as np
from numpy.typing import ArrayLike

from discsim.arrays import FloatArray, require_array, vector3
from discsim.clipping import step_of
from discsim.errors import InputError, require_type
from discsim.estimators.rate import YawRate
from discsim.estimators.readings import require_readings, require_sheet
from discsim.recording import Samples, SensorSheet

__all__ = ["AccelerometerErrors", "accelerometer", "envelope", "rate_with_known_terms"]

STANDARD_GRAVITY = 9.80665  # m/s^2; data sheets state biases and noise in g
_ERRORS = "AccelerometerErrors(...): without arguments the paper's"


@dataclass(frozen=True)
class AccelerometerErrors:
    """Worst-case figures of the accelerometer and its mount; the defaults are the paper's (Section 3, Eq. 13).

    Attributes
    ----------
    nonlinearity, cross_axis : float
        Largest absolute entries of S_T - I on and off its diagonal (13).
    bias : float
        Zero offset of x and y, m/s^2: 6 % of g, the 60 mg of an MPU-9250. (The 8 % of z does not enter a rate.)
    noise : float
        Bound on noise, m/s^2: 0.3 % of g. Widens the envelope; the standard deviation takes the stated noise instead.
    mount : float
        Installation error along each axis, m: 1 mm (or 5 mm).
    origin : float
        Specific force of the body's origin in the disc's plane, m/s^2, any direction. The paper's rate table has
        none (R'' = 0, level); in flight it is the drag and the part of lift that a tilt leaves in the plane.
    vertical : float
        Specific force along z, m/s^2, which the cross-axis term brings in: 1 g at rest and in level flight.
    """

    nonlinearity: float = 0.005
    cross_axis: float = 0.02
    bias: float = 0.06 * STANDARD_GRAVITY
    noise: float = 0.003 * STANDARD_GRAVITY
    mount: float = 0.001
    origin: float = 0.0
    vertical: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            require_type(value, Real, f"accelerometer {name}", "a number, zero or more")
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"accelerometer {name}: got {value:g}, expected zero or more")


def accelerometer(samples: Samples, sheet: SensorSheet, errors: AccelerometerErrors | None = None) -> YawRate:
    """Spin rate sample by sample, r = sqrt(a_x / -d_x), Eq. (12).

    ``samples.value`` is (n, 3) m/s^2, specific force in B, at ``sheet.position``, (3,) m in B. The paper's sensor sits
    on the negative x axis; elsewhere in the plane the component towards the axis of spin takes the place of a_x and
    the distance from it that of -d_x (on the negative x axis both are exactly (12)). The rate has no sign. Holds for
    r^2 well above p^2, q^2 and |dr/dt| (7); an installation error e in d_x scales the rate by sqrt(1 + e / d_x) (9).

    NaN where the component towards the axis is negative, or x or y is missing or at a limit; everywhere if the
    position is unknown or on the axis.

    The standard deviation is one-sided upwards, ``sqrt(r^2 + s) - r`` with s that of r^2: s / (2 r) at high rates,
    sqrt(s) at rest. s holds the stated noise and resolution, and bias, (13), mount and origin of ``errors``: bounds b,
    counted as uniform in [-b, b], b / sqrt(3). A stated uncertainty of the position takes the place of the mount
    error. All but the noise are the same from sample to sample. The bounds ``lower`` and ``upper`` are `envelope`'s.
    """
    require_readings(samples, "accelerometer")
    require_sheet(sheet, "accelerometer")
    require_type(errors, (AccelerometerErrors, NoneType), "errors", _ERRORS)
    errors = errors or AccelerometerErrors()
    unknown = np.full(len(samples), np.nan)
    if sheet.position is None or not np.hypot(*sheet.position[:2]) > 0:
        return YawRate("accelerometer", samples.t, unknown, unknown)
    inward, distance = _inward(sheet.position)
    at_limit = np.any(sheet.clipped(samples.value)[:, :2], axis=1)
    towards_axis = np.where(at_limit, np.nan, samples.value[:, :2] @ inward[:2])
    square = np.where(towards_axis >= 0, towards_axis, np.nan) / distance  # (12)
    rate = np.sqrt(square)

    sensitivity, tangential, vertical = _sensitivity_bounds(inward, errors)
    count = np.abs(inward).sum()  # 1 on an axis; a mount error and a bias act along each of x and y
    noise = np.hypot(sheet.noise_rms or 0.0, (sheet.resolution or step_of(samples.value)) / np.sqrt(12))
    fixed = np.array([errors.bias * count, errors.origin, tangential * errors.origin, vertical * errors.vertical])
    stated = sheet.sigma.get("position_m")
    mount = errors.mount * count / np.sqrt(3) if stated is None else float(np.max(stated))
    relative = (sensitivity**2 / 3) + (mount / distance) ** 2 * (1 + tangential**2)
    spread = np.sqrt((noise**2 + np.sum(fixed**2) / 3) / distance**2 + square**2 * relative)
    lower, upper = envelope(towards_axis, sheet.position, errors)
    return YawRate("accelerometer", samples.t, rate, np.sqrt(square + spread) - rate, lower=lower, upper=upper)


def rate_with_known_terms(
    samples: Samples,
    position: ArrayLike,
    *,
    offset: ArrayLike = (0.0, 0.0, 0.0),
    sensitivity: ArrayLike | None = None,
    bias: ArrayLike = (0.0, 0.0, 0.0),
    origin: ArrayLike = (0.0, 0.0, 0.0),
) -> FloatArray:
    """Spin rate by (8), with the error terms that are known, (n,) rad/s.

    ``position`` is d_d and ``offset`` d_eps of (2), (3,) m; ``sensitivity`` S_T of (4), (3, 3); ``bias`` b_A, (3,)
    m/s^2; ``origin`` the specific force of the body's origin in B, (3,) or (n, 3) m/s^2. (8) has R'' + g for it, where
    its g is the reaction: specific force is R'' - g, (0, 0, -9.8) at rest. As in `accelerometer` the component towards
    the axis of spin stands for x. With every term left at its default this is (12). NaN where the square is negative.

    Raises `InputError` for other shapes, if the position is on the axis, or the terms leave no distance from it.
    """
    require_readings(samples, "accelerometer")
    place = vector3(position, "position (m)")
    inward, _ = _inward(place)
    matrix = np.eye(3) if sensitivity is None else require_array(sensitivity, "sensitivity", "(3, 3)", (3, 3))
    row = inward @ matrix
    n = len(samples)
    force = require_array(origin, "origin", f"(3,) or ({n}, 3) m/s^2, a row for each of samples", (3,), (n, 3))
    numerator = (samples.value - vector3(bias, "bias (m/s^2)")) @ inward - force @ row
    arm = place + vector3(offset, "offset (m)")
    denominator = -float(row[:2] @ arm[:2])  # the centripetal acceleration has no z
    if not denominator > 0:
        raise InputError(f"position {place} m with its known terms is {denominator:g} m from the axis; expected more")
    return np.sqrt(np.where(numerator >= 0, numerator, np.nan) / denominator)


def envelope(
    towards_axis: FloatArray, position: ArrayLike, errors: AccelerometerErrors
) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest rate that the worst case of every error allows (11), each (n,) rad/s.

    ``towards_axis`` is the measured component towards the axis of spin (a_M,x of the paper), (n,) m/s^2. The square of
    the rate is (a - e_n) / (distance - e_d) of (9), monotone in each error, so its extremes stand at corners of the
    error box. Both e_n and e_d hold S_Ax: its two signs are tried one after the other, everything else is at its worst
    for the bound in question. For a level rate table (origin = 0) S_Ax leaves e_n, which is (10), and this is exactly
    (11).

    A negative smallest square gives 0. Both are NaN where even the largest is negative or the sample is NaN; the upper
    bound is infinite where the errors may place the sensor on the axis. Raises `InputError` for other types or shapes.
    """
    towards_axis = require_array(towards_axis, "towards_axis", "(n,) m/s^2, one component of the readings", (None,))
    require_type(errors, AccelerometerErrors, "errors", _ERRORS)
    inward, distance = _inward(vector3(position, "position (m)"))
    diagonal, tangential, vertical = _sensitivity_bounds(inward, errors)
    count = np.abs(inward).sum()
    smallest, largest = np.full(towards_axis.shape, np.inf), np.full(towards_axis.shape, -np.inf)
    for scale in (1 - diagonal, 1 + diagonal):
        numerator = (
            scale * errors.origin
            + tangential * errors.origin
            + vertical * errors.vertical
            + (errors.bias + errors.noise) * count
        )
        mount = (scale + tangential) * errors.mount * count
        longest, shortest = scale * distance + mount, scale * distance - mount
        low, high = towards_axis - numerator, towards_axis + numerator
        smallest = np.minimum(smallest, low / longest)  # the sign of a negative square is all that matters
        largest = np.maximum(largest, high / shortest if shortest > 0 else np.where(high > 0, np.inf, high))
    known = largest >= 0
    lower = np.where(known, np.sqrt(np.maximum(smallest, 0.0)), np.nan)
    return lower, np.sqrt(np.where(known, largest, np.nan))


def _inward(position: FloatArray) -> tuple[FloatArray, float]:
    """Return the unit vector in the plane from the sensor to the axis of spin, (3,), and the distance, m."""
    distance = float(np.hypot(position[0], position[1]))
    if not distance > 0:
        raise InputError(f"accelerometer position {position} m is on the axis of spin; expected it off the axis")
    return np.array([-position[0] / distance, -position[1] / distance, 0.0]), distance


def _sensitivity_bounds(inward: FloatArray, errors: AccelerometerErrors) -> tuple[float, float, float]:
    """Largest errors of the measured inward component per unit of inward, tangential and vertical specific force.

    On the x axis these are S_Ax, S_xy and S_xz of (13); elsewhere the projections of the box of (13).
    """
    x, y = np.abs(inward[:2])
    diagonal = errors.nonlinearity * (x**2 + y**2) + 2 * errors.cross_axis * x * y
    tangential = errors.cross_axis * (x**2 + y**2) + 2 * errors.nonlinearity * x * y
    return float(diagonal), float(tangential), float(errors.cross_axis * (x + y))
