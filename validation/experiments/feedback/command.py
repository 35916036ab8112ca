"""``discsim study feedback``: the paper's Figs. 11 and 13 on our truth, with scores."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import typer

from discsim.shipped import load_throw
from discsim.validation.experiments.feedback.experiment import Experiment, run_experiment
from discsim.validation.experiments.feedback.figures import draw_fig_11, draw_fig_13, draw_what_matters
from discsim.validation.experiments.feedback.scoring import Predicted, feedback_checks
from discsim.validation.experiments.feedback.sensitivity import CHANGES, touch_down_shifts
from discsim.validation.reporting.options import OutOption, SeedOption
from discsim.validation.reporting.run import Run, start_run
from discsim.validation.reporting.scores import at_most
from discsim.validation.yaw_damping.figures import draw_sources

__all__ = ["command"]


def command(out: OutOption = Path("feedback"), seed: SeedOption = 0) -> None:
    """Fit C_Nr to eight throws by every source of spin, and predict three flights with what each source gives.

    Writes fig-11.png, fig-13-*.png, sources.png, what-matters.png, feedback.json and scores.json into --out. The
    paper's release is models/throws/paper.toml.

    Example: discsim study feedback --out feedback
    """
    with start_run(out, seed) as run:
        _write(run, run_experiment(run))


def _write(run: Run, experiment: Experiment) -> None:
    assert experiment.disc.aero is not None
    truth = experiment.disc.aero.CNr
    fit = experiment.fit
    scores = [at_most("C_Nr: error with the best spin on eight throws", 100 * (fit.CNr / truth - 1), "%", 1.0)]
    for flown in experiment.flown:
        scores += feedback_checks(flown.name, flown.predicted)
    names = ("paper", "driver")
    shifts = [touch_down_shifts(experiment.disc, experiment.environment, load_throw(name), CHANGES) for name in names]
    damping, spin = (np.array([getattr(shift, key) for shift in shifts]) for key in ("damping", "spin"))
    run.write_json("scores.json", [item.as_dict() for item in scores])
    run.write_json(
        "feedback.json",
        {
            "true_CNr": truth,
            "sources": [
                {"source": item.source.label, "CNr": item.fit.CNr, "sd": item.fit.sd, "by_equation_26": item.fit.by_26}
                for item in experiment.found
                if item.fit is not None
            ],
            "predicted": {flown.name: [_figures(item) for item in flown.predicted] for flown in experiment.flown},
            "touch_down_shift_m": {
                "change": CHANGES,
                **{name: {"CNr": a, "spin": b} for name, a, b in zip(names, damping, spin, strict=True)},
            },
        },
    )
    draw_fig_11(experiment, run.out / "fig-11.png")
    for flown in experiment.flown:
        draw_fig_13(flown, run.out / f"fig-13-{flown.name.split()[0].removesuffix(chr(39) + 's')}.png")
    draw_sources(experiment.found, run.out / "sources.png")
    draw_what_matters(CHANGES, damping, spin, names, run.out / "what-matters.png")
    for flown in experiment.flown:
        _print(flown.name, flown.predicted)
    for score in scores:
        typer.echo(score.text)


def _figures(item: Predicted) -> dict[str, Any]:
    return {
        "source": item.damping.source,
        "way": item.damping.way,
        "CNr": item.damping.CNr,
        "spin_at_release_deg_s": np.degrees(item.rate),
        "landing_error_m": item.landing,
        "track_error_m": item.track,
        "end_rate_error_deg_s": np.degrees(item.end_rate),
        "landing_error_by_CNr_alone_m": item.damping_only,
        "reason": item.reason,
    }


def _print(name: str, predicted: tuple[Predicted, ...]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("source", "way", "CNr", "r0, deg/s", "landing, m", "track, m", "by CNr alone, m", title=name)
    for item in predicted:
        figures = (f"{item.landing:.3f}", f"{item.track:.3f}", f"{item.damping_only:.3f}")
        cells = figures if item.flight is not None else ("outside the table", "", "")
        CNr = f"{item.damping.CNr:.6f}" if item.damping.table is None else "table"
        table.add_row(item.damping.source, item.damping.way, CNr, f"{np.degrees(item.rate):.1f}", *cells)
    Console(width=120).print(table)
