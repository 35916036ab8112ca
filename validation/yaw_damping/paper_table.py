"""C_Nr the paper's way, (24)-(28): one slope of r per throw, spread over a table of rate and speed.

What it assumes: r falls linearly, so that one slope serves every node; the node's r and V stand in (26) for those that
the disc had; and R sin(alpha), which also acts about z_B (23), is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RectBivariateSpline

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc, YawDampingTable
from discsim.errors import InputError
from discsim.validation.yaw_damping.observations import Throw

__all__ = ["RATES_DEG_S", "SPEEDS_M_S", "PaperTable", "Slope", "damping_by_26", "paper_table", "table_csv"]

#: nodes of (27): 51 rates and 35 speeds
RATES_DEG_S = readonly(4500.0 + 50.0 * np.arange(51))
SPEEDS_M_S = readonly(6.0 + 0.5 * np.arange(35))


@dataclass(frozen=True)
class Slope:
    """A straight line through the spin of one throw, Fig. 11a: |r| = start + slope t, in rad/s over t (2,) s."""

    name: str
    start: float
    slope: float
    t: FloatArray

    def at(self, t: FloatArray) -> FloatArray:
        """Return the line's rate (n,) rad/s at times t (n,) s."""
        return np.asarray(self.start + self.slope * t)

    @property
    def mean_rate(self) -> float:
        """Rate at the middle of the line, rad/s."""
        return float(self.at(self.t).mean())


@dataclass(frozen=True)
class PaperTable:
    """The averaged table (28), CNr (51, 35), and the lines that it is made of."""

    table: YawDampingTable
    slopes: tuple[Slope, ...]

    def at(self, rate: FloatArray, speed: FloatArray) -> FloatArray:
        """Return C_Nr at spin rates (n,) rad/s and airspeeds (n,) m/s by the 2-D spline; NaN outside the table."""
        rates, speeds = self.table.rate, self.table.speed
        rate, speed = np.abs(np.asarray(rate, dtype=np.float64)), np.asarray(speed, dtype=np.float64)
        inside = (rate >= rates[0]) & (rate <= rates[-1]) & (speed >= speeds[0]) & (speed <= speeds[-1])
        spline = RectBivariateSpline(rates, speeds, self.table.CNr)
        return np.where(inside, spline.ev(rate, speed), np.nan)


def damping_by_26(disc: Disc, density: float, r_dot: float, r: FloatArray | float, V: FloatArray | float) -> FloatArray:
    """C_Nr = 16 Izz rdot/(V r rho pi d^4), (26), of magnitudes r (rad/s) and rdot (rad/s^2); broadcasts r and V.

    It is N = Izz rdot with (24) in (25).
    """
    return np.asarray(16.0 * disc.Izz * r_dot / (V * r * density * np.pi * disc.diameter**4))


def paper_table(throws: Sequence[Throw]) -> PaperTable:
    """Fit a line to the spin of each throw, fill the table (27) with each slope, and average (28).

    The fit is unweighted, as the paper's. Raises `InputError` where the air's density is not stated.
    """
    rates, speeds = np.radians(RATES_DEG_S), SPEEDS_M_S
    slopes, matrices = [], []
    for throw in throws:
        density = throw.recording.environment.air_density
        if density is None:
            raise InputError(f"{throw.recording.name}: C_Nr needs air; expected air_density_kg_m3 in [environment]")
        slope, start = np.polyfit(throw.spin_t, np.abs(throw.spin), 1)
        slopes.append(Slope(throw.recording.name, float(start), float(slope), readonly(throw.spin_t[[0, -1]])))
        matrices.append(damping_by_26(throw.disc, density, float(slope), rates[:, None], speeds[None, :]))
    return PaperTable(YawDampingTable(rates, speeds, np.mean(matrices, axis=0)), tuple(slopes))


def table_csv(table: PaperTable) -> str:
    """Return the text of cnr_table.csv: rate_deg_s,speed_m_s,CNr, rate by rate."""
    lines = ["rate_deg_s,speed_m_s,CNr"]
    for rate, row in zip(RATES_DEG_S, table.table.CNr, strict=True):
        lines += [f"{rate:g},{speed:g},{value:.9g}" for speed, value in zip(SPEEDS_M_S, row, strict=True)]
    return "\n".join([*lines, ""])
