"""``discsim fit``: the yaw damping derivative C_Nr from throws."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from discsim.validation.reporting.options import OutOption

if TYPE_CHECKING:
    from discsim.validation.yaw_damping.fitted import FittedYawDamping

__all__ = ["command"]


def command(
    dataset: Annotated[
        Path, typer.Argument(help="A folder of recordings of one disc, or one recording.", show_default=False)
    ],
    method: Annotated[str, typer.Option(help="Spin rate by this method of `estimate`.")] = "best",
    compare: Annotated[
        bool, typer.Option("--compare/--no-compare", help="Also fit spin by fft and by the accelerometer.")
    ] = True,
    out: OutOption = Path("fit"),
) -> None:
    """Fit C_Nr to the throws of a data set.

    Writes cnr.json (C_Nr by output error, with its standard deviation), cnr_table.csv (the paper's table), model.toml
    (the disc with the fitted C_Nr), model-table.toml (the disc with the paper's table), fit.png, surface.png,
    sources.png and report.html into --out.

    Example: discsim fit practice/calm-evening --out calm-evening-fit
    """
    from discsim.validation.reporting.options import say_note
    from discsim.validation.reporting.run import start_run
    from discsim.validation.running.given import read_given
    from discsim.validation.yaw_damping.fitted import check_method, fit_recordings

    check_method(method)
    recordings = read_given(dataset, say_note)
    with start_run(out, inputs=[dataset]) as run:
        found = fit_recordings(recordings, method, compare=compare, progress=run.progress, say=run.step)
        found.report(out)
    _print(found)


def _print(found: FittedYawDamping) -> None:
    from rich.console import Console
    from rich.table import Table

    typer.echo(found.headline)
    table = Table("spin by", "CNr", "sd", "straight line and (26)")
    for item in found.sources:
        if item.fit is None:
            table.add_row(item.source.label, "", "", item.reason)
        else:
            table.add_row(item.source.label, f"{item.fit.CNr:.6f}", f"{item.fit.sd:.6f}", f"{item.fit.by_26:.6f}")
    Console().print(table)
    for note in found.notes:
        typer.echo(f"note: {note}")
