"""Where a throw starts of which a path alone is known. Takes it; gives flights of the baseline along it, best first.

How the path bends tells how large the lift is and where it points, and so the spin axis, (20), (21). How that changes
along the path tells how fast the moment turns the axis, and so the spin. Flights of several spins to either side are
fitted to the path by least squares, first loosely.
"""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from discsim.arrays import FloatArray
from discsim.disc import Release
from discsim.errors import InputError
from discsim.frames import body_to_ned
from discsim.recording import Recording
from discsim.trajectory import Flight, predict
from discsim.validation.identification.initial.path import Fixes, local_cubics, normals_of
from discsim.validation.identification.initial.release_from_field import Flown
from discsim.validation.identification.initial.release_from_forces import INCIDENCE, MOST, TILT
from discsim.validation.identification.initial.smoothing import GRID

__all__ = ["release_from_path"]

#: spins that are tried, rad/s, to either side
_SPINS = (30.0, 60.0, 110.0)
#: what is left of a path while it is fitted, m, one after the other, before its own noise; points that take part
_NARROWER, _POINTS = (0.3, 0.05), 120
#: half of chi2 by which a flight that is worse is not followed: 4 sd
_HOPELESS = 8.0
#: flights whose axes part by less, rad, and whose spins by less, rad/s, are one
_ONE_AXIS, _ONE_SPIN = 0.02, 2.0
#: ordinary throws: rates across the axis and spin, rad/s; speed across what a single camera sees, m/s
_WOBBLE, _SPIN, _UNSEEN = 3.0, 80.0, 2.0
#: numbers by which a throw may be unusual: tilt, incidence, two rates across, spin, velocity
_OF_THROWS = 8
_SCALES = (0.1, 0.1, 0.1, 0.5, 0.5, 0.5, 0.1, 0.1, 0.5, 0.5, 10.0)
_STEP, _TRIES = 1e-4, 15
#: share of chi2 below which a step ends: the fit that begins here goes on
_GAIN = 1e-3
#: error with which a flight is flown, and how high above the ground, where it never ends, m
_TOLERANCE, _HIGH = 1e-5, 1e4
#: what a flight costs, in standard deviations a number, that cannot be flown
_NO_FLIGHT = 30.0


