"""Figures of a diagnosis: residuals before and after, over all recordings and sensor by sensor."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from discsim.arrays import FloatArray
from discsim.recording import SENSORS
from discsim.validation.diagnosis.result import Located, Residuals
from discsim.validation.reporting.figures import new_figure

__all__ = ["draw_overview", "draw_sensor", "readable_axis", "sensors_of"]

#: Okabe and Ito's colours and two more, for as many recordings; more of them take a colour map in order
_SHADES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#6a3d9a", "#7f7f7f")
_MARK = "#e8b400"
#: residuals are drawn linear to this many standard deviations and logarithmic beyond
_LINEAR = 3.0
#: most points drawn of one axis of one recording; of more each n-th, and what stands out further than this
_MOST_POINTS, _OUTSTANDING = 3000, 4.5
#: a span shorter than this share of the time shown is shaded over the whole height
_SHORT = 0.25
#: the overview's colours change at these multiples of the noise, and it has room for this many recordings
_STEPS = (0.0, 1.15, 1.5, 2.0, 4.0, 10.0, 30.0, 100.0)
_MOST_ROWS = 30


def readable_axis(axis: str) -> str:
    """Return ``v_north_m_s`` as "v north": a column's name without its unit."""
    units = ("uT", "m_s2", "rad_s", "m_s", "m")
    ending = next((f"_{unit}" for unit in units if axis.endswith(f"_{unit}")), "")
    return axis.removesuffix(ending).replace("_", " ")


def sensors_of(residuals: Iterable[Residuals]) -> list[str]:
    """Return the sensors that have residuals, in the order of the recording format, others after them."""
    present = list(dict.fromkeys(item.sensor for item in residuals))
    return [sensor for sensor in SENSORS if sensor in present] + [s for s in present if s not in SENSORS]


def _rms(values: FloatArray) -> tuple[float, float]:
    """Return the rms of the known values, and how large noise alone makes it once in some hundred times."""
    known = values[np.isfinite(values)]
    if not known.size:
        return float("nan"), float("nan")
    return float(np.sqrt(np.mean(known**2))), 1.0 + 2.5 / float(np.sqrt(2.0 * known.size))


def draw_overview(residuals: Sequence[Residuals]) -> Figure:
    """Draw the rms of each axis of each recording over its noise, before and after: where the mismatch is, at a glance.

    A recording is a row; of more than fit the worst are shown. What so few readings of plain noise may give is pale.
    """
    columns = [
        (sensor, axis)
        for sensor in sensors_of(residuals)
        for axis in dict.fromkeys(item.axis for item in residuals if item.sensor == sensor)
    ]
    before = {(item.recording, item.sensor, item.axis): _rms(item.before) for item in residuals}
    after = {(item.recording, item.sensor, item.axis): _rms(item.after) for item in residuals}
    names = list(dict.fromkeys(item.recording for item in residuals))
    worst = {name: max(rms for (recording, *_), (rms, _) in before.items() if recording == name) for name in names}
    kept = sorted(names, key=lambda name: -np.nan_to_num(worst[name]))[:_MOST_ROWS]
    rows = [name for name in names if name in kept]
    height = 2.0 + 0.5 * len(rows)
    figure, panels = new_figure(2, 1, width=10.0, height=height, sharex=True)
    _lay_out(figure, height, 2, left=min(2.5, 0.4 + 0.075 * max(map(len, rows))), bottom=1.1, gap=0.35)
    titles = ("Before: the baseline", "After: the final model")
    for axes, title, values in zip(panels, titles, (before, after), strict=True):
        nothing = (np.nan, np.nan)
        table = np.array([[values.get((row, *column), nothing) for column in columns] for row in rows])
        cells, plain = table[..., 0], table[..., 1]
        norm = BoundaryNorm(_STEPS, 256, extend="max")
        axes.imshow(np.ma.masked_invalid(np.where(cells <= plain, 1.0, cells)), cmap="YlOrRd", norm=norm, aspect="auto")
        axes.set_title(f"{title}. Residuals (rms) over the noise; 1 is noise alone")
        axes.set_yticks(range(len(rows)), rows)
        axes.set_facecolor("#eeeeee")
        labels = [f"{sensor.replace('_', ' ')} {readable_axis(axis)}" for sensor, axis in columns]
        axes.set_xticks(range(len(columns)), labels, rotation=40, ha="right", rotation_mode="anchor")
        axes.grid(False)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        for (i, j), cell in np.ndenumerate(cells):
            if np.isfinite(cell):
                shade = "white" if cell >= 10.0 else "black"
                axes.text(j, i, _short(float(cell)), ha="center", va="center", fontsize=7, color=shade)
        for k in range(1, len(columns)):
            if columns[k][0] != columns[k - 1][0]:
                axes.axvline(k - 0.5, color="white", lw=5)
    return figure


def _short(value: float) -> str:
    return f"{value:.2f}" if value < 9.995 else f"{value:.0f}" if value < 9999.5 else f"{value:.0e}"


def _lay_out(figure: Figure, height: float, rows: int, *, left: float, bottom: float, gap: float = 0.12) -> None:
    """Set the margins in inches; matplotlib's own layout engine would take longer than the drawing."""
    figure.set_layout_engine(None)
    panel = (height - bottom - 0.35 - gap * (rows - 1)) / rows
    figure.subplots_adjust(
        left=left / 10.0, right=0.99, bottom=bottom / height, top=1.0 - 0.35 / height, hspace=gap / panel, wspace=0.03
    )


