"""The truth: a spinning disc in MuJoCo with our air on it.

MuJoCo integrates the full spinning body (RK4); the air enters through ``mjcb_passive``, one slot for the whole process,
which all flights share inside `passive_force` and never leave anything in. On a free joint force is in world axes and
acts at the body's origin, the geometric centre here; moment is in body axes about it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

import mujoco
import numpy as np
from scipy.optimize import brentq

from discsim.aerodynamics import air_wrench, outside_table, wind
from discsim.arrays import FloatArray, readonly
from discsim.callbacks import check_lent, compile_model, own_warnings, passive_force
from discsim.compiled import compiled
from discsim.disc import RELEASE_HEIGHT, Disc, Release
from discsim.effects.body import centre_of_mass, transverse_inertia
from discsim.effects.catalogue import Effect
from discsim.effects.events import impulse, spin_step
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.files import model_file
from discsim.frames import body_to_ned, flip_yz, norm3, quaternion_from_matrix, rotate_by_quaternion
from discsim.law import Law, law_wrench
from discsim.motion import Motion
from discsim.own_wrench import own_wrench
from discsim.parameters import PARAMETERS, Tables, flight_parameters, tables

__all__ = ["RELEASE_HEIGHT", "FlyingDisc", "check_model", "fly", "follow"]

#: A free body turns by no more than this in a step, rad: at 0.5 a wobble of 2 rad/s is off by 0.04 rad/s after a second
#: (at 0.15, twice a driver's spin at 1 ms, by 4e-5), at 1 all of it is lost and no warning comes.
LARGEST_TURN = 0.5

#: MuJoCo's warnings of a state that is not finite, or beyond all bounds
_DIVERGED = [
    int(warning)
    for warning in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
    )
]


def check_state(data: Any) -> None:
    """Raise `InputError` where a motion has diverged: MuJoCo itself would start it anew without a word.

    Raises RuntimeError where the step's passive force was taken out of its slot.
    """
    check_lent()
    if data.warning.number[_DIVERGED].any():
        raise InputError(
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


@compiled
def _flow(
    p: Any, t: float, qpos: FloatArray, qvel: FloatArray
) -> tuple[float, float, float, float, float, float, float]:
    """Height of the centre of mass, its velocity relative to the air in B, and the body rates, of a free joint."""
    # MuJoCo's axes to N and B: (x, y, z) -> (x, -y, -z)
    qw, qx, qy, qz = qpos[3], qpos[4], -qpos[5], -qpos[6]
    P, Q, r = qvel[3], -qvel[4], -qvel[5]
    ex, ey, ez = centre_of_mass(p.body_mass_imbalance)
    _, _, centre_down = rotate_by_quaternion(qw, qx, qy, qz, ex, ey, ez)
    h = qpos[2] - centre_down
    sn, se, sd = rotate_by_quaternion(qw, qx, qy, qz, Q * ez - r * ey, r * ex - P * ez, P * ey - Q * ex)
    wn, we, wd = wind(p, t, h)
    u, v, w = rotate_by_quaternion(qw, -qx, -qy, -qz, qvel[0] + sn - wn, -qvel[1] + se - we, -qvel[2] + sd - wd)
    return h, u, v, w, P, Q, r


@compiled
def airspeed(flat: FloatArray, t: float, qpos: FloatArray, qvel: FloatArray) -> float:
    """Speed of the centre of mass through the air, m/s."""
    _, u, v, w, _, _, _ = _flow(flat.view(PARAMETERS)[0], t, qpos, qvel)
    return float(norm3(u, v, w))


@compiled
def flight_force(
    flat: FloatArray, tables: Tables, t: float, qpos: FloatArray, qvel: FloatArray, qfrc: FloatArray
) -> bool:
    """Add the air and the events to a free joint's forces (6,); return False where a C_Nr table does not reach."""
    p = flat.view(PARAMETERS)[0]
    h, u, v, w, P, Q, r = _flow(p, t, qpos, qvel)
    Fx, Fy, Fz, Mx, My, Mz = air_wrench(p, tables, h, u, v, w, P, Q, r)
    if tables.law.shape[0] > 0:
        Lx, Ly, Lz, Kx, Ky, Kz = law_wrench(tables.law, t, h, u, v, w, P, Q, r)
        Fx, Fy, Fz, Mx, My, Mz = Fx + Lx, Fy + Ly, Fz + Lz, Mx + Kx, My + Ky, Mz + Kz
    if tables.own_calls.size > 0:
        Lx, Ly, Lz, Kx, Ky, Kz = own_wrench(tables.own_calls, tables.own_sizes, t, h, u, v, w, P, Q, r)
        Fx, Fy, Fz, Mx, My, Mz = Fx + Lx, Fy + Ly, Fz + Lz, Mx + Kx, My + Ky, Mz + Kz

    # a push through the centre of mass; about the geometric centre it has a moment
    qw, qx, qy, qz = qpos[3], qpos[4], -qpos[5], -qpos[6]
    ex, ey, ez = centre_of_mass(p.body_mass_imbalance)
    an, ae, ad = impulse(p.event_impulse, t)
    bx, by, bz = rotate_by_quaternion(qw, -qx, -qy, -qz, an, ae, ad)
    m = p.disc.mass
    Fx, Fy, Fz = Fx + m * bx, Fy + m * by, Fz + m * bz
    Mx, My, Mz = Mx + m * (ey * bz - ez * by), My + m * (ez * bx - ex * bz), Mz + m * (ex * by - ey * bx)
    Mz += p.disc.Izz * spin_step(p.event_spin_step, t, r)

    Fn, Fe, Fd = rotate_by_quaternion(qw, qx, qy, qz, Fx, Fy, Fz)
    qfrc[0] += Fn
    qfrc[1] -= Fe
    qfrc[2] -= Fd
    qfrc[3] += Mx
    qfrc[4] -= My
    qfrc[5] -= Mz
    return not np.isnan(Mz)


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
        self._views = (self.data.qpos, self.data.qvel, self.data.qfrc_passive)

    def specification(self, timestep: float, contacts: bool) -> Any:
        """Return the mujoco.MjSpec that is compiled; a disc with more parts adds them to the body ``disc``."""
        spec = without_reset(mujoco.MjSpec.from_file(str(model_file("disc.xml"))))
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
        qpos, qvel, qfrc = self._views if data is self.data else (data.qpos, data.qvel, data.qfrc_passive)
        if not flight_force(self.parameters, self.tables, data.time, qpos, qvel, qfrc):
            if self.tables.rate.size == 0:
                raise InputError(f"at {data.time:.4f} s the force of the air is no number; expected finite speeds")
            V = airspeed(self.parameters, data.time, qpos, qvel)
            raise outside_table(self.tables, data.time, float(qvel[5]), V)

    @contextmanager
    def air(self) -> Iterator[None]:
        """Install the callback for the block; raises `InputError` where the model's settings would spoil the flight.

        Blocks of several discs may be open at once, nested or in several threads: each disc flies in its own air.
        """
        check_model(self.model)
        with passive_force(self.model, self.apply):
            yield


