"""Pictures of a sweep: the paper's statement on where to mount a sensor, and any other axis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from discsim.arrays import FloatArray
from discsim.validation.reporting.figures import colour, new_figure, save_figure
from discsim.validation.scenarios.throws import rms
from discsim.validation.sweeps.chunks import Sweep
from discsim.validation.sweeps.mounts import closed_form

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["draw_axes", "draw_installation", "draw_sweep"]

#: points drawn per radius; more hide one another
SHOWN = 300
#: a mount counts as read where this share of its estimates is known
READ = 0.5
#: below this share of known estimates a point says so: a method that is silent where it is hard errs no more
TOLD = 0.75
#: panels of axes in a row, at most
BESIDE = 3
#: values of an axis that span so many times the least are drawn on a logarithmic one
WIDE = 10.0


def draw_sweep(result: xr.Dataset, sweep: Sweep, path: Path | None = None) -> Figure:
    """Draw where to mount the sensor if the plan varies place and mount of an accelerometer, else its axes.

    Where a path is given the figure is written there.
    """
    offsets = np.ptp(sweep.mounts[:, :3], axis=0).max() > 0
    if "accelerometer" in result.estimator.values and "radius_m" in result.dims and offsets:
        return draw_installation(result, sweep, path)
    return draw_axes(result, path)


def draw_installation(result: xr.Dataset, sweep: Sweep, path: Path | None = None) -> Figure:
    """Draw, per part, the relative error against offset over radius with (9), and its size against the radius.

    Axes other than radius and part stand at their first value.
    """
    first = {axis.name: 0 for axis in sweep.plan.axes if axis.name not in ("radius_m", "parts")}
    chosen = result.isel(first)
    parts = [str(part) for part in chosen.parts.values] if "parts" in chosen.dims else [""]
    figure, panels = new_figure(len(parts), 2, width=12.5, height=4.3 * len(parts), squeeze=False)
    for row, part in zip(panels, parts, strict=True):
        shown = chosen.sel(parts=part) if part else chosen
        limit = _range(sweep, part)
        _scatter_over_offset(row[0], shown)
        _size_over_radius(row[1], shown, sweep, limit)
        name = part.split("+")[-1] if part else "accelerometer"
        row[0].set_title(f"{name}: error of each mount, by its offset over its radius")
        row[1].set_title(
            f"{name}: size of the error, by the radius" + (f" (range {limit / 9.80665:.0f} g)" if limit else "")
        )
    return save_figure(figure, path)


def _range(sweep: Sweep, part: str) -> float | None:
    """Return the range of a part's accelerometer, m/s^2; None where it has none."""
    for case in sweep.plan.cases:
        axes = [axis for axis in sweep.plan.axes if axis.name == "parts"]
        if not axes or case.settings["parts"] is axes[0].loaded[list(axes[0].values).index(part)]:
            sensor = sweep.plan.instruments(case).sensors["accelerometer"]
            limit = float(sensor.range)  # type: ignore[union-attr]
            return limit if np.isfinite(limit) else None
    return None


def _relative(shown: xr.Dataset, estimator: str) -> xr.DataArray:
    """Return the bias in per cent of the rate, over radius, mount, segment; NaN where a mount is not read."""
    one = shown.sel(estimator=estimator)
    share: xr.DataArray = 100 * one.bias_deg_s / one.rate_deg_s
    return share.where(one.known >= READ).transpose("radius_m", "mount", "segment")


def _scatter_over_offset(axes: Axes, shown: xr.Dataset) -> None:
    radii = shown.radius_m.values
    error = _relative(shown, "accelerometer")
    shade = colormaps["viridis"].resampled(len(radii) + 1)  # its last, a pale yellow, is left out
    reach = 0.0
    for k, radius in enumerate(radii):
        read = [s for s in range(error.sizes["segment"]) if np.isfinite(error.values[k, :, s]).mean() > READ]
        if not read:
            continue
        fastest = max(read, key=lambda s: float(np.max(shown.rate_deg_s.isel(radius_m=k, segment=s).values)))
        # stated on the negative x axis: an offset along -x leads away from the axis of spin
        ratio = -100 * shown.x_m.values[:SHOWN] / radius
        reach = max(reach, float(np.abs(ratio).max()))
        rate = float(shown.rate_deg_s.isel(radius_m=k, segment=fastest))
        label = f"{1000 * radius:g} mm, {rate:.0f} deg/s"
        axes.plot(ratio, error.values[k, :SHOWN, fastest], ".", ms=3.5, color=shade(k), label=label)
    ratio = np.linspace(-min(reach, 99.9), reach, 400)
    axes.plot(ratio, 100 * (np.sqrt(1 + ratio / 100) - 1), color="black", lw=1.2, ls="--", label="Eq. (9)")
    axes.set_xlabel("offset away from the axis over stated radius (%)")
    axes.set_ylabel("error of the rate (%)")
    axes.legend(fontsize=8, loc="upper left", title="stated radius, fastest rate in range", title_fontsize=8)


