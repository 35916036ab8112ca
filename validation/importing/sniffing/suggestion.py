"""What a table in which no sensor was found may hold. Takes it; gives the line of names that a user can put above it.

Nothing is taken by it: the readings show which columns are worth a name, and a person knows which.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.sniffing.behaviour import STILL, gyroscopes_alike
from discsim.validation.importing.sniffing.clock import clocks_of
from discsim.validation.importing.sniffing.groups import FEWEST_ROWS, Numbers, Triple
from discsim.validation.importing.sniffing.magnitudes import rest_norm
from discsim.validation.importing.sniffing.names import is_time_name

__all__ = ["either_gyroscope", "suggested"]

#: A table of more columns is no log that a line of names mends; and a sentence shows so many readings.
_MOST, _SHOWN = 24, 4
#: A size that lies between these shares of its largest is a field's, or gravity's: it hardly changes.
_STEADY = 0.5


def suggested(numbers: Numbers) -> str:
    """Return a line of names for a table and what the readings below them are; empty where no three go together."""
    names = list(numbers.table.columns)
    known = [k for k in range(len(names)) if np.isfinite(numbers.values[:, k]).sum() >= FEWEST_ROWS]
    threes = _threes(numbers, known)
    if not threes or len(names) > _MOST:
        return ""
    column = clocks_of(numbers)[0].column
    if column is not None and not is_time_name(column):
        names[names.index(column)] = "time"
    read = []
    for at in threes:
        value = numbers.values[:, at : at + 3]
        value = value[np.isfinite(value).all(axis=1)]
        letter, rest, peak = _letter(value), rest_norm(value), float(np.linalg.norm(value, axis=1).max())
        taken = sum(name.startswith(f"{letter}x") for name in names)
        names[at : at + 3] = [f"{letter}{axis}{taken + 1 if taken else ''}" for axis in "xyz"]
        first, _, last = numbers.table.columns[at : at + 3]
        read.append(f"'{first}' to '{last}' are {rest:.3g} at rest and reach {peak:.3g}")
    line = ",".join(names)
    return (
        f"its columns may be '{line}' (by their size alone: {'; '.join(read[:_SHOWN])}): where that is so, or "
        "corrected, put it above the numbers as the line of names; a is the accelerometer, g the gyroscope, m the "
        "magnetometer"
    )


def _threes(numbers: Numbers, known: Sequence[int]) -> list[int]:
    """Return the first columns of threes that stand side by side and move, left to right; what only ascends is none."""
    free = [k for k in known if not _ascends(numbers.values[:, k])]
    found: list[int] = []
    for k in free:
        beside = {k, k + 1, k + 2} <= set(free)
        if beside and (not found or k >= found[-1] + 3) and np.all(np.ptp(_sound(numbers, k), axis=0) > 0):
            found.append(k)
    return found


def _sound(numbers: Numbers, at: int) -> FloatArray:
    value = numbers.values[:, at : at + 3]
    sound = value[np.isfinite(value).all(axis=1)]
    return sound if len(sound) else np.zeros((1, 3))


def _ascends(value: FloatArray) -> bool:
    """Tell a column that never falls, as a time or a count."""
    sound = value[np.isfinite(value)]
    return bool(np.all(np.diff(sound) >= 0))


def _letter(value: FloatArray) -> str:
    """Return g for readings (n, 3) that are nothing at rest, m for those whose size hardly changes, else a."""
    size = np.linalg.norm(value, axis=1)
    low, high = np.percentile(size, [5, 99.5])
    if rest_norm(value) < STILL * high:
        return "g"
    return "m" if low > _STEADY * high else "a"


def either_gyroscope(triples: Sequence[Triple], accel: Triple | None) -> str:
    """Return what to say where several triples read as a gyroscope does, beside the accelerometer; empty for one."""
    alike = gyroscopes_alike(triples, accel)
    if len(alike) < 2:
        return ""
    those = " and ".join(f"'{triple.label}'" for triple in alike)
    return (
        f"{those} read as a gyroscope's do alike: an acceleration without gravity does, too; give the gyroscope's the "
        "names gx, gy and gz in a line above the numbers"
    )
