"""Where a throw starts of which a path alone is known. Takes it; gives flights of the baseline along it, best first.

How the path bends tells how large the lift is and where it points, and so the spin axis, (20), (21). How that changes
along the path tells how fast the moment turns the axis, and so the spin. Flights of several spins to either side are
fitted to the path by least squares, first loosely.
"""

from __future__ import annotations

from contextlib import suppress
from functools import partial

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.frames import body_to_ned
from discsim.recording import Recording
from discsim.trajectory import Flight
from discsim.validation.identification.initial.path import Fixes, local_cubics, normals_of
from discsim.validation.identification.initial.release_from_forces import MOST
from discsim.validation.identification.initial.smoothing import GRID
from discsim.validation.identification.initial.trial_flights import (
    DOWN,
    HOPELESS,
    NO_FLIGHT,
    Flown,
    fitted,
    flown_high,
    unusual_axis,
    within,
)

__all__ = ["release_from_path"]

#: spins that are tried, rad/s, to either side
_SPINS = (30.0, 60.0, 110.0)
#: what is left of a path while it is fitted, m, one after the other, before its own noise; points that take part
_NARROWER, _POINTS = (0.3, 0.05), 120
#: flights whose axes part by less, rad, and whose spins by less, rad/s, are one
_ONE_AXIS, _ONE_SPIN = 0.02, 2.0
#: ordinary throws: rates across the axis and spin, rad/s; speed across what a single camera sees, m/s
_WOBBLE, _SPIN, _UNSEEN = 3.0, 80.0, 2.0
#: numbers by which a throw may be unusual: tilt, incidence, two rates across, spin, velocity
_OF_THROWS = 8
_SCALES = (0.1, 0.1, 0.1, 0.5, 0.5, 0.5, 0.1, 0.1, 0.5, 0.5, 10.0)
#: share of chi2 below which a step ends: the fit that begins here goes on
_GAIN = 1e-3


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
        left = partial(seen.left, sd=sd)
        fits = sorted((fitted(left, x, _SCALES, _GAIN) for x in found), key=lambda fit: float(fit.cost))
        found = _unlike([fit.x for fit in fits if fit.cost < fits[0].cost + HOPELESS])
    after = np.maximum(t - seen.t[0], 0.0)
    told: list[Flown] = []
    for x in found[:MOST]:
        with suppress(InputError):  # beyond the last point a flight may end that did not before
            motion = seen.flown(x, float(after.max()) + GRID).at(after)
            told.append(Flown(motion.position + DOWN, motion.velocity, motion.attitude, motion.rate))
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
        level = np.nanmedian(np.where(self.flat, 0.0, points), axis=0)
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
        return flown_high(self.recording, x[:3], x[3:6], (*x[6:8], 0.0), x[8:], duration)

    def left(self, x: FloatArray, sd: float) -> FloatArray:
        """Return what numbers (11,) leave of the points with noise of ``sd`` m, in standard deviations."""
        try:
            motion = self.flown(x, float(self.t[-1] - self.t[0]) + GRID).at(self.t - self.t[0])
        except InputError:
            return np.full(np.count_nonzero(self.seen) + _OF_THROWS, NO_FLIGHT)
        off = (motion.position + DOWN - self.points)[self.seen] / sd
        axis = body_to_ned(motion.attitude[:1])[0, :, 2]
        unusual = [
            *unusual_axis(axis, x[3:6]),
            *(x[8:10] / _WOBBLE),
            (abs(x[10]) - _SPINS[1]) / _SPIN,
            *np.where(self.flat, x[3:6] / _UNSEEN, 0.0),
        ]
        return within(np.concatenate([off, unusual]))


def _unlike(found: list[FloatArray]) -> list[FloatArray]:
    """Return numbers (11,) without those that end where better ones do."""
    kept: list[FloatArray] = []
    for x in found:
        if not any(
            np.linalg.norm((x - other)[6:8]) < _ONE_AXIS and abs(x[10] - other[10]) < _ONE_SPIN for other in kept
        ):
            kept.append(x)
    return kept
