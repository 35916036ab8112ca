"""How small an effect is found: the share of effects named against their size, and the size at which half are.

Sizes are in units of the detection limit of the very case (`discsim.validation.challenge.cases.detection_limit`), so
that effects of all kinds can be pooled: 1 is where the information in the recordings is worth `THRESHOLD` in chi2.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit, logit
from scipy.stats import chi2, norm

from discsim.arrays import FloatArray
from discsim.validation.challenge.cases.detection_limit import THRESHOLD
from discsim.validation.challenge.scores.result import Scored

__all__ = ["HALF_GOAL", "Curve", "Sized", "allowed", "detections", "fit_curve", "has_curve"]

#: the size at which half of the effects are named should be at most this, in detection limits
HALF_GOAL = 1.2
#: a curve of one effect's own needs as many cases, and as many of either outcome
LEAST_CASES, LEAST_OF_EITHER = 8, 2
#: what a curve is sought among: half-detection sizes, widths in ln(size), shares missed however large the effect
_HALVES = np.geomspace(0.03, 300.0, 185)
_WIDTHS = np.geomspace(0.05, 2.0, 25)
_MISSED = np.linspace(0.0, 0.4, 17)


class Sized(NamedTuple):
    """One concealed effect: its id, its size in units of its detection limit, and whether it was named."""

    effect: str
    size: float
    named: bool


class Curve(NamedTuple):
    """A fitted share of effects named by size: half of them at ``half``, with an interval of 95 % (profile likelihood).

    Where few are missed and none is small the likelihood may be largest at no size at all: then only ``high`` tells.
    ``low`` is 0 and ``high`` infinite where the cases do not bound it. ``width`` is the logistic's, in ln(size);
    ``missed`` the share that is not named however large.
    """

    half: float
    low: float
    high: float
    width: float
    missed: float
    cases: int
    named: int

    def at(self, size: ArrayLike) -> FloatArray:
        """Return the share named at sizes."""
        return np.asarray(_share(np.log(np.asarray(size, dtype=float) / self.half), self.width, self.missed))

    @property
    def text(self) -> str:
        """The half-detection size with its interval, in words."""
        if self.low <= 0 and not np.isfinite(self.high):
            return "unknown (too few cases)"
        if self.low <= 0 and self.half <= _HALVES[0]:
            return f"below {self.high:.2g} (95 %; no case is small enough to tell more)"
        if self.low <= 0:
            return f"{self.half:.2g} (95 %: at most {self.high:.2g})"
        reach = f"{self.high:.2g}" if np.isfinite(self.high) else "any"
        return f"{self.half:.2g} (95 %: {self.low:.2g} to {reach})"


def detections(scored: Iterable[Scored]) -> list[Sized]:
    """Return every concealed effect that has a detection limit; where there was no answer it was not named."""
    return [Sized(id, size, id in item.score.named) for item in scored for id, size in item.sizes.items() if size > 0.0]


def allowed(size: ArrayLike) -> FloatArray:
    """Return the share that the information allows: the estimate of a size scatters by limit / sqrt(THRESHOLD).

    An effect is then above the threshold with the probability that a normal deviate leaves it there.
    """
    return np.asarray(norm.cdf(sqrt(THRESHOLD) * (np.asarray(size, dtype=float) - 1.0)))


def has_curve(items: Sequence[Sized]) -> bool:
    """Tell whether these cases can tell a half-detection size of their own."""
    named = sum(item.named for item in items)
    return len(items) >= LEAST_CASES and min(named, len(items) - named) >= LEAST_OF_EITHER


def fit_curve(items: Sequence[Sized]) -> Curve | None:
    """Return the most likely logistic in ln(size) with a share missed at any size; None where all or none are named.

    The likelihood is computed on a grid, which has no local maxima to be caught in, and its profile gives the interval.
    """
    named = np.array([item.named for item in items], dtype=bool)
    if not named.size or named.all() or not named.any():
        return None
    x = np.log([item.size for item in items])
    offset = x - np.log(_HALVES)[:, None, None]  # (halves, 1, cases)
    levels = np.empty((_HALVES.size, _WIDTHS.size, _MISSED.size))
    for j, width in enumerate(_WIDTHS):
        share = np.clip(_share(offset, width, _MISSED[:, None]), 1e-12, 1.0 - 1e-12)
        levels[:, j] = np.log(np.where(named, share, 1.0 - share)).sum(axis=-1)
    best = np.unravel_index(int(np.argmax(levels)), levels.shape)
    profile = levels.max(axis=(1, 2))
    within = np.flatnonzero(2.0 * (profile.max() - profile) <= chi2.ppf(0.95, 1))
    return Curve(
        half=float(_HALVES[best[0]]),
        low=float(_HALVES[within[0]]) if within[0] > 0 else 0.0,
        high=float(_HALVES[within[-1]]) if within[-1] < _HALVES.size - 1 else inf,
        width=float(_WIDTHS[best[1]]),
        missed=float(_MISSED[best[2]]),
        cases=int(named.size),
        named=int(named.sum()),
    )


def _share(offset: FloatArray, width: float, missed: ArrayLike) -> FloatArray:
    """Return the share named where ln(size) lies ``offset`` above that of one half."""
    most = 1.0 - np.asarray(missed, dtype=float)
    return np.asarray(most * expit(offset / width + logit(0.5 / most)))
