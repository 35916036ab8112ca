"""``discsim view``: a throw or a recording to look at, in a window or as a video."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from discsim.errors import InputError
from discsim.validation.reporting.options import (
    ModelOption,
    WithOption,
    all_effects,
    disc_to_fly,
    given_files,
    laws_upon,
)

if TYPE_CHECKING:
    from discsim.validation.viewing.replay import Replay
    from discsim.validation.viewing.scene import Look

__all__ = ["command"]

ENDINGS = (".gif", ".mp4", ".png")


def command(
    recording: Annotated[Path | None, typer.Argument(help="A recording's folder.", show_default=False)] = None,
    disc: Annotated[
        str | None, typer.Option(help="Fly a disc: a shipped name, or a TOML file with [disc] and [environment].")
    ] = None,
    model: ModelOption = None,
    own: WithOption = None,
    throw: Annotated[
        str | None, typer.Option(help="Its throw: a shipped name, or a TOML file. Default: driver.")
    ] = None,
    video: Annotated[
        Path | None, typer.Option(help="Draw off screen into this .gif, .mp4 or .png, placed in --out if relative.")
    ] = None,
    speed: Annotated[float, typer.Option(help="Times real time; 0.1 is slow motion.")] = 1.0,
    camera: Annotated[
        str, typer.Option(help="track (from behind), side, top, or path (a whole flight from its right).")
    ] = "track",
    span: Annotated[str | None, typer.Option(help="Show only A:B, in seconds.")] = None,
    at: Annotated[
        str | None, typer.Option(help="For a .png: stills at these seconds, separated by commas, side by side.")
    ] = None,
    size: Annotated[
        str | None, typer.Option(help="Pixels, WIDTHxHEIGHT. Default: 640x360, a whole flight in one .png 1200x500.")
    ] = None,
    fps: Annotated[float, typer.Option(help="Frames per second of a video.")] = 30.0,
    enlarge: Annotated[float, typer.Option(help="Draw the disc so many times its size.")] = 1.0,
    out: Annotated[Path, typer.Option("--out", help="Folder to write into; created where absent.")] = Path("."),
) -> None:
    """Show a flight or a rate table, live or as a video.

    A .png shows a whole flight in one picture, with --at single stills. run.json is left beside FILE.

    Example: discsim view --disc driver --video throw.gif --speed 0.1 --span 0:1
    """
    _check_source(recording, disc, model, throw)
    _check_video(video, at)
    pixels = None if size is None else _pixels(size)
    times = None if at is None else _seconds(at, ",", "--at")
    cut = None if span is None else _span(span)
    if video is not None:
        _check_opengl()
    from discsim.validation.reporting.run import start_run
    from discsim.validation.viewing.scene import Look, show

    replay = _replay(recording, disc, model, throw or "driver", own or [])
    replay = replay if cut is None else replay.between(*cut)
    whole = video is not None and video.suffix == ".png" and times is None and replay.travels
    look = Look(*(pixels or ((1200, 500) if whole else (640, 360))), camera, enlarge)
    for note in replay.notes:
        typer.echo(note)
    if video is None:
        return show(replay, look, speed)
    file = out / video
    with start_run(file.parent, None, given_files(recording, model, *(own or []), disc, throw)):
        if file.suffix == ".png":
            _draw_picture(file, replay, look, None if whole else times or [replay.start])
        else:
            _draw_video(file, replay, look, fps, speed)
    typer.echo(f"{file}")


def _check_source(recording: Path | None, disc: str | None, model: Path | None, throw: str | None) -> None:
    if sum(source is not None for source in (recording, disc, model)) != 1:
        raise InputError("expected either the folder of a recording or --disc NAME or --model FILE")
    if throw is not None and recording is not None:
        raise InputError(f"--throw {throw}: a recording has its own motion; expected --disc NAME with it")


def _check_video(video: Path | None, at: str | None) -> None:
    if video is not None and video.suffix not in ENDINGS:
        raise InputError(f"--video {video}: expected a name that ends in {', '.join(ENDINGS)}")
    if at is not None and (video is None or video.suffix != ".png"):
        raise InputError(f"--at {at}: stills go into a .png; expected --video FILE.png with it")


def _check_opengl() -> None:
    """Refuse a wrong MUJOCO_GL before MuJoCo is imported, which gives no clear error for it."""
    from discsim.validation.viewing.offscreen import opengl

    opengl()


def _replay(recording: Path | None, disc: str | None, model: Path | None, throw: str, own: list[Path]) -> Replay:
    from discsim.effects.own import load_user_effects
    from discsim.engine import fly
    from discsim.recording import read_recording
    from discsim.shipped import load_throw
    from discsim.validation.checking.paths import path_findings
    from discsim.validation.checking.statements import unlikely_flight
    from discsim.validation.diagnosis.setup import find_setup_faults, setup_notes
    from discsim.validation.diagnosis.setup.reference import believed, reference_doubts
    from discsim.validation.viewing.replay import replay_motion, replay_recording

    if recording is not None:
        setup = find_setup_faults([read_recording(recording)])
        for note in setup_notes(setup, "drawn are"):
            typer.echo(note)
        (meant,) = setup.recordings
        replay = replay_recording(believed(meant, reference_doubts(meant)))
        for found in path_findings(meant):
            typer.echo(found.sentence)
        return replay
    body, environment, stated = disc_to_fly(disc, model, load_user_effects(own))
    effects, _ = all_effects(stated, None, "flight", (), None)
    laws, _ = laws_upon(stated, "flight", ())
    release = load_throw(throw)
    for note in unlikely_flight(body, environment, release):
        typer.echo(note)
    motion = fly(body, environment, release, effects, law=laws)
    return replay_motion(motion, body.diameter, f"flown in MuJoCo: disc {disc or model}, throw {throw}")


def _draw_picture(file: Path, replay: Replay, look: Look, times: list[float] | None) -> None:
    """Draw stills at some times, or the whole flight."""
    from discsim.validation.viewing.scene import draw_stills, draw_whole, write_picture

    write_picture(file, draw_whole(replay, look) if times is None else draw_stills(replay, look, times))


def _draw_video(file: Path, replay: Replay, look: Look, fps: float, speed: float) -> None:
    from discsim.validation.viewing.scene import frame_times, write_video

    times = frame_times(file, replay, fps, speed)
    if not sys.stderr.isatty():
        typer.echo(f"drawing {times.size} frames", err=True)
        write_video(file, replay, look, times, fps)
        return
    from rich.console import Console
    from rich.progress import track

    with_bar = track(times.tolist(), "drawing", console=Console(stderr=True), transient=True)
    write_video(file, replay, look, with_bar, fps)


def _pixels(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise InputError(f"--size {text}: expected WIDTHxHEIGHT in pixels, such as 640x360")
    return int(width), int(height)


def _span(text: str) -> tuple[float, float]:
    cut = _seconds(text, ":", "--span")
    if len(cut) != 2:
        raise InputError(f"--span {text}: expected A:B, two numbers of seconds")
    return cut[0], cut[1]


def _seconds(text: str, separator: str, option: str) -> list[float]:
    try:
        return [float(item) for item in text.split(separator)]
    except ValueError:
        raise InputError(f"{option} {text}: expected seconds separated by '{separator}'") from None
