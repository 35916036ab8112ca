"""A sweep in numbers: a row for each case, estimator and rate, and what its errors become in C_Nr and a landing."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.files import write_text
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict
from discsim.validation.reporting.markdown import literal
from discsim.validation.scenarios.throws import rms

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "Carried",
    "Combination",
    "Landing",
    "Row",
    "carried_on",
    "cases_of",
    "csv_text",
    "described",
    "landing_of",
    "named_table",
    "rows_of",
    "write_rows",
]

#: a mount counts as read where this share of its estimates is known
READ = 0.5
#: changes of C_Nr and of the spin at release by which a flight's derivatives are taken
_STEP = 0.02


class Combination(NamedTuple):
    """One combination of a sweep's axes: their values, and their places in the arrays."""

    place: dict[str, Any]
    at: dict[str, int]


def cases_of(scores: xr.Dataset) -> Iterator[Combination]:
    """Yield the cases of a result, the last axis running fastest."""
    names = [str(name) for name in scores.bias_deg_s.dims if name not in ("estimator", "mount", "segment")]
    for index in product(*(range(scores.sizes[name]) for name in names)):
        place = {name: scores[name].values[k] for name, k in zip(names, index, strict=True)}
        yield Combination(place, dict(zip(names, index, strict=True)))


def described(place: dict[str, Any]) -> str:
    """Return a case in words: "16.1 mm, mpu9250"."""

    def words(name: str, value: Any) -> str:
        if name == "radius_m":
            return f"{1000 * value:g} mm"
        return str(value) if isinstance(value, str) else f"{name} {value:g}"

    return ", ".join(words(name, value) for name, value in place.items())


class Landing(NamedTuple):
    """How a throw's touch-down moves, (2,) m north and east, per relative change of C_Nr and of the release's spin."""

    by_CNr: FloatArray
    by_spin: FloatArray


def landing_of(disc_name: str = "driver", throw_name: str = "driver") -> Landing:
    """Return the derivatives of a shipped throw's touch-down, from flights with both changed by 2 % either way."""
    disc, environment = load_disc(disc_name)
    release = load_throw(throw_name)
    assert disc.aero is not None
    assert release.body_rate is not None

    def end(CNr: float, spin: float) -> FloatArray:
        assert disc.aero is not None
        assert release.body_rate is not None
        changed = replace(disc, aero=disc.aero._replace(CNr=CNr * disc.aero.CNr))
        thrown = replace(release, body_rate=readonly(np.array([1.0, 1.0, spin]) * release.body_rate))
        return np.asarray(predict(changed, environment, thrown).state[-1, :2])

    up, down = 1.0 + _STEP, 1.0 - _STEP
    return Landing((end(up, 1.0) - end(down, 1.0)) / (2 * _STEP), (end(1.0, up) - end(1.0, down)) / (2 * _STEP))


class Carried(NamedTuple):
    """What a mount's errors of the spin become: relative error of C_Nr, and shift of the touch-down, m; (mounts,)."""

    CNr: FloatArray
    landing: FloatArray


def carried_on(error: FloatArray, rate: FloatArray, landing: Landing) -> Carried:
    """Carry relative errors of the spin (mounts, rates) at rates (rates,) on to C_Nr and the touch-down.

    By (26) C_Nr is the slope of ln r over time. A rate that is read as (1 + e) r makes it
    1 + d ln(1 + e)/d ln r times as large: an error in proportion to the rate leaves it as it is, one that fades with
    the rate does not. The slope is fitted to all rates at which a mount is read; the spin at release has the error of
    the fastest of them. NaN where fewer than two are; a disc at rest counts for none, as it has no relative error.
    """
    slope, fastest = np.full(error.shape[0], np.nan), np.full(error.shape[0], np.nan)
    turning = rate != 0.0
    logarithm = np.log(np.abs(rate), where=turning, out=np.zeros(rate.shape))
    for mount, row in enumerate(error):
        known = np.isfinite(row) & (row > -1.0) & turning
        if known.sum() < 2:
            continue
        away = logarithm[known] - logarithm[known].mean()
        slope[mount] = np.sum(away * np.log1p(row[known])) / np.sum(away**2)
        fastest[mount] = row[np.flatnonzero(known)[np.argmax(np.abs(rate[known]))]]
    moved = slope[:, None] * landing.by_CNr + fastest[:, None] * landing.by_spin
    return Carried(slope, np.hypot(moved[:, 0], moved[:, 1]))


