"""The report of a plan: what it can show, what it cannot, and what to do better."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from discsim.validation.planning.figures import draw_limits
from discsim.validation.planning.planned import Planned
from discsim.validation.reporting.html import Section, write_report

__all__ = ["write_plan_page"]

#: a stand-in that takes less of the trace than this stands behind nearer ones: the effect is told from it about where
#: it is named
_SHARE = 0.5


def write_plan_page(found: Planned, out: Path) -> Path:
    """Write report.html and its figure into ``out``; return the path of the page."""
    draw_limits(found.limits, out / "plan.png")
    sections = [_effects(found, out), _pairs(found), _coefficients(found), _next(found), _hardware(found)]
    sections.append(_made(found))
    write_report(out / "report.html", "Before going out", f"{found.headline}.", sections)
    return out / "report.html"


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "never"


def _factor(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "–"


def _effects(found: Planned, out: Path) -> Section:
    rows = []
    unseen: dict[str, list[str]] = {}
    for one in found.limits.effects:
        row = CATALOGUE[one.id]
        for name, seen, named in zip(one.parameters, one.seen, one.named, strict=True):
            if not np.isfinite(seen):
                unseen.setdefault(one.id, []).append(name)
                continue
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
    if unseen:
        text.append(_unseen(found, unseen))
    header = ("effect", "parameter", "seen", "named", "small but visible", "nearest", "share")
    return Section("What can be seen and named", text, header, rows, [("Sizes of effects", out / "plan.png")])


def _unseen(found: Planned, unseen: Mapping[str, Sequence[str]]) -> str:
    """Say which parameters no size shows, and which axes have no reading that could."""
    names = "; ".join(f"{id} {', '.join(parameters)}" for id, parameters in unseen.items())
    blind = [name for name, share in _shares_clipped(found).items() if share == 1.0]
    why = f" Readings that stand at the range throughout show nothing: {', '.join(blind)}." if blind else ""
    return f"No size of these is seen, so they have no row: {names}.{why}"


def _pairs(found: Planned) -> Section:
    """Return the pairs that matter by effect, and the number of those that come apart before anybody would see them."""
    matters = [pair for pair in found.limits.pairs if pair.visible >= 1.0 and pair.taken >= _SHARE]
    rows = []
    for id in dict.fromkeys(pair.id for pair in matters):
        mine = [pair for pair in matters if pair.id == id]
        never = ", ".join(pair.rival for pair in mine if np.isinf(pair.apart))
        later = ", ".join(f"{pair.rival} ({pair.visible:.1f})" for pair in mine if np.isfinite(pair.apart))
        rows.append((id, never, later))
    text = [
        "A stand-in does to these readings almost what the effect does: a diagnosis lists it under what the effect may "
        "be confused with. Never: whatever the size. Later: up to so many times the small but visible size.",
    ]
    folded = len(found.limits.pairs) - len(matters)
    if folded:
        text.append(
            f"{folded} further pairs are in plan.json alone: they come apart below the small but visible size, or the "
            "stand-in takes less than half of the trace."
        )
    helpful = max((one for one in found.next_throws if one.pairs > 1.0), key=lambda one: one.pairs, default=None)
    if rows and helpful is not None:
        text.append(
            f"Of the next recordings below this one helps most, and divides such sizes by {helpful.pairs:.2f}: "
            f"{helpful.text}."
        )
    if not rows:
        return Section("What could not be told apart", [*text[1:], "No pair of effects that could be seen."])
    header = ("effect", "never told from", "later, up to so many times a visible size")
    return Section("What could not be told apart", text, header, rows)


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
    beyond = [f"{name} ({100 * share:.0f} %)" for name, share in _shares_clipped(found).items() if share > 0.0]
    if not beyond:
        return ["No axis reaches its range: a wider one would buy nothing."]
    return [f"At its range, where a wider one would help: {', '.join(beyond)}."]


def _shares_clipped(found: Planned) -> dict[str, float]:
    """Return for each axis the largest share of a recording's readings that would stand at the range."""
    shares: dict[str, float] = {}
    for one in found.information.trajectories:
        for readings in one.readings:
            for axis, name in enumerate(readings.axes):
                called = f"{name.split('_')[0]} of the {readings.sensor}"
                share = float(np.mean(readings.clipped[:, axis]))
                shares[called] = max(shares.get(called, 0.0), share)
    return shares


def _made(found: Planned) -> Section:
    rows = [(str(number), item.text) for number, item in enumerate(found.plans, start=1)]
    text = [f"Each is made {found.times} times."] if found.times > 1 else []
    text += [
        f"{name}: {sheet.rate_hz:g} Hz"
        + (f", noise {sheet.noise_rms:g}" if sheet.noise_rms is not None else "")
        + (f", range {sheet.range:g}" if sheet.range is not None else "")
        for name, sheet in found.bench.sheets.items()
    ]
    return Section("The plan", text, ("", "recording"), rows)