def release_from_path(recording: Recording, t: FloatArray) -> tuple[Flown, ...]:
    """Return flights at instants t (k,) s that a track or a receiver may have seen, at most `MOST`.

    A coordinate that was not seen is taken to change little. None are returned where the disc's air is unknown, or
    fewer than eight points were seen.
    """
    disc, environment = recording.disc, recording.environment
    sensor = next((sensor for sensor in ("gps", "track") if sensor in recording), None)
    if sensor is None or disc is None or disc.aero is None or environment.air_density is None:
        return ()
    samples, sheet = recording.samples[sensor], recording.sheets[sensor]
    points = samples.value[:, :3]
    here = np.isfinite(points).sum(axis=1) > 1
    if np.count_nonzero(here) < 8 or np.ptp(samples.t[here]) < 3 * GRID:
        return ()
    every = max(1, np.count_nonzero(here) // _POINTS)
    seen = _Path(recording, samples.t[here][::every], points[here][::every])
    found = [x for spin in _SPINS for x in (seen.start(spin), seen.start(-spin))]
    for sd in (*_NARROWER, sheet.noise_rms or _NARROWER[-1]):
        fits = sorted((_least(seen, x, sd) for x in found), key=lambda fit: float(fit.cost))
        found = _unlike([fit.x for fit in fits if fit.cost < fits[0].cost + _HOPELESS])
    after = np.maximum(t - seen.t[0], 0.0)
    told: list[Flown] = []
    for x in found[:MOST]:
        with suppress(InputError):  # beyond the last point a flight may end that did not before
            motion = seen.flown(x, float(after.max()) + GRID).at(after)
            down = np.array([0.0, 0.0, _HIGH])
            told.append(Flown(motion.position + down, motion.velocity, motion.attitude, motion.rate))
    return tuple(told)


class _Path:
    """A path that was seen, and what a flight leaves of it.

    A flight's numbers (11,): position, m, and velocity, m/s, in N, roll and pitch, rad, and the body rates, rad/s, at
    the first point.
    """

    def __init__(self, recording: Recording, t: FloatArray, points: FloatArray) -> None:
        self.recording, self.t, self.points = recording, t, points
        self.seen = np.isfinite(points)
        self.flat = ~self.seen.any(axis=0)
        level = np.where(self.flat, 0.0, np.nanmedian(np.where(self.flat, 0.0, points), axis=0))
        nothing = np.full(points.shape, np.nan)
        fixes = Fixes(t, np.where(self.seen, points, level), nothing, 0.05, 0.1)
        self.cubic = local_cubics(fixes, t[:1])[0]

    def start(self, spin: float) -> FloatArray:
        """Return the numbers (11,) of a flight of a spin, rad/s, whose axis the lift at its start tells."""
        position, velocity, acceleration = self.cubic[:3]
        force = acceleration - np.array([0.0, 0.0, self.recording.environment.gravity])
        axis = normals_of(self.recording, velocity[None], force[None])
        z = np.array([0.0, 0.0, 1.0]) if axis is None else axis[0] / max(float(np.linalg.norm(axis[0])), 1e-9)
        roll, pitch = np.arctan2(-z[1], max(z[2], 0.1)), np.arcsin(np.clip(z[0], -0.9, 0.9))
        return np.array([*position, *velocity, roll, pitch, 0.0, 0.0, spin])

    def flown(self, x: FloatArray, duration: float) -> Flight:
        """Return the baseline's flight of numbers (11,) over ``duration`` s, high above the ground."""
        release = Release(
            position=x[:3] - np.array([0.0, 0.0, _HIGH]),
            velocity=x[3:6],
            roll=float(x[6]),
            pitch=float(x[7]),
            yaw=0.0,
            body_rate=x[8:],
        )
        disc = self.recording.disc
        assert disc is not None
        environment = self.recording.environment
        return predict(disc, environment, release, duration=duration, rtol=_TOLERANCE, atol=_TOLERANCE)

    def left(self, x: FloatArray, sd: float) -> FloatArray:
        """Return what numbers (11,) leave of the points with noise of ``sd`` m, in standard deviations."""
        try:
            motion = self.flown(x, float(self.t[-1] - self.t[0]) + GRID).at(self.t - self.t[0])
        except InputError:
            return np.full(np.count_nonzero(self.seen) + _OF_THROWS, _NO_FLIGHT)
        off = (motion.position + np.array([0.0, 0.0, _HIGH]) - self.points)[self.seen] / sd
        axis = body_to_ned(motion.attitude[:1])[0, :, 2]
        speed = max(float(np.linalg.norm(x[3:6])), 1e-9)
        unusual = [
            (np.arccos(np.clip(axis[2], -1.0, 1.0)) - TILT[0]) / TILT[1],
            (np.arcsin(np.clip(x[3:6] @ axis / speed, -1.0, 1.0)) - INCIDENCE[0]) / INCIDENCE[1],
            *(x[8:10] / _WOBBLE),
            (abs(x[10]) - _SPINS[1]) / _SPIN,
            *np.where(self.flat, x[3:6] / _UNSEEN, 0.0),
        ]
        return np.asarray(np.nan_to_num(np.concatenate([off, unusual]), nan=_NO_FLIGHT))


def _unlike(found: list[FloatArray]) -> list[FloatArray]:
    """Return numbers (11,) without those that end where better ones do."""
    kept: list[FloatArray] = []
    for x in found:
        if not any(
            np.linalg.norm((x - other)[6:8]) < _ONE_AXIS and abs(x[10] - other[10]) < _ONE_SPIN for other in kept
        ):
            kept.append(x)
    return kept


def _least(path: _Path, x: FloatArray, sd: float) -> Any:
    left = partial(path.left, sd=sd)
    return least_squares(
        left, x, diff_step=[_STEP] * x.size, max_nfev=_TRIES, x_scale=_SCALES, loss="soft_l1", ftol=_GAIN, xtol=_GAIN
    )
