"""`diagnose_recordings` and what it gives: a diagnosis with its summary and its report, from one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from discsim.effects.own import UserEffect
from discsim.errors import InputError
from discsim.model_file import Model
from discsim.recording import Recording
from discsim.result import Result
from discsim.threads import one_thread
from discsim.validation.checking.doubts import reading_doubts
from discsim.validation.diagnosis.datasets import need_field, recording_names
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.progress import Progress, silent
from discsim.validation.diagnosis.report.figures import draw_overview
from discsim.validation.diagnosis.report.files import write_outcome
from discsim.validation.diagnosis.report.page import verdict_sentence
from discsim.validation.diagnosis.report.wording import name_of
from discsim.validation.diagnosis.result import Diagnosis, NamedEffect, Outcome
from discsim.validation.diagnosis.setup.remedy import remedy_of
from discsim.validation.identification.plants.plan import Plan
from discsim.validation.running.given import Given, given_recordings

__all__ = ["Diagnosed", "diagnose_named", "diagnose_recordings"]


@dataclass(frozen=True, repr=False)
class Diagnosed(Result):
    """A finished diagnosis.

    Attributes
    ----------
    outcome : Outcome
        Everything: the answer, the improved model, residuals and candidates (`discsim.validation.diagnosis.result`).
    counts : mapping
        Number of recordings by the name of their data set.
    doubts : tuple of str
        What is doubtful about positions, and readings that failed, as `check` says it; it is among the warnings.
    """

    outcome: Outcome
    counts: Mapping[str, int]
    doubts: tuple[str, ...] = ()

    def __repr__(self) -> str:
        effects = ", ".join(effect.id for effect in self.effects) or "no effect named"
        return f"<Diagnosed: {self.verdict}, {effects}, {sum(self.counts.values())} recordings>"

    @property
    def diagnosis(self) -> Diagnosis:
        """The answer; its ``to_json()`` is the content of ``diagnosis.json``."""
        return self.outcome.diagnosis

    @property
    def verdict(self) -> str:
        """One of consistent, recalibrated, explained, unexplained."""
        return self.diagnosis.verdict

    @property
    def effects(self) -> tuple[NamedEffect, ...]:
        """The effects that were left out, strongest evidence first."""
        return self.diagnosis.effects

    @property
    def model(self) -> Model:
        """The improved model, which `discsim.write_model` writes and ``discsim fly --model`` takes."""
        return self.outcome.model

    @property
    def remedies(self) -> tuple[str, ...]:
        """For each named effect that is a fault of the setup the line of an import map that mends it."""
        return tuple(f"{name_of(item.id)}: {line}" for item in self.effects if (line := remedy_of(item)))

    def summary(self) -> str:
        """Return the verdict and the sentence that explains it, one line."""
        return f"{self.verdict}: {verdict_sentence(self.diagnosis)}"

    def table(self) -> dict[str, list[Any]]:
        """Return a row for each parameter of each named effect: effect, recordings, parameter, value, sd."""
        rows = [(effect, name, found) for effect in self.effects for name, found in effect.parameters.items()]
        return {
            "effect": [effect.id for effect, *_ in rows],
            "recordings": [", ".join(effect.recordings or ("all",)) for effect, *_ in rows],
            "parameter": [name for _, name, _ in rows],
            "value": [found.value for *_, found in rows],
            "sd": [float("nan") if found.sd is None else found.sd for *_, found in rows],
        }

    def plot(self) -> Figure:
        """Return the figure of residuals over the noise, by recording and axis, before and after."""
        return draw_overview(self.outcome.residuals)

    def report(self, folder: Path | str, command: str = "discsim.validation.diagnose") -> Path:
        """Write diagnosis.json, report.html, figures and model.toml into ``folder``; return the report's path.

        ``command`` is what the report says that it was made by.
        """
        out = Path(folder)
        settings = {
            "command": command,
            "seed": str(self.diagnosis.seed),
            "recordings": ", ".join(f"{name}: {count}" for name, count in self.counts.items()),
        }
        write_outcome(self.outcome, out, settings)
        return out / "report.html"


def diagnose_recordings(
    recordings: Given,
    *,
    name: str | None = None,
    seed: int = 0,
    user_effects: Sequence[UserEffect] = (),
    plans: Sequence[Plan] | None = None,
    progress: Progress = silent,
) -> Diagnosed:
    """Tell whether the baseline explains recordings down to their noise, and if not, what was left out.

    Parameters
    ----------
    recordings
        Recordings of one plant that share their hardware, a folder of them, or a sequence of either.
    name : str, optional
        What the report calls the data set; by default the folder's name.
    seed : int
        Seed of everything random.
    user_effects
        Effects of your own (`discsim.effects.own.load_user_effects`), which compete with the catalogue's.
    plans
        Recordings that you could make (`discsim.validation.diagnosis.design.plans`), to choose the next one from.
    progress
        Called with a stage, the steps done, and the steps in all.

    Raises
    ------
    InputError
        For recordings of different plants, for a magnetometer in a field that is not stated, and for a rate reference
        or a command that the sensors beside it contradict (its unit, its sign, its clock).
    """
    if name is None:
        name = Path(recordings).resolve().name if isinstance(recordings, Path | str) else "recordings"
    return diagnose_named(
        {name: given_recordings(recordings)}, seed=seed, user_effects=user_effects, plans=plans, progress=progress
    )


@one_thread
def diagnose_named(
    datasets: Mapping[str, Sequence[Recording]],
    *,
    seed: int = 0,
    user_effects: Sequence[UserEffect] = (),
    plans: Sequence[Plan] | None = None,
    progress: Progress = silent,
) -> Diagnosed:
    """Diagnose several data sets by name together, as `diagnose_recordings` does one."""
    sets = list(datasets.values())
    plants = {recording.plant for one in sets for recording in one}
    if len(plants) != 1:
        raise InputError(f"recordings of {', '.join(sorted(plants)) or 'nothing'}; expected recordings of one plant")
    need_field(sets)
    called = [name for group in recording_names(sets, list(datasets)) for name in group]
    doubts = reading_doubts([recording for one in sets for recording in one], called)
    outcome = diagnose(sets, list(datasets), progress=progress, seed=seed, user_effects=user_effects, plans=plans)
    answer = replace(outcome.diagnosis, warnings=(*doubts, *outcome.diagnosis.warnings))
    counts = {name: len(one) for name, one in datasets.items()}
    return Diagnosed(replace(outcome, diagnosis=answer), counts, doubts)
