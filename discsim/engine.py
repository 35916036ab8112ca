"""The truth: a spinning disc in MuJoCo with our air on it.

MuJoCo integrates the full spinning body (RK4); the air enters through ``mjcb_passive``, one slot for the whole process,
which all flights share inside `passive_force` and never leave anything in. On a free joint force is in world axes and
acts at the body's origin, the geometric centre here; moment is in body axes about it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any, Literal

import mujoco
import numpy as np

from discsim.aerodynamics import outside_table
from discsim.arrays import FloatArray, readonly
from discsim.callbacks import check_lent, compile_model, own_warnings, passive_force
from discsim.disc import RELEASE_HEIGHT, Disc, Release
from discsim.effects.body import centre_of_mass, transverse_inertia
from discsim.effects.catalogue import Effect
from discsim.environment import Environment
from discsim.errors import InputError, require_number
from discsim.files import model_file
from discsim.flight_force import LOST, native_force
from discsim.frames import body_to_ned, flip_yz, quaternion_from_matrix
from discsim.law import Law
from discsim.logbook import Logbook, height
from discsim.motion import Motion, State
from discsim.native import call_force
from discsim.parameters import PARAMETERS, flight_parameters, tables

__all__ = ["DIVERGED", "RELEASE_HEIGHT", "FlyingDisc", "centre_state", "check_model", "fly", "follow", "touch_down"]

#: A free body turns by no more than this in a step, rad: at 0.5 a wobble of 2 rad/s is off by 0.04 rad/s after a second
#: (at 0.15, twice a driver's spin at 1 ms, by 4e-5), at 1 all of it is lost and no warning comes.
LARGEST_TURN = 0.5

#: MuJoCo's warnings of a state that is not finite, or beyond all bounds
DIVERGED = [
    int(warning)
    for warning in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
    )
]


#: touch-down is found where the centre of mass is this near the ground, m, or in an interval this short, s: rounding of
#: a height of some metres is 1e-15, and the stated tolerance 0.1 ms
LANDED, SHORTEST = 1e-12, 1e-12


def check_state(data: Any) -> None:
    """Raise `InputError` where a motion has diverged: MuJoCo itself would start it anew without a word.

    Raises RuntimeError where the step's passive force was taken out of its slot.
    """
    check_lent()
    if data.warning.number[DIVERGED].any():
        raise _diverged(data)


def _diverged(data: Any) -> InputError:
    return InputError(
        f"at {data.time:.4f} s the motion is no longer finite; expected rates and speeds that a step can follow "
        "(lower them, or take a smaller step)"
    )


def check_turn(qvel: FloatArray, timestep: float) -> None:
    """Refuse speeds (n, 6) of a free joint at which it turns further in a step than it is integrated well."""
    fastest = float(np.sqrt(np.max(np.sum(qvel[:, 3:] ** 2, axis=1))))
    if not fastest * timestep <= LARGEST_TURN:
        raise InputError(
            f"the disc turns at {fastest:.4g} rad/s, {fastest * timestep:.3g} rad in a step; expected at most "
            f"{LARGEST_TURN:g} rad ({LARGEST_TURN / timestep:g} rad/s): lower it, take a smaller step, or the "
            "trajectory engine"
        )


def without_reset(spec: Any) -> Any:
    """Return a model specification that lets a diverged state be seen instead of starting it anew."""
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return spec


def check_model(model: Any) -> None:
    """Refuse settings under which a spinning body is not integrated as it should be; raises `InputError`."""
    integrator = mujoco.mjtIntegrator(model.opt.integrator)
    if integrator != mujoco.mjtIntegrator.mjINT_RK4:
        raise InputError(
            f"integrator is {integrator.name.removeprefix('mjINT_')}, expected RK4: at 60 rad/s spin and 1 ms, 3 s "
            "of Euler grow a wobble of 3 rad/s to 316 rad/s and implicitfast damps it to 0.03 rad/s"
        )
    both = mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER
    if model.opt.disableflags & both == both:
        raise InputError("springs and dampers are both disabled, which silently switches the passive callback off")
    if model.opt.density != 0.0 or model.opt.viscosity != 0.0:
        raise InputError(
            f"MuJoCo's own air is on (density {model.opt.density:g}, viscosity {model.opt.viscosity:g}), "
            "expected zero: it would brake the disc besides ours"
        )


@cache
def _drawing() -> Any:
    """Return the specification of ``models/disc.xml``, read once."""
    return mujoco.MjSpec.from_file(str(model_file("disc.xml")))


class FlyingDisc:
    """A disc as a MuJoCo model with its data, and its air as a callback.

    >>> flying = FlyingDisc(disc, Environment())          # doctest: +SKIP
    >>> with flying.air():
    ...     mujoco.mj_step(flying.model, flying.data)

    Attributes
    ----------
    model, data : mujoco.MjModel, mujoco.MjData
        The compiled model of ``models/disc.xml`` with this disc's mass, inertia, centre of mass and surroundings.
    parameters : (n,) array
        The flat parameters of `discsim.parameters`; may be changed between steps.
    """

    def __init__(
        self,
        disc: Disc,
        environment: Environment,
        effects: Sequence[Effect] = (),
        *,
        timestep: float = 1e-3,
        contacts: bool = False,
        law: Law | Sequence[Law] | None = None,
    ) -> None:
        self.disc = disc
        self.environment = environment
        self.parameters = flight_parameters(disc, environment, effects)
        self.tables = tables(disc, law, effects)
        record = self.parameters.view(PARAMETERS)[0]
        self.centre_of_mass = readonly(centre_of_mass(record["body_mass_imbalance"]))
        self.model = compile_model(self.specification(timestep, contacts))
        self.data = mujoco.MjData(self.model)
        check_model(self.model)
        self._lost = np.zeros(LOST)
        self._native = native_force(self.parameters, self.tables, self._lost)
        self._call, self._own = (int(self._native.record[0]), self._native.address), _addresses(self.data)

    def specification(self, timestep: float, contacts: bool) -> Any:
        """Return the mujoco.MjSpec that is compiled; a disc with more parts adds them to the body ``disc``."""
        spec = without_reset(_drawing().copy())
        spec.option.timestep = timestep
        spec.option.gravity = [0.0, 0.0, -self.environment.gravity]
        spec.option.magnetic = flip_yz(self.environment.magnetic_field)
        body = spec.body("disc")
        body.mass = self.disc.mass
        asymmetry = self.parameters.view(PARAMETERS)[0]["body_inertia_asymmetry"]
        body.inertia = [self.disc.Ixx, transverse_inertia(asymmetry, self.disc.Ixx), self.disc.Izz]
        body.ipos = flip_yz(self.centre_of_mass)
        grow = self.disc.diameter / 0.212  # the drawing is the driver's
        for geom in body.geoms:
            geom.size = np.asarray(geom.size) * [grow, grow if geom.name != "rim" else 1.0, 1.0]
            geom.pos = np.asarray(geom.pos) * [grow, grow, 1.0]
        if contacts:
            for name in ("rim", "ground"):
                geom = spec.geom(name)
                geom.contype = geom.conaffinity = 1
        return spec

    def release(self, release: Release) -> None:
        """Set the state: velocity and body rate must be known; raises `InputError` naming what is missing.

        Attitude defaults to level, position to `RELEASE_HEIGHT` above the origin.
        """
        Release.require(release)
        position, velocity, C_NB, body_rate = release.start()
        q = quaternion_from_matrix(C_NB)
        mujoco.mj_resetData(self.model, self.data)
        # the release is the centre of mass's, the joint's origin the geometric centre
        self.data.qpos[:3] = flip_yz(position - C_NB @ self.centre_of_mass)
        self.data.qpos[3:7] = [q[0], *flip_yz(q[1:])]
        swing = np.cross(body_rate, self.centre_of_mass)
        self.data.qvel[:3] = flip_yz(velocity - C_NB @ swing)
        self.data.qvel[3:6] = flip_yz(body_rate)

    def apply(self, model: Any, data: Any) -> None:
        """Add air and events to ``data.qfrc_passive``: the callback. A model that is not this disc's is ignored."""
        if model is not self.model:
            return
        function, record = self._call
        qpos, qvel, qfrc = self._own if data is self.data else _addresses(data)
        if not call_force(function, record, data.time, qpos, qvel, qfrc):
            raise self.lost_air() or AssertionError

    def lost_air(self) -> InputError | None:
        """Return the error of the first force that was not finite since this was asked last; None: all were."""
        lost, t, rate, airspeed = self._lost
        self._lost[:] = 0.0
        if not lost:
            return None
        if self.tables.rate.size == 0:
            return InputError(f"at {t:.4f} s the force of the air is no number; expected finite speeds")
        return outside_table(self.tables, float(t), float(rate), float(airspeed))

    @contextmanager
    def air(self, python: bool = False) -> Iterator[None]:
        """Install the callback for the block; raises `InputError` where the model's settings would spoil the flight.

        Blocks of several discs may be open at once, nested or in several threads: each disc flies in its own air.
        MuJoCo calls compiled code, and a force that is not finite is an error at the end of the block. With ``python``,
        and in a subclass with an ``apply`` of its own, it calls `apply`, at twice the cost, and errors are raised
        at once.
        """
        check_model(self.model)
        self.lost_air()
        by_python = python or type(self).apply is not FlyingDisc.apply
        with passive_force(self.model, self.apply, None if by_python else self._native):
            yield
            if (error := self.lost_air()) is not None:
                raise error


