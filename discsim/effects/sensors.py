"""Effects of sensors and clocks that a baseline leaves out.

Functions take arrays of readings (..., 3) in B and return new ones. Order of the chain: soft iron, then hard iron and
stray field; sensitivity, then bias and drift; then lag, noise, rounding, clipping.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled

__all__ = [
    "AccelerometerBias",
    "AccelerometerSaturation",
    "BiasDrift",
    "ClockRate",
    "CrossAxis",
    "DroppedSamples",
    "GSensitivity",
    "GyroscopeBias",
    "HardIron",
    "Lag",
    "Latency",
    "PositionOffset",
    "Scale",
    "SoftIron",
    "StrayField",
    "bias_drift",
    "g_sensitivity",
    "hard_iron",
    "lag",
    "sensitivity",
    "soft_iron",
    "stray_field",
    "true_time",
]


class HardIron(NamedTuple):
    """Field of the sensor's own magnetised surroundings, constant in B (mag.hard_iron)."""

    bx_uT: float = 0.0
    by_uT: float = 0.0
    bz_uT: float = 0.0


def hard_iron(effect: HardIron, m: FloatArray) -> FloatArray:
    """Return m + b, (..., 3) uT."""
    return np.add(m, effect)


class SoftIron(NamedTuple):
    """Surroundings that bend the field, ``m -> (I + S) m`` with S symmetric (mag.soft_iron)."""

    sxx: float = 0.0
    sxy: float = 0.0
    sxz: float = 0.0
    syy: float = 0.0
    syz: float = 0.0
    szz: float = 0.0


def soft_iron(effect: SoftIron, m: FloatArray) -> FloatArray:
    """Return (I + S) m, (..., 3) uT."""
    xx, xy, xz, yy, yz, zz = effect
    S = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.add(m, np.matmul(m, S))  # S is symmetric


class StrayField(NamedTuple):
    """A field fixed in N that dies out with height, ``b exp(-h/height)`` (mag.stray_field)."""

    bn_uT: float = 0.0
    be_uT: float = 0.0
    bd_uT: float = 0.0
    height_m: float = 1.0


def stray_field(effect: StrayField, h: FloatArray) -> FloatArray:
    """Return the added field in N, (..., 3) uT, at heights h (...,) m above ground."""
    decay = np.exp(-np.maximum(h, 0.02) / effect.height_m)
    return np.multiply(decay[..., None], effect[:3])


class Lag(NamedTuple):
    """First-order lag in B before noise, ``tau y' = x - y`` (mag.lag, accel.lag, gyro.lag)."""

    tau_s: float = 0.0


@compiled
def _lagged(t: FloatArray, x: FloatArray, y0: FloatArray, tau: float) -> FloatArray:
    y = np.empty_like(x)
    y[0] = y0
    for k in range(t.size - 1):
        h = t[k + 1] - t[k]
        decay = np.exp(-h / tau)
        for i in range(x.shape[1]):
            slope = (x[k + 1, i] - x[k, i]) / h
            # exact for an input that runs linearly over the step
            y[k + 1, i] = x[k + 1, i] - slope * tau + (y[k, i] - x[k, i] + slope * tau) * decay
    return y


def lag(effect: Lag, t: FloatArray, x: FloatArray, y0: FloatArray | None = None) -> FloatArray:
    """Return the lagged signal at times t (n,) s of an input x (n, k) linear between them.

    y0 (k,) is the output at t[0]; absent, the sensor has settled on x[0].
    """
    if effect.tau_s <= 0.0:
        return x
    return _lagged(t, np.ascontiguousarray(x), np.array(x[0] if y0 is None else y0, dtype=float), effect.tau_s)


class PositionOffset(NamedTuple):
    """The accelerometer sits at its stated position plus this (accel.position_offset)."""

    dx_m: float = 0.0
    dy_m: float = 0.0
    dz_m: float = 0.0


class AccelerometerBias(NamedTuple):
    """Constant bias (accel.bias)."""

    bx_m_s2: float = 0.0
    by_m_s2: float = 0.0
    bz_m_s2: float = 0.0


class BiasDrift(NamedTuple):
    """Bias growing linearly from zero, a warm-up (accel.bias_drift)."""

    bx_m_s3: float = 0.0
    by_m_s3: float = 0.0
    bz_m_s3: float = 0.0


def bias_drift(effect: BiasDrift, t: FloatArray) -> FloatArray:
    """Return the bias (n, 3) m/s^2 at times t (n,) s since the start."""
    return np.multiply(t[:, None], effect)


class Scale(NamedTuple):
    """Scale error per axis, ``f -> (1 + s) f`` (accel.scale, gyro.scale)."""

    sx: float = 0.0
    sy: float = 0.0
    sz: float = 0.0


class CrossAxis(NamedTuple):
    """Off-diagonal terms of S_T, Eq. (4) (accel.cross_axis)."""

    sxy: float = 0.0
    sxz: float = 0.0
    syx: float = 0.0
    syz: float = 0.0
    szx: float = 0.0
    szy: float = 0.0


def sensitivity(scale: Scale, cross: CrossAxis = CrossAxis()) -> FloatArray:  # noqa: B008 - a named tuple is immutable
    """Return S_T (3, 3) of Eq. (4): reading = S_T f."""
    return np.array(
        [
            [1.0 + scale.sx, cross.sxy, cross.sxz],
            [cross.syx, 1.0 + scale.sy, cross.syz],
            [cross.szx, cross.szy, 1.0 + scale.sz],
        ]
    )


class AccelerometerSaturation(NamedTuple):
    """Clips below the stated range (accel.saturation)."""

    limit_m_s2: float = float("inf")


class GyroscopeBias(NamedTuple):
    """Constant bias (gyro.bias)."""

    bx_rad_s: float = 0.0
    by_rad_s: float = 0.0
    bz_rad_s: float = 0.0


class GSensitivity(NamedTuple):
    """Rates that specific force fakes, ``w_i += k_i f_i``, f at the accelerometer's position (gyro.g_sensitivity)."""

    kx: float = 0.0
    ky: float = 0.0
    kz: float = 0.0


def g_sensitivity(effect: GSensitivity, f: FloatArray) -> FloatArray:
    """Return the added rate (..., 3) rad/s for specific force f (..., 3) m/s^2."""
    return np.multiply(f, effect)


class ClockRate(NamedTuple):
    """A clock that runs wrong, ``written time = ratio x true time``."""

    ratio: float = 1.0


def true_time(effect: ClockRate, written: FloatArray) -> FloatArray:
    """Return when a sample written as ``written`` (n,) s was taken."""
    return written / effect.ratio


class DroppedSamples(NamedTuple):
    """Samples lost at random, the rest written at the nominal spacing (mag and accel.dropped_samples)."""

    fraction: float = 0.0


class Latency(NamedTuple):
    """A fix stamped t shows the state at t - delay (gps.latency)."""

    delay_s: float = 0.0
