"""Readings at a limit that stand on the other side than a motion has them: the one thing that such readings tell.

Takes a fit; gives how many of each axis do so, and by how much. No fit counts readings at a limit, so a column whose
sign is reversed and that stands at its limit throughout bends no fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.effects.kind import BOARD
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.prediction import read

__all__ = ["AtLimit", "at_limits"]

#: fewest readings at a limit that tell its side, and the share of them that must be on the other one: one reading in
#: ten may be another's, as a glitch or the beginning of a motion
_FEWEST, _MOST = 25, 0.9


@dataclass(frozen=True)
class AtLimit:
    """How many readings of an axis stand at a limit, how many of those on the other side than the motion.

    ``chi2`` is what these miss the motion by, in the sensor's noise.
    """

    count: int
    other_side: int
    chi2: float

    @property
    def reversed(self) -> bool:
        """Whether the column has the other sign than the axis."""
        return self.count >= _FEWEST and self.other_side > _MOST * self.count


def at_limits(fit: Fit) -> dict[tuple[str, int], AtLimit]:
    """Return the readings at a limit by sensor of the board and axis, of axes that have any."""
    found: dict[tuple[str, int], AtLimit] = {}
    for i, trajectory in enumerate(fit.trajectories):
        for readings in trajectory.readings:
            sensor = readings.sensor
            if sensor not in BOARD or not readings.clipped.any():
                continue
            sd = np.where(np.isfinite(readings.sd), readings.sd, fit.noise[sensor].sd if sensor in fit.noise else 1.0)
            off = readings.value - read(trajectory, fit.values(i), readings)
            other = readings.clipped & (readings.value * (readings.value - off) < 0.0)
            missed = np.where(other, (off / sd) ** 2, 0.0)
            for axis in np.flatnonzero(readings.clipped.any(axis=0)).tolist():
                before = found.get((sensor, axis), AtLimit(0, 0, 0.0))
                found[sensor, axis] = AtLimit(
                    before.count + int(np.count_nonzero(readings.clipped[:, axis])),
                    before.other_side + int(np.count_nonzero(other[:, axis])),
                    before.chi2 + float(np.nansum(missed[:, axis])),
                )
    return found
