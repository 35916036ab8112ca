"""Where a throw may start by its magnetometer alone. Takes the frame that does not spin; gives flights, best first.

The field tells how the spin axis stands to it at each instant, and how fast the disc spins. Which way the throw went,
and how fast, shows only by what the air does to both. So flights of the baseline are flown from many starts, and the
best of them fitted to the two by least squares.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import product

import numpy as np

from discsim.arrays import FloatArray, within_half_turn
from discsim.errors import InputError
from discsim.frames import body_to_ned, euler_angles, multiply, to_body, turn
from discsim.recording import Recording
from discsim.trajectory import Flight
from discsim.validation.identification.initial.attitude import Attitude, states_from
from discsim.validation.identification.initial.path import GUESSED_HEIGHT
from discsim.validation.identification.initial.release_from_forces import ELEVATION, MOST, SPEED
from discsim.validation.identification.initial.smoothing import GRID, Readings
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

__all__ = ["release_from_field"]

#: what smoothing leaves, but at the ends, of the cosine between axis and field and of the spin rate, rad/s, with 0.7 uT
#: of noise
_COSINE, _RATE = 0.005, 0.15
#: what is tried: turns about the field and azimuths in equal parts of a turn, angles of attack rad, speeds m/s
_TURNS, _AZIMUTHS = 12, 12
_INCIDENCES, _SPEEDS = (0.0, 0.15), (11.0, 16.0, 23.0)
#: starts tilted or rising beyond this are none of throws, rad
_STEEPEST, _RISING = 1.3, 0.7
#: starts whose turn and azimuth part by less, rad, are one; how many are fitted
_BESIDE, _FITTED = 0.6, 10
#: noise, uT, in which a flight is fitted to the field's three axes, one after the other; readings that take part
_NARROWER, _READINGS = (10.0, 3.0, 1.0), 250
#: flights whose velocities part by less, m/s, are one
_ONE = 0.5
_SCALES = (0.3, 0.3, 0.1, 0.15, 0.3, 0.3, 0.3, 0.03)
#: sine between axis and field below which the turn between them has no axis
_LEAST = 1e-6


def release_from_field(
    recording: Recording, frame: Attitude, grid: FloatArray, G: FloatArray, t: FloatArray
) -> tuple[Flown, ...]:
    """Return flights at instants t (k,) s that the field's readings may have been made on, at most `MOST`.

    ``G`` (n, 3, 3) on ``grid`` (n,) takes the frame that does not spin, at the start, to N, but for a turn about the
    field. None are returned where the disc's air is unknown, or no field was read.
    """
    disc, environment = recording.disc, recording.environment
    unknown = disc is None or disc.aero is None or environment.air_density is None
    if unknown or frame.field is None or frame.tumbling or not np.any(environment.magnetic_field):
        return ()
    if grid[-1] - grid[0] < 3 * GRID:
        return ()
    seen = _Seen(recording, frame, frame.field, np.arange(grid[0], grid[-1], GRID), grid, G)
    found = [np.append(fitted(seen.slow, x, _SCALES).x, 0.0) for x in _best(seen.slow, seen.tried())]
    for sd in _NARROWER:
        fits = [fitted(partial(seen.whole, sd=sd), x, (*_SCALES, _SCALES[0])) for x in _unlike(found)]
        fits.sort(key=lambda fit: fit.cost)
        found = [fit.x for fit in fits if fit.cost < fits[0].cost + HOPELESS]
    after = np.maximum(t - seen.t[0], 0.0)
    read = states_from(recording, frame, grid, G, t)
    told = list[Flown]()
    for x in _unlike(found)[:MOST]:
        with suppress(InputError):  # beyond the last reading a flight may end that did not before
            told.append(_beside(seen.flown(x, float(after.max()) + GRID), after, read, seen.n))
    return tuple(told)


class _Seen:
    """What the field tells of a throw, and what a flight leaves of it.

    A flight's numbers (8,): a turn about the field, azimuth and elevation, rad, the logarithm of the speed, the body
    rates across the axis and what the spin rate differs by, rad/s, and by how much nearer the field the axis begins,
    rad: smoothing tells neither end well.
    """

    def __init__(
        self, recording: Recording, frame: Attitude, read: Readings, t: FloatArray, grid: FloatArray, G: FloatArray
    ) -> None:
        self.recording, self.t = recording, t
        self.field = recording.environment.magnetic_field
        self.n = np.asarray(self.field / np.linalg.norm(self.field))
        attitude = states_from(recording, frame, grid, G, t)[0]
        self.first = attitude[0]
        level = np.cross(body_to_ned(self.first)[:, 2], self.n)
        self.across = level / max(float(np.linalg.norm(level)), _LEAST)
        self.cosine = body_to_ned(attitude)[:, :, 2] @ self.n
        self.rate = np.interp(t, frame.grid, frame.r)
        every = max(1, len(read.t) // _READINGS)
        self.read = Readings(read.t[::every], read.value[::every])
        release = recording.release
        self.stated = None if release is None else release.velocity
        self.sigma = 1.0 if release is None else float(np.max(release.sigma.get("velocity_ned_m_s", 1.0)))

    def flown(self, x: FloatArray, duration: float) -> Flight:
        """Return the baseline's flight of numbers (8,) or more, over ``duration`` s."""
        begun = multiply(turn(x[7] * self.across), self.first)
        roll, pitch, yaw = euler_angles(multiply(turn(x[0] * self.n), begun))
        position, rate = np.array([0.0, 0.0, -GUESSED_HEIGHT]), np.array([x[4], x[5], self.rate[0] + x[6]])
        return flown_high(self.recording, position, _velocity(x[1:4]), (roll, pitch, yaw), rate, duration)

    def slow(self, x: FloatArray) -> FloatArray:
        """Return what numbers (8,) leave of cosine and spin rate, in standard deviations.

        The rate is that of the field's turning in the disc, which an axis that moves adds to.
        """
        try:
            motion = self.flown(x, self.t[-1] - self.t[0]).at(self.t - self.t[0])
        except InputError:
            return np.full(2 * self.t.size + 4, NO_FLIGHT)
        axis = body_to_ned(motion.attitude)[:, :, 2]
        field = to_body(motion.attitude, self.n)
        turned = -np.diff(np.arctan2(field[:, 1], field[:, 0])) - GRID * 0.5 * (self.rate[1:] + self.rate[:-1])
        slips = within_half_turn(turned) / GRID
        off = [(axis @ self.n - self.cosine) / _COSINE, slips / _RATE]
        return within(np.concatenate([*off, self._unusual(axis[0], _velocity(x[1:4]))]))

    def whole(self, x: FloatArray, sd: float) -> FloatArray:
        """Return what numbers (9,), the last an angle of the spin, rad, leave of readings with noise of ``sd`` uT."""
        times = np.maximum(self.read.t - self.t[0], 0.0)
        try:
            motion = self.flown(x, float(times[-1]) + GRID).at(times)
        except InputError:
            return np.full(self.read.value.size + 5, NO_FLIGHT)
        shown = to_body(multiply(motion.attitude, turn(np.array([0.0, 0.0, x[8]]))), self.field)
        axis = body_to_ned(motion.attitude[:1])[0, :, 2]
        off = ((shown - self.read.value) / sd).ravel()
        return within(np.concatenate([off, self._unusual(axis, _velocity(x[1:4]))]))

    def _unusual(self, axis: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return how far from ordinary throws, or from what is stated, a start is, in standard deviations (5,)."""
        speed = float(np.linalg.norm(velocity))
        if self.stated is None:
            told = [(speed, SPEED), (np.arcsin(-velocity[2] / speed), ELEVATION), (0.0, (0.0, 1.0))]
        else:
            told = [(one, (mean, self.sigma)) for one, mean in zip(velocity, self.stated, strict=True)]
        return np.array([*unusual_axis(axis, velocity), *((value - mean) / sd for value, (mean, sd) in told)])

    def tried(self) -> Iterator[FloatArray]:
        """Yield numbers (8,) to try: ordinary throws, or the stated velocity, at turns about the field."""
        first = body_to_ned(self.first)[:, 2]
        for angle in 2.0 * np.pi / _TURNS * np.arange(_TURNS):
            axis = body_to_ned(turn(angle * self.n)) @ first
            if np.arccos(np.clip(axis[2], -1.0, 1.0)) > _STEEPEST:
                continue
            if self.stated is not None:
                yield np.array([angle, *_numbers(self.stated), 0.0, 0.0, 0.0, 0.0])
                continue
            for azimuth, incidence, speed in product(np.arange(_AZIMUTHS), _INCIDENCES, _SPEEDS):
                level = np.array([np.cos(turned := 2.0 * np.pi / _AZIMUTHS * azimuth), np.sin(turned), 0.0])
                along = level - axis * (level @ axis)
                way = np.cos(incidence) * along / np.linalg.norm(along) + np.sin(incidence) * axis
                if abs(np.arcsin(-way[2]) - ELEVATION[0]) <= _RISING:
                    yield np.array([angle, *_numbers(speed * way), 0.0, 0.0, 0.0, 0.0])


def _unlike(found: Sequence[FloatArray]) -> list[FloatArray]:
    """Return numbers (9,) without those that end where better ones do."""
    kept: list[FloatArray] = []
    for x in found:
        if not any(np.linalg.norm(_velocity(x[1:4]) - _velocity(other[1:4])) < _ONE for other in kept):
            kept.append(x)
    return kept


def _best(left: Callable[[FloatArray], FloatArray], tried: Iterator[FloatArray]) -> list[FloatArray]:
    """Return the best of starts (8,) that are not beside one another."""
    found: list[FloatArray] = []
    for x in sorted(tried, key=lambda x: float(np.sum(np.minimum(np.abs(left(x)), NO_FLIGHT) ** 2))):
        apart = [within_half_turn(x[:2] - other[:2]) for other in found]
        if not any(np.all(np.abs(off) < _BESIDE) for off in apart):
            found.append(x)
        if len(found) == _FITTED:
            break
    return found


def _velocity(numbers: FloatArray) -> FloatArray:
    """Return the velocity (3,) in N of an azimuth, an elevation, rad, and the logarithm of a speed (3,)."""
    azimuth, elevation, speed = numbers[0], numbers[1], np.exp(numbers[2])
    level = speed * np.cos(elevation)
    return np.array([level * np.cos(azimuth), level * np.sin(azimuth), -speed * np.sin(elevation)])


def _numbers(velocity: FloatArray) -> tuple[float, float, float]:
    """Return azimuth and elevation, rad, and the logarithm of the speed of a velocity (3,) in N."""
    speed = float(np.linalg.norm(velocity))
    return float(np.arctan2(velocity[1], velocity[0])), float(np.arcsin(-velocity[2] / speed)), float(np.log(speed))


def _beside(flight: Flight, t: FloatArray, read: tuple[FloatArray, FloatArray], n: FloatArray) -> Flown:
    """Return a flight's states at t (k,) s, turned about the axis to where the field in the disc's plane was ``read``.

    The angle turned is read far better than a flight that is about right tells it.
    """
    motion = flight.at(t)
    own, there = to_body(motion.attitude, n), to_body(read[0], n)
    ahead = np.arctan2(own[:, 1], own[:, 0]) - np.arctan2(there[:, 1], there[:, 0])
    attitude = multiply(motion.attitude, turn(ahead[:, None] * np.array([0.0, 0.0, 1.0])))
    across = (motion.rate[:, 0] + 1j * motion.rate[:, 1]) * np.exp(-1j * ahead)
    rate = np.column_stack([across.real, across.imag, read[1][:, 2]])
    return Flown(motion.position + DOWN, motion.velocity, attitude, rate)
