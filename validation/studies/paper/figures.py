"""The paper's Figs. 3, 9, 11 and 13 on our truth, beside the numbers that it prints, and what would carry 72 m."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from discsim.disc import Disc
from discsim.environment import Environment
from discsim.estimators.fft import fft
from discsim.sensors import Instruments, record
from discsim.trajectory import Flight, predict
from discsim.validation.reporting.figures import COLOURS, new_figure, save_figure
from discsim.validation.studies.paper.distance import PAPER_M
from discsim.validation.studies.paper.modules import MORE_DISTANCE, MORE_SPIN, TWO_MODULES, two_throws
from discsim.validation.studies.paper.prediction import Prediction
from discsim.validation.studies.paper.releases import PaperThrow
from discsim.validation.studies.paper.spectrum import PAPER_HZ, WholeFlight
from discsim.validation.yaw_damping.figures import draw_surface_on
from discsim.validation.yaw_damping.paper_table import RATES_DEG_S

__all__ = ["draw_distances", "draw_fig_3", "draw_fig_9", "draw_fig_11", "draw_fig_13"]

_PAPER = "#999999"
#: the paper's spins outside its own table, deg/s: Fig. 3, and the start of Fig. 9
OUTSIDE_DEG_S = ((3240.0, 3600.0), (4200.0, 4200.0))
#: the distances of the paper's repeated throws, m
PAPER_THROWS_M = (70.0, 80.0)


def draw_fig_3(found: WholeFlight, path: Path) -> None:
    """Draw the field of a whole flight, and one spectrum of all of it with the paper's line."""
    figure, axes = new_figure(1, 2, width=11.0, height=3.8)
    samples = found.magnetometer
    for axis, colour, name in ((0, COLOURS["fft"], "x"), (1, COLOURS["accelerometer"], "y")):
        axes[0].plot(samples.t, samples.value[:, axis], color=colour, lw=0.6, label=name)
    axes[0].set(title="Magnetometer, release to touch-down", xlabel="time (s)", ylabel="field (uT)")
    axes[0].set_ylim(-65.0, 75.0)
    axes[0].legend(loc="upper right", ncols=2)
    axes[1].axvspan(*PAPER_HZ, color=_PAPER, alpha=0.35, lw=0, label="the paper's dominant line")
    axes[1].plot(found.frequency, found.amplitude, color=COLOURS["fft"], lw=1.0, label="all of x")
    for number, hz in enumerate(found.true_hz):
        label = "true spin, release and end" if number == 0 else None
        axes[1].axvline(hz, color=COLOURS["truth"], lw=0.9, ls="--", label=label)
    axes[1].set(title="Spectrum of the whole flight", xlabel="frequency (Hz)", ylabel="amplitude (uT)", xlim=(0, 20))
    axes[1].legend(loc="upper right")
    save_figure(figure, path)


def draw_fig_9(
    disc: Disc, environment: Environment, numbers: dict[str, Any], rng: np.random.Generator, path: Path
) -> None:
    """Draw spin and path with either module, 10 % less speed and spin with the heavier, and all ratios of distance."""
    figure, axes = new_figure(1, 3, width=14.0, height=4.2)
    parts = Instruments.from_parts("mpu9250", "neo_m8n")
    pair = two_throws(disc, PaperThrow().release, TWO_MODULES[2])
    for (flown, release), shade, label in zip(pair, ("#0072b2", "#d55e00"), ("37 g", "15 g"), strict=True):
        flight = predict(flown, environment, release)
        recording = record(flight.motion(), parts, rng, plant="flight", name=label, disc=flown)
        rate = fft(recording.need("magnetometer"))
        axes[0].plot(rate.t, np.degrees(rate.rate), color=shade, lw=1.0, label=f"{label}, fft")
        t = np.linspace(0.0, flight.end, 100)
        axes[0].plot(t, np.degrees(flight.at(t).rate[:, 2]), color=COLOURS["truth"], lw=0.8, ls="--")
        gps = recording.need("gps").value
        axes[1].plot(gps[:, 1], gps[:, 0], ".", color=shade, ms=4, label=f"{label}, GPS")
        _from_above(axes[1], flight, COLOURS["truth"], "--", None)
    axes[0].plot([], [], color=COLOURS["truth"], lw=0.8, ls="--", label="truth")
    starts = [4200.0, 4200.0 / MORE_SPIN]
    axes[0].plot([0.0, 0.0], starts, "o", color=_PAPER, ms=6, label="the paper's, at release")
    axes[0].set(title="(a) Spin rate", xlabel="time (s)", ylabel="rate (deg/s)")
    axes[0].legend(fontsize=8)
    axes[1].set_title("(b) Path from above, the paper's release")
    axes[1].legend(fontsize=8)
    _ratios(axes[2], numbers)
    save_figure(figure, path)