def _addresses(data: Any) -> tuple[int, int, int]:
    """Return where qpos, qvel and qfrc_passive of MuJoCo's data stand."""
    return data.qpos.ctypes.data, data.qvel.ctypes.data, data.qfrc_passive.ctypes.data


def fly(
    disc: Disc,
    environment: Environment,
    release: Release,
    effects: Sequence[Effect] = (),
    *,
    timestep: float = 1e-3,
    duration: float = 30.0,
    ground: Literal["stop", "skip"] = "stop",
    law: Law | Sequence[Law] | None = None,
) -> Motion:
    """Fly a disc in MuJoCo and return its true motion.

    The flight ends where the centre of mass reaches the ground (found to better than 1e-7 s), or after ``duration``
    (s). With ``ground="skip"`` the rim has contact and friction with the ground, and the disc skips and slides on
    until it rests or ``duration`` ends. Raises `InputError` where it turns by more than `LARGEST_TURN` in a step.
    """
    if ground not in ("stop", "skip"):
        raise InputError(f"ground is {ground!r}, expected 'stop' or 'skip'")
    require_number(timestep, "timestep", "s", positive=True)
    require_number(duration, "duration", "s", positive=True)
    flying = FlyingDisc(disc, environment, effects, timestep=timestep, contacts=ground == "skip", law=law)
    return follow(flying, release, duration=duration, ground=ground)


