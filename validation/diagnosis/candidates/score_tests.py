"""Score tests of every candidate effect and of pairs: what each would gain upon a fit (Rao, 1948).

Takes normal equations over all columns; gives screened candidates with expected gain and values to start from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from discsim.effects import Effect
from discsim.effects.catalogue import catalogued
from discsim.effects.track_rows import Camera
from discsim.recording import Recording
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, free_candidate
from discsim.validation.diagnosis.candidates.evidence import ONE_SIDED, charge
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, Start, fitted_parameters
from discsim.validation.diagnosis.candidates.screening import NormalEquations, ScoreTest, free_columns
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.propagation import Column

__all__ = ["start_of"]


@dataclass(frozen=True)
class ScreenedCandidate:
    """A candidate and what algebra expects of it, with values of its columns to start from."""

    candidate: CandidateEffect
    gain: float
    start: Start


def screened_candidates(
    equations: NormalEquations,
    candidates: Sequence[CandidateEffect],
    hypothesis: Hypothesis,
    own: Sequence[Parameter],
) -> list[ScreenedCandidate]:
    """Return what each candidate would gain upon a hypothesis, in all recordings and in each alone, best first."""
    taken = equations.columns_of(fitted_parameters(hypothesis, own))
    base = equations.solve(taken).chi2
    found = []
    present = {(candidate.id, candidate.recordings) for candidate in hypothesis.candidates}
    for candidate in candidates:
        scopes: list[frozenset[int] | None] = [None]
        if equations.recordings > 1 and candidate.told_by_one:
            scopes += [frozenset([i]) for i in range(equations.recordings)]
        best: ScreenedCandidate | None = None
        most = -np.inf
        for scope in scopes:
            if (candidate.id, scope) in present or (candidate.id, None) in present:
                continue
            scoped = replace(candidate, recordings=scope)
            columns = free_columns(scoped)
            rest = [(c, q) for c, q in taken if q.key not in {p.key for _, p in columns} or scope is not None]
            answer = equations.solve([*rest, *columns])
            gain = base - answer.chi2
            if backwards(columns, answer):
                continue
            screened = ScreenedCandidate(scoped, gain, start_of([*rest, *columns], answer, (scoped,)))
            worth = gain - (0.0 if scope is None else scope_price(equations.recordings))
            if best is None or worth > most:
                best, most = screened, worth
        if best is not None:
            found.append(best)
    return sorted(found, key=lambda p: charge(p.candidate) - p.gain)


def hinted(effect: Effect) -> ScreenedCandidate:
    """Return an effect of about the right size as a screened candidate, whatever algebra says of it."""
    candidate = free_candidate(effect.id)
    return ScreenedCandidate(
        candidate, np.inf, {((effect.id, name), None): size for name, size in effect.sizes.items()}
    )


def pictured_from_above(
    recordings: Sequence[Recording], candidates: Sequence[CandidateEffect]
) -> tuple[ScreenedCandidate, ...]:
    """Return the camera of tracks without heights, to be tried first: a plan alone comes from pictures from above.

    Where nothing else tells the motion, algebra from far away lets winds and blows take up anything before.
    """
    id = catalogued(Camera).id
    if not plans_alone(recordings):
        return ()
    return tuple(ScreenedCandidate(candidate, np.inf, {}) for candidate in candidates if candidate.id == id)


def plans_alone(recordings: Sequence[Recording]) -> bool:
    """Tell whether recordings hold nothing but tracks without heights."""
    tracks = [recording.get("track") for recording in recordings]
    plans = all(track is not None and not np.any(np.isfinite(track.value[:, 2])) for track in tracks)
    return plans and all(len(recording.samples) == 1 for recording in recordings)


def scope_price(recordings: int) -> float:
    """Return by how much an effect must do better in one recording alone than in all: what choosing it costs."""
    return float(2.0 * np.log(recordings) + 6.0)


def backwards(freed: Sequence[tuple[Column, Parameter]], answer: ScoreTest) -> bool:
    """Tell whether algebra wants, of the columns that were asked for last, a friction that drives or an early lag."""
    values = answer.value[len(answer.value) - len(freed) :]
    return any(q.key in ONE_SIDED and ONE_SIDED[q.key] * float(v) < 0 for (_, q), v in zip(freed, values, strict=True))


def start_of(
    asked: Sequence[tuple[Column, Parameter]], answer: ScoreTest, candidates: Sequence[CandidateEffect] = ()
) -> Start:
    """Return the values of an answer, and those at which its candidates are shaped."""
    start = {(q.key, q.recordings): q.stated + float(v) for (_, q), v in zip(asked, answer.value, strict=True)}
    for candidate in candidates:
        start |= {((candidate.id, name), candidate.recordings): value for name, value in candidate.shape_grid.items()}
    return start


def one_per_effect(found: Sequence[ScreenedCandidate]) -> list[ScreenedCandidate]:
    """Keep the best shape of each effect."""
    seen: dict[str, ScreenedCandidate] = {}
    for screened in found:
        seen.setdefault(screened.candidate.id, screened)
    return list(seen.values())


@dataclass(frozen=True)
class Pair:
    """Two effects, what is left with both by algebra, charged for parameters, and values to start from."""

    hypothesis: Hypothesis
    merit: float
    start: Start


def pairs(equations: NormalEquations, candidates: Sequence[CandidateEffect], own: Sequence[Parameter]) -> list[Pair]:
    """Return what algebra expects of every two effects in all recordings, the best shapes of each, best pair first."""
    taken = equations.columns_of(fitted_parameters(Hypothesis(), own))
    found: dict[tuple[str, str], Pair] = {}
    for both in combinations(candidates, 2):
        ids = both[0].id, both[1].id
        if ids[0] == ids[1]:
            continue
        freed = [item for candidate in both for item in free_columns(candidate)]
        asked = [*((c, q) for c, q in taken if q.key not in {p.key for _, p in freed}), *freed]
        answer = equations.solve(asked)
        hypothesis = Hypothesis(both)
        merit = answer.chi2 + SELECTION.rival * hypothesis.size
        if merit < (found[ids].merit if ids in found else np.inf) and not backwards(freed, answer):
            found[ids] = Pair(hypothesis, merit, start_of(asked, answer, both))
    return sorted(found.values(), key=lambda pair: pair.merit)
