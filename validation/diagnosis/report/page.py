"""The report of a diagnosis: one page for an experimenter, from the verdict down to the settings."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from math import erfc, sqrt
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from markupsafe import Markup

from discsim.recording import SENSORS
from discsim.validation.diagnosis.answer.misstated import in_short
from discsim.validation.diagnosis.report.consistency_tables import leftovers_of, tables_of
from discsim.validation.diagnosis.report.figures import draw_overview, draw_sensor, readable_axis, sensors_of
from discsim.validation.diagnosis.report.wording import (
    everyday,
    form,
    found,
    law_text,
    name_of,
    plus_minus,
    target_in_words,
    telling_apart,
    unit,
    wind_in_words,
)
from discsim.validation.diagnosis.result import (
    Confusion,
    Diagnosis,
    FitFigures,
    Law,
    Located,
    NamedEffect,
    NoiseNote,
    Outcome,
    Recalibration,
)
from discsim.validation.diagnosis.setup.remedy import remedy_of
from discsim.validation.reporting.figures import save_figure
from discsim.validation.reporting.html import write_page

__all__ = ["draw_figures", "verdict_sentence", "write_diagnosis_report"]

_MEANINGS: Mapping[str, str] = MappingProxyType(
    {
        "consistent": "Nothing was added to the model. Parameters with a stated uncertainty moved within it.",
        "recalibrated": "Nothing was added to the model, but a stated value is off by more than its sigma allows.",
        "explained": "With this in the model the rest is noise.",
        "unexplained": "A significant mismatch remains. Nothing is named, because no known cause removes all of it.",
    }
)
#: longest bar, px
_BAR = 150.0
_MOST_CANDIDATES = 15
_MOST_OUTLIERS = 30
#: a noise level further than this from the stated one is remarked on, as is noise that remembers longer than it
_LEVEL, _MEMORY_S = 1.25, 0.1


def draw_figures(outcome: Outcome, folder: Path) -> list[tuple[str, Path]]:
    """Write the figures into ``folder`` and return caption and file of each, the overview first."""
    residuals, located = outcome.residuals, outcome.diagnosis.located
    if not residuals:
        return []
    overview = folder / "residuals.png"
    save_figure(draw_overview(residuals), overview)
    figures = [
        ("Every axis of every recording: pale is noise, dark far above it, grey had nothing to compare.", overview)
    ]
    for sensor in sensors_of(residuals):
        path = folder / f"residuals-{sensor}.png"
        save_figure(draw_sensor(sensor, residuals, located), path)
        figures.append(
            (f"Residuals of the {_plain(sensor)} before and after, in standard deviations of its noise.", path)
        )
    return figures


def write_diagnosis_report(
    path: Path, outcome: Outcome, figures: Sequence[tuple[str, Path]], settings: Mapping[str, str]
) -> None:
    """Write the page to ``path``, figures embedded; ``settings`` come before the outcome's own."""
    diagnosis = outcome.diagnosis
    outliers = sorted(diagnosis.outliers, key=lambda item: -abs(item.deviation))
    write_page(
        path,
        "diagnosis.html",
        title=f"Diagnosis of {', '.join(diagnosis.datasets)}",
        lead=f"Does the baseline simulation explain these recordings ({_plain(diagnosis.plant)}) down to their noise?",
        verdict=diagnosis.verdict,
        sentence=verdict_sentence(diagnosis),
        meaning=_meaning(diagnosis),
        warnings=diagnosis.warnings,
        figures=_key_figures(diagnosis),
        effects=[_effect(item) for item in diagnosis.effects],
        law=None if diagnosis.law is None else _law(diagnosis.law),
        located=[_place(item) for item in diagnosis.located],
        agreement=_agreement(diagnosis),
        overview=[(caption, base64.b64encode(file.read_bytes()).decode()) for caption, file in figures],
        heldout=[
            (
                item.recording,
                "all saw it" if item.chosen is None else ", ".join(item.chosen) or "nothing",
                f"{item.baseline:.2f}",
                f"{item.final:.2f}",
                _signed(item.delta_log_likelihood, 1),
            )
            for item in diagnosis.heldout
        ],
        candidates=_ranking(outcome),
        more_candidates=_further(outcome),
        next_recordings=_next_recordings(diagnosis),
        recalibrated=[_moved(name, item) for name, item in diagnosis.recalibrated.items()],
        by_recording=_by_recording(outcome),
        noise=[_noise(item) for item in diagnosis.noise],
        outliers=[
            (
                item.recording,
                _plain(item.sensor),
                readable_axis(item.axis),
                f"{item.t_s:.2f}",
                _signed(item.deviation, 1),
            )
            for item in outliers[:_MOST_OUTLIERS]
        ],
        outlier_text=_outlier_text(len(outliers)),
        settings=[*settings.items(), *outcome.settings.items()],
    )


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """Return the verdict as one sentence of plain words."""
    if diagnosis.verdict == "consistent":
        return "The baseline explains these recordings: nothing beyond the noise is left."
    if diagnosis.verdict == "recalibrated":
        moved = sorted(diagnosis.moved.items(), key=lambda pair: -abs(pair[1].sigmas))
        text = _joined([f"{name} moves from {item.stated:.4g} to {item.value:.4g}" for name, item in moved])
        return f"The baseline's physics explains these recordings once {text}.".replace("-", "−")
    if diagnosis.verdict == "unexplained":
        if diagnosis.misstated:
            others = ", or ".join(in_short(numbers) for numbers in diagnosis.misstated)
            return f"A stated number may be wrong: {others} would leave nothing but noise."
        text = "Something is missing that no effect of the catalogue accounts for"
        if diagnosis.partly:
            lead = _joined([name_of(item.id) for item in diagnosis.partly])
            return f"{text}. The nearest is {lead}: it takes most of the mismatch away, and leaves more than noise."
        return f"{text}; a law for it is below." if diagnosis.law is not None else f"{text}."
    names = _joined([_named(item) for item in diagnosis.effects])
    return f"The baseline leaves out {names}."


