"""What the page on the blind test says of finished challenges: result, confusions, failures, masks.

The detection curve counts the effects of the mask near_limit, too. Challenges in which nothing is concealed count for
the share of false alarms, since an upper bound of 1.5 % takes 245 such cases and more.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from discsim.errors import InputError
from discsim.validation.challenge.cases.draw import KINDS, PLANT_SHARES
from discsim.validation.challenge.masks import MASK_HEADER, mask_row, masked_results
from discsim.validation.challenge.report.page import (
    MANY,
    SIZE,
    deviates_of,
    fault_of,
    found_of,
    goal_rows,
    hidden_of,
    percent,
    size_of,
)
from discsim.validation.challenge.scores.detection import Sized, detections, fit_curve
from discsim.validation.challenge.scores.result import Result, Scored, both_times, rates_of, times
from discsim.validation.challenge.scores.scoring import confusion, has_power_law
from discsim.validation.reporting.markdown import table

__all__ = ["masks_text", "result_text", "runs_text", "with_part"]

#: beginning of the names of the page's figures
PREFIX = "challenge-"
#: figures of the page, and what they show
_FIGURES = {
    "detection": "Share of effects named, by size in units of the detection limit",
    "effects": "Each concealed effect by size, named or not",
    "confusion": "What was concealed (rows) and what was named (columns)",
    "deviates": "Errors of parameters in their own standard deviations",
    "exponents": "Exponents of laws found against those concealed",
}


def with_part(page: str, name: str, text: str) -> str:
    """Return the page with ``text`` between its marks ``<!-- name -->`` and ``<!-- /name -->``.

    Raises `InputError` where the page lacks the marks.
    """
    start, end = f"<!-- {name} -->\n", f"<!-- /{name} -->"
    before, mark, rest = page.partition(start)
    _, closed, after = rest.partition(end)
    if not (mark and closed):
        raise InputError(f"the page has no marks {start.strip()} and {end}; expected both, each on a line of its own")
    return f"{before}{start}{text.strip()}\n{end}{after}"


def plain_command(command: str) -> str:
    """Return a command without what says where and by whom it was run."""
    return re.sub(r" --(out|scheduler|workers)[ =]\S+| --anew", "", command)


def made_by(result: Result) -> str:
    """Return a line that says how a result was made, or each of those that are pooled in it."""
    if result.parts:
        return f"{' '.join(map(made_by, result.parts))} Together {len(result.scored)} cases."
    first, last = result.seeds
    return (
        f"`{plain_command(result.command)}` (seeds {first} to {last}), discsim {result.version}, code "
        f"`{result.code[:12]}`: {len(result.scored)} cases."
    )


def result_text(
    result: Result, figures: Sequence[str], near: Result | None = None, blank: Sequence[Result] = ()
) -> str:
    """Return the page's part on a challenge; ``figures`` are the names of those that are drawn.

    ``near`` is a challenge under the mask near_limit, whose effects count for the size at which half are named;
    ``blank`` are challenges in which nothing is concealed, which count for the share of false alarms.
    """
    scored = result.scored
    right = sum(item.score.right for item in scored)
    parts = [
        f"{made_by(result)} {right} are answered rightly in verdict, effects and place. A diagnosis takes "
        f"{both_times(scored)}, on the machine it ran on.",
        _goals(scored, pooled(result, near), [item for other in blank for item in other.scored]),
    ]
    if blank:
        parts.append("The share of false alarms counts as well " + " ".join(map(made_by, blank)))
    if near is not None:
        parts.append(
            "The size at which half are named, and the two figures, count the effects of a second challenge as well, "
            f"whose sizes lie near the limit: {made_by(near)}"
        )
    parts += [f"![{_FIGURES[name]}](images/{PREFIX}{name}.png)" for name in ("detection", "effects") if name in figures]
    parts += ["### By plant and kind", _kinds(scored), "### What was named in place of what", _confusions(scored)]
    parts += [f"![{_FIGURES[name]}](images/{PREFIX}{name}.png)" for name in ("confusion",) if name in figures]
    parts += ["### Errors of parameters and exponents", _errors(scored)]
    parts += [
        f"![{_FIGURES[name]}](images/{PREFIX}{name}.png)" for name in ("deviates", "exponents") if name in figures
    ]
    parts += ["### Failures", _failures(scored)]
    return "\n\n".join(part for part in parts if part)


def pooled(result: Result, near: Result | None) -> list[Sized]:
    """Return the effects by which the detection curve is told."""
    return [*detections(result.scored), *(detections(near.scored) if near is not None else ())]


def _goals(scored: Sequence[Scored], items: Sequence[Sized], blank: Sequence[Scored]) -> str:
    alarms = "false_alarm_rate"
    rates = {**rates_of(scored), alarms: rates_of([*scored, *blank])[alarms]}
    told = {"ok": "met", "FAIL": "**missed**"}
    few = len(scored) + len(blank) < MANY
    rows = [(*row, told.get(state, state)) for *row, state in goal_rows(rates, fit_curve(items), few=few)]
    return table(("", "share", "cases", "95 % interval", "goal", ""), rows)


def _kinds(scored: Sequence[Scored]) -> str:
    rows = []
    kinds = [kind for kind in KINDS if any(item.answer.kind == kind for item in scored)]
    for plant in PLANT_SHARES:
        cells = []
        for kind in kinds:
            mine = [item for item in scored if (item.answer.plant, item.answer.kind) == (plant, kind)]
            cells.append(f"{sum(item.score.right for item in mine)} of {len(mine)}" if mine else "")
        mine = [item for item in scored if item.answer.plant == plant]
        if mine:
            rows.append((plant.replace("_", " "), *cells, times(mine).text))
    lead = "Cases answered rightly, and the wall clock of a diagnosis."
    return lead + "\n\n" + table(("plant", *(kind.replace("_", " ") for kind in kinds), "time"), rows)


def _confusions(scored: Sequence[Scored]) -> str:
    """Return what was not named as itself: the confusion matrix without what is right."""
    rows = []
    for concealed, cells in confusion([(item.answer, item.diagnosis, item.score) for item in scored]).items():
        right = {
            "nothing": ("consistent", "recalibrated"),
            "off-catalogue": ("unexplained",),
        }.get(concealed, (concealed,))
        wrong = {name: count for name, count in cells.most_common() if name not in right}
        if wrong:
            good = sum(count for name, count in cells.items() if name in right)
            mine = (
                item.answer.effects or ("off-catalogue" if item.answer.kind == "off_catalogue" else "nothing",)
                for item in scored
            )
            of = sum(concealed in names for names in mine)
            told = ", ".join(f"{name} ({count})" for name, count in wrong.items())
            rows.append((concealed, f"{good} of {of}", told))
    if not rows:
        return "Nothing: each effect was named as itself."
    return table(("concealed", "named as itself", "in its place"), rows)


def _errors(scored: Sequence[Scored]) -> str:
    z = np.abs(deviates_of(scored))
    lines = []
    if z.size:
        rates = rates_of(scored)
        shares = " and ".join(
            f"{share} ({interval}) within {most}"
            for most, (share, interval) in ((most, percent(rates[f"coverage_{most}sd"])) for most in (1, 2))
        )
        unknown = sum(each.sd is None for item in scored for each in item.score.deviations)
        lines.append(
            f"Of {z.size} parameters {shares} of their own standard deviations; a normal distribution has 68.3 and "
            f"95.4 %. {int(np.count_nonzero(z > 4))} are more than 4 off, the largest error is {z.max():.1f}. "
            f"{unknown} more are given without a standard deviation: the recordings do not determine them."
        )
    lines += _held_out(scored)
    rows = []
    for item in scored:
        found = item.score.exponent
        if found is not None:
            sd, off = found.sd, found.in_sd
            uncertainty = (f"{sd:.2g}", f"{off:+.1f}") if sd is not None and off is not None else ("", "")
            plant = item.answer.plant.replace("_", " ")
            rows.append((str(item.answer.seed), plant, f"{found.true:g}", f"{found.value:.4g}", *uncertainty))
    of = sum(has_power_law(item.answer) for item in scored)
    if of:
        lines.append(f"Of {of} torques with a power law {len(rows)} have an exponent in the law that was found.")
    if rows:
        lines.append(table(("seed", "plant", "exponent", "found", "sd", "error in sd"), rows))
    return "\n\n".join(lines)


def _held_out(scored: Sequence[Scored]) -> list[str]:
    """Return how recordings that took no part fit, by the baseline and with what was named, where that was right."""
    pairs = [
        (score.heldout_before, score.heldout_after)
        for score in (item.score for item in scored if item.answer.effects and item.score.right_set)
        if score.heldout_before is not None and score.heldout_after is not None
    ]
    if not pairs:
        return []
    before, after = np.quantile(pairs, (0.1, 0.5, 0.9), axis=0).T
    told = [f"{middle:.3g} (eight in ten between {low:.3g} and {high:.3g})" for low, middle, high in (before, after)]
    return [
        f"Held-out recordings of the {len(pairs)} cases whose effects were named rightly have a chi2 per reading of "
        f"{told[0]} by the baseline and of {told[1]} with the effects: medians."
    ]


def _failures(scored: Sequence[Scored]) -> str:
    wrong = [item for item in scored if not item.score.right]
    if not wrong:
        return "None."
    counts = Counter(fault_of(item) for item in wrong)
    lead = "; ".join(f"{fault}: {count}" for fault, count in counts.most_common())
    rows = []
    for item in sorted(wrong, key=lambda item: (-counts[fault_of(item)], fault_of(item), item.answer.seed)):
        said = found_of(item) if item.error is None else item.error.strip().splitlines()[-1][:160]
        plant = item.answer.plant.replace("_", " ")
        rows.append((fault_of(item), plant, hidden_of(item), size_of(item), said, f"`{item.reproduce}`"))
    return f"{lead}. {SIZE}\n\n" + table(("fault", "plant", "concealed", "size", "found", "alone"), rows)


#: rate of the summary -> its column in the table of all runs
_RUN_COLUMNS = {
    "false_alarm_rate": "false alarms",
    "right_set_rate_above_twice_the_limit": "right set above twice the limit",
    "right_set_rate_above_twice_the_limit_in_free_spins": "in free spins",
    "coverage_2sd": "parameters within 2 sd",
    "off_catalogue_misnamed_rate": "misnamed",
    "law_given_rate": "a law given",
}


def runs_text(results: Sequence[Result]) -> str:
    """Return the table of challenges, a row each: seeds, code, cases, and the shares that they are judged by."""
    rows = []
    for result in results:
        rates = rates_of(result.scored)
        shares = [
            f"{percent(rates[name])[0]} ({rates[name].hits} of {rates[name].of})" if rates[name].of else "–"
            for name in _RUN_COLUMNS
        ]
        first, last = result.seeds
        rows.append((f"{first} to {last}", f"`{result.code[:12]}`", str(len(result.scored)), *shares))
    return table(("seeds", "code", "cases", *_RUN_COLUMNS.values()), rows)


def masks_text(folders: Sequence[Path], plain: Result | None) -> str:
    """Return the page's part on masks: a row each, and one of the same seeds of ``plain`` without any."""
    results = masked_results(folders)
    if not results:
        names = ", ".join(str(folder) for folder in folders)
        raise InputError(f"--masks {names}: no finished challenge with a mask; expected folders that --mask filled")
    rows = []
    if plain is not None:
        seeds = {item.answer.seed for result in results.values() for item in result.scored}
        same = [item for item in plain.scored if item.answer.seed in seeds]
        if same:
            rows.append(("none (the same seeds)", *mask_row(same)))
    rows += [(f"`{mask}`", *mask_row(result.scored)) for mask, result in results.items()]
    commands = "\n".join(f"- `{mask}`: {made_by(result)}" for mask, result in results.items())
    lead = "Shares with their intervals of 95 %; time is the median of a diagnosis, wall clock."
    return f"{lead}\n\n{table(('mask', *MASK_HEADER), rows)}\n\n{commands}"
