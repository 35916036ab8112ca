"""The report of a rate-table run: which method errs least, methods by rate and plateau, checks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from discsim.validation.reporting.html import Section, Tone, write_report
from discsim.validation.reporting.scores import Score
from discsim.validation.scenarios.rate_table import Plateau
from discsim.validation.scenarios.table_scores import MethodScore, TableScores

__all__ = ["write_table_page"]

#: a method is taken for the answer where it knows the rate for at least this share of the run
_KNOWN = 0.5


def write_table_page(
    out: Path,
    scores: TableScores,
    plateaus: Sequence[Plateau] = (),
    checks: Sequence[Score] = (),
    compared: Sequence[str] = (),
) -> Path:
    """Write report.html into ``out``, where the figures are already; return the path of the page.

    ``compared`` says how a measured run errs beside its emulation; then the scores are those of the measured run.
    """
    lead, tone = _answer(scores.methods), _tone(checks)
    if compared:
        lead = f"{lead} {next(line for line in compared if not line.startswith('note: '))}"
    elif checks:
        kept = sum(item.ok for item in checks)
        lead += f" {kept} of {len(checks)} checks against the paper are within their tolerance."
    sections = [_methods(scores, out, measured=bool(compared))]
    if compared:
        figures = [("Measured and emulated errors", out / "comparison.png")]
        sections.insert(0, Section("Beside its emulation", list(compared), figures=figures))
    if checks:
        rows = [(item.name.partition(": ")[2] or item.name, item.shown, item.goal, "ok" if item.ok else "FAIL")
                for item in checks]  # fmt: skip
        sections.append(Section("Checks against the paper", (), ("figure", "value", "goal", ""), rows))
    sections.append(_bands(scores))
    if plateaus:
        sections.append(_plateaus(plateaus, out))
    write_report(out / "report.html", "Rate-table run", lead, sections, tone)
    return out / "report.html"


def _tone(checks: Sequence[Score]) -> Tone:
    return "plain" if not checks else "good" if all(item.ok for item in checks) else "bad"


def _answer(methods: Sequence[MethodScore]) -> str:
    knowing = [one for one in methods if one.known >= _KNOWN and np.isfinite(one.rms)]
    if not knowing:
        return f"No method knows the rate for {100 * _KNOWN:.0f} % of the run."
    best = min(knowing, key=lambda one: one.rms)
    rest = "; ".join(f"{one.method} {np.degrees(one.rms):.3g}" for one in knowing if one is not best)
    told = f"{100 * best.known:.0f} % of the run"
    said = f"{best.method} errs least: {np.degrees(best.rms):.3g} deg/s rms where it knows the rate, {told}."
    return f"{said} The others: {rest} deg/s." if rest else said


def _methods(scores: TableScores, out: Path, measured: bool) -> Section:
    rows = [
        (
            one.method,
            f"{100 * one.known:.0f} %",
            *_degrees(one.bias, one.rms, one.worst),
            "–" if np.isnan(one.delay) else f"{1000 * one.delay:.1f} ± {1000 * one.delay_sd:.1f}",
        )
        for one in scores.methods
    ]
    against = "the rate reference" if measured else "the truth"
    text = f"Errors of the spin rate against {against}, in deg/s; the delay is by how much an estimate comes late."
    header = ("method", "known", "bias", "rms", "worst", "delay, ms")
    figures = [] if measured else [("All methods against the truth (as the paper's Fig. 7)", out / "methods.png")]
    return Section("By method", (text,), header, rows, figures)


def _bands(scores: TableScores) -> Section:
    rows = []
    for band in scores.bands:
        low, high = np.degrees(band.low), np.degrees(band.high)
        between = f"{low:,.0f} to {high:,.0f}" if np.isfinite(high) else f"above {low:,.0f}"
        known = f"{100 * band.known:.0f} %"
        rows.append((band.method, between, str(band.count), known, *_degrees(band.bias, band.rms, band.worst)))
    header = ("method", "rate, deg/s", "values", "known", "bias, deg/s", "rms, deg/s", "worst, deg/s")
    return Section("By rate", ("The same errors, by the size of the true rate.",), header, rows)


def _plateaus(found: Sequence[Plateau], out: Path) -> Section:
    rows = []
    for row in found:
        percent = f"{100 * row.bias / row.rate:.3f}" if row.rate and np.isfinite(row.bias) else "–"
        known = f"{100 * row.known:.0f} %"
        rows.append((f"{np.degrees(row.rate):.0f}", row.method, known, *_degrees(row.bias, row.sd, row.worst), percent))
    header = ("plateau, deg/s", "method", "known", "bias, deg/s", "sd, deg/s", "worst, deg/s", "bias, %")
    waveform = out / "waveform.png"
    figures = [("Waveform and spectrum on the fastest plateau", waveform)] if waveform.is_file() else []
    return Section("By plateau", (), header, rows, figures)


def _degrees(*values: float) -> list[str]:
    return ["–" if np.isnan(value) else f"{np.degrees(value):.2f}" for value in values]
