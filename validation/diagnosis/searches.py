"""Searches for effects that one linear question about whole recordings does not find: events, gusts, ripples, slips.

Each returns proposals with values to start from; fits with all parameters free decide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from validation.diagnosis.fitting import Fit, Parameter, linearised, mapped, reduce, unknown_prior
from validation.diagnosis.noise import NoiseModel, whitened
from validation.diagnosis.relaxed import NO_JUMPS
from validation.diagnosis.selection import Hypothesis, Proposal, fitted_parameters
from validation.diagnosis.trajectory_pieces import Chain, Column, IntArray, Linear, linearise, recut
from validation.diagnosis.trials import Trial, available

__all__ = ["events", "gusts"]

#: spacing of the boundaries at which a jump is asked for, s
_FINE = 0.1
#: directions of the state in which an event jumps, by plant
_IMPULSE = (3, 4, 5)
_SPIN = {"flight": (11,), "free_spin": (11,), "spin_down": (1,)}
#: how far about the best boundary the instant of an event is looked for, s
_NEAR = {"flight": 0.09, "free_spin": 0.2, "spin_down": 0.12}
#: widths of gusts tried, s, and the spacing of their instants
_WIDTHS, _EVERY = (0.1, 0.2, 0.4, 0.8), 0.1
_WIND = (("air.wind", "w_north_m_s"), ("air.wind", "w_east_m_s"))


# ------------------------------------------------------------------------------- questions to one recording


@dataclass(frozen=True)
class _Ground:
    """One recording, linearised: what any further column would explain once all its unknowns have had their say.

    ``white`` (n, m) are whitened columns of the first state and the parameters, ``left`` (n,) the whitened residual;
    ``inverse`` (m, m) and ``right`` (m,) the normal equations with what is known from elsewhere.
    """

    chain: Chain
    linear: Linear
    noise: NoiseModel
    piece: IntArray
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
        w, V = np.linalg.eigh(H * np.outer(scale, scale))
        # what is left of a column once the unknowns have had their say may be nothing
        kept = w > 1e-6
        if not np.any(kept):
            return 0.0, np.zeros(b.size)
        value = scale * (V[:, kept] @ ((V[:, kept].T @ (scale * b)) / w[kept]))
        return float(b @ value), np.asarray(value)

    def ask(self, columns: FloatArray) -> tuple[float, FloatArray]:
        """Return gain and values (c,) of whitened columns (n, c)."""
        return self.explained(columns.T @ columns, self.white.T @ columns, columns.T @ self.left)


def _fine_edges(chain: Chain) -> FloatArray:
    """Return boundaries about `_FINE` apart, those of the chain among them."""
    parts = [
        np.linspace(a, b, max(1, round((b - a) / _FINE)) + 1)[:-1]
        for a, b in zip(chain.edges[:-1], chain.edges[1:], strict=True)
    ]
    return np.concatenate([*parts, chain.edges[-1:]])


@dataclass(frozen=True)
class Asked:
    """A fit made ready for questions: each recording's ground, and where the columns of a steady wind are in it."""

    fit: Fit
    taken: tuple[Trial, ...]
    grounds: Mapping[int, _Ground]
    wind: tuple[int, ...]

    def has(self, id: str, recording: int) -> bool:
        """Tell whether an effect already acts in a recording."""
        return any(t.id == id and (t.recordings is None or recording in t.recordings) for t in self.taken)


def asked_of(fit: Fit, noise: NoiseModel, own: Sequence[Parameter], hypothesis: Hypothesis) -> Asked:
    """Return a fit, relaxed or tied, ready for questions: cut finely, hanging together, under a hypothesis.

    Parameters of the fit that the hypothesis does not have are taken back to where they stand without it.
    """
    plant = fit.chains[0].recording.plant
    free = fitted_parameters(hypothesis, own)
    wind: tuple[int, ...] = ()
    if plant == "flight":
        # a wind without a prior would swallow a gust: where none is supposed, it is there for its columns alone
        keys = [q.key for q in free if q.recordings is None]
        free = (*free, *(Parameter(*key, 0.0, 0.05, 1e-9) for key in _WIND if key not in keys))
        wind = tuple(next(j for j, q in enumerate(free) if q.key == key and q.recordings is None) for key in _WIND)
    mine = {(q.key, q.recordings) for q in free}
    every = (*free, *(q for q in fit.parameters if (q.key, q.recordings) not in mine))
    place = {(q.key, q.recordings): number for q, number in zip(fit.parameters, fit.at, strict=True)}
    at = np.array([place.get((q.key, q.recordings), q.stated) for q in every])
    tied = replace(fit, parameters=every, at=at, jumps=NO_JUMPS[plant], noise=noise)
    if plant != "free_spin":  # its pieces are short, and what it does not model wanders by the piece
        chains = tuple(recut(chain, tied.values(i), _fine_edges(chain)) for i, chain in enumerate(tied.chains))
        tied = replace(tied, chains=chains)
    return Asked(tied, hypothesis.trials, _grounds(tied, len(free)), wind)


