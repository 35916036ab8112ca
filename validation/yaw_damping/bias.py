"""What the paper's way from spin to C_Nr makes of flights whose C_Nr is known, without any sensor's error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Disc
from discsim.environment import Environment
from discsim.motion import Motion
from discsim.trajectory import predict
from discsim.validation.scenarios.closed_forms import yaw_damping_from_motion
from discsim.validation.scenarios.throws import Throw
from discsim.validation.yaw_damping.paper_table import RATES_DEG_S, SPEEDS_M_S, damping_by_26

__all__ = ["Bias", "paper_biases"]


@dataclass(frozen=True)
class Bias:
    """Relative errors of C_Nr on one throw, the truth's own motion taken for the estimate.

    Attributes
    ----------
    name : str
        The throw.
    rolling : float
        (26) with r, V and rdot of each instant, least squares: what leaving out R sin(alpha) costs.
    slope : float
        A straight line and (26) at the mean r and V, of a disc without rolling moment: what one slope costs.
    both : float
        The same of the disc as it is.
    table : (float, float)
        Least and largest of the table (27) along the flight, where it is inside; NaN where it never is.
    """

    name: str
    rolling: float
    slope: float
    both: float
    table: tuple[float, float]


def paper_biases(disc: Disc, environment: Environment, throws: Sequence[Throw]) -> list[Bias]:
    """Fly each throw and return what the paper's way errs by."""
    assert disc.aero is not None
    plain = replace(disc, aero=disc.aero._replace(CRr=0.0, CRp=0.0), rolling_table=None)
    found = []
    for throw in throws:
        motion = predict(disc, environment, throw.release).motion()
        V, r = _speed(motion), np.abs(motion.rate[:, 2])
        weight = (V * r) ** 2
        instants = np.average(yaw_damping_from_motion(motion, disc), weights=weight)
        slope = float(np.polyfit(motion.t, r, 1)[0])
        inside = (r >= np.radians(RATES_DEG_S[0])) & (r <= np.radians(RATES_DEG_S[-1]))
        inside &= (V >= SPEEDS_M_S[0]) & (V <= SPEEDS_M_S[-1])
        nodes = damping_by_26(disc, motion.environment.air_density or 0.0, slope, r[inside], V[inside])
        errors = nodes / disc.aero.CNr - 1
        found.append(
            Bias(
                throw.name,
                float(instants / disc.aero.CNr - 1),
                _by_line(predict(plain, environment, throw.release).motion(), plain),
                _by_line(motion, disc),
                (float(errors.min()), float(errors.max())) if inside.any() else (float("nan"), float("nan")),
            )
        )
    return found


def _by_line(motion: Motion, disc: Disc) -> float:
    assert disc.aero is not None
    r = np.abs(motion.rate[:, 2])
    slope = float(np.polyfit(motion.t, r, 1)[0])
    density = motion.environment.air_density
    assert density is not None
    return float(damping_by_26(disc, density, slope, r.mean(), _speed(motion).mean()) / disc.aero.CNr - 1)


def _speed(motion: Motion) -> FloatArray:
    return np.asarray(np.linalg.norm(motion.velocity - motion.environment.wind, axis=1))
