"""Physics of no catalogue at work: inside MuJoCo, on the disc (`HiddenDisc`) or the rig (`coast`), or in a sensor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import mujoco
import numpy as np

from discsim.arrays import FloatArray
from discsim.callbacks import compile_model, own_warnings, passive_force
from discsim.disc import Disc, Rig
from discsim.effects.catalogue import Effect, by_id
from discsim.effects.events import spin_step
from discsim.effects.rig import axis
from discsim.engine import FlyingDisc, check_model, check_state
from discsim.environment import Environment
from discsim.frames import flip_yz, multiply, turn
from discsim.law import behind_play
from discsim.motion import Motion
from discsim.parameters import parameter_index
from discsim.sensors import Accelerometer, Gyroscope, Instruments, Magnetometer
from discsim.validation.challenge.cases.off_catalogue import (
    BearingWarmth,
    Cogging,
    DryingDisc,
    LiftHysteresis,
    LoosePart,
    MainsField,
    OffCatalogue,
    PowerLawTorque,
    RotatingMagnet,
    SensorHysteresis,
    Thermal,
    Turbulence,
    Warming,
)

__all__ = ["HiddenDisc", "coast", "haunted"]


# ---------------------------------------------------------------------------------------------- in the air


class HiddenDisc(FlyingDisc):
    """A disc in MuJoCo with physics upon it that the catalogue lacks."""

    def __init__(
        self,
        disc: Disc,
        environment: Environment,
        effects: Sequence[Effect],
        secret: OffCatalogue | None,
        recording: int,
    ) -> None:
        self.secret = secret
        super().__init__(disc, environment, effects)
        self._gusts = secret.series(recording) if isinstance(secret, Turbulence) else None
        self._wind = [parameter_index("environment", f"wind_{way}") for way in ("north", "east", "down")]
        self._late: tuple[float, float] | None = None

    def specification(self, timestep: float, contacts: bool) -> Any:
        """Return the disc's specification, with the loose part on it where there is one."""
        spec = super().specification(timestep, contacts)
        if isinstance(self.secret, LoosePart):
            body = spec.body("disc")
            body.mass -= self.secret.mass
            self.secret.attach(body)
        return spec

    def apply(self, model: Any, data: Any) -> None:
        """Add the air, the events and what is hidden to ``data.qfrc_passive``."""
        if model is not self.model:
            return
        if self._gusts is not None:
            place = data.time / Turbulence.STEP
            k = min(int(place), len(self._gusts) - 2)
            gust = self._gusts[k] + (place - k) * (self._gusts[k + 1] - self._gusts[k])
            self.parameters[self._wind] = self.environment.wind + gust
        elif isinstance(self.secret, Thermal):
            # MuJoCo's world has its y axis to the west and its z axis up
            up = self.secret.wind_up(float(data.qpos[0]), -float(data.qpos[1]))
            self.parameters[self._wind] = self.environment.wind - np.array([0.0, 0.0, up])
        super().apply(model, data)
        if isinstance(self.secret, PowerLawTorque):
            data.qfrc_passive[5] -= self.secret.torque(-data.qvel[5])  # z of MuJoCo's body axes is up
        elif isinstance(self.secret, LiftHysteresis):
            data.qfrc_passive[:3] += self._late_lift(self.secret, data)
        elif isinstance(self.secret, DryingDisc):
            data.qfrc_passive[:6] *= self.secret.lighter(data.time)

    def _late_lift(self, secret: LiftHysteresis, data: Any) -> FloatArray:
        """Return the force (3,) in MuJoCo's world axes, across the wind, that a late angle of attack adds."""
        flat = np.empty(9)
        mujoco.mju_quat2Mat(flat, data.qpos[3:7])
        C = flat.reshape(3, 3)
        through_air = data.qvel[:3] - flip_yz(self.environment.wind)
        u, v, up = C.T @ through_air
        alpha = float(np.arctan2(-up, np.hypot(u, v)))
        time, late = self._late or (data.time, alpha)
        if data.time > time:  # once per step: the stages of one step share what was before
            late += (alpha - late) * (1.0 - np.exp(-(data.time - time) / secret.tau))
        self._late = (data.time, late)
        V = float(np.linalg.norm(through_air))
        assert self.disc.aero is not None
        assert self.environment.air_density is not None
        pressure = 0.5 * self.environment.air_density * V * V * self.disc.area
        lift = secret.share * pressure * self.disc.aero.CLa * (late - alpha)
        along = through_air / V
        across = C[:, 2] - (C[:, 2] @ along) * along
        return np.asarray(lift * across / np.linalg.norm(across))


# ---------------------------------------------------------------------------------------------- on the bench

