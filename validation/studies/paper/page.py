"""The page of the documentation that sets the paper beside the project: docs/paper.md, from the computed numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from discsim.validation.reporting import markdown
from discsim.validation.studies.paper.beside import BLOCKS, figure_rows, number_rows
from discsim.validation.studies.paper.distance import PAPER_M
from discsim.validation.studies.paper.equations import EQUATIONS, STEPS, Row, summary

__all__ = ["page_text"]


def page_text(numbers: Mapping[str, Any], folder: str) -> str:
    """Return the page; ``folder`` is where its figures are, from the page."""
    prediction, distance, ways = numbers["fig_13"], numbers["distance"], numbers["fig_9"]["ways"]
    alike = sorted(one["distance"] for name, one in ways.items() if name.endswith("same speed and spin"))
    return markdown.page_text(
        Path(__file__).with_name("page.md.j2"),
        n=numbers,
        folder=folder,
        cells=_cells,
        said=_said,
        equations=EQUATIONS,
        steps=STEPS,
        figures=figure_rows(),
        blocks=[(what, f"`{name}`") for what, name in BLOCKS],
        numbers=number_rows(numbers),
        ways=_ways(ways),
        alike=[_percent(one) for one in alike],
        damping=_damping(prediction["table"]),
        predicted=_predicted(prediction["predicted"]),
        moves=[(name, f"{metres:.2f}") for name, metres in prediction["moves_m"].items()],
        paper_m=PAPER_M,
        needed=_needed(distance["unknowns"]),
        can=_enumerated([name for name, one in distance["unknowns"].items() if one["needed"]]),
        discs=", ".join(f"{name} {metres:.0f}" for name, metres in distance["discs"].items()),
        undamped=", ".join(f"{name} {a:.1f} and {b:.1f}" for name, (a, b) in distance["undamped_m"].items()),
    )


def _cells(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    return [
        (f"({row.number})", row.says, "<br>".join(f"`{name}`" for name in row.names), row.departs or "as printed")
        for row in rows
    ]


def _said(rows: Sequence[Row]) -> list[str]:
    """Return what each function of the rows says of itself."""
    names = dict.fromkeys(name for row in rows for name in row.names)
    return [f"`{name.rpartition('.')[2]}`: {summary(name)}." for name in names]


def _ways(ways: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of the two modules: what is kept alike between the throws, and what comes of it."""
    rows: list[tuple[str, ...]] = []
    for name, one in ways.items():
        release, _, way = name.partition(": ")
        more = one["more_CD_needed"]
        rows.append(
            (
                release,
                way,
                f"{_percent(one['spin'])}",
                f"{_percent(one['time'])}",
                f"{_percent(one['distance'])}",
                f"{_percent(one['distance_with_bluff_module'])}",
                "none" if more is None else f"{more:.3f}",
            )
        )
    return rows


def _damping(table: Mapping[str, Any]) -> list[tuple[str, ...]]:
    return [
        (
            label,
            str(one["throws"]),
            f"{one['slope_deg_s2'][0]:.0f} to {one['slope_deg_s2'][1]:.0f}",
            f"{1000 * one['nodes'][1]:.2f} to {1000 * one['nodes'][0]:.2f}",
            f"{1000 * one['along'][1]:.2f} to {1000 * one['along'][0]:.2f}",
            f"{1000 * one['mean_along']:.2f}",
        )
        for label, one in table.items()
        if isinstance(one, Mapping) and "mean_along" in one
    ]


def _predicted(predicted: Mapping[str, Any]) -> list[tuple[str, ...]]:
    return [
        (
            label,
            f"{one['spin_deg_s']:.0f}",
            one["reason"] or f"{one['landing_m']:.2f}",
            "" if one["track_m"] is None else f"{one['track_m']:.2f}",
        )
        for label, one in predicted.items()
    ]


def _needed(unknowns: Mapping[str, Any]) -> list[tuple[str, ...]]:
    def listed(values: Sequence[float], unit: str) -> str:
        return " or ".join(f"{value:.3g} {unit}".strip() for value in values) or "none"

    return [
        (
            name,
            f"{one['taken']:g} {one['unit']}".strip(),
            f"{one['range'][0]:g} to {one['range'][1]:g}",
            f"{one['least_m']:.0f} to {one['most_m']:.0f}",
            listed(one["needed"], one["unit"]),
            listed(one["needed_at_23"], one["unit"]),
        )
        for name, one in sorted(unknowns.items(), key=lambda item: -item[1]["most_m"])
    ]


def _enumerated(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _percent(ratio: float) -> str:
    """Return a ratio as a change, without the sign of a zero."""
    return f"{round(100 * (ratio - 1)) + 0:+d} %"
