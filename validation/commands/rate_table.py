"""``discsim rate-table``: a rate-table run in MuJoCo with all sensors on it, estimated by every method."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from validation.reporting.options import (
    EffectOption,
    ModelOption,
    OutOption,
    SeedOption,
    SiteOption,
    WithOption,
    all_effects,
    at_site,
    laws_upon,
    parse_vector,
)

if TYPE_CHECKING:
    from validation.scenarios.rate_table import Plateau

__all__ = ["command"]


def command(
    profile: Annotated[
        Path | None,
        typer.Option(help="CSV of knots, time_s,rate_rad_s or time_s,rate_deg_s. Default: 0 to 5000 deg/s in steps."),
    ] = None,
    mount: Annotated[
        str, typer.Option(help="Installation error dx,dy,dz of the accelerometer in m, added to its stated place.")
    ] = "0,0,0",
    model: ModelOption = None,
    site: SiteOption = None,
    effect: EffectOption = None,
    own: WithOption = None,
    out: OutOption = Path("rate-table"),
    seed: SeedOption = 0,
) -> None:
    """Turn a rate table through a profile and score every method against the truth.

    Writes a recording folder (MPU-9250 and the table's read-out), the wide-range gyroscope's recording in adxrs649/,
    truth.csv, plateaus.csv, scores.json, methods.png (the paper's Fig. 7) and waveform.png (a second of the
    fastest plateau, and the spectrum of one padded window) into --out.

    Example: discsim rate-table --mount 0.001,0.001,0 --out rate-table
    """
    from discsim.effects.own import load_user_effects
    from discsim.environment import Environment
    from discsim.model_file import read_model
    from discsim.recording import write_recording
    from discsim.rig import default_profile, read_profile
    from validation.reporting.run import start_run
    from validation.reporting.truth import write_rate_truth
    from validation.scenarios.rate_table import (
        plateau_table,
        plateaus,
        rate_table_checks,
        run_rate_table,
        write_plateaus,
    )
    from validation.scenarios.rate_table_figures import draw_methods, draw_waveform

    knots = default_profile() if profile is None else read_profile(profile)
    offset = parse_vector(mount, "--mount", "m", 0.05)
    sensors = ("magnetometer", "accelerometer", "gyroscope", "rate_reference")
    mine = load_user_effects(own or [])
    stated = read_model(model, mine) if model is not None else None
    effects, notes = all_effects(stated, effect, "rate_table", sensors, out.resolve().name, mine)
    laws, passed = laws_upon(stated, "rate_table", sensors)
    for note in (*notes, *passed):
        typer.echo(note)
    surroundings = Environment() if stated is None else stated.environment
    inputs = [
        path for path in (profile, model, *(own or []), Path(site) if site and site.endswith(".toml") else None) if path
    ]
    with start_run(out, seed, inputs) as run:
        run.step("turning the table and measuring")
        result = run_rate_table(
            knots,
            at_site(surroundings, site),
            run.rng,
            mount=offset,
            effects=tuple(effects),
            laws=tuple(laws),
            name=out.resolve().name or "rate-table",
            progress=lambda segments: run.progress(segments, len(segments), "segment of the profile"),
        )
        write_recording(result.recording, out)
        write_recording(result.wide, out / "adxrs649")
        write_rate_truth(out / "truth.csv", result.motion)
        table = plateau_table(result)
        write_plateaus(out / "plateaus.csv", table)
        scores = rate_table_checks(result, table)
        run.write_json("scores.json", [item.as_dict() for item in scores])
        run.step("drawing")
        draw_methods(result, out / "methods.png")
        if plateaus(knots):
            draw_waveform(result, out / "waveform.png")
        _print(table)
        for item in scores:
            typer.echo(item.text)


def _print(table: list[Plateau]) -> None:
    import numpy as np
    from rich.console import Console
    from rich.table import Table

    shown = Table(title="errors by plateau, deg/s")
    for name in ("plateau", "method", "known", "bias", "sd", "worst", "bias, %"):
        shown.add_column(name, justify="left" if name == "method" else "right", no_wrap=True)
    for row in table:
        figures = [np.degrees(x) for x in (row.bias, row.sd, row.worst)]
        cells = ["" if np.isnan(x) else f"{x:.2f}" for x in figures]
        percent = f"{100 * row.bias / row.rate:.3f}" if row.rate and np.isfinite(row.bias) else ""
        shown.add_row(f"{np.degrees(row.rate):.0f}", row.method, f"{100 * row.known:.0f} %", *cells, percent)
    Console().print(shown)
