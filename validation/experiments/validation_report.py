"""The report of a validation run: scores, rate table, throws, C_Nr, concealed cases, somebody's recordings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from discsim.validation.experiments.concealed import Concealed
from discsim.validation.experiments.feedback.experiment import INSIDE
from discsim.validation.experiments.feedback.loop import Loop
from discsim.validation.experiments.feedback.scoring import OUTPUT_ERROR
from discsim.validation.reporting.figures import COLOURS, new_figure, save_figure, symmetric_log
from discsim.validation.reporting.html import Section, write_report
from discsim.validation.reporting.run import Run
from discsim.validation.reporting.scores import Score
from discsim.validation.scenarios.throws import EDGE_S, ThrowResult, rms

__all__ = ["draw_throws", "write_validation_report"]


def draw_throws(results: Sequence[ThrowResult], path: Path) -> None:
    """Draw each throw's error of spin rate by method, and where it flew."""
    figure, axes = new_figure(1, 2, width=11.0, height=4.2)
    for number, result in enumerate(results):
        position = result.motion.position
        axes[0].plot(position[:, 1], position[:, 0], lw=1.2, label=result.throw.name)
        for method in ("accelerometer", "fft", "best"):
            if method not in result.rates:
                continue
            rate = result.rates[method]
            inner = (rate.t >= EDGE_S) & (rate.t <= result.motion.end - EDGE_S)
            axes[1].plot(
                rate.t[inner],
                np.degrees(result.error(method)),
                color=COLOURS[method],
                lw=0.7,
                alpha=0.8,
                label=method if number == 0 else None,
            )
    axes[0].set_title("Seen from above")
    axes[0].set_xlabel("east, m")
    axes[0].set_ylabel("north, m")
    axes[0].set_aspect("equal", adjustable="datalim")
    axes[0].legend(fontsize=7)
    symmetric_log(axes[1], linear=20.0, limit=600.0)
    axes[1].axhline(0, color=COLOURS["truth"], lw=0.8)
    axes[1].set_title("Error of the estimated spin rate on every throw")
    axes[1].set_xlabel("time, s")
    axes[1].set_ylabel("error, deg/s (logarithmic beyond 20)")
    axes[1].legend()
    save_figure(figure, path)


def write_validation_report(
    run: Run,
    scores: Sequence[Score],
    results: Sequence[ThrowResult],
    loop: Loop,
    concealed: Sequence[Concealed],
) -> None:
    """Write ``report.html`` into the run's folder; its figures are there already."""
    failed = sum(not item.ok for item in scores)
    verdict = f"{failed} scores are outside their tolerance" if failed else "every score is within its tolerance"
    sections = [*_scores(scores), _rate_table(run.out), _throws(results, run.out), _loop(loop, run.out)]
    write_report(
        run.out / "report.html",
        "Validation report",
        f"{len(scores)} scores, seed {run.seed}: {verdict}.",
        [*sections, _concealed(concealed)],
    )


def _scores(scores: Sequence[Score]) -> list[Section]:
    groups: dict[str, list[tuple[str, ...]]] = {}
    for item in scores:
        group, _, name = item.name.partition(": ")
        row = (name or group, item.shown, item.goal, "ok" if item.ok else "FAIL")
        groups.setdefault(group, []).append(row)
    header = ("score", "value", "goal", "")
    return [Section(f"Scores: {group}", (), header, rows) for group, rows in groups.items()]


def _rate_table(out: Path) -> Section:
    figures = [("All methods against truth", out / "rate-table.png")]
    if (waveform := out / "waveform.png").exists():  # not for a profile without a plateau
        figures.append(("Waveform and spectrum on the fastest plateau", waveform))
    text = (
        "One MPU-9250, drawn within its data sheet, on a table that runs through plateaus; the wide-range gyroscope "
        "beside it. Envelopes are the accelerometer's worst case for each mount error."
    )
    return Section("Rate table", (text,), figures=figures)


def _throws(results: Sequence[ThrowResult], out: Path) -> Section:
    methods = list(results[0].rates)
    rows = [(one.throw.name, *(_cell(np.degrees(rms(one.error(method)))) for method in methods)) for one in results]
    text = (
        "The disc with its module, the accelerometer 1 mm off along x and y. Figures are rms errors of the spin rate "
        "in deg/s away from the ends of the flight; a dash where a method knows nothing."
    )
    figures = [("Flights and errors", out / "throws.png")]
    return Section("Throws", (text,), ("throw", *methods), rows, figures)


def _loop(loop: Loop, out: Path) -> Section:
    text = (
        "One C_Nr for all throws, by output error and by straight lines and (26), from each method's spin. Errors are "
        "those of the first throw flown with the source's C_Nr (output error) and spin at release; the last column but "
        "one has the true spin, so that only C_Nr is the source's. The paper's table (28) ends where its experiments "
        f"did: flown by it is a throw that stays inside, {INSIDE.name}, with the true release."
    )
    figures = [
        ("Spin, its models and what they leave", out / "cnr.png"),
        ("C_Nr by source", out / "cnr-sources.png"),
        ("The table (28) by the best spin, and the throws that it is from", out / "cnr-table.png"),
        ("Predicted flights against the truth", out / "feedback.png"),
    ]
    header = (
        "spin by",
        "CNr",
        "sd",
        "by (26)",
        "landing, m",
        "track, m",
        "landing by CNr alone, m",
        "landing by (28), m",
    )
    return Section("C_Nr, and the flights that it predicts", (text,), header, _loop_rows(loop), figures)


def _concealed(concealed: Sequence[Concealed]) -> Section:
    text = (
        "Drawn and simulated as discsim challenge does, diagnosed by another process that got the recordings and "
        "nothing else. The command repeats a case alone."
    )
    rows = [case.row for case in concealed]
    return Section("Concealed cases", (text,), ("concealed", "found", "", "command"), rows)


def _loop_rows(loop: Loop) -> list[tuple[str, ...]]:
    predicted = {item.damping.source: item for item in loop.flown[0].predicted if item.damping.way == OUTPUT_ERROR}
    rows = []
    for item in loop.found:
        assert item.fit is not None
        flight = predicted[item.source.label]
        errors = (f"{value:.3f}" for value in (flight.landing, flight.track, flight.damping_only))
        by_table = loop.by_table.get(item.source.label)
        last = "outside" if by_table is None else f"{by_table:.3f}"
        fitted = (f"{item.fit.CNr:.6f}", f"{item.fit.sd:.6f}", f"{item.fit.by_26:.6f}")
        rows.append((item.source.label, *fitted, *errors, last))
    return rows


def _cell(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "\u2013"