@compiled
def _centre_height(qpos: FloatArray, ex: float, ey: float, ez: float) -> float:
    """Height of the centre of mass, m."""
    _, _, down = rotate_by_quaternion(qpos[3], qpos[4], -qpos[5], -qpos[6], ex, ey, ez)
    return float(qpos[2] - down)


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
    flying = FlyingDisc(disc, environment, effects, timestep=timestep, contacts=ground == "skip", law=law)
    return follow(flying, release, duration=duration, ground=ground)


def follow(
    flying: FlyingDisc, release: Release, *, duration: float = 30.0, ground: Literal["stop", "skip"] = "stop"
) -> Motion:
    """Release a disc that is built and return the true motion of its body ``disc``; see `fly`."""
    flying.release(release)
    model, data = flying.model, flying.data
    check_turn(data.qvel[None, :6], model.opt.timestep)
    ex, ey, ez = (float(x) for x in flying.centre_of_mass)
    steps = max(1, round(duration / model.opt.timestep))
    width = 1 + model.nq + 2 * model.nv
    size, rows = 1024, 0
    log = np.empty((size, width))

    def note() -> None:
        nonlocal log, rows, size
        if rows == size:
            size *= 2
            log = np.resize(log, (size, width))
        np.concatenate(([data.time], data.qpos, data.qvel, data.qacc), out=log[rows])
        rows += 1

    touched = False
    with own_warnings(), flying.air():
        mujoco.mj_forward(model, data)
        note()
        for _ in range(steps):
            mujoco.mj_step(model, data)
            check_state(data)
            if ground == "stop" and _centre_height(data.qpos, ex, ey, ez) <= 0.0:
                _land(flying, log[rows - 1])
                touched = True
            mujoco.mj_forward(model, data)
            if touched and data.time - log[rows - 1, 0] < 1e-9:
                rows -= 1  # the previous instant already is touch-down
            note()
            if touched or (ground == "skip" and _rests(data)):
                break
    check_turn(log[:rows, 1 + model.nq :][:, :6], model.opt.timestep)
    return _motion(log[:rows], flying, touched)


