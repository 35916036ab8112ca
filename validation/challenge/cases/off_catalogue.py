"""Physics that the catalogue lacks: it lives here only, so that a diagnosis has nothing to look it up in.

Each kind is one frozen type: its fields are its numbers, ``drawn`` a specimen of a size that nobody could take for
noise, ``law`` what a person would write down who knew. Kinds that act on the motion work inside MuJoCo, on the disc
(`HiddenDisc`) or on the rig (`coast`); kinds that act on a sensor replace it by one that is haunted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any, ClassVar, TypeAlias

import mujoco
import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray
from discsim.callbacks import compile_model, own_warnings, passive_force
from discsim.compiled import compiled
from discsim.disc import Disc, Rig
from discsim.effects.catalogue import Effect, by_id
from discsim.effects.events import spin_step
from discsim.effects.rig import axis
from discsim.engine import FlyingDisc, check_model, check_state
from discsim.environment import Environment
from discsim.frames import flip_yz, multiply, turn
from discsim.motion import Motion
from discsim.parameters import parameter_index
from discsim.recording import Plant
from discsim.sensors import Accelerometer, Gyroscope, Instruments, Magnetometer

__all__ = [
    "OFF_CATALOGUE",
    "BearingWarmth",
    "HiddenDisc",
    "LiftHysteresis",
    "LoosePart",
    "OffCatalogue",
    "PowerLawTorque",
    "RotatingMagnet",
    "SensorHysteresis",
    "Turbulence",
    "Warming",
    "coast",
    "haunted",
]


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a size whose logarithm is even."""
    return float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.6g}")


@dataclass(frozen=True)
class PowerLawTorque:
    """Torque ``-coefficient sign(r) |r|^exponent`` about z_B, in a bearing or in the air."""

    coefficient: float
    exponent: float
    plants: ClassVar[tuple[Plant, ...]] = ("spin_down", "flight")

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> PowerLawTorque:
        """Draw a torque that is 5 to 50 % of the baseline's at 60 rad/s; the exponent keeps clear of 0, 1 and 2."""
        low, high = ((2.5, 3.5), (1.4, 1.6))[int(plant == "spin_down" and rng.random() < 0.25)]
        exponent = round(float(rng.uniform(low, high)), 3)
        at_60 = 1.8e-3 if plant == "spin_down" else 1.5e-3
        return cls(float(f"{log_uniform(rng, 0.05, 0.5) * at_60 / 60.0**exponent:.6g}"), exponent)

    @property
    def law(self) -> str:
        """What it is, as text."""
        return f"torque about z_B -{self.coefficient:g} sign(r) |r|^{self.exponent:g} N m, r in rad/s"

    def torque(self, r: float) -> float:
        """Torque, N m, at rate r in rad/s."""
        return float(-np.sign(r) * self.coefficient * abs(r) ** self.exponent)


@dataclass(frozen=True)
class BearingWarmth:
    """A bearing that runs easier as it warms: viscous friction falls by ``share`` with time constant ``tau`` (s)."""

    share: float
    tau: float
    plants: ClassVar[tuple[Plant, ...]] = ("spin_down",)

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> BearingWarmth:
        """Draw a bearing that loses 10 to 50 % of its friction within a run."""
        return cls(log_uniform(rng, 0.1, 0.5), log_uniform(rng, 4.0, 12.0))

    @property
    def law(self) -> str:
        """What it is, as text."""
        return f"torque about z_B +{self.share:g} viscous r (1 - exp(-t/{self.tau:g} s))"


@dataclass(frozen=True)
class LiftHysteresis:
    """Lift that follows the angle of attack late: that much of it (``share``) by a lag of ``tau`` seconds."""

    share: float
    tau: float
    plants: ClassVar[tuple[Plant, ...]] = ("flight",)

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> LiftHysteresis:
        """Draw a lag that a flow around a disc could have, and far more."""
        return cls(round(float(rng.uniform(0.4, 1.0)), 3), log_uniform(rng, 0.15, 0.6))

    @property
    def law(self) -> str:
        """What it is, as text."""
        return f"lift Q A CLa {self.share:g} (alpha_late - alpha), {self.tau:g} s d(alpha_late)/dt = alpha - alpha_late"


