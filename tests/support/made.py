"""Short recordings made in MuJoCo, for tests that need some: throws, tables, run-downs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Disc, Release, Rig
from discsim.effects import Effect
from discsim.engine import fly
from discsim.frames import C3, attitude_matrix, euler_angles, quaternion_from_matrix
from discsim.motion import Motion
from discsim.recording import Plant, Recording, Samples
from discsim.rig import spin_down, turn_table
from discsim.sensors import Instruments, record
from discsim.sensors.sampling import Noise
from discsim.shipped import load_disc

DRIVER, FIELD = load_disc("driver")
MODULE = Instruments.from_parts("mpu9250", "neo_m8n")
RIG = Rig(1.1e-3, 4e-5)
PROFILES = (
    Samples(np.array([0.0, 0.5, 1.5, 3.0]), np.array([0.0, 0.0, 50.0, 50.0])),
    Samples(np.array([0.0, 1.0, 2.0, 3.0]), np.array([20.0, 20.0, -40.0, -40.0])),
)


def release_of(heading: float, spin: float, up: float = 3.5) -> Release:
    """Return the release of a throw towards a heading (rad from north), the disc leaning and nosing up with it."""
    C_BN = attitude_matrix(np.radians(-12.0) * np.sign(spin), np.radians(8.0), 1.0) @ C3(heading)
    roll, pitch, yaw = (float(angle) for angle in euler_angles(quaternion_from_matrix(C_BN.T)))
    velocity = C3(heading).T @ np.array([22.0, 0.0, -up])
    return Release(np.array([0.0, 0.0, -1.3]), velocity, roll, pitch, yaw, np.array([0.5, -0.4, spin]))


def flight(hidden: Sequence[Effect] = (), *, heading: float = 0.4, spin: float = 70.0, seconds: float = 1.0) -> Motion:
    """Return the first seconds of a throw."""
    return fly(DRIVER, FIELD, release_of(heading, spin), hidden, duration=seconds)


def throws(
    hidden: Sequence[Effect] = (),
    errors: Sequence[Effect] = (),
    *,
    only: int | None = None,
    seconds: float = 1.5,
    module: Instruments = MODULE,
    disc: Disc = DRIVER,
    plant: Plant = "flight",
) -> list[Recording]:
    """Return two throws; what is hidden acts in both, or in number ``only``."""
    made = []
    for k, (heading, spin) in enumerate(((0.4, 70.0), (-1.9, 62.0))):
        motion = flight(hidden if only in (None, k) else (), heading=heading, spin=spin, seconds=seconds)
        rng = np.random.default_rng(10 + k)
        made.append(record(motion, module.with_effects(errors), rng, plant=plant, name=f"throw-{k}", disc=disc))
    return made


def tables(
    hidden: Sequence[Effect] = (), errors: Sequence[Effect] = (), profiles: Sequence[Samples] = PROFILES
) -> list[Recording]:
    """Return two runs of a rate table, one of them into both directions; or a run of each of some ``profiles``."""
    made = []
    for k, profile in enumerate(profiles):
        motion = turn_table(profile, FIELD, hidden, yaw=0.3 + k)
        module, rng = Instruments.from_parts("mpu9250").with_effects(errors), np.random.default_rng(20 + k)
        made.append(record(motion, module, rng, plant="rate_table", name=f"table-{k}", command=profile))
    return made


def coasts(
    hidden: Sequence[Effect] = (),
    errors: Sequence[Effect] = (),
    *,
    true: Rig = RIG,
    stated: Rig = RIG,
    rates: Sequence[float] = (60.0, 25.0),
    only: int | None = None,
    seconds: float = 4.0,
) -> list[Recording]:
    """Return runs of a rig that coasts down from some rates; its gyroscope would be clipped and stays at home."""
    made = []
    for k, rate in enumerate(rates):
        motion = spin_down(true, FIELD, rate, seconds, hidden if only in (None, k) else (), yaw=0.5 + k)
        made.append(coasting(motion, stated, k, errors))
    return made


def coasting(motion: Motion, stated: Rig, number: int = 0, errors: Sequence[Effect] = ()) -> Recording:
    """Return the recording of one run-down."""
    module = Instruments.from_parts("mpu9250").without("gyroscope").with_effects(errors)
    rng = np.random.default_rng(30 + number)
    return record(motion, module, rng, plant="spin_down", name=f"run-{number}", rig=stated)


def noiseless(module: Instruments) -> Instruments:
    """Return a module without noise, rounding and range."""
    for name in module.sensors:
        if name == "gps":
            module = module.fitted(name, position_noise=Noise(), velocity_noise=Noise())
        else:
            module = module.fitted(name, noise=Noise(), resolution=0.0, range=float("inf"))
    return module


def rows_of(motion: Motion, t: FloatArray) -> FloatArray:
    """Return the true motion as rows (n, 19): position to acceleration in N, attitude, rates and their derivatives."""
    at = motion.at(t)
    return np.hstack([at.position, at.velocity, at.acceleration, at.attitude, at.rate, at.angular_acceleration])


def states_of(motion: Motion, t: FloatArray) -> FloatArray:
    """Return the true motion as states (n, 13) of pieces in the air."""
    at = motion.at(t)
    return np.hstack([at.position, at.velocity, at.attitude, at.rate])
