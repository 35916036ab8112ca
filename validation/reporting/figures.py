"""One look for all figures of the project, and figures that are written whole or not at all."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any
from weakref import WeakSet

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.ticker import LogFormatter, NullLocator

from discsim.arrays import FloatArray
from discsim.estimators.rate import YawRate
from discsim.estimators.spin_spline import IndexArray
from discsim.files import write_bytes
from discsim.validation.reporting.drawn_values import KEY, drawn_values

__all__ = [
    "COLOURS",
    "STYLE",
    "colour",
    "draw_differences",
    "draw_rates",
    "legend_columns",
    "new_figure",
    "save_figure",
    "symmetric_log",
]

#: One colour per method wherever it is drawn: Okabe and Ito's, which colour-blind readers can tell apart.
COLOURS: Mapping[str, str] = MappingProxyType(
    {
        "truth": "#000000",
        "rate_reference": "#000000",
        "fft": "#d55e00",
        "accelerometer": "#0072b2",
        "gyroscope": "#cc79a7",
        "adxrs649": "#009e73",
        "best": "#009e73",
        "fusion": "#6a3d9a",
        "tracking": "#8c6d31",
        "likelihood": "#56b4e9",
        "accelerometer_calibrated": "#7f7f7f",
    }
)
_OTHERS = ("#e69f00", "#117733", "#882255", "#44aa99", "#999933")

#: matplotlib settings of every figure.
STYLE: Mapping[Any, Any] = MappingProxyType(
    {
        "font.size": 9.0,
        "axes.titlesize": 10.0,
        "axes.titlelocation": "left",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.color": "#dddddd",
        "grid.linewidth": 0.6,
        "axes.axisbelow": True,
        "legend.frameon": False,
        "lines.linewidth": 1.2,
        "svg.hashsalt": "discsim",  # the same figure gives the same bytes
    }
)


#: matplotlib's settings of whoever called, from the first figure begun until the last one is saved
_BEFORE: dict[Any, Any] = {}
#: figures begun and not saved; one that nobody holds any more drops out
_BEGUN: WeakSet[Figure] = WeakSet()


def colour(method: str, others: Sequence[str] = ()) -> str:
    """Return a method's colour; one without its own takes the next free one by its place in ``others``."""
    if method in COLOURS:
        return COLOURS[method]
    unlisted = [name for name in others if name not in COLOURS]
    return _OTHERS[unlisted.index(method) % len(_OTHERS) if method in unlisted else 0]


def new_figure(
    rows: int = 1, columns: int = 1, *, width: float = 9.0, height: float = 4.5, **options: Any
) -> tuple[Figure, Any]:
    """Return a figure (inches) and its axes as ``Figure.subplots`` does (one, or an array of them)."""
    # not in a context: titles and legends come later and take it too; `save_figure` gives back what was
    _BEFORE.update({key: mpl.rcParams[key] for key in STYLE if key not in _BEFORE})
    mpl.rcParams.update(dict(STYLE))
    figure = Figure(figsize=(width, height), layout="constrained")
    _BEGUN.add(figure)
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, **options)


def legend_columns(labels: Sequence[str], width: float, fontsize: float) -> int:
    """Return how many columns of a legend fit into a width (inches), one at least; the font is in points.

    A legend that is wider than its figure leaves the axes no room.
    """
    font = FontProperties(size=fontsize)
    widest = max((text_to_path.get_text_width_height_descent(label, font, False)[0] for label in labels), default=0.0)
    beside = mpl.rcParams["legend.handlelength"] + mpl.rcParams["legend.handletextpad"]
    column = widest + fontsize * (beside + mpl.rcParams["legend.columnspacing"])
    return max(1, min(len(labels), int(72.0 * width / column)))


def save_figure(figure: Figure, path: Path | None) -> Figure:
    """Write a figure as ``path``'s ending says (``.png`` or ``.svg``), without a date, unless it is None; return it.

    With the last figure that was begun, matplotlib's settings are the caller's own again.
    """
    try:
        return _saved(figure, path)
    finally:
        _BEGUN.discard(figure)
        if not _BEGUN:
            mpl.rcParams.update(_BEFORE)
            _BEFORE.clear()


def _saved(figure: Figure, path: Path | None) -> Figure:
    _take_names_literally(figure)
    if path is None:
        return figure
    kind = path.suffix.removeprefix(".")
    metadata: dict[str, str | None] = {"Date": None} if kind == "svg" else {"Software": None}
    if kind == "png" and (values := drawn_values(figure)):
        metadata[KEY] = values
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, dpi=150, metadata=metadata)
    write_bytes(path, buffer.getvalue())
    return figure


def _take_names_literally(figure: Figure) -> None:
    """Let a dollar in a recording's name be one: matplotlib reads a formula between two, and fails at a wrong one."""
    named = [text for text in figure.findobj(Text) if "$" in text.get_text()]
    if not named:
        return
    logarithmic = [
        axis
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        if isinstance(axis.get_major_formatter(), LogFormatter)
    ]
    ticks = [tick for axis in logarithmic for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())]
    formulas = {id(label) for tick in ticks for label in (tick.label1, tick.label2)}  # powers of ten
    for text in named:
        if id(text) not in formulas:
            text.set_parse_math(False)


def symmetric_log(axes: Axes, *, linear: float, limit: float) -> None:
    """Give the y axis a scale that is linear within +-``linear`` and logarithmic to +-``limit``, with plain numbers."""
    axes.set_yscale("symlog", linthresh=linear)
    axes.set_ylim(-limit, limit)
    decades = [linear * factor for factor in (1.0, 3.0, 10.0, 30.0, 100.0) if linear * factor <= limit]
    axes.set_yticks([-value for value in reversed(decades)] + [0.0] + decades)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())


