"""The page of the documentation on measured recordings: a summary, then a table and a figure per source."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from discsim.estimators.fft import FftSettings
from discsim.recording import SENSORS
from discsim.validation.reporting import markdown
from discsim.validation.studies.real_recordings.agreement import (
    LOWERED,
    PHASE_WINDOW,
    RATIO_FROM,
    Agreement,
    attempts,
    held,
)
from discsim.validation.studies.real_recordings.charts import draw
from discsim.validation.studies.real_recordings.findings import FINDINGS
from discsim.validation.studies.real_recordings.road import Answers, road_section
from discsim.validation.studies.real_recordings.sources import SOURCES, Measured, Source, load

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
    sections = []
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
        sections.append({**_section(source, cuts, found), "figure": f"{out.name}/{figure.name}"})
    page = out.parent / f"{out.name}.md"
    markdown.write_page(
        page,
        Path(__file__).with_name("page.md.j2"),
        road="\n".join(road_section(walked)) if walked else "",
        ratio_from=RATIO_FROM,
        paper=FftSettings(),
        lowered=LOWERED,
        phase_window=PHASE_WINDOW,
        summary=summary,
        sections=sections,
    )
    return page


_SUMMED = ("fft", LOWERED, "accelerometer", "gyroscope", "gyroscope, size")


def _section(source: Source, cuts: Sequence[Measured], found: Sequence[Sequence[Agreement]]) -> dict[str, Any]:
    """Return what the template's part about a source is filled with."""
    tried = source.lowered is not None and "magnetometer" in cuts[0].recording
    return {
        "source": source,
        "sampling": _sampling(cuts),
        "interval": cuts[0].recording.need("magnetometer").interval if tried else None,
        "cuts": [
            (cut.cut.label, _span(cut), [_detail_cells(one) for one in agreements])
            for cut, agreements in zip(cuts, found, strict=True)
        ],
        "findings": FINDINGS[source.key](source, cuts, found),
    }


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
