"""The local linear problem about a fit, in which detectors solve for one event after another.

Takes a fit and a hypothesis; gives, recording by recording, what any further column would explain once all unknowns
have had their say (the columns projected off the others: Frisch, Waugh and Lovell).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray, IntArray
from discsim.effects.air import Wind
from discsim.effects.catalogue import catalogued
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, fitted_parameters
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.identification.gauss_newton import Fit, linearised
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.noise import NoiseModel, whitened
from discsim.validation.identification.normal_equations import inverse_of, known_directions, reduce, unknown_prior
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.segments import Trajectory

__all__ = ["WIND", "LocalProblem", "LocalProblems", "gain_of", "local_problems", "peaks"]

#: spacing of the boundaries at which a jump is asked for, s
_FINE = 0.1


#: less than this share of a column's square, a thousandth of the column, is nothing: what the unknowns leave of it once
#: they have had their say is the difference of what they were solved with
_LEFT = 1e-6


#: the parameters of a steady wind
WIND = tuple((catalogued(Wind).id, name) for name in Wind._fields)


@dataclass(frozen=True)
class LocalProblem:
    """One recording, linearised: what any further column would explain once all its unknowns have had their say.

    ``white`` (n, m) are whitened columns of the first state and the parameters, ``left`` (n,) the whitened residual;
    ``inverse`` (m, m) and ``right`` (m,) the normal equations with what is known from elsewhere.
    """

    trajectory: Trajectory
    linear: Linear
    noise: NoiseModel
    segment: IntArray
    white: FloatArray
    left: FloatArray
    inverse: FloatArray
    right: FloatArray

    def whiten(self, columns: FloatArray) -> FloatArray:
        """Return columns (n, c) whitened as the residual is."""
        return whitened(self.linear, self.noise, columns)

    def explained(self, own: FloatArray, cross: FloatArray, pull: FloatArray) -> tuple[float, FloatArray]:
        """Return gain and values (c,) of columns with products own (c, c), cross (m, c) and pull (c,)."""
        H = own - cross.T @ self.inverse @ cross
        b = pull - cross.T @ self.inverse @ self.right
        size = np.sqrt(np.maximum(np.diag(own), 0.0))
        scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 1e-100)
        w, V = known_directions(H * np.outer(scale, scale), _LEFT)
        value = scale * (V @ ((V.T @ (scale * b)) / w))
        return float(b @ value), np.asarray(value)

    def solve(self, columns: FloatArray) -> tuple[float, FloatArray]:
        """Return gain and values (c,) of whitened columns (n, c)."""
        return self.explained(columns.T @ columns, self.white.T @ columns, columns.T @ self.left)


def _fine_nodes(trajectory: Trajectory) -> FloatArray:
    """Return boundaries about `_FINE` apart, those of the trajectory among them."""
    parts = [
        np.linspace(a, b, max(1, round((b - a) / _FINE)) + 1)[:-1]
        for a, b in zip(trajectory.nodes[:-1], trajectory.nodes[1:], strict=True)
    ]
    return np.concatenate([*parts, trajectory.nodes[-1:]])


@dataclass(frozen=True)
class LocalProblems:
    """A fit made ready for questions: each recording's ground, and where the columns of a steady wind are in it."""

    fit: Fit
    taken: tuple[CandidateEffect, ...]
    by_recording: Mapping[int, LocalProblem]
    wind: tuple[int, ...]

    def has(self, id: str, recording: int) -> bool:
        """Tell whether an effect already acts in a recording."""
        return any(t.id == id and (t.recordings is None or recording in t.recordings) for t in self.taken)


def local_problems(fit: Fit, noise: NoiseModel, own: Sequence[Parameter], hypothesis: Hypothesis) -> LocalProblems:
    """Return a fit, relaxed or tied, ready for questions: cut finely, hanging together, under a hypothesis.

    Parameters of the fit that the hypothesis does not have are taken back to where they stand without it.
    """
    plant = fit.plant
    free = fitted_parameters(hypothesis, own)
    wind: tuple[int, ...] = ()
    if plant.follows_path:
        # a wind without a prior would swallow a gust: where none is supposed, it is there for its columns alone
        keys = [q.key for q in free if q.recordings is None]
        free = (*free, *(Parameter(*key, 0.0, 0.05, 1e-9) for key in WIND if key not in keys))
        wind = tuple(next(j for j, q in enumerate(free) if q.key == key and q.recordings is None) for key in WIND)
    mine = {(q.key, q.recordings) for q in free}
    every = (*free, *(q for q in fit.parameters if (q.key, q.recordings) not in mine))
    place = {(q.key, q.recordings): number for q, number in zip(fit.parameters, fit.at, strict=True)}
    at = np.array([place.get((q.key, q.recordings), q.stated) for q in every])
    fitted = replace(fit, parameters=every, at=at, defects=plant.sizes.continuous, noise=noise)
    if not np.any(plant.sizes.continuous.allowed):  # else segments are short, and what is not modelled wanders by them
        fitted = fitted.cut_at([_fine_nodes(trajectory) for trajectory in fitted.trajectories])
    return LocalProblems(fitted, hypothesis.candidates, _by_recording(fitted, len(free)), wind)


def _by_recording(fit: Fit, f: int) -> dict[int, LocalProblem]:
    """Return the grounds of all recordings; the first ``f`` parameters are free, the others taken back."""
    parameters, noise, at = fit.parameters[:f], fit.noise, fit.at
    linears = linearised(fit)
    away = np.concatenate([np.zeros(f), at[f:] - np.array([q.stated for q in fit.parameters[f:]])])
    grams = []
    for linear, trajectory in zip(linears, fit.trajectories, strict=True):
        G = reduce(linear, trajectory, noise, fit.defects).gram
        back = G[:-1, -1] + G[:-1, :-1] @ away
        grams.append((G[:f, :f], back[:f]))
    total = np.sum([g for g, _ in grams], axis=0)
    pulled = np.sum([b for _, b in grams], axis=0)
    prior = np.array([q.precision for q in parameters])
    off = prior * (np.array([q.stated for q in parameters]) - at[:f])
    found = {}
    for i, (linear, trajectory) in enumerate(zip(linears, fit.trajectories, strict=True)):
        own, full = linear.unknowns, linear.full
        residual = linear.residual + full[:, own:] @ away
        columns = np.hstack([full[:, : own + f], residual[:, None]])
        white = whitened(linear, noise, columns)
        A, e = white[:, :-1], white[:, -1]
        H, right = A.T @ A, A.T @ e
        known, pull, _ = unknown_prior(linear, trajectory, fit.defects)
        H[:own, :own] += known
        right[:own] += pull
        H[own:, own:] += total - grams[i][0] + np.diag(prior)
        right[own:] += pulled - grams[i][1] + off
        scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
        inverse = inverse_of(H * np.outer(scale, scale)) * np.outer(scale, scale)
        segment = np.where(linear.segment < 0, trajectory.segment_of(linear.t), linear.segment)
        found[i] = LocalProblem(trajectory, linear, noise, segment, A, e, inverse, right)
    return found


def peaks(gain: FloatArray, count: int) -> list[int]:
    """Return the places of the highest local maxima."""
    padded = np.concatenate([[-np.inf], gain, [-np.inf]])
    tops = np.flatnonzero((gain >= padded[:-2]) & (gain >= padded[2:]))
    return [int(j) for j in tops[np.argsort(gain[tops])[::-1][:count]]]


def gain_of(screened: ScreenedCandidate) -> float:
    """Return what a screened candidate is expected to gain, to sort by."""
    return screened.gain
