"""The answer of a diagnosis: what ``diagnosis.json`` holds, and what its report shows beside it.

Every type here refuses what may not be written: a number that is no number, a verdict that its effects contradict. Its
parts are those of `discsim.validation.diagnosis.answer`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Literal, get_args

from discsim.arrays import FloatArray, readonly
from discsim.effects.catalogue import CATALOGUE
from discsim.model_file import Model
from discsim.recording import PLANTS, Plant
from discsim.validation.diagnosis.answer.checked import Recordings, finite, plain, shared
from discsim.validation.diagnosis.answer.leftover import Leftover
from discsim.validation.diagnosis.answer.measured import FitFigures, HeldOut, Located, NoiseNote, Outlier
from discsim.validation.diagnosis.answer.misstated import Misstated
from discsim.validation.diagnosis.answer.named import (
    MOVE_LIMIT,
    SMALLEST_P_VALUE,
    Advice,
    Confusion,
    Evidence,
    Law,
    NamedEffect,
    ParameterValue,
    Recalibration,
    Separation,
)
from discsim.validation.diagnosis.answer.partly import PartlyExplained
from discsim.validation.diagnosis.consistency.spin_agreement import Agreement

__all__ = [
    "DIAGNOSIS_FORMAT",
    "MOVE_LIMIT",
    "SMALLEST_P_VALUE",
    "Advice",
    "Candidate",
    "Confusion",
    "Diagnosis",
    "Evidence",
    "FitFigures",
    "HeldOut",
    "Law",
    "Located",
    "NamedEffect",
    "NoiseNote",
    "Outcome",
    "Outlier",
    "ParameterValue",
    "PartlyExplained",
    "Recalibration",
    "Residuals",
    "Separation",
    "Verdict",
]

DIAGNOSIS_FORMAT = "discsim-diagnosis/1"
Verdict = Literal["consistent", "recalibrated", "explained", "unexplained"]


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer; `to_json` is the content of ``diagnosis.json``.

    Attributes
    ----------
    datasets : tuple of str
        Names of the data sets; with several, a recording is named ``set/folder``.
    plant : str
        One of `discsim.recording.PLANTS`.
    seed : int
        Seed of everything random.
    verdict : str
        "consistent", "recalibrated", "explained" or "unexplained".
    baseline, final : FitFigures
        The fit before and after; a baseline has its release states and phases fitted, too.
    located, effects, recalibrated, law, noise
        The contract's entries; the effects are put in order of evidence, strongest first.
    heldout : tuple of HeldOut
        Before and after, recording by recording.
    outliers : tuple of Outlier
        Readings that were weighed down.
    next_recordings : tuple of str
        What to record next, as sentences.
    warnings : tuple of str
        What the reader must know: a sensor that is absent or cannot be used, sensors that contradict one another.
    partly : tuple of PartlyExplained
        Effects that explain an unexplained mismatch in part, on every recording set aside.
    leftovers : tuple of Leftover
        What each recording keeps of each sensor with the others' numbers, where rows had to be counted.
    misstated : tuple of tuple of Misstated
        Sets of numbers that are stated as exact; were those of one set others, they would explain all.
    agreement : Agreement or None
        Which sensors agree about the spin, and what single causes reconcile them; None where none can be compared.
    """

    datasets: tuple[str, ...]
    plant: Plant
    seed: int
    verdict: Verdict
    baseline: FitFigures
    final: FitFigures
    located: tuple[Located, ...] = ()
    effects: tuple[NamedEffect, ...] = ()
    recalibrated: Mapping[str, Recalibration] = field(default_factory=dict)
    law: Law | None = None
    noise: tuple[NoiseNote, ...] = ()
    heldout: tuple[HeldOut, ...] = ()
    outliers: tuple[Outlier, ...] = ()
    next_recordings: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    agreement: Agreement | None = None
    partly: tuple[PartlyExplained, ...] = ()
    leftovers: tuple[Leftover, ...] = ()
    misstated: tuple[tuple[Misstated, ...], ...] = ()

    def __post_init__(self) -> None:
        if not self.datasets:
            raise ValueError("diagnosis: no data set named; expected at least one")
        if self.plant not in PLANTS:
            raise ValueError(f"diagnosis: plant is {self.plant!r}, expected one of {', '.join(PLANTS)}")
        if self.verdict not in get_args(Verdict):
            raise ValueError(f"diagnosis: verdict is {self.verdict!r}, expected one of {', '.join(get_args(Verdict))}")
        object.__setattr__(self, "recalibrated", MappingProxyType(dict(self.recalibrated)))
        by_evidence = sorted(self.effects, key=lambda effect: -effect.evidence.delta_bic)
        object.__setattr__(self, "effects", tuple(by_evidence))
        if bool(self.effects) != (self.verdict == "explained"):
            raise ValueError(
                f"diagnosis: {len(self.effects)} effects with the verdict {self.verdict}; "
                "expected effects where it is explained, and nowhere else"
            )
        if self.law is not None and self.verdict != "unexplained":
            raise ValueError(f"diagnosis: a law with the verdict {self.verdict}; expected one only where unexplained")
        if self.verdict in ("consistent", "recalibrated") and bool(self.moved) != (self.verdict == "recalibrated"):
            raise ValueError(
                f"diagnosis: verdict {self.verdict} with {len(self.moved)} parameters moved by more than "
                f"{MOVE_LIMIT:g} of their sigma; expected none where consistent, some where recalibrated"
            )
        _each_once(self.effects)

    @property
    def moved(self) -> dict[str, Recalibration]:
        """The parameters that moved by more than their statement allows."""
        return {name: item for name, item in self.recalibrated.items() if item.beyond}

    def to_json(self) -> dict[str, Any]:
        """Return the content of ``diagnosis.json``: plain numbers, texts, lists and null, no NaN or Infinity."""
        return {
            "format": DIAGNOSIS_FORMAT,
            "dataset": self.datasets[0] if len(self.datasets) == 1 else list(self.datasets),
            "plant": self.plant,
            "seed": int(self.seed),
            "verdict": self.verdict,
            "located": _list(self.located),
            "effects": _list(self.effects),
            "recalibrated": {name: item.to_json() for name, item in self.recalibrated.items()},
            "partly_explained": _list(self.partly),
            "misstated": [_list(numbers) for numbers in self.misstated],
            "law": None if self.law is None else self.law.to_json(),
            "noise": _list(self.noise),
            "fit": {"baseline": self.baseline.to_json(), "final": self.final.to_json()},
            "heldout": _list(self.heldout),
            "leftovers": _list(self.leftovers),
            "outliers": _list(self.outliers),
            "next_recordings": list(self.next_recordings),
            "warnings": list(self.warnings),
            "agreement": None if self.agreement is None else self.agreement.to_json(),
        }


