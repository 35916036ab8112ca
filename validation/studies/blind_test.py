"""``discsim study blind-test``: write finished challenges into the page on the blind test."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Annotated

import typer

from discsim.errors import InputError
from discsim.files import read_text, write_bytes, write_text
from discsim.validation.challenge.masks import masked_results
from discsim.validation.challenge.report.document import PREFIX, masks_text, pooled, result_text, with_part
from discsim.validation.challenge.report.page import draw_all
from discsim.validation.challenge.scores.result import RESULT, Result, read_result
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
    if out is None and not masks:
        raise InputError("nothing to write; expected the folder of a challenge, or --masks")
    text = read_text(page)
    plain = None if out is None else read_result(out)
    if plain is not None:
        if plain.mask is not None:
            raise InputError(f"{out}: was made under the mask {plain.mask}; expected it under --masks")
        plain = plain.pooled(*map(read_result, more)) if more else plain
        without = [_blank(folder, plain) for folder in blank or ()]
        near = masked_results(masks or ()).get("near_limit")
        drawn = draw_all(plain.scored, page.parent / "images", PREFIX, pooled(plain, near))
        text = with_part(text, "result", result_text(plain, list(drawn), near, without))
    if masks:
        text = with_part(text, "masks", masks_text(masks, plain))
    write_text(page, text)
    if keep is not None and out is not None:
        for place in (out, *(more or ()), *(blank or ())):
            _keep(place, keep)


def _keep(place: Path, folder: Path) -> None:
    """Write a challenge's file, gzipped, as the number of its first seed: the same bytes for the same cases."""
    file = place / RESULT if place.is_dir() else place
    if file.suffix != ".gz":
        folder.mkdir(parents=True, exist_ok=True)
        first, _ = read_result(place).seeds
        write_bytes(folder / f"{first}.json.gz", gzip.compress(file.read_bytes(), mtime=0))


def _blank(folder: Path, plain: Result) -> Result:
    """Read a challenge that may count for the false alarms of another one; raises `InputError` where it may not."""
    result = read_result(folder)
    if result.mask is not None or any(item.answer.kind not in NOTHING for item in result.scored):
        raise InputError(f"{folder}: conceals something; expected a challenge of --kind {', '.join(NOTHING)}")
    if {item.answer.seed for item in result.scored} & {item.answer.seed for item in plain.scored}:
        raise InputError(f"{folder}: has seeds of the challenge itself; expected others")
    return result
