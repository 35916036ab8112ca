"""A hypothesis: the effects that may act, and the parameters fitted under it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from validation.diagnosis.selection.candidates import Trial, parameters_of
from validation.identification.parameters import Parameter

__all__ = ["Hypothesis", "Start"]

#: values of parameters by what they are and the recordings that share them
Start: TypeAlias = Mapping[tuple[tuple[str, str], frozenset[int] | None], float]


@dataclass(frozen=True)
class Hypothesis:
    """Effects that may act."""

    trials: tuple[Trial, ...] = ()

    def plus(self, trial: Trial) -> Hypothesis:
        """Return it with one more effect."""
        return replace(self, trials=(*self.trials, trial))

    def without(self, trial: Trial) -> Hypothesis:
        """Return it less one of its effects."""
        return replace(self, trials=tuple(t for t in self.trials if t is not trial))

    @property
    def size(self) -> int:
        """Number of parameters it adds."""
        return sum(len(parameters_of(trial)) for trial in self.trials)


def fitted_parameters(hypothesis: Hypothesis, own: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Return a recording set's own parameters and those of the hypothesis."""
    taken = [q for trial in hypothesis.trials for q in parameters_of(trial)]
    keys = {(q.key, q.recordings) for q in taken}
    return (*(q for q in own if (q.key, q.recordings) not in keys), *taken)