def _named(item: NamedEffect) -> str:
    """Return an effect in a few words, with its size where one number tells it."""
    size = ""
    if wind := wind_in_words(item.parameters):
        size = f" ({wind})"
    elif len(item.parameters) == 1:
        ((name, parameter),) = item.parameters.items()
        shown = (
            everyday(item.id, name, parameter) or f"{plus_minus(parameter.value, parameter.sd)} {unit(item.id, name)}"
        )
        size = f" ({shown.strip()})" if not shown.startswith("(") else f" {shown}"
    where = "" if item.recordings is None else f" in {_recordings(item.recordings)}"
    return f"{name_of(item.id)}{size}{where}"


def _key_figures(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    def pair(read: Any) -> str:
        before, after = read(diagnosis.baseline), read(diagnosis.final)
        return _over_noise(after) if abs(before - after) < 0.005 else f"{_over_noise(before)} → {_over_noise(after)}"

    figures = [
        ("mismatch over noise (χ² per reading)", pair(lambda fit: fit.chi2_per_sample), "1 is noise alone"),
    ]
    if _held_out(diagnosis.baseline) and _held_out(diagnosis.final):
        text = pair(lambda fit: fit.heldout_chi2_per_sample)
        seen = "a law's form was chosen with them" if diagnosis.law is not None else "neither fit nor choice saw them"
        figures.append(("the same on recordings set aside", text, seen))
    if diagnosis.effects:
        figures.append(("effects named", str(len(diagnosis.effects)), "strongest evidence first"))
    elif diagnosis.verdict in ("consistent", "recalibrated"):
        moved = diagnosis.moved
        text = f"of {len(diagnosis.recalibrated)} that may" if diagnosis.recalibrated else "none has an uncertainty"
        figures.append(("parameters beyond 3 stated sd", str(len(moved)), text))
    return figures


def _held_out(fit: FitFigures) -> bool:
    return fit.heldout_chi2_per_sample is not None


def _effect(item: NamedEffect) -> dict[str, Any]:
    evidence = item.evidence
    sentences = [
        f"Evidence: the Bayesian information criterion improves by {evidence.delta_bic:,.0f} "
        "(10 is strong; each effect pays for its parameters)."
    ]
    if evidence.heldout_delta_log_likelihood is not None:
        sentences.append(
            f"Recordings that took no part in its choice nor its size become more likely by "
            f"{evidence.heldout_delta_log_likelihood:,.1f} in natural logarithm."
        )
    chance = f"{max(evidence.p_value, 1e-300):.0e}" if evidence.p_value < 0.001 else f"{evidence.p_value:.2g}"
    bound = "less than " if evidence.p_value <= 1e-300 else "about "
    sentences.append(f"The chance of such a gain with nothing there is {bound}{chance}.")
    if line := remedy_of(item):
        sentences.append(f"{line[0].upper()}{line[1:]}.")
    rows: list[tuple[str, ...]] = [
        (name, plus_minus(value.value, value.sd), unit(item.id, name), everyday(item.id, name, value))
        for name, value in item.parameters.items()
    ]
    rows += [(name, text, "", "") for name, text in item.setting.items()]
    if not any(row[-1] for row in rows):
        rows = [row[:-1] for row in rows]
    return {
        "id": item.id,
        "title": name_of(item.id).capitalize() if name_of(item.id) != item.id else "An effect of your own:",
        "where": _where(item),
        "found": Markup(found(item.id, item.parameters, item.setting)),
        "form": Markup(form(item.id)),
        "header": ("parameter", "value", "unit", "that is")[: len(rows[0])],
        "parameters": rows,
        "evidence": " ".join(sentences),
        "confusions": [
            (other.id, _other(other), f"{other.delta_bic:,.0f}", other.next_recording or "")
            for other in item.confused_with
        ],
    }


def _other(item: Confusion) -> str:
    """Return what a confused effect is called, and which of its settings or sizes it is where that is told."""
    sizes = [f"{name} = {value.value:.4g}" for name, value in item.parameters.items()]
    which = ", ".join([*(f"{name} = {text}" for name, text in item.setting.items()), *sizes])
    return f"{name_of(item.id)} ({which})" if which else name_of(item.id)


def _where(item: NamedEffect) -> str:
    where = "In all recordings." if item.recordings is None else f"In {_recordings(item.recordings)} only."
    wind = wind_in_words(item.parameters)
    return f"{where} {wind}." if wind else where


def _law(law: Law) -> dict[str, Any]:
    gain = law.heldout_delta_log_likelihood
    return {
        "parts": [
            {
                "target": target_in_words(part.target),
                "text": Markup(law_text(part.text)),
                "coefficients": [
                    (name, plus_minus(value.value, value.sd)) for name, value in part.coefficients.items()
                ],
            }
            for part in (law, *law.also)
        ],
        "leaves": law.leaves,
        "evidence": "No recording could be set aside to test it."
        if gain is None
        else f"With it, recordings set aside become more likely by {gain:,.1f} in natural logarithm: its form was "
        "chosen with all of them, its numbers were fitted to the others.",
    }


def _place(item: Located) -> dict[str, Any]:
    return {
        "text": item.text[:1].upper() + item.text[1:],
        "recording": item.recording,
        "sensor": _plain(item.sensor),
        "axis": readable_axis(item.axis),
        "span": f"{item.from_s:.2f} to {item.to_s:.2f}",
        "grows_with": item.grows_with or "",
        "share": f"{100.0 * item.share_of_excess:.0f} %",
        "width": f"{_BAR * item.share_of_excess:.0f}",
    }


def _ranking(outcome: Outcome) -> list[dict[str, Any]]:
    named = {item.id for item in outcome.diagnosis.effects}
    largest = max((item.gain for item in outcome.candidates), default=0.0) or 1.0
    return [
        {
            "id": item.id,
            "name": name_of(item.id),
            "gain": f"{item.gain:,.1f}".replace("-", "−"),
            "width": f"{_BAR * max(item.gain / largest, 0.0):.0f}",
            "size": ", ".join(f"{name} = {value:.4g}".replace("-", "−") for name, value in item.parameters.items()),
            "note": ", ".join(
                filter(None, ("" if item.recordings is None else _recordings(item.recordings), item.note))
            ),
            "named": item.id in named,
        }
        for item in outcome.candidates[:_MOST_CANDIDATES]
    ]


def _further(outcome: Outcome) -> str:
    rest = outcome.candidates[_MOST_CANDIDATES:]
    if not rest:
        return ""
    largest = max(item.gain for item in rest)
    return f"{len(rest)} more were tried and gained at most {largest:,.1f}: {', '.join(item.id for item in rest)}."


def _next_recordings(diagnosis: Diagnosis) -> list[str]:
    """Return what to record next: what separates confused effects, then what the answer proposes, each once."""
    separating = [telling_apart(item.id, other) for item in diagnosis.effects for other in item.confused_with]
    return list(dict.fromkeys(text for text in (*separating, *diagnosis.next_recordings) if text))


def _by_recording(outcome: Outcome) -> list[tuple[str, str, str, str]]:
    """Return for each recording its mismatch over noise before and after, and where most of it is; the worst first."""
    squares: dict[str, dict[tuple[str, str], tuple[Any, Any]]] = {}
    for item in outcome.residuals:
        known = np.isfinite(item.before) & np.isfinite(item.after)
        if known.any():
            pair = item.before[known] ** 2, item.after[known] ** 2
            squares.setdefault(item.recording, {})[item.sensor, item.axis] = pair
    rows = []
    for recording, axes in squares.items():
        before, after = (np.concatenate([pair[k] for pair in axes.values()]).mean() for k in (0, 1))
        worst = max(axes, key=lambda axis: float(axes[axis][0].mean()))
        where = f"{_plain(worst[0])} {readable_axis(worst[1])}"
        rows.append((float(before), (recording, f"{before:.2f}", f"{after:.2f}", where)))
    return [row for _, row in sorted(rows, key=lambda item: -item[0])] if len(rows) > 1 else []


def _moved(name: str, item: Recalibration) -> tuple[str, str, str, str, str, str]:
    chance = erfc(abs(item.sigmas) / sqrt(2.0))
    return (
        name,
        plus_minus(item.stated, item.stated_sd),
        plus_minus(item.value, item.sd),
        _signed(item.sigmas, 1),
        f"{chance:.2g}" if chance >= 1e-12 else "below 1e-12",
        "beyond its uncertainty" if item.beyond else "",
    )


def _noise(item: NoiseNote) -> tuple[str, str, str, str, str, str]:
    remarks = []
    if item.stated_rms:
        ratio = item.observed_rms / item.stated_rms
        if ratio > _LEVEL:
            remarks.append(f"{ratio:.1f} times as large as stated")
        elif ratio < 1.0 / _LEVEL:
            remarks.append(f"{1.0 / max(ratio, 1e-9):.1f} times smaller than stated")
    if item.correlation_s > _MEMORY_S:
        remarks.append("slow: neighbouring readings err alike")
    sensor, _, part = item.sensor.partition(".")
    units = {"position": "m", "velocity": "m/s"}
    shown = {"uT": "µT", "m_s2": "m/s²", "rad_s": "rad/s", "m": "m", "": ""}
    return (
        " ".join(filter(None, (_plain(sensor), part))),
        units.get(part) or (shown[SENSORS[sensor].unit] if sensor in SENSORS else ""),
        "not stated" if item.stated_rms is None else f"{item.stated_rms:.3g}",
        f"{item.observed_rms:.3g}",
        f"{item.correlation_s:.2g}",
        ", ".join(remarks) or "as stated" if item.stated_rms is not None else ", ".join(remarks),
    )


def _meaning(diagnosis: Diagnosis) -> str:
    """Return what the verdict means, and what it does not where rows had to be counted or a stated number is off."""
    if diagnosis.verdict == "unexplained" and diagnosis.misstated:
        return (
            "As stated, a significant mismatch remains, and no effect is named: a number without a sigma is taken as "
            "exact. With a sigma it may move, and what the recordings then say of it is told with its error."
        )
    if diagnosis.verdict == "explained" and diagnosis.leftovers:
        return (
            "With this in the model little more is left than pure error: what a motion without any physics leaves of "
            "the same rows, whose instants were counted and not written. The table of what is left has both."
        )
    return _MEANINGS[diagnosis.verdict]


def _agreement(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Return which sensors agree, as sentences and tables, where any contradict one another."""
    found = diagnosis.agreement
    if found is None or not found.contradiction:
        return None
    tables = tables_of(found)
    if diagnosis.leftovers:
        tables.append(leftovers_of(diagnosis.leftovers))
    return {"sentences": found.sentences, "tables": tables}


def _over_noise(value: float) -> str:
    return f"{value:.2f}" if value < 9.995 else f"{value:.3g}" if value < 999.5 else f"{value:,.0f}"


def _outlier_text(count: int) -> str:
    text = f"{count} readings stand" if count != 1 else "One reading stands"
    more = f"; the {_MOST_OUTLIERS} furthest are listed." if count > _MOST_OUTLIERS else "."
    return f"{text} too far out for the noise, and weigh less than the others{more}"


def _signed(value: float, places: int) -> str:
    return f"{value:+,.{places}f}".replace("-", "−")


def _plain(name: str) -> str:
    return "GPS" if name == "gps" else name.replace("_", " ")


def _recordings(names: Sequence[str]) -> str:
    return f"recording{'s' * (len(names) > 1)} {_joined(names)}"


def _joined(items: Sequence[str]) -> str:
    """Return "a, b and c"."""
    return " and ".join(filter(None, (", ".join(items[:-1]), items[-1])))
