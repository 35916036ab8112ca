"""``discsim study blind-test``: write finished challenges into the page on the blind test."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Annotated

import typer

from discsim.errors import InputError
from discsim.files import read_text, write_bytes, write_text
from discsim.validation.challenge.masks import masked_results
from discsim.validation.challenge.report.document import (
    PREFIX,
    masks_text,
    pooled,
    result_text,
    runs_text,
    with_part,
)
from discsim.validation.challenge.report.page import draw_all
from discsim.validation.challenge.scores.result import Result, read_result, result_file
from discsim.validation.challenge.scores.scoring import NOTHING

__all__ = ["command"]


def command(
    out: Annotated[Path | None, typer.Argument(help="Folder of a finished challenge without a mask.")] = None,
    more: Annotated[
        list[Path] | None,
        typer.Option(help="Challenges of one code with it, on other seeds; may repeat."),
    ] = None,
    masks: Annotated[list[Path] | None, typer.Option(help="Challenges with a mask; may repeat.")] = None,
    blank: Annotated[list[Path] | None, typer.Option(help="Challenges that conceal nothing; may repeat.")] = None,
    runs: Annotated[
        Path | None, typer.Option(help="Folder that --keep filled: a row for each challenge in it, into --page.")
    ] = None,
    page: Annotated[Path, typer.Option(help="The page; its figures go into images beside it.")] = Path(
        "docs/challenge.md"
    ),
    keep: Annotated[
        Path | None, typer.Option(help="Folder in which each challenge's cases are kept, as SEED.json.gz.")
    ] = None,
) -> None:
    """Put result, confusions, failures and figures of a challenge into its page, and a row for each mask.

    Only what stands between the page's marks is replaced. A challenge is its folder, or a file that --keep left.

    Example: discsim study blind-test challenge --masks challenge-masks
    """
    if out is None and not masks and runs is None:
        raise InputError("nothing to write; expected the folder of a challenge, --masks or --runs")
    plain: Result | None = None
    read = [] if out is None else [read_result(place) for place in (out, *(more or ()))]
    if not page.is_file():
        raise InputError(f"{page}: no such page; expected one with the page's marks, as in a checkout, with --page")
    text = read_text(page)
    if out is not None:
        first, *others = read
        if first.mask is not None:
            raise InputError(f"{out}: was made under the mask {first.mask}; expected it under --masks")
        plain = first.pooled(*others)
        without = [_blank(folder, plain) for folder in blank or ()]
        read += without
        near = masked_results(masks or ()).get("near_limit")
        drawn = draw_all(plain.scored, page.parent / "images", PREFIX, pooled(plain, near))
        text = with_part(text, "result", result_text(plain, list(drawn), near, without))
    if masks:
        text = with_part(text, "masks", masks_text(masks, plain))
    if runs is not None:
        text = with_part(text, "runs", runs_text([read_result(file) for file in _kept(runs)]))
    write_text(page, text)
    if keep is not None and out is not None:
        for place, result in zip((out, *(more or ()), *(blank or ())), read, strict=True):
            _keep(result_file(place), keep / f"{result.seeds[0]}.json.gz")


def _kept(folder: Path) -> list[Path]:
    """Return the files that `--keep` left in a folder, by seed; raises `InputError` where there is none."""
    files = sorted(folder.glob("*.json.gz"))
    if not files:
        raise InputError(f"{folder}: holds no challenge; expected a folder that --keep filled")
    return files


def _keep(file: Path, kept: Path) -> None:
    """Write a challenge's file to ``kept``, gzipped: the same bytes for the same cases. What is kept already stays.

    The folder that the challenge was written to is called by its own name, for nobody else has those above it.
    """
    if file.suffix != ".gz":
        kept.parent.mkdir(parents=True, exist_ok=True)
        folder = file.resolve().parent
        text = file.read_text(encoding="utf-8").replace(str(folder), folder.name)
        write_bytes(kept, gzip.compress(text.encode(), mtime=0))


def _blank(folder: Path, plain: Result) -> Result:
    """Read a challenge that may count for the false alarms of another one; raises `InputError` where it may not."""
    result = read_result(folder)
    if result.mask is not None or any(item.answer.kind not in NOTHING for item in result.scored):
        raise InputError(f"{folder}: conceals something; expected a challenge of --kind {', '.join(NOTHING)}")
    if {item.answer.seed for item in result.scored} & {item.answer.seed for item in plain.scored}:
        raise InputError(f"{folder}: has seeds of the challenge itself; expected others")
    return result
