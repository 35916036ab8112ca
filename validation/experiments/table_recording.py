"""A measured rate-table run against its rate reference, beside an emulation of the same run from what is stated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.estimators.methods import all_methods
from discsim.estimators.rate import YawRate
from discsim.files import write_text
from discsim.rate_tables import RateTable
from discsim.recording import Recording, Samples, read_recording, write_recording
from discsim.rig import measured_profile
from discsim.sensors import Accelerometer, Gyroscope, Instruments, Magnetometer, RateReference, Sensor
from discsim.sensors.sampling import Noise, Sampling
from discsim.validation.checking.finding import doubts_of
from discsim.validation.checking.statements import statement_findings
from discsim.validation.diagnosis.setup import find_setup_faults, setup_notes
from discsim.validation.diagnosis.setup.reference import reference_doubts
from discsim.validation.reporting.figures import colour, new_figure, save_figure, symmetric_log
from discsim.validation.reporting.markdown import literal
from discsim.validation.scenarios.rate_table import (
    Plateau,
    RateTableRun,
    errors_within,
    papers_rates,
    plateau_rows,
    plateaus,
)
from discsim.validation.scenarios.table_scores import Band, TableScores, score_rates

__all__ = ["Comparison", "MeasuredRun", "compare", "differences", "draw_comparison", "lines_through", "read_run"]

#: sensors that show a spin
_SHOWING = ("magnetometer", "accelerometer", "gyroscope")
#: doubts of a rate reference by which it is no truth to score against; what is late or turns the other way is a note
_NO_TRUTH = ("units", "clock", "factor", "another")
#: estimates this far apart share no data, s: the window of the paper's method
_APART = 1.28
#: a difference of two biases by this many of its standard deviations is told: sound runs have it once in 370 bands
_SIGMAS = 3.0
#: and from this size on, rad/s: half the last digit that is printed. Sensors without noise differ by rounding alone
_LEAST = np.radians(0.005)
#: lines between readings of a log stay within this many times its scatter of the others: one reading of 10 000 is off
#: by 4, and so may the line's ends be
_WITHIN = 4.0 * np.sqrt(2.0)


@dataclass(frozen=True)
class MeasuredRun:
    """A measured run: the recording with faults of its setup mended, what was mended, and the rate that was told."""

    recording: Recording
    notes: tuple[str, ...]
    profile: Samples

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant at which the rate is told, s."""
        return float(self.profile.t[0]), float(self.profile.t[-1])

    def truth(self, t: FloatArray) -> FloatArray:
        """Return the rate by the reference, rad/s, at times t (n,) s."""
        return np.interp(t, self.profile.t, self.profile.value)

    @property
    def instruments(self) -> Instruments:
        """The sensors on board as they are stated, without an error that is not."""
        sensors = {name: _sensor(name, self.recording) for name in self.recording.samples}
        return Instruments({name: sensor for name, sensor in sensors.items() if sensor is not None})

    def profile_for(self, table: RateTable) -> Samples:
        """Return what an emulation is commanded: the command through a drive that is stated, else what was measured."""
        command = self.recording.command
        return self.profile if table.drive.is_ideal or command is None else command


def read_run(folder: Path) -> MeasuredRun:
    """Read a rate-table recording.

    Raises `InputError` where it is another plant, has no rate reference or one that cannot be true, or shows no spin.
    """
    recording = read_recording(folder)
    if recording.plant != "rate_table":
        raise InputError(f"{folder}: plant is {recording.plant}; expected rate_table")
    if not any(name in recording for name in _SHOWING):
        raise InputError(f"{folder}: no sensor that shows a spin; expected some of {', '.join(_SHOWING)}")
    for doubt in reference_doubts(recording):
        if doubt.about_reference and doubt.sure and doubt.kind in _NO_TRUTH:
            raise InputError(f"{folder}: {doubt.sentence}")
    setup = find_setup_faults([recording])
    data = setup.recordings[0]
    notes = (*setup_notes(setup, "scored are"), *doubts_of(statement_findings(data)))
    return MeasuredRun(data, notes, measured_profile(data))


