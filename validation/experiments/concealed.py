"""One concealed case of each verdict, diagnosed blind: it must still say what is there, and no more.

The cases are drawn by the blind test's own generator and simulated by MuJoCo. Seeds were chosen for their short time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, NamedTuple

from discsim.threads import cores
from discsim.validation.challenge.blind import Request, diagnose_blind
from discsim.validation.challenge.cases.conceal import Answer
from discsim.validation.challenge.scores.scoring import CaseScore, score_case
from discsim.validation.diagnosis.answer.named import MOVE_LIMIT
from discsim.validation.reporting.scores import Score, at_most, score

__all__ = ["FULL_CASES", "QUICK_CASES", "Concealed", "concealed_cases", "concealed_checks"]

#: louder noise than stated, and an effect
QUICK_CASES = (Request(5205, "rate_table"), Request(5211, "rate_table"))
#: and a stated number that is off, and physics of no catalogue
FULL_CASES = (*QUICK_CASES, Request(2, "spin_down", kind="beyond_sigma"), Request(5213, "rate_table"))


class Concealed(NamedTuple):
    """A case, its answer, and what the diagnosis made of it (None: nothing)."""

    request: Request
    answer: Answer
    diagnosis: dict[str, Any] | None
    error: str | None
    score: CaseScore

    @property
    def row(self) -> tuple[str, ...]:
        """A row for people: what was concealed, what was found, how well, and the command that repeats it."""
        found = "no answer" if self.diagnosis is None else self.diagnosis["verdict"]
        named = ", ".join(self.score.named)
        hidden = ", ".join(self.answer.effects)
        return (
            self.answer.verdict + (f": {hidden}" if hidden else ""),
            found + (f": {named}" if named else self._moved),
            "right" if self.score.right else "WRONG",
            self.request.command,
        )

    @property
    def _moved(self) -> str:
        """What a recalibration moved, from the stated value to the one found, and by how many stated deviations."""
        stated = {} if self.diagnosis is None else self.diagnosis.get("recalibrated", {})
        sigmas = {name: (item["value"] - item["stated"]) / item["stated_sd"] for name, item in stated.items()}
        texts = [
            f"{name} {stated[name]['stated']:.4g} → {stated[name]['value']:.4g} ({move:+.1f} stated sd)"
            for name, move in sigmas.items()
            if abs(move) > MOVE_LIMIT
        ]
        return f": {', '.join(texts)}" if texts else ""


@contextmanager
def concealed_cases(requests: Sequence[Request]) -> Iterator[Iterator[Concealed]]:
    """Diagnose cases inside the block, as many at once as there are cores, and yield an iterator of them in order.

    Each is diagnosed by another process that gets recordings and nothing else: what runs in the block goes on beside.
    """

    def diagnosed(request: Request) -> Concealed:
        answer = Answer.of(request.draw())
        done = diagnose_blind(tuple(request), None)
        return Concealed(request, answer, done["diagnosis"], done["error"], score_case(answer, done["diagnosis"]))

    pool = ThreadPoolExecutor(cores())
    try:
        waiting = [pool.submit(diagnosed, request) for request in requests]
        yield (one.result() for one in waiting)
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def concealed_checks(cases: Sequence[Concealed]) -> list[Score]:
    """Return one score a case, and one for the sizes of what was named."""
    scores = [
        score(f"concealed, {case.answer.verdict}: right verdict, effects and place", case.score.right, "", 1.0, 0.0)
        for case in cases
    ]
    errors = [abs(item.in_sd) for case in cases for item in case.score.deviations if item.in_sd is not None]
    # of some ten numbers, honest standard deviations let one pass 4 in 1500 runs
    return [*scores, at_most("concealed, largest error of a size", max(errors, default=float("nan")), "sd", 4.0)]
