"""Whether an acceleration holds gravity, as a sensor's reading does. Takes its columns; gives yes or no."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.validation.importing.import_map import G0
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.groups import Triple
from discsim.validation.importing.sniffing.magnitudes import PER_G, REST, gravity_norm, rest_norm
from discsim.validation.importing.sniffing.names import NO_READING, is_called_linear

__all__ = ["GRAVITY_ITSELF", "linear_with_gravity", "rests", "shows_gravity", "weightless"]

#: Names of iOS's motion beside the raw sensors, whose accelerometer reads -1 g along the axis that points up.
_OF_IOS = ("motionuseracceleration", "motiongravity")
GRAVITY_ITSELF = Decision(
    "accelerometer sign",
    "turned",
    "likely",
    "columns are called as iOS does, whose accelerometer shows gravity itself: -1 g along the axis that points up",
)


def shows_gravity(names: Sequence[str]) -> bool:
    """Tell by the names of a log's columns whether its accelerometer shows gravity and not the force against it."""
    return any(name.lower().startswith(_OF_IOS) for name in names)


def weightless(triple: Triple) -> bool:
    """Tell an acceleration with gravity taken off: at rest it is nothing, below a fiftieth of its largest.

    A steady spin is as quiet as a rest, so a fifth of the windows of 16 rows will do, if none rests on gravity.
    """
    value = triple.values[np.isfinite(triple.values).all(axis=1)]
    nothing = 0.02 * float(np.linalg.norm(value, axis=1).max())
    if rest_norm(value) < nothing:
        return True
    count = len(value) // 16
    means = np.linalg.norm(value[: count * 16].reshape(count, 16, 3).mean(axis=1), axis=1)
    return count > 0 and not rests(triple) and bool(np.mean(means < nothing) > 0.2)


def rests(triple: Triple) -> bool:
    """Tell whether most steady readings are gravity in a usual unit, or in counts, as on a launch pad."""
    value = triple.values[np.isfinite(triple.values).all(axis=1)]
    counts = PER_G if np.array_equal(value, np.round(value)) else ()
    shared = gravity_norm(value)
    return any(abs(shared / one - 1) < REST for one in (G0, 1.0, 1000.0, *counts))


def linear_with_gravity(triple: Triple) -> bool:
    """Tell an acceleration that is called linear, and is no reading by that word alone, but rests on gravity.

    ROS calls the specific force so, and people who log its messages do; Movesense calls its files so.
    """
    called = is_called_linear(triple.base) or (not triple.base and is_called_linear(triple.numbers.path.stem))
    return triple.penalty == NO_READING and called and rests(triple)
