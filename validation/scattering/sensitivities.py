"""Which input scatters the landings: Sobol indices by a polynomial chaos of second order.

Independent groups of inputs are turned into standard normal numbers z, and a result is fitted by least squares as a
sum of Hermite polynomials of them up to second order. These are orthonormal, so the variance is the sum of the squared
coefficients, and a group's share of it is that of the terms it is in: alone (first order), or with others, too (total).
What the polynomials do not explain is stated beside the shares. B. Sudret, Global sensitivity analysis using polynomial
chaos expansions, Reliability Engineering and System Safety 93 (2008) 964-979.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.scattering.inputs import Inputs

__all__ = ["Share", "Shares", "sensitivities"]

#: flights per polynomial term: the shares are then known to about a percent of the variance
PER_TERM = 10


class Share(NamedTuple):
    """A group of inputs: its share of the variance alone and with others, and the slope by each of its inputs.

    ``slopes`` are in units of the result per unit of the input, at the middle of the scatter.
    """

    inputs: tuple[str, ...]
    first: float
    total: float
    slopes: tuple[float, ...]


class Shares(NamedTuple):
    """What scatters one result: a share for each group, largest first, and the share that no polynomial explains."""

    result: str
    variance: float
    shares: tuple[Share, ...]
    unexplained: float
    order: int


def sensitivities(inputs: Inputs, rows: FloatArray, values: FloatArray, result: str) -> Shares:
    """Return what scatters ``values`` (n,), the result of inputs ``rows`` (n, k); of order 1 where flights are few."""
    groups = inputs.groups()
    mean = np.array([item.mean for item in inputs.items])
    z, back, owner = [], np.zeros((0, len(mean))), []
    for number, group in enumerate(groups):
        sd = np.sqrt(np.diag(inputs.covariance)[group])
        w, V = np.linalg.eigh(inputs.covariance[np.ix_(group, group)] / np.outer(sd, sd))
        kept = w > 1e-9 * w[-1]
        to_z = (V[:, kept] / np.sqrt(w[kept])).T / sd
        z.append((rows[:, group] - mean[group]) @ to_z.T)
        slopes = np.zeros((int(kept.sum()), len(mean)))
        slopes[:, group] = to_z
        back = np.vstack([back, slopes])
        owner += [number] * int(kept.sum())
    Z = np.hstack(z)
    k = Z.shape[1]
    order = 2 if values.size >= PER_TERM * (1 + 2 * k + k * (k - 1) // 2) else 1
    columns, members = [Z[:, i] for i in range(k)], [{owner[i]} for i in range(k)]
    if order == 2:
        columns += [(Z[:, i] ** 2 - 1.0) / np.sqrt(2.0) for i in range(k)]
        members += [{owner[i]} for i in range(k)]
        for i, j in combinations(range(k), 2):
            columns.append(Z[:, i] * Z[:, j])
            members.append({owner[i], owner[j]})
    A = np.column_stack([np.ones(values.size), *columns])
    fit = np.linalg.lstsq(A, values, rcond=None)[0]
    left = values - A @ fit
    spare = max(values.size - A.shape[1], 1)
    variance, noise = float(values.var(ddof=1)), float(left @ left) / spare
    # a coefficient's square is too large by the variance that chance gives it
    power = np.maximum(fit[1:] ** 2 - noise / values.size, 0.0)
    whole = float(power.sum()) + noise
    whole = whole if whole > 0.0 else 1.0
    slopes = fit[1 : k + 1] @ back
    shares = [
        Share(
            tuple(inputs.items[i].name for i in group),
            float(sum(p for p, m in zip(power, members, strict=True) if m == {number})) / whole,
            float(sum(p for p, m in zip(power, members, strict=True) if number in m)) / whole,
            tuple(float(slopes[i]) for i in group),
        )
        for number, group in enumerate(groups)
    ]
    ranked = tuple(sorted(shares, key=lambda share: -share.total))
    return Shares(result, variance, ranked, noise / whole, order)
