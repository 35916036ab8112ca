"""Pictures of landings: where they are with their ellipses, and which uncertainty scatters them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from discsim.validation.reporting.figures import COLOURS, new_figure, save_figure
from discsim.validation.scattering.scattered import Scattered

__all__ = ["draw_landings", "draw_shares"]

#: dots drawn; more hide one another
SHOWN = 2000
#: inputs drawn of each result
_BARS = 8


def draw_landings(found: Scattered, path: Path) -> None:
    """Draw landings in north and east with the ellipses, the release and the landing without scatter."""
    figure, axes = new_figure(width=8.0, height=6.5)
    ends = found.flown.ends[np.isfinite(found.flown.ends[:, 0])][:SHOWN]
    axes.plot(ends[:, 1], ends[:, 0], ".", ms=2.5, color=COLOURS["accelerometer_calibrated"], label="landings")
    for ellipse, shade in zip(found.ellipses, ("#0072b2", "#009e73", "#d55e00"), strict=True):
        outline = ellipse.outline()
        long, short = (2 * axis for axis in ellipse.semi_axes)
        label = f"{100 * ellipse.share:.0f} %: {long:.1f} by {short:.1f} m"
        axes.plot(outline[:, 1], outline[:, 0], color=shade, label=label)
    start = found.inputs.release.start()[0]
    axes.plot(start[1], start[0], "^", color="black", ms=7, label="release")
    axes.plot(found.nominal[1], found.nominal[0], "x", color="black", ms=8, mew=2, label="landing without scatter")
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("east (m)")
    axes.set_ylabel("north (m)")
    axes.set_title("Landings, and the ellipses that hold 50, 90 and 95 % of them")
    axes.legend(fontsize=8)
    save_figure(figure, path)


def draw_shares(found: Scattered, path: Path) -> None:
    """Draw which share of each result's variance each input has: alone, and with others."""
    figure, panels = new_figure(1, len(found.shares), width=11.0, height=3.6, squeeze=False)
    for axes, shares in zip(panels[0], found.shares, strict=True):
        most = shares.shares[:_BARS][::-1]
        places = np.arange(len(most))
        names = [_short(share.inputs) for share in most]
        axes.barh(places, [100 * s.total for s in most], color="#9ecae1", label="with others")
        axes.barh(places, [100 * s.first for s in most], color="#0072b2", label="alone")
        axes.set_yticks(places, names, fontsize=8)
        axes.set_xlabel("share of the variance (%)")
        axes.set_title(f"{shares.result}, sd {np.sqrt(shares.variance):.2g} {'s' if 'time' in shares.result else 'm'}")
    panels[0][-1].legend(fontsize=8, loc="lower right")
    save_figure(figure, path)


def _short(names: tuple[str, ...]) -> str:
    return ", ".join(names[:2]) + (f" and {len(names) - 2} more" if len(names) > 2 else "")
