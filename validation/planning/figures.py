"""A picture of a plan: the size of each effect that is seen and named, beside an ordinary size."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from discsim.validation.planning.limits import Limits
from discsim.validation.reporting.figures import new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_limits", "limits_figure"]


def draw_limits(limits: Limits, path: Path) -> None:
    """Write the figure of `limits_figure` to a file."""
    save_figure(limits_figure(limits), path)


def limits_figure(limits: Limits) -> Figure:
    """Return for each effect its sizes, seen and named, over the small but visible size that the catalogue states."""
    rows = []
    for one in limits.effects:
        row = CATALOGUE[one.id]
        scales = np.array([row.fitted_scale[name] for name in one.parameters])
        seen, named = np.array(one.seen) / scales, np.array(one.named) / scales
        rows.append((one.id, seen[np.isfinite(seen)], named[np.isfinite(named)]))
    rows.sort(key=lambda item: -float(np.min(item[2])) if item[2].size else -np.inf)
    figure, axes = new_figure(width=9.0, height=1.2 + 0.21 * len(rows))
    for place, (_, seen, named) in enumerate(rows):
        label = place == len(rows) - 1
        if named.size:
            axes.plot([named.min(), named.max()], [place, place], color="#0072b2", lw=4, alpha=0.35)
        axes.plot(
            seen, np.full(seen.size, place), "o", mfc="white", mec="#0072b2", ms=5, label="seen" if label else None
        )
        axes.plot(named, np.full(named.size, place), "o", color="#0072b2", ms=4, label="named" if label else None)
    axes.axvline(1.0, color="#999999", lw=0.8, ls="--")
    axes.set_xscale("log")
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=7)
    axes.set_ylim(-0.7, len(rows) - 0.3)
    axes.set_xlabel("size at which half of the diagnoses see and name it, over a small but visible size")
    axes.set_title("What these recordings can show, a dot for each parameter")
    # below the axes: dots may lie in each corner
    figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    return figure
