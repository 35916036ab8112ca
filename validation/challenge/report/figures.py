"""Figures of a challenge: confusions, errors in their own sd, detection against size, exponents of laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE
from discsim.validation.challenge.scores.detection import HALF_GOAL, Curve, Sized, allowed, fit_curve, has_curve
from discsim.validation.challenge.scores.scoring import Deviation, rate
from discsim.validation.reporting.figures import new_figure, save_figure

__all__ = ["draw_confusion", "draw_detection", "draw_deviates", "draw_effects", "draw_exponents"]

_NAMED, _MISSED, _CURVE, _ALLOWED = "#0072b2", "#d55e00", "#0072b2", "#009e73"
#: sizes that a figure shows, in detection limits; others stand at the ends
_LEAST, _MOST = 0.2, 500.0


def draw_confusion(table: Mapping[str, Mapping[str, int]], path: Path) -> None:
    """Draw the confusion matrix with its numbers; only what occurs has a row or a column."""
    columns = [id for id in CATALOGUE if any(id in row for row in table.values())]
    verdicts = ("explained", "unexplained", "recalibrated", "consistent", "no answer")
    columns += [verdict for verdict in verdicts if any(verdict in row for row in table.values())]
    rows = list(table)
    counts = np.array([[table[row].get(column, 0) for column in columns] for row in rows], dtype=float)
    right = np.array([[row == column or (row, column) in _RIGHT for column in columns] for row in rows])
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    shade = np.where(right, 1.0, -1.0) * np.where(counts > 0, 0.3 + 0.7 * shares, 0.0)
    figure, axes = new_figure(width=3.4 + 0.27 * len(columns), height=2.2 + 0.24 * len(rows))
    # orange and blue, which colour-blind readers can tell apart, light enough for black numbers
    axes.imshow(shade, cmap="PuOr", vmin=-1.6, vmax=1.6, aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        axes.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", fontsize=8)
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.tick_params(length=0)
    axes.grid(False)
    axes.xaxis.tick_top()
    axes.set_ylabel("concealed")
    save_figure(figure, path)


_RIGHT = {("nothing", "consistent"), ("nothing", "recalibrated"), ("off-catalogue", "unexplained")}


def draw_deviates(deviates: FloatArray, path: Path) -> None:
    """Draw the errors of parameters in their own standard deviations against a standard normal distribution."""
    figure, axes = new_figure(width=7.0, height=3.4)
    edges = np.arange(-6.0, 6.5, 0.5)
    shown = np.clip(deviates, -5.99, 5.99)
    axes.hist(shown, bins=edges, color="#56b4e9", edgecolor="white", label="parameters")
    z = np.linspace(-6, 6, 241)
    axes.plot(z, deviates.size * 0.5 * np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi), color="k", label="standard normal")
    beyond = int(np.count_nonzero(np.abs(deviates) > 6))
    axes.set_xlabel("(found - concealed) / sd" + (f"; {beyond} beyond 6 stand at the ends" if beyond else ""))
    axes.set_ylabel("number")
    axes.legend()
    save_figure(figure, path)


def draw_detection(items: Sequence[Sized], curve: Curve | None, path: Path | None = None) -> Figure:
    """Draw the share of effects named by size: bins with exact intervals, the fitted curve, what information allows."""
    edges = np.array([0.0, 0.7, 1.0, 1.5, 2.0, 4.0, 10.0, 30.0, 100.0, np.inf])
    sizes, named = np.array([item.size for item in items]), np.array([item.named for item in items])
    shown = np.clip(sizes, _LEAST, _MOST)
    figure, axes = new_figure(width=8.0, height=4.2)
    along = np.geomspace(_LEAST, _MOST, 400)
    axes.plot(along, allowed(along), color=_ALLOWED, label="what the Fisher information allows")
    if curve is not None:
        axes.plot(along, curve.at(along), color=_CURVE, label=f"fitted; half-detection size: {curve.text}")
    rng = np.random.default_rng(0)
    heights = np.where(named, 1.07, -0.07) + rng.uniform(-0.025, 0.025, sizes.size)
    axes.plot(shown[named], heights[named], ".", color=_NAMED, ms=4, alpha=0.7)
    axes.plot(shown[~named], heights[~named], ".", color=_MISSED, ms=4, alpha=0.7)
    label: str | None = "share named, with intervals of 95 %; dots are effects"
    for low, high in pairwise(edges):
        mine = (sizes >= low) & (sizes < high)
        if mine.any():
            found = rate(bool(ok) for ok in named[mine])
            middle = float(np.exp(np.mean(np.log(shown[mine]))))
            error = [[found.value - found.low], [found.high - found.value]]
            axes.errorbar([middle], [found.value], yerr=error, fmt="o", color="k", ms=4, capsize=2, label=label)
            label = None
    axes.axvline(1.0, color="k", lw=0.8, ls="--")
    axes.axvline(HALF_GOAL, color="#888888", lw=0.8, ls=":")
    axes.axhline(0.5, color="#999999", lw=0.6)
    _size_axis(axes)
    axes.set_ylim(-0.13, 1.13)
    axes.set_yticks([0, 0.25, 0.5, 0.75, 1])
    axes.set_xlabel(f"size / detection limit (dashed: the limit; dotted: {HALF_GOAL:g} times the limit)")
    axes.set_ylabel("share named")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.08))
    return save_figure(figure, path)


def draw_effects(items: Sequence[Sized], path: Path) -> None:
    """Draw each concealed effect by id and size, named or not, and the half-detection size where cases suffice."""
    ids = [id for id in CATALOGUE if any(item.effect == id for item in items)]
    figure, axes = new_figure(width=8.0, height=1.3 + 0.19 * len(ids))
    rows = {id: number for number, id in enumerate(ids)}
    for outcome, colour, mark, name in ((True, _NAMED, "o", "named"), (False, _MISSED, "x", "not named")):
        some = [item for item in items if item.named is outcome]
        if some:
            x, y = np.clip([item.size for item in some], _LEAST, _MOST), [rows[item.effect] for item in some]
            axes.plot(x, y, mark, color=colour, ms=4.5, mew=1.2, alpha=0.75, label=name)
    label: str | None = "half are named, 95 %"
    for id, row in rows.items():
        mine = [item for item in items if item.effect == id]
        curve = fit_curve(mine) if has_curve(mine) else None
        if curve is not None:
            reach = np.clip([curve.low, curve.high], _LEAST, _MOST)
            axes.plot(reach, [row + 0.3] * 2, color="k", lw=1.2)
            axes.plot(np.clip([curve.half], _LEAST, _MOST), [row + 0.3], "|", color="k", ms=6, label=label)
            label = None
    axes.axvline(1.0, color="k", lw=0.8, ls="--")
    axes.axvline(HALF_GOAL, color="#888888", lw=0.8, ls=":")
    _size_axis(axes)
    axes.set_yticks(range(len(ids)), ids, fontsize=8)
    axes.set_ylim(len(ids) - 0.4, -0.6)
    axes.set_xlabel(f"size / detection limit (dashed: the limit; dotted: {HALF_GOAL:g} times the limit)")
    figure.legend(loc="outside upper right", ncols=3)
    save_figure(figure, path)


def draw_exponents(found: Sequence[Deviation], path: Path) -> None:
    """Draw exponents of laws that were found against the concealed ones."""
    figure, axes = new_figure(width=5.0, height=4.0)
    true = np.array([item.true for item in found])
    value = np.array([item.value for item in found])
    span = np.array([min(true.min(), value.min()) - 0.1, max(true.max(), value.max()) + 0.1])
    axes.plot(span, span, color="k", lw=0.8, label="right")
    error = np.array([2.0 * (item.sd or 0.0) for item in found])
    axes.errorbar(true, value, yerr=error, fmt="o", color=_NAMED, ms=4, capsize=2, label="found, with 2 sd")
    axes.set_xlabel("exponent concealed")
    axes.set_ylabel("exponent found")
    axes.set_ylim(span[0], span[1])
    axes.legend(loc="upper left")
    save_figure(figure, path)


def _size_axis(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.set_xlim(0.9 * _LEAST, 1.1 * _MOST)
    axes.xaxis.set_major_locator(FixedLocator([0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter("{x:g}")
