"""Gusts: winds of a bell's shape in time, scanned over instant and width by matched filters.

Takes the local linear problem of a fit; gives candidates with instant, width and wind.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, detected
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.diagnosis.detectors.local_problem import WIND, LocalProblem, LocalProblems, gain_of
from discsim.validation.diagnosis.settings import DETECTORS
from discsim.validation.identification.gauss_newton import mapped
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.segments import undone

__all__ = ["gusts"]

#: widths of gusts tried, s, and the spacing of their instants
_WIDTHS, _EVERY = (0.1, 0.2, 0.4, 0.8), 0.1


def gusts(problems: LocalProblems, least: float = DETECTORS.least) -> list[ScreenedCandidate]:
    """Return gusts, at most one per recording, that would gain more than ``least``, best first.

    A gust is a sum of winds that blow for one segment of motion each, so any instant and width is asked for by algebra.
    """
    kinds = detected([trajectory.recording for trajectory in problems.fit.trajectories], "gusts")

    def one(task: tuple[str, int]) -> ScreenedCandidate | None:
        id, i = task
        return None if problems.has(id, i) else _gust(id, problems.by_recording[i], i, problems.wind)

    found = mapped(one, [(row.id, i) for row in kinds for i in problems.by_recording])
    return sorted((p for p in found if p is not None and p.gain > least), key=gain_of, reverse=True)


def _gust(id: str, problem: LocalProblem, recording: int, wide: Sequence[int]) -> ScreenedCandidate | None:
    """Return the gust in a recording that would gain most; ``wide`` are the places of a steady wind's columns."""
    linear, segment, nodes = problem.linear, problem.segment, problem.trajectory.nodes
    d, own, k = problem.trajectory.plant.layout.directions, linear.unknowns, len(problem.trajectory.states)
    full = linear.full
    first = full[:, :d]
    # u: the change of the first state that a wind up to each boundary amounts to
    u = np.stack([undone(m[:, :d], m[:, [own + w for w in wide]]) for m in linear.sensitivities])
    within = full[:, [own + w for w in wide]] - np.einsum("nd,ndw->nw", first, u[segment])
    push = np.diff(u, axis=0)
    middle = 0.5 * (nodes[:-1] + nodes[1:])
    best: ScreenedCandidate | None = None
    for width in _WIDTHS:
        for t in np.arange(0.0, nodes[-1], max(_EVERY, 0.4 * width)):
            weight = np.exp(-(((middle - t) / width) ** 2) / 2.0)
            before = np.zeros((k, d, len(wide)))
            before[1:] = np.cumsum(weight[:-1, None, None] * push, axis=0)
            columns = np.einsum("nd,ndw->nw", first, before[segment]) + weight[segment, None] * within
            gain, value = problem.solve(problem.whiten(columns))
            if best is None or gain > best.gain:
                given = (("t_s", float(t)), ("width_s", width))
                columns_of = tuple(Column(id, name, 0.05, given) for _, name in WIND)
                candidate = CandidateEffect(id, columns_of, frozenset([recording]))
                sizes = zip((name for _, name in WIND), value.tolist(), strict=True)
                start = {((id, name), candidate.recordings): number for name, number in (*sizes, *given)}
                best = ScreenedCandidate(candidate, gain, start)
    return best
