"""Mounts: how far off its stated place and how crooked a sensor sits; what it then reads, from one truth run.

The specific force is affine in the sensor's place, Eq. (1), and a crooked mount turns it. So what is taken from the
truth once, the force at the body's origin and its gradient, gives every mount's reading by a few multiplications.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import prod
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from discsim.arrays import FloatArray, readonly
from discsim.effects.sensors import bias_drift, sensitivity
from discsim.errors import InputError
from discsim.frames import body_to_ned, turn
from discsim.motion import Motion
from discsim.recording import Samples
from discsim.sensors import Accelerometer, Magnetometer
from discsim.sensors.accelerometer import specific_force
from discsim.sensors.sampling import digitise, filtered

__all__ = [
    "MOUNT_FIELDS",
    "AccelerometerView",
    "MagnetometerView",
    "MountDesign",
    "closed_form",
    "look_with_accelerometer",
    "look_with_magnetometer",
    "stretched",
]

#: what a mount is: offset from the stated place in B, m; rotation vector of the sensor's axes, rad
MOUNT_FIELDS = ("x", "y", "z", "about_x", "about_y", "about_z")


@dataclass(frozen=True)
class MountDesign:
    """A set of mounts between ``lower`` and ``upper`` (6,), in the order of `MOUNT_FIELDS`.

    ``design`` "random" draws evenly, "sobol" fills evenly (Sobol' points, scrambled); both have ``count`` mounts.
    "grid" has ``points`` (6,) values along each field, ends included (one point: the middle). "saltelli" is what shares
    of variance are told from: blocks of ``base`` mounts, A, B, for each field that varies A with that field of B, and A
    again, whose modules are those of B. ``count`` is what all blocks hold.
    """

    design: Literal["grid", "random", "sobol", "saltelli"] = "sobol"
    count: int = 1
    lower: FloatArray = field(default_factory=lambda: np.zeros(6))
    upper: FloatArray = field(default_factory=lambda: np.zeros(6))
    points: tuple[int, ...] = (1, 1, 1, 1, 1, 1)
    base: int = 0

    @property
    def varies(self) -> bool:
        """Whether any mount differs from another by more than its module."""
        return bool(np.any(self.upper > self.lower))

    def __post_init__(self) -> None:
        for name in ("lower", "upper"):
            object.__setattr__(self, name, readonly(getattr(self, name)))
            if getattr(self, name).shape != (6,):
                raise ValueError(f"mounts {name}: got {getattr(self, name).shape}, expected (6,)")
        if np.any(self.lower > self.upper):
            raise InputError("mounts: a range runs backwards; expected the smaller number first")
        if self.design == "grid":
            object.__setattr__(self, "count", prod(self.points))
        if self.design == "saltelli":
            if self.base < 2 or self.base & (self.base - 1):
                raise InputError(f"mounts: a saltelli design of {self.base}; expected a power of two, from 2")
            object.__setattr__(self, "count", self.base * (self.varied.size + 3))
        if self.count < 1:
            raise InputError(f"mounts: got {self.count}, expected at least one")

    @property
    def varied(self) -> NDArray[np.int64]:
        """Places in `MOUNT_FIELDS` of the fields that vary."""
        return np.flatnonzero(self.upper > self.lower)

    def module_of(self, mount: int) -> int:
        """Return the number of the module, with its errors and its noise, that sits in a mount.

        Each mount has its own, but for blocks of a saltelli design.
        """
        if self.design != "saltelli":
            return mount
        block, place = divmod(mount, self.base)
        return place + (self.base if block in (1, self.varied.size + 2) else 0)

    def mounts(self, seed: int) -> FloatArray:
        """Return the mounts, (count, 6)."""
        width = self.upper - self.lower
        if self.design == "grid":
            along = [
                np.linspace(low, high, n) if n > 1 else np.array([(low + high) / 2])
                for low, high, n in zip(self.lower, self.upper, self.points, strict=True)
            ]
            return np.stack(np.meshgrid(*along, indexing="ij"), axis=-1).reshape(-1, 6)
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0,)))
        if self.design == "saltelli":
            return self._blocks(rng)
        varied = np.flatnonzero(width > 0)
        unit = np.full((self.count, 6), 0.5)
        if varied.size and self.design == "random":
            unit[:, varied] = rng.random((self.count, varied.size))
        elif varied.size:
            # Sobol' points are even in powers of two; the first `count` of the next power are the nearest to it
            power = int(np.ceil(np.log2(self.count)))
            unit[:, varied] = qmc.Sobol(varied.size, rng=rng).random_base2(power)[: self.count]
        return np.asarray(self.lower + width * unit)

    def _blocks(self, rng: np.random.Generator) -> FloatArray:
        """Return the mounts of a saltelli design, (count, 6): two halves of Sobol' points, and their mixtures."""
        varied = self.varied
        points = qmc.Sobol(2 * varied.size, rng=rng).random_base2(self.base.bit_length() - 1)
        halves = np.full((2, self.base, 6), 0.5)
        halves[:, :, varied] = points.reshape(self.base, 2, varied.size).transpose(1, 0, 2)
        blocks = [halves[0], halves[1]]
        for k in varied:
            mixed = halves[0].copy()
            mixed[:, k] = halves[1][:, k]
            blocks.append(mixed)
        return np.asarray(self.lower + (self.upper - self.lower) * np.concatenate([*blocks, halves[0]]))


def closed_form(rate: FloatArray, position: FloatArray, offset: FloatArray) -> FloatArray:
    """Error of the accelerometer's rate by a mount error alone, (9): r (sqrt(1 + e / d) - 1), in the rate's unit.

    ``rate`` (s,) is the true magnitude, ``position`` (3,) where the sensor is stated to sit, ``offset`` (m, 3) how far
    off it sits; d is the stated distance from the axis and e the part of the offset that leads away from it. Returns
    (m, s); NaN where the offset leads beyond the axis. (9) has d_x < 0 and its e_d is the same along x.
    """
    distance = float(np.hypot(position[0], position[1]))
    outward = offset[:, :2] @ position[:2] / distance
    ratio = 1 + outward / distance
    return np.asarray(np.abs(rate) * (np.sqrt(np.where(ratio >= 0, ratio, np.nan)) - 1)[:, None])


class AccelerometerView(NamedTuple):
    """What an accelerometer anywhere on the body would feel at its sampling instants.

    ``t`` (n,) s as written; ``origin`` (n, 3) m/s^2 and ``gradient`` (n, 3, 3) 1/s^2 of the specific force in B
    (force = origin + gradient @ position), and ``drift`` (n, 3) m/s^2, all through the sensor's lag.
    """

    t: FloatArray
    origin: FloatArray
    gradient: FloatArray
    drift: FloatArray

    def measure(self, sensor: Accelerometer, rng: np.random.Generator) -> Samples:
        """Return what `Accelerometer.measure` does, for this sensor's offset, misalignment and errors.

        The sensor is the one looked with but for these. Only its noise draws from ``rng``: which samples were lost and
        how instants jittered was drawn once, for all mounts.
        """
        x, y, z = sensor.position + np.array(sensor.offset)
        force = self.origin + x * self.gradient[:, :, 0] + y * self.gradient[:, :, 1] + z * self.gradient[:, :, 2]
        chain = body_to_ned(turn(sensor.misalignment)) @ sensitivity(sensor.scale, sensor.cross_axis).T
        value = _times(force, chain) + np.array(sensor.bias) + self.drift
        reading = digitise(value, self.t, sensor.noise, rng, resolution=sensor.resolution, limit=sensor.limit)
        return Samples(self.t, reading)


def stretched(rate: FloatArray, mount_hz: float) -> FloatArray:
    """Return how many times as far from the axis (n,) a module rides at spin rates (n,) rad/s in a mount that yields.

    A module of mass m in an elastic mount vibrates at w = 2 pi ``mount_hz``: m w^2 per metre hold it against m r^2 p at
    its place p, so that p = p0/(1 - (r/w)^2) of where it sits at rest. The spin changes slowly against the vibration,
    which is damped. Raises `InputError` where the spin reaches w: no spring holds it then.
    """
    w = 2 * np.pi * mount_hz
    fastest = float(np.max(np.abs(rate), initial=0.0))
    if fastest >= w:
        raise InputError(
            f"a mount of {mount_hz:g} Hz at {fastest / (2 * np.pi):.3g} turns/s tears off; expected a stiffer"
        )
    return np.asarray(1.0 / (1.0 - (rate / w) ** 2))


def look_with_accelerometer(
    motion: Motion, sensor: Accelerometer, rng: np.random.Generator, mount_hz: float = np.inf
) -> AccelerometerView:
    """Take from a motion what every mount of ``sensor`` needs; ``rng`` draws its instants where they are random.

    A mount that yields, of ``mount_hz``, lets the sensor out by `stretched`.
    """
    written, taken = sensor.sampling.instants(motion.start, motion.end, rng)

    def signal(t: FloatArray) -> FloatArray:
        state = motion.at(t)
        origin = specific_force(state, motion.surroundings, np.zeros(3))
        along = [specific_force(state, motion.surroundings, axis) - origin for axis in np.eye(3)]  # per metre
        out = stretched(state.rate[:, 2], mount_hz)[:, None]
        return np.hstack((origin, out * along[0], out * along[1], along[2], bias_drift(sensor.drift, t - motion.start)))

    # a lag is linear and settled at the start, so it may act before the mount turns and weighs the parts
    parts = filtered(sensor.lag, motion, signal, taken)
    gradient = np.stack((parts[:, 3:6], parts[:, 6:9], parts[:, 9:12]), axis=-1)
    return AccelerometerView(written, parts[:, :3], gradient, parts[:, 12:])


class MagnetometerView(NamedTuple):
    """The field that a magnetometer sees at its sampling instants: t (n,) s as written, field (n, 3) uT in B."""

    t: FloatArray
    field: FloatArray

    def measure(self, sensor: Magnetometer, rng: np.random.Generator) -> Samples:
        """Return what `Magnetometer.measure` does, for this sensor's misalignment; only noise draws from ``rng``."""
        value = _times(self.field, body_to_ned(turn(sensor.misalignment)))
        return Samples(
            self.t, digitise(value, self.t, sensor.noise, rng, resolution=sensor.resolution, limit=sensor.range)
        )


def look_with_magnetometer(motion: Motion, sensor: Magnetometer, rng: np.random.Generator) -> MagnetometerView:
    """Take from a motion what every mounting angle of ``sensor`` needs."""
    if np.any(sensor.misalignment):
        raise ValueError("the magnetometer looked with is crooked already; expected its axes along the body's")
    written, taken = sensor.sampling.instants(motion.start, motion.end, rng)
    return MagnetometerView(written, filtered(sensor.lag, motion, lambda t: sensor.ideal(motion, t), taken))


def _times(rows: FloatArray, matrix: FloatArray) -> FloatArray:
    """Return rows @ matrix, (n, 3) @ (3, 3); numpy's own sum, whose bytes do not depend on a library's threads."""
    return np.asarray(np.einsum("ni,ij->nj", rows, matrix))
