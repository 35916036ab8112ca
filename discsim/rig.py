"""Rigs in MuJoCo: a rate table that follows a commanded profile, and a spinner that runs down in its bearing.

Both turn about one hinge, its axis straight down unless tilted; the yaw phase at the start is free.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Sequence
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from discsim.arrays import FloatArray
from discsim.bearing import bearing_torque
from discsim.callbacks import compile_model, own_warnings, passive_force
from discsim.compiled import compiled
from discsim.disc import Rig
from discsim.effects.catalogue import Effect
from discsim.effects.events import spin_step
from discsim.effects.rig import SpeedRipple, axis, speed_ripple
from discsim.engine import check_model, check_state, without_reset
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.files import model_file, read_text
from discsim.frames import flip_yz, multiply, turn
from discsim.law import Law
from discsim.limits import FASTEST_SPIN, LONGEST_RUN
from discsim.motion import JUMP_S, Motion
from discsim.parameters import PARAMETERS, Tables, parameters, tables
from discsim.profiles import read_shape
from discsim.recording import COMMAND_HEADER, Recording, Samples, read_csv, read_recording

__all__ = ["default_profile", "measured_profile", "profile_fault", "read_profile", "spin_down", "turn_table"]

#: plateaus of the default profile, deg/s
PLATEAUS_DEG_S = (0, 300, 600, 1000, 1500, 2000, 2500, 3000, 3500, 4000, 4500, 5000)
#: parts of a profile, of however many knots, after which progress is told
PARTS = 23
#: stiffness of the table's speed loop, 1/s: an error of speed dies out within some 10 ms
SPEED_LOOP = 100.0
#: knots of a profile are corners where both of their ramps last this many steps: closer ones follow a curve
CORNER = 20
#: header of a profile in degrees, beside that of a recording's command
_IN_DEGREES = "time_s,rate_deg_s"


def default_profile(plateaus_deg_s: Sequence[float] = PLATEAUS_DEG_S, hold: float = 5.0, ramp: float = 1.0) -> Samples:
    """Return the knots of a profile of plateaus (deg/s) held for ``hold`` s, with ramps of ``ramp`` s between."""
    t, rate = [0.0], [np.radians(plateaus_deg_s[0])]
    for index, plateau in enumerate(plateaus_deg_s):
        if index:
            t.append(t[-1] + ramp)
            rate.append(np.radians(plateau))
        t.append(t[-1] + hold)
        rate.append(np.radians(plateau))
    return Samples(np.array(t), np.array(rate))


def read_profile(path: Path) -> Samples:
    """Read a profile: a CSV file of knots, columns ``time_s,rate_rad_s`` or ``time_s,rate_deg_s``, or a TOML shape.

    A recording's folder stands for its rate reference, a log of what a table did.
    """
    if path.suffix == ".toml":
        return _within_limits(path, read_shape(path))
    if (path / "recording.toml").is_file():
        return _within_limits(path, measured_profile(read_recording(path)))
    first = read_text(path).partition("\n")[0]
    if first not in (COMMAND_HEADER, _IN_DEGREES):
        raise InputError.at(path, 1, f"header is '{first[:120]}', expected '{_IN_DEGREES}' or '{COMMAND_HEADER}'")
    degrees = first == _IN_DEGREES
    knots = read_csv(path, first, gaps_allowed=False)
    knots = Samples(knots.t, np.radians(knots.value)) if degrees else knots
    if len(knots) < 2:
        raise InputError.at(path, 2, "one knot only; expected at least two")
    if knots.t[0] != 0.0:
        raise InputError.at(path, 2, f"first knot at {knots.t[0]:g} s, expected 0 s (the start of the recording)")
    if found := profile_fault(knots):
        knot, message = found
        raise InputError.at(path, 2 + knot, message)
    return knots


def _within_limits(path: Path, profile: Samples) -> Samples:
    if found := profile_fault(profile):
        raise InputError.at(path, None, found[1])
    return profile


def measured_profile(recording: Recording) -> Samples:
    """Return a recording's rate reference as a profile from 0 s; gaps are bridged by lines.

    Raises `InputError` where it has none, or no two readings.
    """
    reference = recording.need("rate_reference")
    known = np.isfinite(reference.value)
    if known.sum() < 2:
        raise InputError(f"{recording.path or recording.name}: no two readings of the rate reference; expected a log")
    t, rate = reference.t[known], reference.value[known]
    t, rate = t[t >= 0.0], rate[t >= 0.0]
    return Samples(t, rate) if t[0] == 0.0 else Samples(np.append(0.0, t), np.append(rate[0], rate))


def profile_fault(knots: Samples) -> tuple[int, str] | None:
    """Return the knot (from 0) at which a profile leaves the limits (`discsim.limits`), and what is wrong there."""
    if knots.t[-1] > LONGEST_RUN:
        return len(knots) - 1, f"the profile ends at {knots.t[-1]:.6g} s, expected at most {LONGEST_RUN:g} s"
    fast = np.abs(knots.value) > FASTEST_SPIN
    if np.any(fast):
        knot = int(np.argmax(fast))
        return knot, f"the rate is {knots.value[knot]:.6g} rad/s, expected at most {FASTEST_SPIN:g} rad/s in size"
    return None


@compiled
def bearing_force(
    flat: FloatArray, tables: Tables, t: float, qpos: FloatArray, qvel: FloatArray, qfrc: FloatArray
) -> None:
    """Add the torque of a spin-down rig: ``Izz rdot = -viscous r`` and what a baseline leaves out."""
    p = flat.view(PARAMETERS)[0]
    r = qvel[0]
    qfrc[0] += bearing_torque(p, tables, t, qpos[0], r) + p.rig.Izz * spin_step(p.event_spin_step, t, r)


@compiled
def drive_force(
    flat: FloatArray, segment: FloatArray, t: float, qpos: FloatArray, qvel: FloatArray, qfrc: FloatArray
) -> None:
    """Add the torque of a rate table's drive, which follows the running segment of its profile.

    segment is (start s, rate there rad/s, slope rad/s^2, yaw at the recording's start rad, inertia kg m^2).
    """
    p = flat.view(PARAMETERS)[0]
    start, rate, slope, yaw, inertia = segment[0], segment[1], segment[2], segment[3], segment[4]
    r = qvel[0]
    command = rate + slope * (t - start)
    ripple, ripple_slope = speed_ripple(p.rig_speed_ripple, qpos[0] - yaw, r)
    if command == 0.0 and slope == 0.0:  # the ripple is there while the table turns
        ripple, ripple_slope = 0.0, 0.0
    qfrc[0] += inertia * (slope + ripple_slope + SPEED_LOOP * (command + ripple - r))


class _Hinge:
    """The compiled rate-table model and the log of its states."""

    def __init__(self, environment: Environment, flat: FloatArray, inertia: float, yaw: float) -> None:
        spec = without_reset(mujoco.MjSpec.from_file(str(model_file("rate_table.xml"))))
        spec.option.gravity = [0.0, 0.0, -environment.gravity]
        spec.option.magnetic = flip_yz(environment.magnetic_field)
        spec.body("table").inertia = [inertia, inertia, inertia]
        self.tilt = _tilt(flat)
        spec.body("axis").quat = [self.tilt[0], *flip_yz(self.tilt[1:])]
        self.model = compile_model(spec)
        self.data = mujoco.MjData(self.model)
        check_model(self.model)
        self.environment = environment
        self.data.qpos[0] = yaw
        self.log = array("d")  # time, yaw, rate, acceleration of each state, one after the other

    def note(self) -> None:
        data = self.data
        mujoco.mj_forward(self.model, data)
        check_state(data)
        self.log.extend((data.time, float(data.qpos[0]), float(data.qvel[0]), float(data.qacc[0])))

    def note_again(self) -> None:
        """Note the present state in place of the last one, from which it has jumped at the same instant."""
        del self.log[-4:]
        self.note()

    def run(self, until: float, timestep: float) -> None:
        """Step to ``until`` in equal steps of at most ``timestep``, noting each state."""
        span = until - self.data.time
        steps = max(1, int(np.ceil(span / timestep - 1e-9)))
        self.model.opt.timestep = span / steps
        for left in reversed(range(steps)):
            mujoco.mj_step(self.model, self.data)
            if left == 0:
                self.data.time = until  # so that thousands of steps add up to the knot itself
            self.note()

    def motion(self) -> Motion:
        t, yaw, rate, acceleration = np.frombuffer(self.log).reshape(-1, 4).T
        along_z = np.array([0.0, 0.0, 1.0])
        still = np.zeros((t.size, 3))
        attitude = multiply(np.broadcast_to(self.tilt, (t.size, 4)), turn(yaw[:, None] * along_z))
        return Motion(
            t=t,
            position=still,
            velocity=still,
            acceleration=still,
            attitude=attitude,
            rate=rate[:, None] * along_z,
            angular_acceleration=acceleration[:, None] * along_z,
            environment=self.environment,
        )


def _tilt(flat: FloatArray) -> FloatArray:
    """Return the quaternion that turns z of N onto the rig's axis the short way."""
    n, e, d = axis(flat.view(PARAMETERS)[0]["rig_axis_tilt"])
    across = np.hypot(n, e)
    angle = np.arctan2(across, d)
    return turn(np.array([-e, n, 0.0]) * (angle / across if across > 0 else 0.0))


def turn_table(
    profile: Samples,
    environment: Environment,
    effects: Sequence[Effect] = (),
    *,
    yaw: float = 0.0,
    inertia: float = 1.1e-3,
    timestep: float = 1e-3,
    progress: Callable[[Sequence[range]], Iterable[range]] = iter,
) -> Motion:
    """Turn a rate table through a profile (t (n,) s, rate (n,) rad/s, piecewise linear) and return its true motion.

    ``yaw`` is the phase at t = 0 in rad, ``inertia`` the table's in kg m^2. Steps end on the profile's knots, so the
    table follows ramps without error, and its acceleration jumps at corners; `discsim.effects.rig` can add ripple and
    tilt. ``progress`` is handed at most `PARTS` ranges of the profile's segments and yields them one by one, which
    shows how far it is.
    """
    if len(profile) < 2 or profile.value.ndim != 1 or np.any(np.isnan(profile.value)):
        raise InputError("profile: expected at least two knots (time, rate) without gaps")
    if profile.t[0] != 0.0:
        raise InputError(f"profile: first knot at {profile.t[0]:g} s, expected 0 s (the start of the recording)")
    flat = parameters(environment, effects=effects)
    hinge = _Hinge(environment, flat, inertia, yaw)
    model, data = hinge.model, hinge.data
    segment = np.zeros(5)
    views = (data.qpos, data.qvel, data.qfrc_passive)

    def drive(stepped_model: Any, stepped_data: Any) -> None:
        if stepped_data is data:
            drive_force(flat, segment, data.time, *views)

    lasting = np.diff(profile.t)
    slopes = np.diff(profile.value) / lasting
    corner = (np.diff(slopes, prepend=slopes[0]) != 0.0) & (lasting > CORNER * timestep)
    corner[1:] &= lasting[:-1] > CORNER * timestep
    ripple = SpeedRipple(*flat.view(PARAMETERS)[0]["rig_speed_ripple"])
    turning = False
    data.qvel[0] = profile.value[0]
    with own_warnings(), passive_force(model, drive):
        for k in chain.from_iterable(progress(_parts(slopes.size))):
            turning, before = bool(profile.value[k] or slopes[k]), turning
            # the ripple is there while the table turns: it sets in and ends with it
            at_once = 0.0 if turning == before else speed_ripple(ripple, float(data.qpos[0]) - yaw, 0.0)[0]
            data.qvel[0] += at_once if turning else -at_once
            segment[:] = profile.t[k], profile.value[k], slopes[k], yaw, inertia
            if k == 0:
                hinge.note()
            elif at_once:
                hinge.note_again()
            elif corner[k]:
                hinge.run(float(profile.t[k]) + JUMP_S, timestep)
            hinge.run(float(profile.t[k + 1]), timestep)
    return hinge.motion()


def _parts(count: int) -> list[range]:
    """Return ranges that cover ``count`` segments: each its own where they are few."""
    ends = np.linspace(0, count, min(count, PARTS) + 1).round().astype(int).tolist()
    return [range(first, last) for first, last in pairwise(ends)]


def spin_down(
    rig: Rig,
    environment: Environment,
    rate: float,
    duration: float,
    effects: Sequence[Effect] = (),
    *,
    yaw: float = 0.0,
    timestep: float = 1e-3,
    law: Law | Sequence[Law] | None = None,
) -> Motion:
    """Let a rig run down from ``rate`` (rad/s) for ``duration`` (s) and return its true motion.

    Of a law and of effects of the user's own the moment about the axis acts; they are given no air.
    """
    lookup = tables(None, law, effects)
    flat = parameters(environment, rig=rig, effects=effects)
    hinge = _Hinge(environment, flat, rig.Izz, yaw)
    model, data = hinge.model, hinge.data
    views = (data.qpos, data.qvel, data.qfrc_passive)

    def brake(stepped_model: Any, stepped_data: Any) -> None:
        if stepped_data is data:
            bearing_force(flat, lookup, data.time, *views)

    data.qvel[0] = rate
    with own_warnings(), passive_force(model, brake):
        hinge.note()
        hinge.run(duration, timestep)
    return hinge.motion()
