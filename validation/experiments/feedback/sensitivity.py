"""How far a touch-down moves with C_Nr, and with the spin at release."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc, Release
from discsim.environment import Environment
from discsim.trajectory import predict

__all__ = ["CHANGES", "Shifts", "touch_down_shifts"]

#: relative errors: a hundredth, ..., all of C_Nr
CHANGES = readonly([0.01, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5])


class Shifts(NamedTuple):
    """How far the touch-down moves, m, by a relative error of C_Nr and by one of the spin at release; both (n,)."""

    damping: FloatArray
    spin: FloatArray


def touch_down_shifts(disc: Disc, environment: Environment, release: Release, changes: FloatArray) -> Shifts:
    """Fly with C_Nr, and with the spin at release, smaller by each of ``changes`` (n,)."""
    assert disc.aero is not None
    assert release.body_rate is not None
    place = predict(disc, environment, release).landing
    damping, spin = [], []
    for change in changes:
        weaker = replace(disc, aero=disc.aero._replace(CNr=disc.aero.CNr * (1.0 - change)))
        damping.append(float(np.linalg.norm(predict(weaker, environment, release).landing - place)))
        slower = replace(release, body_rate=release.body_rate * np.array([1.0, 1.0, 1.0 - change]))
        spin.append(float(np.linalg.norm(predict(disc, environment, slower).landing - place)))
    return Shifts(np.array(damping), np.array(spin))
