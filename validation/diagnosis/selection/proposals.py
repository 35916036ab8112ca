"""Proposals: what algebra about a fit (score tests) expects of each candidate effect and of pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from discsim.effects import Effect
from validation.diagnosis.selection.candidates import Trial, free_trial, parameters_of
from validation.diagnosis.selection.evidence import ONE_SIDED
from validation.diagnosis.selection.hypothesis import Hypothesis, Start, fitted_parameters
from validation.diagnosis.selection.screening import Answer, Board, free_columns
from validation.diagnosis.settings import SELECTION
from validation.identification.parameters import Parameter
from validation.identification.propagation import Column

__all__ = ["start_of"]


@dataclass(frozen=True)
class Proposal:
    """A trial and what algebra expects of it, with values of its columns to start from."""

    trial: Trial
    gain: float
    start: Start


def proposals(
    board: Board,
    trials: Sequence[Trial],
    hypothesis: Hypothesis,
    own: Sequence[Parameter],
) -> list[Proposal]:
    """Return what each trial would gain upon a hypothesis, in all recordings and in each alone, best first."""
    taken = board.columns_of(fitted_parameters(hypothesis, own))
    base = board.ask(taken).chi2
    found = []
    present = {(trial.id, trial.recordings) for trial in hypothesis.trials}
    for trial in trials:
        scopes: list[frozenset[int] | None] = [None]
        if board.recordings > 1:
            scopes += [frozenset([i]) for i in range(board.recordings)]
        best: Proposal | None = None
        for scope in scopes:
            if (trial.id, scope) in present or (trial.id, None) in present:
                continue
            scoped = replace(trial, recordings=scope)
            columns = free_columns(scoped)
            rest = [(c, q) for c, q in taken if q.key not in {p.key for _, p in columns} or scope is not None]
            answer = board.ask([*rest, *columns])
            gain = base - answer.chi2
            if _backwards(columns, answer):
                continue
            proposal = Proposal(scoped, gain, start_of([*rest, *columns], answer, (scoped,)))
            if best is None or gain > best.gain + (scope_price(board.recordings) if scope is not None else 0.0):
                best = proposal
        if best is not None:
            found.append(best)
    return sorted(found, key=lambda p: SELECTION.rival * len(parameters_of(p.trial)) - p.gain)


def hinted(effect: Effect) -> Proposal:
    """Return an effect of about the right size as a proposal, whatever algebra says of it."""
    trial = free_trial(effect.id)
    return Proposal(trial, np.inf, {((effect.id, name), None): size for name, size in effect.sizes.items()})


def scope_price(recordings: int) -> float:
    """Return by how much an effect must do better in one recording alone than in all: what choosing it costs."""
    return float(2.0 * np.log(recordings) + 6.0)


def _backwards(freed: Sequence[tuple[Column, Parameter]], answer: Answer) -> bool:
    """Tell whether algebra wants, of the columns that were asked for last, a friction that drives or an early lag."""
    values = answer.value[len(answer.value) - len(freed) :]
    return any(q.key in ONE_SIDED and ONE_SIDED[q.key] * float(v) < 0 for (_, q), v in zip(freed, values, strict=True))


def start_of(asked: Sequence[tuple[Column, Parameter]], answer: Answer, trials: Sequence[Trial] = ()) -> Start:
    """Return the values of an answer, and those at which its trials are shaped."""
    start = {(q.key, q.recordings): q.stated + float(v) for (_, q), v in zip(asked, answer.value, strict=True)}
    for trial in trials:
        start |= {((trial.id, name), trial.recordings): value for name, value in trial.shapes.items()}
    return start


def one_per_effect(found: Sequence[Proposal]) -> list[Proposal]:
    """Keep the best shape of each effect."""
    seen: dict[str, Proposal] = {}
    for proposal in found:
        seen.setdefault(proposal.trial.id, proposal)
    return list(seen.values())


@dataclass(frozen=True)
class Pair:
    """Two effects, what is left with both by algebra, charged for parameters, and values to start from."""

    hypothesis: Hypothesis
    merit: float
    start: Start


def pairs(board: Board, trials: Sequence[Trial], own: Sequence[Parameter]) -> list[Pair]:
    """Return what algebra expects of every two effects in all recordings, the best shapes of each, best pair first."""
    taken = board.columns_of(fitted_parameters(Hypothesis(), own))
    found: dict[tuple[str, str], Pair] = {}
    for both in combinations(trials, 2):
        ids = both[0].id, both[1].id
        if ids[0] == ids[1]:
            continue
        freed = [item for trial in both for item in free_columns(trial)]
        asked = [*((c, q) for c, q in taken if q.key not in {p.key for _, p in freed}), *freed]
        answer = board.ask(asked)
        hypothesis = Hypothesis(both)
        merit = answer.chi2 + SELECTION.rival * hypothesis.size
        if merit < (found[ids].merit if ids in found else np.inf) and not _backwards(freed, answer):
            found[ids] = Pair(hypothesis, merit, start_of(asked, answer, both))
    return sorted(found.values(), key=lambda pair: pair.merit)
