"""The challenge from one end to the other: seal, diagnose blind (resumable, over Dask), open, score, report."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import discsim
from discsim.files import digest, model_file, model_names, write_text
from discsim.validation.challenge.blind import DIAGNOSE, Request, diagnose_blind, open_answers, seal_answers
from discsim.validation.challenge.cases.detection_limit import sizes_and_apart
from discsim.validation.challenge.report.page import write_page
from discsim.validation.challenge.scores.detection import detections, fit_curve
from discsim.validation.challenge.scores.result import RESULT, Scored, processor_times, rates_of, times
from discsim.validation.reporting.run import Run, json_text, package_version, source_digest
from discsim.validation.running.tasks import Task, claim, discard, idle_cores, run_tasks

__all__ = ["challenge", "code_digest", "limit_of", "write_challenge"]

#: folder of what is done, in --out
CHECKPOINTS = "checkpoints"
#: what is done with finished cases: a change of it is no reason to do them again
_AFTERWARDS = ("__init__.py", "challenged.py", "masks.py", "report", "run.py", "scores")


def challenge(
    run: Run,
    requests: Sequence[Request],
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    anew: bool = False,
    command: Sequence[str] | None = None,
) -> list[Scored]:
    """Put the diagnosis to the test; write ``challenge.json`` and ``report.html`` into the run's folder.

    ``command`` is another command that diagnoses (its folder of recordings and ``--out DIR`` are appended). What is
    done is kept in ``checkpoints`` of the run's folder and not done again.
    """
    folder = run.out / CHECKPOINTS
    if anew:
        discard(folder)
        (run.out / "sealed.json").unlink(missing_ok=True)
    others = {name: version(name) for name in ("mujoco", "numba", "numpy", "scipy")}
    versions = {"discsim": package_version(), **others, "code": code_digest()}
    # each case belongs to its seed: more of them may be asked for later, all drawn in the same way
    drawn = sorted({json.dumps(request[1:]) for request in requests})
    claim(folder, {"drawn": drawn, "command": command, "versions": versions})
    seal_answers(requests, run.out)
    run.step(f"{len(requests)} answers are sealed; their digests stand in {run.out / 'sealed.json'}")
    if note := idle_cores(scheduler, workers):
        run.step(note)
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
        Scored.opened(answer, **result, sizes=limit["sizes"], apart=limit["apart"], reproduce=request.command)
        for request, answer, result, limit in zip(
            requests, open_answers(requests, run.out), results, limits, strict=True
        )
    ]
    write_challenge(run.out, scored, requests[0].mask, run.command, command)
    return scored


def write_challenge(
    out: Path, scored: Sequence[Scored], mask: str | None, made_by: Sequence[str], command: Sequence[str] | None = None
) -> None:
    """Write ``challenge.json`` and ``report.html`` of scored cases into ``out``; ``command`` diagnosed them."""
    curve = fit_curve(detections(scored))
    content = {
        "command": list(command or DIAGNOSE[1:]),
        "made_by": " ".join(["discsim", *made_by]),
        "version": package_version(),
        "code_sha256": code_digest(),
        "mask": mask,
        "cases": [item.to_json() for item in scored],
        "summary": {name: value.to_json() for name, value in rates_of(scored).items()},
        "half_detection": curve._asdict() if curve is not None else None,
        "seconds": times(scored)._asdict(),
        "cpu_seconds": processor_times(scored)._asdict(),
    }
    write_text(out / RESULT, json_text(content))
    write_page(out, scored)


def code_digest() -> str:
    """Return the SHA-256 of simulation, diagnosis, concealment and their models: a result of others is no result of it.

    Models are the discs and parts that cases are drawn with, and the ordinary errors by which twins are told.
    """
    here = Path(__file__).parents[1]
    places = [here / "challenge" / name for name in _AFTERWARDS]
    afterwards = {file for place in places for file in (place.rglob("*.py") if place.is_dir() else [place])}
    rooms = ("rows", "identification", "diagnosis", "challenge")
    folders = (Path(discsim.__file__).parent, *(here / name for name in rooms))
    files = (here / "scenarios" / "throws.py", here / "commands" / "diagnose.py")
    code = source_digest(*folders, *files, without=afterwards)
    read = [f"{folder}/{name}.toml" for folder in ("discs", "parts") for name in model_names(folder)]
    models = [digest(model_file(name)) for name in (*read, "priors.toml")]
    return hashlib.sha256("".join((code, *models)).encode()).hexdigest()


def limit_of(request: tuple[Any, ...], shared: Any) -> dict[str, dict[str, float]]:
    """Return how far a case's concealed effects are above what can be seen of them, and what is told from others."""
    seen, told = sizes_and_apart(Request(*request).draw())
    return {"sizes": seen, "apart": told}
