"""The usable readings of one sensor, in the form that a fit takes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from discsim.arrays import BoolArray, FloatArray

__all__ = ["Readings", "group_of"]


@dataclass(frozen=True)
class Readings:
    """The usable readings of one sensor of a recording.

    t (n,) written times; value (n, k); good (n, k) tells which readings count; sd (k,) the stated noise with rounding
    (NaN where nothing is stated), or (n, k) where it is known reading by reading; clipped (n, k) stand at the limit,
    which is the range unless readings stand still below it.
    """

    sensor: str
    t: FloatArray
    value: FloatArray
    good: BoolArray
    clipped: BoolArray
    sd: FloatArray
    axes: tuple[str, ...]
    #: the range that clips them, as stated or lower; None where there is none
    limit: float | None = None
    #: written times and weights (w, n) of the samples that each reading is a mean of; None where it is one sample
    taken: FloatArray | None = None
    weights: FloatArray | None = None

    @cached_property
    def worth(self) -> float:
        """How many independent samples a reading is worth: one, or what its weights make of several."""
        if self.weights is None or self.weights.size == 0:
            return 1.0
        return 1.0 / max(float(np.median(np.sum(self.weights**2, axis=0))), 1e-9)

    def at(self, chosen: BoolArray) -> Readings:
        """Return some of the readings, ``chosen`` (n,)."""
        return replace(
            self,
            t=self.t[chosen],
            value=self.value[chosen],
            good=self.good[chosen],
            clipped=self.clipped[chosen],
            taken=None if self.taken is None else self.taken[:, chosen],
            weights=None if self.weights is None else self.weights[:, chosen],
        )


def group_of(sensor: str, axis: int) -> str:
    """Return the name under which an axis shares its noise with others."""
    if sensor == "gps":
        return "gps.position" if axis < 3 else "gps.velocity"
    return sensor
