"""``discsim sweep``: many mounts, parts, fields or throws scored against truth; goes on where it was stopped."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from validation.reporting.options import OutOption

if TYPE_CHECKING:
    import xarray as xr

    from validation.reporting.run import Run
    from validation.tasks import Progress

__all__ = ["command"]

T = TypeVar("T")

#: folder of the results of single tasks, in --out
CHECKPOINTS = "checkpoints"


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
    import numpy as np

    from discsim.errors import InputError
    from validation.reporting.run import package_version, start_run
    from validation.sweeps.chunks import Sweep, chunk_tasks, fly_truth, motion_from, score_chunk, truth_tasks
    from validation.sweeps.figures import draw_sweep
    from validation.sweeps.plan import plan_file, read_plan
    from validation.sweeps.result import labelled, write_netcdf
    from validation.tasks import Task, claim, discard, run_tasks

    if scheduler is not None and workers is not None:
        raise InputError("--workers counts local processes, and --scheduler uses none; expected one of the two")
    path = plan_file(plan)
    asked = read_plan(path, count=mounts, seed=seed)
    folder = out / CHECKPOINTS
    identity = {**asked.identity, "versions": {"discsim": package_version(), "numpy": np.__version__}}
    with start_run(out, asked.seed, [path]) as run:
        if anew:
            discard(folder)
        claim(folder, identity)

        def done(tasks: list[Task], what: str) -> list[Task]:
            there = sum((folder / f"{task.name}.npz").exists() for task in tasks)
            if there:
                run.step(f"{there} of {len(tasks)} {what} are there from an earlier run")
            return tasks

        flown = run_tasks(
            done(truth_tasks(asked), "truth runs"),
            fly_truth,
            folder,
            shared=asked,
            scheduler=scheduler,
            workers=workers,
            progress=_shown(run, "truth run"),
        )
        motions = tuple(motion_from(arrays, asked, number) for number, arrays in enumerate(flown))
        sweep = Sweep(asked, asked.mounts.mounts(asked.seed), motions)
        chunks = run_tasks(
            done(chunk_tasks(asked), "chunks"),
            score_chunk,
            folder,
            shared=sweep,
            scheduler=scheduler,
            workers=workers,
            progress=_shown(run, "chunk"),
        )
        result = labelled(sweep, [chunk["scores"] for chunk in chunks])
        write_netcdf(out / "sweep.nc", result)
        draw_sweep(result, sweep, out / "sweep.png")
        _print(result)


def _shown(run: Run, what: str) -> Progress:
    def progress(items: Iterator[T], total: int) -> Iterator[T]:
        return run.progress(items, total, what)

    return progress


def _print(result: xr.Dataset) -> None:
    """Print each estimator's errors over all that was varied."""
    import numpy as np
    from rich.console import Console
    from rich.table import Table

    table = Table("estimator", "scored", "known", "median rms, deg/s", "95 % below, deg/s", title="errors of the rate")
    for name in result.estimator.values:
        known = result.known.sel(estimator=name).values
        rms = result.rms_deg_s.sel(estimator=name).values
        scored, seen = known[np.isfinite(known)], rms[np.isfinite(rms)]
        figures = [f"{np.median(seen):.3f}", f"{np.quantile(seen, 0.95):.3f}"] if seen.size else ["", ""]
        table.add_row(str(name), str(scored.size), f"{100 * scored.mean():.0f} %", *figures)
    Console().print(table)
