"""``discsim check``: what a recording or a data set holds, what is wrong with it, and what it can tell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["command"]


def command(
    recordings: Annotated[
        Path, typer.Argument(help="A recording, or a data set (a folder of recordings).", show_default=False)
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for check.json; nothing is written without it.")
    ] = None,
) -> None:
    """Say what a recording holds, and what is wrong with it.

    Nothing is fitted. Prints a table per recording: rates, gaps, held, late and lost rows, clipping, resolution and
    noise as found in the readings, then what cannot be or is unlikely, with what to do. Writes check.json and run.json
    where --out is given.

    Example: discsim check throw-01
    """
    from discsim.validation.checking.checked import check
    from discsim.validation.checking.table import print_checks
    from discsim.validation.reporting.options import say_note
    from discsim.validation.reporting.run import start_run
    from discsim.validation.running.given import read_given

    found = check(read_given(recordings, say_note))
    if out is not None:
        with start_run(out, inputs=[recordings]):
            found.report(out)
    print_checks(found.checks)
