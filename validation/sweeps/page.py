"""The report of a sweep: which estimator errs least, each one over all that was varied, and every case."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from discsim.validation.reporting.html import Section, write_report
from discsim.validation.sweeps.cases import Row, described

__all__ = ["write_sweep_page"]

#: cases that a page lists; all are in cases.csv
_LISTED = 200

#: a row for each estimator: name, estimates scored, share known, median and 95th percentile of its rms, deg/s
Errors = Sequence[tuple[str, str, str, str, str]]


def write_sweep_page(out: Path, plan: str, varied: str, errors: Errors, rows: Sequence[Row]) -> Path:
    """Write report.html into ``out``, where the figures are already; return the path of the page."""
    header = ("estimator", "mounts scored", "known", "median rms error, deg/s", "95 % of them below, deg/s")
    text = f"Plan '{plan}': {varied}. Every mount is scored on the same true run, so that differences are the mounts'."
    figures = [("Errors by case and rate", out / "sweep.png")]
    sections = [Section("By estimator", (text,), header, errors, figures), _cases(rows)]
    if (out / "shares.png").is_file():
        said = "Total share of each error of the mount in the variance of the rate (Sobol); all are in shares.csv."
        shown = [("Shares of the variance by case", out / "shares.png")]
        sections.append(Section("Which error of the mount it is", (said,), figures=shown))
    write_report(out / "report.html", f"Sweep: {plan}", _answer(errors), sections)
    return out / "report.html"


def _answer(errors: Errors) -> str:
    told = [row for row in errors if row[4]]
    if not told:
        return "No estimator told a rate in any case."
    best = min(told, key=lambda row: float(row[4]))
    others = ", ".join(f"{row[0]} {row[4]}" for row in told if row is not best)
    said = f"{best[0]} errs least: 95 % of its rms errors are below {best[4]} deg/s, half below {best[3]}."
    return f"{said} The same limit of the others: {others} deg/s." if others else said


def _cases(rows: Sequence[Row]) -> Section:
    shown = []
    for row in rows[:_LISTED]:
        rate = "all" if np.isnan(row.rate_deg_s) else f"{row.rate_deg_s:,.0f}"
        figures = (row.mean, row.rms, row.most, row.CNr_percent, row.landing_m)
        cells = ("–" if np.isnan(value) else f"{value:.3g}" for value in figures)
        shown.append((described(row.place), row.estimator, rate, str(row.mounts), f"{100 * row.read:.0f} %", *cells))
    text = [
        "Errors are biases of the mounts in per cent of the rate: mean, rms, and what 95 % of the mounts stay below. "
        "The last two columns are what they become in C_Nr and in the place where a shipped throw lands."
    ]
    text += [f"{len(rows) - _LISTED} more are in cases.csv."] if len(rows) > _LISTED else []
    header = ("case", "estimator", "rate, deg/s", "mounts", "read", "mean, %", "rms, %", "95 % below, %")
    return Section("Cases", text, (*header, "C_Nr, % (rms)", "landing, m (rms)"), shown)