def _size_over_radius(axes: Axes, shown: xr.Dataset, sweep: Sweep, limit: float | None) -> None:
    radii = shown.radius_m.values
    error = _relative(shown, "accelerometer").values
    rates = shown.rate_deg_s.transpose("radius_m", "segment").values[0]
    shade = colormaps["plasma"]
    scale = Normalize(0.0, 1.25 * float(np.nanmax(rates)))
    for s, rate in enumerate(rates):
        read = np.isfinite(error[:, :, s])
        whole = read.mean(axis=1) > READ
        size = np.array([rms(error[k, :, s]) if whole[k] else np.nan for k in range(len(radii))])
        label = f"{rate:.0f} deg/s" + ("" if whole.any() else ", beyond its range" if rate else ", no share of it")
        axes.plot(1000 * radii, size, "o-", ms=4, lw=1.0, color=shade(scale(rate)), label=label)
        farthest = 1000 * limit / np.radians(rate) ** 2 if limit and rate else np.inf
        if 1000 * radii[0] < farthest < 1000 * radii[-1]:
            axes.axvline(farthest, color=shade(scale(rate)), lw=0.9, ls=":")
    fine = np.geomspace(radii[0], radii[-1], 60)
    predicted = [
        rms(100 * closed_form(np.ones(1), np.array([-radius, 0.0, 0.0]), sweep.mounts[:, :3])) for radius in fine
    ]
    axes.plot(1000 * fine, predicted, color="black", lw=1.2, ls="--", label="Eq. (9)")
    for name in shown.estimator.values:
        if name != "accelerometer":
            other = _relative(shown, str(name)).values
            size = np.array([rms(other[k]) for k in range(len(radii))])
            # a method that takes seconds for each mount is scored on few of them
            count = int(np.isfinite(shown.known.sel(estimator=name)).any("segment").sum("mount").max())
            label = f"{name}, all rates ({count} mount{'s' if count > 1 else ''})"
            axes.plot(1000 * radii, size, "s-", ms=4, lw=1.0, color=colour(str(name)), label=label)
    if limit:
        axes.plot([], [], color="0.4", lw=0.9, ls=":", label="out of range beyond")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(1000 * radii, [f"{1000 * radius:g}" for radius in radii])
    axes.xaxis.set_minor_locator(NullLocator())
    _plain_decades(axes)
    axes.set_xlabel("stated radius (mm)")
    axes.set_ylabel("mean error, rms over the mounts (%)")
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _plain_decades(axes: Axes) -> None:
    """Mark 1, 2 and 5 of each decade of a logarithmic y axis, in plain numbers."""
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())


def draw_axes(result: xr.Dataset, path: Path | None = None) -> Figure:
    """Draw, per axis of the plan, each estimator's rms error: median and 5 to 95 % over all else that was varied."""
    names = [
        str(name)
        for name in result.rms_deg_s.dims
        if name not in ("estimator", "mount") and (name == "segment" or result.sizes[name] > 1)
    ]
    names = [name for name in names if name != "segment" or result.sizes["segment"] > 1 or len(names) == 1]
    columns = min(len(names), BESIDE)
    rows = -(-len(names) // columns)
    figure, panels = new_figure(rows, columns, width=max(6.0, 4.5 * columns), height=4.2 * rows, squeeze=False)
    for axes, name in zip(panels.flat, names, strict=False):
        _along(axes, result, name)
    for axes in panels.flat[len(names) :]:
        figure.delaxes(axes)
    for axes in panels[:, 0]:
        axes.set_ylabel("rms error of the rate (deg/s)")
    panels[0, 0].legend(fontsize=8)
    panels[0, 0].set_title(f"{result.attrs['title']}: median, 5 to 95 % over all else")
    return save_figure(figure, path)


def _along(axes: Axes, result: xr.Dataset, name: str) -> None:
    x, labels = _places(result, name)
    methods = [str(estimator) for estimator in result.estimator.values]
    for estimator in methods:
        values = result.rms_deg_s.sel(estimator=estimator).transpose(name, ...).values.reshape(len(x), -1)
        known = np.isfinite(values).any(axis=1)
        low, middle, high = np.full((3, len(x)), np.nan)
        if known.any():
            low[known], middle[known], high[known] = np.nanquantile(values[known], (0.05, 0.5, 0.95), axis=1)
        shade = colour(estimator, methods)
        axes.fill_between(x, low, high, color=shade, alpha=0.2, lw=0)
        axes.plot(x, middle, "o-", ms=4, color=shade, label=estimator + ("" if known.any() else " (unknown)"))
        share = result.known.sel(estimator=estimator).transpose(name, ...).values.reshape(len(x), -1)
        for at, error, told in zip(x[known], middle[known], share[known], strict=True):
            if (mean := float(np.nanmean(told))) < TOLD:
                side = "left" if at == x.min() else "right" if at == x.max() else "center"
                text, place = f"{100 * mean:.0f} % known", (0, 6)
                axes.annotate(text, (at, error), place, textcoords="offset points", ha=side, fontsize=7)
    axes.set_yscale("log")
    _plain_decades(axes)
    if labels is None and x.min() > 0.0 and x.max() >= WIDE * x.min():
        axes.set_xscale("log")
        axes.set_xticks(x, [f"{value:g}" for value in x])
        axes.xaxis.set_minor_locator(NullLocator())
    if labels is not None:
        axes.set_xticks(x, labels, rotation=20, ha="right")
    axes.set_xlabel("mean true rate (deg/s)" if name == "segment" else name)


def _places(result: xr.Dataset, name: str) -> tuple[FloatArray, Any]:
    """Return where the values of an axis are drawn, and their labels where they are texts."""
    if name == "segment":
        rate = result.rate_deg_s.transpose("segment", ...).values.reshape(result.sizes["segment"], -1)
        same = np.nanmax(rate, axis=1) - np.nanmin(rate, axis=1) < 0.01 * np.nanmax(rate)
        if same.all():
            return np.asarray(rate[:, 0]), None
        return np.arange(len(rate), dtype=float), [f"segment {k}" for k in range(len(rate))]
    values = result[name].values
    if values.dtype.kind in "fi":
        return np.asarray(values, dtype=float), None
    return np.arange(len(values), dtype=float), [str(value) for value in values]
