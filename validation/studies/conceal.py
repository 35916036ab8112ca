"""``discsim study conceal``: conceal effects in recordings, without diagnosing them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from discsim.files import write_text
from discsim.recording import Plant
from discsim.validation.challenge.cases.case import Kind, Mask
from discsim.validation.challenge.cases.conceal import conceal
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.reporting.options import SeedOption

__all__ = ["command"]


def command(
    out: Annotated[Path, typer.Option(help="Folder to write into; created where absent.")],
    seed: SeedOption = 0,
    cases: Annotated[int, typer.Option(min=1, help="Number of cases; case k has seed --seed + k.")] = 1,
    plant: Annotated[Plant | None, typer.Option(help="Only this plant. Default: all four.")] = None,
    effect: Annotated[
        list[str] | None, typer.Option(help="An id of the catalogue, or one off-catalogue name; may repeat.")
    ] = None,
    kind: Annotated[Kind | None, typer.Option(help="Only this kind of case. Default: as drawn.")] = None,
    mask: Annotated[Mask | None, typer.Option(help="Put this over every case.")] = None,
) -> None:
    """Simulate cases in MuJoCo, write plain recordings, and seal the answers away from them.

    Writes CASE/01.. (recordings), answers/CASE.toml and sealed.json (digests of both, to be published before anybody
    diagnoses) into --out.

    Example: discsim study conceal --seed 1 --cases 3 --out cases
    """
    digests = {}
    for number in range(seed, seed + cases):
        case = draw_case(number, plant, effect or (), kind, mask)
        name = f"case-{number:05d}"
        digests[name] = conceal(case, out / name, out / "answers" / f"{name}.toml")
        typer.echo(f"{name}: {case.plant}, {len(case.runs)} recordings")
        write_text(out / "sealed.json", json.dumps(digests, indent=2) + "\n")
