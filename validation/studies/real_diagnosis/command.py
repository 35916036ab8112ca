"""``discsim study real-diagnosis``: write the page on what a diagnosis says of measured recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from discsim.validation.reporting.options import SeedOption
from discsim.validation.studies.real_diagnosis.page import write_page
from discsim.validation.studies.real_recordings.sources import RecordingsOption, find_recordings

__all__ = ["command"]


def command(
    recordings: RecordingsOption = None,
    page: Annotated[Path, typer.Option(help="The page; its figures go into a folder of its name.")] = Path(
        "docs/real-diagnosis.md"
    ),
    work: Annotated[
        Path,
        typer.Option(help="Folder of the diagnoses. One of the same recordings, seed and code is taken as it is."),
    ] = Path("real-diagnosis"),
    seed: SeedOption = 0,
) -> None:
    """Diagnose measured recordings and write a page with tables and figures.

    Example: discsim study real-diagnosis --work real-diagnosis
    """
    found = find_recordings(recordings)
    written = write_page(found, page, work, seed, lambda text: print(text, file=sys.stderr, flush=True))
    typer.echo(f"{written}")
