"""The paper's Fig. 7 from a rate-table run, and one window of its fastest plateau as the FFT sees it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from discsim.estimators.fft import FftSettings
from discsim.validation.reporting.figures import COLOURS, colour, new_figure, save_figure, symmetric_log
from discsim.validation.scenarios.rate_table import RateTableRun, errors_within, plateaus

__all__ = ["draw_methods", "draw_waveform"]

#: width of a method's line, in the order in which they are drawn; errors are drawn the scattered ones first
_WIDTHS = {"adxrs649": 0.5, "gyroscope": 1.6, "accelerometer": 0.8, "fft": 1.2}
_ERRORS = ("adxrs649", "accelerometer", "gyroscope", "fft")


def draw_methods(run: RateTableRun, path: Path) -> None:
    """Draw Fig. 7: all methods against truth, the accelerometer's envelopes for each mount error, and the errors."""
    rows = 2 + len(run.envelopes)
    figure, axes = new_figure(rows, 1, width=10.0, height=3.1 * rows, sharex=True)
    truth_t, truth = run.motion.t[::20], np.degrees(run.motion.rate[::20, 2])
    names = [method for method in _WIDTHS if method in run.rates]
    names += [method for method in run.rates if method not in _WIDTHS]

    top = axes[0]
    for method in names:
        rate = run.rates[method]
        top.plot(rate.t, np.degrees(rate.rate), color=colour(method, names), lw=_WIDTHS.get(method, 1.0), label=method)
    top.plot(truth_t, truth, color=COLOURS["truth"], lw=0.9, ls="--", label="truth")
    top.set_title("All methods on one profile")
    top.legend(loc="upper left", ncols=5, fontsize=8)
    if spans := plateaus(run.profile):
        start, stop, level = max(spans, key=lambda span: abs(span[2]))
        inset = top.inset_axes((0.66, 0.07, 0.33, 0.34))
        for method in [name for name in names if name in ("accelerometer", "fft")]:
            rate = run.rates[method]
            inset.plot(rate.t, np.degrees(rate.rate), color=COLOURS[method], lw=0.9)
        inset.plot(truth_t, np.abs(truth), color=COLOURS["truth"], lw=0.9, ls="--")
        inset.set_xlim(start, min(stop, start + 3.0))
        inset.set_ylim(abs(np.degrees(level)) - 15, abs(np.degrees(level)) + 35)
        inset.set_title(f"at {abs(np.degrees(level)):.0f} deg/s", fontsize=8)
        inset.tick_params(labelsize=7)

    for panel, (mount, estimate) in zip(axes[1:-1], run.envelopes.items(), strict=True):
        assert estimate.lower is not None
        assert estimate.upper is not None
        panel.fill_between(
            estimate.t,
            np.degrees(estimate.lower),
            np.degrees(estimate.upper),
            color=COLOURS["accelerometer"],
            alpha=0.25,
            lw=0,
            label="accelerometer, worst case (11)",
        )
        if (fft := run.rates.get("fft")) is not None:
            panel.plot(fft.t, np.degrees(fft.rate), color=COLOURS["fft"], lw=1.2, label="fft")
        panel.plot(truth_t, np.abs(truth), color=COLOURS["truth"], lw=0.9, ls="--", label="truth")
        panel.set_title(f"Envelope for a mount error of {1000 * mount:g} mm")
        panel.legend(loc="upper left", fontsize=8)

    bottom = axes[-1]
    for method in [name for name in _ERRORS if name in names] + [name for name in names if name not in _ERRORS]:
        rate = run.rates[method]
        error, _ = errors_within(rate, run.truth, *run.span)
        inside = (rate.t >= run.motion.start) & (rate.t <= run.motion.end)
        bottom.plot(rate.t[inside], np.degrees(error), color=colour(method, names), lw=0.7)
    symmetric_log(bottom, linear=10.0, limit=300.0)
    bottom.set_title("Error of each method (logarithmic beyond 10 deg/s)")
    bottom.set_ylabel("error, deg/s")
    bottom.set_xlabel("time, s")
    for panel in axes[:-1]:
        panel.set_ylabel("rate, deg/s")
        fastest = float(np.abs(truth).max())
        panel.set_ylim(min(0.0, 1.1 * float(truth.min())) - 300, 1.25 * fastest + 300)
    save_figure(figure, path)


def draw_waveform(run: RateTableRun, path: Path) -> None:
    """Draw a second of the magnetometer on the fastest plateau, and one window's padded spectrum, (P-3) to (P-5)."""
    magnetometer = run.recording.need("magnetometer")
    start, _, level = max(plateaus(run.profile), key=lambda span: abs(span[2]))
    settings = FftSettings()
    shown = magnetometer.between(start, start + 1.0)
    first = int(np.searchsorted(magnetometer.t, start))
    window = magnetometer.value[first : first + settings.window, 0]
    interval = magnetometer.interval
    frequency = np.fft.rfftfreq(settings.window + settings.pad, interval)
    amplitude = np.abs(np.fft.rfft(window, settings.window + settings.pad)) * 2 / settings.window

    figure, axes = new_figure(1, 2, width=10.0, height=3.6)
    for axis, shade, name in ((0, COLOURS["fft"], "x"), (1, COLOURS["accelerometer"], "y")):
        axes[0].plot(shown.t, shown.value[:, axis], color=shade, marker=".", ms=4, lw=0.8, label=name)
    axes[0].set_title("Magnetometer on the turning table")
    axes[0].set_xlabel("time, s")
    axes[0].set_ylabel("field, uT")
    axes[0].legend(loc="lower left", bbox_to_anchor=(0.7, 1.0), ncols=2)
    axes[1].plot(frequency, amplitude, color=COLOURS["fft"], lw=1.0)
    axes[1].axvline(abs(level) / (2 * np.pi), color=COLOURS["truth"], lw=0.9, ls="--", label="truth")
    axes[1].axvspan(0, settings.threshold / (2 * np.pi), color="0.85", label="below the threshold")
    axes[1].set_title(f"Spectrum of {settings.window} samples, zero-padded")
    axes[1].set_xlabel("frequency, Hz")
    axes[1].set_ylabel("amplitude, uT")
    axes[1].set_xlim(0, 0.5 / interval)
    axes[1].legend(loc="upper right")
    save_figure(figure, path)
