"""Flights of the baseline that are tried as a throw's start: flown high above the ground, fitted by least squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from discsim.arrays import FloatArray
from discsim.disc import Release
from discsim.recording import Recording
from discsim.trajectory import Flight, predict
from discsim.validation.identification.initial.release_from_forces import INCIDENCE, TILT

__all__ = ["DOWN", "HOPELESS", "NO_FLIGHT", "Flown", "fitted", "flown_high", "unusual_axis", "within"]

#: from where a trial is flown, high above the ground, where it never ends, to where it was thrown, m
DOWN = np.array([0.0, 0.0, 1e4])
#: error with which a trial is flown
_TOLERANCE = 1e-5
#: what a flight costs, in standard deviations a number, that cannot be flown
NO_FLIGHT = 30.0
#: half of chi2 by which a flight that is worse is not followed: 4 sd
HOPELESS = 8.0
#: step of the differences that stand for derivatives, as a share of a number, and how many steps a fit takes
_STEP, _TRIES = 1e-4, 15
#: share of chi2 below which a fit ends, as scipy has it
_GAIN = 1e-8


class Flown(NamedTuple):
    """States of a flight: position (k, 3) m and velocity (k, 3) m/s in N, attitude (k, 4), rate (k, 3) rad/s in B."""

    position: FloatArray
    velocity: FloatArray
    attitude: FloatArray
    rate: FloatArray


def flown_high(
    recording: Recording,
    position: FloatArray,
    velocity: FloatArray,
    angles: Sequence[float | FloatArray],
    rate: FloatArray,
    duration: float,
) -> Flight:
    """Return the baseline's flight from a position (3,) m, `DOWN` below where it is flown.

    Velocity (3,) m/s, roll, pitch and yaw, rad, and body rates (3,) rad/s are those at release; it lasts ``duration``
    s. Raises `InputError` where it cannot be flown.
    """
    roll, pitch, yaw = (float(angle) for angle in angles)
    release = Release(position=position - DOWN, velocity=velocity, roll=roll, pitch=pitch, yaw=yaw, body_rate=rate)
    assert recording.disc is not None
    return predict(recording.disc, recording.environment, release, duration=duration, rtol=_TOLERANCE, atol=_TOLERANCE)


def fitted(
    left: Callable[[FloatArray], FloatArray], x: FloatArray, scales: Sequence[float], gain: float = _GAIN
) -> Any:
    """Return scipy's least squares of what numbers (k,) leave, from ``x``, up to a step that gains a share of chi2."""
    return least_squares(
        left, x, diff_step=[_STEP] * x.size, max_nfev=_TRIES, x_scale=scales, loss="soft_l1", ftol=gain, xtol=gain
    )


def within(off: FloatArray) -> FloatArray:
    """Return what a flight leaves (n,) with `NO_FLIGHT` for what is not finite."""
    return np.asarray(np.nan_to_num(off, nan=NO_FLIGHT, posinf=NO_FLIGHT, neginf=-NO_FLIGHT))


def unusual_axis(axis: FloatArray, velocity: FloatArray) -> list[float]:
    """Return how far tilt and angle of attack of a start are from ordinary throws, in standard deviations."""
    speed = max(float(np.linalg.norm(velocity)), 1e-9)
    tilt = np.arccos(np.clip(axis[2], -1.0, 1.0))
    incidence = np.arcsin(np.clip(velocity @ axis / speed, -1.0, 1.0))
    return [(tilt - TILT[0]) / TILT[1], (incidence - INCIDENCE[0]) / INCIDENCE[1]]