_SPINNER = """
<mujoco>
  <option timestep="0.001" integrator="RK4"/>
  <worldbody>
    <body name="axis">
      <body name="rotor">
        <joint name="spin" type="hinge" axis="0 0 -1"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def coast(
    rig: Rig,
    environment: Environment,
    rate: float,
    duration: float,
    effects: Sequence[Effect] = (),
    secret: OffCatalogue | None = None,
    *,
    yaw: float = 0.0,
) -> Motion:
    """Let a rig run down in MuJoCo's own joint and return its true motion.

    Viscous and quadratic drag are the joint's polynomial damping, dry friction is its friction loss (a constraint of
    the solver), a tilt turns the body that carries the hinge: none of it is the catalogue's formula. Only a kick is.
    """
    given = by_id(effects)
    model, tilt = _spinner(rig, environment, given, secret)
    data = mujoco.MjData(model)
    check_model(model)
    data.qpos[0], data.qvel[0] = yaw, rate
    kick = given.get("event.spin_step")

    def hidden(stepped_model: Any, stepped_data: Any) -> None:
        if stepped_data is not data:
            return
        r = float(data.qvel[0])
        torque = rig.Izz * spin_step(kick, data.time, r) if kick is not None else 0.0
        if isinstance(secret, PowerLawTorque):
            torque += secret.torque(r)
        elif isinstance(secret, BearingWarmth):
            torque += secret.share * rig.viscous * r * (1.0 - np.exp(-data.time / secret.tau))
        elif isinstance(secret, Cogging):
            torque += secret.torque(float(data.qpos[0]))
        data.qfrc_passive[0] += torque

    steps = round(duration / model.opt.timestep)
    log = np.empty((steps + 1, 4))
    with own_warnings(), passive_force(model, hidden):
        for k in range(steps + 1):
            if k:
                mujoco.mj_step(model, data)
            mujoco.mj_forward(model, data)
            check_state(data)
            log[k] = data.time, data.qpos[0], data.qvel[0], data.qacc[0]
    down = np.array([0.0, 0.0, 1.0])
    still = np.zeros((steps + 1, 3))
    return Motion(
        t=log[:, 0],
        position=still,
        velocity=still,
        acceleration=still,
        attitude=multiply(np.broadcast_to(tilt, (steps + 1, 4)), turn(log[:, 1:2] * down)),
        rate=log[:, 2:3] * down,
        angular_acceleration=log[:, 3:4] * down,
        environment=environment,
    )


def _spinner(
    rig: Rig, environment: Environment, given: Mapping[str, Any], secret: OffCatalogue | None
) -> tuple[mujoco.MjModel, FloatArray]:
    """Return the rig's model, its bearing's friction in the joint, and the quaternion (4,) by which its axis tilts."""
    spec = mujoco.MjSpec.from_string(_SPINNER)
    spec.option.gravity = [0.0, 0.0, -environment.gravity]
    joint, rotor = spec.joint("spin"), spec.body("rotor")
    quadratic = given["rig.quadratic_drag"].coefficient_N_m_s2 if "rig.quadratic_drag" in given else 0.0
    joint.damping = [rig.viscous, quadratic, 0.0]
    joint.frictionloss = given["rig.coulomb_friction"].torque_N_m if "rig.coulomb_friction" in given else 0.0
    rotor.inertia = [rig.Izz, rig.Izz, rig.Izz]
    if isinstance(secret, LoosePart):
        secret.attach(rotor)
    tilt = np.array([1.0, 0.0, 0.0, 0.0])
    if "rig.axis_tilt" in given:
        n, e, d = axis(given["rig.axis_tilt"])
        across = np.hypot(n, e)
        tilt = turn(np.array([-e, n, 0.0]) * np.arctan2(across, d) / across)
        spec.body("axis").quat = [tilt[0], *flip_yz(tilt[1:])]
    return compile_model(spec), tilt


# ---------------------------------------------------------------------------------------------- haunted sensors


@dataclass(frozen=True)
class MagnetisedMagnetometer(Magnetometer):
    """A magnetometer with a magnet that turns beside it, or a mains cable."""

    magnet: RotatingMagnet | MainsField = field(default_factory=lambda: RotatingMagnet(0.0, 0.5))

    def ideal(self, motion: Motion, t: FloatArray) -> FloatArray:
        """Return the reading (n, 3) uT before lag and noise."""
        return np.asarray(super().ideal(motion, t) + self.magnet.field_b(motion, t))


@dataclass(frozen=True)
class HauntedAccelerometer(Accelerometer):
    """An accelerometer that warms up, or whose spring has play along x."""

    warming: Warming = field(default_factory=lambda: Warming("accelerometer", (0.0, 0.0, 0.0), 1.0))
    play: float = 0.0

    def ideal(self, motion: Motion, t: FloatArray) -> FloatArray:
        """Return the reading (n, 3) m/s^2 before lag and noise."""
        reading = super().ideal(motion, t) + self.warming.at(t - motion.start)
        if self.play > 0.0:
            reading[:, 0] = behind_play(reading[:, 0], self.play)
        return np.asarray(reading)


@dataclass(frozen=True)
class WarmingGyroscope(Gyroscope):
    """A gyroscope that warms up."""

    warming: Warming = field(default_factory=lambda: Warming("gyroscope", (0.0, 0.0, 0.0), 1.0))

    def ideal(self, motion: Motion, t: FloatArray) -> FloatArray:
        """Return the reading (n, 3) rad/s before lag and noise."""
        return np.asarray(super().ideal(motion, t) + self.warming.at(t - motion.start))


def haunted(instruments: Instruments, secret: OffCatalogue | None) -> Instruments:
    """Return the instruments with the sensor replaced that a secret acts on."""

    def replaced(name: str, kind: type[Any], **added: Any) -> Instruments:
        sensor = instruments.sensors[name]
        own = {item.name: getattr(sensor, item.name) for item in fields(sensor)}
        return Instruments({**instruments.sensors, name: kind(**own, **added)}, instruments.clock)

    if isinstance(secret, (RotatingMagnet, MainsField)):
        return replaced("magnetometer", MagnetisedMagnetometer, magnet=secret)
    if isinstance(secret, SensorHysteresis):
        return replaced("accelerometer", HauntedAccelerometer, play=secret.width)
    if isinstance(secret, Warming) and secret.sensor == "accelerometer":
        return replaced("accelerometer", HauntedAccelerometer, warming=secret)
    if isinstance(secret, Warming):
        return replaced("gyroscope", WarmingGyroscope, warming=secret)
    return instruments
