"""``discsim show``: a disc, part, throw, site, map, sweep or effect by its name."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["command"]


def command(
    name: Annotated[str, typer.Argument(help="A name of `discsim list`; discs/driver is the disc of that name alone.")],
) -> None:
    """Show what is shipped: a disc, part, throw, map or effect.

    Example: discsim show driver
    """
    from discsim.listing import shown

    typer.echo(shown(name), nl=False)
