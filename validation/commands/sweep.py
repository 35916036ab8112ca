"""``discsim sweep``: many mounts, parts, fields or throws scored against truth; goes on where it was stopped."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from discsim.validation.reporting.options import OutOption

if TYPE_CHECKING:
    import xarray as xr

    from discsim.validation.sweeps.swept import Swept

__all__ = ["command"]


def command(
    plan: Annotated[str, typer.Argument(help="A shipped plan's name (installation, ...), or a TOML plan.")],
    mounts: Annotated[int | None, typer.Option(min=1, help="Number of mounts. Default: the plan's.")] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a running Dask scheduler. Default: local processes.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Local processes; 1 works in this one. Default: one per core.")
    ] = None,
    anew: Annotated[bool, typer.Option("--anew", help="Throw away what an earlier sweep left in --out.")] = False,
    below: Annotated[
        float | None,
        typer.Option(min=0.01, max=50.0, help="Also tell which tolerance of mount keeps the error below so many %."),
    ] = None,
    out: OutOption = Path("sweep"),
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of everything random. Default: the plan's.")] = None,
) -> None:
    """Score estimators over many mounts, parts, fields or throws.

    Every combination of a plan's axes and mounts is scored, on one truth run for all mounts.
    Writes report.html, sweep.nc (labelled arrays, netCDF), cases.csv and cases.md (a row for each combination and
    rate) and sweep.png into --out; of a saltelli plan shares.csv and shares.png (which error of the mount makes the
    scatter), with --below tolerances.csv, tolerances.md and tolerances.png. Each finished chunk is kept in
    --out/checkpoints: stopped at any moment, the same command goes on and gives the same bytes.

    Example: discsim sweep installation --mounts 4096 --below 1 --out sweep
    """
    from discsim.errors import InputError
    from discsim.validation.reporting.run import start_run
    from discsim.validation.sweeps.plan import plan_file, read_plan
    from discsim.validation.sweeps.swept import CHECKPOINTS, sweep

    if scheduler is not None and workers is not None:
        raise InputError("--workers counts local processes, and --scheduler uses none; expected one of the two")
    path = plan_file(plan)
    asked = read_plan(path, count=mounts, seed=seed)
    with start_run(out, asked.seed, [path]) as run:
        found = sweep(
            asked,
            scheduler=scheduler,
            workers=workers,
            checkpoints=out / CHECKPOINTS,
            anew=anew,
            progress=run.progress,
            say=run.step,
        )
        found.report(out)
    _print(found.scores)
    if below is not None:
        _tell(found, below / 100.0, out)


def _tell(found: Swept, below: float, out: Path) -> None:
    """Write and say which tolerance of mount stays below a share of the rate."""
    from discsim.validation.sweeps.tolerance import draw_tolerances, sentences_of, write_tolerances

    if not found.sweep.plan.mounts.varies:
        typer.echo("the plan varies no mount, so that no tolerance is told; expected a range in [mounts], such as x_m")
        return
    told = found.tolerances(below)
    if not told:
        typer.echo("no estimator was scored on enough mounts to tell a tolerance; expected 56 or more")
        return
    write_tolerances(out, told, below)
    draw_tolerances(told, below, out / "tolerances.png")
    for line in sentences_of(told, below):
        typer.echo(line)


def _print(scores: xr.Dataset) -> None:
    """Print each estimator's errors over all that was varied."""
    from rich.console import Console
    from rich.table import Table

    from discsim.validation.sweeps.swept import error_rows

    table = Table("estimator", "scored", "known", "median rms, deg/s", "95 % below, deg/s", title="errors of the rate")
    for row in error_rows(scores):
        table.add_row(*row)
    Console().print(table)
