"""The page of the documentation on the golf throws: misses, the band of the stated inputs, a figure."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from discsim.files import write_text
from validation.reporting.figures import COLOURS, new_figure, save_figure
from validation.studies.golf_throws.prediction import THROWS, Prediction, predict_throw

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
    write_text(page, _text(found, f"{page.stem}/{figure.name}"))
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


def _text(found: Sequence[Prediction], figure: str) -> str:
    lines = [
        "# Three tracked golf throws",
        "",
        _wrapped(
            "Throws of a distance driver that a drone filmed from above, flown by the standalone model with the "
            "tabulated coefficients of `models/discs/dd2.toml` from the release that was measured. Made by"
        ),
        "",
        "```sh",
        "discsim study golf-throws",
        "```",
        "",
        _wrapped(
            "from the source `shotshaper` (K.E.T. Giljarhus, M.T. Gooding, J. Njaerheim, Sports Engineering 25:26, "
            "2022; see [Importing](importing.md) for its angles). The band is a Monte Carlo of "
            f"{DRAWS - 1} flights: speed, pitch, yaw, roll, nose, spin, wobble, height and wind are drawn from their "
            "stated sigmas. The source states none for its coefficients, so the band has none of theirs; it did not "
            "film heights, so the track's end is taken for the touch-down."
        ),
        "",
        f"![Tracks, flights as stated, and their bands]({figure})",
        "",
        "## Where they come down",
        "",
        _table(
            (
                "throw",
                "track ends at, m",
                "predicted, m",
                "miss north, m",
                "miss east, m",
                "band north, east (1 sd), m",
                "miss in sd",
                "share of band inside",
            ),
            [
                (
                    throw.name,
                    f"{throw.track[-1, 0]:.1f}, {throw.track[-1, 1]:.1f} at {throw.t[-1]:.1f} s",
                    f"{throw.nominal_end[0]:.1f}, {throw.nominal_end[1]:.1f} at {throw.nominal_end[2]:.1f} s",
                    f"{throw.miss[0]:+.1f}",
                    f"{throw.miss[1]:+.1f}",
                    f"{throw.band[0]:.1f}, {throw.band[1]:.1f}",
                    f"{throw.excess:.1f}",
                    f"{100 * throw.beyond:.1f} %",
                )
                for throw in found
            ],
        ),
        "",
        _wrapped(
            "Places are north (down range) and east; a miss is predicted less tracked. *Miss in sd* is the distance of "
            "the track's end from the middle of the drawn touch-downs in their standard deviations, both axes "
            "together; the last column says how many of the drawn flights come down nearer to the middle than that."
        ),
        "",
        *_reading(found),
        "",
        "## On the way",
        "",
        "Distance in plan between flight as stated and track, m:",
        "",
        _table(
            ("throw", *(f"{t:g} s" for t in INSTANTS)),
            [(throw.name, *(_apart(throw, t) for t in INSTANTS)) for throw in found],
        ),
        "",
        "## What the band is made of",
        "",
        "Shift of the touch-down by one sigma more of one input alone, north and east, m:",
        "",
        _table(
            ("input", *(throw.name for throw in found)),
            [
                (name, *(f"{throw.shifts[name][0]:+.1f}, {throw.shifts[name][1]:+.1f}" for throw in found))
                for name in found[0].shifts
            ],
        ),
        "",
    ]
    return "\n".join(lines)


def _reading(found: Sequence[Prediction]) -> list[str]:
    outside = [throw.name for throw in found if throw.beyond > 0.95]
    short = [throw for throw in found if throw.miss[0] < 0]
    worst = max(found, key=lambda throw: float(np.linalg.norm(throw.miss)))
    where = f"outside the 95 % band for {', '.join(outside)}" if outside else "inside the 95 % band for every throw"
    verdict = "what is stated does not explain them" if outside else "what is stated can explain them"
    return [
        _wrapped(
            f"The track's end is {where}: {verdict}. {len(short)} of {len(found)} flights come down short of the "
            f"track; the largest miss is {np.linalg.norm(worst.miss):.1f} m ({worst.name}). What is not in the band: "
            "the coefficients (CFD of a disc that does not spin, rate derivatives of another disc), how the wind grows "
            "with height, and the disc itself (discs of one mould differed by 3 mm in the height of the nose)."
        )
    ]


def _apart(throw: Prediction, t: float) -> str:
    k = int(np.argmin(np.abs(throw.t - t)))
    apart = float(np.linalg.norm(throw.nominal[k] - throw.track[k]))
    return f"{apart:.1f}" if np.isfinite(apart) else ""


def _wrapped(text: str) -> str:
    return textwrap.fill(text, 118, break_long_words=False, break_on_hyphens=False)


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in (header, ["---"] * len(header), *rows))
