"""Shares of variance: how much of the error's scatter comes from which error of the mount (Sobol' indices)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from scipy.stats import sobol_indices

from discsim.arrays import FloatArray
from discsim.files import write_text
from discsim.validation.reporting.figures import new_figure, save_figure
from discsim.validation.sweeps.cases import cases_of, csv_text, described
from discsim.validation.sweeps.chunks import Sweep
from discsim.validation.sweeps.mounts import MOUNT_FIELDS

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Share", "draw_shares", "shares_of", "write_shares"]

#: what is left of the scatter beside the mount: the part's own errors, and noise
MODULE = "module"
#: fewest mounts of a block that tell a share, of those that the sensor could be read in
_FEWEST = 16
#: resamples of the interval of a share: 2 % of its width
_RESAMPLES = 200


class Share(NamedTuple):
    """Share of a case's variance by one input: alone, and with all of its interactions, and the latter's 95 %."""

    place: dict[str, Any]
    estimator: str
    rate_deg_s: float
    source: str
    first: float
    total: float
    low: float
    high: float


def shares_of(scores: xr.Dataset, sweep: Sweep) -> list[Share]:
    """Return the shares of variance of the relative error, for each case, estimator and segment of a saltelli design.

    First order and total indices by `scipy.stats.sobol_indices`; those below zero are scatter about zero. Mounts in
    which the rate is not known are left out, with their partners in the other blocks.
    """
    design = sweep.plan.mounts
    if design.design != "saltelli":
        return []
    sources = [*(MOUNT_FIELDS[k] for k in design.varied), MODULE]
    shares = []
    for case in cases_of(scores):
        for name in scores.estimator.values:
            if sweep.plan.scored(str(name)).size < design.count:
                continue
            one = scores.sel(estimator=name).isel(case.at)
            for segment in range(scores.sizes["segment"]):
                rate = float(one.rate_deg_s.isel(segment=segment))
                error = one.bias_deg_s.isel(segment=segment).values / rate
                told = _indices(error.reshape(-1, design.base))
                if told is not None:
                    shares += [
                        Share(case.place, str(name), rate, source, *(float(x) for x in row))
                        for source, row in zip(sources, told, strict=True)
                    ]
    return shares


def _indices(blocks: FloatArray) -> FloatArray | None:
    """Return first order, total, and the interval of total (inputs, 4) from blocks (inputs + 2, n); None: too few."""
    known = np.isfinite(blocks).all(axis=0)
    # Sobol' points are even in powers of two: as many as there are
    size = 1 << (int(known.sum()).bit_length() - 1) if known.any() else 0
    if size < _FEWEST:
        return None
    values = blocks[:, np.flatnonzero(known)[:size]]
    if not values.std() > 0.0:
        return None
    parts: Any = {"f_A": values[:1], "f_B": values[1:2], "f_AB": values[2:, None, :]}
    found = sobol_indices(func=parts, n=size, rng=np.random.default_rng(0))
    pick = np.random.default_rng(0).integers(0, size, (_RESAMPLES, size))
    again = 0.5 * np.mean((values[0] - values[2:])[:, pick] ** 2, axis=-1) / np.var(values[:2, pick], axis=(0, -1))
    low, high = np.quantile(again, (0.025, 0.975), axis=1)
    return np.stack([np.reshape(found.first_order, -1), np.reshape(found.total_order, -1), low, high], axis=1)


def write_shares(path: Path, shares: list[Share]) -> None:
    """Write the shares as CSV: a row for each case, estimator, rate and source."""
    names = list(shares[0].place)
    lines = [[*names, "estimator", "rate_deg_s", "source", "first_order", "total_order", "total_low", "total_high"]]
    for share in shares:
        figures = (share.first, share.total, share.low, share.high)
        cells = [*map(str, share.place.values()), share.estimator, f"{share.rate_deg_s:.6g}", share.source]
        lines.append([*cells, *(f"{x:.4f}" for x in figures)])
    write_text(path, csv_text(lines))


def draw_shares(shares: list[Share], path: Path) -> None:
    """Draw, per estimator, the total share of each source as bars, a group for each case, at its fastest known rate."""
    estimators = list(dict.fromkeys(share.estimator for share in shares))
    sources = list(dict.fromkeys(share.source for share in shares))
    figure, panels = new_figure(len(estimators), 1, width=10.0, height=3.4 * len(estimators), squeeze=False)
    shade = colormaps["tab10"]
    for axes, estimator in zip(panels[:, 0], estimators, strict=True):
        fastest: dict[str, float] = {}
        for share in shares:
            if share.estimator == estimator:
                case = described(share.place)
                fastest[case] = max(fastest.get(case, 0.0), share.rate_deg_s)
        chosen = {
            (described(share.place), share.source): share
            for share in shares
            if share.estimator == estimator and share.rate_deg_s == fastest[described(share.place)]
        }
        places = np.arange(len(fastest))
        width = 0.85 / len(sources)
        for k, source in enumerate(sources):
            rows = [chosen[case, source] for case in fastest]
            total = np.array([row.total for row in rows])
            span = np.array([[row.total - row.low, row.high - row.total] for row in rows]).T
            at = places + (k - (len(sources) - 1) / 2) * width
            axes.bar(at, total, width, yerr=np.maximum(span, 0.0), color=shade(k), label=source, error_kw={"lw": 0.7})
        labels = [f"{case}\n{rate:.0f} deg/s" for case, rate in fastest.items()]
        axes.set_xticks(places, labels, fontsize=8)
        axes.set_ylabel("share of the variance")
        axes.set_title(f"{estimator}: which error of the mount makes its error (total shares, 95 %)")
        axes.legend(fontsize=8, ncols=len(sources), loc="upper center", bbox_to_anchor=(0.5, -0.16))
    save_figure(figure, path)
