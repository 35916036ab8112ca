"""How long a whole diagnosis still takes: from the shares of its time after which its stages usually begin.

Takes what a diagnosis reports of itself and a clock; gives seconds. What is found decides how much is still to be
tried, so an estimate holds within a factor of two and no better; docs/diagnosing.md says how often it does.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

__all__ = ["TimeLeft"]


class Span(NamedTuple):
    """Shares of a diagnosis' time at which a stage begins and, where nothing is found there, ends."""

    begins: float
    ends: float


#: of all but rate tables; measured on twelve diagnoses of `benchmarks/plan.py`
_USUAL = {
    "following the data": Span(0.10, 0.36),
    "asking every effect": Span(0.36, 0.45),
    "fitting the baseline": Span(0.45, 0.50),
    "refitting candidates": Span(0.50, 0.66),
    "effect 1": Span(0.57, 0.80),
}
#: of rate tables, whose sensors are compared at length; measured on such as ripple
_ON_TABLE = {
    "following the data": Span(0.25, 0.43),
    "asking every effect": Span(0.43, 0.49),
    "fitting the baseline": Span(0.49, 0.52),
    "refitting candidates": Span(0.52, 0.66),
    "effect 1": Span(0.56, 0.80),
}
#: a second effect is mostly the last one tried; where there is a third, more come
_LATER = {
    "refitting with two": Span(0.60, 0.80),
    "effect 2": Span(0.62, 0.85),
    "effect 3": Span(0.45, 0.75),
    "effect 4": Span(0.60, 0.88),
    "refitting in place of": Span(0.72, 0.88),
    "looking for a law": Span(0.90, 0.97),
    "asking what to record next": Span(0.90, 0.97),
}
_SPANS: Mapping[bool, Mapping[str, Span]] = MappingProxyType({False: _USUAL | _LATER, True: _ON_TABLE | _LATER})
#: stages of the search that take up a longer name's place
_MANY = re.compile(r"effect ([4-9]|\d\d)")


class TimeLeft:
    """Tells the seconds that are left of a diagnosis, of a rate ``table`` or of anything else; ``now`` gives seconds.

    A stage that lasts longer than it usually does makes the whole longer.
    """

    def __init__(self, *, table: bool, now: Callable[[], float] = time.monotonic) -> None:
        self._now, self._spans = now, _SPANS[table]
        self._start = now()
        self._stage, self._entered = "", 0.0

    def __call__(self, stage: str, done: int, total: int) -> float | None:
        """Return the seconds left once a stage is so far; None before anything is known of how fast it goes."""
        spent, name = self._now() - self._start, self._named(stage)
        if name is not None and name != self._stage:
            self._stage, self._entered = name, spent
        if not self._stage or spent <= 0.0:
            return None
        begins, ends = self._spans[self._stage]
        within = done / total if name is not None and ": " in stage and total else 0.0
        # by how many of a round are done, or by the pace up to this stage, whichever is farther
        paced = begins * spent / self._entered if self._entered > 0.0 else begins
        share = min(max(begins + (ends - begins) * within, paced), ends)
        return spent / share - spent

    def _named(self, stage: str) -> str | None:
        """Return the stage that a report is of; None for one that is part of the stage before."""
        name = _MANY.sub("effect 4", stage)
        return next((known for known in self._spans if name.startswith(known)), None)
