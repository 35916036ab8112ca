"""The report of a plan: what it can show, what it cannot, and what to do better."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from discsim.validation.planning.figures import draw_limits
from discsim.validation.planning.planned import Planned
from discsim.validation.reporting.html import Section, write_report

__all__ = ["write_plan_page"]

#: pairs that are listed
_PAIRS = 40


def write_plan_page(found: Planned, out: Path, command: str = "") -> Path:
    """Write report.html and its figure into ``out``; return the path of the page."""
    draw_limits(found.limits, out / "plan.png")
    sections = [_effects(found, out), _pairs(found), _coefficients(found), _next(found), _hardware(found)]
    sections.append(_made(found, command))
    write_report(out / "report.html", "Before going out", f"{found.headline}.", sections)
    return out / "report.html"


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "never"


def _factor(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "–"


def _effects(found: Planned, out: Path) -> Section:
    rows = []
    for one in found.limits.effects:
        row = CATALOGUE[one.id]
        for name, seen, named in zip(one.parameters, one.seen, one.named, strict=True):
            scale = row.fitted_scale[name]
            rows.append(
                (one.id, name, _number(seen), _number(named), f"{scale:g}", one.rival, f"{100 * one.taken:.1f} %")
            )
    shape_grid = {one.id: one.shape for one in found.limits.effects if one.shape}
    text = [
        "Half of the diagnoses see that something is there at the size seen, and name this effect at the size named: "
        "the information of the planned recordings against what the diagnosis asks of evidence.",
        "Nearest is the effect that can take the largest share of its trace.",
    ]
    if shape_grid:
        said = "; ".join(
            f"{id} with " + ", ".join(f"{name} = {value:.3g}" for name, value in shape.items())
            for id, shape in shape_grid.items()
        )
        text.append(f"Asked about: {said}. What comes at an instant comes in the first recording.")
    if found.information.questions.silent:
        text.append(f"Not foretold, for no linear question shows it: {', '.join(found.information.questions.silent)}.")
    header = ("effect", "parameter", "seen", "named", "small but visible", "nearest", "share")
    return Section("What can be seen and named", text, header, rows, [("Sizes of effects", out / "plan.png")])


def _pairs(found: Planned) -> Section:
    shown = found.limits.pairs[:_PAIRS]
    rows = [
        (pair.id, pair.rival, f"{100 * pair.taken:.2f} %", "never" if np.isinf(pair.apart) else f"{pair.apart:.1f}")
        for pair in shown
    ]
    more = len(found.limits.pairs) - len(shown)
    text = [
        "The second effect can stand in for the first until that is so many times larger than the size that is named; "
        "a diagnosis then lists it under what it may be confused with."
    ]
    text += [f"{more} more pairs are in plan.json."] if more > 0 else []
    return Section("What could not be told apart", text, ("effect", "stand-in", "share", "times the size"), rows)


def _coefficients(found: Planned) -> Section:
    rows = [
        (one.name, f"{one.value:g}", _number(one.alone), _number(one.together),
         f"{100 * one.together / abs(one.value):.2g} %" if one.value and np.isfinite(one.together) else "–")
        for one in found.coefficients
    ]  # fmt: skip
    text = [
        "Standard deviations that these recordings alone would give: with all other coefficients as stated, and with "
        "all of them free together. Releases are free. Wind and other physics left out would add to them."
    ]
    header = ("coefficient", "value", "sd, alone", "sd, together", "of its value")
    return Section("How well coefficients would be known", text, header, rows)


def _next(found: Planned) -> Section:
    rows = [
        (one.text, _factor(one.coefficients), _factor(one.CNr), _factor(one.effects), _factor(one.pairs))
        for one in found.next_throws
    ]
    text = [
        "One further recording divides standard deviations and sizes by these factors. Coefficients: the geometric "
        "mean of their standard deviations, all free, so that the first is the D-optimal one. Pairs: the size at which "
        "the pairs above are told apart."
    ]
    header = ("recording", "coefficients", "C_Nr", "effects", "pairs")
    return Section("The best next recordings", text, header, rows)


def _hardware(found: Planned) -> Section:
    rows = [(one.text, _factor(one.CNr), _factor(one.effects), one.most, _factor(one.by)) for one in found.bought]
    text = [
        "Factors by which a change divides the sd of C_Nr and the sizes that are named; below one it is worse. "
        "Twice as fast stands for the same white noise in twice as many samples.",
        *_clipped(found),
    ]
    header = ("change", "C_Nr", "effects", "helps or hurts most", "by")
    return Section("What other hardware would buy", text, header, rows)


def _clipped(found: Planned) -> list[str]:
    """Return which axes would stand at their range: a wider one would show what they hide."""
    shares: dict[str, float] = {}
    for one in found.information.trajectories:
        for readings in one.readings:
            for axis, name in enumerate(readings.axes):
                share = float(np.mean(readings.clipped[:, axis]))
                shares[f"{name} of the {readings.sensor}"] = max(
                    shares.get(f"{name} of the {readings.sensor}", 0), share
                )
    beyond = [f"{name} ({100 * share:.0f} %)" for name, share in shares.items() if share > 0.0]
    if not beyond:
        return ["No axis reaches its range: a wider one would buy nothing."]
    return [f"At its range, where a wider one would help: {', '.join(beyond)}."]


def _made(found: Planned, command: str) -> Section:
    rows = [(str(number), item.text) for number, item in enumerate(found.plans, start=1)]
    text = [f"Each is made {found.times} times."] if found.times > 1 else []
    text += [
        f"{name}: {sheet.rate_hz:g} Hz"
        + (f", noise {sheet.noise_rms:g}" if sheet.noise_rms is not None else "")
        + (f", range {sheet.range:g}" if sheet.range is not None else "")
        for name, sheet in found.bench.sheets.items()
    ]
    text += [f"Command: {command}"] if command else []
    return Section("The plan", text, ("", "recording"), rows)
