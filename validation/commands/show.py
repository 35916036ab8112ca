"""``discsim show``: a disc, part, throw, site, map, sweep or effect by its name."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["command"]


def command(
    name: Annotated[
        str, typer.Argument(help="A name of `discsim list`; throws/driver is the throw that shares it with a disc.")
    ],
) -> None:
    """Show what is shipped: a disc, part, throw, map or effect.

    What else has that name is told on standard error, so that `discsim show driver > mine.toml` writes a disc.

    Example: discsim show driver
    """
    from discsim.listing import namesakes, shown

    typer.echo(shown(name), nl=False)
    for other in namesakes(name):
        typer.echo(f"{name} is the name of {other}, too: discsim show {other}", err=True)
