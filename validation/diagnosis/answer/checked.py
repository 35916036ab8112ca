"""Numbers and names as an answer may hold them: finite, plain, and of recordings that are told."""

from __future__ import annotations

from math import isfinite
from typing import Any, TypeAlias

__all__ = ["Recordings", "Told", "finite", "not_negative", "plain", "shared"]

#: None for what all recordings share, else the names of those that have it, as in a model file
Recordings: TypeAlias = tuple[str, ...] | None


def finite(owner: str, **numbers: float | None) -> None:
    """Refuse numbers that are there and not finite; raises `ValueError` naming their owner."""
    for name, number in numbers.items():
        if number is not None and not isfinite(number):
            raise ValueError(f"{owner}: {name} is {number}, expected a finite number")


def not_negative(owner: str, **numbers: float | None) -> None:
    """Refuse numbers that are there and negative, or not finite; raises `ValueError` naming their owner."""
    finite(owner, **numbers)
    for name, number in numbers.items():
        if number is not None and number < 0:
            raise ValueError(f"{owner}: {name} is {number:g}, expected zero or more")


def plain(number: float | None) -> float | None:
    """Return a number as JSON takes it, also one of numpy's."""
    return None if number is None else float(number)


def shared(recordings: Recordings) -> str | list[str]:
    """Return recordings as JSON has them."""
    return "all" if recordings is None else list(recordings)


class Told:
    """A part of an answer whose fields are texts and numbers, which JSON has by their names."""

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {name: value if isinstance(value, str) else plain(value) for name, value in vars(self).items()}
