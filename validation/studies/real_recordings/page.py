"""The page of the documentation on measured recordings: a summary, then a table and a figure per source."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from discsim.files import write_text
from discsim.recording import SENSORS
from estimators.fft import FftSettings
from validation.studies.real_recordings.agreement import LOWERED, PHASE_WINDOW, RATIO_FROM, Agreement, attempts, held
from validation.studies.real_recordings.charts import draw
from validation.studies.real_recordings.findings import FINDINGS
from validation.studies.real_recordings.road import Answers, road_section
from validation.studies.real_recordings.sources import SOURCES, Measured, Source, load

__all__ = ["write_page"]


def write_page(
    real: Path,
    out: Path,
    also: Sequence[str] | None = None,
    say: Callable[[str], None] = lambda _: None,
    sources: Sequence[Source] = SOURCES,
    walked: Sequence[Answers] = (),
) -> Path:
    """Write ``out``.md and a PNG per source into the folder ``out``; return the page's path.

    ``also`` names the methods that are tried beside the paper's (`attempts`); ``walked`` is what the commands said of
    each log. The same recordings give the same bytes, but for the processor times in ``walked``.
    Raises `InputError` as importing and `attempts` do.
    """
    summary: list[Sequence[str]] = []
    sections: list[str] = []
    for source in sources:
        say(source.title)
        cuts = [load(source, cut, real) for cut in source.cuts]
        tried = [attempts(source, cut, also) for cut in cuts]
        found = [held(cut, made) for cut, made in zip(cuts, tried, strict=True)]
        figure = out / f"{source.key}.png"
        draw(source, cuts, tried, figure)
        for cut, agreements in zip(cuts, found, strict=True):
            core = [one for one in agreements if one.method in _SUMMED]
            summary += [[f"[{cut.cut.label}](#{source.key})", *_summary_cells(one)] for one in core]
        sections.append(_section(source, cuts, found, f"{out.name}/{figure.name}"))
    page = out.parent / f"{out.name}.md"
    road = [*road_section(walked), ""] if walked else []
    write_text(page, "\n".join([_lead(), *road, _summed(), _table(_SUMMARY, summary), "", *sections]))
    return page


_SUMMED = ("fft", LOWERED, "accelerometer", "gyroscope", "gyroscope, size")
_SUMMARY = ("recording", "method", "against", "known", "ratio", "rms difference, deg/s", "remark")
_DETAIL = (
    "method",
    "against",
    "answers",
    "known",
    "median",
    "reference's",
    "ratio",
    "rms difference",
    "beyond 3 sd",
    "remark",
)


def _lead() -> str:
    what = (
        "What the commands make of logs that nobody here wrote, and how far each method's rate is from a reference "
        "sensor. Every number in the tables and findings is computed by the command below from the recordings in "
        "`DISCSIM_RECORDINGS` (or `--recordings DIR`), and the same recordings give the same bytes, but for processor "
        "times. Whatever disagrees is stated with its size and left standing."
    )
    lines = [
        "# Real recordings",
        "",
        _wrapped(what),
        "",
        "```sh",
        "discsim study real-recordings",
        "```",
        "",
    ]
    return "\n".join(
        [
            *lines,
            "To import and estimate such data yourself: [Importing](importing.md), [Estimators](estimators.md).",
            "",
        ]
    )


def _summed() -> str:
    paper = FftSettings()
    lines = ["## The methods against a reference", "", "How to read it:", ""]
    entries = (
        "*known*: share of a method's answers that are numbers; it is silent where it cannot tell.",
        f"*ratio*: median of method over reference, where the reference turns at {np.degrees(RATIO_FROM):.0f} deg/s "
        "or faster. *rms difference*: in deg/s, over all times at which both are known. Both are of magnitudes where "
        "one of the two has no sign.",
        "`fft` and `field's phase` are held against the reference's mean over their window, other methods against "
        "its value at the time: a ripple of the reference that a method averages away counts as a difference.",
        "*beyond 3 sd*: share of the differences larger than three of the method's own standard deviations.",
        f"`fft` has the paper's settings: window {paper.window} samples, threshold {np.degrees(paper.threshold):.0f} "
        f"deg/s. `{LOWERED}` is the same method with a lower threshold and another window, stated in each section, "
        "and with each window's mean taken off.",
        "`field's phase` is no method of the program: the slope of the field's angle about the centre of a fitted "
        f"circle, over {PHASE_WINDOW} s, for bodies too slow for a spectrum.",
        "A reference is a sensor and not the truth; and what a method that takes the gyroscope in says against the "
        "gyroscope is no test of it.",
    )
    lines += [*(_wrapped(entry, "- ") for entry in entries), "", "### Summary", ""]
    return "\n".join([*lines, "The paper's two methods, and the gyroscope where something else can judge it.", ""])


def _wrapped(text: str, bullet: str = "") -> str:
    return textwrap.fill(
        text,
        118,
        initial_indent=bullet,
        subsequent_indent=" " * len(bullet),
        break_long_words=False,
        break_on_hyphens=False,
    )


def _section(source: Source, cuts: Sequence[Measured], found: Sequence[Sequence[Agreement]], figure: str) -> str:
    findings = FINDINGS[source.key](source, cuts, found)
    lines = [
        f'<a id="{source.key}"></a>',
        "",
        f"## {source.title}",
        "",
        _wrapped(source.about),
        "",
        _wrapped(f"*Source:* {source.terms}"),
        "",
    ]
    lines += [_table(("sensor", "samples read", "median rate, Hz", "longest step, ms"), _sampling(cuts)), ""]
    if source.lowered is not None and "magnetometer" in cuts[0].recording:
        lowered, interval = source.lowered, cuts[0].recording.need("magnetometer").interval
        lines += [
            f"`{LOWERED}`: window {lowered.window} samples ({lowered.window * interval:.2f} s), threshold "
            f"{np.degrees(lowered.threshold):.0f} deg/s ({np.degrees(lowered.threshold) / 360:.2f} Hz).",
            "",
        ]
    for cut, agreements in zip(cuts, found, strict=True):
        lines += [
            f"**{cut.cut.label}**{_span(cut)}",
            "",
            _table(_DETAIL, [_detail_cells(one) for one in agreements]),
            "",
        ]
    lines += [f"![{source.title}: spin rate by each method]({figure})", "", "What is found:", ""]
    lines += [_wrapped(sentence, "- ") for sentence in findings.sentences]
    if findings.rows:
        lines += ["", _table(findings.header, findings.rows)]
    return "\n".join([*lines, ""])


def _span(cut: Measured) -> str:
    first = min(samples.t[0] for samples in cut.recording.samples.values())
    last = max(samples.t[-1] for samples in cut.recording.samples.values())
    rows = "" if cut.cut.rows is None else f"data rows {cut.cut.rows.start} to {cut.cut.rows.stop - 1}, "
    return f" ({rows}{first:.1f} to {last:.1f} s)"


def _sampling(cuts: Sequence[Measured]) -> list[list[str]]:
    rows = []
    for sensor in SENSORS:
        present = [cut.whole.samples[sensor] for cut in cuts if sensor in cut.whole]
        if present:
            counts = ", ".join(dict.fromkeys(str(len(samples)) for samples in present))
            rate = ", ".join(dict.fromkeys(f"{1 / samples.interval:.4g}" for samples in present))
            longest = max(float(np.max(np.diff(samples.t))) for samples in present)
            rows.append([sensor, counts, rate, f"{1000 * longest:.1f}"])
    return rows


def _summary_cells(one: Agreement) -> list[str]:
    return [one.method, one.reference or "nothing", _known(one), _ratio(one), _deg(one.rms), one.reason]


def _detail_cells(one: Agreement) -> list[str]:
    return [
        one.method,
        one.reference or "nothing",
        str(one.values) if one.values else "",
        _known(one),
        _deg(one.median),
        _deg(one.reference_median),
        _ratio(one),
        _deg(one.rms),
        _percent(one.beyond) if np.isfinite(one.beyond) else "",
        one.reason,
    ]


def _known(one: Agreement) -> str:
    return _percent(one.known) if one.values else "cannot run"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %" if 0 < share < 1 else f"{100 * share:.0f} %"


def _ratio(one: Agreement) -> str:
    return f"{one.ratio:.3f}" if np.isfinite(one.ratio) else ""


def _deg(rate: float) -> str:
    return f"{np.degrees(rate):.1f}" if np.isfinite(rate) else ""


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
