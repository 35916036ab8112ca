"""``discsim list``: what is shipped of a kind."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["command"]


def command(
    kind: Annotated[str, typer.Argument(help="discs, parts, throws, sites, tables, maps, sweeps or effects.")],
) -> None:
    """List what is shipped: discs, parts, throws, effects and more.

    Example: discsim list discs
    """
    from discsim.listing import listed

    found = listed(kind)
    width = max(map(len, found))
    for name, line in found.items():
        typer.echo(f"{name:{width}}  {line}".rstrip())
