"""Figures of a fit of C_Nr: spin with its models (Fig. 11a), the table (Fig. 11b), and the sources side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from discsim.validation.reporting.figures import COLOURS, legend_columns, new_figure, save_figure
from discsim.validation.yaw_damping.compared import Compared
from discsim.validation.yaw_damping.observations import Throw
from discsim.validation.yaw_damping.output_error import Fit
from discsim.validation.yaw_damping.paper_table import RATES_DEG_S, SPEEDS_M_S, PaperTable

__all__ = ["draw_fit", "draw_sources", "draw_surface", "draw_surface_on"]

_SHADES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#6a3d9a", "#8c6d31")
#: throws that are named beside a figure, at most: beyond the shades twice over a colour tells none of them
_NAMED = 2 * len(_SHADES)


def draw_fit(throws: Sequence[Throw], fit: Fit, paper: PaperTable, path: Path | None = None) -> Figure:
    """Draw the spin of each throw with the model flight and the paper's line, and what each leaves.

    Where a path is given the figure is written there.
    """
    figure, panels = new_figure(2, 2, width=9.0, height=7.0)
    figure.delaxes(panels[1, 1])
    panels[1, 0].set_subplotspec(panels[1, 0].get_gridspec()[1, :])
    rates, left, path_left = panels[0, 0], panels[0, 1], panels[1, 0]
    for number, (throw, fitted, line) in enumerate(zip(throws, fit.throws, paper.slopes, strict=True)):
        shade = _SHADES[number % len(_SHADES)]
        t, r = throw.spin_t, np.degrees(np.abs(throw.spin))
        residual = np.degrees(np.sign(throw.spin) * fitted.spin_residual)
        rates.plot(t, r, ".", color=shade, ms=2.5, alpha=0.5)
        rates.plot(t, r - residual, color=shade, lw=1.2)
        rates.plot(line.t, np.degrees(line.at(line.t)), color=shade, lw=0.9, ls="--")
        left.plot(t, r - np.degrees(line.at(t)), color=shade, lw=0.8, ls="--")
        left.plot(t, residual, color=shade, lw=1.0)
        speed_residual = np.linalg.norm(fitted.path_residual[:, 3:], axis=1)
        path_left.plot(throw.path_t, speed_residual, color=shade, lw=0.7, alpha=0.8, label=throw.recording.name)
    _explain(rates)
    rates.set(title="Magnitude of the spin rate", xlabel="time (s)", ylabel="rate (deg/s)")
    left.set(title="Estimate less model (solid), less line (dashed)", xlabel="time (s)", ylabel="difference (deg/s)")
    left.axhline(0, color=COLOURS["truth"], lw=0.6)
    path_left.set(title="GPS velocity less the model's, size", xlabel="time (s)", ylabel="difference (m/s)")
    path_left.set_ylim(bottom=0)
    if any(throw.path_t.size for throw in throws) and len(throws) <= _NAMED:
        handles, labels = path_left.get_legend_handles_labels()
        columns = legend_columns(labels, figure.get_figwidth(), 8.0)
        figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=8)
    return save_figure(figure, path)


def _explain(axes: Axes) -> None:
    """Say what dots and lines are, in no throw's colour: throws lie upon one another."""
    grey = "#555555"
    axes.plot([], [], "o", color=grey, ms=4, label="estimated")
    axes.plot([], [], color=grey, label="model flight")
    axes.plot([], [], color=grey, ls="--", label="straight line (paper)")
    axes.legend(fontsize=8)


def draw_surface(paper: PaperTable, fit: Fit | None, path: Path) -> None:
    """Draw the paper's table over rate and speed, with the flights that it was made from."""
    figure, axes = new_figure(width=7.5, height=4.8)
    draw_surface_on(axes, paper, fit)
    save_figure(figure, path)


def draw_surface_on(axes: Axes, paper: PaperTable, fit: Fit | None) -> None:
    """Draw the table on given axes: colours and contours of -1000 C_Nr, and flights as (V, r) lines over it."""
    matrix = -1000.0 * paper.table.CNr
    mesh = axes.pcolormesh(SPEEDS_M_S, RATES_DEG_S, matrix, cmap="viridis", shading="gouraud", rasterized=True)
    lines = axes.contour(SPEEDS_M_S, RATES_DEG_S, matrix, levels=8, colors="white", linewidths=0.6)
    axes.clabel(lines, fontsize=7, fmt="%.1f")
    if fit is not None:
        for number, throw in enumerate(fit.throws):
            t = np.linspace(0.0, throw.flight.end, 100)
            state = throw.flight.at(t)
            speed = np.linalg.norm(state.velocity - throw.flight.environment.wind, axis=1)
            label = "flights" if number == 0 else None
            axes.plot(speed, np.degrees(np.abs(state.rate[:, 2])), color="#d55e00", lw=1.2, label=label)
        axes.legend(fontsize=8, loc="lower right", frameon=True)
    axes.grid(False)
    axes.set(title="The paper's table (28), as -1000 CNr", xlabel="airspeed (m/s)", ylabel="spin rate (deg/s)")
    axes.figure.colorbar(mesh, ax=axes, label="-1000 CNr")


def draw_sources(found: Sequence[Compared], path: Path) -> None:
    """Draw C_Nr by each source, with two standard deviations, and beside it what (26) gives from the same spin."""
    known = [item for item in found if item.fit is not None]
    figure, axes = new_figure(width=8.0, height=1.6 + 0.4 * len(known))
    for number, item in enumerate(known):
        assert item.fit is not None
        value, sd = 1000 * item.fit.CNr, 1000 * item.fit.sd
        first = number == 0
        axes.errorbar(
            value, number, xerr=2 * sd, fmt="o", color=COLOURS["best"], capsize=3, label="output error, 2 sd" * first
        )
        axes.plot(1000 * item.fit.by_26, number, "x", color=COLOURS["fft"], label="straight line and (26)" * first)
    axes.set_yticks(range(len(known)), [item.source.label for item in known])
    axes.set_ylim(len(known) - 0.5, -0.5)
    axes.set(title="C_Nr by source of the spin rate", xlabel="1000 CNr")
    axes.legend(fontsize=8)
    save_figure(figure, path)