def _sensor(name: str, recording: Recording) -> Sensor | None:
    """Return a sensor as its sheet and its time stamps state it; None for what a table's emulation does not have."""
    sheet, samples = recording.sheets[name], recording.need(name)
    rate = 1.0 / samples.interval if len(samples) > 1 else sheet.rate_hz
    common = {
        "sampling": Sampling(rate, phase_s=max(0.0, float(samples.t[0]))),
        "noise": Noise(sheet.noise_rms or 0.0),
        "resolution": sheet.resolution or 0.0,
    }
    limit = float("inf") if sheet.range is None else sheet.range
    if name == "magnetometer":
        return Magnetometer(**common, range=limit)  # type: ignore[arg-type]
    if name == "accelerometer":
        place = (0.0, 0.0, 0.0) if sheet.position is None else sheet.position
        return Accelerometer(**common, range=limit, position=np.asarray(place))  # type: ignore[arg-type]
    if name == "gyroscope":
        x, y, z = (bool(np.isfinite(column).any()) for column in samples.value.T)
        return Gyroscope(**common, range=limit, axes=(x, y, z))  # type: ignore[arg-type]
    return RateReference(**common) if name == "rate_reference" else None  # type: ignore[arg-type]


@dataclass(frozen=True)
class Difference:
    """A band of rates in which a method is off by other amounts in the measured run than in the emulated one."""

    measured: Band
    emulated: Band
    sigmas: float

    @property
    def text(self) -> str:
        """One line for a person."""
        low, high = (np.degrees(x) for x in (self.measured.low, self.measured.high))
        band = f"{low:.0f} to {high:.0f} deg/s" if np.isfinite(high) else f"above {low:.0f} deg/s"
        was, here = (np.degrees(one.bias) for one in (self.emulated, self.measured))
        return f"{self.measured.method}, {band}: off by {here:+.2f} deg/s, emulated {was:+.2f} ({self.sigmas:.0f} sd)"


@dataclass(frozen=True)
class Comparison:
    """Scores of a measured run and its emulation, and where they differ by more than chance."""

    real: MeasuredRun
    run: RateTableRun
    rates: Mapping[str, YawRate]
    measured: TableScores
    emulated: TableScores
    plateaus: list[Plateau]
    differences: tuple[Difference, ...]

    def sentences(self, out: Path) -> list[str]:
        """Return what there is to say, a line each; the last hands on differences written into ``out``."""
        lines = [f"note: {note}" for note in self.real.notes]
        if not self.differences:
            return [*lines, "The emulation errs as the measured run does: what is stated of the sensors explains it."]
        lines.append("The measured run errs otherwise than its emulation from what is stated:")
        lines += [f"  {one.text}" for one in self.differences]
        return [*lines, f"What makes the difference: discsim diagnose {self.for_diagnosis(out)} --out diagnosis"]

    def for_diagnosis(self, out: Path) -> Path:
        """Return the folder of the recording that can be diagnosed: its own where it states a command."""
        own = self.real.recording.path
        return own if own is not None and self.real.recording.command is not None else out / "recording"

    def write(self, out: Path) -> None:
        """Write comparison.md, and into recording/ the run with its log as the command where it states none."""
        if self.real.recording.command is None:
            command = lines_through(self.real.profile)
            write_recording(replace(self.real.recording, command=command), out / "recording")
        write_text(out / "comparison.md", "\n".join(self._page(out)))

    def _page(self, out: Path) -> list[str]:
        rows = []
        for one in self.measured.methods:
            other = {score.method: score for score in self.emulated.methods}.get(one.method)
            pairs = [
                (f"{100 * x.known:.0f} %", f"{np.degrees(x.bias):+.2f}", f"{np.degrees(x.rms):.2f}", _ms(x.delay))
                if x is not None
                else ("", "", "", "")
                for x in (one, other)
            ]
            rows.append(f"| {one.method} | " + " | ".join(f"{a} | {b}" for a, b in zip(*pairs, strict=True)) + " |")
        return [
            f"# {literal(self.real.recording.name) or 'The run'}, measured and emulated",
            "",
            "Errors of the spin rate in deg/s against the rate reference (measured) and truth (emulated), delay in ms.",
            "",
            "| method | known | emulated | bias | emulated | rms | emulated | delay | emulated |",
            "|---|---|---|---|---|---|---|---|---|",
            *rows,
            "",
            *map(literal, self.sentences(out)),
            "",
        ]


def _ms(delay: float) -> str:
    return "" if np.isnan(delay) else f"{1000 * delay:.1f}"


