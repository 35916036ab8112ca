"""The paper's figures on our truth: Fig. 11 (lines and surface) and 13 (predicted paths)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from discsim.arrays import FloatArray
from discsim.motion import Motion
from discsim.trajectory import Flight
from discsim.validation.experiments.feedback.experiment import Experiment, Flown
from discsim.validation.experiments.feedback.scoring import LINE, OUTPUT_ERROR, Predicted
from discsim.validation.reporting.figures import COLOURS, new_figure, save_figure
from discsim.validation.yaw_damping.figures import draw_surface_on

__all__ = ["draw_fig_11", "draw_fig_13", "draw_what_matters"]

#: what is drawn in Fig. 13: source and way, with colour and line
_DRAWN = (
    ("best", OUTPUT_ERROR, COLOURS["best"], "-"),
    ("fft", LINE, COLOURS["fft"], "-"),
    ("accelerometer, 1 mm", LINE, COLOURS["accelerometer"], "-"),
    ("accelerometer, 5 mm", LINE, COLOURS["accelerometer"], "--"),
)


def draw_fig_11(experiment: Experiment, path: Path) -> None:
    """Draw the spin of all throws with the paper's straight lines, and the table that they make."""
    figure, axes = new_figure(1, 2, width=12.0, height=4.6)
    for number, (throw, line) in enumerate(zip(experiment.throws, experiment.paper.slopes, strict=True)):
        first = number == 0
        axes[0].plot(
            throw.spin_t,
            np.degrees(np.abs(throw.spin)),
            ".",
            color="#0072b2",
            ms=2,
            label="estimated (best)" if first else None,
        )
        axes[0].plot(
            line.t, np.degrees(line.at(line.t)), color="#d55e00", lw=1.0, label="straight line" if first else None
        )
    axes[0].set(title="Fig. 11a: spin of eight throws", xlabel="time (s)", ylabel="magnitude of spin rate (deg/s)")
    axes[0].legend()
    draw_surface_on(axes[1], experiment.paper, experiment.fit)
    axes[1].set_title(f"Fig. 11b: table (28) as -1000 CNr; the truth is {-1000 * _truth(experiment):g} everywhere")
    save_figure(figure, path)


def draw_fig_13(flown: Flown, path: Path) -> None:
    """Draw predicted paths and spins with C_Nr and spin at release from each source, against the truth."""
    figure, axes = new_figure(1, 3, width=13.0, height=4.4)
    _draw_from_above(axes[0], flown.motion)
    for item, shade, line in _drawn(flown):
        assert item.flight is not None
        t = np.linspace(0.0, item.flight.end, 300)
        state = item.flight.at(t)
        label = f"{item.damping.source}; {item.damping.way}"
        axes[0].plot(state.position[:, 1], state.position[:, 0], color=shade, ls=line, lw=1.1)
        axes[1].plot(*_apart(item.flight, flown.motion), color=shade, ls=line, lw=1.1, label=label)
        axes[2].plot(t, np.degrees(np.abs(state.rate[:, 2])), color=shade, ls=line, lw=1.1)
    t = flown.motion.t
    axes[2].plot(t, np.degrees(np.abs(flown.motion.rate[:, 2])), color=COLOURS["truth"], lw=1.4, ls=":", label="truth")
    axes[0].set_title(f"Fig. 13: {flown.name}, seen from above")
    axes[1].set(title="Distance from the truth at the same time", xlabel="time (s)", ylabel="distance (m)")
    axes[1].legend(fontsize=7)
    axes[2].set(title="Spin rate", xlabel="time (s)", ylabel="magnitude (deg/s)")
    axes[2].legend(fontsize=8)
    axes[0].legend(fontsize=8)
    save_figure(figure, path)


def draw_what_matters(
    changes: FloatArray, damping: FloatArray, spin: FloatArray, labels: tuple[str, ...], path: Path
) -> None:
    """Draw how far the touch-down moves with C_Nr and with the spin at release: changes (n,), metres (k, n)."""
    figure, axes = new_figure(width=7.0, height=4.2)
    for number, label in enumerate(labels):
        line = ("-", "--", ":")[number]
        axes.plot(100 * changes, damping[number], color=COLOURS["best"], ls=line, label=f"C_Nr, {label}")
        axes.plot(100 * changes, spin[number], color=COLOURS["fft"], ls=line, label=f"spin at release, {label}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(100 * changes, [f"{100 * change:g}" for change in changes])
    axes.minorticks_off()
    axes.set(title="What moves the touch-down", xlabel="error (%)", ylabel="distance (m)")
    axes.legend(fontsize=8)
    save_figure(figure, path)


def _truth(experiment: Experiment) -> float:
    assert experiment.disc.aero is not None
    return experiment.disc.aero.CNr


def _draw_from_above(axes: Axes, motion: Motion) -> None:
    axes.plot(motion.position[:, 1], motion.position[:, 0], color=COLOURS["truth"], lw=1.4, ls=":", label="truth")
    axes.set(xlabel="east (m)", ylabel="north (m)")
    axes.set_aspect("equal", adjustable="datalim")


def _drawn(flown: Flown) -> list[tuple[Predicted, str, str]]:
    found = {(item.damping.source, item.damping.way): item for item in flown.predicted if item.flight is not None}
    return [(found[source, way], shade, line) for source, way, shade, line in _DRAWN if (source, way) in found]


def _apart(flight: Flight, truth: Motion) -> tuple[FloatArray, FloatArray]:
    t = np.linspace(0.0, min(flight.end, truth.end), 300)
    return t, np.linalg.norm(flight.at(t).position - truth.at(t).position, axis=1)
