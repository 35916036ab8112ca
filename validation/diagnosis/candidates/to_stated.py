"""Reduced normal equations taken back to where parameters are stated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.identification.gauss_newton import Fit

__all__ = ["to_baseline"]


def to_baseline(grams: FloatArray, fit: Fit, places: Sequence[int] | None = None) -> FloatArray:
    """Take reduced matrices (recordings, p + 1, p + 1) to where a fit's parameters are stated, and return them.

    ``places`` are those of its parameters among the columns, by default the first.
    """
    places = range(len(fit.parameters)) if places is None else places
    for i, G in enumerate(grams):
        away = np.zeros(G.shape[0] - 1)
        for j, q, number in zip(places, fit.parameters, fit.at, strict=True):
            if q.acts_in(i):
                away[j] = number - q.stated
        e, chi2 = G[:-1, -1].copy(), float(G[-1, -1])
        G[-1, -1] = chi2 + float(2.0 * away @ e + away @ G[:-1, :-1] @ away)
        G[:-1, -1] = G[-1, :-1] = e + G[:-1, :-1] @ away
    return grams
