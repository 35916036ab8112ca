"""Gusts: winds of a bell's shape in time, scanned over time and width."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from validation.diagnosis.detectors.local_problem import WIND, Asked, Ground, gain_of
from validation.diagnosis.selection.candidates import Trial, detected
from validation.diagnosis.selection.proposals import Proposal
from validation.diagnosis.settings import DETECTORS
from validation.identification.gauss_newton import mapped
from validation.identification.propagation import Column
from validation.identification.segments import undone

__all__ = ["gusts"]

#: widths of gusts tried, s, and the spacing of their instants
_WIDTHS, _EVERY = (0.1, 0.2, 0.4, 0.8), 0.1


def gusts(asked: Asked, least: float = DETECTORS.least) -> list[Proposal]:
    """Return gusts, at most one per recording, that would gain more than ``least``, best first.

    A gust is a sum of winds that blow for one piece of motion each, so any instant and width is asked for by algebra.
    """
    kinds = detected([chain.recording for chain in asked.fit.chains], "gusts")

    def one(task: tuple[str, int]) -> Proposal | None:
        id, i = task
        return None if asked.has(id, i) else _gust(id, asked.grounds[i], i, asked.wind)

    found = mapped(one, [(row.id, i) for row in kinds for i in asked.grounds])
    return sorted((p for p in found if p is not None and p.gain > least), key=gain_of, reverse=True)


def _gust(id: str, ground: Ground, recording: int, wide: Sequence[int]) -> Proposal | None:
    """Return the gust in a recording that would gain most; ``wide`` are the places of a steady wind's columns."""
    linear, piece, edges = ground.linear, ground.piece, ground.chain.edges
    d, own, k = ground.chain.plant.layout.directions, linear.unknowns, len(ground.chain.states)
    first = linear.local[:, :d]
    # u: the change of the first state that a wind up to each boundary amounts to
    u = np.stack([undone(m[:, :d], m[:, [own + w for w in wide]]) for m in linear.moves])
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
                columns_of = tuple(Column(id, name, 0.05, given) for _, name in WIND)
                trial = Trial(id, columns_of, frozenset([recording]))
                sizes = zip((name for _, name in WIND), value.tolist(), strict=True)
                start = {((id, name), trial.recordings): number for name, number in (*sizes, *given)}
                best = Proposal(trial, gain, start)
    return best
