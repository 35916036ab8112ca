"""What passes from stage to stage of a diagnosis: each is made by the stage before, and none is changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from discsim.effects.catalogue import Effect, effect_of
from discsim.effects.sensors import Lag
from discsim.recording import Recording
from discsim.validation.diagnosis.answer.leftover import Leftover
from discsim.validation.diagnosis.answer.misstated import Misstated
from discsim.validation.diagnosis.consistency.spin_agreement import Agreement, Comparison
from discsim.validation.diagnosis.detectors.row_times import RowTimes
from discsim.validation.diagnosis.early_verdict import Contradiction
from discsim.validation.diagnosis.progress import Progress, silent
from discsim.validation.diagnosis.result import Verdict
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.setup import SetupFindings
from discsim.validation.diagnosis.unknown_law.find import FoundLaw
from discsim.validation.identification.competing_effects import CATALOGUED, Competing
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.plants.plan import Plan

__all__ = ["Judged", "Prepared", "Question", "Tried"]


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked: recordings of one plant, what each and each data set is called, the effects that compete.

    ``plans`` are the recordings that could be made next, None for such as are made easily.
    """

    recordings: tuple[Recording, ...]
    names: tuple[str, ...]
    datasets: tuple[str, ...]
    effects: Competing = CATALOGUED
    plans: Sequence[Plan] | None = None
    seed: int = 0
    progress: Progress = silent


@dataclass(frozen=True, eq=False)
class Prepared:
    """Recordings under a supposed setup: as they were ``meant``, and as they are ``fitted``; what must be known.

    ``agreeing`` are the comparisons of each recording's sensors with one another, ``agreement`` what they come to;
    ``rows`` tells when the rows were made, where that was counted.
    """

    setup: SetupFindings
    meant: tuple[Recording, ...]
    fitted: tuple[Recording, ...]
    notes: tuple[str, ...]
    agreeing: tuple[tuple[Comparison, ...], ...]
    agreement: Agreement | None = None
    rows: RowTimes | None = None

    @property
    def supposed(self) -> tuple[Effect, ...]:
        """The effects, of about the right size, that sensors which were asked of one another leave to a fit."""
        settling = None if self.agreement is None else self.agreement.settling
        if settling is None or not plant_of(self.fitted[0]).held:
            return ()
        return (effect_of(Lag(settling.tau_s), "accelerometer"),)


@dataclass(frozen=True, eq=False)
class Tried:
    """A setup put to the proof: either sensors contradict one another under it, or effects were searched.

    ``law`` is that by which one sensor alone contradicts all others. ``misstated`` are sets of numbers that are stated
    as exact; were those of one set others, sensors would not contradict one another.
    """

    prepared: Prepared
    contradiction: Contradiction | None = None
    found: Search | None = None
    law: FoundLaw | None = None
    misstated: tuple[tuple[Misstated, ...], ...] = ()

    @property
    def fit(self) -> Fit | None:
        """The fit of the effects that were found; None where sensors contradict one another."""
        return None if self.found is None else self.found.final.fit


@dataclass(frozen=True, eq=False)
class Judged:
    """What was tried, with its verdict; a ``law`` stands for all that was left out.

    ``left`` is what each recording keeps of each sensor, where rows had to be counted, by the fits ``set_aside``.
    ``misstated`` are sets of numbers that are stated as exact; were those of one set others, they would explain all.
    """

    tried: Tried
    verdict: Verdict
    law: FoundLaw | None = None
    left: tuple[Leftover, ...] = ()
    set_aside: tuple[Fit, ...] = ()
    misstated: tuple[tuple[Misstated, ...], ...] = ()
