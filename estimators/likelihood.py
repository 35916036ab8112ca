"""Spin rate from the magnetometer by maximum likelihood in a moving window: two axes as one complex signal.

In each window the field across the spin axis is a tone whose phase is a polynomial of time; hard iron and the
ellipse of soft iron are unknown along with it (`discsim.estimators.tone`). Two axes tell the direction of spin, have no
leakage from the negative frequency, and reach the Cramer-Rao bound. The field's phase does not turn at -r but at
``-r + m_z (p m_x + q m_y)/(m_x^2 + m_y^2)`` (docs/spin-phase.md): with a gyroscope the difference is removed, without
one its stated size is part of the standard deviation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import BoolArray, ComplexArray, FloatArray
from discsim.errors import InputError
from discsim.estimators.precession import AxialField, axial_field, tipping, transverse_gyroscope, transverse_rates
from discsim.estimators.rate import YawRate
from discsim.estimators.spin_spline import IndexArray
from discsim.estimators.window_fit import COLUMNS, search_windows, turn_windows
from discsim.recording import Recording, Samples, SensorSheet
from discsim.threads import side_by_side

__all__ = [
    "LEAST",
    "LikelihoodSettings",
    "ToneFit",
    "fit_windows",
    "likelihood",
    "likelihood_from_samples",
    "span_of",
    "usable_field",
]


#: Fewest readings that a spin rate is looked for in.
LEAST = 16


#: Residuals more correlated than this from sample to sample are no noise but motion that no polynomial follows.
LARGEST_CORRELATION = 0.3

#: Such a window is no answer where the residual is above this share of the amplitude; below it, what the rate wobbles
#: by within the window is in the standard deviation.
LARGEST_MISFIT = 0.05

#: Relative standard deviation of the correction by p and q: the gyroscope's gain (2 %), and soft iron (3 % on the field
#: along the axis, and the mean of two such across it).
CORRECTION_SD = 0.042


#: Windows that are fitted together: memory does not grow with the recording, and parts are fitted side by side.
TOGETHER = 1024

#: Windows before a part from which its search takes up the tone: each starts from that of the window before it.
BEFORE = 16


@dataclass(frozen=True)
class LikelihoodSettings:
    """Settings of `likelihood`.

    Attributes
    ----------
    window : float
        Length of a window, s; doubled, up to ``longest_window``, until it holds ``turns`` turns.
    step : float
        Spacing of the windows' centres, s.
    degree : int
        Of the polynomial of the rate in a window: 1 is a chirp, 2 adds curvature. An even degree and the next one
        know the rate at the centre equally well; 2 costs 2.5 times the standard deviation of 1, and removes a bias
        of r'' T^2/40: 0.6 deg/s in 1.28 s of an ordinary flight.
    longest_window, turns : float
        See ``window``; s and turns.
    ellipse_sd : float
        Prior standard deviation of each part of the relative ellipse of soft iron.
    precession_sd : float
        Transverse rate expected in flight where no gyroscope shows it, rad/s; more at a slow spin
        (`precession.tipping`).
    significance : float
        Least amplitude over its standard deviation; below it the answer is NaN.
    largest_sd : float
        A window whose standard deviation is above this, rad/s, is no answer: NaN.
    """

    window: float = 1.28
    step: float = 0.05
    degree: int = 2
    longest_window: float = 10.24
    turns: float = 1.5
    ellipse_sd: float = 0.05
    precession_sd: float = 0.1
    significance: float = 8.0
    largest_sd: float = np.radians(60.0)

    def __post_init__(self) -> None:
        for name in ("window", "step", "longest_window", "turns", "ellipse_sd", "significance", "largest_sd"):
            if not getattr(self, name) > 0:
                raise InputError(f"likelihood {name}: got {getattr(self, name)}, expected a positive number")
        if self.degree not in (0, 1, 2, 3):
            raise InputError(f"likelihood degree: got {self.degree}, expected 0 to 3")


@dataclass(frozen=True)
class ToneFit:
    """Windows fitted: arrays (n,), NaN where nothing could be told.

    ``t`` window centre, s; ``phase`` of the field at it, rad; ``phase_rate`` rad/s, and the sd of both; ``chirp``
    rad/s^2; ``amplitude`` and its unit; ``offset`` hard iron x + i y; ``noise`` residual per axis; ``length`` s;
    ``along`` mean of the transverse rate along the field, rad/s; ``correlation`` of neighbouring residuals, and the
    ``wobble`` of the phase rate that they show, rad/s rms.
    """

    t: FloatArray
    phase: FloatArray
    phase_sd: FloatArray
    phase_rate: FloatArray
    phase_rate_sd: FloatArray
    chirp: FloatArray
    amplitude: FloatArray
    axial: FloatArray
    offset: ComplexArray
    noise: FloatArray
    length: FloatArray
    along: FloatArray
    correlation: FloatArray
    wobble: FloatArray


def likelihood(recording: Recording, settings: LikelihoodSettings | None = None) -> YawRate:
    """Spin rate, signed, from a recording's magnetometer, with its gyroscope's p and q where it has one.

    Raises `InputError` if the recording has no magnetometer, or one of fewer than `LEAST` readings.
    """
    span_of(recording)
    return likelihood_from_samples(
        recording.need("magnetometer"),
        settings,
        sheet=recording.sheets.get("magnetometer"),
        gyroscope=transverse_gyroscope(recording),
        gyroscope_sheet=recording.sheets.get("gyroscope"),
        field=recording.environment.field_strength,
        fixed_axis=recording.plant in ("rate_table", "spin_down"),
    )


def likelihood_from_samples(
    magnetometer: Samples,
    settings: LikelihoodSettings | None = None,
    *,
    sheet: SensorSheet | None = None,
    gyroscope: Samples | None = None,
    gyroscope_sheet: SensorSheet | None = None,
    field: float | None = None,
    fixed_axis: bool = False,
) -> YawRate:
    """Spin rate over time, signed, rad/s.

    Parameters
    ----------
    magnetometer, gyroscope : Samples
        (n, 3) uT and (m, 3) rad/s in B; of the gyroscope only p and q are used.
    sheet, gyroscope_sheet : SensorSheet or None
        The magnetometer's, for its range, and the gyroscope's, for its noise.
    field : float or None
        Strength of the field, uT: it tells the hard iron along z, which the phase rate's correction needs.
    fixed_axis : bool
        True on a rig: no precession, so none is removed.
    """
    settings = settings or LikelihoodSettings()
    t, m = usable_field(magnetometer, sheet)
    centres = window_centres(t, settings)
    fits = fit_windows(t, m, centres, settings)
    rate, sd = -fits.phase_rate, fits.phase_rate_sd
    if not fixed_axis:
        axial = axial_field(fits.amplitude, fits.axial, field)
        if gyroscope is not None:
            fits = fit_windows(t, m, centres, settings, gyroscope=gyroscope, axial=axial, start=fits)
            cotangent = (fits.axial - axial.offset) / fits.amplitude
            slack = np.hypot(fits.along / fits.amplitude * axial.sd, fits.along * cotangent * CORRECTION_SD)
            if gyroscope_sheet is not None and gyroscope_sheet.noise_rms is not None:
                # white noise of p and q makes the phase a random walk, and a fitted slope sees 6/5 of its rate
                density = gyroscope_sheet.noise_rms**2 * gyroscope.interval
                walk = (1.2 if settings.degree < 2 else 2.5) * density * cotangent**2 / fits.length
                slack = np.sqrt(slack**2 + walk)
        else:
            unseen = tipping(settings.precession_sd, fits.phase_rate)
            slack = np.hypot(fits.axial - axial.offset, axial.sd) / fits.amplitude * unseen
        rate, sd = -fits.phase_rate, np.hypot(fits.phase_rate_sd, slack)
    moving = np.nan_to_num(fits.correlation, nan=1.0) > LARGEST_CORRELATION
    sd = np.where(moving, np.hypot(sd, fits.wobble), sd)
    known = np.isfinite(rate) & np.isfinite(sd) & (sd <= settings.largest_sd)
    known &= ~moving | (fits.noise <= LARGEST_MISFIT * fits.amplitude)
    return YawRate("likelihood", fits.t, np.where(known, rate, np.nan), np.where(known, sd, np.nan), signed=True)


def span_of(recording: Recording) -> tuple[float, float]:
    """Return the magnetometer's first and last time, s; raises `InputError` for fewer than `LEAST` readings."""
    magnetometer = recording.need("magnetometer")
    if len(magnetometer) < LEAST:
        where = recording.path or recording.name
        raise InputError(f"{where}: {len(magnetometer)} magnetometer readings; a spin rate needs at least {LEAST}")
    return float(magnetometer.t[0]), float(magnetometer.t[-1])


