"""Normal equations with each recording's nuisance unknowns eliminated (Schur complement), and their solution.

Takes a `Linear`, its noise and priors; gives the reduced normal matrix of the common parameters, and steps of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from discsim.arrays import FloatArray
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.noise import NoiseModel, whitened, whitened_channel
from discsim.validation.identification.parameters import AllowedDefects, Parameter
from discsim.validation.identification.release_prior import release_rows
from discsim.validation.identification.segments import Trajectory

__all__ = [
    "CUT_OFF",
    "OWN_TRUST_RADIUS",
    "Reduced",
    "inverse_of",
    "known_directions",
    "local_covariance",
    "reduce",
    "unknown_prior",
]


#: the cut-off of every symmetric system of sums of squares: eigenvalues below this share of the largest stand for
#: combinations of unknowns of which nothing is known. Slopes are differences, good to 1e-5, and the eigenvalues of a
#: normal matrix are squares of theirs.
CUT_OFF = 1e-10


def known_directions(H: FloatArray, least: float | None = None) -> tuple[FloatArray, FloatArray]:
    """Return eigenvalues (k,) and vectors (n, k) of a symmetric matrix (n, n) of sums of squares that say something.

    Those are above `CUT_OFF` times the largest, or above ``least``. Columns of several units are to be scaled before.
    """
    w, V = np.linalg.eigh(H)
    kept = w > (CUT_OFF * max(float(w[-1]), 1e-300) if least is None else least)
    return w[kept], V[:, kept]


def inverse_of(H: FloatArray) -> FloatArray:
    """Return the inverse (n, n) of a symmetric matrix of sums of squares, zero in directions that say nothing."""
    w, V = known_directions(H)
    return np.asarray((V / w) @ V.T)


@dataclass(frozen=True)
class Reduced:
    """What one recording says of the shared parameters once its own unknowns are eliminated.

    ``gram`` (p + 1, p + 1) holds the reduced normal matrix over [parameters | residual]; its last entry is chi-squared
    with the parameters where they stand. ``back`` gives the local unknowns from the shared ones.
    """

    gram: FloatArray
    factor: Any
    cross: FloatArray
    rows: int


def normal_matrix(linear: Linear, noise: NoiseModel) -> FloatArray:
    """Return the normal matrix (l + p + 1, l + p + 1) over [local | shared | residual] of whitened rows."""
    u, d = linear.unknowns, linear.sensitivities.shape[1]
    if u == d:
        A = whitened(linear, noise, np.hstack([linear.full, linear.residual[:, None]]))
        return np.asarray(A.T @ A)
    # with defects the full rows are long and mostly empty: what later segments say of a state is summed backwards, and
    # a jump meets the unknowns before it through the state that it moves
    rows = whitened(linear, noise, np.hstack([linear.own, linear.residual[:, None]]), linear.segment)
    k, width = linear.sensitivities.shape[0], linear.sensitivities.shape[2] + 1
    p = width - 1 - u
    G = np.zeros((width, width))
    later = np.zeros((d + p + 1, d + p + 1))
    passing = np.eye(d + p + 1)
    for i in reversed(range(k)):
        if i + 1 < k:
            passing[:d, :-1] = linear.transitions[i]
            later = passing.T @ later @ passing
        mine = rows[linear.segment == i]
        later += mine.T @ mine
        unknown = np.flatnonzero(linear.defect_segment == i)
        moved = np.arange(d) if i == 0 else linear.defect_kind[unknown]
        told = later[moved]
        places = np.r_[: unknown[-1] + 1 if unknown.size else 0, u : width - 1]
        G[unknown[:, None], places] = told[:, :d] @ linear.sensitivities[i][:, places]
        G[unknown, u:] += told[:, d:]
    G[u:, u:] = later[d:, d:]
    G[:u, :u] = np.tril(G[:u, :u]) + np.tril(G[:u, :u], -1).T
    G[u:, :u] = G[:u, u:].T
    if linear.whole.size:
        A = _spread_rows(linear, noise)
        G += A.T @ A
    return G


def _spread_rows(linear: Linear, noise: NoiseModel) -> FloatArray:
    """Return the whitened rows (m, l + p + 1) of readings that hang on several segments, which are whole channels."""
    parts, at, residual = [], 0, linear.residual
    for channel in linear.channels:
        count = channel.index.size
        if count and linear.segment[channel.rows.start] < 0:
            rows = np.hstack([linear.whole[at : at + count], residual[channel.rows, None]])
            parts.append(whitened_channel(linear, noise, channel, rows))
            at += count
    return np.concatenate(parts)


def unknown_prior(linear: Linear, current: Trajectory, defects: AllowedDefects) -> tuple[FloatArray, FloatArray, float]:
    """Return what is known of a recording's own unknowns beside its readings: normal matrix (l, l), pull (l,), chi2."""
    u = linear.unknowns
    prior = np.zeros(u)
    first = linear.defect_kind < 0
    prior[first] = (current.plant.sizes.unknown if current.trust_radius is None else current.trust_radius) ** -2.0
    prior[~first] = defects.sd[linear.defect_kind[~first]] ** -2.0
    # a defect is pulled to zero from where it stands
    H, right, chi2 = np.diag(prior), -prior * linear.defect, float(prior @ linear.defect**2)
    stated, rows = release_rows(current)
    if stated.size:
        d = rows.shape[1]
        # the first state has followed the closing of nothing: its tangents are the first columns
        H[:d, :d] += rows.T @ rows
        right[:d] += rows.T @ stated
        chi2 += float(stated @ stated)
    return H, right, chi2


