"""The report of a challenge: the goals and what was measured, confusions, deviations, limits, and every failure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from validation.challenge.scoring import Rate, confusion, median, rate
from validation.figures import new_figure, save_figure
from validation.report import Section, write_report

if TYPE_CHECKING:
    from validation.challenge.run import Scored

__all__ = ["GOALS", "Goal", "goals_met", "write_page"]


class Goal(NamedTuple):
    """What a rate of the summary should be: between ``low`` and ``high``; its interval may reach ``reach``."""

    text: str
    low: float
    high: float
    reach: float = 1.0

    def met(self, found: Rate) -> bool | None:
        """Tell whether the goal is met; None where no case bears on it."""
        if not found.of:
            return None
        return self.low <= found.value <= self.high and found.high <= self.reach


#: rate of the summary -> its goal, for 300 cases or more
GOALS: Mapping[str, Goal] = {
    "false_alarm_rate": Goal("at most 1 %, upper bound at most 3 %", 0.0, 0.01, 0.03),
    "right_set_rate_above_twice_the_limit": Goal("at least 95 %", 0.95, 1.0),
    "coverage_2sd": Goal("92 to 98 %", 0.92, 0.98),
    "off_catalogue_misnamed_rate": Goal("at most 5 %", 0.0, 0.05),
    "crash_rate": Goal("none", 0.0, 0.0),
}


def goals_met(rates: Mapping[str, Rate], *, few: bool) -> bool:
    """Tell whether every goal is met that cases bear on.

    ``few`` cases cannot show a rate of one per cent: then a goal counts as missed only where its interval excludes it.
    """
    for name, goal in GOALS.items():
        found = rates[name]
        if few and found.of and (found.low > goal.high or found.high < goal.low):
            return False
        if not few and goal.met(found) is False:
            return False
    return True


def write_page(out: Path, scored: Sequence[Scored], rates: Mapping[str, Rate]) -> None:
    """Draw the figures and write ``report.html`` into ``out``."""
    figures = out / "figures"
    triples = [(item.answer, item.diagnosis, item.score) for item in scored]
    table = confusion(triples)
    draw_confusion(table, figures / "confusion.png")
    sections = [
        _goals(rates),
        _kinds(scored),
        Section(
            "What was named in place of what",
            (
                "Rows are what was concealed, columns what was named; where nothing was named the verdict stands. Of "
                "two concealed effects each is a row. Violet is right, orange a mistake.",
            ),
            figures=[("Concealed (rows) and named (columns), number of cases", figures / "confusion.png")],
        ),
        _by_effect(scored),
    ]
    deviates = np.array([z for item in scored for each in item.score.deviations if (z := each.in_sd) is not None])
    if deviates.size:
        draw_deviates(deviates, figures / "deviates.png")
        sections.append(
            Section(
                "Are the standard errors honest?",
                (
                    f"{deviates.size} parameters of effects that were concealed and named, and of coefficients that "
                    "were stated with a sigma: how many of its own standard deviations each lies off its true value.",
                ),
                figures=[("Errors of parameters in their own standard deviations", figures / "deviates.png")],
            )
        )
    sized = [(item.strength, item.score.right_set, item) for item in scored if item.strength is not None]
    if sized:
        draw_detection([(size, right) for size, right, _ in sized], figures / "detection.png")
        sections.append(
            Section(
                "How small an effect is found",
                (
                    "Size of the smaller concealed effect of a case in units of its detection limit: the size at which "
                    "the recordings of that very case, with everything fitted that is unknown in them, hold just "
                    "enough information for a gain in chi2 that chance does not give. It is computed without the "
                    "diagnosis.",
                ),
                figures=[("Share of cases named rightly, by size", figures / "detection.png")],
            )
        )
    sections.append(_failures(scored))
    right = sum(item.score.right for item in scored)
    seconds = median([item.seconds for item in scored if item.diagnosis is not None])
    write_report(
        out / "report.html",
        "Blind test of the diagnosis",
        f"{len(scored)} concealed cases, {right} answered rightly in verdict, effects and place; "
        f"{seconds:.0f} s a case (median).",
        sections,
    )


def _percent(found: Rate) -> tuple[str, str]:
    if not found.of:
        return "–", "no such case"
    return f"{100 * found.value:.1f} %", f"{100 * found.low:.1f} to {100 * found.high:.1f} %"


_NAMES = {
    "false_alarm_rate": "false alarms: something named, or unexplained, where nothing is hidden",
    "right_set_rate": "effects named rightly, all sizes",
    "right_set_rate_above_twice_the_limit": "effects named rightly, above twice the detection limit",
    "right_set_or_listed_confusion_rate": "named, or listed as indistinguishable from what is named",
    "right_verdict_rate": "right verdict, all cases",
    "right_place_rate": "right place: sensor of a fault, recording and instant of an event",
    "coverage_1sd": "parameters within 1 standard deviation",
    "coverage_2sd": "parameters within 2 standard deviations",
    "off_catalogue_misnamed_rate": "physics of no catalogue named as an effect of the catalogue",
    "off_catalogue_noticed_rate": "physics of no catalogue found unexplained",
    "heldout_improved_rate": "held-out recordings fit better (effects named rightly)",
    "crash_rate": "no answer at all",
}


def _goals(rates: Mapping[str, Rate]) -> Section:
    rows = []
    for name, found in rates.items():
        goal = GOALS.get(name)
        met = goal.met(found) if goal else None
        share, interval = _percent(found)
        state = {True: "ok", False: "FAIL", None: ""}[met]
        rows.append((_NAMES[name], share, f"{found.hits} of {found.of}", interval, goal.text if goal else "", state))
    text = "Intervals are Clopper and Pearson's, of 95 %. Goals are meant for 300 cases or more."
    return Section("Result", (text,), ("", "share", "cases", "95 % interval", "goal", ""), rows)


def _kinds(scored: Sequence[Scored]) -> Section:
    rows = []
    for plant in ("flight", "rate_table", "spin_down", "free_spin"):
        for kind in ("nothing", "noise", "within_sigma", "beyond_sigma", "one", "two", "off_catalogue"):
            mine = [item for item in scored if (item.answer.plant, item.answer.kind) == (plant, kind)]
            if mine:
                right = rate(item.score.right for item in mine)
                seconds = median([item.seconds for item in mine])
                rows.append(
                    (plant.replace("_", " "), kind.replace("_", " "), str(len(mine)), str(right.hits), f"{seconds:.1f}")
                )
    text = (
        "noise: louder, quieter or slower than stated, which is no physics. within and beyond sigma: coefficients that "
        "differ from the stated ones by less, or one of them by more, than their stated uncertainty allows."
    )
    return Section("By kind of case", (text,), ("plant", "concealed", "cases", "right", "seconds (median)"), rows)


def _by_effect(scored: Sequence[Scored]) -> Section:
    rows = []
    for id in CATALOGUE:
        mine = [item for item in scored if id in item.answer.effects]
        if not mine:
            continue
        found = [item for item in mine if id in item.score.named]
        deviates = [
            abs(z)
            for item in mine
            for each in item.score.deviations
            if each.effect == id and (z := each.in_sd) is not None
        ]
        confused = Counter(other for item in mine for other in item.score.named if other not in item.answer.effects)
        rows.append(
            (
                id,
                str(len(mine)),
                str(len(found)),
                f"{sum(z <= 2 for z in deviates)} of {len(deviates)}" if deviates else "–",
                ", ".join(f"{other} ({n})" for other, n in confused.most_common(3)),
            )
        )
    header = ("effect", "cases", "named", "parameters within 2 sd", "named beside or instead")
    return Section("By effect", (), header, rows)


def _failures(scored: Sequence[Scored]) -> Section:
    rows = []
    for item in scored:
        if item.score.right:
            continue
        answer = item.answer
        hidden = ", ".join(answer.effects) or answer.law or answer.verdict
        verdict = "no answer" if item.diagnosis is None else str(item.diagnosis["verdict"])
        said = ", ".join(item.score.named) or verdict
        if item.score.right_set and item.score.right_place is False:
            said += " (in another place)"
        size = "" if item.strength is None else f"{item.strength:.2g}"
        rows.append((str(answer.seed), answer.plant.replace("_", " "), hidden, size, said, (item.error or "")[:200]))
    text = (
        "Each is reproduced alone by its seed: discsim challenge --seed SEED --cases 1 (its recordings: python -m "
        "validation.challenge.conceal --seed SEED --out DIR). Size is in units of the detection limit."
    )
    header = ("seed", "plant", "concealed", "size", "found", "error")
    return Section("Failures" if rows else "No failures", (text,) if rows else (), header if rows else (), rows)


# ---------------------------------------------------------------------------------------------- figures


def draw_confusion(table: Mapping[str, Mapping[str, int]], path: Path) -> None:
    """Draw the confusion matrix with its numbers; only what occurs has a row or a column."""
    columns = [id for id in CATALOGUE if any(id in row for row in table.values())]
    verdicts = ("explained", "unexplained", "recalibrated", "consistent", "no answer")
    columns += [verdict for verdict in verdicts if any(verdict in row for row in table.values())]
    rows = list(table)
    counts = np.array([[table[row].get(column, 0) for column in columns] for row in rows], dtype=float)
    right = np.array([[row == column or (row, column) in _RIGHT for column in columns] for row in rows])
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    shade = np.where(right, 1.0, -1.0) * np.where(counts > 0, 0.3 + 0.7 * shares, 0.0)
    figure, axes = new_figure(width=3.4 + 0.27 * len(columns), height=2.2 + 0.24 * len(rows))
    # orange and blue, which colour-blind readers can tell apart, light enough for black numbers
    axes.imshow(shade, cmap="PuOr", vmin=-1.6, vmax=1.6, aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        axes.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", fontsize=8)
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.tick_params(length=0)
    axes.grid(False)
    axes.xaxis.tick_top()
    axes.set_ylabel("concealed")
    save_figure(figure, path)


_RIGHT = {("nothing", "consistent"), ("nothing", "recalibrated"), ("off-catalogue", "unexplained")}


def draw_deviates(deviates: np.ndarray, path: Path) -> None:
    """Draw the errors of parameters in their own standard deviations against a standard normal distribution."""
    figure, axes = new_figure(width=7.0, height=3.4)
    edges = np.arange(-6.0, 6.5, 0.5)
    shown = np.clip(deviates, -5.99, 5.99)
    axes.hist(shown, bins=edges, color="#56b4e9", edgecolor="white", label="parameters")
    z = np.linspace(-6, 6, 241)
    axes.plot(z, deviates.size * 0.5 * np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi), color="k", label="standard normal")
    beyond = int(np.count_nonzero(np.abs(deviates) > 6))
    axes.set_xlabel("(found - concealed) / sd" + (f"; {beyond} beyond 6 stand at the ends" if beyond else ""))
    axes.set_ylabel("number")
    axes.legend()
    save_figure(figure, path)


def draw_detection(sized: Sequence[tuple[float, bool]], path: Path) -> None:
    """Draw the share of cases named rightly by size over detection limit, with exact intervals, in bins of a factor."""
    edges = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 4.0, 10.0, 30.0, 100.0, np.inf])
    sizes = np.array([size for size, _ in sized])
    right = np.array([ok for _, ok in sized])
    figure, axes = new_figure(width=7.0, height=3.6)
    rng = np.random.default_rng(0)
    shown = np.clip(sizes, 0.2, 500.0)
    axes.plot(shown, np.where(right, 1.04, -0.04) + rng.uniform(-0.02, 0.02, sizes.size), ".", color="#7f7f7f", ms=4)
    for low, high in pairwise(edges):
        mine = (sizes >= low) & (sizes < high)
        if mine.any():
            found = rate(bool(ok) for ok in right[mine])
            middle = float(np.exp(np.mean(np.log(shown[mine]))))
            error = [[found.value - found.low], [found.high - found.value]]
            axes.errorbar([middle], [found.value], yerr=error, fmt="o", color="#0072b2", capsize=2)
    axes.axvline(1.0, color="k", lw=0.8, ls="--")
    axes.axvline(2.0, color="#d55e00", lw=0.8, ls="--")
    axes.axhline(0.5, color="#999999", lw=0.6)
    axes.set_xscale("log")
    axes.set_xlim(0.18, 600.0)
    axes.set_ylim(-0.1, 1.1)
    axes.set_xlabel("size / detection limit (dashed: the limit, and twice the limit)")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_ylabel("share named rightly")
    save_figure(figure, path)