class Row(NamedTuple):
    """An estimator on one case: mounts scored and the share of them that is read, errors in per cent of the rate.

    ``mean``, ``rms`` and the size that 95 % of the mounts stay below are of the mounts' biases. ``rate_deg_s`` NaN
    stands for all rates; there ``CNr_percent`` and ``landing_m`` are the rms over the mounts of what `carried_on` says.
    """

    place: dict[str, Any]
    estimator: str
    rate_deg_s: float
    mounts: int
    read: float
    mean: float
    rms: float
    most: float
    CNr_percent: float = float("nan")
    landing_m: float = float("nan")


def rows_of(scores: xr.Dataset, landing: Landing | None) -> list[Row]:
    """Return the rows of a result: each estimator on each case and segment, and where two are read on all of them."""
    rows = []
    for case in cases_of(scores):
        for name in scores.estimator.values:
            one = scores.sel(estimator=name).isel(case.at)
            scored = np.isfinite(one.known.values).any(axis=one.known.get_axis_num("segment"))
            share = one.known.transpose("mount", "segment").values[scored]
            rate = one.rate_deg_s.values
            error = one.bias_deg_s.transpose("mount", "segment").values[scored] / np.where(rate == 0.0, np.nan, rate)
            error = np.where(share >= READ, error, np.nan)
            for k, each in enumerate(rate):
                if np.isfinite(each):
                    rows.append(Row(case.place, str(name), float(each), int(scored.sum()), *_figures(error[:, k])))
            if landing is not None and np.isfinite(rate).sum() > 1:
                carried = carried_on(error, rate, landing)
                whole = _figures(error.ravel())
                ends = (100 * rms(carried.CNr), rms(carried.landing))
                rows.append(Row(case.place, str(name), float("nan"), int(scored.sum()), *whole, *ends))
    return rows


def _figures(error: FloatArray) -> tuple[float, float, float, float]:
    known = error[np.isfinite(error)]
    read = known.size / error.size if error.size else 0.0
    if not known.size:
        return read, float("nan"), float("nan"), float("nan")
    return read, 100 * float(known.mean()), 100 * rms(known), 100 * float(np.quantile(np.abs(known), 0.95))


def write_rows(folder: Path, rows: list[Row]) -> None:
    """Write cases.csv and cases.md into ``folder``."""
    names = list(rows[0].place)
    head = [*names, "estimator", "rate_deg_s", "mounts", "read", "mean_percent", "rms_percent", "95_percent_below"]
    head += ["CNr_rms_percent", "landing_rms_m"]
    lines = []
    for row in rows:
        rate = "all" if np.isnan(row.rate_deg_s) else f"{row.rate_deg_s:.6g}"
        cells = [*map(str, row.place.values()), row.estimator, rate, str(row.mounts), f"{row.read:.3g}"]
        figures = (row.mean, row.rms, row.most, row.CNr_percent, row.landing_m)
        lines.append([*cells, *("" if np.isnan(x) else f"{x:.3g}" for x in figures)])
    write_text(folder / "cases.csv", csv_text([head, *lines]))
    write_text(folder / "cases.md", named_table(head, lines) + "\n")


def csv_text(lines: Iterable[Sequence[str]]) -> str:
    """Return lines of cells as CSV; a cell with a comma, a quote or an end of line in it stands in quotes."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(lines)
    return text.getvalue()


def named_table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown whose cells may hold names that somebody else gave."""
    cells = [[literal(cell) for cell in line] for line in lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *cells))