def _list(items: Iterable[Any]) -> list[dict[str, Any]]:
    return [item.to_json() for item in items]


def _each_once(effects: Sequence[NamedEffect]) -> None:
    """Refuse one effect twice in one recording; only events repeat."""
    seen: dict[str, list[Recordings]] = {}
    for item in effects:
        if item.id in CATALOGUE and CATALOGUE[item.id].event:
            continue
        for other in seen.setdefault(item.id, []):
            if other is None or item.recordings is None or set(other) & set(item.recordings):
                raise ValueError(f"diagnosis: {item.id} twice in one recording; expected disjoint recordings")
        seen[item.id].append(item.recordings)


@dataclass(frozen=True)
class Residuals:
    """What is left of one axis of one sensor in one recording, in standard deviations of its noise.

    ``t``, ``before`` (of the baseline) and ``after`` (of the final model) are (n,); NaN where a reading was left out.
    ``marks`` are spans (from, to) in s that deserve the eye, beside those of `Located`.
    """

    recording: str
    sensor: str
    axis: str
    t: FloatArray
    before: FloatArray
    after: FloatArray
    marks: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        for name in ("t", "before", "after"):
            array = readonly(getattr(self, name))
            if array.ndim != 1 or array.size != len(self.t):
                raise ValueError(f"residuals: {name} is {array.shape}, expected ({len(self.t)},) as t")
            object.__setattr__(self, name, array)


@dataclass(frozen=True)
class Candidate:
    """A hypothesis in the ranking: what it takes off chi2 when it alone is added, and why it was kept or not.

    ``note`` is a short text for the reader ("named", "no better than chance", "worse on held-out recordings").
    """

    id: str
    gain: float
    parameters: Mapping[str, float] = field(default_factory=dict)
    recordings: Recordings = None
    note: str = ""

    def __post_init__(self) -> None:
        finite(f"candidate {self.id}", gain=self.gain, **self.parameters)
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "id": self.id,
            "recordings": shared(self.recordings),
            "gain": plain(self.gain),
            "parameters": {name: plain(value) for name, value in self.parameters.items()},
            "note": self.note,
        }


@dataclass(frozen=True)
class Outcome:
    """What a diagnosis returns: the answer, and what its report, ``model.toml`` and figures are made of.

    ``candidates`` are in the order of the ranking; ``settings`` are shown as they are.
    """

    diagnosis: Diagnosis
    model: Model
    residuals: tuple[Residuals, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    settings: Mapping[str, str] = field(default_factory=dict)
