"""``python -m validation.real_recordings``: write the page on measured recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from discsim.errors import InputError
from validation.real_recordings.page import write_page
from validation.real_recordings.sources import find_recordings

__all__ = ["app", "command"]


def command(
    recordings: Annotated[
        Path | None,
        typer.Option(
            help="Folder of recordings with 'real' in it. Default: DISCSIM_RECORDINGS, or beside the checkout."
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of the figures; the page is beside it, with .md.")] = Path(
        "docs/real-recordings"
    ),
    also: Annotated[
        list[str] | None,
        typer.Option(help="A method to try beside the paper's; may repeat. Default: all that there are."),
    ] = None,
) -> None:
    """Write a page with a table and a figure per measured source: what each method says against a reference sensor.

    Example: python -m validation.real_recordings --out docs/real-recordings
    """
    try:
        page = write_page(find_recordings(recordings), out, also, lambda text: print(text, file=sys.stderr, flush=True))
    except InputError as error:
        typer.echo(f"real_recordings: {error}", err=True)
        raise typer.Exit(2) from None
    typer.echo(f"{page}")


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
app.command()(command)

if __name__ == "__main__":
    app()
