"""What several tests fly: the driver disc, bodies without air, and throws stated in degrees."""

from __future__ import annotations

import dataclasses

import numpy as np

from discsim.disc import Aero, Disc, Release
from discsim.environment import Environment
from discsim.frames import C3, attitude_matrix, euler_angles, quaternion_from_matrix
from discsim.shipped import load_disc

DRIVER, FIELD = load_disc("driver")
#: the driver's body with every coefficient zero: the air leaves it alone
BARE = dataclasses.replace(DRIVER, aero=Aero())
WEIGHTLESS = dataclasses.replace(FIELD, gravity=0.0)


def with_aero(disc: Disc = DRIVER, **coefficients: float) -> Disc:
    assert disc.aero is not None
    return dataclasses.replace(disc, aero=disc.aero._replace(**coefficients))


def in_wind(*wind: float) -> Environment:
    return dataclasses.replace(FIELD, wind=np.array(wind))


def throw(
    speed: float = 24.0,
    climb_deg: float = 10.0,
    roll_deg: float = -12.0,
    pitch_deg: float = 8.0,
    yaw_deg: float = 0.0,
    spin_deg_s: float = 4200.0,
    wobble: tuple[float, float] = (0.0, 0.0),
    height: float = 1.3,
) -> Release:
    """A throw to the north; wobble is p and q in rad/s."""
    climb = np.radians(climb_deg)
    return Release(
        np.array([0.0, 0.0, -height]),
        speed * np.array([np.cos(climb), 0.0, -np.sin(climb)]),
        float(np.radians(roll_deg)),
        float(np.radians(pitch_deg)),
        float(np.radians(yaw_deg)),
        np.array([*wobble, np.radians(spin_deg_s)]),
    )


def with_attitude(release: Release, C_NB: np.ndarray) -> Release:
    roll, pitch, yaw = (float(angle) for angle in euler_angles(quaternion_from_matrix(C_NB)))
    return dataclasses.replace(release, roll=roll, pitch=pitch, yaw=yaw)


def attitude(release: Release) -> np.ndarray:
    """C_NB of a release."""
    return attitude_matrix(release.roll or 0.0, release.pitch or 0.0, release.yaw or 0.0).T


def turned(release: Release, angle: float) -> Release:
    """The same throw with everything turned clockwise by angle (rad) about the vertical."""
    turn = C3(angle).T
    assert release.position is not None
    assert release.velocity is not None
    moved = dataclasses.replace(release, position=turn @ release.position, velocity=turn @ release.velocity)
    return with_attitude(moved, turn @ attitude(release))


def mirrored(release: Release) -> Release:
    """The throw seen in a mirror that stands north-south: east, roll and spin change sign."""
    M = np.diag([1.0, -1.0, 1.0])
    assert release.position is not None
    assert release.velocity is not None
    assert release.body_rate is not None
    moved = dataclasses.replace(
        release,
        position=M @ release.position,
        velocity=M @ release.velocity,
        body_rate=-M @ release.body_rate,  # a rotation is an axial vector
    )
    return with_attitude(moved, M @ attitude(release) @ M)
