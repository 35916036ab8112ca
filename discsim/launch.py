"""A release in the words of who throws: speed, launch angle, heading, hyzer, nose, spin and height.

Angles are seen along the direction of flight. Launch is that of the velocity above the horizon. Hyzer is how far the
disc's plane leans to the side that it fades to: left edge down for a spin clockwise from above (r > 0), right edge
down for the other. Nose is the pitch of the plane above the path, as launch monitors have it: a throw that is launched
higher takes its plane along.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import RELEASE_HEIGHT, Release
from discsim.errors import InputError
from discsim.frames import multiply, turn
from discsim.limits import FASTEST_SPIN

__all__ = ["Launch", "launch_of", "launch_states", "released"]


#: a number, or an array (n,) of one for each of many throws
Number: TypeAlias = Any


class Launch(NamedTuple):
    """What a person says of a throw, SI and rad; numbers, or arrays (n,) of one throw each."""

    speed: Number
    launch: Number
    heading: Number
    hyzer: Number
    nose: Number
    spin: Number
    height: Number


def launch_of(release: Release) -> Launch:
    """Return a release in these words; raises `InputError` where velocity or body rate is unknown."""
    position, velocity, C_NB, rate = release.start()
    level = float(np.hypot(velocity[0], velocity[1]))
    heading = float(np.arctan2(velocity[1], velocity[0])) if level > 0.0 else 0.0
    launch = float(np.arctan2(-velocity[2], level))
    forward, right, down = _along(heading, C_NB[:, 2])
    lean = float(np.arctan2(-right, down))
    return Launch(
        float(np.linalg.norm(velocity)),
        launch,
        heading,
        -lean * _hand(float(rate[2])),
        float(np.arcsin(np.clip(forward, -1.0, 1.0))) - launch,
        float(rate[2]),
        -float(position[2]),
    )


def released(words: Launch, like: Release | None = None) -> Release:
    """Return the release of these words; place, yaw and wobble (p, q) are those of ``like``, else zero.

    Raises `InputError` for what nobody throws: no speed, no height, or a spin above `FASTEST_SPIN`.
    """
    for name, value in words._asdict().items():
        if not np.isfinite(value):
            raise InputError(f"a throw whose {name} is {value:g}; expected a finite number")
    if not (words.speed > 0.0 and words.height > 0.0):
        raise InputError(
            f"a throw at {words.speed:g} m/s from {words.height:g} m above the ground; expected both above zero"
        )
    if abs(words.spin) > FASTEST_SPIN:
        raise InputError(f"a spin of {words.spin:.4g} rad/s; expected at most {FASTEST_SPIN:g} rad/s")
    roll, pitch = _tilts(words)
    base = like or Release(np.array([0.0, 0.0, -RELEASE_HEIGHT]))
    place = np.zeros(3) if base.position is None else np.array(base.position)
    place[2] = -words.height
    wobble = np.zeros(3) if base.body_rate is None else np.array(base.body_rate)
    wobble[2] = words.spin
    velocity = np.array(_velocity(words))
    return replace(
        base, position=place, velocity=velocity, roll=float(roll), pitch=float(pitch), body_rate=wobble, sigma={}
    )


def launch_states(words: Launch, wobble: FloatArray, like: Release) -> FloatArray:
    """Return the states (n, 14) of n throws, as `discsim.trajectory.release_state` gives that of one.

    ``words`` holds arrays (n,), ``wobble`` (n, 2) the body rates p and q; place and yaw are those of ``like``.
    """
    place = like.start()[0]
    states = np.zeros((wobble.shape[0], 14))
    states[:, 0], states[:, 1], states[:, 2] = place[0], place[1], -np.asarray(words.height)
    states[:, 3:6] = np.column_stack(_velocity(words))
    roll, pitch = _tilts(words)
    # C_NB = C1(roll)^T C2(pitch)^T C3(yaw)^T
    yaw = np.full(wobble.shape[0], like.yaw or 0.0)
    q = multiply(_turned(roll, 0), multiply(_turned(pitch, 1), _turned(yaw, 2)))
    states[:, 6:10] = q
    states[:, 10:12], states[:, 12] = wobble, words.spin
    return states


def _turned(angle: FloatArray, axis: int) -> FloatArray:
    return turn(np.asarray(angle)[..., None] * np.eye(3)[axis])


def _hand(spin: FloatArray | float) -> FloatArray:
    return np.where(np.asarray(spin) < 0.0, -1.0, 1.0)


def _velocity(words: Launch) -> tuple[FloatArray, FloatArray, FloatArray]:
    level = words.speed * np.cos(words.launch)
    return level * np.cos(words.heading), level * np.sin(words.heading), -words.speed * np.sin(words.launch)


def _along(heading: float, v_ned: FloatArray) -> tuple[float, float, float]:
    """Return the components of a vector along a heading, to its right, and down."""
    c, s = np.cos(heading), np.sin(heading)
    return float(c * v_ned[0] + s * v_ned[1]), float(c * v_ned[1] - s * v_ned[0]), float(v_ned[2])


def _tilts(words: Launch) -> tuple[FloatArray, FloatArray]:
    """Return roll and pitch in the paper's order, which counts them from north, not from the heading."""
    lean, pitch = -np.asarray(words.hyzer) * _hand(words.spin), np.asarray(words.nose) + words.launch
    # z_B along the heading, to its right and down, then in N; (A1) has it at (sin pitch, -cos pitch sin roll, ...)
    forward, right, down = np.sin(pitch), -np.cos(pitch) * np.sin(lean), np.cos(pitch) * np.cos(lean)
    c, s = np.cos(words.heading), np.sin(words.heading)
    north, east = c * forward - s * right, s * forward + c * right
    return np.arctan2(-east, down), np.arcsin(np.clip(north, -1.0, 1.0))
