"""``discsim study golf-throws``: write the page on the three tracked golf throws."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from discsim.validation.reporting.options import SeedOption
from discsim.validation.studies.golf_throws.page import write_page
from discsim.validation.studies.real_recordings.sources import RecordingsOption, find_recordings

__all__ = ["command"]


def command(
    recordings: RecordingsOption = None,
    page: Annotated[Path, typer.Option(help="The page; its figure goes into a folder of its name.")] = Path(
        "docs/golf-throws.md"
    ),
    seed: SeedOption = 0,
) -> None:
    """Fly three measured throws, compare them with their tracks, and write a page with a table and a figure.

    Example: discsim study golf-throws --page docs/golf-throws.md
    """
    found = write_page(find_recordings(recordings), page, seed)
    for throw in found:
        typer.echo(
            f"{throw.name}: misses by {np.linalg.norm(throw.miss):.1f} m, band (1 sd) {throw.band[0]:.1f} m north and "
            f"{throw.band[1]:.1f} m east, {throw.excess:.1f} sd"
        )
