"""Physics that the catalogue lacks: it lives in the blind test only, so that a diagnosis has nothing to look it up in.

Each kind is one frozen type: its fields are its numbers, ``drawn`` a specimen of a size that nobody could take for
noise, ``law`` what a person would write down who knew. `hidden_physics` lets them act.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, TypeAlias

import mujoco
import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray
from discsim.motion import Motion
from discsim.recording import Plant

__all__ = [
    "OFF_CATALOGUE",
    "BearingWarmth",
    "Cogging",
    "DryingDisc",
    "LiftHysteresis",
    "LoosePart",
    "MainsField",
    "OffCatalogue",
    "PowerLawTorque",
    "RotatingMagnet",
    "SensorHysteresis",
    "Thermal",
    "Turbulence",
    "Warming",
    "log_uniform",
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


@dataclass(frozen=True)
class Cogging:
    """A bearing that holds in ``order`` places of a turn, as motors do: torque ``amplitude cos(order yaw)`` in N m."""

    amplitude: float
    order: int
    plants: ClassVar[tuple[Plant, ...]] = ("spin_down",)

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> Cogging:
        """Draw a torque that makes the rate pulse by 0.05 to 0.5 rad/s at 60 rad/s, two to four times a turn."""
        order = int(rng.integers(2, 5))
        return cls(float(f"{log_uniform(rng, 0.05, 0.5) * 1.1e-3 * order * 60.0:.6g}"), order)

    @property
    def law(self) -> str:
        """What it is, as text."""
        return f"torque about z_B {self.amplitude:g} cos({self.order} yaw) N m, yaw the rig's own"

    def torque(self, yaw: float) -> float:
        """Torque, N m, at yaw in rad."""
        return self.amplitude * float(np.cos(self.order * yaw))


@dataclass(frozen=True)
class MainsField:
    """The field of a mains cable: ``field_uT`` along ``direction`` in N at ``frequency`` (Hz), in any phase."""

    field_uT: float
    frequency: float
    direction: tuple[float, float, float]
    plants: ClassVar[tuple[Plant, ...]] = ("rate_table", "spin_down", "free_spin")

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> MainsField:
        """Draw a field of 2 to 15 uT of a mains of 50 or 60 Hz, which is never quite that."""
        field_uT = log_uniform(rng, 2.0, 15.0)
        frequency = round(float(rng.choice([50.0, 60.0]) + rng.uniform(-0.2, 0.2)), 3)
        direction = rng.standard_normal(3)
        n, e, d = (float(f"{x:.6g}") for x in direction / np.linalg.norm(direction))
        return cls(field_uT, frequency, (n, e, d))

    @property
    def law(self) -> str:
        """What it is, as text."""
        n, e, d = self.direction
        return f"field in N ({n:g}, {e:g}, {d:g}) {self.field_uT:g} uT cos(2 pi {self.frequency:g} t + any phase)"

    def field_b(self, motion: Motion, t: FloatArray) -> FloatArray:
        """Return the field in B (n, 3) uT at instants t (n,).

        Its phase is that of a number without meaning, so that it is another one in each recording.
        """
        phase = 1e4 * float(np.sum(motion.attitude[0]))
        swing = np.cos(2.0 * np.pi * self.frequency * t + phase)
        return np.asarray(motion.at(t).in_body(np.outer(swing, self.field_uT * np.array(self.direction))))


@dataclass(frozen=True)
class DryingDisc:
    """A wet disc that dries: mass and inertia fall by ``share`` of what is stated with time constant ``tau`` (s)."""

    share: float
    tau: float
    plants: ClassVar[tuple[Plant, ...]] = ("flight",)

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> DryingDisc:
        """Draw 3 to 15 % of its mass, thrown off within a second or so."""
        return cls(log_uniform(rng, 0.03, 0.15), log_uniform(rng, 0.4, 1.5))

    @property
    def law(self) -> str:
        """What it is, as text."""
        return f"mass and inertia {1.0 + self.share:g} to 1 of what is stated, by exp(-t/{self.tau:g} s)"

    def lighter(self, t: float) -> float:
        """Return what the air's force and moment are worth at t s, beside a disc of the stated mass."""
        return 1.0 / (1.0 + self.share * float(np.exp(-t / self.tau)))


@dataclass(frozen=True)
class Thermal:
    """Air that rises with ``speed`` (m/s) about a place in the field, over ``size`` (m)."""

    speed: float
    north: float
    east: float
    size: float
    plants: ClassVar[tuple[Plant, ...]] = ("flight",)

    @classmethod
    def drawn(cls, plant: Plant, rng: np.random.Generator) -> Thermal:
        """Draw air that rises by 1 to 3 m/s over 15 to 40 m, so near that each throw feels it, none alike."""
        size, way = rng.uniform(15.0, 40.0), rng.uniform(0.0, 2.0 * np.pi)
        off = 0.7 * size
        return cls(
            log_uniform(rng, 1.0, 3.0), round(off * np.cos(way), 2), round(off * np.sin(way), 2), round(float(size), 2)
        )

    @property
    def law(self) -> str:
        """What it is, as text."""
        where = f"exp(-((north - {self.north:g})^2 + (east - {self.east:g})^2) / (2 ({self.size:g} m)^2))"
        return f"wind up {self.speed:g} m/s {where}"

    def wind_up(self, north: float, east: float) -> float:
        """Return the wind, m/s upwards, at a place in m."""
        away = ((north - self.north) ** 2 + (east - self.east) ** 2) / self.size**2
        return self.speed * float(np.exp(-0.5 * away))


OffCatalogue: TypeAlias = (
    PowerLawTorque
    | BearingWarmth
    | LiftHysteresis
    | LoosePart
    | Turbulence
    | RotatingMagnet
    | Warming
    | SensorHysteresis
    | Cogging
    | MainsField
    | DryingDisc
    | Thermal
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
        "cogging": Cogging,
        "mains_field": MainsField,
        "drying_disc": DryingDisc,
        "thermal": Thermal,
    }
)
