"""Two runs side by side: which score has changed, and by how much of its tolerance."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from discsim.errors import InputError
from discsim.files import read_text
from discsim.validation.reporting.figures import COLOURS, new_figure, save_figure
from discsim.validation.reporting.html import Section, write_report
from discsim.validation.reporting.scores import Score, score

__all__ = ["Change", "compare_scores", "read_scores", "write_regression"]

#: a change below this share of the tolerance is none worth naming: the same seed on another machine stays below it
NOTABLE = 0.05


@dataclass(frozen=True)
class Change:
    """One score in both runs; None in the run that has it not."""

    name: str
    before: Score | None
    after: Score | None

    @property
    def in_tolerances(self) -> float:
        """How much farther from what is expected the new value is, in the new tolerance; negative where it is nearer.

        NaN where one of the two does not know it; infinite where no tolerance is left to count in.
        """
        if self.before is None or self.after is None:
            return float("nan")
        was, now = abs(self.before.value - self.before.expected), abs(self.after.value - self.after.expected)
        if now == was:
            return 0.0
        return float((now - was) / self.after.tolerance) if self.after.tolerance else float(np.sign(now - was) * np.inf)

    @property
    def verdict(self) -> str:
        """What has become of it, in a word or two."""
        if self.before is None:
            return "new" if self.after is not None and self.after.ok else "new, FAIL"
        if self.after is None:
            return "gone"
        if self.before.ok != self.after.ok:
            return "ok again" if self.after.ok else "FAIL now"
        if not self.after.ok:
            return "FAIL still"
        change = self.in_tolerances
        if abs(change) < NOTABLE:
            return "same"
        return "worse" if change > 0 else "better"


def read_scores(place: Path) -> list[Score]:
    """Return the scores of an earlier run: its folder, or its scores.json. Raises `InputError` where there are none."""
    path = place / "scores.json" if place.is_dir() else place
    try:
        entries = json.loads(read_text(path))
        return [_score(entry) for entry in entries]
    except (ValueError, TypeError, KeyError):
        raise InputError.at(
            path, None, "holds no scores; expected the scores.json that discsim validate wrote"
        ) from None


def _score(entry: dict[str, Any]) -> Score:
    value = float("nan") if entry["value"] is None else float(entry["value"])
    return score(str(entry["name"]), value, str(entry["unit"]), float(entry["expected"]), float(entry["tolerance"]))


def compare_scores(before: Sequence[Score], after: Sequence[Score]) -> list[Change]:
    """Return the changes by name: those of the new run in its order, then what is gone."""
    old, new = {item.name: item for item in before}, {item.name: item for item in after}
    return [Change(name, old.get(name), new.get(name)) for name in dict.fromkeys((*new, *old))]


def write_regression(out: Path, changes: Sequence[Change], against: str) -> None:
    """Write ``against.html`` and its figure into a folder: changed scores first, those that fail before all."""
    order = ("FAIL now", "new, FAIL", "FAIL still", "gone", "worse", "ok again", "new", "better", "same")
    ranked = sorted(changes, key=lambda change: order.index(change.verdict))
    counts = {verdict: sum(change.verdict == verdict for change in changes) for verdict in order}
    lead = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count) or "no scores"
    _draw(ranked, out / "against.png")
    section = Section(
        "Every score in both runs",
        (
            "Change: how much farther from what is expected the new value is, in units of its tolerance. Less than "
            f"{NOTABLE:g} is called the same.",
        ),
        ("score", "unit", "before", "now", "expected", "tolerance", "change", ""),
        [_row(change) for change in ranked],
        figures=[("Distance from what is expected, in tolerances", out / "against.png")],
    )
    write_report(out / "against.html", f"Against {against}", f"{lead}.", [section])


def _row(change: Change) -> tuple[str, ...]:
    one = change.after or change.before
    assert one is not None
    values = ["–" if item is None else f"{item.value:.5g}" for item in (change.before, change.after)]
    moved = change.in_tolerances
    return (
        change.name,
        one.unit,
        *values,
        f"{one.expected:g}",
        f"{one.tolerance:g}",
        f"{moved:+.2f}" if np.isfinite(moved) else "–",
        change.verdict,
    )


def _draw(changes: Sequence[Change], path: Path) -> None:
    """Draw each score before and now by its distance from what is expected over its tolerance."""
    figure, axes = new_figure(width=10.0, height=1.2 + 0.24 * max(len(changes), 1))
    for row, change in enumerate(changes):
        places = [_place(item) for item in (change.before, change.after)]
        axes.plot(places, [row, row], color=COLOURS["accelerometer_calibrated"], lw=0.8)
        axes.plot(places[0], row, "o", mfc="white", mec=COLOURS["accelerometer"], label="before" if row == 0 else None)
        axes.plot(places[1], row, "o", color=COLOURS["fft"], ms=4, label="now" if row == 0 else None)
    axes.axvspan(-1.0, 1.0, color="0.92", lw=0, zorder=0)
    axes.set_yticks(range(len(changes)), [change.name for change in changes], fontsize=7)
    axes.set_ylim(len(changes) - 0.5, -0.5)
    axes.set_xlim(-1.6, 1.6)
    axes.set_xlabel("(value - expected) / tolerance; what is beyond is drawn at the edge")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8)
    save_figure(figure, path)


def _place(item: Score | None) -> float:
    if item is None or not np.isfinite(item.value):
        return float("nan")
    off = item.value - item.expected
    return float(np.clip(off / item.tolerance if item.tolerance else np.sign(off) * 2.0, -1.5, 1.5))
