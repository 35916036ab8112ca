"""`blind_test` and what it gives: scored cases of the blind test, their summary and their files."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from matplotlib.figure import Figure

from discsim.errors import InputError, require_type
from discsim.recording import Plant
from discsim.result import Result
from discsim.validation.challenge.blind import Request
from discsim.validation.challenge.cases.case import Kind, Mask
from discsim.validation.challenge.report.figures import draw_detection
from discsim.validation.challenge.report.page import MANY, goals_met
from discsim.validation.challenge.run import challenge, write_challenge
from discsim.validation.challenge.scores.detection import Curve, detections, fit_curve
from discsim.validation.challenge.scores.result import Scored, both_times, rates_of
from discsim.validation.challenge.scores.scoring import Rate
from discsim.validation.reporting.run import Run

__all__ = ["Challenged", "blind_test"]


@dataclass(frozen=True)
class Challenged(Result):
    """A finished blind test.

    Attributes
    ----------
    cases : tuple of Scored
        Each case opened: what was concealed, what the diagnosis said, and the score.
    mask : str or None
        What lay over every case.
    """

    cases: tuple[Scored, ...]
    mask: Mask | None = None

    def __repr__(self) -> str:
        return f"<Challenged: {self._right}>"

    @property
    def _right(self) -> str:
        return f"{sum(item.score.right for item in self.cases)} of {len(self.cases)} answered rightly"

    @cached_property
    def rates(self) -> dict[str, Rate]:
        """False alarms, right sets, coverage and the others, each with its 95 % interval."""
        return rates_of(self.cases)

    @cached_property
    def curve(self) -> Curve | None:
        """The chance to be named over the size in detection limits; None where too little was concealed."""
        return fit_curve(detections(self.cases))

    @property
    def goals_met(self) -> bool:
        """Whether every goal is met; under a mask an answer to every case is all that can be asked for."""
        if self.mask is not None:
            return not self.rates["crash_rate"].hits
        return goals_met(self.rates, self.curve, few=len(self.cases) < MANY)

    def summary(self) -> str:
        """Return the rates, the size that is named in half of all cases, and the time: a line each."""
        lines = []
        for label, found in self.rates.items():
            share = f"{100 * found.value:.1f} % ({found.hits} of {found.of})" if found.of else "no such case"
            lines.append(f"{label.replace('_', ' ')}: {share}")
        if self.curve is not None:
            lines.append(f"half-detection size, in detection limits: {self.curve.text}")
        return "\n".join([*lines, self._right, f"a diagnosis took {both_times(self.cases)}"])

    def table(self) -> dict[str, list[Any]]:
        """Return a row for each case: seed, plant, what was concealed, what was answered, and whether it is right."""
        return {
            "seed": [item.answer.seed for item in self.cases],
            "plant": [item.answer.plant for item in self.cases],
            "concealed": [", ".join(item.answer.effects) for item in self.cases],
            "named": [", ".join(item.score.named) for item in self.cases],
            "right": [item.score.right for item in self.cases],
            "time_s": [item.seconds for item in self.cases],
        }

    def plot(self) -> Figure:
        """Return the figure of detection: the share of effects that are named over their size."""
        return draw_detection(detections(self.cases), self.curve)

    def report(self, folder: Path | str) -> Path:
        """Write challenge.json and report.html with its figures into ``folder``; return the report's path."""
        out = Path(folder)
        write_challenge(out, self.cases, self.mask, ["challenge"])
        return out / "report.html"


def blind_test(
    cases: int = 20,
    seed: int = 0,
    *,
    plant: Plant | None = None,
    effects: Sequence[str] = (),
    kind: Kind | None = None,
    mask: Mask | None = None,
    workers: int | None = None,
    folder: Path | str | None = None,
) -> Challenged:
    """Put the diagnosis to a blind test: effects are concealed, diagnosed by another process, then opened and scored.

    Parameters
    ----------
    cases, seed : int
        Case k has the seed ``seed + k``.
    plant, effects, kind, mask
        Only this plant, these concealed effects (ids), this kind of case, this mask; by default as drawn, no mask.
    workers : int, optional
        Local processes; 1 works in this one.
    folder : Path, optional
        Where finished cases are kept, so that a test that was stopped goes on. By default nothing is kept.

    Raises
    ------
    InputError
        For what does not go together, such as an effect that a plant does not have, and for no case at all.
    """
    for value, name in ((cases, "cases"), (seed, "seed")):
        require_type(value, Integral, name, "a whole number")
    if cases < 1:
        raise InputError(f"{cases} cases; expected at least one")
    requests = [Request(number, plant, tuple(effects), kind, mask) for number in range(seed, seed + cases)]
    requests[0].draw()  # what does not go together is refused before hours are spent
    with ExitStack() as stack:
        out = Path(folder if folder is not None else stack.enter_context(TemporaryDirectory()))
        out.mkdir(parents=True, exist_ok=True)
        return Challenged(tuple(challenge(Run(out, ["challenge"], seed), requests, workers=workers)), mask)
