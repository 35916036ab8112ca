"""``discsim estimate``: spin rate over time by each method."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from discsim.validation.reporting.options import DateOption, OutOption, PlaceOption

if TYPE_CHECKING:
    from discsim.estimators.rate import YawRate
    from discsim.recording import Recording
    from discsim.validation.estimating.spin_estimates import SpinEstimates

__all__ = ["command"]


def command(
    recording: Annotated[
        Path, typer.Argument(help="A recording folder, or a data set: each of it into a folder.", show_default=False)
    ],
    method: Annotated[
        str, typer.Option(help="A method's name, 'best' that the sensors allow, or 'all' whose sensors are present.")
    ] = "best",
    out: OutOption = Path("estimate"),
    window: Annotated[int, typer.Option(help="fft: window, samples (P-1).")] = 128,
    pad: Annotated[int | None, typer.Option(help="fft: zeros appended, (P-2). Default: 2^14 less the window.")] = None,
    threshold: Annotated[float, typer.Option(help="fft: lowest rate looked for, deg/s.")] = 500.0,
    step: Annotated[int, typer.Option(help="fft: samples between windows (P-7).")] = 1,
    stamp: Annotated[
        Literal["centre", "unshifted"],
        typer.Option(help="fft: time of a window, its centre or (unshifted) its end, which delays as in Fig. 7."),
    ] = "centre",
    remove_mean: Annotated[
        bool, typer.Option("--remove-mean", help="fft: take each window's mean off first; the paper does not.")
    ] = False,
    mount_error: Annotated[float, typer.Option(help="accelerometer: bound on its installation error, mm.")] = 1.0,
    place: PlaceOption = None,
    date: DateOption = None,
) -> None:
    """Estimate the spin rate of a recording over time.

    Writes rate.csv (time_s,method,rate_rad_s,sd_rad_s; a cell is empty where a method cannot tell), rate.png,
    estimate.json and report.html into --out. fft and accelerometer give magnitudes. Methods that contradict each other
    beyond their standard deviations are named, not averaged. No method needs the magnetic field of the place; where it
    is stated, or looked up by --place and --date, the magnetometer's methods know more.

    Example: discsim estimate throw-01 --method all --out throw-01-rate
    """
    from dataclasses import replace

    import numpy as np

    from discsim.estimators.accelerometer import AccelerometerErrors
    from discsim.estimators.fft import FftSettings
    from discsim.estimators.methods import Options
    from discsim.validation.estimating.spin_estimates import estimate_spin
    from discsim.validation.reporting.options import at_place, say_note
    from discsim.validation.reporting.place import swapped_place
    from discsim.validation.reporting.run import Run, start_run
    from discsim.validation.running.given import read_given

    zeros = max(0, 2**14 - window) if pad is None else pad
    options = Options(
        FftSettings(window, zeros, float(np.radians(threshold)), step, stamp, remove_mean),
        AccelerometerErrors(mount=mount_error / 1000),
    )
    given = read_given(recording, say_note)
    placed = [replace(one, environment=at_place(one.environment, place, date)) for one in given]
    shown = Run(out, [], None)  # what fails leaves no folder behind
    if doubt := swapped_place(place, date, given):
        shown.step(doubt)
    found = []
    for number, one in enumerate(placed, start=1):
        if len(placed) > 1:
            shown.step(f"recording {number} of {len(placed)}: {_called(one)}")
        found.append(estimate_spin(one, method, options, progress=shown.progress))
    with start_run(out, inputs=[recording]):
        for one, rates in zip(placed, found, strict=True):
            rates.report(out / _called(one) if len(placed) > 1 else out)
            if len(placed) > 1:
                typer.echo(f"{_called(one)}:")
            _print(rates)


def _called(recording: Recording) -> str:
    return recording.name if recording.path is None else recording.path.name


def _times(rate: YawRate) -> str:
    """Return from when to when a method knows the rate: medians over other times are of other spins."""
    import numpy as np

    known = rate.t[np.isfinite(rate.rate)]
    return f"{round(known[0], 1) + 0.0:.1f} to {known[-1]:.1f}" if known.size else ""


def _print(found: SpinEstimates) -> None:
    import numpy as np
    from rich.console import Console
    from rich.table import Column, Table

    from discsim.validation.estimating.spin_estimates import figures_of

    # names are what --method takes: whole on a narrow terminal, too
    first = Column("method", no_wrap=True, min_width=max((len(rate.method) for rate in found.rates), default=0))
    spans = [_times(rate) for rate in found.rates]
    covers = Column("times, s", no_wrap=True, min_width=max(map(len, spans), default=0))
    table = Table(first, "values", "unknown", covers, "median, deg/s", "median sd, deg/s")
    for rate, span in zip(found.rates, spans, strict=True):
        figures = figures_of(rate)
        cells = [np.degrees(figures["median_rate_rad_s"]), np.degrees(figures["median_sd_rad_s"])]
        # a deviation that rounds to nothing is not nothing
        shown = [
            "" if np.isnan(cell) else f"{cell:.2f}" if abs(cell) >= 0.005 or not cell else f"{cell:.1g}"
            for cell in cells
        ]
        if figures.get("median_is_beyond"):
            shown = [f"beyond {shown[0]}", ""]
        table.add_row(rate.method, str(len(rate)), f"{100 * figures['share_unknown']:.0f} %", span, *shown)
    Console().print(table)
    for line in found.remarks:
        typer.echo(line)
