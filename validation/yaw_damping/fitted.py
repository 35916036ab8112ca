"""`fit_recordings` and what it gives: C_Nr of recordings with its standard deviation, its summary and its files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from discsim.errors import InputError, require_type
from discsim.estimators.methods import METHODS
from discsim.files import write_text
from discsim.model_file import Model, write_model
from discsim.recording import Recording
from discsim.result import Result
from discsim.threads import one_thread
from discsim.validation.checking.doubts import mended_flights
from discsim.validation.reporting.run import json_text
from discsim.validation.running.given import Given, given_recordings
from discsim.validation.running.progress import Progress, silent
from discsim.validation.yaw_damping.compared import SOURCES, Compared, Source, compare_sources
from discsim.validation.yaw_damping.figures import draw_fit, draw_sources, draw_surface
from discsim.validation.yaw_damping.model import fitted_model, tabulated_model
from discsim.validation.yaw_damping.observations import Throw, need_flight, observe
from discsim.validation.yaw_damping.output_error import Fit, fit_yaw_damping
from discsim.validation.yaw_damping.page import write_fit_page
from discsim.validation.yaw_damping.paper_table import PaperTable, paper_table, table_csv

__all__ = ["FittedYawDamping", "check_method", "cnr_json", "fit_recordings", "notes"]

#: findings about numbers that no fit uses: C_Nr is free whatever is stated
_NOT_USED = ("disc.CNr",)


@dataclass(frozen=True, repr=False)
class FittedYawDamping(Result):
    """C_Nr fitted to throws.

    Attributes
    ----------
    recordings : tuple of Recording
        The throws, all of one disc, with setup faults mended.
    throws : tuple of Throw
        What of each the fit used.
    fit : Fit
        By output error: C_Nr, its standard deviation, the model flights and what they leave.
    paper : PaperTable
        The paper's table over spin rate and airspeed.
    sources : tuple of Compared
        The same by each source of spin, the chosen one first.
    doubts : tuple of str
        What is doubtful before anything is fitted: faults of the setup, stated numbers that cannot be.
    """

    recordings: tuple[Recording, ...]
    throws: tuple[Throw, ...]
    fit: Fit
    paper: PaperTable
    sources: tuple[Compared, ...]
    doubts: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<FittedYawDamping: {self.headline}>"

    @property
    def CNr(self) -> float:
        """The yaw damping derivative."""
        return self.fit.CNr

    @property
    def sd(self) -> float:
        """Its standard deviation."""
        return self.fit.sd

    @property
    def headline(self) -> str:
        """C_Nr in one line."""
        fit = self.fit
        return f"CNr = {fit.CNr:.6f} +- {fit.sd:.6f} ({len(fit.throws)} throws, spin by {fit.method})"

    @property
    def notes(self) -> list[str]:
        """What is doubtful, and where the residuals contradict what the recordings state, a line each."""
        return [*self.doubts, *notes(self.fit)]

    @property
    def model(self) -> Model:
        """The disc and its surroundings with the fitted C_Nr."""
        return fitted_model(self.recordings[0], self.fit)

    def summary(self) -> str:
        """Return C_Nr, what each source of spin makes of it, and the notes: a line each."""
        lines = [self.headline]
        for item in self.sources[1:]:
            found = item.reason if item.fit is None else f"CNr = {item.fit.CNr:.6f} +- {item.fit.sd:.6f}"
            lines.append(f"spin by {item.source.label}: {found}")
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def table(self) -> dict[str, list[Any]]:
        """Return a row for each source of spin: source, C_Nr and its standard deviation (NaN where it gives none)."""
        fits = [item.fit for item in self.sources]
        return {
            "source": [item.source.label for item in self.sources],
            "CNr": [float("nan") if fit is None else fit.CNr for fit in fits],
            "sd": [float("nan") if fit is None else fit.sd for fit in fits],
        }

    def plot(self) -> Figure:
        """Return the figure of fit.png: the spin of each throw beside the model flight, and what is left."""
        return draw_fit(self.throws, self.fit, self.paper)

    def to_json(self) -> dict[str, Any]:
        """Return the content of cnr.json."""
        return {**cnr_json(self.fit, self.sources), "notes": self.notes}

    def report(self, folder: Path | str) -> Path:
        """Write cnr.json, cnr_table.csv, models, figures and report.html; return the path of the first."""
        out = Path(folder)
        write_text(out / "cnr.json", json_text(self.to_json()))
        write_text(out / "cnr_table.csv", table_csv(self.paper))
        write_model(self.model, out / "model.toml")
        write_model(tabulated_model(self.recordings[0], self.paper), out / "model-table.toml")
        draw_fit(self.throws, self.fit, self.paper, out / "fit.png")
        draw_surface(self.paper, self.fit, out / "surface.png")
        draw_sources(self.sources, out / "sources.png")
        write_fit_page(out, self.fit, self.paper, self.sources, notes(self.fit), self.doubts)
        return out / "cnr.json"


def check_method(method: str) -> None:
    """Raise `InputError` for a method that there is not."""
    require_type(method, str, "method", f"the name of a method: best, {', '.join(METHODS)}")
    if method != "best" and method not in METHODS:
        raise InputError(f"--method {method}: unknown; expected one of best, {', '.join(METHODS)}")


@one_thread
def fit_recordings(
    recordings: Given,
    method: str = "best",
    *,
    compare: bool = False,
    progress: Progress = silent,
    say: Callable[[str], None] = lambda text: None,
) -> FittedYawDamping:
    """Fit the yaw damping derivative C_Nr to throws of one disc, by output error of the whole model flight.

    ``recordings`` are flights with what tells the spin, and a track or GPS: recordings, a folder, or a sequence of
    either. ``method`` of `discsim.estimators.estimate` gives the spin; with ``compare`` C_Nr is fitted by the paper's
    sources, too. Setup faults (an axis, a unit, an offset in time) are mended first, and noted. Raises `InputError` for
    an unknown method, throws of several discs, or nothing that tells the release.
    """
    check_method(method)
    given = given_recordings(recordings)
    for one in given:
        need_flight(one)
    data, doubts = mended_flights(given, done="fitted", passed=_NOT_USED)
    throws = list(progress((observe(one, method) for one in data), len(data), "spin rate of throw"))
    say("fitting model flights")
    fit, paper = fit_yaw_damping(throws), paper_table(throws)
    found = [Compared(Source(method), fit, paper)]
    if compare:
        others = [source for source in SOURCES if source != found[0].source]
        found += progress(compare_sources(data, fit, others), len(others), "other source")
    return FittedYawDamping(data, tuple(throws), fit, paper, tuple(found), doubts)


def cnr_json(fit: Fit, found: Sequence[Compared]) -> dict[str, Any]:
    """Return the content of cnr.json."""
    return {
        "CNr": {"value": fit.CNr, "sd": fit.sd},
        "method": f"output error, spin by {fit.method}",
        "recordings": [throw.name for throw in fit.throws],
        "refined": {name: {"value": value, "sd": sd} for name, (value, sd) in fit.others.items()},
        "covariance": {"names": ["CNr", *fit.others], "matrix": fit.covariance},
        "residuals": {
            "spin_over_stated": fit.spin_scale,
            "path_over_stated": fit.path_scale,
            "spin_whiteness_p": fit.spin_whiteness.p,
            "path_whiteness_p": fit.path_whiteness.p,
        },
        "by_equation_26": fit.by_26,
        "sources": [
            {"source": item.source.label, "CNr": None, "reason": item.reason}
            if item.fit is None
            else {
                "source": item.source.label,
                "CNr": {"value": item.fit.CNr, "sd": item.fit.sd},
                "by_equation_26": item.fit.by_26,
                "spin_over_stated": item.fit.spin_scale,
            }
            for item in found
        ],
        "notes": notes(fit),
    }


def notes(fit: Fit) -> list[str]:
    """Say where the residuals contradict what the recordings state, and where these do not tell C_Nr."""
    found = []
    for what, scale, white in (
        ("spin", fit.spin_scale, fit.spin_whiteness.p),
        ("path", fit.path_scale, fit.path_whiteness.p),
    ):
        if scale > 1.5:
            found.append(f"the {what} is {scale:.1f} times as far from the model as stated; the sd is raised by that")
        if white < 0.001:
            found.append(f"residuals of the {what} are not white (Ljung and Box: p = {white:.1g})")
    if found:
        found.append("the model lacks something, wind perhaps: CNr may be off by more than its sd says")
    if abs(fit.CNr) < 2.0 * fit.sd:  # 95 % of a Gaussian lie within two standard deviations
        found.append(
            "CNr is within two standard deviations of zero: these recordings do not tell it; expected readings of the "
            "whole throw, or more throws"
        )
    return found
