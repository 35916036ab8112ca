"""What a challenge leaves of each case once its answer is opened, and the file that keeps it."""

from __future__ import annotations

import gzip
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from discsim.errors import InputError
from discsim.validation.challenge.cases.conceal import Answer
from discsim.validation.challenge.scores.scoring import CaseScore, Rate, score_case, summary

__all__ = [
    "RESULT",
    "Result",
    "Scored",
    "Times",
    "both_times",
    "processor_times",
    "rates_of",
    "read_result",
    "result_file",
    "times",
]

#: the file of a challenge's result
RESULT = "challenge.json"


@dataclass(frozen=True)
class Scored:
    """One case, opened: its answer, the diagnosis (None where there is none), its score, time and detection limit.

    ``sizes`` holds each concealed effect of the catalogue in units of the smallest that can be seen, by id, ``apart``
    the same in units of the smallest that is told from other effects of its sensor (empty in older files);
    ``reproduce`` is the command that does this case alone. ``cpu_seconds`` are None in files of older versions.
    """

    answer: Answer
    diagnosis: dict[str, Any] | None
    score: CaseScore
    error: str | None
    seconds: float
    recordings_sha256: str
    sizes: Mapping[str, float] = field(default_factory=dict)
    reproduce: str = ""
    cpu_seconds: float | None = None
    apart: Mapping[str, float] = field(default_factory=dict)

    @property
    def told(self) -> float | None:
        """The least of the concealed sizes in units of that at which it is told from others; None where not known."""
        return min(self.apart.values(), default=None)

    @property
    def strength(self) -> float | None:
        """The least of the concealed sizes in units of its limit; None where nothing of the catalogue is concealed."""
        return min(self.sizes.values(), default=None)

    def to_json(self) -> dict[str, Any]:
        """Return the entry of ``challenge.json``."""
        answer = self.answer
        return {
            "seed": answer.seed,
            "reproduce": self.reproduce,
            "answer": {
                "verdict": answer.verdict,
                "effects": list(answer.effects),
                "recordings": "all" if answer.recordings is None else list(answer.recordings),
                "parameters": answer.parameters,
                "moved": answer.moved,
                "law": answer.law,
                "setting": answer.setting,
                "equivalents": [list(one) for one in answer.equivalents],
                "plant": answer.plant,
                "kind": answer.kind,
            },
            "diagnosis": self.diagnosis,
            "right": self.score.right,
            "score": self.score.to_json(),
            "size_over_limit": self.strength,
            "sizes_over_limit": dict(self.sizes),
            "sizes_told_apart": dict(self.apart),
            "error": self.error,
            "seconds": self.seconds,
            "cpu_seconds": self.cpu_seconds,
            "recordings_sha256": self.recordings_sha256,
        }

    @classmethod
    def from_json(cls, entry: Mapping[str, Any]) -> Scored:
        """Return the case of an entry of ``challenge.json``, scored anew."""
        told = dict(entry["answer"])
        only, alike = told.pop("recordings"), told.pop("equivalents", ())
        answer = Answer(
            seed=entry["seed"],
            effects=tuple(told.pop("effects")),
            recordings=None if only == "all" else tuple(only),
            equivalents=tuple((id, axes) for id, axes in alike),
            **told,
        )
        return cls.opened(
            answer,
            entry["diagnosis"],
            error=entry["error"],
            seconds=entry["seconds"],
            cpu_seconds=entry.get("cpu_seconds"),
            recordings_sha256=entry["recordings_sha256"],
            sizes=entry["sizes_over_limit"],
            apart=entry.get("sizes_told_apart", {}),
            reproduce=entry["reproduce"],
        )

    @classmethod
    def opened(cls, answer: Answer, diagnosis: dict[str, Any] | None, *, error: str | None, **told: Any) -> Scored:
        """Return the scored case; a diagnosis that breaks its contract is no answer, and the ``error`` says why.

        ``told`` are the other fields.
        """
        try:
            return cls(answer, diagnosis, score_case(answer, diagnosis), error, **told)
        except InputError as fault:
            return cls(answer, None, score_case(answer, None), str(fault), **told)


