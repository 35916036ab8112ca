"""The report of a fit of C_Nr: the value with its deviation, by each source of spin, by throw, and what to doubt."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from discsim.validation.reporting.html import Section, write_report
from discsim.validation.yaw_damping.compared import Compared
from discsim.validation.yaw_damping.output_error import Fit
from discsim.validation.yaw_damping.paper_table import PaperTable

__all__ = ["write_fit_page"]


def write_fit_page(
    out: Path,
    fit: Fit,
    paper: PaperTable,
    sources: Sequence[Compared],
    notes: Sequence[str],
    before: Sequence[str] = (),
) -> Path:
    """Write report.html into ``out``, where the figures are already; return the path of the page.

    ``notes`` are of the fit, and what is doubtful ``before`` it of the recordings.
    """
    share = f", {100 * fit.sd / abs(fit.CNr):.2g} % of it" if fit.CNr else ""
    lead = (
        f"C_Nr = {fit.CNr:.6f} ± {fit.sd:.6f} (one standard deviation{share}), from "
        f"{len(fit.throws)} throw{'s' * (len(fit.throws) > 1)}, spin by {fit.method}."
    )
    if notes:
        lead += " The model does not fit as well as it should: see below before you use it."
    elif before:
        lead += " Of the recordings something must be known: see below before you use it."
    heeded = [*before, *notes]
    doubts = [Section("Before you believe it", [f"{note[:1].upper()}{note[1:]}." for note in heeded])] if heeded else []
    sections = [*doubts, _throws(fit, out), _sources(sources, out), _others(fit), _table(out, fit, paper)]
    write_report(
        out / "report.html",
        "The yaw damping derivative C_Nr",
        lead,
        [section for section in sections if section is not None],
        "heed" if heeded else "good",
    )
    return out / "report.html"


def _throws(fit: Fit, out: Path) -> Section:
    rows = []
    for throw in fit.throws:
        spin = np.degrees(throw.spin_residual[np.isfinite(throw.spin_residual)])
        place = throw.path_residual[:, :3]
        place = place[np.isfinite(place)]
        rows.append(
            (
                throw.name,
                f"{np.nanmax(throw.speed):.1f} to {np.nanmin(throw.speed):.1f}",
                f"{_rms(spin):.3g}",
                f"{_rms(throw.spin_z):.2f}",
                f"{_rms(place):.3g}",
                f"{_rms(throw.path_z):.2f}",
            )
        )
    text = (
        "One model flight for each throw, all with one C_Nr: residuals are what was measured less that flight. In "
        "units of the stated standard deviation honest noise has 1."
    )
    header = (
        *("throw", "airspeed, m/s", "spin residual, deg/s (rms)", "in stated sd"),
        *("place residual, m (rms)", "path in stated sd"),
    )
    return Section("How the model flights fit", (text,), header, rows, [("Spin, and its residuals", out / "fit.png")])


def _sources(sources: Sequence[Compared], out: Path) -> Section:
    rows: list[Sequence[str]] = [
        (one.source.label, "–", "–", "–", one.reason)
        if one.fit is None
        else (one.source.label, f"{one.fit.CNr:.6f}", f"{one.fit.sd:.6f}", f"{one.fit.by_26:.6f}", "")
        for one in sources
    ]
    header: Sequence[str] = ("spin by", "C_Nr", "sd", "by (26)", "left out because")
    columns = len(header) - all(one.fit is not None for one in sources)
    text = (
        "The same throws with the spin from other methods. Millimetres are by how much the accelerometer is taken to "
        "sit beside its stated place, as in the paper. By (26): the paper's equation with these flights' own r, V and "
        "rate of change. It takes the spin to fall along a straight line and leaves the rolling moment out, so it may "
        "differ from C_Nr by far more than the sd."
    )
    rows = [row[:columns] for row in rows]
    return Section("By source of spin", (text,), header[:columns], rows, [("C_Nr by source", out / "sources.png")])


def _others(fit: Fit) -> Section | None:
    if not fit.others:
        return None
    rows = [(name, f"{value:.6g}", f"{sd:.2g}") for name, (value, sd) in fit.others.items()]
    text = "These were stated with a standard deviation, and could move within it."
    return Section("Other coefficients, refined with it", (text,), ("coefficient", "value", "sd"), rows)


def _table(out: Path, fit: Fit, paper: PaperTable) -> Section:
    text = (
        "The paper's way to C_Nr: straight lines through the spin, and (26) at each rate and airspeed. Its table is in "
        "cnr_table.csv; model.toml is the disc with the value above, model-table.toml the disc with the table."
    )
    share = _share_inside(fit, paper)
    where = (
        "These flights stay inside the table."
        if share == 1.0
        else f"These flights are inside the table for {100 * share:.0f} % of their time: a flight with "
        "model-table.toml ends with an error where it leaves the table. Use model.toml."
    )
    figures = [("The paper's table over spin rate and airspeed, and these flights", out / "surface.png")]
    return Section("The paper's table", (text, where), figures=figures)


def _share_inside(fit: Fit, paper: PaperTable) -> float:
    """Return the share of the model flights' time, each weighed alike, in which the table has a value."""
    inside = []
    for throw in fit.throws:
        state = throw.flight.at(np.linspace(0.0, throw.flight.end, 200))
        speed = np.linalg.norm(state.velocity - throw.flight.environment.wind, axis=1)
        inside.append(np.mean(np.isfinite(paper.at(state.rate[:, 2], speed))))
    return float(np.mean(inside))


def _rms(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")
