"""A stated number that would explain recordings were it another, as the answer tells it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from discsim.validation.diagnosis.answer.checked import Told, finite

__all__ = ["Misstated", "in_short", "sentence"]


@dataclass(frozen=True)
class Misstated(Told):
    """A number of ``recording.toml`` that is stated as exact, and what it would be; units are those of its name."""

    name: str
    stated: float
    value: float
    sd: float

    def __post_init__(self) -> None:
        finite(f"what {self.name} would be", stated=self.stated, value=self.value, sd=self.sd)


def in_short(numbers: Sequence[Misstated]) -> str:
    """Return numbers in the place of what is stated, in a few words."""
    return " and ".join(f"{one.name} {_rounded(one)} in the place of {one.stated:g}" for one in numbers)


def sentence(numbers: Sequence[Misstated], *, instead: bool) -> str:
    """Return what to say of numbers that together explain recordings, ``instead`` of effects that are named."""
    names = ", ".join(one.name for one in numbers)
    stated = ", ".join(f"{one.stated:g}" for one in numbers)
    would = ", ".join(f"{_rounded(one)} ± {one.sd:.2g}" for one in numbers)
    verb, they, them = ("is", "it", "it") if len(numbers) == 1 else ("are", "they", "them")
    left = "nothing but noise would be left without any effect" if instead else "nothing but noise would be left"
    return (
        f"{names} {verb} stated as {stated}, without a sigma. Were {they} {would}, {left}: measure {them} again, with "
        "the board on, or state a sigma."
    )


def _rounded(one: Misstated) -> str:
    """Return the value to the last digit that its standard error leaves, three at least."""
    digits = math.ceil(math.log10(abs(one.value) / one.sd)) if 0.0 < one.sd < abs(one.value) else 0
    return f"{one.value:.{max(digits, 3)}g}"
