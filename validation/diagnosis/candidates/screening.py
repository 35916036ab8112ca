"""The normal equations of all candidates at once: what any set of parameters, in any recordings, would explain.

Takes a fit and candidates; gives `NormalEquations`. The columns of every candidate are taken once, each recording's
nuisance unknowns eliminated, and what remains are small matrices: a hypothesis is a choice of rows and columns of them,
and costs a few microseconds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, parameters_of
from discsim.validation.diagnosis.candidates.to_stated import to_baseline
from discsim.validation.identification.gauss_newton import Fit, linearised_in, mapped
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.normal_equations import inverse_of, reduce
from discsim.validation.identification.parameters import AllowedDefects, Parameter
from discsim.validation.identification.plants import PLANTS
from discsim.validation.identification.propagation import Column

__all__ = ["NormalEquations", "ScoreTest", "columns_about", "normal_equations_of"]


@dataclass(frozen=True)
class ScoreTest:
    """What a choice of columns explains: chi-squared left, priors included, and the values of the free columns."""

    chi2: float
    value: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class NormalEquations:
    """Reduced normal matrices of all recordings over [columns | residual], taken to the baseline of every column."""

    columns: tuple[Column, ...]
    grams: FloatArray
    place: Mapping[Column, int]

    @property
    def recordings(self) -> int:
        """Number of recordings."""
        return int(self.grams.shape[0])

    def columns_of(self, parameters: Sequence[Parameter]) -> list[tuple[Column, Parameter]]:
        """Return the columns of parameters, those that have one here, to `solve` with."""
        found = [(column_of(q), q) for q in parameters]
        return [(column, q) for column, q in found if column in self.place]

    def solve(self, parameters: Sequence[tuple[Column, Parameter]], only: Sequence[int] | None = None) -> ScoreTest:
        """Free some columns, each in its recordings and with its prior; all others stay at their baseline.

        ``only`` are the recordings that take part; by default all. Values are measured from the baseline.
        """
        some = range(self.recordings) if only is None else only
        free = np.array([self.place[column] for column, _ in parameters], dtype=int)
        f = free.size
        if f == 0:
            return ScoreTest(float(sum(self.grams[i, -1, -1] for i in some)), np.empty(0), np.empty((0, 0)))
        H, right, chi2 = np.zeros((f, f)), np.zeros(f), 0.0
        for i in some:
            G = self.grams[i]
            active = np.array([q.acts_in(i) for _, q in parameters], dtype=float)
            H += G[np.ix_(free, free)] * np.outer(active, active)
            right += G[free, -1] * active
            chi2 += float(G[-1, -1])
        H = H + np.diag([q.precision for _, q in parameters])
        # what nothing shows stays at its baseline
        scale = np.where(np.diag(H) > 0.0, 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300)), 0.0)
        covariance = inverse_of(H * np.outer(scale, scale)) * np.outer(scale, scale)
        value = covariance @ right
        return ScoreTest(chi2 - float(value @ right), value, covariance)


def column_of(q: Parameter) -> Column:
    """Return the column of a parameter; one that differs from recording to recording has a column for each."""
    if q.recordings is not None and q.group in PLANTS:
        return Column(q.group, q.name, q.step, (("recording", float(min(q.recordings))),))
    return Column(q.group, q.name, q.step)


def normal_equations_of(
    fit: Fit,
    candidates: Sequence[CandidateEffect],
    noise: NoiseModel,
    defects: AllowedDefects,
    *,
    some_astray: bool = False,
) -> NormalEquations:
    """Take the columns of candidates and of a fit's own parameters where the fit stands, to the baseline of each.

    Raises `InputError` where a recording's motion leaves the numbers, or with ``some_astray`` where all do: far from
    the data one may, and then says nothing.
    """
    columns = columns_about(fit, candidates)
    place = {column: k for k, column in enumerate(columns)}
    allowing = replace(fit, defects=defects)

    def gram(index: int) -> FloatArray:
        # the slopes by all columns of all recordings would be most of what a diagnosis holds in memory
        return reduce(linearised_in(allowing, index, columns), fit.trajectories[index], noise, defects).gram

    grams = np.stack(mapped(gram, range(len(fit.trajectories))))
    lost = ~np.isfinite(grams).all(axis=(1, 2))
    if np.all(lost) if some_astray else np.any(lost):
        raise InputError(
            "diagnose: no motion of this plant follows the readings, its fit leaves the numbers "
            "(a free spin turns by itself, driven by nothing); expected the part of the log in which it does: "
            "discsim import RAW --throw N or --rows A:B takes it out"
        )
    grams[lost] = 0.0
    to_baseline(grams, fit, [place[column_of(q)] for q in fit.parameters])
    return NormalEquations(columns, grams, place)


def columns_about(fit: Fit, candidates: Sequence[CandidateEffect]) -> tuple[Column, ...]:
    """Return the columns of a fit's own parameters, and those of candidates behind them."""
    of_candidates = (column for candidate in candidates for column in candidate.columns)
    return tuple(dict.fromkeys((*map(column_of, fit.parameters), *of_candidates)))


def free_columns(candidate: CandidateEffect) -> list[tuple[Column, Parameter]]:
    """Return the columns that a candidate frees, with their parameters."""
    return list(zip(candidate.columns, parameters_of(candidate, shaped=False), strict=True))