def _ratios(axes: Axes, numbers: dict[str, Any]) -> None:
    """Draw the ratios of distance as bars, bare and with a bluff module."""
    for row, (name, shade) in enumerate((("paper", "#56b4e9"), ("driver", "#e69f00"))):
        for number, way in enumerate(TWO_MODULES):
            figures = numbers["ways"][f"{name}: {way}"]
            at, label = number + 0.36 * row - 0.18, f"{name}'s release" if number == 0 else None
            axes.bar(at, figures["distance"] - 1, 0.32, bottom=1, color=shade, label=label)
            bluff = "and a module that sticks out" if number == 0 and row == 1 else None
            axes.plot(at, figures["distance_with_bluff_module"], "_", color="black", ms=16, mew=1.5, label=bluff)
    axes.axhline(MORE_DISTANCE, color=_PAPER, lw=2, label="the paper's")
    axes.set_xticks(range(len(TWO_MODULES)), ["same speed\nand spin", "same\nenergy", "10 % less speed\nand spin"])
    axes.set(title="(c) Distance with 15 g over that with 37 g", ylim=(0.9, 1.45))
    axes.legend(fontsize=7, loc="upper left")


def draw_fig_11(found: Prediction, path: Path) -> None:
    """Draw spins and lines of the throws beside the paper's range of rates, and the table that they make."""
    figure, axes = new_figure(1, 2, width=12.5, height=4.6)
    axes[0].axhspan(RATES_DEG_S[0], RATES_DEG_S[-1], color=_PAPER, alpha=0.2, lw=0, label="the paper's table")
    for number, (low, high) in enumerate(OUTSIDE_DEG_S):
        label = ("the paper's Fig. 3", "the paper's Fig. 9, at release")[number]
        if low == high:
            axes[0].plot(0.0, low, "o", color="black", ms=6, label=label)
        else:
            axes[0].plot([0.0, 0.0], [low, high], color="black", lw=3, label=label)
    for number, (throw, line) in enumerate(zip(found.throws, found.paper.slopes, strict=True)):
        first = number == 0
        axes[0].plot(throw.spin_t, np.degrees(throw.spin), ".", color="#0072b2", ms=2, label="fft" if first else None)
        ends = np.degrees(line.at(line.t))
        axes[0].plot(line.t, ends, color="#d55e00", lw=1.0, label="straight line" if first else None)
    axes[0].set(title="(a) Spin of eight throws", xlabel="time (s)", ylabel="rate (deg/s)", ylim=(3000, 7300))
    axes[0].legend(fontsize=8, ncols=2, loc="lower right")
    draw_surface_on(axes[1], found.paper, None)
    t = np.linspace(0.0, found.truth.end, 100)
    state = found.truth.at(t)
    speed = np.linalg.norm(state.velocity, axis=1)
    axes[1].plot(speed, np.degrees(state.rate[:, 2]), color="#d55e00", lw=1.6, label="the flight of Fig. 13")
    truth = -1000 * found.numbers["table"]["true_CNr"]
    axes[1].set_title(f"(b) Table (28) as -1000 CNr; the truth is {truth:g} everywhere")
    axes[1].legend(fontsize=8, loc="upper left", frameon=True)
    save_figure(figure, path)


