"""Scores of spin rates against a truth, whatever the profile: over the whole run and by rate."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from discsim.arrays import FloatArray
from discsim.estimators.rate import YawRate
from discsim.files import write_text
from discsim.validation.scenarios.rate_table import errors_within

__all__ = ["BANDS_DEG_S", "Band", "MethodScore", "TableScores", "score_rates"]

#: edges of the rate bands, deg/s: below 250 the paper's method is silent, 2000 is the end of a usual gyroscope's range
BANDS_DEG_S = (0.0, 250.0, 500.0, 1000.0, 2000.0, 3000.0, 4000.0, 5000.0, 6000.0, 8000.0, np.inf)
#: delays are looked for between these, s, at this step; the paper's method is late by 0.64 s where it is not shifted
_LATEST, _LAG_STEP = 1.0, 2e-3
#: estimates that a delay is fitted to, at most: more of them tell no more
_FITTED = 4000
#: a delay is told where its standard deviation is below this, s: a thirtieth of the paper's 0.64 s
_TOLD = 0.02


@dataclass(frozen=True)
class MethodScore:
    """A method over a whole run: share known, bias, rms and largest error in rad/s, delay and its sd in s.

    The delay is by how much the estimate comes late, NaN where the rate changes too little to tell.
    """

    method: str
    known: float
    bias: float
    rms: float
    worst: float
    delay: float
    delay_sd: float


@dataclass(frozen=True)
class Band:
    """Errors of a method, rad/s, at the times when the true rate's size lies from ``low`` to ``high``, rad/s."""

    method: str
    low: float
    high: float
    count: int
    known: float
    bias: float
    rms: float
    worst: float


@dataclass(frozen=True)
class TableScores:
    """Whole-run scores and those by rate band of every method of a run."""

    methods: tuple[MethodScore, ...]
    bands: tuple[Band, ...]

    def __getitem__(self, method: str) -> MethodScore:
        """Return a method's score over the whole run; raises KeyError where there is none."""
        return {score.method: score for score in self.methods}[method]

    def write(self, folder: Path) -> None:
        """Write methods.csv and bands.csv into ``folder``, in deg/s."""
        head = "method,known_share,bias_deg_s,rms_deg_s,worst_deg_s,delay_s,delay_sd_s"
        rows = (
            (
                *(score.method, _cell(score.known), *_degrees(score.bias, score.rms, score.worst)),
                *(_cell(score.delay), _cell(score.delay_sd)),
            )
            for score in self.methods
        )
        _write(folder / "methods.csv", head, rows)
        head = "method,from_deg_s,to_deg_s,count,known_share,bias_deg_s,rms_deg_s,worst_deg_s"
        bands = (
            (
                *(band.method, *(f"{np.degrees(x):g}" for x in (band.low, band.high)), str(band.count)),
                *(_cell(band.known), *_degrees(band.bias, band.rms, band.worst)),
            )
            for band in self.bands
        )
        _write(folder / "bands.csv", head, bands)


def _cell(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.4g}"


def _degrees(*values: float) -> list[str]:
    return [_cell(float(np.degrees(value))) for value in values]


def _write(path: Path, head: str, rows: Iterable[Sequence[str]]) -> None:
    write_text(path, "\n".join([head, *(",".join(row) for row in rows), ""]))


def score_rates(
    rates: Mapping[str, YawRate], truth: Callable[[FloatArray], FloatArray], span: tuple[float, float]
) -> TableScores:
    """Return the scores of each method against a truth, the rate (n,) rad/s at times (n,) s within ``span`` s."""
    methods, bands = [], []
    for method, rate in rates.items():
        error, known = errors_within(rate, truth, *span)
        delay, sd = delay_of(rate, truth, span)
        share = float(known.mean()) if known.size else 0.0
        methods.append(MethodScore(method, share, *_figures(error[known]), delay, sd))
        size = np.abs(truth(rate.t[(rate.t >= span[0]) & (rate.t <= span[1])]))
        for low, high in pairwise(np.radians(BANDS_DEG_S).tolist()):
            inside = (size >= low) & (size < high)
            if inside.any():
                told = inside & known
                share = float(told.sum() / inside.sum())
                bands.append(Band(method, low, high, int(inside.sum()), share, *_figures(error[told])))
    return TableScores(tuple(methods), tuple(bands))


def _figures(error: FloatArray) -> tuple[float, float, float]:
    """Return mean, rms and largest size of errors (n,); NaN where there are none."""
    if not error.size:
        return (float("nan"),) * 3
    return float(error.mean()), float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())


def delay_of(
    rate: YawRate, truth: Callable[[FloatArray], FloatArray], span: tuple[float, float]
) -> tuple[float, float]:
    """Return by how much an estimate comes late, s, and its standard deviation; NaN both where that cannot be told.

    The delay at which truth, moved by it and by a constant, leaves the least squares; beyond its ends the truth stays.
    The deviation takes neighbouring errors for correlated as they are found to be.
    """
    unknown = float("nan"), float("nan")
    chosen = np.isfinite(rate.rate) & (rate.t >= span[0]) & (rate.t <= span[1])
    if chosen.sum() < 8:
        return unknown
    places = np.flatnonzero(chosen)
    places = places[:: max(1, places.size // _FITTED)]
    t, seen = rate.t[places], rate.rate[places]

    def left(delay: float) -> FloatArray:
        true = truth(np.clip(t - delay, *span))
        gap = seen - (true if rate.signed else np.abs(true))
        return np.asarray(gap - gap.mean())

    coarse = np.arange(-_LATEST, _LATEST + 0.5 * 10 * _LAG_STEP, 10 * _LAG_STEP)
    best = coarse[int(np.argmin([np.sum(left(delay) ** 2) for delay in coarse]))]
    fine = best + np.arange(-10, 11) * _LAG_STEP
    squares = np.array([np.sum(left(delay) ** 2) for delay in fine])
    k = int(np.argmin(squares))
    if k in (0, fine.size - 1):
        return unknown
    below, here, above = squares[k - 1 : k + 2]
    curvature = (below - 2 * here + above) / _LAG_STEP**2
    if not curvature > 0.0:
        return unknown
    delay = fine[k] + 0.5 * (below - above) / (below - 2 * here + above) * _LAG_STEP
    gap = left(float(delay))
    alike = float(np.clip(np.sum(gap[1:] * gap[:-1]) / max(np.sum(gap**2), 1e-300), 0.0, 0.99))
    # least squares: variance of the parameter is twice that of the errors over the curvature of their sum of squares
    sd = float(np.sqrt(2.0 * np.mean(gap**2) / curvature * (1 + alike) / (1 - alike)))
    return (float(delay), sd) if sd < _TOLD else unknown
