"""Array types used throughout, read-only copies of what is handed in, and a spread that outliers do not move."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from discsim.errors import InputError, shown

__all__ = [
    "BoolArray",
    "ComplexArray",
    "FloatArray",
    "IntArray",
    "readonly",
    "real",
    "require_array",
    "require_reals",
    "runs",
    "scatter_of",
    "sd_by_median",
    "sd_of_share",
    "sealed",
    "vector3",
    "within_half_turn",
]

FloatArray: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.int64]
ComplexArray: TypeAlias = NDArray[np.complex128]


def readonly(values: ArrayLike) -> FloatArray:
    """Return a read-only float64 copy; a frozen dataclass alone would still let its arrays be written.

    An array that owns its numbers and is read-only already is one: it comes back as it is.
    """
    if type(values) is np.ndarray and values.dtype == np.float64 and values.base is None and not values.flags.writeable:
        return values
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def real(values: ArrayLike) -> FloatArray:
    """Return real numbers as float64; raises ValueError for complex ones, and for dates, whose unit would be lost."""
    array = np.asarray(values)
    if array.dtype.kind in "mM":
        how = "t" if array.dtype.kind == "m" else "(t - t[0])"
        raise ValueError(f"got {array.dtype}, expected numbers; of times in seconds: {how} / np.timedelta64(1, 's')")
    if array.dtype.kind == "c":
        raise ValueError("got complex numbers, expected real ones")
    if array.dtype.kind in "US":
        raise ValueError("got texts, expected numbers")
    return np.asarray(array, dtype=np.float64)


def sealed(array: FloatArray) -> FloatArray:
    """Return an array that nobody else holds, made read-only: `readonly` without a copy."""
    array.setflags(write=False)
    return array


def sd_of_share(share: float, count: float) -> float:
    """Return the standard deviation of a share of so many; of none and of all as if one had been the other."""
    return float(np.sqrt(max(share * (1.0 - share), 1.0 / count) / count))


def sd_by_median(values: ArrayLike, axis: int | None = None) -> Any:
    """Return the standard deviation of Gaussian values about zero by the median of their sizes, along an axis or all.

    A median absolute deviation is about the values' own median; of residuals zero is known to be the middle.
    """
    return 1.4826 * np.median(np.abs(values), axis=axis)


def scatter_of(position: FloatArray) -> float:
    """Return the scatter of single points (n, k) m by third differences, robustly; 0 of fewer than four.

    Third differences of white noise have 20 times its variance.
    """
    third = np.diff(position, 3, axis=0)
    return float(np.median(np.abs(third)) / 0.6745 / 20.0**0.5) if third.size else 0.0


def runs(chosen: BoolArray) -> list[tuple[int, int]]:
    """Return the first place and the one after the last of each run of chosen (n,) places."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(np.int8)))
    return [(int(first), int(after)) for first, after in edges.reshape(-1, 2)]


def vector3(values: ArrayLike | Sequence[float], what: str) -> FloatArray:
    """Return ``values`` as a read-only (3,) array, or raise `InputError` naming ``what``."""
    array = readonly(require_reals(values, what, "three finite numbers"))
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        raise InputError(f"{what}: got {shown(values)}, expected three finite numbers")
    return array


def require_reals(values: ArrayLike, name: str, expected: str) -> FloatArray:
    """Return real numbers of any shape as float64; raises `InputError` with the argument's name for what is none."""
    try:
        return real(values)
    except (ValueError, TypeError):
        raise InputError(f"{name} is {shown(values)}, of type {type(values).__name__}; expected {expected}") from None


def require_array(values: ArrayLike, name: str, expected: str, *shapes: tuple[int | None, ...]) -> FloatArray:
    """Return real numbers as float64 of one of some shapes, in which None is any length.

    Raises `InputError` with the argument's ``name``, what it is and what was ``expected``.

    >>> require_array([[1.0, 2.0]], "rates", "(n,) rad/s", (None,))
    Traceback (most recent call last):
    discsim.errors.InputError: rates has shape (1, 2); expected (n,) rad/s
    """
    array = require_reals(values, name, expected)
    if not any(
        len(shape) == array.ndim and all(length in (None, own) for length, own in zip(shape, array.shape, strict=True))
        for shape in shapes
    ):
        raise InputError(f"{name} has shape {array.shape}; expected {expected}")
    return array


def within_half_turn(angle: FloatArray) -> FloatArray:
    """Return angles in rad without their whole turns: from -pi to below pi."""
    return np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi
