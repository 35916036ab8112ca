"""Figures of the page on what a diagnosis says of measured recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from discsim.arrays import FloatArray
from discsim.estimators.methods import estimate
from discsim.recording import Recording
from discsim.validation.reporting.figures import COLOURS, new_figure, save_figure
from discsim.validation.studies.real_diagnosis.flatball import Rows, restamped
from discsim.validation.studies.real_diagnosis.golf_causes import CauseHeldOut, Throw
from discsim.validation.studies.real_diagnosis.golf_flight import Flown
from discsim.validation.studies.real_recordings.turns import field_phase

__all__ = ["draw_fields", "draw_golf", "draw_rows"]

#: the field's phase is taken over this long for a rate, s
SMOOTH = 0.4
TRACK, STATED, FITTED, HELD_OUT = COLOURS["truth"], COLOURS["accelerometer"], COLOURS["best"], COLOURS["fft"]


def draw_golf(
    throws: Mapping[str, Throw], stated: Mapping[str, Flown], none: CauseHeldOut, best: CauseHeldOut, path: Path
) -> None:
    """Draw each throw from above, and below it how far what was fitted is off along the track.

    Both fits are of the throw's own release, with no cause and with the cause as the other two throws have it.
    """
    figure, axes = new_figure(2, len(throws), width=12.0, height=7.0)
    name_of = best.together.cause.name.strip("`")
    for column, (name, throw) in enumerate(throws.items()):
        panel, beside = axes[0, column], axes[1, column]
        track = throw.recording.need("track")
        panel.plot(track.value[:, 1], track.value[:, 0], ".", ms=2.5, color=TRACK, label="tracked by the drone")
        _flight(panel, stated[name], STATED, "as stated")
        for fit, colour, style, label in (
            (none.tried[name], FITTED, "--", "release and wind fitted, no cause"),
            (best.tried[name], HELD_OUT, "-", f"with the other two throws' {name_of}"),
        ):
            panel.plot(fit.paths[name][:, 1], fit.paths[name][:, 0], style, color=colour, label=label)
            off = np.linalg.norm(fit.seen[name] - throw.plan, axis=1)
            beside.plot(track.t[throw.kept], off, style, color=colour, label=label)
        panel.set(title=name, xlabel="east (m)", ylabel="down range (m)")
        panel.set_aspect("equal", adjustable="datalim")
        beside.set(xlabel="time (s)", ylabel="off the track, as seen (m)", ylim=(0.0, None))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    save_figure(figure, path)


def _flight(panel: Axes, one: Flown, colour: str, label: str) -> None:
    panel.plot(one.path[:, 1], one.path[:, 0], color=colour, label=label)
    panel.plot(one.landing[1], one.landing[0], "x", ms=7, color=colour)


def draw_rows(throws: Mapping[str, Recording], rows: Mapping[str, Rows], path: Path) -> None:
    """Draw the spin by gyroscope, force and field, for rows as filed and of their mean length, and these lengths."""
    figure, axes = new_figure(len(throws), 3, width=12.0, height=2.2 * len(throws), squeeze=False)
    for row, (name, throw) in zip(axes, throws.items(), strict=True):
        for panel, ratio in zip(row[:2], (1.0, rows[name].by_field), strict=True):
            again = restamped(throw, ratio)
            field, gyroscope, force = (
                again.need("magnetometer"),
                again.need("gyroscope"),
                estimate(again, "accelerometer"),
            )
            count = max(round(SMOOTH / field.interval), 2)
            phase = -field_phase(field.value)
            slope = (phase[count:] - phase[:-count]) / (field.t[count:] - field.t[:-count])
            middle = (field.t[count:] + field.t[:-count]) / 2.0
            for label, t, rate in (
                ("magnetometer", middle, np.abs(slope)),
                ("gyroscope", gyroscope.t, np.abs(gyroscope.value[:, 2])),
                ("accelerometer", force.t, force.rate),
            ):
                panel.plot(t, np.degrees(rate), color=COLOURS.get(label, COLOURS["fft"]), label=label, lw=1.0)
            panel.set_title(f"{name}, rows of {10.0 * ratio:.2f} ms")
        top = float(np.max(np.abs(np.degrees(throw.need("gyroscope").value[:, 2]))))
        row[0].set(ylabel="spin (deg/s)", ylim=(0.6 * top, 1.5 * top))
        row[1].set(ylim=(0.6 * top, 1.5 * top))
        row[2].hist(1e3 * rows[name].steps, bins=np.arange(0.0, 40.0, 0.5), color=COLOURS["fft"])
        row[2].axvline(10.0, color=COLOURS["truth"], ls="--", lw=1.0)
        row[2].set(title=f"{name}, each row (dashed: as filed)", ylabel="rows")
    for panel in axes[-1]:
        panel.set_xlabel("length of the row (ms)" if panel is axes[-1, 2] else "time (s)")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
    save_figure(figure, path)


def draw_fields(logs: Sequence[tuple[str, FloatArray, float | None]], path: Path) -> None:
    """Draw how often a magnetometer's readings (n, 3) uT have which size, and the stated size of the field, uT."""
    columns = 3
    rows = (len(logs) + columns - 1) // columns
    figure, axes = new_figure(rows, columns, width=10.0, height=2.4 * rows, squeeze=False)
    for panel, (name, field, stated) in zip(axes.flat, logs, strict=False):
        size = np.linalg.norm(field, axis=1)
        panel.hist(size, bins=60, color=COLOURS["accelerometer"], histtype="stepfilled", alpha=0.8)
        if stated is not None:
            panel.axvline(stated, color=TRACK, ls="--", lw=1.2, label="stated")
            panel.legend(fontsize=7)
        panel.set(title=name, xlabel="size of the reading (uT)", ylabel="readings", xlim=(0.0, None))
    for panel in axes.flat[len(logs) :]:
        panel.set_visible(False)
    save_figure(figure, path)
