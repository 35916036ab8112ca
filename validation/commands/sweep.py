"""``discsim sweep``: many mounts, parts, fields or throws scored against truth; goes on where it was stopped."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from validation.reporting.options import OutOption

if TYPE_CHECKING:
    import xarray as xr

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
    out: OutOption = Path("sweep"),
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of everything random. Default: the plan's.")] = None,
) -> None:
    """Score estimators over every combination of a plan's axes and mounts, on one truth run for all mounts.

    Writes sweep.nc (labelled arrays, netCDF) and sweep.png into --out. Each finished chunk is kept in
    --out/checkpoints: stopped at any moment, the same command goes on and gives the same bytes.

    Example: discsim sweep installation --mounts 4096 --out sweep
    """
    from discsim.errors import InputError
    from validation.reporting.run import start_run
    from validation.sweeps.plan import plan_file, read_plan
    from validation.sweeps.swept import CHECKPOINTS, sweep

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


def _print(scores: xr.Dataset) -> None:
    """Print each estimator's errors over all that was varied."""
    from rich.console import Console
    from rich.table import Table

    from validation.sweeps.swept import error_rows

    table = Table("estimator", "scored", "known", "median rms, deg/s", "95 % below, deg/s", title="errors of the rate")
    for row in error_rows(scores):
        table.add_row(*row)
    Console().print(table)
