"""Where two estimates of one spin rate contradict each other by more than they say they may be off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from discsim.arrays import FloatArray
from discsim.estimators.rate import YawRate

__all__ = ["Disagreement", "compare", "disagreements"]

#: Differences count from three combined standard deviations, which Gaussian errors exceed 0.3 % of the time;
#: a pair is reported where more than this share of its common times exceed them.
SIGMAS = 3.0
SHARE = 0.05


@dataclass(frozen=True)
class Disagreement:
    """How two methods differ at the common times where they contradict each other.

    Attributes
    ----------
    first, second : str
        The methods; ``difference`` is first less second.
    start, stop : float
        First and last such time, s.
    share : float
        Share of the common times that are such.
    common : int
        Number of common times.
    difference : float
        Median difference of the magnitudes (of the rates where both have a sign), rad/s.
    relative : float
        Median of its size over the second method's rate.
    sigmas : float
        Median of its size in combined standard deviations.
    """

    first: str
    second: str
    start: float
    stop: float
    share: float
    common: int
    difference: float
    relative: float
    sigmas: float

    @property
    def text(self) -> str:
        """One sentence for a person."""
        degrees = f"{np.degrees(self.difference):+.1f} deg/s"
        # of a rate near zero a difference is no share
        much = f"{100 * self.relative:.2g} % ({degrees}" if self.relative < 1 else f"({degrees}"
        return (
            f"{self.first} and {self.second} differ by {much}, {self.sigmas:.1f} sd) at {100 * self.share:.0f} % of "
            "their common times, over "
            f"{self.start + 0.0:.1f}..{self.stop:.1f} s"
        )


def disagreements(rates: Sequence[YawRate]) -> list[Disagreement]:
    """Compare every pair; return those that contradict each other."""
    return [found for a, b in combinations(rates, 2) if (found := compare(a, b)) is not None]


def compare(first: YawRate, second: YawRate) -> Disagreement | None:
    """Compare two estimates at the times of the one with fewer values; None where they do not contradict each other.

    The other is taken linearly between its values, and only beside one. Standard deviations are combined as if
    independent.
    """
    fewer, more = (first, second) if len(first) <= len(second) else (second, first)
    if len(more) < 2:
        return None
    t = fewer.t
    other, other_sd = _between(more, t, more.rate), _between(more, t, more.sd)
    a, b = (fewer.rate, other) if fewer is first else (other, fewer.rate)
    if not (first.signed and second.signed):
        a, b = np.abs(a), np.abs(b)
    difference, spread = a - b, np.hypot(fewer.sd, other_sd)
    known = np.isfinite(difference) & np.isfinite(spread)
    beyond = known & (np.abs(difference) > SIGMAS * spread)
    common = int(known.sum())
    if not beyond.any() or beyond.sum() <= SHARE * common:
        return None
    size = np.abs(difference[beyond])
    with np.errstate(divide="ignore", invalid="ignore"):
        relative, sigmas = np.median(size / np.abs(b[beyond])), np.median(size / spread[beyond])
    return Disagreement(
        first.method,
        second.method,
        float(t[beyond][0]),
        float(t[beyond][-1]),
        float(beyond.sum() / common),
        common,
        float(np.median(difference[beyond])),
        float(relative),
        float(sigmas),
    )


def _between(rate: YawRate, t: FloatArray, value: FloatArray) -> FloatArray:
    """Return ``value`` of an estimate at times t, NaN outside it and further than its spacing from any of its times."""
    spacing = float(np.median(np.diff(rate.t)))
    after = np.clip(np.searchsorted(rate.t, t), 1, len(rate) - 1)
    nearest = np.minimum(np.abs(t - rate.t[after - 1]), np.abs(t - rate.t[after]))
    found = np.interp(t, rate.t, value, left=np.nan, right=np.nan)
    return np.where(nearest <= spacing, found, np.nan)
