"""Sizes that recordings ask for by themselves: whether an effect that all share is the same in all.

Takes a fit with the effect; gives what chi-squared would fall by if each recording had its own size, and the chance.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.identification.gauss_newton import Fit, reduced_each
from discsim.validation.identification.normal_equations import common_step

__all__ = ["OwnSizes", "own_sizes"]


class OwnSizes(NamedTuple):
    """What chi-squared falls by with a size for each recording, and how many sizes that frees."""

    gain: float
    freed: int

    @property
    def chance(self) -> float:
        """With what chance recordings that share a size ask for sizes as unlike as these.

        The gain is chi-squared distributed, with as many degrees of freedom as sizes are freed (W. Cochran, Biometrics
        10, 1954, p. 101).
        """
        return float(chi2.sf(self.gain, self.freed)) if self.freed else 1.0


def own_sizes(fit: Fit, candidate: CandidateEffect) -> OwnSizes:
    """Return what recordings gain by sizes of their own, about where a fit stands that has an effect of them all."""
    sized = {(column.group, column.name) for column in candidate.columns}
    mine = [k for k, q in enumerate(fit.parameters) if q.recordings is None and q.key in sized]
    rest = [k for k in range(len(fit.parameters)) if k not in mine]
    count, kept, m = len(fit.trajectories), len(rest), len(mine)
    if candidate.recordings is not None or not mine or count < 2:
        return OwnSizes(0.0, 0)
    grams = [reduced.gram for reduced in reduced_each(fit)]
    size = kept + m * count + 1
    split = np.zeros((size, size))
    taken = np.array([*rest, *mine, len(fit.parameters)])
    for i, gram in enumerate(grams):
        places = np.array([*range(kept), *(kept + m * i + k for k in range(m)), size - 1])
        split[np.ix_(places, places)] += gram[np.ix_(taken, taken)]
    each = [replace(fit.parameters[k], recordings=frozenset([i])) for i in range(count) for k in mine]
    order = [*rest, *mine * count]
    parameters = [*(fit.parameters[k] for k in rest), *each]
    shared = common_step(np.sum(grams, axis=0), fit.parameters, fit.at)[2]
    apart = common_step(split, parameters, fit.at[order])[2]
    return OwnSizes(shared - apart, m * (count - 1))