@dataclass(frozen=True)
class LoosePart:
    """A part (kg) that slides out along x_B against friction, from the middle to ``reach`` (m)."""

    mass: float
    reach: float
    drag: float
    plants: ClassVar[tuple[Plant, ...]] = ("flight", "free_spin", "spin_down")

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> LoosePart:
        """Draw a battery that slips: 2 to 8 g over 15 to 40 mm in a second or so."""
        mass = log_uniform(rng, 0.002, 0.008)
        # it creeps at r^2 mass/drag per metre of radius: from 1 mm to its reach within this time, at 60 rad/s; a
        # longer time would need a friction too stiff for steps of 1 ms
        slow = float(rng.uniform(0.5, 1.2))
        reach = float(f"{rng.uniform(0.015, 0.04):.4g}")
        return cls(mass, reach, float(f"{mass * 3600.0 * slow / np.log(reach / 1e-3):.5g}"))

    @property
    def law(self) -> str:
        """What it is, as text."""
        return f"a part of {1e3 * self.mass:.2g} g slides {1e3 * self.reach:.3g} mm out along x_B"

    def attach(self, body: Any) -> None:
        """Add the part to a body of a mujoco.MjSpec; it starts 1 mm off the middle."""
        part = body.add_body(name="loose", pos=[1e-3, 0.0, 0.0])
        part.add_joint(
            name="slide",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=[1.0, 0.0, 0.0],
            damping=[self.drag, 0.0, 0.0],
            limited=True,
            range=[0.0, self.reach],
        )
        part.mass = self.mass
        part.inertia = [self.mass * 1e-5] * 3
        part.explicitinertial = True


@dataclass(frozen=True)
class Turbulence:
    """Wind that comes and goes: three independent components of rms ``intensity`` (m/s) over ``scale`` seconds.

    Dryden's spectrum along the path: a first-order Gauss-Markov process, other in every recording.
    """

    intensity: float
    scale: float
    seed: int
    plants: ClassVar[tuple[Plant, ...]] = ("flight",)
    STEP: ClassVar[float] = 0.01

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> Turbulence:
        """Draw a wind of 0.3 to 2 m/s rms on a scale of 0.2 to 1 s (4 to 20 m of path)."""
        return cls(log_uniform(rng, 0.3, 2.0), log_uniform(rng, 0.2, 1.0), int(rng.integers(2**31)))

    @property
    def law(self) -> str:
        """What it is, as text."""
        return f"a turbulent wind of {self.intensity:g} m/s rms, correlated over {self.scale:g} s"

    def series(self, recording: int) -> FloatArray:
        """Return the wind (n, 3) m/s in N of one recording on a grid of `STEP`, 40 s long."""
        rng = np.random.default_rng([self.seed, recording])
        drive = rng.standard_normal((4000, 3))
        keep = float(np.exp(-self.STEP / self.scale))
        wind = np.empty_like(drive)
        wind[0] = drive[0]
        for k in range(1, len(drive)):
            wind[k] = keep * wind[k - 1] + np.sqrt(1 - keep * keep) * drive[k]
        return self.intensity * wind


@dataclass(frozen=True)
class RotatingMagnet:
    """A magnet that turns beside the sensor at ``ratio`` times the spin: a field (uT) in the plane of the disc."""

    field_uT: float
    ratio: float
    plants: ClassVar[tuple[Plant, ...]] = ("flight", "free_spin", "rate_table", "spin_down")

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> RotatingMagnet:
        """Draw a field of 2 to 15 uT; the ratio keeps clear of 0 (hard iron) and 1 (soft iron, stray field)."""
        low, high = ((0.25, 0.7), (1.3, 2.6))[int(rng.random() < 0.5)]
        return cls(log_uniform(rng, 2.0, 15.0), round(float(rng.uniform(low, high)), 3))

    @property
    def law(self) -> str:
        """What it is, as text."""
        return f"magnetometer x, y {self.field_uT:g} uT (cos, sin)({self.ratio:g} psi), psi the angle turned"

    def field_b(self, motion: Motion, t: FloatArray) -> FloatArray:
        """Return the field in B (n, 3) uT at instants t (n,)."""
        turned = cumulative_trapezoid(motion.rate[:, 2], motion.t, initial=0)
        angle = self.ratio * np.interp(t, motion.t, turned)
        return self.field_uT * np.column_stack((np.cos(angle), np.sin(angle), np.zeros(t.size)))