def draw_sensor(sensor: str, residuals: Sequence[Residuals], located: Sequence[Located]) -> Figure:
    """Draw a sensor's residuals over time, a row per axis, before on the left and after on the right.

    The grey band holds 95 % of plain noise. Located spans are marked in the left column: a bar above the axis, and
    shading where they are short.
    """
    mine = [item for item in residuals if item.sensor == sensor]
    axes_names = list(dict.fromkeys(item.axis for item in mine))
    names = list(dict.fromkeys(item.recording for item in residuals))
    shades = _shades(names)
    height = 1.15 + 1.45 * len(axes_names)
    figure, panels = new_figure(len(axes_names), 2, width=10.0, height=height, sharex=True, sharey="row", squeeze=False)
    _lay_out(figure, height, len(axes_names), left=0.85, bottom=0.85)
    for row, axis in zip(panels, axes_names, strict=True):
        items = [item for item in mine if item.axis == axis]
        for axes, which in zip(row, ("before", "after"), strict=True):
            axes.axhspan(-1.96, 1.96, color="#000000", alpha=0.07, lw=0)
            for item in items:
                t, value = _thinned(item.t, item.before if which == "before" else item.after)
                axes.plot(
                    t,
                    value,
                    ".",
                    ms=2.4 if t.size > 400 else 4.0,
                    mew=0,
                    color=shades[item.recording],
                    alpha=0.7,
                    rasterized=True,
                )
            if not any(np.isfinite(item.before).any() or np.isfinite(item.after).any() for item in items):
                axes.text(0.5, 0.7, "no usable reading", transform=axes.transAxes, ha="center", color="#5b6773")
        _scale(row[0], items)
        _mark(row[0], items, located, shades)
        row[0].set_ylabel(f"{readable_axis(axis)}\n(noise sd)")
    for axes, title in zip(panels[0], ("before: the baseline", "after: the final model"), strict=True):
        axes.set_title(f"{sensor.replace('_', ' ')}, {title}")
    for axes in panels[-1]:
        axes.set_xlabel("time (s)")
    _name_recordings(figure, panels[0][1], list(dict.fromkeys(item.recording for item in mine)), shades)
    return figure


def _shades(names: Sequence[str]) -> dict[str, str]:
    if len(names) <= len(_SHADES):
        return dict(zip(names, _SHADES, strict=False))
    return dict(
        zip(names, (to_hex(shade) for shade in colormaps["turbo"](np.linspace(0.05, 0.95, len(names)))), strict=True)
    )


def _name_recordings(figure: Figure, axes: Axes, names: Sequence[str], shades: dict[str, str]) -> None:
    """Name the recordings in two lines below the panels, as many as there is room for: in order, the last always."""
    if len(names) < 2:
        return
    columns = max(2, min(10, int(115 / (max(map(len, names)) + 7))))
    if len(names) > 2 * columns:
        chosen = np.unique(np.linspace(0, len(names) - 1, 2 * columns).astype(int))
        names = [names[k] for k in chosen]
    handles = [axes.plot([], [], "o", ms=4, color=shades[name], label=name)[0] for name in names]
    figure.legend(handles=handles, loc="lower center", ncols=min(columns, len(names)), fontsize=8)


def _thinned(t: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the known points; of many each n-th, and the largest of each n where noise would not reach it."""
    known = np.isfinite(value) & np.isfinite(t)
    t, value = t[known], value[known]
    run = -(-t.size // _MOST_POINTS)
    if run <= 1:
        return t, value
    whole = t.size // run * run
    largest = np.argmax(np.abs(value[:whole]).reshape(-1, run), axis=1) + np.arange(0, whole, run)
    kept = np.union1d(np.arange(0, t.size, run), largest[np.abs(value[largest]) > _OUTSTANDING])
    return t[kept], value[kept]


def _scale(axes: Axes, items: Sequence[Residuals]) -> None:
    """Scale the y axis: linear where all is within some standard deviations, else logarithmic beyond the noise."""
    values = np.abs(np.concatenate([array for item in items for array in (item.before, item.after)]))
    values = values[np.isfinite(values)]
    limit = max(5.0, 1.15 * float(values.max())) if values.size else 5.0
    if limit <= 4 * _LINEAR:
        axes.set_ylim(-limit, limit)
        return
    axes.set_yscale("symlog", linthresh=_LINEAR, linscale=0.7)
    axes.set_ylim(-limit, limit)
    ticks = [tick for k in range(12) for tick in (10.0**k, 3.0 * 10.0**k) if _LINEAR <= tick <= 0.9 * limit]
    ticks = ticks[:: -(-len(ticks) // 3)]
    axes.set_yticks([*(-tick for tick in reversed(ticks)), 0.0, *ticks])
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())


def _mark(axes: Axes, items: Sequence[Residuals], located: Sequence[Located], shades: dict[str, str]) -> None:
    """Mark the located spans; one of a single recording in that recording's colour."""
    start = min((float(item.t[0]) for item in items if item.t.size), default=0.0)
    stop = max((float(item.t[-1]) for item in items if item.t.size), default=1.0)
    spans: list[tuple[float, float, str]] = [(*span, shades[item.recording]) for item in items for span in item.marks]
    for place in located:
        if any(place.covers(item.recording, item.sensor, item.axis) for item in items):
            spans.append((place.from_s, place.to_s, shades.get(place.recording, _MARK)))
    for begin, end, shade in dict.fromkeys(spans):
        least = 0.004 * (stop - start)  # an instant must be seen, too
        left, right = max(start, min(begin, (begin + end - least) / 2)), min(stop, max(end, (begin + end + least) / 2))
        axes.axvspan(left, right, ymin=0.955, ymax=1.0, color=_MARK, lw=0)
        if right - left < _SHORT * (stop - start):
            axes.axvspan(left, right, color=shade, alpha=0.22, lw=0)
