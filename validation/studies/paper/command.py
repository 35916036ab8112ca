"""``discsim study paper``: write the page that sets the paper beside the project."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from discsim.files import write_text
from discsim.validation.reporting.options import SeedOption
from discsim.validation.reporting.run import json_text
from discsim.validation.studies.paper.numbers import compute
from discsim.validation.studies.paper.page import page_text

__all__ = ["NUMBERS", "SEED", "command", "read_numbers"]

#: seed of the page in the documentation
SEED = 0
#: file of the numbers, in the page's folder of figures
NUMBERS = "numbers.json"


def command(
    page: Annotated[Path, typer.Option(help="The page; figures and numbers go into a folder of its name.")] = Path(
        "docs/paper.md"
    ),
    seed: SeedOption = SEED,
    text: Annotated[bool, typer.Option("--text", help="Write the page anew from numbers that are there.")] = False,
) -> None:
    """Compute every number and figure that can be set beside the paper's, and write the page.

    Example: discsim study paper --page docs/paper.md
    """
    folder = page.parent / page.stem
    if not text:
        numbers = compute(seed, folder, lambda step: typer.echo(step, err=True))
        write_text(folder / NUMBERS, json_text(numbers))
    write_text(page, page_text(read_numbers(folder), folder.name))
    typer.echo(f"{page}: written")


def read_numbers(folder: Path) -> dict[str, Any]:
    """Return the numbers that a page was made from."""
    found: dict[str, Any] = json.loads((folder / NUMBERS).read_text(encoding="utf-8"))
    return found
