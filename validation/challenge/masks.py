"""The same cases under every mask in turn: how the score degrades when effects hide under something else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from discsim.validation.challenge.blind import Request
from discsim.validation.challenge.cases.case import MASKS, Mask
from discsim.validation.challenge.report.page import percent
from discsim.validation.challenge.run import challenge
from discsim.validation.challenge.scores.result import RESULT, Result, Scored, rates_of, read_result, times
from discsim.validation.reporting.html import Section, write_report
from discsim.validation.reporting.run import Run

__all__ = ["MASK_HEADER", "challenge_masks", "mask_row", "masked_results"]

#: columns of `mask_row`, and the rates in them
MASK_HEADER = (
    "cases",
    "right verdict",
    "right set, all sizes",
    "false alarms",
    "misnamed",
    "no answer",
    "time",
)
_RATES = (
    "right_verdict_rate",
    "right_set_rate",
    "false_alarm_rate",
    "off_catalogue_misnamed_rate",
    "crash_rate",
)


def challenge_masks(
    run: Run,
    requests: Sequence[Request],
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    anew: bool = False,
    command: Sequence[str] | None = None,
) -> dict[Mask | None, list[Scored]]:
    """Put the diagnosis to the test under each mask, in a folder of its own in the run's; write a table of them.

    The options are those of `discsim.validation.challenge.run.challenge`. What is done is not done again.
    """
    masked = {mask: [request._replace(mask=mask) for request in requests] for mask in MASKS}
    for group in masked.values():
        group[0].draw()  # a mask under which nothing can be concealed is refused before hours are spent
    results: dict[Mask | None, list[Scored]] = {}
    for mask, group in masked.items():
        run.step(f"mask {mask}: {MASKS[mask]}")
        (run.out / mask).mkdir(exist_ok=True)
        part = Run(run.out / mask, run.command, run.seed)
        results[mask] = challenge(part, group, scheduler=scheduler, workers=workers, anew=anew, command=command)
        write_masks_page(run.out, results)
    return results


def write_masks_page(out: Path, results: Mapping[Mask | None, Sequence[Scored]]) -> None:
    """Write ``report.html`` with a row for each mask into ``out``."""
    rows = [(mask or "none", MASKS[mask] if mask else "", *mask_row(scored)) for mask, scored in results.items()]
    text = (
        "The same cases under each mask; each has a report of its own in its folder. Intervals are Clopper and "
        "Pearson's, of 95 %. Time is the median of a diagnosis."
    )
    section = Section("Masks", (text,), ("mask", "what", *MASK_HEADER), rows)
    write_report(out / "report.html", "Blind test of the diagnosis under masks", "How the score degrades.", [section])


def mask_row(scored: Sequence[Scored]) -> tuple[str, ...]:
    """Return a row of the table of masks, as `MASK_HEADER` names its columns."""
    rates = rates_of(scored)
    cells = []
    for name in _RATES:
        found = rates[name]
        share, interval = percent(found)
        cells.append(f"{share} ({interval}; {found.hits} of {found.of})" if found.of else "no such case")
    return (str(len(scored)), *cells, f"{times(scored).median_s:.0f} s")


def masked_results(folders: Sequence[Path]) -> dict[Mask, Result]:
    """Read finished challenges under a mask from folders, or from folders in them; in the order of `MASKS`.

    A mask that is not there, or not finished, is left out. Raises `InputError` where a folder that holds a result
    holds one that cannot be read.
    """
    found: dict[str | None, Result] = {}
    for folder in folders:
        places = [folder] if (folder / RESULT).exists() else [folder / mask for mask in MASKS]
        for place in places:
            if (place / RESULT).exists():
                result = read_result(place)
                found[result.mask] = result
    return {mask: found[mask] for mask in MASKS if mask in found}
