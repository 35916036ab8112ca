"""`YawRate`: what every spin-rate estimator gives, so that comparing two is one line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from discsim.arrays import FloatArray, readonly, require_array
from discsim.errors import InputError
from discsim.result import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Median", "YawRate"]


class Median(NamedTuple):
    """The median of rates, rad/s, and of their standard deviations; ``beyond`` where it is more than that in size."""

    rate: float
    sd: float
    beyond: bool


@dataclass(frozen=True)
class YawRate(Result):
    """Spin rate over time.

    Attributes
    ----------
    method : str
        Name of the estimator.
    t : (n,) array
        Centre of the data used for each value, s, ascending.
    rate, sd : (n,) array
        Rate about +z_B and its one-sigma uncertainty, rad/s; NaN (both) where the data cannot tell.
    signed : bool
        False where the method cannot tell the direction of spin and gives the magnitude.
    precession_sd : (n,) array or None
        The part of ``sd`` that an unseen precession of the axis makes, rad/s, where a method tells it apart. It does
        not average out: it may keep its sign for a whole flight.
    lower, upper : (n,) array or None
        Worst-case bounds, rad/s, where the method has them (Eq. 11).
    beyond : (n,) array or None
        Where the sensor clipped, the limit that the rate is beyond, rad/s, with its sign; NaN elsewhere.
    """

    method: str
    t: FloatArray
    rate: FloatArray
    sd: FloatArray
    signed: bool = False
    precession_sd: FloatArray | None = None
    lower: FloatArray | None = None
    upper: FloatArray | None = None
    beyond: FloatArray | None = None

    _dimension: ClassVar[str] = "time_s"

    def __post_init__(self) -> None:
        for name in ("t", "rate", "sd", "precession_sd", "lower", "upper", "beyond"):
            value = getattr(self, name)
            if value is None:
                continue
            size = np.size(self.t)
            expected = "(n,) s" if name == "t" else f"({size},) rad/s, as many as t"
            array = readonly(require_array(value, f"{self.method}: {name}", expected, (size,)))
            object.__setattr__(self, name, array)
        if np.any(np.isfinite(self.rate) != np.isfinite(self.sd)):
            raise InputError(f"{self.method}: rate and sd must be known (or NaN) together")

    def __len__(self) -> int:
        return int(self.t.size)

    def __repr__(self) -> str:
        return f"<YawRate {self.summary()}>"

    @property
    def median(self) -> Median:
        """The median of the known rates and of those that are beyond a limit (censored values); NaN where none is."""
        known = np.isfinite(self.rate)
        values, bounds = self.rate[known], np.empty(0)
        if self.beyond is not None:
            bounds = self.beyond[~known & np.isfinite(self.beyond)]
        if not values.size + bounds.size:
            return Median(float("nan"), float("nan"), False)
        middle = float(np.median(np.concatenate([values, bounds])))
        # more than half are beyond a limit of its sign: so is the median
        side = bounds[np.sign(bounds) == np.sign(middle)]
        censored = 2 * side.size > values.size + bounds.size
        sd = float("nan") if censored or not values.size else float(np.median(self.sd[known]))
        return Median(middle, sd, bool(censored))

    def summary(self) -> str:
        """Return one line: the method, how many values are known, the median rate and standard deviation."""
        known = np.isfinite(self.rate)
        if not known.any():
            return f"by {self.method}: none of {len(self)} values is known"
        found = self.median
        median, sd = np.degrees([found.rate, found.sd])
        if found.beyond:
            return f"by {self.method}: {known.sum()} of {len(self)} known, median beyond {median:.5g} deg/s, its limit"
        sign = "" if self.signed else "magnitude, "
        return f"by {self.method}: {sign}{known.sum()} of {len(self)} known, median {median:.5g} +- {sd:.2g} deg/s"

    def table(self) -> dict[str, FloatArray]:
        """Return time, rate and standard deviation, and the bounds where the method has them."""
        columns = {"time_s": self.t, "rate_rad_s": self.rate, "sd_rad_s": self.sd}
        bounds = {"lower_rad_s": self.lower, "upper_rad_s": self.upper, "precession_sd_rad_s": self.precession_sd}
        return columns | {name: values for name, values in bounds.items() if values is not None}

    def plot(self) -> Figure:
        """Return a figure of the rate, deg/s, with a band of one standard deviation."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.0, 3.5), layout="constrained")
        axes = figure.subplots()
        rate, sd = np.degrees(self.rate), np.degrees(self.sd)
        axes.fill_between(self.t, rate - sd, rate + sd, alpha=0.3, lw=0)
        axes.plot(self.t, rate, lw=1.0)
        axes.set(xlabel="time (s)", ylabel="spin rate (deg/s)", title=f"Spin rate by {self.method}")
        axes.grid(color="#dddddd", lw=0.6)
        return figure

    def at(self, t: FloatArray) -> FloatArray:
        """Return the rate at times t (m,), linear between neighbours; NaN outside and next to unknown values."""
        return np.interp(t, self.t, self.rate, left=np.nan, right=np.nan) if len(self) else np.full(np.shape(t), np.nan)
