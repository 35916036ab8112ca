"""Array types used throughout, and read-only copies of what is handed in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["BoolArray", "FloatArray", "IntArray", "readonly", "vector3"]

FloatArray: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.int64]


def readonly(values: ArrayLike) -> FloatArray:
    """Return a read-only float64 copy; a frozen dataclass alone would still let its arrays be written."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def vector3(values: ArrayLike | Sequence[float], what: str) -> FloatArray:
    """Return ``values`` as a read-only (3,) array, or raise ValueError naming ``what``."""
    array = readonly(values)
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        raise ValueError(f"{what}: got {values!r}, expected three finite numbers")
    return array
