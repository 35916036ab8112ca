"""Which of several refits of one step is best.

Takes refits that are worth their price, each with what is charged for it; gives the one that explains most beside that.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit
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


def best_of(fits: Sequence[Refitted], distant: bool) -> Refitted:
    """Return the refit that explains most for what is charged.

    Which is best is asked on the readings that take part in both, as each may leave out others.
    """
    if distant:
        # far from the data chi-squared says more than a likelihood that has swallowed the mismatch as noise
        return min(fits, key=lambda one: one.chi2 + one.charged)
    first = min(fits, key=lambda one: one.fitted.score + one.charged).fitted
    return min(fits, key=lambda one: one.fitted.worse_than(first) + one.charged)
