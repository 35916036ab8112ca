"""Where a fit of a flight starts: the state at release, from the stated release or from the first fixes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Disc
from discsim.errors import InputError
from discsim.frames import attitude_matrix, quaternion_from_matrix
from discsim.validation.yaw_damping.observations import Throw

__all__ = ["release_candidates"]

#: fixes of the first second give velocity and acceleration at release
EARLY_S = 1.0
#: angles of attack that are looked through for a lift, rad
_ALPHA = np.radians(np.arange(-30.0, 60.5, 0.5))


def release_candidates(throw: Throw) -> Iterator[FloatArray]:
    """Yield release states (13,), position, velocity, attitude, body rates: what is stated, the rest from the path.

    The tilt of a disc whose attitude is not stated follows from its lift: upright first, then upside down. Raises
    `InputError` where neither is enough.
    """
    release = throw.recording.release
    velocity = None if release is None else release.velocity
    position = None if release is None else release.position
    stated_tilt = release is not None and release.roll is not None and release.pitch is not None
    early = _early(throw)
    if early is None and (velocity is None or not stated_tilt):
        raise InputError(
            f"{throw.recording.path or throw.recording.name}: too few gps fixes with velocity in the first "
            f"{EARLY_S:g} s; expected at least four, or velocity_ned_m_s, roll_rad and pitch_rad in [release]"
        )
    if early is not None:
        seen_position, seen_velocity, acceleration = early
        velocity = seen_velocity if velocity is None else velocity
        position = seen_position if position is None else position
    if position is None:
        position = np.array([0.0, 0.0, -1.3])
    assert velocity is not None
    rate = np.array([0.0, 0.0, _spin_at_release(throw)])
    if release is not None and release.body_rate is not None:
        rate[:2] = release.body_rate[:2]
    if stated_tilt:
        assert release is not None
        assert release.roll is not None
        assert release.pitch is not None
        attitudes = [attitude_matrix(release.roll, release.pitch, release.yaw or 0.0).T]
    else:
        attitudes = _tilts(throw, velocity, acceleration)
    for C_NB in attitudes:
        yield np.concatenate([position, velocity, quaternion_from_matrix(C_NB), rate])


def _early(throw: Throw) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return position, velocity and acceleration (3,) at release from parabolas through the first fixes, or None."""
    good = np.isfinite(throw.path).all(axis=1)
    t, path = throw.path_t[good], throw.path[good]
    if t.size < 4:
        return None
    some = t <= max(t[0] + EARLY_S, t[3])
    if t[0] > EARLY_S:
        return None
    powers = np.vander(t[some], 3, increasing=True)
    velocity, *_ = np.linalg.lstsq(powers, path[some, 3:], rcond=None)
    position, *_ = np.linalg.lstsq(powers, path[some, :3], rcond=None)
    return position[0], velocity[0], velocity[1]


def _spin_at_release(throw: Throw) -> float:
    """Return the spin rate at t = 0, rad/s, from a line through ln|r|."""
    line = np.polyfit(throw.spin_t, np.log(np.maximum(np.abs(throw.spin), 1e-3)), 1)
    return float(np.sign(np.median(throw.spin)) * np.exp(line[1]))


def _tilts(throw: Throw, velocity: FloatArray, acceleration: FloatArray) -> list[FloatArray]:
    """Return C_NB (3, 3) of the two attitudes, disc upright or upside down along its lift, that carry the path.

    In the wind frame the air pushes along -z by L = m |f|, f the part of a - g across the relative wind (18), (20);
    the angle of attack is the smallest whose C_L gives that.
    """
    environment, disc = throw.recording.environment, throw.disc
    assert environment.air_density is not None
    relative = velocity - environment.wind
    V = float(np.linalg.norm(relative))
    along = relative / V
    force = acceleration - np.array([0.0, 0.0, environment.gravity])
    across = force - (force @ along) * along
    size = float(np.linalg.norm(across))
    up = across / size if size > 0 else _any_across(along)
    CL = disc.mass * size / (0.5 * environment.air_density * V**2 * disc.area)
    attitudes = []
    for sign in (1.0, -1.0):
        alpha = _angle_of_attack(disc, sign * CL)
        # z_W = -sign up; F_H = C2(alpha) F_W (20)
        z_W = -sign * up
        x_B = np.cos(alpha) * along - np.sin(alpha) * z_W
        z_B = np.sin(alpha) * along + np.cos(alpha) * z_W
        attitudes.append(np.column_stack((x_B, np.cross(z_B, x_B), z_B)))
    return attitudes


def _any_across(along: FloatArray) -> FloatArray:
    across = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    return np.asarray(across / np.linalg.norm(across))


def _angle_of_attack(disc: Disc, CL: float) -> float:
    """Return the angle of attack, rad, nearest to zero among those whose C_L comes nearest."""
    assert disc.aero is not None
    lookup = disc.aero_table
    lift = disc.aero.CL0 + disc.aero.CLa * _ALPHA if lookup is None else np.interp(_ALPHA, lookup.alpha, lookup.CL)
    miss = np.abs(lift - CL)
    near = miss <= miss.min() + 0.02
    return float(min(_ALPHA[near], key=abs))
