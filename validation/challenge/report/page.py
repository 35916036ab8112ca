"""The report of a challenge: the goals and what was measured, confusions, deviations, limits, and every failure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE
from discsim.validation.challenge.cases.draw import KINDS
from discsim.validation.challenge.report.figures import (
    draw_confusion,
    draw_detection,
    draw_deviates,
    draw_effects,
    draw_exponents,
)
from discsim.validation.challenge.scores.detection import HALF_GOAL, Curve, Sized, detections, fit_curve, has_curve
from discsim.validation.challenge.scores.result import Scored, both_times, rates_of
from discsim.validation.challenge.scores.scoring import NOTHING, Rate, confusion, has_power_law, median, rate
from discsim.validation.reporting.html import Section, write_report

__all__ = [
    "GOALS",
    "MANY",
    "SIZE",
    "Goal",
    "deviates_of",
    "draw_all",
    "fault_of",
    "found_of",
    "goal_rows",
    "goals_met",
    "hidden_of",
    "percent",
    "size_of",
    "write_page",
]


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


#: cases from which on a rate of half a per cent can be shown: 250 of 600 conceal nothing, and where none of these has
#: an alarm the upper bound of 95 % is 1.5 %
MANY = 600
#: rate of the summary -> its goal, for `MANY` cases or more
GOALS: Mapping[str, Goal] = {
    "false_alarm_rate": Goal("at most 0.5 %, upper bound at most 1.5 %", 0.0, 0.005, 0.015),
    "right_set_rate_above_twice_the_limit": Goal("at least 97 %", 0.97, 1.0),
    "right_set_rate_above_twice_the_limit_in_free_spins": Goal("at least 92 %", 0.92, 1.0),
    "coverage_2sd": Goal("93 to 97 %", 0.93, 0.97),
    "off_catalogue_misnamed_rate": Goal("at most 3 %", 0.0, 0.03),
    "right_setup_rate_where_told_apart": Goal("at least 98 %", 0.98, 1.0),
    "right_verdict_like_real_rate": Goal("at least 95 %", 0.95, 1.0),
    "right_like_real_rate": Goal("at least 90 %", 0.90, 1.0),
    "crash_rate": Goal("none", 0.0, 0.0),
}


def goals_met(rates: Mapping[str, Rate], curve: Curve | None = None, *, few: bool) -> bool:
    """Tell whether every goal is met that cases bear on, the half-detection size of ``curve`` among them.

    ``few`` cases cannot show a rate of one per cent: then a goal counts as missed only where its interval excludes it.
    """
    for name, goal in GOALS.items():
        found = rates[name]
        if few and found.of and (found.low > goal.high or found.high < goal.low):
            return False
        if not few and goal.met(found) is False:
            return False
    return curve is None or (curve.low if few else curve.half) <= HALF_GOAL


def write_page(out: Path, scored: Sequence[Scored]) -> None:
    """Draw the figures and write ``report.html`` into ``out``."""
    rates, items = rates_of(scored), detections(scored)
    figures = draw_all(scored, out / "figures")
    curve = fit_curve(items)
    sections = [_goals(rates, curve, few=len(scored) < MANY), _kinds(scored)]
    if "confusion" in figures:
        text = (
            "Rows are what was concealed, columns what was named; where nothing was named the verdict stands. Of two "
            "concealed effects each is a row. Violet is right, orange a mistake."
        )
        caption = "Concealed (rows) and named (columns), number of cases"
        sections.append(Section("What was named in place of what", (text,), figures=[(caption, figures["confusion"])]))
    sections.append(_by_effect(scored))
    if "deviates" in figures:
        z = deviates_of(scored)
        most = np.sqrt(np.mean(z[np.abs(z) <= 4] ** 2))
        text = (
            f"{z.size} parameters of effects that were concealed and named, and of coefficients that were stated with "
            "a sigma: how many of its own standard deviations each lies off its true value. Their root mean square is "
            f"{np.sqrt(np.mean(z**2)):.2f}, without those beyond 4 it is {most:.2f}; "
            "honest errors have 1."
        )
        caption = "Errors of parameters in their own standard deviations"
        sections.append(Section("Are the standard errors honest?", (text,), figures=[(caption, figures["deviates"])]))
    if items:
        sections.append(_detection(curve, figures))
    if any(has_power_law(item.answer) for item in scored):
        sections.append(_exponents(scored, figures))
    sections.append(_failures(scored))
    right = sum(item.score.right for item in scored)
    write_report(
        out / "report.html",
        "Blind test of the diagnosis",
        f"{len(scored)} concealed cases, {right} answered rightly in verdict, effects and place. "
        f"A diagnosis takes {both_times(scored)}.",
        sections,
    )


def deviates_of(scored: Sequence[Scored]) -> FloatArray:
    """Return the errors of all parameters in their own standard deviations."""
    return np.array([z for item in scored for each in item.score.deviations if (z := each.in_sd) is not None])


def draw_all(
    scored: Sequence[Scored], folder: Path, prefix: str = "", items: Sequence[Sized] | None = None
) -> dict[str, Path]:
    """Draw what the cases can show into ``folder``; return the files by name.

    ``items`` are the effects whose detection is drawn where they are not those of the cases.
    """
    drawn = {}
    table = confusion([(item.answer, item.diagnosis, item.score) for item in scored])
    drawn["confusion"] = folder / f"{prefix}confusion.png"
    draw_confusion(table, drawn["confusion"])
    z = deviates_of(scored)
    if z.size:
        drawn["deviates"] = folder / f"{prefix}deviates.png"
        draw_deviates(z, drawn["deviates"])
    items = detections(scored) if items is None else items
    if items:
        drawn["detection"], drawn["effects"] = folder / f"{prefix}detection.png", folder / f"{prefix}effects.png"
        draw_detection(items, fit_curve(items), drawn["detection"])
        draw_effects(items, drawn["effects"])
    exponents = [item.score.exponent for item in scored if item.score.exponent is not None]
    if exponents:
        drawn["exponents"] = folder / f"{prefix}exponents.png"
        draw_exponents(exponents, drawn["exponents"])
    return drawn


def percent(found: Rate) -> tuple[str, str]:
    """Return a share and its interval as text."""
    if not found.of:
        return "–", "no such case"
    return f"{100 * found.value:.1f} %", f"{100 * found.low:.1f} to {100 * found.high:.1f} %"


#: rate of the summary -> what it is, in words
NAMES: Mapping[str, str] = {
    "false_alarm_rate": "false alarms: something named, or unexplained, where nothing is hidden",
    "right_set_rate": "effects named rightly, all sizes",
    "right_set_rate_above_twice_the_limit": "effects named rightly, above twice the detection limit",
    "right_set_rate_above_twice_the_limit_in_free_spins": "of these, in free spins",
    "right_set_rate_where_told_apart": "effects named rightly, above twice the size at which they are told from others",
    "right_set_or_listed_confusion_rate": "named, or listed as indistinguishable from what is named",
    "right_verdict_rate": "right verdict, all cases",
    "right_place_rate": "right place (effects named rightly): recordings, instant of an event, sensor of a fault",
    "coverage_1sd": "parameters within 1 standard deviation",
    "coverage_2sd": "parameters within 2 standard deviations",
    "coverage_2sd_effects": "of these, parameters of effects that were concealed",
    "coverage_2sd_recalibrated": "of these, stated numbers that were off",
    "off_catalogue_misnamed_rate": "physics of no catalogue named as an effect of the catalogue",
    "off_catalogue_noticed_rate": "physics of no catalogue found unexplained",
    "law_given_rate": "a law given for what is found unexplained",
    "exponent_given_rate": "power laws: an exponent given",
    "exponent_within_2sd_rate": "power laws: exponent within 2 standard deviations",
    "heldout_improved_rate": "held-out recordings fit better (effects named rightly)",
    "right_setup_rate": "faults of the setup: verdict, effects, setting and place are right, all sizes",
    "right_setup_rate_where_told_apart": "of these, alone or beside an effect above twice the size at which it is told",
    "right_verdict_like_real_rate": "throws like real ones: verdict is right",
    "right_like_real_rate": "throws like real ones: verdict, effects and place are right",
    "found_like_real_rate": "effects in throws like real ones, each by itself: named",
    "crash_rate": "no answer at all",
}


def goal_rows(
    rates: Mapping[str, Rate], curve: Curve | None, *, few: bool = False
) -> list[tuple[str, str, str, str, str, str]]:
    """Return what was measured: what, share, cases, interval, goal, and "ok" or "FAIL" where there is a goal.

    Where a goal is missed but ``few`` cases leave it within the interval, that is said in place of "FAIL".
    """
    state = {True: "ok", False: "FAIL", None: ""}

    def judged(goal: Goal | None, found: Rate) -> str:
        met = goal.met(found) if goal else None
        if goal and few and met is False and found.low <= goal.high and found.high >= goal.low:
            return "too few cases"
        return state[met]

    rows = []
    for name, found in rates.items():
        goal = GOALS.get(name)
        share, interval = percent(found)
        said = goal.text if goal else ""
        rows.append((NAMES[name], share, f"{found.hits} of {found.of}", interval, said, judged(goal, found)))
    if curve is not None:
        size, _, interval = curve.text.partition(" (")
        what = "size at which half of the effects are named, in detection limits"
        cases = f"{curve.named} of {curve.cases}"
        goal_text = f"at most {HALF_GOAL:g}"
        open_ = few and curve.low <= HALF_GOAL < curve.half
        met = "too few cases" if open_ else state[curve.half <= HALF_GOAL]
        rows.append((what, size, cases, interval.rstrip(")"), goal_text, met))
    return rows


def _goals(rates: Mapping[str, Rate], curve: Curve | None, few: bool) -> Section:
    text = f"Intervals are Clopper and Pearson's, of 95 %. Goals are meant for {MANY} cases or more."
    rows = goal_rows(rates, curve, few=few)
    return Section("Result", (text,), ("", "share", "cases", "95 % interval", "goal", ""), rows)


def _kinds(scored: Sequence[Scored]) -> Section:
    rows = []
    for plant in ("flight", "rate_table", "spin_down", "free_spin"):
        for kind in KINDS:
            mine = [item for item in scored if (item.answer.plant, item.answer.kind) == (plant, kind)]
            if mine:
                right = rate(item.score.right for item in mine)
                seconds = median([item.seconds for item in mine])
                rows.append(
                    (plant.replace("_", " "), kind.replace("_", " "), str(len(mine)), str(right.hits), f"{seconds:.1f}")
                )
    text = (
        "noise: louder, quieter or slower than stated, which is no physics. within and beyond sigma: coefficients that "
        "differ from the stated ones by less, or one of them by more, than their stated uncertainty allows. like real: "
        "what a measured logger did to throws, five to eight effects at once."
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
        own = [item for item in detections(mine) if item.effect == id]
        missed = [item.size for item in own if not item.named]
        curve = fit_curve(own) if has_curve(own) else None
        confused = Counter(other for item in mine for other in item.score.named if other not in item.answer.effects)
        rows.append(
            (
                id,
                str(len(mine)),
                str(len(found)),
                f"{max(missed):.2g}" if missed else "–",
                curve.text if curve is not None else "",
                *(f"{sum(z <= most for z in deviates)} of {len(deviates)}" if deviates else "–" for most in (1, 2)),
                ", ".join(f"{other} ({n})" for other, n in confused.most_common(3)),
            )
        )
    text = (
        "Sizes are in units of the detection limit of each case; the half-detection size stands where enough cases "
        "were named and enough were not."
    )
    header = (
        "effect",
        "cases",
        "named",
        "largest that was not",
        "half are named at",
        "parameters within 1 sd",
        "within 2 sd",
        "named beside or instead",
    )
    return Section("By effect", (text,), header, rows)


def _detection(curve: Curve | None, figures: Mapping[str, Path]) -> Section:
    text = [
        "Size of each concealed effect in units of its detection limit: the size at which the recordings of that very "
        "case, with everything fitted that is unknown in them, hold just enough information for a gain in chi2 that "
        "chance does not give. It is computed without the diagnosis. The green curve is what an ideal test would do."
    ]
    if curve is not None:
        text.append(
            f"Half-detection size in detection limits: {curve.text} (a logistic in the logarithm of the size, "
            f"with {100 * curve.missed:.0f} % missed however large); the goal is {HALF_GOAL:g}."
        )
    drawn = [
        ("Share of effects named, by size", figures["detection"]),
        ("Each effect by size, named or not", figures["effects"]),
    ]
    return Section("How small an effect is found", text, figures=drawn)


def _exponents(scored: Sequence[Scored], figures: Mapping[str, Path]) -> Section:
    rows = []
    for item in scored:
        if not has_power_law(item.answer):
            continue
        found = item.score.exponent
        told = ("–", "–", "–")
        if found is not None:
            sd, off = found.sd, found.in_sd
            told = (
                f"{found.value:.4g}",
                f"{sd:.2g}" if sd is not None else "–",
                f"{off:+.2f}" if off is not None else "–",
            )
        answer = item.answer
        rows.append(
            (
                str(answer.seed),
                answer.plant.replace("_", " "),
                f"{answer.parameters['exponent']:g}",
                *told,
                found_of(item),
            )
        )
    header = ("seed", "plant", "concealed", "found", "sd", "error in sd", "verdict")
    drawn = [("Exponents found against concealed", figures["exponents"])] if "exponents" in figures else []
    text = "A torque about the spin axis with a power of the spin rate that no catalogue has: the exponent of the law."
    return Section("Exponents of power laws", (text,), header, rows, drawn)


def hidden_of(item: Scored) -> str:
    """Return what was concealed, in words."""
    return ", ".join(item.answer.effects) or item.answer.law or item.answer.verdict


def found_of(item: Scored) -> str:
    """Return what the diagnosis said, in words."""
    verdict = "no answer" if item.diagnosis is None else str(item.diagnosis["verdict"])
    said = ", ".join(item.score.named) or verdict
    return said + (" (in another place)" if item.score.right_set and item.score.right_place is False else "")


def fault_of(item: Scored) -> str:
    """Return in which way a case was answered wrongly; empty where it was answered rightly."""
    answer, score = item.answer, item.score
    if score.right:
        return ""
    if score.crashed or item.diagnosis is None:
        return "no answer"
    alarm = item.diagnosis["verdict"] in ("explained", "unexplained")
    if answer.kind in NOTHING:
        return "false alarm" if alarm else "consistent and recalibrated confused"
    if answer.kind == "off_catalogue":
        return "physics of no catalogue named as an effect" if score.named else "physics of no catalogue not noticed"
    hidden, named = set(answer.effects), set(score.named)
    if named == hidden:
        return "right effects in another place" if score.right_setting is not False else "another setting named"
    if not alarm:
        return "not noticed"
    if not named:
        return "noticed, called unexplained"
    if named < hidden:
        return "one of two effects not named" if len(hidden) == 2 else "some of the effects not named"
    return "effects named beside the right ones" if hidden < named else "another effect named"


#: what `size_of` tells
SIZE = (
    "Size is that of the least concealed effect in units of its detection limit; in brackets in units of the size at "
    "which it is told from other effects of its sensor."
)


def size_of(item: Scored) -> str:
    """Return the least concealed size in detection limits, and where it is told from others at another size, that."""
    if item.strength is None:
        return ""
    seen, told = (f"{size:.2g}" for size in (item.strength, item.strength if item.told is None else item.told))
    return seen if told == seen else f"{seen} ({told})"


def _failures(scored: Sequence[Scored]) -> Section:
    rows = []
    for item in scored:
        if item.score.right:
            continue
        what = (
            fault_of(item),
            hidden_of(item),
            size_of(item),
            found_of(item),
            (item.error or "")[-200:],
            item.reproduce,
        )
        rows.append((str(item.answer.seed), *what))
    text = (
        "Each is reproduced alone by its command; its recordings and its answer are written by "
        f"discsim study conceal --seed SEED --out DIR with the same options. {SIZE}"
    )
    header = ("seed", "fault", "concealed", "size", "found", "error", "command")
    return Section("Failures" if rows else "No failures", (text,) if rows else (), header if rows else (), rows)
