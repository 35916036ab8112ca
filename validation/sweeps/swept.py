"""`sweep` and what it gives: the scores of a plan as labelled arrays, their summary and their files."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from discsim.result import Result, require
from discsim.validation.reporting.run import package_version
from discsim.validation.running.progress import Progress, silent
from discsim.validation.running.tasks import Task, claim, discard, idle_cores, run_tasks
from discsim.validation.sweeps.cases import landing_of, rows_of, write_rows
from discsim.validation.sweeps.chunks import Sweep, chunk_tasks, fly_truth, motion_from, score_chunk, truth_tasks
from discsim.validation.sweeps.figures import draw_sweep
from discsim.validation.sweeps.page import write_sweep_page
from discsim.validation.sweeps.plan import Plan, plan_file, read_plan
from discsim.validation.sweeps.result import labelled, write_netcdf
from discsim.validation.sweeps.shares import draw_shares, shares_of, write_shares
from discsim.validation.sweeps.tolerance import Tolerance, tolerances_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["CHECKPOINTS", "Swept", "error_rows", "sweep"]


#: folder of the results of single tasks, in the folder of a sweep
CHECKPOINTS = "checkpoints"


@dataclass(frozen=True, repr=False)
class Swept(Result):
    """A finished sweep.

    Attributes
    ----------
    scores : xarray.Dataset
        ``bias_deg_s``, ``rms_deg_s``, ``worst_deg_s`` and ``known`` over estimator, the plan's axes, mount and segment;
        ``rate_deg_s`` and ``closed_form_deg_s`` beside them.
    sweep : Sweep
        The plan, its mounts (count, 6), and the true motions.
    """

    scores: xr.Dataset
    sweep: Sweep

    def __repr__(self) -> str:
        sizes = ", ".join(f"{name} {size}" for name, size in self.scores.sizes.items())
        return f"<Swept: plan '{self.sweep.plan.name}', {sizes}>"

    def summary(self) -> str:
        """Return each estimator's errors over all that was varied, a line each."""
        return "\n".join(
            f"{name}: {scored} scored, {known} known, rms {median or '?'} deg/s (median), 95 % below {most or '?'}"
            for name, scored, known, median, most in error_rows(self.scores)
        )

    def table(self) -> dict[str, Any]:
        """Return a row for each estimator, case, mount and segment: what was varied, and the scores."""
        frame = self.scores.to_dataframe().reset_index()
        return {str(name): frame[name].to_numpy() for name in frame}

    def to_xarray(self) -> xr.Dataset:
        """Return the scores."""
        return self.scores

    def plot(self) -> Figure:
        """Return the figure of sweep.png."""
        return draw_sweep(self.scores, self.sweep)

    def report(self, folder: Path | str) -> Path:
        """Write sweep.nc (netCDF), cases.csv and cases.md, sweep.png and report.html; return the path of the first.

        Of a saltelli design also the shares of variance, shares.csv and shares.png.
        """
        out = Path(folder)
        out.mkdir(parents=True, exist_ok=True)
        write_netcdf(out / "sweep.nc", self.scores)
        rows = rows_of(self.scores, landing_of())
        write_rows(out, rows)
        draw_sweep(self.scores, self.sweep, out / "sweep.png")
        if shares := shares_of(self.scores, self.sweep):
            write_shares(out / "shares.csv", shares)
            draw_shares(shares, out / "shares.png")
        else:
            (out / "shares.png").unlink(missing_ok=True)  # of an earlier run into this folder
        varied = ", ".join(f"{size} of {name}" for name, size in self.scores.sizes.items())
        write_sweep_page(out, self.sweep.plan.name, varied, error_rows(self.scores), rows)
        return out / "sweep.nc"

    def tolerances(self, below: float) -> list[Tolerance]:
        """Return what each case allows for 95 % of all mounts to err by less than a share of the rate."""
        return tolerances_of(self.scores, self.sweep, below)


def error_rows(scores: xr.Dataset) -> list[tuple[str, str, str, str, str]]:
    """Return a row for each estimator: name, estimates scored, share known, median and 95th percentile of its rms."""
    rows = []
    for name in scores.estimator.values:
        known = scores.known.sel(estimator=name).values
        rms = scores.rms_deg_s.sel(estimator=name).values
        scored, seen = known[np.isfinite(known)], rms[np.isfinite(rms)]
        median, most = (f"{np.median(seen):.3f}", f"{np.quantile(seen, 0.95):.3f}") if seen.size else ("", "")
        rows.append((str(name), str(scored.size), f"{100 * scored.mean():.0f} %", median, most))
    return rows


def sweep(
    plan: Plan | Path | str,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    checkpoints: Path | None = None,
    anew: bool = False,
    progress: Progress = silent,
    say: Callable[[str], None] = lambda text: None,
) -> Swept:
    """Score estimators over every combination of a plan's axes and mounts, on one truth run for all mounts.

    Parameters
    ----------
    plan
        A shipped plan's name, a TOML file, or a `Plan` (`discsim.validation.sweeps.plan.read_plan` takes a number of
        mounts and a seed).
    scheduler, workers
        Address of a running Dask scheduler, or the number of local processes; 1 works in this one.
    checkpoints : Path, optional
        Folder of finished chunks: a sweep that was stopped goes on there. By default none is kept.
    anew : bool
        Whether to throw away what an earlier sweep left there.

    Raises
    ------
    InputError
        For a plan that cannot be read, for checkpoints of another plan, and where xarray (the extra tables) is not
        installed.
    """
    require("xarray", "sweep", "tables")
    asked = plan if isinstance(plan, Plan) else read_plan(plan_file(plan))
    identity = {**asked.identity, "versions": {"discsim": package_version(), "numpy": np.__version__}}
    with ExitStack() as stack:
        folder = checkpoints or Path(stack.enter_context(TemporaryDirectory()))
        if anew:
            discard(folder)
        claim(folder, identity)
        for note in (*asked.notes, *filter(None, [idle_cores(scheduler, workers)])):
            say(note)

        def run(tasks: list[Task], what: str, function: Callable[..., Any], shared: object) -> list[Any]:
            there = sum((folder / f"{task.name}.npz").exists() for task in tasks)
            if there:
                say(f"{there} of {len(tasks)} {what}s are there from an earlier run")
            return run_tasks(
                tasks,
                function,
                folder,
                shared=shared,
                scheduler=scheduler,
                workers=workers,
                progress=lambda items, total: progress(items, total, what),
            )

        flown = run(truth_tasks(asked), "truth run", fly_truth, asked)
        motions = tuple(motion_from(arrays, asked, number) for number, arrays in enumerate(flown))
        whole = Sweep(asked, asked.mounts.mounts(asked.seed), motions)
        chunks = run(chunk_tasks(asked), "chunk", score_chunk, whole)
    return Swept(labelled(whole, [chunk["scores"] for chunk in chunks]), whole)