def reduce(
    linear: Linear, current: Trajectory, noise: NoiseModel, defects: AllowedDefects, damping: float = 0.0
) -> Reduced:
    """Eliminate the local unknowns of a recording; ``damping`` keeps its attitude from turning far in one step."""
    u, d = linear.unknowns, linear.sensitivities.shape[1]
    p = linear.own.shape[1] - d
    # most of what is shared may be other recordings' own, which says nothing here
    acting = linear.acting
    G = normal_matrix(linear.only(acting), noise)
    H, right, chi2 = unknown_prior(linear, current, defects)
    attitude = current.plant.layout.attitude
    if damping and attitude is not None:
        turns = list(current.plant.layout.directions_of(attitude))
        H[turns, turns] += damping * _ATTITUDE_TRUST_RADIUS**-2.0
    G[:u, :u] += H
    G[:u, -1] += right
    G[-1, :u] += right
    G[-1, -1] += chi2
    scale = 1.0 / np.sqrt(np.maximum(np.diag(G)[:u], 1e-300))
    H = G[:u, :u] * scale[:, None] * scale[None, :]
    H[np.arange(u), np.arange(u)] += 1e-12
    L = lower_root(H)
    told = G[:u, u:] * scale[:, None]
    half = solve_triangular(L, told, lower=True, check_finite=False)
    places = np.append(acting, p)
    cross, gram = np.zeros((u, p + 1)), np.zeros((p + 1, p + 1))
    cross[:, places] = told
    gram[np.ix_(places, places)] = G[u:, u:] - half.T @ half
    return Reduced(gram, (L, scale), cross, linear.residual.size)


#: smallest eigenvalue, as a share of the largest, that a matrix of sums of squares may have come to by rounding
_ROUNDING = 1e-12


def lower_root(H: FloatArray) -> FloatArray:
    """Return the lower triangular root of a symmetric matrix (l, l) of sums of squares; NaN where it is not finite.

    Sums over segments whose motion grows without bounds lose the last digits of what came before: eigenvalues that are
    negative by rounding stand for nothing that is known.
    """
    if not np.all(np.isfinite(H)):
        return np.full(H.shape, np.nan)
    try:
        return np.asarray(np.linalg.cholesky(H))
    except np.linalg.LinAlgError:
        w, V = np.linalg.eigh(H)
        root = V * np.sqrt(np.maximum(w, _ROUNDING * max(float(w[-1]), 1e-300)))
        upper: FloatArray = np.linalg.qr(root.T)[1]
        return np.asarray(upper.T)


def nuisance_step(reduced: Reduced, common: FloatArray) -> FloatArray:
    """Return the step of the local unknowns that goes with a step of the shared ones (p,)."""
    L, scale = reduced.factor
    right = reduced.cross[:, -1] - reduced.cross[:, :-1] @ common
    return np.asarray(scale * cho_solve((L, True), right, check_finite=False))


def local_covariance(reduced: Reduced, covariance: FloatArray) -> FloatArray:
    """Return the covariance (l, l) of the local unknowns, with the share of the shared ones, whose own is (p, p)."""
    L, scale = reduced.factor
    alone = scale[:, None] * cho_solve((L, True), np.eye(scale.size), check_finite=False) * scale
    way = scale[:, None] * cho_solve((L, True), reduced.cross[:, :-1], check_finite=False)
    return np.asarray(alone + way @ covariance @ way.T)


def common_step(
    gram: FloatArray, parameters: Sequence[Parameter], at: FloatArray, trust_radius: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, float]:
    """Solve for the shared parameters from a summed gram (p + 1, p + 1), each held back to its ``trust_radius`` (p,).

    Returns the step (p,), the covariance (p, p) of where it leads and what chi-squared is expected to become, priors
    included; all NaN where the fit has gone where its predictions are not finite.
    """
    p = len(parameters)
    prior = np.array([q.precision for q in parameters])
    off = np.array([q.stated for q in parameters]) - at
    held = prior if trust_radius is None else prior + trust_radius**-2.0
    H = gram[:p, :p] + np.diag(held)
    right = gram[:p, -1] + prior * off
    if p == 0:
        return np.empty(0), np.empty((0, 0)), float(gram[-1, -1])
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = H * scale[:, None] * scale[None, :]
    if not (np.all(np.isfinite(gram)) and np.all(np.isfinite(scaled))):
        return np.full(p, np.nan), np.full((p, p), np.nan), np.nan
    units = scale[:, None] * scale[None, :]
    covariance = inverse_of(scaled) * units
    step = covariance @ right
    expected = float(gram[-1, -1] + prior @ off**2 - step @ right)
    return step, covariance + _unread(scaled, held * scale**2) * units, expected


def _unread(H: FloatArray, prior: FloatArray) -> FloatArray:
    """Return the covariance (p, p) of combinations of which a normal matrix (p, p) says nothing: no step moves these.

    All that is known of them was known beforehand: ``prior`` (p,) are precisions in the units of the matrix.
    """
    w, V = np.linalg.eigh(H)
    unread = V[:, w <= CUT_OFF * max(float(w[-1]), 1e-300)]
    if not unread.size:
        return np.zeros_like(H)
    return np.asarray(unread @ inverse_of(unread.T @ (prior[:, None] * unread)) @ unread.T)


#: how far one step goes where the readings say little, beyond which motion is far from linear: shares of the sigma of
#: a plant's own parameters, as how a free spin's wobble dies and turns, and rad of its attitude, which may turn about
#: the field
OWN_TRUST_RADIUS, _ATTITUDE_TRUST_RADIUS = 1.0 / 15.0, 0.02
