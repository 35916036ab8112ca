"""``discsim challenge``: conceals effects in MuJoCo flights and rigs, has them diagnosed blind, opens the answers."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from discsim.validation.reporting.options import OutOption, SeedOption

if TYPE_CHECKING:
    from discsim.recording import Plant
    from discsim.validation.challenge.cases.case import Kind, Mask
    from discsim.validation.challenge.scores.result import Scored

__all__ = ["command"]


class PlantName(enum.StrEnum):
    """What moves."""

    flight = "flight"
    rate_table = "rate_table"
    spin_down = "spin_down"
    free_spin = "free_spin"


class KindName(enum.StrEnum):
    """What is concealed."""

    nothing = "nothing"
    noise = "noise"
    within_sigma = "within_sigma"
    beyond_sigma = "beyond_sigma"
    one = "one"
    two = "two"
    off_catalogue = "off_catalogue"
    setup = "setup"
    like_real = "like_real"


class MaskName(enum.StrEnum):
    """Under what an effect hides."""

    all = "all"
    stated_loosely = "stated_loosely"
    coloured_noise = "coloured_noise"
    second_effect = "second_effect"
    few_recordings = "few_recordings"
    short = "short"
    clipped = "clipped"
    magnetometer_only = "magnetometer_only"
    near_limit = "near_limit"


def command(
    cases: Annotated[int, typer.Option(min=1, help="Number of cases; case k has seed --seed + k.")] = 20,
    plant: Annotated[PlantName | None, typer.Option(help="Only this plant. Default: all four.")] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(help="Conceal this in every case, an id of the catalogue; may repeat. Default: as drawn."),
    ] = None,
    kind: Annotated[KindName | None, typer.Option(help="Only this kind of case. Default: as drawn.")] = None,
    mask: Annotated[
        MaskName | None,
        typer.Option(
            help="Put this over every case, to see how the score degrades; all: one mask after another, each in a "
            "folder of its own."
        ),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a running Dask scheduler. Default: local processes.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Local processes; 1 works in this one. Default: one per core.")
    ] = None,
    anew: Annotated[bool, typer.Option("--anew", help="Throw away what an earlier challenge left in --out.")] = False,
    out: OutOption = Path("challenge"),
    seed: SeedOption = 0,
) -> None:
    """Put discsim diagnose to a blind test and score it.

    Effects are concealed in MuJoCo and written as plain recordings; another process that gets nothing but those
    diagnoses them; then the sealed answers are opened. Writes challenge.json and report.html into --out. Stopped at
    any moment, the same command goes on. Exit status 1 where a goal is missed, under a mask where an answer is missing.

    Example: discsim challenge --cases 20 --out challenge
    """
    from discsim.errors import InputError
    from discsim.validation.challenge.blind import Request
    from discsim.validation.challenge.challenged import Challenged
    from discsim.validation.challenge.masks import challenge_masks
    from discsim.validation.challenge.run import challenge
    from discsim.validation.reporting.run import start_run

    if scheduler is not None and workers is not None:
        raise InputError("--workers counts local processes, and --scheduler uses none; expected one of the two")
    chosen: Plant | None = None if plant is None else plant.value
    only: Kind | None = None if kind is None else kind.value
    over = None if mask in (None, MaskName.all) else cast("Mask", mask.value)
    requests = [Request(number, chosen, tuple(effect or ()), only, over) for number in range(seed, seed + cases)]
    requests[0].draw()  # what does not go together is refused before anything is written
    results: dict[Mask | None, list[Scored]]
    with start_run(out, seed) as run:
        if mask is MaskName.all:
            results = challenge_masks(run, requests, scheduler=scheduler, workers=workers, anew=anew)
        else:
            results = {over: challenge(run, requests, scheduler=scheduler, workers=workers, anew=anew)}
    challenged = [Challenged(tuple(scored), name) for name, scored in results.items()]
    for found in challenged:
        typer.echo((f"\n{found.mask}\n" if mask is MaskName.all else "") + found.summary())
    typer.echo(f"report: {out / 'report.html'}")
    if not all(found.goals_met for found in challenged):
        raise typer.Exit(1)