def _grounds(fit: Fit, f: int) -> dict[int, _Ground]:
    """Return the grounds of all recordings; the first ``f`` parameters are free, the others taken back."""
    parameters, noise, at = fit.parameters[:f], fit.noise, fit.at
    linears = linearised(fit)
    away = np.concatenate([np.zeros(f), at[f:] - np.array([q.stated for q in fit.parameters[f:]])])
    grams = []
    for linear, chain in zip(linears, fit.chains, strict=True):
        G = reduce(linear, chain, noise, fit.jumps).gram
        back = G[:-1, -1] + G[:-1, :-1] @ away
        grams.append((G[:f, :f], back[:f]))
    total = np.sum([g for g, _ in grams], axis=0)
    pulled = np.sum([b for _, b in grams], axis=0)
    prior = np.array([q.sigma**-2.0 if np.isfinite(q.sigma) else 0.0 for q in parameters])
    off = prior * (np.array([q.stated for q in parameters]) - at[:f])
    found = {}
    for i, (linear, chain) in enumerate(zip(linears, fit.chains, strict=True)):
        residual = linear.residual + linear.shared @ away
        own = linear.unknowns
        columns = np.hstack([linear.local, linear.shared[:, :f], residual[:, None]])
        white = whitened(linear, noise, columns)
        A, e = white[:, :-1], white[:, -1]
        H, right = A.T @ A, A.T @ e
        known, pull, _ = unknown_prior(linear, chain, fit.jumps)
        H[:own, :own] += known
        right[:own] += pull
        H[own:, own:] += total - grams[i][0] + np.diag(prior)
        right[own:] += pulled - grams[i][1] + off
        scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
        w, V = np.linalg.eigh(H * np.outer(scale, scale))
        kept = w > 1e-11 * w[-1]
        inverse = ((V[:, kept] / w[kept]) @ V[:, kept].T) * np.outer(scale, scale)
        piece = np.clip(np.searchsorted(chain.edges, linear.t, side="right") - 1, 0, len(chain.states) - 1)
        found[i] = _Ground(
            chain, linear, noise, piece if linear.piece.size == 0 else linear.piece, A, e, inverse, right
        )
    return found


# ---------------------------------------------------------------------------------------------------- events


def _jumps(ground: _Ground, directions: Sequence[int]) -> FloatArray:
    """Return what a jump of the state in some directions at each boundary (k - 1,) would gain."""
    d = ground.chain.tangent
    k = len(ground.chain.states)
    moves = ground.linear.moves[:, :, :d]
    A = np.hstack([ground.white, ground.left[:, None]])
    # products of the rows after each boundary with the first state's columns
    products = np.zeros((k, d, A.shape[1]))
    for i in range(k):
        rows = A[ground.piece == i]
        products[i] = rows[:, :d].T @ rows
    after = np.cumsum(products[::-1], axis=0)[::-1]
    gain = np.zeros(max(k - 1, 0))
    for j in range(1, k):
        back = np.linalg.solve(moves[j], np.eye(d)[:, list(directions)])
        own = back.T @ after[j][:, :d] @ back
        cross = (back.T @ after[j]).T
        gain[j - 1], _ = ground.explained(own, cross[:-1], cross[-1])
    return gain


def _events_at(ground: _Ground, fit: Fit, recording: int, trial: Trial, instants: FloatArray) -> list[Proposal]:
    """Return an event at each of some instants as a proposal, by its true columns."""
    columns = [Column(c.group, c.name, c.step, (("t_s", float(t)),)) for t in instants for c in trial.columns]
    values = fit.values(recording)
    linear = linearise(ground.chain, values, columns, NO_JUMPS[ground.chain.recording.plant].allowed)
    white = ground.whiten(linear.shared)
    width = len(trial.columns)
    found = []
    for n, t in enumerate(instants):
        part = slice(n * width, (n + 1) * width)
        gain, value = ground.ask(white[:, part])
        shaped = replace(trial, columns=tuple(columns[part]), recordings=frozenset([recording]))
        start = {((c.group, c.name), shaped.recordings): float(v) for c, v in zip(shaped.columns, value, strict=True)}
        start[(trial.id, "t_s"), shaped.recordings] = float(t)
        found.append(Proposal(shaped, gain, start))
    return found


def _peaks(gain: FloatArray, count: int) -> list[int]:
    """Return the places of the highest local maxima."""
    padded = np.concatenate([[-np.inf], gain, [-np.inf]])
    tops = np.flatnonzero((gain >= padded[:-2]) & (gain >= padded[2:]))
    return [int(j) for j in tops[np.argsort(gain[tops])[::-1][:count]]]


