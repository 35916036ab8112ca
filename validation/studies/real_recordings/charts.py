"""One figure per measured source."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from discsim.estimators.rate import YawRate
from discsim.files import write_bytes
from discsim.validation.reporting.figures import COLOURS, draw_rates, new_figure
from discsim.validation.studies.real_recordings.agreement import LOWERED, Attempt, run_fft
from discsim.validation.studies.real_recordings.findings import SHIFTS, shifted_rms
from discsim.validation.studies.real_recordings.sources import Measured, Source

__all__ = ["draw"]

#: Length of the stretch of a hand-turned recording that is drawn, s: over all of it the reversals run together.
STRETCH = 4.0
#: Dots per inch and colours of a figure: the page's figures are kept with the documentation, so they are kept small.
DPI, PALETTE = 125.0, 256


def draw(source: Source, cuts: Sequence[Measured], tried: Sequence[Sequence[Attempt]], path: Path) -> None:
    """Draw the methods with the reference, and what else the source needs, into a PNG."""
    if source.reference == "optical":
        figure, grid = new_figure(len(cuts), 2, width=10.0, height=3.2 * len(cuts), width_ratios=(3, 1), squeeze=False)
        for (left, right), cut, attempts in zip(grid, cuts, tried, strict=True):
            _by_hand(left, cut, attempts)
            _shifts(right, cut)
    elif source.lowered is not None:  # its cuts are one log as several sensors saw it
        figure, (left, right) = new_figure(1, 2, width=10.0, height=3.6)
        _whole(left, source, cuts[0])
        _rates(right, cuts[0], tried[0])
        for other in cuts[1:]:
            assert other.reference is not None
            shown = _inside(other.reference, other)
            line = {"color": COLOURS["gyroscope"], "ls": ":", "lw": 1.0}
            right.plot(shown.t, np.degrees(np.abs(shown.rate)), label=f"gyroscope of {other.cut.label}", **line)
        right.legend(loc="upper center", fontsize=7, ncols=2)
    else:
        rows = (len(cuts) + 1) // 2
        figure, grid = new_figure(rows, 2, width=10.0, height=3.2 * rows, squeeze=False)
        for axes, cut, attempts in zip(grid.flat, cuts, tried, strict=False):
            _rates(axes, cut, attempts)
    _save(figure, path)


def _rates(axes: Axes, cut: Measured, attempts: Sequence[Attempt]) -> None:
    # the accelerometer's worst case would set the scale of every panel
    rates = [replace(one.rate, lower=None, upper=None) for one in attempts if one.rate is not None]
    if cut.reference is not None:
        rates.append(_inside(cut.reference, cut))
    draw_rates(axes, rates)
    _legend_above(axes)
    axes.set_title(cut.cut.label)


def _legend_above(axes: Axes) -> None:
    """Put the legend over the curves, with room made for it."""
    low, high = axes.get_ylim()
    lines = (len(axes.get_legend_handles_labels()[0]) + 1) // 2
    axes.set_ylim(low, high + (0.05 + 0.07 * lines) * (high - low))
    axes.legend(loc="upper center", fontsize=7, ncols=2)


def _by_hand(axes: Axes, cut: Measured, attempts: Sequence[Attempt]) -> None:
    """Draw the methods over a stretch, the optical rate about z on them, and the size of its vector."""
    assert cut.reference is not None
    assert cut.vector is not None
    t = cut.reference.t
    start = float(np.median(t)) - STRETCH / 2
    shown = (t >= start) & (t <= start + STRETCH)
    parts = [_between(one.rate, start, start + STRETCH) for one in attempts if one.rate is not None]
    draw_rates(axes, parts)
    about, size = np.degrees(np.abs(cut.vector[shown, 2])), np.degrees(np.linalg.norm(cut.vector[shown], axis=1))
    axes.plot(t[shown], about, "k--", lw=0.9, label="optical, about z")
    axes.plot(t[shown], size, "k:", lw=0.9, label="optical, size of the vector")
    axes.set_ylim(0, 1.6 * np.nanmax(np.append(size, axes.get_ylim()[1] / 1.3)))
    axes.legend(loc="upper center", fontsize=7, ncols=3)
    axes.set_title(f"{cut.cut.label}, {STRETCH:.0f} s of it")


def _whole(axes: Axes, source: Source, cut: Measured) -> None:
    """Draw `fft` with lowered settings and the reference over the whole log, the compared span shaded."""
    assert source.lowered is not None
    rates = [run_fft(cut.whole, source.lowered, LOWERED)]
    rates += [] if cut.reference is None else [cut.reference]
    draw_rates(axes, rates)
    if cut.cut.span is not None:
        axes.axvspan(*cut.cut.span, color="#000000", alpha=0.07, lw=0)
    axes.set_title("the whole log (shaded: compared)")


def _shifts(axes: Axes, cut: Measured) -> None:
    assert cut.vector is not None
    rms = np.degrees(shifted_rms(cut.recording.need("gyroscope"), cut.vector))
    axes.plot(1000 * SHIFTS, rms, ".-", color=COLOURS["gyroscope"])
    axes.set_ylim(0, None)
    axes.set_xlabel("optical rate taken later by (ms)")
    axes.set_ylabel("rms difference (deg/s)")
    axes.set_title("gyroscope less optical, vector")


def _save(figure: Figure, path: Path) -> None:
    """Write a PNG with a palette, a third of the size of one with four channels."""
    full, small = io.BytesIO(), io.BytesIO()
    figure.savefig(full, format="png", dpi=DPI, metadata={"Software": None})
    picture = Image.open(full).convert("RGB").quantize(PALETTE, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    picture.save(small, format="png", optimize=True)
    write_bytes(path, small.getvalue())


def _inside(rate: YawRate, cut: Measured) -> YawRate:
    first = min(samples.t[0] for samples in cut.recording.samples.values())
    last = max(samples.t[-1] for samples in cut.recording.samples.values())
    return _between(rate, float(first), float(last))


def _between(rate: YawRate, start: float, stop: float) -> YawRate:
    chosen = (rate.t >= start) & (rate.t <= stop)
    return YawRate(rate.method, rate.t[chosen], rate.rate[chosen], rate.sd[chosen], rate.signed)
