"""Where a fit of short segments starts: path, attitude and body rates at given instants, from the data alone.

Three steps, each with a fall-back where a sensor is missing. The angle turned about the spin axis, psi, comes from the
field in the disc's plane (`phase_spin`): hard iron and the ellipse of soft iron are taken out by a conic through the
readings. In the frame S, which does not spin (B turned back by psi), everything is slow: the transverse rates
of the gyroscope make the relative attitude D of S, and field and specific force are smoothed there. They are compared
with the field and with the path's acceleration less gravity in N (Wahba's problem), locally in time, so that sensors
whose clocks differ by some per cent still agree within each comparison.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from discsim.arrays import ComplexArray, FloatArray
from discsim.errors import InputError
from discsim.frames import body_to_ned, turn
from discsim.recording import Recording
from discsim.trajectory import predict
from discsim.validation.identification.initial.attitude import (
    VECTOR_SIGMA,
    Attitude,
    field_in_start,
    frame_of,
    other_attitudes,
    states_from,
    turned_to_ned,
    windowed,
)
from discsim.validation.identification.initial.path import (
    SpecificForce,
    compared,
    dead_reckoning,
    in_ned,
    integrated,
    normals_of,
    path_fixes,
    path_states,
    specific_force_by,
)
from discsim.validation.identification.initial.release_from_field import release_from_field
from discsim.validation.identification.initial.release_from_forces import Told, release_from_forces
from discsim.validation.identification.initial.release_from_path import release_from_path
from discsim.validation.identification.initial.smoothing import GRID
from discsim.validation.identification.initial.trial_flights import DOWN

__all__ = ["InitialStates", "begins_open", "flight_initial_states", "flight_starts", "spin_initial_states"]


#: sensors that fly with the disc
ON_BOARD = ("magnetometer", "gyroscope", "accelerometer")


class InitialStates(NamedTuple):
    """States at instants, for a fit to start from.

    ``t`` (k,) s in written time; ``position`` (k, 3) m and ``velocity`` (k, 3) m/s in N; ``attitude`` (k, 4)
    quaternions of C_NB; ``rate`` (k, 3) rad/s in B; ``ambiguous`` holds other attitudes (4,) worth trying at t[0].
    """

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    attitude: FloatArray
    rate: FloatArray
    ambiguous: tuple[FloatArray, ...]


# ---------------------------------------------------------------------------------------------- the three plants


def flight_initial_states(recording: Recording, t: FloatArray) -> InitialStates:
    """Return the likeliest of `flight_starts`."""
    return next(flight_starts(recording, t))


def flight_starts(recording: Recording, t: FloatArray) -> Iterator[InitialStates]:
    """Yield states at instants t (k,) s of a flight, likeliest first; always finite.

    Without GPS and track the path is dead reckoning from the stated release, or from what the air does
    (`release_from_forces`, of a magnetometer alone `release_from_field`): that alone leaves several to choose from.
    Without path or accelerometer the attitude's turn about the field is the one that keeps the disc most level, unless
    the release states it; the others are in ``ambiguous``. With no sensor on board at all, the flight that the baseline
    predicts from a stated release is the start, or without one those that fit the path (`release_from_path`).
    """
    t = np.asarray(t, dtype=float)
    if not any(sensor in recording for sensor in ON_BOARD):
        predicted = _predicted(recording, t)
        if predicted is not None:
            yield predicted
            return
    if begins_open(recording):
        for flown in release_from_path(recording, t):
            yield _finite(InitialStates(t, *flown, ()))
    frame = frame_of(recording)
    grid = _even(t, recording)
    fixes = path_fixes(recording)
    force_felt = specific_force_by(recording, frame)
    pair = None if fixes is None else compared(fixes, force_felt, grid, recording.environment.gravity)
    normals = (
        None if fixes is None or pair is None else normals_of(recording, path_states(fixes, None, grid)[1], pair[0])
    )
    if fixes is not None and force_felt is not None and pair is not None and normals is not None:
        phase_drift = _phase_drift(frame, recording.environment.magnetic_field, grid, pair, normals)
        if phase_drift is not None:
            force_felt = _turned_about_axis(force_felt, frame, -np.interp(force_felt.grid, grid, phase_drift))
            pair = compared(fixes, force_felt, grid, recording.environment.gravity)
    G, certain = turned_to_ned(recording, frame, grid, pair, normals)
    told: tuple[Told, ...] = ()
    if fixes is None and (recording.release is None or recording.release.velocity is None):
        told = release_from_forces(recording, frame, grid, G, force_felt)
    if fixes is None and force_felt is None and frame.transverse is None:
        for flown in release_from_field(recording, frame, grid, G, t):
            yield _finite(InitialStates(t, *flown, ()))
    for start in told or (None,):
        turns = G if start is None else start.turn @ G
        attitude, rate = states_from(recording, frame, grid, turns, t)
        force = None if force_felt is None else in_ned(force_felt, grid, turns, recording.environment.gravity)
        if fixes is not None:
            position, velocity = path_states(fixes, force, t)
        else:
            position, velocity = dead_reckoning(recording, force, t, None if start is None else start.velocity)
        others = () if certain or told else other_attitudes(recording, attitude[0])
        yield _finite(InitialStates(t, position, velocity, attitude, rate, others))


def begins_open(recording: Recording) -> bool:
    """Tell a flight that was seen from outside alone, and of which no velocity at release is stated."""
    release = recording.release
    stated = release is not None and release.velocity is not None
    return not stated and not any(sensor in recording for sensor in ON_BOARD)


def _predicted(recording: Recording, t: FloatArray) -> InitialStates | None:
    """Return the states (k,) of the flight from a stated release, or None where that does not say enough to fly."""
    release, disc = recording.release, recording.disc
    if release is None or release.position is None or disc is None:
        return None
    # the ground is no end to a start: flown high above it, where the baseline's air is the same
    try:
        aloft = replace(release, position=release.position - DOWN)
        flight = predict(disc, recording.environment, aloft, duration=float(np.max(t, initial=0.0)) + GRID)
    except InputError:
        return None
    at = flight.at(np.maximum(t, 0.0))
    return InitialStates(t, at.position + DOWN, at.velocity, at.attitude, at.rate, ())


def spin_initial_states(recording: Recording, t: FloatArray) -> InitialStates:
    """Return attitudes and rates at instants t (k,) s of a free spin; position and velocity are zero.

    The field alone cannot tell a turn about itself: the attitude given is the one that starts most level.
    """
    t = np.asarray(t, dtype=float)
    frame = frame_of(recording)
    grid = _even(t, recording)
    G, _ = turned_to_ned(recording, frame, grid, None, None)
    attitude, rate = states_from(recording, frame, grid, G, t)
    nothing = np.zeros((t.size, 3))
    return _finite(InitialStates(t, nothing, nothing.copy(), attitude, rate, other_attitudes(recording, attitude[0])))


# ---------------------------------------------------------------------------------------------- readings


def _even(t: FloatArray, recording: Recording) -> FloatArray:
    start = min(0.0, float(np.min(t, initial=0.0)))
    stop = max(recording.end, float(np.max(t, initial=0.0)), start + GRID)
    return np.linspace(start, stop, int(np.ceil((stop - start) / GRID)) + 1)


# ---------------------------------------------------------------------------------------------- attitude


def _phase_drift(
    frame: Attitude,
    field: FloatArray,
    grid: FloatArray,
    pair: tuple[FloatArray, FloatArray | None],
    normals: FloatArray,
) -> FloatArray | None:
    """Return by how much (n,) rad the accelerometer's phase runs ahead of the magnetometer's, or None where it is not.

    Where clocks differ, or readings were lost, one slips against the other. The angle from field to force in the
    disc's plane, which path and lift foretell, shows it; what changes by less than half a radian is left alone, for
    wind and iron make as much.
    """
    force, force_felt = pair
    if frame.field is None or force_felt is None or grid.size < 5:
        return None
    m = field_in_start(frame.field, frame, grid, VECTOR_SIGMA)
    axis = body_to_ned(frame.D_at(grid))[:, :, 2]
    a, b = _from_to(m, force_felt, axis), _from_to(np.broadcast_to(field, m.shape), force, normals)
    product, level = a * np.conj(b), np.abs(a * b)
    # a steady slip first: 7 rad/s are 2 % of the fastest spin, or 10 % of readings lost at an ordinary one
    trial = np.linspace(-7.0, 7.0, 281)
    sums = np.abs(np.exp(-1j * trial[:, None] * grid) @ product)
    steady = float(trial[np.argmax(sums)]) * grid
    rest = windowed(product * np.exp(-1j * steady), 0.5)
    if np.median(np.abs(rest)) < 0.7 * np.median(windowed(level, 0.5)):
        return None
    angle = np.asarray(steady + np.unwrap(np.angle(np.where(np.abs(rest) > 0, rest, 1.0))))
    # by whole turns nearest to none at the start, where no time has passed to slip in
    angle -= 2 * np.pi * np.rint(angle[0] / (2 * np.pi))
    return angle if float(np.ptp(angle)) > 0.5 else None


def _turned_about_axis(force_felt: SpecificForce, frame: Attitude, angle: FloatArray) -> SpecificForce:
    """Return a force felt turned about the spin axis by an angle (n,) rad on its grid."""
    axis = body_to_ned(frame.D_at(force_felt.grid))[:, :, 2]
    return integrated(
        force_felt.grid, np.einsum("nij,nj->ni", body_to_ned(turn(angle[:, None] * axis)), force_felt.force)
    )


def _from_to(m: FloatArray, f: FloatArray, axis: FloatArray) -> ComplexArray:
    """Return the components of f (n, 3) along and to the right of m across the axis, as one complex number (n,)."""
    z = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-9)
    x = m - np.sum(m * z, axis=1, keepdims=True) * z
    x = x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-9)
    return np.asarray(np.sum(x * f, axis=1) + 1j * np.sum(np.cross(z, x) * f, axis=1))


# ---------------------------------------------------------------------------------------------- path


def _finite(starts: InitialStates) -> InitialStates:
    """Return the starts with anything that is not finite replaced by what a level, resting disc has."""
    level = np.array([1.0, 0.0, 0.0, 0.0])
    lost = np.asarray(~np.all(np.isfinite(starts.attitude), axis=1))
    return starts._replace(
        position=np.nan_to_num(starts.position, nan=0.0, posinf=0.0, neginf=0.0),
        velocity=np.nan_to_num(starts.velocity, nan=0.0, posinf=0.0, neginf=0.0),
        attitude=np.where(lost[:, None], level, starts.attitude),
        rate=np.nan_to_num(starts.rate, nan=0.0, posinf=0.0, neginf=0.0),
    )
