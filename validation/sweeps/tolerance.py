"""The inverse question: how far off and how crooked a sensor may sit for its rate to stay below an error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from discsim.arrays import FloatArray
from discsim.files import write_text
from discsim.validation.reporting.figures import new_figure, save_figure
from discsim.validation.sweeps.cases import READ, cases_of, csv_text, described, named_table
from discsim.validation.sweeps.chunks import Sweep

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Tolerance", "draw_tolerances", "sentences_of", "tolerances_of", "write_tolerances"]

#: share of mounts within the tolerance that stay below the error
SHARE = 0.95
#: mounts by which a tolerance is tried: a quantile of 95 % is then known to 0.7 % of the mounts
_TRIED = 1024
#: halvings of a tolerance: to 0.1 % of the plan's range
_HALVINGS = 10
#: fewest mounts that a parabola is fitted to: twice its 28 terms
_FEWEST = 56


class Tolerance(NamedTuple):
    """What a case allows at a rate so that `SHARE` of all mounts stay below an error.

    ``place_m`` is the half-width of the offset along each axis, with angles as in the plan; ``place_straight_m`` with
    none; ``angle_rad`` the half-width of each angle, with the sensor where it is stated to sit. 0 where even a perfect
    mount errs by more; ``at_least`` where the plan's whole range does not. ``perfect`` is what a perfect mount stays
    below, a share of the rate.
    """

    place: dict[str, Any]
    estimator: str
    rate_deg_s: float
    perfect: float
    place_m: float
    place_straight_m: float
    angle_rad: float
    at_least: tuple[bool, bool, bool]


def tolerances_of(scores: xr.Dataset, sweep: Sweep, below: float) -> list[Tolerance]:
    """Return what each case allows at each rate for errors below a share of the rate.

    A parabola of the six errors of a mount is fitted to the square of the rate that was read over the true one, which
    is linear in the offset, (9). Mounts within a tolerance are then drawn, each with what the fit left of one of those
    swept: the errors of its part, and its noise. Rates that less than half of the mounts could be read at are left out.
    """
    found = []
    for case in cases_of(scores):
        for name in scores.estimator.values:
            one = scores.sel(estimator=name).isel(case.at)
            for segment in range(scores.sizes["segment"]):
                rate = float(one.rate_deg_s.isel(segment=segment))
                here = one.isel(segment=segment)
                if rate == 0.0:  # no error is a share of nothing
                    continue
                error = np.where(here.known.values >= READ, here.bias_deg_s.values / rate, np.nan)
                told = np.isfinite(error)
                scored = np.isfinite(here.known.values)
                if told.sum() < _FEWEST or told.sum() < READ * scored.sum():
                    continue
                surrogate = _Surrogate.fit(sweep, told, error)
                found.append(Tolerance(case.place, str(name), rate, *surrogate.answers(below)))
    return found


class _Surrogate(NamedTuple):
    """(rate read / true rate)^2 as a parabola of the mount in units of its half-widths, and what that leaves."""

    half_width: FloatArray
    middle: FloatArray
    weights: FloatArray
    left: FloatArray

    @classmethod
    def fit(cls, sweep: Sweep, told: Any, error: FloatArray) -> _Surrogate:
        """Fit the mounts that are ``told`` (mounts,) to their relative errors."""
        design = sweep.plan.mounts
        half, middle = (design.upper - design.lower) / 2, (design.upper + design.lower) / 2
        square = (1.0 + error[told]) ** 2
        terms = _terms(_scaled(sweep.mounts[told], middle, half))
        weights = np.linalg.lstsq(terms, square, rcond=None)[0]
        return cls(half, middle, weights, square - terms @ weights)

    def quantile(self, place: float, angle: float) -> float:
        """Return what `SHARE` of the mounts within these shares of the half-widths stay below, relative to the rate.

        Around a perfect mount, wherever the plan's range lies: beyond that range nothing is known.
        """
        width = np.array([place] * 3 + [angle] * 3) * self.half_width
        drawn = (2.0 * qmc.Sobol(7, seed=0).random(_TRIED) - 1.0) * np.append(width, 1.0)
        scaled = _scaled(drawn[:, :6], self.middle, self.half_width)
        pick = ((drawn[:, 6] + 1.0) / 2.0 * self.left.size).astype(int).clip(0, self.left.size - 1)
        square = _terms(scaled) @ self.weights + self.left[pick]
        return float(np.quantile(np.abs(np.sqrt(np.maximum(square, 0.0)) - 1.0), SHARE))

    def largest(self, below: float, place: bool, angle: float) -> tuple[float, bool]:
        """Return the largest share of the half-widths that stays below, and whether that is all of them.

        Of the offsets' with the angles at a share of theirs (``place``), or of the angles' with no offset.
        """

        def errs(share: float) -> float:
            return self.quantile(share, angle) if place else self.quantile(0.0, share)

        if errs(1.0) <= below:
            return 1.0, True
        low, high = 0.0, 1.0
        if errs(low) > below:
            return 0.0, False
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if errs(middle) <= below else (low, middle)
        return low, False

    def answers(self, below: float) -> tuple[float, float, float, float, tuple[bool, bool, bool]]:
        """Return the figures of a `Tolerance` behind its case."""
        with_angles, all_places = self.largest(below, True, 1.0)
        straight, whole = self.largest(below, True, 0.0)
        angle, all_angles = self.largest(below, False, 0.0)
        offset, turn = float(self.half_width[:3].max()), float(self.half_width[3:].max())
        ends = (with_angles * offset, straight * offset, angle * turn)
        return self.quantile(0.0, 0.0), *ends, (all_places, whole, all_angles)


def _scaled(mounts: FloatArray, middle: FloatArray, half: FloatArray) -> FloatArray:
    return np.divide(mounts - middle, half, out=np.zeros_like(mounts), where=half > 0)


def _terms(scaled: FloatArray) -> FloatArray:
    """Return the terms of a parabola of six variables (n, 6): constant, each, and the products of each two, (n, 28)."""
    first, second = np.triu_indices(scaled.shape[1])
    return np.column_stack([np.ones(scaled.shape[0]), scaled, scaled[:, first] * scaled[:, second]])


def write_tolerances(folder: Path, found: list[Tolerance], below: float) -> None:
    """Write tolerances.csv and tolerances.md into ``folder``."""
    names = list(found[0].place) if found else []
    head = [*names, "estimator", "rate_deg_s", "perfect_mount_percent", "place_mm", "place_straight_mm", "angle_deg"]
    rows = []
    for one in found:
        values = (1000 * one.place_m, 1000 * one.place_straight_m, float(np.degrees(one.angle_rad)))
        cells = [f"{'>=' if all_of else ''}{value:.3g}" for value, all_of in zip(values, one.at_least, strict=True)]
        rows.append(
            [*map(str, one.place.values()), one.estimator, f"{one.rate_deg_s:.6g}", f"{100 * one.perfect:.3g}", *cells]
        )
    write_text(folder / "tolerances.csv", csv_text([head, *rows]))
    what = f"Half-widths within which {100 * SHARE:g} % of mounts err by less than {100 * below:g} % of the rate."
    write_text(folder / "tolerances.md", f"{what}\n\n{named_table(head, rows)}\n")


def sentences_of(found: list[Tolerance], below: float) -> list[str]:
    """Return the answer in words: for each estimator and lowest rate the case that allows most from there on.

    The tolerance of a case is the least of those at its rates; a case that cannot be read at one of them has none.
    """
    lines: list[str] = []
    for name in dict.fromkeys(one.estimator for one in found):
        own = [one for one in found if one.estimator == name]
        rates = sorted({round(one.rate_deg_s) for one in own})
        answers: dict[str, str] = {}
        for lowest in rates:
            cases: dict[str, list[Tolerance]] = {}
            for one in own:
                if round(one.rate_deg_s) >= lowest:
                    cases.setdefault(described(one.place), []).append(one)
            wanted = sum(rate >= lowest for rate in rates)
            least = {
                case: min(rows, key=lambda row: row.place_m) for case, rows in cases.items() if len(rows) == wanted
            }
            best = max(least, key=lambda case: least[case].place_m, default=None)
            if best is not None and least[best].place_m > 0.0:
                more = "at least " if least[best].at_least[0] else ""
                where = f"{more}{1000 * least[best].place_m:.2g} mm along each axis with {best or 'what was swept'}"
                answers.setdefault(where, f"{name}, from {lowest} deg/s on: {where}")
        lines += answers.values() or [f"{name}: at no rate, however it sits"]
    return [f"To stay below {100 * below:g} % a sensor may sit off its place (angles as in the plan) by", *lines]


def draw_tolerances(found: list[Tolerance], below: float, path: Path) -> None:
    """Draw the tolerance of place over the radius, a line for each rate, a panel for each part; else over the rate."""
    parts = sorted({(one.estimator, str(one.place.get("parts", ""))) for one in found})
    rows, columns = -(-len(parts) // 2), min(2, len(parts))
    figure, panels = new_figure(rows, columns, width=5.2 * columns, height=3.6 * rows, squeeze=False, sharey="row")
    for axes in panels.ravel()[len(parts) :]:
        axes.set_visible(False)
    for axes, (estimator, part) in zip(panels.ravel(), parts, strict=False):
        own = [one for one in found if (one.estimator, str(one.place.get("parts", ""))) == (estimator, part)]
        over_radius = len({one.place.get("radius_m") for one in own}) > 1
        lines: dict[float, list[tuple[float, float, bool]]] = {}
        for one in own:
            x = 1000 * one.place["radius_m"] if over_radius else one.rate_deg_s
            key = round(one.rate_deg_s) if over_radius else 0.0
            lines.setdefault(key, []).append((x, 1000 * one.place_m, one.at_least[0]))
        for rate, points in sorted(lines.items()):
            x, y, whole = (np.array(column) for column in zip(*sorted(points), strict=True))
            (line,) = axes.plot(x, y, "o-", ms=4, lw=1.0, label=f"{rate:.0f} deg/s" if over_radius else None)
            axes.plot(x[whole], y[whole], "^", ms=7, color=line.get_color())
        axes.plot([], [], "^", color="0.4", label="all that was swept")
        axes.set_xlabel("stated radius (mm)" if over_radius else "rate (deg/s)")
        axes.set_title(f"{estimator}, {part}" if part else estimator)
        axes.legend(fontsize=8)
    what = f"offset along each axis that keeps {100 * SHARE:g} %\nof mounts below {100 * below:g} % (mm)"
    for axes in panels[:, 0]:
        axes.set_ylabel(what)
        axes.set_ylim(bottom=0.0)
    save_figure(figure, path)
