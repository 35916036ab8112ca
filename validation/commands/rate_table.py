"""``discsim rate-table``: a rate-table run, emulated in MuJoCo or measured, with every method scored on it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import typer

from discsim.validation.reporting.options import (
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
    from discsim.effects.catalogue import Effect
    from discsim.environment import Environment
    from discsim.law import Law
    from discsim.rate_tables import RateTable
    from discsim.recording import Samples
    from discsim.validation.experiments.table_recording import MeasuredRun
    from discsim.validation.reporting.run import Run
    from discsim.validation.scenarios.rate_table import Bench, Plateau, RateTableRun
    from discsim.validation.scenarios.table_scores import TableScores

__all__ = ["command"]


def command(
    profile: Annotated[
        Path | None,
        typer.Option(
            help="CSV of knots (time_s,rate_rad_s or time_s,rate_deg_s; other names with units too), a TOML shape "
            "(trapezoids, sine, sweep), or a recording whose rate reference is followed. Default: 0 to 5000 deg/s in "
            "steps."
        ),
    ] = None,
    mount: Annotated[
        str, typer.Option(help="Installation error dx,dy,dz of the accelerometer in m, added to its stated place.")
    ] = "0,0,0",
    parts: Annotated[
        str | None,
        typer.Option(help="Parts on the table, names or TOML files separated by commas. Default: the paper's module."),
    ] = None,
    radius: Annotated[
        float | None,
        typer.Option(
            help="Where the accelerometer is stated to sit, m from the axis on -x. Default: where its part says."
        ),
    ] = None,
    table: Annotated[
        str | None,
        typer.Option(
            help="A shipped rate table (ac1120s, workshop) or a TOML file: drive, encoder, field, second axis."
        ),
    ] = None,
    recording: Annotated[
        Path | None,
        typer.Option(help="A measured run with a rate reference: scored, and set beside an emulation of it."),
    ] = None,
    method: Annotated[
        Literal["paper", "all"], typer.Option(help="The paper's methods, or every one that the parts allow.")
    ] = "paper",
    tolerance: Annotated[
        float, typer.Option(min=0.0, help="Within which a stretch of the profile is a plateau, deg/s.")
    ] = 3.0,
    model: ModelOption = None,
    site: SiteOption = None,
    effect: EffectOption = None,
    own: WithOption = None,
    out: OutOption = Path("rate-table"),
    seed: SeedOption = 0,
) -> None:
    """Turn a rate table and score every method against the truth.

    Writes a recording folder (the module and the table's read-out), truth.csv, methods.csv (each method over the whole
    run), bands.csv (by rate), scores.json, report.html and methods.png (as the paper's Fig. 7) into --out, where the
    profile has plateaus also plateaus.csv and waveform.png; with the paper's module also the wide-range gyroscope's
    recording, in adxrs649/. With --recording the emulation's files go into emulation/; comparison.md and comparison.png
    show both.

    Example: discsim rate-table --table workshop --parts mpu9250,adxl375 --radius 0.03 --out rate-table
    """
    from discsim.environment import Environment
    from discsim.errors import InputError
    from discsim.validation.experiments.table_recording import read_run
    from discsim.validation.reporting.run import start_run

    if recording is not None and (parts is not None or radius is not None):
        raise InputError("--recording states the parts and their places; expected it without --parts and --radius")
    bench = _bench(table, parts, radius, mount)
    real = None if recording is None else read_run(recording)
    knots = _knots(profile, bench.table, real)
    sensors = tuple(bench.sensors) if real is None else tuple(real.recording.samples)
    acting = _acting(model, effect, own, sensors, out.resolve().name)
    stated = Environment() if real is None else real.recording.environment
    surroundings = at_site(acting.environment or stated, site)
    inputs = [path for path in (profile, model, recording, *(own or [])) if path]
    inputs += [Path(name) for name in (site, table, *(parts or "").split(",")) if name and name.endswith(".toml")]
    with start_run(out, seed, inputs) as run:
        if real is None:
            _emulate(run, _Asked(knots, bench, surroundings, acting, method, tolerance))
        else:
            _compare(run, real, _Asked(knots, bench, surroundings, acting, method, tolerance))


class _Acting(NamedTuple):
    """Effects and laws upon a run, and the surroundings of a model where one states them."""

    effects: tuple[Effect, ...]
    laws: tuple[Law, ...]
    environment: Environment | None


class _Asked(NamedTuple):
    """What is to be turned and told."""

    profile: Samples
    bench: Bench
    environment: Environment
    acting: _Acting
    method: str
    tolerance_deg_s: float

    def run(self, run: Run, name: str) -> RateTableRun:
        """Turn the table, with progress told by ``run``, and score by all methods where they are asked for."""
        from discsim.validation.scenarios.rate_table import run_rate_table, with_all_methods

        run.step("turning the table and measuring")
        result = run_rate_table(
            self.profile,
            self.environment,
            run.rng,
            bench=self.bench,
            effects=self.acting.effects,
            laws=self.acting.laws,
            name=name,
            progress=lambda parts: run.progress(parts, len(parts), "part of the profile"),
        )
        return with_all_methods(result) if self.method == "all" else result


def _knots(path: Path | None, table: RateTable, real: MeasuredRun | None) -> Samples:
    """Return the profile: that of ``path``, else of the measured run, else the default; says what is odd in it."""
    from discsim.rig import default_profile
    from discsim.validation.scenarios.profile_files import read_knots, speed_note

    if path is None:
        return default_profile() if real is None else real.profile_for(table)
    stated = read_knots(path)
    for note in (*stated.notes, speed_note(stated, table)):
        if note:
            typer.echo(f"note: {note}")
    return stated.knots


def _bench(table: str | None, parts: str | None, radius: float | None, mount: str) -> Bench:
    """Return what turns and what sits on it, as the options say; raises `InputError`."""
    from discsim.errors import InputError
    from discsim.rate_tables import RateTable, load_table
    from discsim.validation.scenarios.rate_table import Bench

    if radius is not None and not 1e-4 <= radius <= 1.0:
        raise InputError(f"--radius {radius:g}: expected 0.0001 to 1 m (is it in millimetres?)")
    names = None if parts is None else tuple(name.strip() for name in parts.split(",") if name.strip())
    if names == ():
        raise InputError("--parts names none; expected names or TOML files separated by commas")
    offset = parse_vector(mount, "--mount", "m", 0.05)
    return Bench(RateTable() if table is None else load_table(table), names, radius, offset)


def _acting(
    model: Path | None, effect: list[str] | None, own: list[Path] | None, sensors: tuple[str, ...], name: str
) -> _Acting:
    from discsim.effects.own import load_user_effects
    from discsim.model_file import read_model

    mine = load_user_effects(own or [])
    stated = read_model(model, mine) if model is not None else None
    effects, notes = all_effects(stated, effect, "rate_table", sensors, name, mine)
    laws, passed = laws_upon(stated, "rate_table", sensors)
    for note in (*notes, *passed):
        typer.echo(note)
    return _Acting(tuple(effects), tuple(laws), None if stated is None else stated.environment)


def _emulate(run: Run, asked: _Asked) -> None:
    import numpy as np

    from discsim.validation.scenarios.rate_table import plateau_table, rate_table_checks
    from discsim.validation.scenarios.table_page import write_table_page
    from discsim.validation.scenarios.table_scores import score_rates

    result = asked.run(run, run.out.resolve().name or "rate-table")
    _write(run.out, result)
    scores = score_rates(result.rates, result.truth, result.span)
    table = plateau_table(result, np.radians(asked.tolerance_deg_s))
    _write_scores(run.out, scores, table)
    checks = rate_table_checks(result, plateau_table(result))
    run.write_json("scores.json", [item.as_dict() for item in checks])
    run.step("drawing")
    _draw(run.out, result)
    write_table_page(run.out, scores, table, checks)
    _print_methods(scores)
    if table:
        _print_plateaus(table)
    for item in checks:
        typer.echo(item.text)


def _compare(run: Run, real: MeasuredRun, asked: _Asked) -> None:
    from dataclasses import replace

    from discsim.validation.experiments.table_recording import compare, draw_comparison
    from discsim.validation.scenarios.table_page import write_table_page

    bench = replace(asked.bench, stated=real.instruments)
    emulated = asked._replace(bench=bench).run(run, f"{real.recording.name or 'run'}-emulated")
    folder = run.out / "emulation"
    _write(folder, emulated)
    run.step("estimating the measured run")
    found = compare(real, emulated, asked.method, asked.tolerance_deg_s)
    _write_scores(run.out, found.measured, found.plateaus)
    _write_scores(folder, found.emulated, [])
    found.write(run.out)
    draw_comparison(found, run.out / "comparison.png")
    run.write_json("scores.json", [])
    said = found.sentences(run.out)
    write_table_page(run.out, found.measured, found.plateaus, compared=said)
    _print_methods(found.measured)
    for line in said:
        typer.echo(line)


def _write(out: Path, result: RateTableRun) -> None:
    from discsim.recording import write_recording
    from discsim.validation.reporting.truth import write_rate_truth

    write_recording(result.recording, out)
    if result.wide is not None:
        write_recording(result.wide, out / "adxrs649")
    write_rate_truth(out / "truth.csv", result.motion)


def _write_scores(out: Path, scores: TableScores, table: list[Plateau]) -> None:
    from discsim.validation.scenarios.rate_table import write_plateaus

    scores.write(out)
    if table:
        write_plateaus(out / "plateaus.csv", table)
    else:
        (out / "plateaus.csv").unlink(missing_ok=True)  # of an earlier run into this folder


def _draw(out: Path, result: RateTableRun) -> None:
    from discsim.validation.scenarios.rate_table import plateaus
    from discsim.validation.scenarios.rate_table_figures import draw_methods, draw_waveform

    draw_methods(result, out / "methods.png")
    if "magnetometer" in result.recording and plateaus(result.profile):
        draw_waveform(result, out / "waveform.png")
    else:
        (out / "waveform.png").unlink(missing_ok=True)


def _print_methods(scores: TableScores) -> None:
    import numpy as np
    from rich.console import Console
    from rich.table import Table

    shown = Table(title="errors over the whole run, deg/s")
    for name in ("method", "known", "bias", "rms", "worst", "delay, ms"):
        shown.add_column(name, justify="left" if name == "method" else "right", no_wrap=True)
    for row in scores.methods:
        figures = [np.degrees(x) for x in (row.bias, row.rms, row.worst)]
        cells = ["" if np.isnan(x) else f"{x:.2f}" for x in figures]
        delay = "" if np.isnan(row.delay) else f"{1000 * row.delay:.1f} +- {1000 * row.delay_sd:.1f}"
        shown.add_row(row.method, f"{100 * row.known:.0f} %", *cells, delay)
    Console().print(shown)


def _print_plateaus(table: list[Plateau]) -> None:
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