def draw_rates(axes: Axes, rates: Sequence[YawRate]) -> None:
    """Draw spin rates over time in deg/s with bands of one standard deviation, and the bounds of those that have them.

    Where one method has no sign all are drawn as magnitudes. The scale is set by the rates, not by their bands.
    """
    signless = any(not rate.signed for rate in rates)
    names = [rate.method for rate in rates]
    # The scattered methods first, so that the smooth ones lie on top of them.
    for rate in sorted(rates, key=lambda rate: -_scatter(rate)):
        shade = colour(rate.method, names)
        look: dict[str, Any] = (
            {"ls": "--", "lw": 0.9} if rate.method == "rate_reference" else {}
        )  # what it covers must show
        value = np.degrees(np.abs(rate.rate) if signless else rate.rate)
        sd = np.degrees(rate.sd)
        known = np.isfinite(value)
        if not known.any():
            axes.plot([], [], color=shade, label=f"{rate.method} (unknown throughout)")
            continue
        isolated = known & ~np.append(known[1:], False) & ~np.append(False, known[:-1])
        _band(axes, rate.t, value, sd, shade)
        chosen = _outline(rate.t, value)
        axes.plot(rate.t[chosen], value[chosen], color=shade, label=rate.method, **look)
        lone = chosen[isolated[chosen]]
        axes.plot(rate.t[lone], value[lone], ".", color=shade, ms=3)
        if rate.lower is not None and rate.upper is not None:
            for number, bound in enumerate((rate.lower, rate.upper)):
                label = f"{rate.method}, worst case (11)" if number == 0 else None
                at = _outline(rate.t, bound)
                axes.plot(rate.t[at], np.degrees(bound[at]), color=shade, lw=0.7, ls=":", label=label)
    shown = np.concatenate([np.degrees(np.abs(r.rate) if signless else r.rate) for r in rates] or [np.zeros(0)])
    shown = shown[np.isfinite(shown)]
    if shown.size:
        low, high = np.percentile(shown, (0.1, 99.9))
        margin = max(0.08 * (high - low), 0.006 * abs(high), 1.0, *(1.3 * np.degrees(_scatter(r)) for r in rates))
        axes.set_ylim(max(0.0, low - margin) if signless else low - margin, high + margin)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("magnitude of spin rate (deg/s)" if signless else "spin rate (deg/s)")
    axes.legend(loc="best", fontsize=8)


def draw_differences(axes: Axes, rates: Sequence[YawRate], reference: YawRate) -> None:
    """Draw each rate less ``reference``, in deg/s with bands of one standard deviation of its own.

    Where one of the two has no sign magnitudes are compared. The scale is linear to 10 deg/s, logarithmic beyond.
    """
    names = [rate.method for rate in rates]
    for rate in sorted(rates, key=lambda rate: -_scatter(rate)):
        middle = reference.at(rate.t)
        signless = not (rate.signed and reference.signed)
        value = np.degrees(np.abs(rate.rate) - np.abs(middle) if signless else rate.rate - middle)
        shade, sd = colour(rate.method, names), np.degrees(rate.sd)
        _band(axes, rate.t, value, sd, shade)
        chosen = _outline(rate.t, value)
        axes.plot(rate.t[chosen], value[chosen], color=shade, lw=0.9)
    symmetric_log(axes, linear=10.0, limit=300.0)
    axes.set_xlabel("time (s)")
    axes.set_ylabel(f"rate less {reference.method} (deg/s)")


#: Columns of pixels of the widest figure: 10 inches of 150 dots. Of more readings than four to a column (first, least,
#: greatest and last draw the same line) only those are drawn.
_COLUMNS = 1500


def _outline(t: FloatArray, value: FloatArray) -> IndexArray:
    """Return which of values (n,) over t to draw: of each column of pixels the first, least, greatest and last known.

    One unknown value of a column that has any stays, so that a gap does. All where they are few.
    """
    if t.size <= 4 * _COLUMNS:
        return np.arange(t.size)
    column = np.minimum(((t - t[0]) / (t[-1] - t[0]) * _COLUMNS).astype(np.int64), _COLUMNS - 1)
    known = np.isfinite(value)
    first = np.flatnonzero(np.diff(column, prepend=-1))
    last = np.append(first[1:], t.size) - 1
    kept = [first, last]
    for worst, pick in ((np.inf, np.minimum), (-np.inf, np.maximum)):
        best = np.repeat(pick.reduceat(np.where(known, value, worst), first), last - first + 1)
        same = np.flatnonzero(known & (value == best))
        kept.append(same[np.unique(column[same], return_index=True)[1]])
    gaps = np.flatnonzero(~known)
    kept.append(gaps[np.unique(column[gaps], return_index=True)[1]])
    return np.unique(np.concatenate(kept))


def _band(axes: Axes, t: FloatArray, value: FloatArray, sd: FloatArray, shade: str) -> None:
    """Fill one standard deviation on either side of values (n,), of each column of pixels the outermost."""
    chosen = np.union1d(_outline(t, value - sd), _outline(t, value + sd))
    t, value, sd = t[chosen], value[chosen], sd[chosen]
    axes.fill_between(t, value - sd, value + sd, where=np.isfinite(value).tolist(), color=shade, alpha=0.2, lw=0)


def _scatter(rate: YawRate) -> float:
    return float(np.nanmedian(rate.sd)) if np.isfinite(rate.sd).any() else 0.0
