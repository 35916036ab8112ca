"""The page of the documentation on the golf throws: misses, the band of the stated inputs, a figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from discsim.validation.reporting import markdown
from discsim.validation.reporting.figures import COLOURS, new_figure, save_figure
from discsim.validation.studies.golf_throws.prediction import THROWS, Prediction, predict_throw

__all__ = ["DRAWS", "draw", "write_page"]

#: drawn flights; a standard deviation from so many is known to 2 %
DRAWS = 2001
#: instants at which the page tabulates the distance between flight and track, s
INSTANTS = (1.0, 2.0, 3.0, 4.0, 5.0)


def write_page(recordings: Path, page: Path, seed: int = 0) -> list[Prediction]:
    """Fly the three throws, write ``page`` and a figure into the folder of its name; return the predictions.

    ``recordings`` holds the folders of measured sources. The same recordings and seed give the same bytes.
    """
    folder = recordings / "shotshaper-dd2-drone-tracked-throws"
    streams = np.random.default_rng(seed).spawn(len(THROWS))
    found = [predict_throw(name, folder, DRAWS, stream) for name, stream in zip(THROWS, streams, strict=True)]
    figure = page.parent / page.stem / "tracks.png"
    draw(found, figure)
    template = Path(__file__).with_name("page.md.j2")
    markdown.write_page(page, template, figure=f"{page.stem}/{figure.name}", **_content(found))
    return found


def draw(found: Sequence[Prediction], path: Path) -> None:
    """Draw each throw from above, and below it how far down range it is over time, both with their band."""
    figure, axes = new_figure(2, len(found), width=13.0, height=7.2)
    for column, throw in enumerate(found):
        plan, range_ = axes[0, column], axes[1, column]
        for flight in throw.paths[:150]:
            plan.plot(flight[:, 1], flight[:, 0], color=COLOURS["accelerometer"], lw=0.4, alpha=0.15)
        plan.plot(
            throw.ends[:400, 1], throw.ends[:400, 0], ".", ms=2, alpha=0.35, color=COLOURS["accelerometer"],
            label="touch-downs drawn from the sigmas",
        )  # fmt: skip
        plan.plot(throw.nominal[:, 1], throw.nominal[:, 0], color=COLOURS["accelerometer"], label="as stated")
        plan.plot(throw.track[:, 1], throw.track[:, 0], color=COLOURS["fft"], label="tracked by the drone")
        plan.set(title=f"{throw.name}: seen from above", xlabel="east (m)", ylabel="down range (m)")
        plan.set_aspect("equal", adjustable="datalim")
        some = np.isfinite(throw.paths[:, :, 0]).mean(axis=0) > 0.5
        low, high = np.nanpercentile(throw.paths[:, some, 0], (2.5, 97.5), axis=0)
        range_.fill_between(throw.t[some], low, high, color=COLOURS["accelerometer"], alpha=0.2, lw=0, label="95 %")
        range_.plot(throw.t, throw.nominal[:, 0], color=COLOURS["accelerometer"], label="as stated")
        range_.plot(throw.t, throw.track[:, 0], color=COLOURS["fft"], label="tracked")
        range_.set(xlabel="time (s)", ylabel="down range (m)")
    axes[0, 0].legend(fontsize=7, loc="lower right")
    axes[1, 0].legend(fontsize=8)
    save_figure(figure, path)


def _content(found: Sequence[Prediction]) -> dict[str, Any]:
    """Return what the page's template is filled with."""
    worst = max(found, key=lambda throw: float(np.linalg.norm(throw.miss)))
    return {
        "flights": DRAWS - 1,
        "names": [throw.name for throw in found],
        "instants": [f"{t:g} s" for t in INSTANTS],
        "places": [_place_cells(throw) for throw in found],
        "outside": [throw.name for throw in found if throw.beyond > 0.95],
        "short": sum(throw.miss[0] < 0 for throw in found),
        "worst": f"{np.linalg.norm(worst.miss):.1f} m ({worst.name})",
        "on_the_way": [(throw.name, *(_apart(throw, t) for t in INSTANTS)) for throw in found],
        "shifts": [
            (name, *(f"{throw.shifts[name][0]:+.1f}, {throw.shifts[name][1]:+.1f}" for throw in found))
            for name in found[0].shifts
        ],
    }


def _place_cells(throw: Prediction) -> list[str]:
    return [
        throw.name,
        f"{throw.track[-1, 0]:.1f}, {throw.track[-1, 1]:.1f} at {throw.t[-1]:.1f} s",
        f"{throw.nominal_end[0]:.1f}, {throw.nominal_end[1]:.1f} at {throw.nominal_end[2]:.1f} s",
        f"{throw.miss[0]:+.1f}",
        f"{throw.miss[1]:+.1f}",
        f"{throw.band[0]:.1f}, {throw.band[1]:.1f}",
        f"{throw.excess:.1f}",
        f"{100 * throw.beyond:.1f} %",
    ]


def _apart(throw: Prediction, t: float) -> str:
    k = int(np.argmin(np.abs(throw.t - t)))
    apart = float(np.linalg.norm(throw.nominal[k] - throw.track[k]))
    return f"{apart:.1f}" if np.isfinite(apart) else ""