def usable_field(magnetometer: Samples, sheet: SensorSheet | None = None) -> tuple[FloatArray, FloatArray]:
    """Return times (n,) and field (n, 3) of the readings that are there and not clipped."""
    if magnetometer.value.ndim != 2 or magnetometer.value.shape[1] != 3:
        raise InputError(f"magnetometer: got values {magnetometer.value.shape}, expected (n, 3)")
    good: BoolArray = np.all(np.isfinite(magnetometer.value), axis=1)
    if sheet is not None:
        good &= ~np.any(sheet.clipped(magnetometer.value), axis=1)
    if np.all(good):
        return magnetometer.t, magnetometer.value
    return magnetometer.t[good], magnetometer.value[good]


def window_centres(t: FloatArray, settings: LikelihoodSettings) -> FloatArray:
    """Return the centres of the windows; a stretch of readings shorter than one window has its middle.

    A hole longer than the longest window parts two stretches: a clock that jumps by years leaves no windows between.
    """
    if t.size == 0:
        return np.zeros(0)
    interval = float(np.median(np.diff(t))) if t.size > 1 else 0.0
    holes = 1 + np.flatnonzero(np.diff(t) > max(settings.longest_window, settings.window))
    stretches = [(t[i], t[j - 1]) for i, j in zip([0, *holes], [*holes, t.size], strict=True)]
    return np.concatenate([_centres(float(start), float(stop), interval, settings) for start, stop in stretches])


