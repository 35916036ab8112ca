"""Which of several refits of one step is best.

Takes refits that are worth their price, each with what is charged for it; gives the one that explains most beside that.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit
from discsim.validation.identification.gauss_newton import Fit

__all__ = ["Refitted", "best_of"]


class Refitted(NamedTuple):
    """A refit that is worth its price.

    It begins ``about`` a fit; ``cost`` is what choosing lost samples cost it, ``chi2`` its chi-squared and that, and
    ``charged`` what stands against it beside the likelihood.
    """

    fitted: ContinuousFit
    about: Fit
    cost: float
    chi2: float
    charged: float


def best_of(fits: Sequence[Refitted], distant: bool, far: Sequence[bool]) -> Refitted:
    """Return the refit that explains most for what is charged; ``far`` tells of each whether it is far from the data.

    Which is best is asked on the readings that take part in both, as each may leave out others. What only tells why
    readings are out has its evidence from a motion that does not follow the data: it waits where another comes near.
    """
    if distant:
        if not all(far):
            fits = [one for one, off in zip(fits, far, strict=True) if not (off and one.cost < 0.0)]
        # far from the data chi-squared says more than a likelihood that has swallowed the mismatch as noise
        return min(fits, key=lambda one: one.chi2 + one.charged)
    first = min(fits, key=lambda one: one.fitted.score + one.charged).fitted
    return min(fits, key=lambda one: one.fitted.worse_than(first) + one.charged)
