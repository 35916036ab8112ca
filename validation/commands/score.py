"""``discsim score``: rates that something computed, a firmware say, against the truth."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from discsim.validation.reporting.options import OutOption

__all__ = ["command"]


def command(
    rates: Annotated[Path, typer.Argument(metavar="RATE.csv", help="time_s and rate_rad_s, rate_deg_s or rate_rpm.")],
    against: Annotated[
        Path, typer.Option(metavar="TRUTH.csv", help="truth.csv, rate_reference.csv, or the like of RATE.csv.")
    ],
    limit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=NUMBER", help="bias, rms, worst, p95 (deg/s), delay (s), known, covered, within; may repeat."
        ),
    ] = None,
    magnitude: Annotated[bool, typer.Option("--magnitude", help="The rates have no sign: compare magnitudes.")] = False,
    junit: Annotated[Path | None, typer.Option(help="Also write the limits as a JUnit XML file.")] = None,
    out: OutOption = Path("score"),
) -> None:
    """Score rates that a firmware computed against the truth.

    Writes score.json, score.png and report.html into --out. Exit status 1 if a limit is exceeded. RATE.csv may have a
    column method, and sd_rad_s; rate.csv of discsim estimate is one. The truth is interpolated to the rates' times.

    Example: discsim score firmware.csv --against table/truth.csv --limit rms=0.5 --limit known=0.95 --junit score.xml
    """
    from discsim.validation.estimating.rate_files import read_rates, read_truth
    from discsim.validation.estimating.scored import score_rates
    from discsim.validation.reporting.options import parse_sizes
    from discsim.validation.reporting.run import start_run
    from discsim.validation.reporting.scores import write_junit

    started = time.monotonic()
    limits = parse_sizes(",".join(limit or ()), "--limit")
    rates, against = _in_folder(rates, "rate.csv"), _in_folder(against, "truth.csv")
    with start_run(out, inputs=[rates, against]):
        found = score_rates(read_rates(rates, magnitude=magnitude), read_truth(against), limits)
        found.report(out)
        if junit is not None:
            write_junit(junit, found.scores, time.monotonic() - started, suite="discsim score")
    typer.echo(found.summary())
    if not found.ok:
        raise typer.Exit(1)


def _in_folder(path: Path, name: str) -> Path:
    """Return the file of that name where ``path`` is a folder that some command wrote, else the path itself."""
    return path / name if path.is_dir() else path
