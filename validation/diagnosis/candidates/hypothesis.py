"""A hypothesis: the effects that may act, and the parameters fitted under it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, parameters_of
from discsim.validation.identification.parameters import Parameter

__all__ = ["Hypothesis", "Start"]

#: values of parameters by what they are and the recordings that share them
Start: TypeAlias = Mapping[tuple[tuple[str, str], frozenset[int] | None], float]


@dataclass(frozen=True)
class Hypothesis:
    """Effects that may act."""

    candidates: tuple[CandidateEffect, ...] = ()

    def plus(self, candidate: CandidateEffect) -> Hypothesis:
        """Return it with one more effect."""
        return replace(self, candidates=(*self.candidates, candidate))

    def without(self, candidate: CandidateEffect) -> Hypothesis:
        """Return it less one of its effects."""
        return replace(self, candidates=tuple(t for t in self.candidates if t is not candidate))

    @property
    def size(self) -> int:
        """Number of parameters it adds."""
        return sum(len(parameters_of(candidate)) for candidate in self.candidates)


def fitted_parameters(hypothesis: Hypothesis, own: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Return a recording set's own parameters and those of the hypothesis."""
    taken = [q for candidate in hypothesis.candidates for q in parameters_of(candidate)]
    keys = {(q.key, q.recordings) for q in taken}
    return (*(q for q in own if (q.key, q.recordings) not in keys), *taken)
