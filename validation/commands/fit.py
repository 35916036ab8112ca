"""``discsim fit``: the yaw damping derivative C_Nr from throws."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from validation.reporting.options import OutOption

if TYPE_CHECKING:
    from collections.abc import Sequence

    from validation.yaw_damping import Compared, Fit

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
    (the disc with the fitted C_Nr), model-table.toml (the disc with the paper's table), fit.png, surface.png and
    sources.png into --out.

    Example: discsim fit practice/calm-evening --out calm-evening-fit
    """
    from discsim.errors import InputError
    from discsim.files import write_text
    from discsim.model_file import write_model
    from discsim.recording import read_dataset
    from estimators.methods import METHODS
    from validation.reporting.run import start_run
    from validation.yaw_damping import SOURCES, Compared, Source, compare_sources, fit_yaw_damping, observe, paper_table
    from validation.yaw_damping.figures import draw_fit, draw_sources, draw_surface
    from validation.yaw_damping.model import fitted_model, tabulated_model
    from validation.yaw_damping.paper_table import table_csv

    if method != "best" and method not in METHODS:
        raise InputError(f"--method {method}: unknown; expected one of best, {', '.join(METHODS)}")
    recordings = read_dataset(dataset)
    with start_run(out, inputs=[dataset]) as run:
        spins = (observe(recording, method) for recording in recordings)
        throws = list(run.progress(spins, len(recordings), "spin rate of throw"))
        run.step("fitting model flights")
        fit, paper = fit_yaw_damping(throws), paper_table(throws)
        found = [Compared(Source(method), fit, paper)]
        if compare:
            others = [source for source in SOURCES if source != found[0].source]
            found += run.progress(compare_sources(recordings, fit, others), len(others), "other source")
        run.write_json("cnr.json", summary(fit, found))
        write_text(out / "cnr_table.csv", table_csv(paper))
        write_model(fitted_model(recordings[0], fit), out / "model.toml")
        write_model(tabulated_model(recordings[0], paper), out / "model-table.toml")
        draw_fit(throws, fit, paper, out / "fit.png")
        draw_surface(paper, fit, out / "surface.png")
        draw_sources(found, out / "sources.png")
    _print(fit, found)


def summary(fit: Fit, found: Sequence[Compared]) -> dict[str, Any]:
    """Return the content of cnr.json."""
    return {
        "CNr": {"value": fit.CNr, "sd": fit.sd},
        "method": f"output error, spin by {fit.method}",
        "recordings": [throw.name for throw in fit.throws],
        "refined": {name: {"value": value, "sd": sd} for name, (value, sd) in fit.others.items()},
        "residuals": {
            "spin_over_stated": fit.spin_scale,
            "path_over_stated": fit.path_scale,
            "spin_whiteness_p": fit.spin_whiteness.p,
            "path_whiteness_p": fit.path_whiteness.p,
        },
        "by_equation_26": fit.by_26,
        "sources": [
            {"source": item.source.label, "CNr": None, "reason": item.reason}
            if item.fit is None
            else {
                "source": item.source.label,
                "CNr": {"value": item.fit.CNr, "sd": item.fit.sd},
                "by_equation_26": item.fit.by_26,
                "spin_over_stated": item.fit.spin_scale,
            }
            for item in found
        ],
        "notes": notes(fit),
    }


def notes(fit: Fit) -> list[str]:
    """Say where the residuals contradict what the recordings state."""
    found = []
    for what, scale, white in (
        ("spin", fit.spin_scale, fit.spin_whiteness.p),
        ("path", fit.path_scale, fit.path_whiteness.p),
    ):
        if scale > 1.5:
            found.append(f"the {what} is {scale:.1f} times as far from the model as stated; the sd is raised by that")
        if white < 0.001:
            found.append(f"residuals of the {what} are not white (Ljung and Box: p = {white:.1g})")
    if found:
        found.append("the model lacks something, wind perhaps: CNr may be off by more than its sd says")
    return found


def _print(fit: Fit, found: Sequence[Compared]) -> None:
    from rich.console import Console
    from rich.table import Table

    typer.echo(f"CNr = {fit.CNr:.6f} +- {fit.sd:.6f} ({len(fit.throws)} throws, spin by {fit.method})")
    if found:
        table = Table("spin by", "CNr", "sd", "straight line and (26)")
        for item in found:
            if item.fit is None:
                table.add_row(item.source.label, "", "", item.reason)
            else:
                table.add_row(item.source.label, f"{item.fit.CNr:.6f}", f"{item.fit.sd:.6f}", f"{item.fit.by_26:.6f}")
        Console().print(table)
    for note in notes(fit):
        typer.echo(f"note: {note}")
