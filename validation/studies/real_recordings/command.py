"""``discsim study real-recordings``: write the page on measured recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from discsim.validation.studies.real_recordings.page import write_page
from discsim.validation.studies.real_recordings.road import LOGS, walk
from discsim.validation.studies.real_recordings.sources import RecordingsOption, find_recordings

__all__ = ["command"]


def command(
    recordings: RecordingsOption = None,
    out: Annotated[Path, typer.Option(help="Folder of the figures; the page is beside it, with .md.")] = Path(
        "docs/real-recordings"
    ),
    also: Annotated[
        list[str] | None,
        typer.Option(help="A method to try beside the paper's; may repeat. Default: all that there are."),
    ] = None,
    logs: Annotated[
        Path, typer.Option(help="Folder that keeps what the commands said of each log; a second run reads it.")
    ] = Path("real-recordings-logs"),
    walked: Annotated[
        bool, typer.Option("--walk/--no-walk", help="Run import, check, estimate and diagnose on each log.")
    ] = True,
) -> None:
    """Write a page: what the four commands say of each measured log, and each method against a reference sensor.

    Example: discsim study real-recordings --out docs/real-recordings
    """
    real = find_recordings(recordings)
    found = [walk(log, real, logs, _say) for log in LOGS] if walked else []
    page = write_page(real, out, also, _say, walked=found)
    typer.echo(f"{page}")


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
