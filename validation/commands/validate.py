"""``discsim validate``: the main job, headless. Everything is run, scored against truth, and reported."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from discsim.errors import InputError
from validation.reporting.options import OutOption, SeedOption

__all__ = ["command"]


def command(
    quick: Annotated[bool, typer.Option("--quick", help="A shorter profile and fewer throws.")] = False,
    junit: Annotated[Path | None, typer.Option(help="Also write the scores as a JUnit XML file.")] = None,
    out: OutOption = Path("validation-report"),
    seed: SeedOption = 0,
) -> None:
    """Run the rate table and a set of throws, score every estimator against truth, and write a report.

    Writes scores.json, report.html and figures into --out. Exit status 1 if a score is outside its tolerance.

    Example: discsim validate --quick --junit scores.xml --out validation-report
    """
    from validation.experiments.validation_run import validate
    from validation.reporting.run import start_run
    from validation.reporting.scores import all_ok

    if junit is not None and (junit.is_dir() or junit.parent.is_file()):
        raise InputError(f"--junit {junit}: is no place for a file; expected the name of one")
    with start_run(out, seed) as run:
        scores = validate(run, quick=quick, junit=junit)
    for item in scores:
        typer.echo(item.text)
    failed = sum(not item.ok for item in scores)
    typer.echo(f"{len(scores) - failed} of {len(scores)} scores within tolerance; report: {out / 'report.html'}")
    if not all_ok(scores):
        raise typer.Exit(1)
