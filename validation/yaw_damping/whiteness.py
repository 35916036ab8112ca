"""Whether what a fit leaves is noise: the test of Ljung and Box for residuals that remember."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from discsim.arrays import FloatArray

__all__ = ["Whiteness", "whiteness"]

#: lags that are looked at, at most, and how many values a series must have for each
LAGS, VALUES_PER_LAG = 5, 4


class Whiteness(NamedTuple):
    """Q = n(n + 2) sum rho_k^2/(n - k) summed over series, its degrees of freedom, and the chance of more if white."""

    Q: float
    lags: int
    p: float


def whiteness(series: Sequence[FloatArray]) -> Whiteness:
    """Test series of residuals (n_i,) evenly spaced, each for itself (no lag reaches from one to the next).

    Series of fewer than four values, or constant ones, tell nothing; p is NaN where none tells anything. A fit takes
    parameters out of its residuals, so where series are short p is only a guide.
    """
    total, count = 0.0, 0
    for values in series:
        x = values[np.isfinite(values)]
        lags = min(LAGS, x.size // VALUES_PER_LAG)
        if lags == 0 or np.ptp(x) == 0.0:
            continue
        n, x = x.size, x - x.mean()
        for k in range(1, lags + 1):
            total += n * (n + 2) * float(x[:-k] @ x[k:] / (x @ x)) ** 2 / (n - k)
        count += lags
    return Whiteness(total, count, float(chi2.sf(total, count)) if count else float("nan"))
