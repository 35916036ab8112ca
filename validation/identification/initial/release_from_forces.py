"""Where a throw starts whose velocity neither a path nor a release tells: from the force felt and how the axis turns.

The sensors on board tell the attitude but for a turn about the field. How large the force is, where it points in the
disc, and how fast the spin axis is turned by the moment tell airspeed and angle of attack by the disc's coefficients,
(14) to (23), and gravity, which turns the path down, tells which way is up. All velocities of ordinary throws are
tried, with all turns about the field; the best is refined (Nelder and Mead, 1965).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from discsim.aerodynamics import air_wrench, wind
from discsim.arrays import FloatArray, within_half_turn
from discsim.compiled import compiled
from discsim.frames import body_to_ned
from discsim.parameters import PARAMETERS, Tables, flight_parameters, tables
from discsim.recording import Recording
from discsim.validation.identification.initial.attitude import Attitude
from discsim.validation.identification.initial.path import GUESSED_HEIGHT, SpecificForce, nearest_places
from discsim.validation.identification.initial.smoothing import smoothed

__all__ = ["ELEVATION", "INCIDENCE", "MOST", "SPEED", "TILT", "Told", "release_from_forces"]

#: how long after the first reading the motion is compared, s, how often, and over how long the axis's turning is
#: smoothed, so that nutation averages out
_LENGTH, _EVERY, _SMOOTHED = 0.8, 0.05, 0.1
#: what the baseline's air leaves of a force, m/s^2, and of the rate at which the axis turns, rad/s; each beside a share
#: of itself: hidden physics of ordinary size
_FORCE, _TURNING, _SHARE = 0.7, 0.1, 0.1
#: ordinary throws: speed m/s, and elevation, tilt of the axis and angle of attack, rad; means with deviations
SPEED, ELEVATION, TILT, INCIDENCE = (17.0, 7.0), (0.1, 0.25), (0.0, 0.6), (0.1, 0.3)
#: what is tried: azimuths and turns about the field in equal parts of a turn, elevations rad, speeds m/s
_AZIMUTHS, _TURNS = 24, 24
_ELEVATIONS = np.array([-0.3, -0.1, 0.05, 0.2, 0.4])
_SPEEDS = np.array([7.0, 9.0, 11.5, 14.0, 17.0, 20.0, 24.0, 29.0])
#: of an attitude of which no field tells anything: tilts, rad, and how many directions of each
_TILTS, _TILTED = (0.2, 0.45), 8
#: steps of the refinement: a turn, rad; azimuth and elevation, rad, and the logarithm of the speed; and how many
_STEP_OF_TURN, _STEPS, _TRIES = 0.15, (0.15, 0.1, 0.1), 200
#: most starts that are told; those whose turn and azimuth part by less, rad, are one; places in the table looked at
MOST, _BESIDE, _RANKED = 4, 0.6, 5000


@compiled
def _costs(
    flat: FloatArray,
    tables: Tables,
    attitude: FloatArray,
    force: FloatArray,
    turning: FloatArray,
    rate: FloatArray,
    starts: FloatArray,
) -> FloatArray:
    """Return what each start (c, 3) m/s in N costs, twice a negative log likelihood.

    ``attitude`` (m, 3, 3) takes the frame that does not spin to N, `_EVERY` s apart; ``force`` (m, 3) m/s^2 and
    ``turning`` (m, 2) rad/s are in that frame, NaN where nothing tells them; ``rate`` (m,) is the spin rate, rad/s.
    """
    p: Any = flat.view(PARAMETERS)[0]
    mass, gravity, height = p.disc.mass, p.environment.gravity, GUESSED_HEIGHT
    out = np.empty(starts.shape[0])
    for c in range(starts.shape[0]):
        north, east, down = starts[c, 0], starts[c, 1], starts[c, 2]
        speed = np.sqrt(north**2 + east**2 + down**2)
        tilt = np.arccos(min(max(attitude[0, 2, 2], -1.0), 1.0))
        cost = ((speed - SPEED[0]) / SPEED[1]) ** 2 + ((tilt - TILT[0]) / TILT[1]) ** 2
        cost += ((np.arcsin(-down / speed) - ELEVATION[0]) / ELEVATION[1]) ** 2
        for j in range(attitude.shape[0]):
            A = attitude[j]
            wn, we, wd = wind(p, tables, 0.0, 0.0, 0.0, height)
            a, b, d = north - wn, east - we, down - wd
            u = A[0, 0] * a + A[1, 0] * b + A[2, 0] * d
            v = A[0, 1] * a + A[1, 1] * b + A[2, 1] * d
            w = A[0, 2] * a + A[1, 2] * b + A[2, 2] * d
            if j == 0:
                incidence = np.arctan2(w, np.sqrt(u * u + v * v))
                cost += ((incidence - INCIDENCE[0]) / INCIDENCE[1]) ** 2
            P, Q = turning[j, 0], turning[j, 1]
            known = not np.isnan(P)
            X, Y, Z, L, M, _ = air_wrench(p, tables, height, u, v, w, P if known else 0.0, Q if known else 0.0, rate[j])
            fx, fy, fz = X / mass, Y / mass, Z / mass
            if known and rate[j] != 0.0:
                # what is slow of Ixx dP/dt + Izz r Q = L and Ixx dQ/dt - Izz r P = M
                spin = p.disc.Izz * rate[j]
                left = (P + M / spin) ** 2 + (Q - L / spin) ** 2
                cost += np.log1p(left / (_TURNING**2 + _SHARE**2 * (P * P + Q * Q)))
            if not np.isnan(force[j, 0]):
                gx, gy, gz = force[j, 0], force[j, 1], force[j, 2]
                left = (fx - gx) ** 2 + (fy - gy) ** 2 + (fz - gz) ** 2
                cost += np.log1p(left / (_FORCE**2 + _SHARE**2 * (gx * gx + gy * gy + gz * gz)))
                fx, fy, fz = gx, gy, gz
            north += _EVERY * (A[0, 0] * fx + A[0, 1] * fy + A[0, 2] * fz)
            east += _EVERY * (A[1, 0] * fx + A[1, 1] * fy + A[1, 2] * fz)
            down += _EVERY * (A[2, 0] * fx + A[2, 1] * fy + A[2, 2] * fz + gravity)
        out[c] = cost if np.isfinite(cost) else np.inf
    return out


class Told(NamedTuple):
    """A start: the rotation (3, 3) that the attitude in N still needs, and the velocity (3,) m/s in N."""

    turn: FloatArray
    velocity: FloatArray


def release_from_forces(
    recording: Recording, frame: Attitude, grid: FloatArray, G: FloatArray, force_felt: SpecificForce | None
) -> tuple[Told, ...]:
    """Return where a throw may start at its first reading, likeliest first, at most `MOST`.

    ``G`` (n, 3, 3) on ``grid`` (n,) takes the frame that does not spin, at the start, to N, but for a turn about the
    field, or where no magnetometer is on board for any tilt; ``force_felt`` is in that frame. None are returned where
    the disc's air is unknown, or neither accelerometer nor gyroscope tells anything.
    """
    disc, environment = recording.disc, recording.environment
    if disc is None or disc.aero is None or environment.air_density is None:
        return ()
    if frame.tumbling or (force_felt is None and frame.transverse is None):
        return ()
    t = np.arange(grid[0], min(grid[0] + _LENGTH, recording.end), _EVERY)
    if t.size < 2:
        return ()
    D = body_to_ned(frame.D_at(t))
    attitude = np.ascontiguousarray(G[nearest_places(grid, t)] @ D)
    force, turning = np.full((t.size, 3), np.nan), np.full((t.size, 2), np.nan)
    if force_felt is not None:
        there = np.column_stack([np.interp(t, force_felt.grid, column) for column in force_felt.force.T])
        force = np.einsum("nji,nj->ni", D, there)
    if frame.transverse is not None:
        W = frame.transverse * np.exp(1j * frame.psi)
        turning = smoothed(frame.grid, np.column_stack([W.real, W.imag]), t, _SMOOTHED)
    rate = np.interp(t, frame.grid, frame.r)
    given = flight_parameters(disc, environment), tables(disc)
    basis, turns = _turns(recording, frame)
    b = len(basis)

    def costs(turn: FloatArray, starts: FloatArray) -> FloatArray:
        turned = np.ascontiguousarray(_rotation(turn, basis) @ attitude)
        return np.asarray(_costs(*given, turned, force, turning, rate, starts))

    azimuths = 2.0 * np.pi / _AZIMUTHS * np.arange(_AZIMUTHS)
    tried = np.array([(a, e, np.log(V)) for a in azimuths for e in _ELEVATIONS for V in _SPEEDS])
    table = np.array([costs(turn, _velocities(tried)) for turn in turns])

    def cost(x: FloatArray) -> float:
        return float(costs(x[:b], _velocities(x[None, b:]))[0])

    found: list[tuple[float, FloatArray]] = []
    for which, start in _apart(table, turns, tried):
        first = np.array([*turns[which], *tried[start]])
        simplex = np.vstack([first, first + np.diag([*[_STEP_OF_TURN] * b, *_STEPS])])
        best = minimize(cost, first, method="Nelder-Mead", options={"initial_simplex": simplex, "maxfev": _TRIES})
        found.append((float(best.fun), best.x))
    found.sort(key=lambda item: item[0])
    return tuple(Told(_rotation(x[:b], basis), _velocities(x[None, b:])[0]) for _, x in found)


def _turns(recording: Recording, frame: Attitude) -> tuple[FloatArray, FloatArray]:
    """Return the axes (b, 3) in N about which the attitude is not known, and the turns (k, b) rad to be tried."""
    if (release := recording.release) is not None and release.roll is not None and release.pitch is not None:
        return np.empty((0, 3)), np.empty((1, 0))
    if frame.field is not None:
        field = recording.environment.magnetic_field
        n = np.asarray(field / max(float(np.linalg.norm(field)), 1e-9))
        return n[None], np.linspace(0.0, 2.0 * np.pi, _TURNS, endpoint=False)[:, None]
    around = 2.0 * np.pi / _TILTED * np.arange(_TILTED)
    tilts = [tilt * np.array([np.cos(a), np.sin(a)]) for tilt in _TILTS for a in around]
    return np.eye(3)[:2], np.array([np.zeros(2), *tilts])


def _rotation(turn: FloatArray, basis: FloatArray) -> FloatArray:
    return np.asarray(Rotation.from_rotvec(turn @ basis).as_matrix())


def _apart(table: FloatArray, turns: FloatArray, tried: FloatArray) -> list[tuple[int, int]]:
    """Return the places in a table of costs (k, c) of the best starts that are not beside one another."""
    found: list[tuple[int, int]] = []
    for place in np.argsort(table, axis=None)[:_RANKED]:
        which, start = (int(number) for number in np.unravel_index(place, table.shape))
        if len(found) == MOST or not np.isfinite(table[which, start]):
            break

        def near(other: tuple[int, int], which: int = which, start: int = start) -> bool:
            apart = [*(turns[which] - turns[other[0]]), tried[start, 0] - tried[other[1], 0]]
            return bool(np.all(np.abs(within_half_turn(np.array(apart))) < _BESIDE))

        if not any(near(other) for other in found):
            found.append((which, start))
    return found


def _velocities(numbers: FloatArray) -> FloatArray:
    """Return velocities (k, 3) in N of azimuths, elevations, rad, and logarithms of speeds (k, 3)."""
    azimuth, elevation, speed = numbers[:, 0], numbers[:, 1], np.exp(numbers[:, 2])
    level = speed * np.cos(elevation)
    return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), -speed * np.sin(elevation)])
