"""Parameters that recordings share, and how far segments may be apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from discsim.arrays import BoolArray, FloatArray

__all__ = ["AllowedDefects", "Parameter", "Values", "values_of"]

#: parameters that differ from their baseline, by (group, name); groups are effect ids, or aero, disc, environment, rig,
#: or a plant with parameters of its own; a law's are called TERM.PLACE, as in 0.power_r
Values: TypeAlias = Mapping[tuple[str, str], float]


@dataclass(frozen=True)
class Parameter:
    """A number that the recordings share.

    ``stated`` is where it stands without a fit, ``sigma`` the one-sigma uncertainty with which it is stated (inf:
    free), ``step`` half the width of its differences. ``recordings`` are those it acts in; None means all. ``offsets``
    are what recordings that state it differently state beyond that, in their order: all then move by as much.
    """

    group: str
    name: str
    stated: float
    step: float
    sigma: float = np.inf
    recordings: frozenset[int] | None = None
    offsets: tuple[float, ...] = ()

    @property
    def key(self) -> tuple[str, str]:
        """Group and name."""
        return self.group, self.name

    @property
    def precision(self) -> float:
        """What its prior adds to a normal matrix, one over the variance: zero where it is free."""
        return float(self.sigma**-2.0)

    def acts_in(self, recording: int) -> bool:
        """Tell whether it acts in a recording."""
        return self.recordings is None or recording in self.recordings


@dataclass(frozen=True)
class AllowedDefects:
    """How far segments may jump: one-sigma size (d,) in each direction of the state, zero where they may not."""

    sd: FloatArray

    @property
    def allowed(self) -> BoolArray:
        """Directions in which segments may jump."""
        return np.asarray(self.sd > 0)


def values_of(
    parameters: Sequence[Parameter], at: FloatArray, recording: int, fixed: Values
) -> dict[tuple[str, str], float]:
    """Return fixed values and those of the parameters that act in a recording."""
    values = dict(fixed)
    for parameter, number in zip(parameters, at, strict=True):
        if parameter.acts_in(recording):
            own = parameter.offsets[recording] if parameter.offsets else 0.0
            values[parameter.key] = float(number) + own
    return values
