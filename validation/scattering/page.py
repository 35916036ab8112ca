"""The report of a scatter: where throws land, what scatters them, and from what uncertainties."""

from __future__ import annotations

from pathlib import Path

from discsim.validation.reporting.html import Section, write_report
from discsim.validation.scattering.figures import draw_landings, draw_shares
from discsim.validation.scattering.scattered import PERCENTILES, Scattered

__all__ = ["write_scatter_page"]


def write_scatter_page(found: Scattered, out: Path) -> Path:
    """Write report.html and its figures into ``out``; return the path of the page."""
    draw_landings(found, out / "scatter.png")
    draw_shares(found, out / "sensitivities.png")
    write_report(
        out / "report.html",
        "Where it lands",
        f"{found.headline}.",
        [_landings(found, out), _sensitivities(found, out), _inputs(found)],
    )
    return out / "report.html"


def _landings(found: Scattered, out: Path) -> Section:
    rows = [
        (
            f"{item.name}, {item.unit}",
            f"{item.nominal:.2f}",
            f"{item.mean:.2f}",
            f"{item.sd:.2f}",
            *(f"{value:.2f}" for value in item.values),
        )
        for item in found.percentiles
    ]
    widest = max((high - low) / 2 for item in found.percentiles[:3] for low, high in item.intervals)
    text = [
        "Columns of per cent are percentiles: 5 % of the landings stay below the first. An ellipse has the shape of "
        "the landings' covariance and the size that holds its share of them.",
        f"With these {found.landed} landings a percentile of a distance is known to {widest:.2f} m or better "
        "(95 %, by order statistics).",
        *(f"Note: {note}." for note in found.notes),
    ]
    header = ("result", "without scatter", "mean", "sd", *(f"{q:g} %" for q in PERCENTILES))
    return Section("Landings", text, header, rows, [("Landings seen from above", out / "scatter.png")])


def _sensitivities(found: Scattered, out: Path) -> Section:
    text = [
        "Sobol indices by a polynomial chaos of second order: the share of the variance that an input brings alone, "
        "and with others. Inputs that a fit gives together vary together, and count as one.",
        "The slope is how far the result moves per unit of the input, about the middle of the scatter.",
        *(
            f"{shares.result.capitalize()}: {100 * shares.unexplained:.0f} % of the variance is of higher order, and "
            "in no row below."
            for shares in found.shares
            if shares.unexplained >= 0.05
        ),
    ]
    units = {item.name: item.unit for item in found.inputs.items}
    rows = []
    for shares in found.shares:
        unit = "s" if "time" in shares.result else "m"
        for share in shares.shares:
            for name, slope in zip(share.inputs, share.slopes, strict=True):
                per = f"{unit}/({units[name]})" if "/" in units[name] else f"{unit}/{units[name] or '1'}"
                rows.append(
                    (
                        shares.result,
                        name,
                        f"{100 * share.first:.1f} %",
                        f"{100 * share.total:.1f} %",
                        f"{slope:.3g}",
                        per,
                    )
                )
    header = ("result", "input", "alone", "with others", "slope", "unit")
    return Section("What scatters them", text, header, rows, [("Shares of the variance", out / "sensitivities.png")])


def _inputs(found: Scattered) -> Section:
    rows = [(item.name, f"{item.mean:.5g}", f"{item.sd:.3g}", item.unit, item.source) for item in found.inputs.items]
    text = [f"Seed {found.seed}; {len(found.flown.ends)} flights by the standalone model of 12 states."]
    return Section("What was uncertain", text, ("input", "mean", "sd", "unit", "from"), rows)
