"""``discsim diagnose``: where recordings part from the baseline, which physics was left out, and its size."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from discsim.validation.reporting.options import DateOption, OutOption, PlaceOption, SeedOption

__all__ = ["command"]


def command(
    datasets: Annotated[
        list[Path],
        typer.Argument(
            metavar="DATASET",
            help="Data sets (folders of recordings) of one plant that share their hardware.",
            show_default=False,
        ),
    ],
    out: OutOption = Path("diagnosis"),
    seed: SeedOption = 0,
    user_effects: Annotated[
        list[Path] | None,
        typer.Option("--with", help="A Python file with effects of your own, to compete with the catalogue's."),
    ] = None,
    candidates: Annotated[
        Path | None,
        typer.Option(
            "--candidates", help="A TOML file of recordings that you could make, to choose the next one from."
        ),
    ] = None,
    place: PlaceOption = None,
    date: DateOption = None,
) -> None:
    """Tell what the simulation left out of recordings, if anything.

    Says whether the baseline, a freely spinning disc with honest sensors, explains them down to their noise.
    Writes diagnosis.json (verdict, places, effects with their sizes, evidence, held-out gain), report.html to read,
    residuals*.png, and model.toml: the improved model, which other commands take with --model.

    Example: discsim diagnose open-field --out open-field-diagnosis
    """
    from dataclasses import replace

    from discsim.effects.own import load_user_effects
    from discsim.validation.diagnosis.datasets import need_field, read_datasets
    from discsim.validation.diagnosis.design.plans import read_plans
    from discsim.validation.diagnosis.diagnosed import diagnose_named
    from discsim.validation.reporting.options import at_place, say_note
    from discsim.validation.reporting.progress import shown
    from discsim.validation.reporting.run import start_run
    from discsim.validation.reporting.time_left import TimeLeft

    files = user_effects or []
    effects = load_user_effects(files)
    recordings, names = read_datasets(datasets, say_note)
    recordings = [
        [replace(one, environment=at_place(one.environment, place, date)) for one in set_] for set_ in recordings
    ]
    need_field(recordings)
    plans = None if candidates is None else read_plans(candidates, recordings[0][0].plant)
    named = dict(zip(names, recordings, strict=True))
    with start_run(out, seed, [*datasets, *files, *([candidates] if candidates else [])]) as run:
        with shown(TimeLeft(table=recordings[0][0].plant == "rate_table")) as progress:
            found = diagnose_named(named, progress=progress, seed=seed, user_effects=effects, plans=plans)
        found.report(out, command=f"discsim {' '.join(run.command)}")
    for doubt in found.doubts:
        say_note(doubt)
    typer.echo("\n".join([found.summary(), *found.remedies]))
    typer.echo(f"read {out / 'report.html'}")
