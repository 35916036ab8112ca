"""``discsim study``: the pages and tables of the documentation, each made anew by its own program."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["CONTEXT", "command"]

#: all that stands behind the study's name is the study's own
CONTEXT = {"allow_extra_args": True, "ignore_unknown_options": True, "allow_interspersed_args": False}


def command(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(help="The study. Without one they are listed.")] = None,
) -> None:
    """Run a study of the documentation; without a name list them.

    NAME --help shows a study's options.

    Example: discsim study paper --page docs/paper.md
    """
    from discsim.validation.studies.catalogue import STUDIES, run_study

    if name is None:
        for known, study in STUDIES.items():
            typer.echo(f"{known:16} {study.line}")
        return
    run_study(name, context.args)
