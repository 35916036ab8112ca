"""``discsim fly``: one flight of a disc as its instruments record it, with the truth beside it."""

from __future__ import annotations

import enum
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from discsim.validation.reporting.options import (
    EffectOption,
    ModelOption,
    ModuleOption,
    OutOption,
    SeedOption,
    SiteOption,
    WithOption,
    all_effects,
    at_site,
    at_wind,
    disc_to_fly,
    given_files,
    laws_upon,
    parse_module,
    throw_as_said,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from discsim.motion import Motion

__all__ = ["command"]


class Ground(enum.StrEnum):
    """What the ground does to a flight."""

    stop = "stop"
    skip = "skip"


class Engine(enum.StrEnum):
    """What integrates a flight."""

    mujoco = "mujoco"
    trajectory = "trajectory"


def command(
    disc: Annotated[
        str | None,
        typer.Option(help="A shipped disc's name, or a TOML file with [disc] and [environment]. Default: driver."),
    ] = None,
    model: ModelOption = None,
    throw: Annotated[
        str, typer.Option(help="A shipped throw's name, or a TOML file with the keys of [release].")
    ] = "driver",
    speed: Annotated[float | None, typer.Option(help="In the place of the throw's: speed, m/s.")] = None,
    launch: Annotated[
        float | None, typer.Option(min=-90.0, max=90.0, help="... launch angle of the velocity, deg up.")
    ] = None,
    heading: Annotated[float | None, typer.Option(help="... heading, deg clockwise from north.")] = None,
    hyzer: Annotated[float | None, typer.Option(help="... hyzer, deg of lean to the side it fades to.")] = None,
    nose: Annotated[float | None, typer.Option(help="... nose angle, deg of the disc's plane above its path.")] = None,
    spin: Annotated[float | None, typer.Option(help="... spin, rpm, clockwise from above if positive.")] = None,
    height: Annotated[float | None, typer.Option(help="... height of the release, m.")] = None,
    wind: Annotated[
        str | None,
        typer.Option(metavar="SPEED,FROM", help="Known wind: m/s, and where it comes from, deg from north."),
    ] = None,
    parts: Annotated[
        str, typer.Option(help="Sensor parts on board, shipped names or TOML files, separated by commas.")
    ] = "mpu9250,neo_m8n",
    module: ModuleOption = None,
    site: SiteOption = None,
    effect: EffectOption = None,
    own: WithOption = None,
    ground: Annotated[Ground, typer.Option(help="The ground ends the flight, or the disc skips on.")] = Ground.stop,
    engine: Annotated[
        Engine, typer.Option(help="MuJoCo, or the standalone model of 12 states: the same physics, much faster.")
    ] = Engine.mujoco,
    duration: Annotated[float, typer.Option(min=0.01, help="Longest flight, s.")] = 30.0,
    out: OutOption = Path("flight"),
    seed: SeedOption = 0,
) -> None:
    """Fly a disc and write what its instruments record.

    Writes a recording folder (recording.toml and one CSV file per sensor) and truth.csv into --out.

    Example: discsim fly --speed 26 --launch 12 --hyzer 15 --spin 900 --wind 3,270 --out flight
    or: discsim fly --disc driver --effect air.wind:w_north_m_s=2 --out flight
    or, with what a diagnosis or a fit has written: discsim fly --model model.toml --engine trajectory --out flight
    """
    from discsim.effects.catalogue import by_id
    from discsim.effects.own import load_user_effects
    from discsim.module import loaded
    from discsim.recording import write_recording
    from discsim.sensors import Instruments, record
    from discsim.shipped import load_throw
    from discsim.validation.checking.finding import doubts_of
    from discsim.validation.checking.statements import statement_findings
    from discsim.validation.reporting.run import start_run
    from discsim.validation.reporting.truth import write_flight_truth

    fly = _flown_by(engine, ground)
    mine = load_user_effects(own or [])
    body, surroundings, stated = disc_to_fly(disc, model, mine)
    environment = at_wind(at_site(surroundings, site), wind)
    said = {"speed": speed, "launch": launch, "heading": heading, "hyzer": hyzer, "nose": nose, "spin": spin,
            "height": height}  # fmt: skip
    release = throw_as_said(load_throw(throw), said)
    instruments = Instruments.from_parts(*parts.split(","))
    effects, notes = all_effects(stated, effect, "flight", list(instruments.sensors), out.resolve().name, mine)
    if module is not None:
        body, aboard = loaded(body, parse_module(module))
        effects = [*effects, *aboard]
        by_id(effects)
    laws, passed = laws_upon(stated, "flight", list(instruments.sensors))
    instruments = instruments.with_effects(effects).with_laws(laws)
    with start_run(out, seed, given_files(model, *(own or []), disc, throw, site, *parts.split(","))) as run:
        motion = fly(body, environment, release, effects, duration=duration, law=laws)
        recording = record(motion, instruments, run.rng, plant="flight", name=out.resolve().name, disc=body)
        write_recording(recording, out)
        write_flight_truth(out / "truth.csv", motion)
    unlikely = doubts_of(statement_findings(replace(recording, release=release)))
    for note in (*notes, *passed, *unlikely, f"{out}: {_end(motion)}"):
        typer.echo(note)


def _flown_by(engine: Engine, ground: Ground) -> Callable[..., Motion]:
    """Return what flies a disc; raises `InputError` where the engine does not know that ground."""
    from discsim.errors import InputError

    if engine is Engine.mujoco:
        from discsim.engine import fly

        return partial(fly, ground=ground.value)
    if ground is Ground.skip:
        raise InputError("--engine trajectory knows no contact with the ground; expected --ground stop with it")
    from discsim.trajectory import predict

    return lambda *what, **how: predict(*what, **how).motion()


def _end(motion: Motion) -> str:
    north, east = motion.position[-1, :2]
    what = "touches down" if motion.touched_down else "is left"
    return f"{what} after {motion.end:.2f} s, {north:.1f} m north and {east:.1f} m east"
