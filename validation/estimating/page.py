"""The report of an estimate: the spin rate in a sentence, each method's figures, and what to know first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from discsim.estimators.rate import YawRate
from discsim.recording import Recording
from discsim.validation.reporting.html import Section, Tone, write_report

__all__ = ["answer_of", "write_estimate_page"]


def answer_of(rates: Sequence[YawRate]) -> str:
    """Return the spin rate in a sentence, by the most preferred method that knows it anywhere."""
    knowing = [rate for rate in rates if np.isfinite(rate.rate).any()]
    if not knowing:
        return f"No spin rate: {', '.join(rate.method for rate in rates) or 'no method'} could tell one anywhere."
    rate = knowing[0]
    known = np.isfinite(rate.rate)
    value = np.degrees(rate.rate[known] if rate.signed else np.abs(rate.rate[known]))
    low, high = np.percentile(value, (1.0, 99.0))
    if rate.median.beyond:
        return (
            f"Spin rate beyond {np.degrees(rate.median.rate):,.0f} deg/s, the limit of the sensor, by {rate.method}: "
            f"most of its readings are clipped, and it is known for {100 * known.mean():.0f} % of the time only, "
            f"between {low:,.1f} and {high:,.1f} deg/s then."
        )
    middle, sd = np.degrees(rate.median[:2]).tolist()
    turns = abs(middle) / 360.0
    said = f"Spin rate {middle:,.1f} deg/s in the middle ({turns:.2f} turns a second, {60 * turns:,.0f} rpm)"
    spread = f"from {low:,.1f} to {high:,.1f} deg/s (98 % of the values)"
    sure = f"standard deviation {_short(sd)} deg/s" if np.isfinite(sd) else "no standard deviation"
    unsigned = "" if rate.signed else " A magnitude: this method cannot tell the direction of spin."
    return f"{said}, {spread}, {sure}, by {rate.method}; known for {100 * known.mean():.0f} % of the time.{unsigned}"


def write_estimate_page(
    out: Path,
    recording: Recording,
    rates: Sequence[YawRate],
    left_out: Mapping[str, str],
    contradictions: Sequence[str],
    notes: Sequence[str],
) -> Path:
    """Write report.html into ``out``, where rate.png is already; return the path of the page."""
    known = any(np.isfinite(rate.rate).any() for rate in rates)
    lead = answer_of(rates)
    if contradictions:
        lead += f" {len(contradictions)} contradiction{'s' * (len(contradictions) > 1)} between methods: see below."
    sections = []
    if contradictions or notes:
        sections.append(
            Section("Before you believe it", [f"{text[:1].upper()}{text[1:]}." for text in (*contradictions, *notes)])
        )
    text = (
        "Values are those at which a method was asked; unknown is the share at which it cannot tell. The standard "
        "deviation is each method's own. The most preferred method stands first."
    )
    header = ("method", "values", "unknown", "median, deg/s", "1 %", "99 %", "median sd, deg/s")
    figures = [("Spin rate over time, with bands of one standard deviation", out / "rate.png")]
    sections.append(Section("By method", (text,), header, [_row(rate) for rate in rates], figures))
    if left_out:
        why = [(method, reason) for method, reason in left_out.items()]
        sections.append(Section("Methods left out", (), ("method", "because"), why))
    sections.append(_sensors(recording))
    tone: Tone = "bad" if not known else "heed" if contradictions else "good"
    write_report(out / "report.html", f"Spin rate of {recording.name}", lead, sections, tone)
    return out / "report.html"


def _row(rate: YawRate) -> tuple[str, ...]:
    known = np.isfinite(rate.rate)
    if not known.any():
        return (rate.method, str(len(rate)), "100 %", "–", "–", "–", "–")
    value, sd = np.degrees(rate.rate[known]), np.degrees(rate.median.sd)
    ends = (f"{x:.2f}" for x in np.percentile(value, (1.0, 99.0)))
    unknown = f"{100 * (1 - known.mean()):.0f} %"
    if rate.median.beyond:
        return (rate.method, str(len(rate)), unknown, f"beyond {np.degrees(rate.median.rate):.0f}", *ends, "–")
    return (rate.method, str(len(rate)), unknown, f"{np.degrees(rate.median.rate):.2f}", *ends, _short(float(sd)))


def _short(sd: float) -> str:
    return "–" if not np.isfinite(sd) else f"{sd:.2g}" if sd < 100.0 else f"{sd:.0f}"


def _sensors(recording: Recording) -> Section:
    rows = []
    for name, samples in recording.samples.items():
        sheet = recording.sheets[name]
        rows.append(
            (
                name.replace("_", " "),
                f"{len(samples):,}",
                f"{sheet.rate_hz:.6g}",
                f"{samples.t[0]:.2f} to {samples.t[-1]:.2f}" if len(samples) else "–",
                "–" if sheet.noise_rms is None else f"{sheet.noise_rms:.3g}",
                "–" if sheet.range is None else f"{sheet.range:.4g}",
            )
        )
    text = f"Plant: {recording.plant.replace('_', ' ')}. As stated, in SI units (field in uT)."
    header = ("sensor", "readings", "rate, Hz", "time, s", "noise (rms)", "range")
    return Section("What was recorded", (text,), header, rows)