def events(asked: Asked, least: float = 25.0) -> list[Proposal]:
    """Return events, at most one of each kind per recording, that would gain more than ``least``, best first.

    A jump of velocity or spin is asked for at every boundary of finely cut motion, which costs no simulation; the
    instant is then read off the event's true signature, in which a pulse of 10 ms is a needle.
    """
    recordings = [chain.recording for chain in asked.fit.chains]
    plant = recordings[0].plant
    there = available(recordings)
    kinds: list[tuple[str, Sequence[int], tuple[str, ...]]] = []
    if "event.impulse" in there:
        kinds.append(("event.impulse", _IMPULSE, ("dv_north_m_s", "dv_east_m_s", "dv_down_m_s")))
    if "event.spin_step" in there:
        kinds.append(("event.spin_step", _SPIN[plant], ("dr_rad_s",)))

    def one(task: tuple[int, tuple[str, Sequence[int], tuple[str, ...]]]) -> Proposal | None:
        i, (id, directions, names) = task
        ground = asked.grounds[i]
        gain = _jumps(ground, directions)
        if asked.has(id, i) or gain.size == 0 or gain.max() < least - 10.0:
            return None
        trial = Trial(id, tuple(Column(id, name, 0.02) for name in names))
        inner, end = ground.chain.edges[1:-1], float(ground.chain.edges[-1])
        near = np.concatenate([inner[j] + _NEAR[plant] * np.linspace(-1.0, 1.0, 13) for j in _peaks(gain, 2)])
        near = np.unique(near.round(4))
        best = max(_events_at(ground, asked.fit, i, trial, near[(near > 0.01) & (near < end)]), key=_gain)
        about = best.trial.shapes["t_s"] + np.linspace(-0.012, 0.012, 7)
        best = max([best, *_events_at(ground, asked.fit, i, trial, about[(about > 0.0) & (about < end)])], key=_gain)
        return best if best.gain > least else None

    tasks = [(i, kind) for i in asked.grounds for kind in kinds]
    return sorted((p for p in mapped(one, tasks) if p is not None), key=_gain, reverse=True)


def _gain(proposal: Proposal) -> float:
    return proposal.gain


# ----------------------------------------------------------------------------------------------------- gusts


def gusts(asked: Asked, least: float = 25.0) -> list[Proposal]:
    """Return gusts, at most one per recording, that would gain more than ``least``, best first.

    A gust is a sum of winds that blow for one piece of motion each, so any instant and width is asked for by algebra.
    """
    if "air.gust" not in available([chain.recording for chain in asked.fit.chains]):
        return []

    def one(i: int) -> Proposal | None:
        return None if asked.has("air.gust", i) else _gust(asked.grounds[i], i, asked.wind)

    found = [p for p in mapped(one, list(asked.grounds)) if p is not None and p.gain > least]
    return sorted(found, key=_gain, reverse=True)


def _gust(ground: _Ground, recording: int, wide: Sequence[int]) -> Proposal | None:
    """Return the gust in a recording that would gain most; ``wide`` are the places of a steady wind's columns."""
    linear, piece, edges = ground.linear, ground.piece, ground.chain.edges
    d, own, k = ground.chain.tangent, linear.unknowns, len(ground.chain.states)
    first = linear.local[:, :d]
    # u: the change of the first state that a wind up to each boundary amounts to
    u = np.stack([np.linalg.solve(m[:, :d], m[:, [own + w for w in wide]]) for m in linear.moves])
    within = linear.shared[:, list(wide)] - np.einsum("nd,ndw->nw", first, u[piece])
    push = np.diff(u, axis=0)
    middle = 0.5 * (edges[:-1] + edges[1:])
    best: Proposal | None = None
    for width in _WIDTHS:
        for t in np.arange(0.0, edges[-1], max(_EVERY, 0.4 * width)):
            weight = np.exp(-(((middle - t) / width) ** 2) / 2.0)
            before = np.zeros((k, d, len(wide)))
            before[1:] = np.cumsum(weight[:-1, None, None] * push, axis=0)
            columns = np.einsum("nd,ndw->nw", first, before[piece]) + weight[piece, None] * within
            gain, value = ground.ask(ground.whiten(columns))
            if best is None or gain > best.gain:
                given = (("t_s", float(t)), ("width_s", width))
                trial = Trial(
                    "air.gust",
                    tuple(Column("air.gust", name, 0.05, given) for _, name in _WIND),
                    frozenset([recording]),
                )
                sizes = zip((name for _, name in _WIND), value.tolist(), strict=True)
                start = {(("air.gust", name), trial.recordings): number for name, number in (*sizes, *given)}
                best = Proposal(trial, gain, start)
    return best