def follow(
    flying: FlyingDisc,
    release: Release,
    *,
    duration: float = 30.0,
    ground: Literal["stop", "skip"] = "stop",
    python: bool = False,
) -> Motion:
    """Release a disc that is built and return the true motion of its body ``disc``; see `fly`.

    ``python`` takes the callback in Python, as `FlyingDisc.air` does; the motion is the same.
    """
    flying.release(release)
    check_turn(flying.data.qvel[None, :6], flying.model.opt.timestep)
    log = Logbook(flying.model, flying.data, flying.centre_of_mass)
    with own_warnings(), flying.air(python):
        try:
            touched = _follow(flying, log, max(1, round(duration / flying.model.opt.timestep)), ground)
        except FloatingPointError:
            raise flying.lost_air() or _diverged(flying.data) from None
    check_turn(log.rows[:, 1 + flying.model.nq :][:, :6], flying.model.opt.timestep)
    return _motion(log.rows, flying, touched)


def _follow(flying: FlyingDisc, log: Logbook, steps: int, ground: Literal["stop", "skip"]) -> bool:
    """Step a released disc to its end, noting each state; return whether it touched down."""
    model, data = flying.model, flying.data
    mujoco.mj_forward(model, data)
    log.note()
    for _ in range(steps):
        # mj_step is both of these the other way round; so the state whose acceleration is noted is evaluated once
        mujoco.mj_RungeKutta(model, data, 4)
        mujoco.mj_forward(model, data)
        below = log.note()
        check_lent()
        if ground == "skip" and _rests(data):
            return False
        if ground == "stop" and below:
            log.strike()
            before = log.rows[-1]
            touch_down(flying, before)
            mujoco.mj_forward(model, data)
            if data.time - before[0] < 1e-9:
                log.strike()  # the previous instant already is touch-down
            log.note()
            return True
    return False