@dataclass(frozen=True)
class Warming:
    """A bias that temperature drives, ``bias (1 - exp(-t/tau))``, of the accelerometer (m/s^2) or gyroscope (rad/s)."""

    sensor: str
    bias: tuple[float, float, float]
    tau: float
    plants: ClassVar[tuple[Plant, ...]] = ("flight", "free_spin", "rate_table", "spin_down")

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> Warming:
        """Draw a drift that is far from linear within a recording, 5 to 30 times the noise of one sample."""
        # where translation is unknown only the gyroscope shows its bias
        sensor = "gyroscope" if plant == "free_spin" or rng.random() < 0.5 else "accelerometer"
        size = log_uniform(rng, 0.4, 2.0) if sensor == "accelerometer" else log_uniform(rng, 0.02, 0.1)
        direction = rng.standard_normal(3)
        bias = size * direction / np.linalg.norm(direction)
        tau = float(rng.uniform(3.0, 7.0) if plant in ("rate_table", "spin_down") else rng.uniform(0.6, 1.2))
        x, y, z = (float(f"{b:.6g}") for b in bias)
        return cls(sensor, (x, y, z), round(tau, 3))

    @property
    def law(self) -> str:
        """What it is, as text."""
        unit = "m/s^2" if self.sensor == "accelerometer" else "rad/s"
        x, y, z = self.bias
        return f"{self.sensor} bias ({x:g}, {y:g}, {z:g}) {unit} (1 - exp(-t/{self.tau:g} s))"

    def at(self, t: FloatArray) -> FloatArray:
        """Return the bias (n, 3) at t (n,) seconds from the start."""
        return np.outer(1.0 - np.exp(-t / self.tau), self.bias)


@dataclass(frozen=True)
class SensorHysteresis:
    """An accelerometer whose spring has play: x lags by ``width`` (m/s^2) behind whichever way it goes."""

    width: float
    plants: ClassVar[tuple[Plant, ...]] = ("rate_table",)

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> SensorHysteresis:
        """Draw 0.3 to 3 m/s^2 of play, up to two per cent of the range."""
        return cls(log_uniform(rng, 0.3, 3.0))

    @property
    def law(self) -> str:
        """What it is, as text."""
        return f"accelerometer x with a play of +-{self.width:g} m/s^2 (hysteresis)"


OffCatalogue: TypeAlias = (
    PowerLawTorque
    | BearingWarmth
    | LiftHysteresis
    | LoosePart
    | Turbulence
    | RotatingMagnet
    | Warming
    | SensorHysteresis
)

#: kinds by the name used on the command line and in an answer
OFF_CATALOGUE: Mapping[str, type[OffCatalogue]] = MappingProxyType(
    {
        "power_law_torque": PowerLawTorque,
        "bearing_warmth": BearingWarmth,
        "lift_hysteresis": LiftHysteresis,
        "loose_part": LoosePart,
        "turbulence": Turbulence,
        "rotating_magnet": RotatingMagnet,
        "warming": Warming,
        "sensor_hysteresis": SensorHysteresis,
    }
)


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
        super().apply(model, data)
        if isinstance(self.secret, PowerLawTorque):
            data.qfrc_passive[5] -= self.secret.torque(-data.qvel[5])  # z of MuJoCo's body axes is up
        elif isinstance(self.secret, LiftHysteresis):
            data.qfrc_passive[:3] += self._late_lift(self.secret, data)

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
    """A magnetometer with a magnet that turns beside it."""

    magnet: RotatingMagnet = field(default_factory=lambda: RotatingMagnet(0.0, 0.5))

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
            reading[:, 0] = play(reading[:, 0], self.play)
        return np.asarray(reading)


@dataclass(frozen=True)
class WarmingGyroscope(Gyroscope):
    """A gyroscope that warms up."""

    warming: Warming = field(default_factory=lambda: Warming("gyroscope", (0.0, 0.0, 0.0), 1.0))

    def ideal(self, motion: Motion, t: FloatArray) -> FloatArray:
        """Return the reading (n, 3) rad/s before lag and noise."""
        return np.asarray(super().ideal(motion, t) + self.warming.at(t - motion.start))


@compiled
def play(x: FloatArray, width: float) -> FloatArray:
    """Return what a part with play +-width shows that x (n,) pushes to and fro, Prandtl's operator."""
    y = np.empty_like(x)
    y[0] = x[0]
    for k in range(1, x.size):
        y[k] = min(max(y[k - 1], x[k] - width), x[k] + width)
    return y


def haunted(instruments: Instruments, secret: OffCatalogue | None) -> Instruments:
    """Return the instruments with the sensor replaced that a secret acts on."""

    def replaced(name: str, kind: type[Any], **added: Any) -> Instruments:
        sensor = instruments.sensors[name]
        own = {item.name: getattr(sensor, item.name) for item in fields(sensor)}
        return Instruments({**instruments.sensors, name: kind(**own, **added)}, instruments.clock)

    if isinstance(secret, RotatingMagnet):
        return replaced("magnetometer", MagnetisedMagnetometer, magnet=secret)
    if isinstance(secret, SensorHysteresis):
        return replaced("accelerometer", HauntedAccelerometer, play=secret.width)
    if isinstance(secret, Warming) and secret.sensor == "accelerometer":
        return replaced("accelerometer", HauntedAccelerometer, warming=secret)
    if isinstance(secret, Warming):
        return replaced("gyroscope", WarmingGyroscope, warming=secret)
    return instruments