class Times(NamedTuple):
    """Seconds that diagnoses took: the median, what nine in ten do not exceed, the longest."""

    median_s: float
    nine_in_ten_s: float
    longest_s: float

    @property
    def text(self) -> str:
        """The three in words."""
        most = f"nine in ten within {self.nine_in_ten_s:.0f} s, longest {self.longest_s:.0f} s"
        return f"{self.median_s:.0f} s (median), {most}"


def _times(seconds: Sequence[float]) -> Times:
    if not seconds:
        return Times(float("nan"), float("nan"), float("nan"))
    return Times(*(float(np.quantile(seconds, share)) for share in (0.5, 0.9, 1.0)))


def times(scored: Sequence[Scored]) -> Times:
    """Return how long the diagnoses took by the clock, with an answer or without; NaN of none."""
    return _times([item.seconds for item in scored])


def processor_times(scored: Sequence[Scored]) -> Times:
    """Return how long they kept processors busy; NaN where that is not known."""
    return _times([item.cpu_seconds for item in scored if item.cpu_seconds is not None])


def both_times(scored: Sequence[Scored]) -> str:
    """Return in words how long the diagnoses took by the clock and, where it is known, of the processors."""
    busy = processor_times(scored)
    by_clock = f"{times(scored).text} by the clock"
    return by_clock if np.isnan(busy.median_s) else f"{by_clock}; of processor time {busy.text}"


def rates_of(scored: Sequence[Scored]) -> dict[str, Rate]:
    """Return the shares that the challenge is judged by."""
    cases = [(item.answer, item.diagnosis, item.score) for item in scored]
    return summary(cases, [item.strength for item in scored], [item.told for item in scored])


class Result(NamedTuple):
    """A finished challenge: the command that gave it, version and code, what was put over every case, the cases.

    ``parts`` are the challenges that were pooled in it; none where it is one.
    """

    command: str
    version: str
    code: str
    mask: str | None
    scored: list[Scored]
    parts: tuple[Result, ...] = ()

    @property
    def seeds(self) -> tuple[int, int]:
        """First and last seed."""
        numbers = [item.answer.seed for item in self.scored]
        return min(numbers), max(numbers)

    def pooled(self, *others: Result) -> Result:
        """Return this challenge and others of the same code, mask and version as one; raises `InputError` otherwise."""
        if not others:
            return self
        parts = (self, *others)
        for k, part in enumerate(parts):
            if (part.version, part.code, part.mask) != (self.version, self.code, self.mask):
                raise InputError(
                    f"{part.command}: of discsim {part.version}, code {part.code[:12]}, mask {part.mask}; expected "
                    f"{self.version}, {self.code[:12]} and {self.mask}, to count in one table"
                )
            known = {item.answer.seed for other in parts[:k] for item in other.scored}
            if twice := known & {item.answer.seed for item in part.scored}:
                raise InputError(f"{part.command}: {len(twice)} seeds are there already, the first {min(twice)}")
        return self._replace(scored=[item for part in parts for item in part.scored], parts=parts)


def result_file(place: Path) -> Path:
    """Return the file of a finished challenge, which is named itself or by its folder."""
    return place / RESULT if place.is_dir() else place


def read_result(place: Path) -> Result:
    """Read what `discsim.validation.challenge.run.challenge` left: its folder, or its file, which may be gzipped.

    Raises `InputError` where it is not there or cannot be read.
    """
    file = result_file(place)
    try:
        content = file.read_bytes()
        kept = json.loads(gzip.decompress(content) if file.suffix == ".gz" else content)
        scored = [Scored.from_json(entry) for entry in kept["cases"]]
        return Result(kept["made_by"], kept["version"], kept["code_sha256"], kept["mask"], scored)
    except FileNotFoundError:
        raise InputError(f"{file}: is not there; expected the folder of a finished discsim challenge") from None
    except (OSError, EOFError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{file}: cannot be read ({type(error).__name__}: {error}); expected what discsim challenge of this "
            "version wrote (the same command writes it again from its checkpoints)"
        ) from None
