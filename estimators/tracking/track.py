"""What a tracked recording is: settings of the smoother, rows of rates measured otherwise, and a track."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field as dataclass_field

import numpy as np

from discsim.arrays import FloatArray, IntArray
from discsim.errors import InputError
from discsim.estimators.precession import STRENGTH_SD

__all__ = ["RateRows", "Track", "TrackingSettings"]


@dataclass(frozen=True)
class TrackingSettings:
    """Settings of `tracking`; the priors are standard deviations.

    Attributes
    ----------
    knots : float
        Spacing of the spin rate's knots, s.
    step : float
        Spacing of the answers, s.
    segment, overlap : float
        A longer recording is cut into segments, s, that share ``overlap`` s with each neighbour: memory stays bounded.
    hard_iron, soft_iron : float
        uT, and relative.
    gyroscope_bias, gyroscope_gain : float
        Of p and q: rad/s, and relative (scale and turning about z; lag shows as turning).
    strength : float
        Relative, of the field's strength.
    precession, precession_knots : float
        Where no gyroscope shows p and q: transverse rate in the frame that does not spin, rad/s (more at a slow spin,
        `precession.tipping`), and its knots, s.
    largest_sd : float
        Answers less certain than this, rad/s, are NaN.
    misfit : float
        Answers are NaN where the residual over half a second exceeds this many times the recording's own noise.
    window : float
        Of the likelihood windows that start the search, s.
    """

    knots: float = 0.1
    step: float = 0.05
    segment: float = 16.0
    overlap: float = 2.0
    hard_iron: float = 100.0
    soft_iron: float = 0.03
    gyroscope_bias: float = 0.2
    gyroscope_gain: float = 0.02
    strength: float = STRENGTH_SD
    precession: float = 0.15
    precession_knots: float = 0.4
    largest_sd: float = np.radians(60.0)
    misfit: float = 4.0
    window: float = 0.8

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InputError(f"tracking {name}: got {value}, expected a positive number")
        if self.segment < 2 * self.overlap:
            raise InputError(f"tracking segment: got {self.segment} s, expected at least twice the overlap")


@dataclass(frozen=True)
class RateRows:
    """Another sensor's say on the spin rate: readings ``value`` (n,) = r-dependent model, with unknown calibration.

    ``kind`` is "linear" for ``(1 + a) r + b`` (a gyroscope) and "centripetal" for complex ``(-r^2 + i r') d + b``
    (an accelerometer averaged over turns). ``calibration`` is the prior mean, ``prior`` its standard deviations.
    """

    kind: str
    t: FloatArray
    value: FloatArray
    sd: FloatArray
    calibration: FloatArray
    prior: FloatArray


@dataclass(frozen=True)
class Track:
    """One segment's answer.

    ``t`` (n,) s, ``rate`` and ``sd`` (n,) rad/s; ``blur`` (n,) the share of sd that the knots' spacing makes at a
    corner; ``start`` and ``stop`` of the magnetometer's readings, s, and of their residual about each t the mean square
    per axis ``left`` (n,) with the number of readings ``count`` (n,), and ``usual`` that of most readings, uT^2;
    ``noise`` per axis, uT; ``hard_iron`` (3,) uT; ``field`` (3,) uT at the start; ``calibration`` of other sensors;
    ``chi2`` of their rows per degree of freedom; ``roughness`` the spectral density of r'' found. Where a
    fit of the same readings with more rows goes on from: ``point`` all unknowns, ``weights`` of the readings, ``local``
    of the roughness.
    """

    t: FloatArray
    rate: FloatArray
    sd: FloatArray
    blur: FloatArray
    start: float
    stop: float
    left: FloatArray
    count: IntArray
    usual: float
    noise: float
    hard_iron: FloatArray
    field: FloatArray
    roughness: float
    calibration: list[FloatArray] = dataclass_field(default_factory=list)
    calibration_sd: list[FloatArray] = dataclass_field(default_factory=list)
    chi2: list[float] = dataclass_field(default_factory=list)
    gyroscope_gain: complex = 0j
    point: FloatArray = dataclass_field(default_factory=lambda: np.zeros(0))
    weights: FloatArray = dataclass_field(default_factory=lambda: np.zeros(0))
    local: FloatArray = dataclass_field(default_factory=lambda: np.zeros(0))
