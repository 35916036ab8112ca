"""Evidence on recordings held out: what effects gain where their parameters were not fitted (cross-validation)."""

from __future__ import annotations

import numpy as np

from validation.diagnosis.selection.candidates import Trial
from validation.diagnosis.selection.found import Search
from validation.diagnosis.selection.hypothesis import Hypothesis, fitted_parameters

__all__ = ["heldout_chi2", "heldout_gain"]


def heldout_gain(found: Search, trial: Trial) -> float | None:
    """Return the log likelihood that an effect gains on recordings that took no part in its fit."""
    board, final = found.board, found.final
    assert board is not None
    count = board.recordings
    if count < 2 or not trial.columns or (trial.recordings is not None and len(trial.recordings) < 2):
        return None
    rest = final.hypothesis.without(trial)
    total = 0.0
    for i in range(count):
        total += heldout_chi2(found, rest, i) - heldout_chi2(found, final.hypothesis, i)
    return 0.5 * total


def heldout_chi2(found: Search, hypothesis: Hypothesis, i: int) -> float:
    """Return chi-squared of a recording with the shared parameters as the other recordings have them."""
    board = found.board
    assert board is not None
    own = board.columns_of(fitted_parameters(hypothesis, found.own))
    others = [j for j in range(board.recordings) if j != i]
    answer = board.ask(own, only=others)
    G = board.grams[i]
    fixed = [
        (board.place[column], float(v))
        for (column, q), v in zip(own, answer.value, strict=True)
        if q.acts_in(i) and any(q.acts_in(j) for j in others)
    ]
    alone = [(column, q) for column, q in own if q.acts_in(i) and not any(q.acts_in(j) for j in others)]
    at = np.array([place for place, _ in fixed], dtype=int)
    v = np.array([value for _, value in fixed])
    e = G[:, -1].copy()
    chi2 = float(G[-1, -1])
    if at.size:
        chi2 += float(-2.0 * v @ e[at] + v @ G[np.ix_(at, at)] @ v)
        e[:-1] -= G[:-1][:, at] @ v
    if alone:
        free = np.array([board.place[column] for column, _ in alone])
        H = G[np.ix_(free, free)] + np.diag([q.precision for _, q in alone])
        chi2 -= float(e[free] @ np.linalg.solve(H + 1e-12 * np.diag(np.diag(H)), e[free]))
    return chi2
