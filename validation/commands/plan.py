"""``discsim plan``: what recordings could show, before anybody goes out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from discsim.validation.reporting.options import ModelOption, OutOption

if TYPE_CHECKING:
    from discsim.disc import Disc, Release
    from discsim.environment import Environment
    from discsim.recording import Plant, Recording
    from discsim.validation.identification.plants.plan import Plan

__all__ = ["command"]

#: plants of which no throw is made -> what a file says of each recording
_KEYS = {
    "free_spin": "body_rate_rad_s and duration_s",
    "spin_down": "rate_rad_s and duration_s",
    "rate_table": "time_s and rate_rad_s, lists of knots,",
}


def command(
    plan: Annotated[
        Path | None,
        typer.Argument(help="A TOML file of recordings, [[recording]]. Default: --throws like --throw."),
    ] = None,
    like: Annotated[
        Path | None, typer.Option(help="A data set: recordings like these again, with their hardware.")
    ] = None,
    throws: Annotated[int, typer.Option(min=1, help="So many throws like --throw, headings round the compass.")] = 6,
    throw: Annotated[str, typer.Option(help="A shipped throw's name, or a TOML file.")] = "driver",
    disc: Annotated[str | None, typer.Option(help="A shipped disc's name, or a TOML file. Default: driver.")] = None,
    model: ModelOption = None,
    plant: Annotated[
        str, typer.Option(help="flight, free_spin, spin_down or rate_table, of the file's recordings.")
    ] = ("flight"),
    parts: Annotated[str, typer.Option(help="Sensor parts, names or TOML files, separated by commas.")] = (
        "mpu9250,neo_m8n"
    ),
    instead: Annotated[
        list[str] | None, typer.Option("--instead", metavar="PARTS", help="Other parts to compare; may repeat.")
    ] = None,
    times: Annotated[int, typer.Option(min=1, help="How often each recording is made.")] = 1,
    candidates: Annotated[
        Path | None, typer.Option(help="A TOML file of recordings that could be added. Default: ordinary ones.")
    ] = None,
    out: OutOption = Path("plan"),
) -> None:
    """Tell what recordings could show, before going out.

    Writes plan.json, plan.png and report.html into --out: the size of each effect that would be seen and named, pairs
    that could not be told apart, the sd of C_Nr and every coefficient, the best next recordings, and what better
    sensors would buy. Nothing is fitted: all of it comes from the information of simulated recordings.

    Example: discsim plan --throws 6 --disc driver --parts mpu9250,neo_m8n --out plan
    """
    from discsim.errors import InputError
    from discsim.shipped import load_throw
    from discsim.validation.diagnosis.design.plans import read_plans
    from discsim.validation.planning.planned import plan as tell
    from discsim.validation.reporting.options import disc_to_fly, known_plant, rig_of, say_note
    from discsim.validation.reporting.run import start_run
    from discsim.validation.running.given import read_given

    if plan is not None and plan.is_dir():
        raise InputError(f"{plan}: is a folder; expected a TOML file of recordings, or a data set as --like {plan}")
    if like is not None and plan is not None:
        raise InputError(f"{plan} and --like {like} both say what is recorded; expected one of them")
    kind = known_plant(plant)
    if plan is None and like is None and kind != "flight":
        raise InputError(
            f"--plant {kind}: --throws plans flights alone; expected recordings in hand as --like DATASET, or a TOML "
            f"file with {_KEYS[kind]} in each [[recording]]"
        )
    rig = rig_of(model, kind)
    body, place, _ = disc_to_fly(disc, None if rig is not None else model)
    named = [Path(name) for name in (disc or "", throw, *parts.split(",")) if name.endswith(".toml")]
    asked: Sequence[Plan] | Sequence[Recording] | int = throws if plan is None else read_plans(plan, plant)
    if like is not None:
        asked, named = read_given(like, say_note), [*named, like]
    further = None if candidates is None else read_plans(candidates, plant)
    release = load_throw(throw)
    for note in _doubts(asked, kind, (body, place, release) if rig is None and like is None else None):
        typer.echo(note)
    with start_run(out, inputs=[*filter(None, (plan, model, candidates)), *named]) as run:
        found = tell(
            asked,
            body,
            parts.split(","),
            environment=place,
            throw=release,
            plant=kind,
            rig=rig,
            times=times,
            candidates=further,
            instead=[other.split(",") for other in instead or ()],
            say=run.step,
        )
        found.report(out)
    typer.echo(found.summary())
    typer.echo(f"read {out / 'report.html'}")


def _doubts(
    asked: Sequence[Plan] | Sequence[Recording] | int, plant: Plant, flown: tuple[Disc, Environment, Release] | None
) -> list[str]:
    """Return what cannot be, or is unlikely, about the hardware (None: not stated here) and what is planned of it."""
    from discsim.disc import Release
    from discsim.rate_tables import RateTable
    from discsim.recording import Recording
    from discsim.validation.checking.doubts import reading_doubts
    from discsim.validation.checking.statements import unlikely_flight
    from discsim.validation.identification.plants import PLANTS
    from discsim.validation.identification.plants.plan import Plan
    from discsim.validation.scenarios.profile_files import Profile, speed_note

    given = [] if isinstance(asked, int) else [one for one in asked if isinstance(one, Recording)]
    if given:
        return list(reading_doubts(given, [one.name for one in given]))
    plans = [] if isinstance(asked, int) else [one for one in asked if isinstance(one, Plan)]
    if plant == "rate_table":
        asks = {
            one.text: speed_note(Profile(one.command, in_radians=False), RateTable(), f"'{one.text}'")
            for one in plans
            if one.command is not None
        }
        return [f"{note}; were deg/s meant under rate_rad_s?" for note in asks.values() if note is not None]
    if flown is None or plant == "spin_down":
        return []
    body, place, throw = flown
    layout = PLANTS[plant].layout
    releases = [throw] if isinstance(asked, int) else []
    for one in plans:
        velocity = None if layout.velocity is None else one.state[layout.velocity]
        releases.append(Release(velocity=velocity, body_rate=one.state[layout.rate]))
    return unlikely_flight(body, place, *releases)