def _rests(data: Any) -> bool:
    return bool(data.qpos[2] < 0.05 and np.abs(data.qvel[:3]).max() < 0.02 and np.abs(data.qvel[3:]).max() < 0.2)


def _land(flying: FlyingDisc, before: FloatArray) -> None:
    """Redo the last step so that it ends where the centre of mass reaches the ground."""
    model, data = flying.model, flying.data
    nq, nv = model.nq, model.nv
    whole = model.opt.timestep
    centre = tuple(float(x) for x in flying.centre_of_mass)

    def height_after(step: float) -> float:
        data.time, data.qpos[:], data.qvel[:] = before[0], *np.split(before[1:-nv], [nq])
        model.opt.timestep = max(step, 1e-12)
        mujoco.mj_step(model, data)
        return float(_centre_height(data.qpos, *centre))

    try:
        # brentq's last call need not be its answer, so step once more to it
        height_after(brentq(height_after, 0.0, whole, xtol=1e-9) if height_after(0.0) > 0.0 else 0.0)
    finally:
        model.opt.timestep = whole


def _motion(log: FloatArray, flying: FlyingDisc, touched: bool) -> Motion:
    """Turn MuJoCo's states of the geometric centre into N axes and the motion of the centre of mass."""
    nq, nv = flying.model.nq, flying.model.nv
    pose, speed, push = log[:, 1:8], log[:, 1 + nq : 7 + nq], log[:, 1 + nq + nv : 7 + nq + nv]
    attitude = np.column_stack((pose[:, 3], flip_yz(pose[:, 4:7])))
    rate, turning = flip_yz(speed[:, 3:6]), flip_yz(push[:, 3:6])
    e = flying.centre_of_mass
    C_NB = body_to_ned(attitude)
    swing = np.cross(rate, e)

    def in_ned(v: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("nij,nj->ni", C_NB, np.broadcast_to(v, rate.shape)))

    return Motion(
        t=log[:, 0],
        position=flip_yz(pose[:, :3]) + in_ned(e),
        velocity=flip_yz(speed[:, :3]) + in_ned(swing),
        acceleration=flip_yz(push[:, :3]) + in_ned(np.cross(turning, e) + np.cross(rate, swing)),
        attitude=attitude,
        rate=rate,
        angular_acceleration=turning,
        environment=flying.environment,
        centre_of_mass=e,
        touched_down=touched,
    )
