"""The challenge from one end to the other: seal, diagnose blind (resumable, over Dask), open, score, report."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import discsim
from validation.challenge.blind import DIAGNOSE, Request, diagnose_blind, open_answers, seal_answers
from validation.challenge.conceal import Answer
from validation.challenge.page import write_page
from validation.challenge.scoring import CaseScore, Rate, score_case, summary
from validation.challenge.strength import strength
from validation.run import Run, package_version
from validation.sweeps.execution import Task, claim, discard, run_tasks

__all__ = ["Scored", "challenge", "limit_of"]

#: folder of what is done, in --out
CHECKPOINTS = "checkpoints"


@dataclass(frozen=True)
class Scored:
    """One case, opened: its answer, the diagnosis (None where there is none), its score, time and detection limit.

    ``strength`` is the concealed size in units of the smallest that can be seen (the least of several); None where
    nothing, or nothing of the catalogue, is concealed.
    """

    answer: Answer
    diagnosis: dict[str, Any] | None
    score: CaseScore
    error: str | None
    seconds: float
    recordings_sha256: str
    strength: float | None

    def to_json(self) -> dict[str, Any]:
        """Return the entry of ``challenge.json``."""
        answer = self.answer
        return {
            "seed": answer.seed,
            "answer": {
                "verdict": answer.verdict,
                "effects": list(answer.effects),
                "recordings": "all" if answer.recordings is None else list(answer.recordings),
                "parameters": answer.parameters,
                "moved": answer.moved,
                "law": answer.law,
                "plant": answer.plant,
                "kind": answer.kind,
            },
            "diagnosis": self.diagnosis,
            "right": self.score.right,
            "score": self.score.to_json(),
            "size_over_limit": self.strength,
            "error": self.error,
            "seconds": self.seconds,
            "recordings_sha256": self.recordings_sha256,
        }


def challenge(
    run: Run,
    requests: Sequence[Request],
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    anew: bool = False,
    command: Sequence[str] | None = None,
) -> tuple[list[Scored], dict[str, Rate]]:
    """Put the diagnosis to the test; write ``challenge.json`` and ``report.html`` into the run's folder.

    ``command`` is another command that diagnoses (its folder of recordings and ``--out DIR`` are appended). What is
    done is kept in ``checkpoints`` of the run's folder and not done again.
    """
    folder = run.out / CHECKPOINTS
    if anew:
        discard(folder)
        (run.out / "sealed.json").unlink(missing_ok=True)
    versions = {"discsim": package_version(), "numpy": np.__version__, "code": code_digest()}
    claim(folder, {"cases": [list(request) for request in requests], "command": command, "versions": versions})
    seal_answers(requests, run.out)
    run.step(f"{len(requests)} answers are sealed; their digests stand in {run.out / 'sealed.json'}")
    tasks = [Task(request.name, tuple(request)) for request in requests]
    done = sum((folder / f"{task.name}.json").exists() for task in tasks)
    if done:
        run.step(f"{done} of {len(tasks)} cases are there from an earlier run")
    results = run_tasks(
        tasks,
        diagnose_blind,
        folder,
        shared=list(command) if command else None,
        scheduler=scheduler,
        workers=workers,
        progress=lambda items, total: run.progress(items, total, "case"),
    )
    limits = run_tasks(
        [Task(f"limit-{request.seed:05d}", tuple(request)) for request in requests],
        limit_of,
        folder,
        scheduler=scheduler,
        workers=workers,
        progress=lambda items, total: run.progress(items, total, "limit"),
    )
    scored = [
        Scored(
            answer,
            result["diagnosis"],
            score_case(answer, result["diagnosis"]),
            result["error"],
            result["seconds"],
            result["recordings_sha256"],
            limit["strength"],
        )
        for answer, result, limit in zip(open_answers(requests, run.out), results, limits, strict=True)
    ]
    rates = summary([(item.answer, item.diagnosis, item.score) for item in scored], [item.strength for item in scored])
    run.write_json(
        "challenge.json",
        {
            "command": list(command or DIAGNOSE[1:]),
            "version": package_version(),
            "cases": [item.to_json() for item in scored],
            "summary": {name: value.to_json() for name, value in rates.items()},
        },
    )
    write_page(run.out, scored, rates)
    return scored, rates


def code_digest() -> str:
    """Return the SHA-256 of the simulation, the diagnosis and this test: a result of other code is no result of it."""
    total = hashlib.sha256()
    here = Path(__file__).parents[1]
    for folder in (Path(discsim.__file__).parent, here / "diagnosis", here / "challenge"):
        for file in sorted(folder.rglob("*.py")):
            total.update(str(file.relative_to(folder)).encode() + b"\0" + file.read_bytes() + b"\0")
    return total.hexdigest()


def limit_of(request: tuple[Any, ...], shared: Any) -> dict[str, float | None]:
    """Return how far above its detection limit a case's smallest concealed effect is."""
    return {"strength": strength(Request(*request).draw())}