def _rests(data: Any) -> bool:
    return bool(data.qpos[2] < 0.05 and np.abs(data.qvel[:3]).max() < 0.02 and np.abs(data.qvel[3:]).max() < 0.2)


def touch_down(flying: FlyingDisc, before: FloatArray) -> None:
    """Step from a state ``before`` (time, qpos and qvel) so that the centre of mass reaches the ground."""
    model, data = flying.model, flying.data
    nq, nv = model.nq, model.nv
    whole = model.opt.timestep
    centre = tuple(float(x) for x in flying.centre_of_mass)

    def height_after(step: float) -> float:
        data.time, data.qpos[:], data.qvel[:] = before[0], before[1 : 1 + nq], before[1 + nq : 1 + nq + nv]
        model.opt.timestep = max(step, 1e-12)
        mujoco.mj_step(model, data)
        return float(height(data.qpos, *centre))

    try:
        above = height_after(0.0)
        if above <= 0.0:
            return
        low, high, below, side = 0.0, whole, height_after(whole), 0
        # regula falsi after Illinois, which keeps its bracket; the step taken last is the answer
        while high - low > SHORTEST:
            share = (low * below - high * above) / (below - above)
            miss = height_after(share)
            if abs(miss) < LANDED:
                return
            if miss > 0.0:
                low, above = share, miss
                below *= 0.5 if side > 0 else 1.0
                side = 1
            else:
                high, below = share, miss
                above *= 0.5 if side < 0 else 1.0
                side = -1
    finally:
        model.opt.timestep = whole


def _motion(log: FloatArray, flying: FlyingDisc, touched: bool) -> Motion:
    return Motion(*centre_state(log, flying), flying.environment, flying.centre_of_mass, touched)


def centre_state(log: FloatArray, flying: FlyingDisc) -> State:
    """Turn rows (n,) of a log, of the geometric centre in MuJoCo's axes, into the motion of the centre of mass in N."""
    nq, nv = flying.model.nq, flying.model.nv
    pose, speed, push = log[:, 1:8], log[:, 1 + nq : 7 + nq], log[:, 1 + nq + nv : 7 + nq + nv]
    attitude = np.column_stack((pose[:, 3], flip_yz(pose[:, 4:7])))
    rate, turning = flip_yz(speed[:, 3:6]), flip_yz(push[:, 3:6])
    e = flying.centre_of_mass
    C_NB = body_to_ned(attitude)
    swing = np.cross(rate, e)

    def in_ned(v: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("nij,nj->ni", C_NB, np.broadcast_to(v, rate.shape)))

    return State(
        t=log[:, 0],
        position=flip_yz(pose[:, :3]) + in_ned(e),
        velocity=flip_yz(speed[:, :3]) + in_ned(swing),
        acceleration=flip_yz(push[:, :3]) + in_ned(np.cross(turning, e) + np.cross(rate, swing)),
        attitude=attitude,
        rate=rate,
        angular_acceleration=turning,
    )
