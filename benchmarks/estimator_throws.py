"""Whole throws of `estimators.py`: every method's error on random throws with everything on, a table and a figure."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from estimator_windows import SETTINGS, rms
from matplotlib.ticker import ScalarFormatter
from support.spinning_sensor import Faults, Spin, record

from discsim.arrays import FloatArray
from discsim.estimators.accelerometer import accelerometer
from discsim.estimators.fft import FftSettings, fft
from discsim.estimators.fusion import accelerometer_calibrated, fusion
from discsim.estimators.likelihood import likelihood
from discsim.estimators.methods import best as best_of_recording
from discsim.estimators.precession import phase_rate
from discsim.estimators.rate import YawRate
from discsim.estimators.tracking import tracking
from discsim.recording import Recording
from discsim.validation.reporting.figures import new_figure, save_figure


def random_throw(rng: np.random.Generator) -> tuple[Spin, Faults]:
    """Return an ordinary throw and ordinary faults of an MPU-9250 in it."""
    spin = Spin(
        rate=float(rng.choice([-1, 1]) * rng.uniform(2500, 6500)),
        decay=float(rng.uniform(12, 30)),
        decay_change=float(rng.uniform(0, 0.6)),
        duration=float(rng.uniform(3, 8)),
        precession=(float(rng.normal(0, 5)), float(rng.normal(0, 5))),
        precession_change=(float(rng.normal(0, 2)), float(rng.normal(0, 2))),
        nutation=float(rng.uniform(5, 40)),
        nutation_decay=float(rng.uniform(0.3, 1.0)),
        roll=float(rng.normal(0, 12)),
        pitch=float(rng.normal(5, 8)),
        yaw=float(rng.uniform(0, 360)),
        force=(float(rng.normal(0, 3)), float(rng.normal(0, 3)), -9.0),
    )
    soft = np.triu(rng.normal(0, SETTINGS.soft_iron, (3, 3)))
    scale = float(rng.normal(0, SETTINGS.gyroscope_gain))
    faults = Faults(
        hard_iron=tuple(rng.normal(0, 12, 3)),
        soft_iron=soft + np.triu(soft, 1).T + float(rng.normal(0, SETTINGS.strength)) * np.eye(3),
        mount_error=tuple(rng.normal(0, 0.001, 2)),
        accelerometer_bias=tuple(rng.normal(0, 0.3, 2)),
        gyroscope_bias=tuple(rng.normal(0, 0.05, 3)),
        gyroscope_scale=(scale, scale, float(rng.normal(0, 0.02))),
    )
    return spin, faults


def _only(recording: Recording, *sensors: str) -> Recording:
    return replace(recording, samples={sensor: recording.need(sensor) for sensor in sensors})


def _blind(recording: Recording) -> Recording:
    return _only(recording, "magnetometer")


THROW_METHODS: dict[str, Callable[[Recording], YawRate]] = {
    "fft (paper)": lambda recording: fft(recording.need("magnetometer"), FftSettings()),
    "accelerometer (paper)": lambda recording: accelerometer(
        recording.need("accelerometer"), recording.sheets["accelerometer"]
    ),
    "accelerometer_calibrated": accelerometer_calibrated,
    "likelihood, no gyroscope": lambda recording: likelihood(_blind(recording)),
    "tracking, no gyroscope": lambda recording: tracking(_blind(recording)),
    "fusion, no gyroscope": lambda recording: fusion(_only(recording, "magnetometer", "accelerometer")),
    "likelihood": likelihood,
    "tracking": tracking,
    "best (fusion)": best_of_recording,
}


#: The row of what the field's phase turns at without any noise: the error that precession alone makes.
PHASE = "the phase itself, no noise"


class Flown(NamedTuple):
    """One throw by one method: errors deg/s, errors over standard deviations, share of instants answered, seconds."""

    errors: FloatArray
    scaled: FloatArray
    answered: float
    seconds: float


def fly(number: int, seed: int) -> dict[str, Flown]:
    """Return what each method makes of one random throw."""
    rng = np.random.default_rng([seed, number, 77])
    spin, faults = random_throw(rng)
    recording, truth = record(spin, rng, faults)
    some = slice(None, None, 20)
    body = truth.attitude[some] @ np.asarray(spin.magnetic_field)
    false = np.degrees(-phase_rate(body, truth.w[some]) - truth.w[some, 2])
    out = {PHASE: Flown(false, np.full(1, np.nan), 1.0, np.nan)}
    for name, method in THROW_METHODS.items():
        start = time.perf_counter()
        found = method(recording)
        seconds = time.perf_counter() - start
        r = truth.r(found.t)
        error = np.degrees(found.rate - (r if found.signed else np.abs(r)))
        known = np.isfinite(error)
        out[name] = Flown(error[known], error[known] / np.degrees(found.sd[known]), float(np.mean(known)), seconds)
    return out


class Pooled(NamedTuple):
    """A method over all throws: rms over all instants, of each throw (n,), mean, rms over sd, answered, seconds."""

    rms: float
    each: FloatArray
    bias: float
    over_sd: float
    answered: float
    seconds: float


def pooled(throws: Sequence[dict[str, Flown]], name: str) -> Pooled:
    """Pool a method's throws."""
    own = [throw[name] for throw in throws]
    errors = np.concatenate([flown.errors for flown in own])
    return Pooled(
        rms(errors),
        np.array([rms(flown.errors) if flown.errors.size else np.nan for flown in own]),
        float(np.mean(errors)),
        rms(np.concatenate([flown.scaled for flown in own])),
        float(np.mean([flown.answered for flown in own])),
        float(np.median([flown.seconds for flown in own])),
    )


def throws_table(throws: Sequence[dict[str, Flown]]) -> list[str]:
    """Return the lines of the table of whole throws with everything on."""
    lines = [
        "| method | rms | median throw's rms | bias | error/sd | answered | s per throw |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in (PHASE, *THROW_METHODS):
        one = pooled(throws, name)
        if name == PHASE:
            lines.append(f"| {name} | {one.rms:.2f} | {np.nanmedian(one.each):.2f} | {one.bias:+.2f} | | | |")
            continue
        lines.append(
            f"| {name} | {one.rms:.2f} | {np.nanmedian(one.each):.2f} | {one.bias:+.2f} | {one.over_sd:.2f} |"
            f" {100 * one.answered:.0f} % | {one.seconds:.2f} |"
        )
    return lines


def draw_throws(throws: Sequence[dict[str, Flown]], path: Path) -> None:
    """Draw each throw's rms error by each method."""
    figure, axes = new_figure(width=8.0, height=3.8)
    names = [PHASE, *THROW_METHODS]
    shift = np.random.default_rng(0)
    for row, name in enumerate(names):
        each = pooled(throws, name).each
        ours = "no gyroscope" not in name and "paper" not in name and name != PHASE
        axes.plot(
            each, row + shift.uniform(-0.22, 0.22, each.size), "o", ms=3, mew=0, alpha=0.6,
            color="#009e73" if ours else "#d55e00" if "paper" in name else "#0072b2",
        )  # fmt: skip
        axes.plot([np.nanmedian(each)] * 2, [row - 0.36, row + 0.36], color="black", lw=1.6)
    axes.axvline(0.5, color="black", lw=0.8, ls=":")
    axes.set(xscale="log", xlabel="rms error of a throw, deg/s (bar: median; dotted: the goal of 0.5)")
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.xaxis.set_major_formatter(ScalarFormatter())
    save_figure(figure, path)