_SHADES = ("#d55e00", "#56b4e9", "#0072b2", "#00365c", "#009e73")


def draw_fig_13(found: Prediction, path: Path) -> None:
    """Draw paths from above, distance from the truth and spins of all predictions, beside the paper's distances."""
    figure, axes = new_figure(1, 3, width=14.0, height=4.6)
    plan = axes[0]
    angle = np.radians(np.linspace(70.0, 110.0, 60))
    ring = np.array([np.sin(angle), np.cos(angle)])
    for metres, line in ((PAPER_M, "-"), (PAPER_THROWS_M[0], ":"), (PAPER_THROWS_M[1], ":")):
        label = {PAPER_M: "the paper's 72 m", PAPER_THROWS_M[0]: "its 70 to 80 m"}.get(metres)
        plan.plot(*(metres * ring), color=_PAPER, ls=line, lw=1.4, label=label)
    plan.plot(
        found.gps_ends[:, 1], found.gps_ends[:, 0], ".", color="#009e73", ms=2, alpha=0.4, label="ends, velocity by GPS"
    )
    t = np.linspace(0.0, found.truth.end, 300)
    _from_above(plan, found.truth, COLOURS["truth"], "-", "truth")
    truth = found.truth.at(t)
    for item, shade in zip(found.predicted, _SHADES, strict=True):
        if item.flight is None:
            continue
        _from_above(plan, item.flight, shade, "--", None)
        both = t[t <= item.flight.end]
        apart = np.linalg.norm(item.flight.at(both).position - found.truth.at(both).position, axis=1)
        axes[1].plot(both, apart, color=shade, label=item.label)
        axes[2].plot(both, np.degrees(item.flight.at(both).rate[:, 2]), color=shade)
    axes[2].plot(t, np.degrees(truth.rate[:, 2]), color=COLOURS["truth"], lw=1.4, ls=":", label="truth")
    plan.set_title("(a) From above")
    plan.legend(fontsize=7, loc="lower left")
    axes[1].set(title="(b) Distance from the truth at the same time", xlabel="time (s)", ylabel="distance (m)")
    axes[1].set_yscale("log")
    axes[1].set_ylim(1e-3, 10.0)
    axes[1].legend(fontsize=7)
    axes[2].set(title="(c) Spin rate", xlabel="time (s)", ylabel="rate (deg/s)")
    axes[2].legend(fontsize=8)
    save_figure(figure, path)


def _from_above(axes: Axes, flight: Flight, shade: str, line: str, label: str | None) -> None:
    place = flight.at(np.linspace(0.0, flight.end, 200)).position
    axes.plot(place[:, 1], place[:, 0], color=shade, ls=line, lw=1.1, label=label)
    axes.set(xlabel="east (m)", ylabel="north (m)")
    axes.set_aspect("equal", adjustable="datalim")


def draw_distances(numbers: dict[str, Any], path: Path) -> None:
    """Draw between what distances each unknown alone carries the disc, and the paper's 72 m."""
    figure, axes = new_figure(width=9.0, height=5.0)
    unknowns = sorted(numbers["unknowns"].items(), key=lambda item: item[1]["most_m"])
    for row, (_, found) in enumerate(unknowns):
        axes.barh(row, found["most_m"] - found["least_m"], left=found["least_m"], height=0.6, color="#56b4e9")
    axes.axvline(PAPER_M, color=COLOURS["fft"], lw=1.4, label="the paper's 72 m")
    axes.axvline(numbers["m"], color=COLOURS["truth"], lw=1.0, ls="--", label="ours, as taken")
    labels = [
        f"{name}, {found['range'][0]:g} to {found['range'][1]:g} {found['unit']}".rstrip() for name, found in unknowns
    ]
    axes.set_yticks(range(len(unknowns)), labels)
    axes.set(title="How far the disc flies with one unknown at a time", xlabel="distance (m)", xlim=(25, 115))
    axes.legend(loc="lower right", frameon=True)
    save_figure(figure, path)
