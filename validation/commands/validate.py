"""``discsim validate``: the main job, headless. Everything is run, scored against truth, and reported."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from discsim.errors import InputError
from discsim.validation.reporting.options import ModelOption, OutOption, SeedOption, disc_to_fly, given_files, say_note

if TYPE_CHECKING:
    from discsim.validation.experiments.subject import Subject
    from discsim.validation.experiments.validation_run import Validated

__all__ = ["command"]

#: seeds that limits are recorded from, where --repeat does not say
_SEEDS = 5

RepeatOption = Annotated[
    int | None,
    typer.Option(min=2, help=f"--record-limits: number of seeds, from --seed on.  [default: {_SEEDS}]"),
]
MarginOption = Annotated[
    float | None,
    typer.Option(
        min=0.0,
        help="--record-limits: standard deviations beyond the mean; else what 99.99 % of further runs stay within.",
    ),
]


def command(
    quick: Annotated[bool, typer.Option("--quick", help="A shorter profile and fewer throws.")] = False,
    junit: Annotated[Path | None, typer.Option(help="Also write the scores as a JUnit XML file.")] = None,
    summary: Annotated[Path | None, typer.Option(help="Also write the scores as a Markdown file.")] = None,
    disc: Annotated[str | None, typer.Option(help="A shipped disc's name or a TOML file. Default: driver.")] = None,
    model: ModelOption = None,
    parts: Annotated[
        str | None, typer.Option(help="Parts on board of the throws, names or TOML files, separated by commas.")
    ] = None,
    throws: Annotated[
        str | None, typer.Option(help="Throws, shipped names or TOML files, separated by commas, in place of ours.")
    ] = None,
    profile: Annotated[Path | None, typer.Option(help="The rate table's profile, as of discsim rate-table.")] = None,
    recordings: Annotated[
        Path | None, typer.Option(help="Recordings of your own, a data set or one: their scores join the others.")
    ] = None,
    limits: Annotated[Path | None, typer.Option(help="A TOML file of tolerances of your own, by score.")] = None,
    record_limits: Annotated[
        Path | None, typer.Option(help="Write such a file, from the spread of this run over --repeat seeds.")
    ] = None,
    repeat: RepeatOption = None,
    margin: MarginOption = None,
    against: Annotated[
        Path | None, typer.Option(help="An earlier run's folder or scores.json: write against.html beside the report.")
    ] = None,
    out: OutOption = Path("validation-report"),
    seed: SeedOption = 0,
) -> None:
    """Run the main job: score everything against truth, report it.

    Simulates a rate table and throws, scores every estimator, fits C_Nr and flies with it, diagnoses concealed cases.
    Writes scores.json, report.html and figures into --out. Exit status 1 if a score is outside its tolerance. Where
    GitHub runs it, failures become annotations and the summary goes to the job's page.

    Example: discsim validate --quick --junit scores.xml --out validation-report
    or: discsim validate --disc mine.toml --throws mine-1.toml,mine-2.toml --limits limits.toml --against last-report
    """
    from discsim.validation.experiments.subject import stated_subject
    from discsim.validation.experiments.validation_run import Judging, validate
    from discsim.validation.reporting.limits import shipped_limits
    from discsim.validation.reporting.run import start_run
    from discsim.validation.running.given import read_given

    _check_places({"--junit": junit, "--summary": summary, "--record-limits": record_limits})
    body, surroundings, stated = disc_to_fly(disc, model)
    names = [part.split(",") if part else [] for part in (parts, throws)]
    flown = None if disc is None and model is None else (body, surroundings)
    subject = stated_subject(quick, disc=flown, parts=names[0], throws=names[1], profile=profile)
    mine = [] if recordings is None else read_given(recordings, say_note)
    # with a disc, parts, throws or profile of one's own the scores scatter otherwise
    shipped = {} if any((disc, model, *names, profile)) else shipped_limits(quick)
    judging = replace(Judging.read(shipped, limits, against), **_recorded(record_limits, repeat, margin))
    passed = stated is not None and (stated.effects or stated.laws)
    _doubt(subject, f"{model}: its effects and laws are passed over; the scores are of its disc" if passed else None)
    inputs = given_files(model, profile, recordings, limits, disc, *names[0], *names[1])
    with start_run(out, seed, inputs) as run:
        done = validate(run, quick=quick, junit=junit, subject=subject, judging=judging, recordings=mine)
    _leave(done, summary)
    if not _told(done, out):
        raise typer.Exit(1)


def _told(done: Validated, out: Path) -> bool:
    """Print every score; tell whether all are within tolerance."""
    for item in done.scores:
        typer.echo(item.text)
    within, count = sum(item.ok for item in done.scores), len(done.scores)
    typer.echo(f"{within} of {count} scores within tolerance; report: {out / 'report.html'}")
    return within == count


def _doubt(subject: Subject, passed: str | None) -> None:
    """Print what is passed over, and what cannot be about the disc that is flown, its surroundings and its throws."""
    from discsim.validation.checking.statements import unlikely_flight

    unlikely = unlikely_flight(subject.disc, subject.environment, *(one.release for one in subject.throws))
    for note in (*filter(None, [passed]), *unlikely):
        typer.echo(note)


def _recorded(record: Path | None, repeat: int | None, margin: float | None) -> dict[str, Any]:
    """Return how limits are recorded, as `Judging` has it; raises `InputError` where that is said of none."""
    if record is None and (repeat, margin) != (None, None):
        raise InputError("--repeat and --margin say how limits are recorded; expected them with --record-limits FILE")
    return {"record": record, "seeds": repeat or _SEEDS, "margin": margin}


def _check_places(files: Mapping[str, Path | None]) -> None:
    for option, file in files.items():
        if file is not None and (file.is_dir() or file.parent.is_file()):
            raise InputError(f"{option} {file}: is no place for a file; expected the name of one")


def _leave(done: Validated, summary: Path | None) -> None:
    """Write the summary where it was asked for, and where GitHub runs this onto its job's page, with annotations."""
    from discsim.files import write_text
    from discsim.validation.reporting.ci import github_commands, markdown_summary

    text = markdown_summary("discsim validate", done.scores, done.changes)
    if summary is not None:
        write_text(summary, text)
    if page := os.environ.get("GITHUB_STEP_SUMMARY"):
        with Path(page).open("a", encoding="utf-8") as stream:
            stream.write(text)
    if os.environ.get("GITHUB_ACTIONS") == "true":
        for line in github_commands(done.scores, done.changes):
            typer.echo(line)
