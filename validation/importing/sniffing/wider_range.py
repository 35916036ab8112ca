"""Two sensors of a kind, one of a wider range, as boards for rockets and blows have them. Takes the triples of a kind.

At the spin of a throw an accelerometer of 4 or 16 g stands at its limit, and the part for shocks beside it reads on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import BoolArray
from discsim.clipping import clipped
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.groups import Triple

__all__ = ["wider_range"]

#: Share of rows at a limit from which a sensor of a wider range is worth its larger noise: a blow at touch-down is not.
OFTEN = 0.05
#: The other reads so much more there, or it stands at a limit of the same size.
BEYOND = 1.05


def wider_range(first: Triple, others: Sequence[Triple]) -> tuple[Triple, Decision] | None:
    """Return the sensor that reads on where the ``first`` stands at its limit, and why; None where none does.

    Units may differ: one is worth as much of the other as their sizes say where the first reads.
    """
    beside = [other for other in others if other.numbers is first.numbers and other.where == first.where]
    if not beside:
        return None
    at_limit = np.any(clipped(first.values, None, None), axis=1)
    if np.mean(at_limit) < OFTEN:
        return None
    for other in beside:
        if _reads_on(first, other, at_limit):
            why = (
                f"{first.label} stand at their limit in {100 * np.mean(at_limit):.0f} % of the rows, where it reads on"
            )
            return other, Decision(str(first.sensor), other.label, "likely", why)
    return None


def _reads_on(first: Triple, other: Triple, at_limit: BoolArray) -> bool:
    """Tell whether one sensor reads on where the other stands at its limit, ``at_limit`` (n,)."""
    sizes = [np.linalg.norm(one.values, axis=1) for one in (first, other)]
    known = np.isfinite(sizes[0]) & np.isfinite(sizes[1]) & (sizes[0] > 0.0)
    reading, standing = known & ~at_limit, known & at_limit
    if not reading.any() or not standing.any():
        return False
    ratio = sizes[1] / np.where(known, sizes[0], 1.0)
    # the largest half of what the first reads: next to nothing an offset or a step of resolution is all there is
    large = reading & (sizes[0] >= np.median(sizes[0][reading]))
    return bool(np.median(ratio[standing]) > BEYOND * np.median(ratio[large]) > 0.0)
