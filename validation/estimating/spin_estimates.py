"""`estimate_spin` and what it gives: spin rates by several methods, what contradicts what, and the files of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from discsim.errors import InputError, require_type
from discsim.estimators.methods import BY_THE_FIELD, METHODS, Options, all_methods, best_of, estimate, folded
from discsim.estimators.notes import notes_on
from discsim.estimators.rate import YawRate
from discsim.estimators.usable import usable
from discsim.files import write_pieces, write_text
from discsim.recording import Recording
from discsim.result import Result
from discsim.threads import one_thread
from discsim.validation.checking.failed_readings import failed_findings, without_failed
from discsim.validation.checking.finding import doubts_of
from discsim.validation.checking.readings import reading_findings
from discsim.validation.checking.statements import statement_findings
from discsim.validation.diagnosis.late_stamps import with_even_rows
from discsim.validation.diagnosis.repeats import without_held_readings
from discsim.validation.diagnosis.setup import find_setup_faults, setup_notes
from discsim.validation.diagnosis.setup.reference import ReferenceDoubt, believed, reference_doubts
from discsim.validation.estimating.method_disagreement import Disagreement, disagreements
from discsim.validation.estimating.page import write_estimate_page
from discsim.validation.importing.guesses import guesses_of
from discsim.validation.reporting.figures import draw_differences, draw_rates, new_figure, save_figure
from discsim.validation.reporting.run import json_text
from discsim.validation.running.given import Given, given_recordings
from discsim.validation.running.progress import Progress, silent

__all__ = [
    "SpinEstimates",
    "all_notes",
    "draw_estimates",
    "estimate_all",
    "estimate_json",
    "estimate_spin",
    "figures_of",
    "rate_csv",
]

#: rows of rate.csv put into words at once: their text, a few MB, is all that is held of it
_ROWS = 50_000


@dataclass(frozen=True, repr=False)
class SpinEstimates(Result):
    """Spin rates of one recording.

    Attributes
    ----------
    recording : Recording
        What was estimated from, with setup faults mended.
    asked : str
        The method asked for: a name, ``best`` or ``all``.
    rates : tuple of YawRate
        What each method gives, the most preferred first.
    left_out : mapping
        Methods that give nothing, with the reason.
    disagreements : tuple of Disagreement
        Methods that contradict each other beyond their standard deviations.
    notes : tuple of str
        What a reader must know before believing the rates.
    """

    recording: Recording
    asked: str
    rates: tuple[YawRate, ...]
    left_out: Mapping[str, str]
    disagreements: tuple[Disagreement, ...]
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<SpinEstimates of '{self.recording.name}': {', '.join(rate.method for rate in self.rates)}>"

    def __getitem__(self, method: str) -> YawRate:
        """Return the rate by the method of that name; raises KeyError where it gave none."""
        return {rate.method: rate for rate in self.rates}[method]

    @property
    def remarks(self) -> list[str]:
        """What was left out, contradicts, or must be known: a line each."""
        lines = [f"left out: {method} ({reason})" for method, reason in self.left_out.items()]
        lines += [f"contradiction: {item.text}" for item in self.disagreements]
        return lines + [f"note: {note}" for note in self.notes]

    def summary(self) -> str:
        """Return a line for each method, and the remarks."""
        return "\n".join([*(rate.summary() for rate in self.rates), *self.remarks])

    def table(self) -> dict[str, Any]:
        """Return the rates of all methods in one long table, as rate.csv has them."""
        return {
            "time_s": np.concatenate([rate.t for rate in self.rates]),
            "method": np.repeat([rate.method for rate in self.rates], [len(rate) for rate in self.rates]),
            "rate_rad_s": np.concatenate([rate.rate for rate in self.rates]),
            "sd_rad_s": np.concatenate([rate.sd for rate in self.rates]),
        }

    def plot(self) -> Figure:
        """Return the figure of rate.png."""
        return draw_estimates(self.rates, self.recording.name)

    def report(self, folder: Path | str) -> Path:
        """Write rate.csv, estimate.json, rate.png and report.html into ``folder``; return the path of the first."""
        out = Path(folder)
        write_pieces(out / "rate.csv", rate_csv(self.rates))
        content = estimate_json(self.recording, self.asked, self.rates, self.left_out, self.disagreements, self.notes)
        write_text(out / "estimate.json", json_text(content))
        draw_estimates(self.rates, self.recording.name, out / "rate.png")
        contradictions = [item.text for item in self.disagreements]
        write_estimate_page(out, self.recording, self.rates, self.left_out, contradictions, self.notes)
        return out / "rate.csv"


@one_thread
def estimate_spin(
    recording: Given, method: str = "best", options: Options | None = None, *, progress: Progress = silent
) -> SpinEstimates:
    """Estimate the spin rate of one recording by a method, by the best that its sensors allow, or by all.

    Readings that failed (-1, 65535) are left out, setup faults (an axis, a unit, an offset in time) mended, and noted;
    `discsim.estimators.estimate` does without. A rate reference that the sensors beside it refute is passed over, but
    where it is asked for. What was written again with a faster sensor's rows counts once, and what was
    stamped early or late of even rows is taken at these.
    Raises `InputError` for an unknown method, more than one recording, or where nothing can be estimated.
    """
    require_type(method, str, "method", f"the name of one: best, all, {', '.join(METHODS)}")
    given = given_recordings(recording)
    if len(given) != 1:
        raise InputError(f"{len(given)} recordings; expected one (take them one after the other)")
    failed = doubts_of(failed_findings(given[0]))
    sound, repeats = without_held_readings(without_failed(given[0]))
    sound, stamps = with_even_rows(sound)
    setup = find_setup_faults([sound])
    data = setup.recordings[0]
    refuted = list(reference_doubts(data))
    doubts = [] if method == "rate_reference" else refuted
    taken = believed(data, doubts)
    rates, left_out = estimate_all(taken, method, Options.of(options), progress)
    left_out.update(("rate_reference", f"it {one.what}") for one in doubts if one.sure and one.about_reference)
    notes = [
        *guesses_of(given[0]),
        *(f"{one}; the estimates are of the rest" for one in failed),
        *repeats,
        *stamps,
        *setup_notes(setup, "the estimates are of"),
        *_errors(data, refuted),
        *all_notes(taken),
    ]
    if method in BY_THE_FIELD and (told := folded(usable(taken).recording, method)):
        notes.append(f"{method}: {told}")
    return SpinEstimates(data, method, tuple(rates), left_out, tuple(disagreements(rates)), tuple(notes))


def _errors(recording: Recording, doubts: Sequence[ReferenceDoubt]) -> list[str]:
    """Return what `discsim check` calls an error in what is stated of a sensor, or in its readings."""
    found = [*statement_findings(recording), *reading_findings(recording, doubts)]
    sensors = {one for sensor in recording.samples for one in (sensor, f"[sensors.{sensor}]")}
    return [one.sentence for one in found if one.severity == "error" and one.where in sensors]


def draw_estimates(rates: Sequence[YawRate], name: str, path: Path | None = None) -> Figure:
    """Draw the rates, and below them their differences from the most preferred method that knows the rate.

    Where a path is given the figure is written there.
    """
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
    return save_figure(figure, path)


def estimate_all(
    recording: Recording, name: str, options: Options, progress: Progress = silent
) -> tuple[list[YawRate], dict[str, str]]:
    """Return what the named method gives (of all for "all"), and with the reason those left out or passed over.

    Raises `InputError` for an unknown name, or where nothing can be estimated.
    """
    if name == "all":
        return all_methods(recording, options, each=lambda names: progress(names, len(METHODS), "method"))
    if name == "best":
        found, passed_over = best_of(recording, options)
        return [found], passed_over
    if name not in METHODS:
        raise InputError(f"--method {name}: unknown; expected one of best, all, {', '.join(METHODS)}")
    return [estimate(recording, name, options)], {}


def all_notes(recording: Recording) -> list[str]:
    """Return a line for all that a reader must know of a recording before believing an estimate from it."""
    sound = usable(recording)
    return [*sound.notes, *notes_on(sound.recording)]


def rate_csv(rates: Sequence[YawRate]) -> Iterator[str]:
    """Yield the text of rate.csv in pieces: method by method in time order, cells empty where a value is unknown."""
    yield "time_s,method,rate_rad_s,sd_rad_s\n"
    for rate in rates:
        known, unknown = f"%.9g,{rate.method},%.9g,%.4g\n", f"%.9g,{rate.method},,\n"
        for first in range(0, len(rate), _ROWS):
            part = slice(first, first + _ROWS)
            # a first time of -0.0 is zero
            rows = zip((rate.t[part] + 0.0).tolist(), rate.rate[part].tolist(), rate.sd[part].tolist(), strict=True)
            # row[1] != row[1]: NaN
            yield "".join([unknown % row[0] if row[1] != row[1] else known % row for row in rows])


def estimate_json(
    recording: Recording,
    asked: str,
    rates: Sequence[YawRate],
    left_out: Mapping[str, str],
    found: Sequence[Disagreement],
    notes: Sequence[str],
) -> dict[str, Any]:
    """Return the content of estimate.json."""
    return {
        "recording": recording.name,
        "asked": asked,
        "methods": {rate.method: figures_of(rate) for rate in rates},
        "left_out": dict(left_out),
        "disagreements": [{**asdict(item), "text": item.text} for item in found],
        "notes": list(notes),
    }


def figures_of(rate: YawRate) -> dict[str, Any]:
    """Return the entry of a method in estimate.json."""
    known = np.isfinite(rate.rate)
    median = rate.median
    part: dict[str, float | bool] = {"median_is_beyond": True} if median.beyond else {}
    if rate.precession_sd is not None and np.any(rate.precession_sd[known] > 0):
        part["median_precession_sd_rad_s"] = float(np.median(rate.precession_sd[known]))
    return {
        "count": len(rate),
        "share_unknown": float(1 - known.mean()) if len(rate) else float("nan"),
        "median_rate_rad_s": median.rate,
        "median_sd_rad_s": median.sd,
        **part,
        "signed": rate.signed,
    }
