"""``discsim estimate``: spin rate over time by each method."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from validation.reporting.options import DateOption, OutOption, PlaceOption

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from discsim.recording import Recording
    from estimators.methods import Options
    from estimators.rate import YawRate
    from validation.scenarios.method_disagreement import Disagreement

__all__ = ["all_notes", "command", "estimate_all", "rate_csv", "summary"]

#: rows of rate.csv put into words at once: their text, a few MB, is all that is held of it
_ROWS = 50_000


def command(
    recording: Annotated[Path, typer.Argument(help="A recording folder (with recording.toml).", show_default=False)],
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
    """Estimate the spin rate of a recording and its standard deviation over time.

    Writes rate.csv (time_s,method,rate_rad_s,sd_rad_s; a cell is empty where a method cannot tell), rate.png and
    estimate.json into --out. fft and accelerometer give magnitudes. Methods that contradict each other beyond their
    standard deviations are named, not averaged. No method needs the magnetic field of the place; where it is stated,
    or looked up by --place and --date, the magnetometer's methods know more.

    Example: discsim estimate throw-01 --method all --out throw-01-rate
    """
    from dataclasses import replace

    import numpy as np

    from discsim.files import write_pieces
    from discsim.recording import read_recording
    from discsim.written import require_seconds
    from estimators.accelerometer import AccelerometerErrors
    from estimators.fft import FftSettings
    from estimators.methods import Options
    from validation.diagnosis.setup import find_setup_faults
    from validation.reporting.options import at_place
    from validation.reporting.run import start_run
    from validation.scenarios.method_disagreement import disagreements

    zeros = max(0, 2**14 - window) if pad is None else pad
    options = Options(
        FftSettings(window, zeros, float(np.radians(threshold)), step, stamp, remove_mean),
        AccelerometerErrors(mount=mount_error / 1000),
    )
    data = read_recording(recording)
    data = replace(data, environment=at_place(data.environment, place, date))
    setup = find_setup_faults([data])
    data = setup.recordings[0]
    require_seconds(data)
    rates, left_out = estimate_all(data, method, options)
    notes = [f"{fault.sentence}; the estimates are of the readings so corrected" for fault in setup.faults]
    notes += all_notes(data)
    found = disagreements(rates)
    with start_run(out, inputs=[recording]) as run:
        write_pieces(out / "rate.csv", rate_csv(rates))
        run.write_json("estimate.json", summary(data, method, rates, left_out, found, notes))
        draw(rates, data.name, out / "rate.png")
    _print(rates, left_out, found, notes)


def draw(rates: Sequence[YawRate], name: str, path: Path) -> None:
    """Draw the rates, and below them their differences from the most preferred method that knows the rate."""
    import numpy as np

    from validation.reporting.figures import draw_differences, draw_rates, new_figure, save_figure

    knowing = [rate for rate in rates if np.isfinite(rate.rate).any()]
    if len(knowing) < 2:
        figure, axes = new_figure(width=10.0, height=5.0)
        draw_rates(axes, rates)
    else:
        figure, (axes, lower) = new_figure(2, 1, width=10.0, height=8.0, sharex=True, height_ratios=(3, 2))
        draw_rates(axes, rates)
        axes.set_xlabel("")
        draw_differences(lower, knowing, max(knowing, key=lambda rate: bool(np.mean(np.isfinite(rate.rate)) >= 0.5)))
    axes.set_title(f"Spin rate of {name}, with bands of one standard deviation")
    # below the axes: with all methods there is no free corner
    handles, labels = axes.get_legend_handles_labels()
    axes.get_legend().remove()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 5), fontsize=8)
    save_figure(figure, path)


def estimate_all(recording: Recording, name: str, options: Options) -> tuple[list[YawRate], dict[str, str]]:
    """Return what the named method gives (of all for "all"), and with the reason those left out or passed over.

    Raises `InputError` for an unknown name, or where nothing can be estimated.
    """
    from discsim.errors import InputError
    from estimators.methods import METHODS, all_methods, best_of, estimate

    if name == "all":
        return all_methods(recording, options)
    if name == "best":
        found, passed_over = best_of(recording, options)
        return [found], passed_over
    if name not in METHODS:
        raise InputError(f"--method {name}: unknown; expected one of best, all, {', '.join(METHODS)}")
    return [estimate(recording, name, options)], {}


def all_notes(recording: Recording) -> list[str]:
    """Return a line for all that a reader must know of a recording before believing an estimate from it."""
    from estimators.fusion import contradictions
    from estimators.methods import axis_notes, clock_notes, field_notes, folding_notes, sampling_notes
    from estimators.usable import usable

    sound = usable(recording)
    data = sound.recording
    about = (sampling_notes, folding_notes, field_notes, axis_notes, contradictions, clock_notes)
    return [*sound.notes, *(line for notes in about for line in notes(data))]


def rate_csv(rates: Sequence[YawRate]) -> Iterator[str]:
    """Yield the text of rate.csv in pieces: method by method in time order, cells empty where a value is unknown."""
    yield "time_s,method,rate_rad_s,sd_rad_s\n"
    for rate in rates:
        known, unknown = f"%.9g,{rate.method},%.9g,%.4g\n", f"%.9g,{rate.method},,\n"
        for first in range(0, len(rate), _ROWS):
            part = slice(first, first + _ROWS)
            rows = zip(rate.t[part].tolist(), rate.rate[part].tolist(), rate.sd[part].tolist(), strict=True)
            # row[1] != row[1]: NaN
            yield "".join([unknown % row[0] if row[1] != row[1] else known % row for row in rows])


def summary(
    recording: Recording,
    asked: str,
    rates: Sequence[YawRate],
    left_out: dict[str, str],
    found: Sequence[Disagreement],
    notes: Sequence[str],
) -> dict[str, Any]:
    """Return the content of estimate.json."""
    from dataclasses import asdict

    return {
        "recording": recording.name,
        "asked": asked,
        "methods": {rate.method: _figures(rate) for rate in rates},
        "left_out": left_out,
        "disagreements": [{**asdict(item), "text": item.text} for item in found],
        "notes": list(notes),
    }


def _figures(rate: YawRate) -> dict[str, Any]:
    import numpy as np

    known = np.isfinite(rate.rate)
    median = float(np.median(rate.rate[known])) if known.any() else float("nan")
    sd = float(np.median(rate.sd[known])) if known.any() else float("nan")
    part: dict[str, float] = {}
    if rate.precession_sd is not None and np.any(rate.precession_sd[known] > 0):
        part["median_precession_sd_rad_s"] = float(np.median(rate.precession_sd[known]))
    return {
        "count": len(rate),
        "share_unknown": float(1 - known.mean()) if len(rate) else float("nan"),
        "median_rate_rad_s": median,
        "median_sd_rad_s": sd,
        **part,
        "signed": rate.signed,
    }


def _print(
    rates: Sequence[YawRate], left_out: dict[str, str], found: Sequence[Disagreement], notes: Sequence[str]
) -> None:
    import numpy as np
    from rich.console import Console
    from rich.table import Column, Table

    # names are what --method takes: whole on a narrow terminal, too
    first = Column("method", no_wrap=True, min_width=max((len(rate.method) for rate in rates), default=0))
    table = Table(first, "values", "unknown", "median, deg/s", "median sd, deg/s")
    for rate in rates:
        figures = _figures(rate)
        cells = [np.degrees(figures["median_rate_rad_s"]), np.degrees(figures["median_sd_rad_s"])]
        # a deviation that rounds to nothing is not nothing
        shown = [
            "" if np.isnan(cell) else f"{cell:.2f}" if abs(cell) >= 0.005 or not cell else f"{cell:.1g}"
            for cell in cells
        ]
        table.add_row(rate.method, str(len(rate)), f"{100 * figures['share_unknown']:.0f} %", *shown)
    Console().print(table)
    for method, reason in left_out.items():
        typer.echo(f"left out: {method} ({reason})")
    for item in found:
        typer.echo(f"contradiction: {item.text}")
    for note in notes:
        typer.echo(f"note: {note}")