def compare(real: MeasuredRun, run: RateTableRun, method: str, tolerance_deg_s: float) -> Comparison:
    """Score a measured run as its emulation is scored, by the paper's methods or by all, and tell where they differ."""
    rates = papers_rates(real.recording, fixed_axis=run.bench.table.second is None)
    if method == "all":
        found, _ = all_methods(real.recording)
        rates |= {rate.method: rate for rate in found if rate.method not in (*rates, "rate_reference")}
    measured = score_rates(rates, real.truth, real.span)
    emulated = score_rates({name: run.rates[name] for name in rates if name in run.rates}, run.truth, run.span)
    spans = plateaus(real.profile, np.radians(tolerance_deg_s))
    return Comparison(
        real,
        run,
        rates,
        measured,
        emulated,
        plateau_rows(rates, real.truth, spans),
        differences(measured, emulated, rates),
    )


def differences(measured: TableScores, emulated: TableScores, rates: Mapping[str, YawRate]) -> tuple[Difference, ...]:
    """Return the bands in which biases differ by more than their scatter makes them."""
    others = {(band.method, band.low): band for band in emulated.bands}
    found = []
    for band in measured.bands:
        other = others.get((band.method, band.low))
        if other is None or not (np.isfinite(band.bias) and np.isfinite(other.bias)):
            continue
        interval = float(np.median(np.diff(rates[band.method].t)))
        sd = np.hypot(_of_mean(band, interval), _of_mean(other, interval))
        off = abs(band.bias - other.bias)
        if off > max(_SIGMAS * sd, _LEAST):
            found.append(Difference(band, other, float(off / sd) if sd > 0 else np.inf))
    return tuple(found)


def _of_mean(band: Band, interval: float) -> float:
    """Return the standard deviation of a band's mean error, of which those `_APART` are taken for independent."""
    independent = max(1.0, band.known * band.count * interval / _APART)
    return float(np.sqrt(max(band.rms**2 - band.bias**2, 0.0) / independent))


def lines_through(log: Samples) -> Samples:
    """Return knots of a log (t (n,) s, rate (n,) rad/s) whose lines leave no more than its scatter.

    The longest lines that stay within `_WITHIN` standard deviations (of differences of neighbouring readings, over
    sqrt(2)) of every reading between their ends, halved at the worst one (Ramer, Douglas and Peucker).
    """
    t, rate = log.t, log.value
    scatter = 1.4826 * float(np.median(np.abs(np.diff(rate, 2)))) / np.sqrt(6.0) if rate.size > 2 else 0.0
    kept = {0, rate.size - 1}
    parts = [(0, rate.size - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        inside = slice(first + 1, last)
        line = np.interp(t[inside], t[[first, last]], rate[[first, last]])
        off = np.abs(rate[inside] - line)
        worst = int(np.argmax(off))
        if off[worst] > _WITHIN * scatter:
            middle = first + 1 + worst
            kept.add(middle)
            parts += [(first, middle), (middle, last)]
    places = sorted(kept)
    return Samples(t[places], rate[places])


def draw_comparison(found: Comparison, path: Path) -> None:
    """Draw each method's error over the rate, measured and emulated, and the bias of each band on it."""
    methods = list(found.rates)
    figure, panels = new_figure(len(methods), 1, width=9.0, height=2.6 * len(methods), squeeze=False, sharex=True)
    for axes, method in zip(panels[:, 0], methods, strict=True):
        for rate, truth, span, shade, label in (
            (found.run.rates.get(method), found.run.truth, found.run.span, "0.7", "emulated"),
            (found.rates[method], found.real.truth, found.real.span, colour(method, methods), "measured"),
        ):
            if rate is None:
                continue
            error, _ = errors_within(rate, truth, *span)
            size = np.abs(truth(rate.t[(rate.t >= span[0]) & (rate.t <= span[1])]))
            axes.plot(np.degrees(size), np.degrees(error), ".", ms=2, color=shade, label=label, rasterized=True)
        symmetric_log(axes, linear=10.0, limit=300.0)
        axes.axhline(0.0, color="black", lw=0.6)
        axes.set_title(method)
        axes.set_ylabel("error (deg/s)")
        axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5), markerscale=4)
    panels[-1, 0].set_xlabel("rate by the reference (deg/s)")
    save_figure(figure, path)
