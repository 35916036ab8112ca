"""What a continuous integration shows of a run: annotations where GitHub runs it, and a summary in Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.validation.reporting.markdown import literal
from discsim.validation.reporting.regression import Change
from discsim.validation.reporting.scores import Score

__all__ = ["github_commands", "markdown_summary"]


def github_commands(scores: Sequence[Score], changes: Sequence[Change] = ()) -> list[str]:
    """Return GitHub's workflow commands: an error for each score that fails, a warning for each that got worse."""
    lines = [f"::error title={_property(item.name)}::{_message(_said(item))}" for item in scores if not item.ok]
    for change in changes:
        if change.verdict in ("worse", "gone"):
            said = (
                "is gone" if change.after is None else f"{change.in_tolerances:+.2f} tolerances: {_said(change.after)}"
            )
            lines.append(f"::warning title={_property(change.name)}::{_message(said)}")
    return lines


def _said(item: Score) -> str:
    return f"{item.shown} (expected {item.goal})".replace("±", "+-")


def _message(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _message(text).replace(":", "%3A").replace(",", "%2C")


def markdown_summary(title: str, scores: Sequence[Score], changes: Sequence[Change] = ()) -> str:
    """Return a page in Markdown: the verdict, what fails, what has changed, and every score in a folded table."""
    failed = [item for item in scores if not item.ok]
    verdict = f"{len(failed)} of {len(scores)} scores outside their tolerance" if failed else (
        f"all {len(scores)} scores within their tolerance"
    )  # fmt: skip
    lines = [f"## {title}: {verdict}", ""]
    if failed:
        lines += [*_table(failed), ""]
    notable = [change for change in changes if change.verdict not in ("same", "FAIL still")]
    if notable:
        lines += ["### Changed", "", "| score | before | now | in tolerances | |", "|---|---|---|---|---|"]
        lines += [_changed(change) for change in notable]
        lines.append("")
    lines += ["<details><summary>every score</summary>", "", *_table(scores), "", "</details>", ""]
    return "\n".join(lines)


def _table(scores: Sequence[Score]) -> list[str]:
    rows = [
        f"| {literal(item.name)} | {literal(item.shown)} | {item.expected:g} | {item.tolerance:g} | "
        f"{'ok' if item.ok else '**FAIL**'} |"
        for item in scores
    ]
    return ["| score | value | expected | tolerance | |", "|---|---|---|---|---|", *rows]


def _changed(change: Change) -> str:
    values = ["–" if item is None else f"{item.value:.5g}" for item in (change.before, change.after)]
    moved = f"{change.in_tolerances:+.2f}" if np.isfinite(change.in_tolerances) else "–"
    return f"| {literal(change.name)} | {' | '.join(values)} | {moved} | {change.verdict} |"