def _centres(start: float, stop: float, interval: float, settings: LikelihoodSettings) -> FloatArray:
    if stop - start + interval <= settings.window * (1 + 1e-9):
        return np.array([0.5 * (start + stop)])
    inset = 0.5 * (settings.window - interval)
    # windows closer than the readings hold the same ones
    return np.asarray(np.arange(start + inset, stop - inset + 1e-9, max(settings.step, interval)))


def fit_windows(
    t: FloatArray,
    m: FloatArray,
    centres: FloatArray,
    settings: LikelihoodSettings,
    *,
    gyroscope: Samples | None = None,
    axial: AxialField | None = None,
    start: ToneFit | None = None,
) -> ToneFit:
    """Fit the tone in a window around each of ``centres``.

    With ``gyroscope`` and ``axial`` the turning of the field by p and q is part of the model and the phase rate
    found is -r; ``start`` are then the fits without it. Windows that cannot tell are NaN.
    """
    centres = np.asarray(centres, dtype=float)
    if gyroscope is None or axial is None or start is None:
        table = _searched(t, m, centres, settings)
    else:
        table = _turned(t, m, centres, settings, gyroscope, axial, start)
    columns = {name: table[:, i].copy() for i, name in enumerate(COLUMNS)}
    offset = columns.pop("offset_x") + 1j * columns.pop("offset_y")
    return ToneFit(t=centres, offset=offset, **columns)


