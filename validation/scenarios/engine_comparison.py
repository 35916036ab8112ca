"""Two engines, one physics: the same throw in MuJoCo and in the standalone model, and how far they part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Disc, Release
from discsim.effects import aero, air, body, events
from discsim.effects.catalogue import Effect, effect_of
from discsim.engine import fly
from discsim.environment import Environment
from discsim.frames import rotation_error
from discsim.shipped import load_disc
from discsim.trajectory import predict

__all__ = ["DISCS", "EnginePair", "StrongThrow", "compare_engines", "strong_throw"]

DISCS = ("driver", "dd2", "ultrastar", "cd1")


@dataclass(frozen=True)
class StrongThrow:
    """A throw with what it is flown in and with; every effect on a flight is large."""

    name: str
    disc: Disc
    environment: Environment
    release: Release
    effects: tuple[Effect, ...]


def strong_throw(rng: np.random.Generator, number: int) -> StrongThrow:
    """Return a random throw: discs in turn, spins of alternating direction, wobbling, in strong effects."""

    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    def around(size: float) -> float:
        return between(-size, size)

    name = DISCS[number % len(DISCS)]
    disc, environment = load_disc(name)
    speed, climb, heading = between(12.0, 28.0), np.radians(between(0.0, 18.0)), around(np.pi)
    velocity = speed * np.array([np.cos(climb) * np.cos(heading), np.cos(climb) * np.sin(heading), -np.sin(climb)])
    direction = 1.0 if number // len(DISCS) % 2 == 0 else -1.0
    release = Release(
        np.array([around(50.0), around(50.0), -between(0.8, 2.0)]),
        velocity,
        around(0.5),
        around(0.3),
        around(np.pi),
        np.array([around(5.0), around(5.0), direction * between(35.0, 105.0)]),
    )
    effects = (
        air.Wind(w_north_m_s=around(5.0), w_east_m_s=around(5.0)),
        air.WindShear(w_north_m_s=around(2.0), w_east_m_s=around(2.0), exponent=0.2),
        air.Gust(t_s=between(0.3, 2.0), width_s=0.2, w_north_m_s=around(3.0), w_east_m_s=around(3.0)),
        air.Density(ratio=1.1),
        air.GroundEffect(k=0.3),
        aero.SpinSideForce(CYr=around(0.02)),
        aero.SpinLift(CLr=around(0.02)),
        aero.SpinDrag(CDrr=between(0.0, 0.02)),
        aero.SpinPitchingMoment(CMr=around(0.001)),
        aero.Stall(k=0.3, alpha_stall_rad=0.35),
        aero.YawReynolds(exponent=0.2),
        aero.YawQuadratic(CNrr=-0.001),
        aero.YawAlpha(CNraa=-0.01),
        body.MassImbalance(ex_m=0.001 * np.cos(number), ey_m=0.001 * np.sin(number)),
        body.InertiaAsymmetry(dIyy_kg_m2=between(0.0, 0.02) * disc.Ixx),
        events.Impulse(t_s=between(0.2, 1.0), dv_north_m_s=0.5, dv_east_m_s=-0.5, dv_down_m_s=around(0.3)),
        events.SpinStep(t_s=between(0.2, 1.0), dr_rad_s=around(3.0)),
    )
    return StrongThrow(f"{number}: {name}", disc, environment, release, tuple(map(effect_of, effects)))


@dataclass(frozen=True)
class EnginePair:
    """Differences of the two flights: of the landing, m and s, and the largest on the way, m and rad."""

    landing: float
    delay: float
    position: float
    attitude: float
    duration: float


def compare_engines(throw: StrongThrow, timestep: float = 5e-4, duration: float = 30.0) -> EnginePair:
    """Fly a throw in both engines and compare them at MuJoCo's instants."""
    truth = fly(throw.disc, throw.environment, throw.release, throw.effects, timestep=timestep, duration=duration)
    flight = predict(throw.disc, throw.environment, throw.release, throw.effects, duration=duration)
    last: FloatArray = flight.state[-1, :3] - truth.position[-1]
    common = truth.t <= flight.end
    at = flight.at(truth.t[common])
    return EnginePair(
        landing=float(np.linalg.norm(last)),
        delay=flight.end - truth.end,
        position=float(np.linalg.norm(at.position - truth.position[common], axis=1).max()),
        attitude=float(rotation_error(at.attitude, truth.attitude[common]).max()),
        duration=truth.end,
    )