def _searched(t: FloatArray, m: FloatArray, centres: FloatArray, settings: LikelihoodSettings) -> FloatArray:
    """Return the table (w, columns) of windows in which a tone is looked for."""
    lengths = np.array(_lengths(settings))
    interval, span = _interval(t), float(t[-1] - t[0]) if t.size else 0.0
    limits = (settings.turns, settings.significance, settings.largest_sd)

    def fit(part: slice) -> FloatArray:
        before = min(part.start, BEFORE)
        own = centres[part.start - before : part.stop]
        first, after = _ranges(t, own, lengths[:, None])
        lo, hi = _reach(first, after, t.size)
        table = np.full((own.size, len(COLUMNS)), np.nan)
        at, field = _copies(t[lo:hi], m[lo:hi])
        search_windows(
            at, field, own, lengths, first - lo, after - lo, interval, span, settings.degree,
            settings.ellipse_sd, limits, table,
        )  # fmt: skip
        return table[before:]

    return np.concatenate([np.empty((0, len(COLUMNS))), *side_by_side(fit, _parts(centres.size))])


def _turned(
    t: FloatArray,
    m: FloatArray,
    centres: FloatArray,
    settings: LikelihoodSettings,
    gyroscope: Samples,
    axial: AxialField,
    start: ToneFit,
) -> FloatArray:
    """Return the table (w, columns) of windows that have a tone, with the field's turning by p and q."""
    interval, span = _interval(t), float(t[-1] - t[0]) if t.size else 0.0
    limits = (settings.turns, settings.significance, settings.largest_sd)
    known = np.column_stack([getattr(start, name) for name in COLUMNS[:-2]])

    def fit(part: slice) -> FloatArray:
        own = centres[part]
        first, after = _ranges(t, own, np.nan_to_num(start.length[part]))
        lo, hi = _reach(first, after, t.size)
        rates, _ = transverse_rates(gyroscope, t[lo:hi])
        table = np.full((own.size, len(COLUMNS)), np.nan)
        at, field = _copies(t[lo:hi], m[lo:hi])
        turn_windows(
            at, field, own, known[part], first - lo, after - lo, interval, span, settings.degree,
            settings.ellipse_sd, limits, axial.offset, rates, table,
        )  # fmt: skip
        return table

    return np.concatenate([np.empty((0, len(COLUMNS))), *side_by_side(fit, _parts(centres.size))])


def _copies(t: FloatArray, m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return arrays that may be written: for those that may not all would be compiled once more."""
    return np.array(t), np.array(m)


def _interval(t: FloatArray) -> float:
    return float(np.median(np.diff(t))) if t.size > 1 else 1.0


def _parts(count: int) -> list[slice]:
    """Return the parts in which so many windows are fitted."""
    return [slice(start, min(start + TOGETHER, count)) for start in range(0, count, TOGETHER)]


def _reach(first: IndexArray, after: IndexArray, count: int) -> tuple[int, int]:
    """Return from which to which of ``count`` readings windows of these ranges reach; all where that is nearly all."""
    lo, hi = int(np.min(first)), int(np.max(after))
    return (lo, hi) if hi - lo < 0.9 * count else (0, count)


def _ranges(t: FloatArray, centres: FloatArray, lengths: FloatArray) -> tuple[IndexArray, IndexArray]:
    """Return the first reading of each window, and the first after it, for lengths that broadcast with the centres."""
    first = np.searchsorted(t, centres - 0.5 * lengths - 1e-9)
    return first, np.searchsorted(t, centres + 0.5 * lengths + 1e-9)


def _lengths(settings: LikelihoodSettings) -> list[float]:
    lengths = [settings.window]
    while 2 * lengths[-1] <= settings.longest_window * (1 + 1e-9):
        lengths.append(2 * lengths[-1])
    return lengths
