"""Spin rate from the magnetometer by a moving, zero-padded FFT: the paper's steps (P-1) to (P-7)."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from types import NoneType
from typing import Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from discsim.arrays import BoolArray, ComplexArray, FloatArray
from discsim.compiled import compiled_nogil
from discsim.errors import InputError, require_type
from discsim.estimators.fft_fast import dirichlet, highest, spectra, transform_at
from discsim.estimators.precession import AxialField, axial_field, tipping
from discsim.estimators.rate import YawRate
from discsim.estimators.readings import require_readings
from discsim.estimators.spin_spline import IndexArray
from discsim.recording import Samples
from discsim.threads import side_by_side

__all__ = ["FftSettings", "fft"]

#: Windows looked at together; memory does not grow with the recording.
CHUNK = 512

#: Windows transformed at once: their coarse spectra, 1 MB at n = 128, stay in a core's cache.
BLOCK = 64

#: Windows that the hard iron along the axis is found from, at most.
AXIAL_WINDOWS = 100

#: Strength of the field, uT, that is taken where neither it nor the field along the axis is known: the Earth's is 25 to
#: 65 uT.
USUAL_STRENGTH = 50.0

#: Parts of a window that noise is looked for in, and the fewest samples of one, for five parameters.
NOISE_PARTS, NOISE_LEAST = 4, 8

#: Below this share of the window's variance the line is smeared by a change of rate of more than about four bins
#: over the window; its spectrum then has several peaks of one height and the highest says little.
COHERENT_SHARE = 0.4


@dataclass(frozen=True)
class FftSettings:
    """Settings of `fft`; the defaults are the paper's.

    Attributes
    ----------
    window : int
        n of (P-1), samples: 128 at 100 Hz.
    pad : int
        k of (P-2), zeros appended to each window: 2^14 - n.
    threshold : float
        Lowest rate looked for, rad/s (500 deg/s, Section 3).
    step : int
        Samples between the starts of successive windows (P-7).
    stamp : {"centre", "unshifted"}
        Each value's time: the window's centre, or its last sample, which shows the delay of Fig. 7.
    remove_mean : bool
        Subtract the window's mean before the transform. The paper does not; with a hard iron of the size of the
        horizontal field it removes most of the error below about 2000 deg/s.
    false_alarm : float
        Chance that white noise alone passes for a line in one window.
    precession_sd : float
        Rate, along the field, of the turning of a disc's axis in flight, rad/s rms. Of 42 throws of three discs, drawn
        at random (15 to 27 m/s, 2800 to 6400 deg/s, any heading), it is 0.077 rad/s rms, along and across the field.
        At spins below 4600 deg/s more is taken (`precession.tipping`); this is the least.
    """

    window: int = 128
    pad: int = 2**14 - 128
    threshold: float = np.radians(500.0)
    step: int = 1
    stamp: Literal["centre", "unshifted"] = "centre"
    remove_mean: bool = False
    false_alarm: float = 1e-4
    precession_sd: float = 0.08

    def __post_init__(self) -> None:
        for name in ("window", "pad", "step"):
            require_type(getattr(self, name), (int, np.integer), f"fft {name}", "a whole number of samples")
        for name in ("threshold", "false_alarm", "precession_sd"):
            require_type(getattr(self, name), Real, f"fft {name}", "a number")
        if self.window < 8:
            raise InputError(f"fft window: got {self.window} samples, expected at least 8")
        if self.pad < 0:
            raise InputError(f"fft pad: got {self.pad} zeros, expected none or more")
        if self.step < 1:
            raise InputError(f"fft step: got {self.step} samples, expected at least 1")
        if not self.threshold > 0:
            raise InputError(f"fft threshold: got {np.degrees(self.threshold):g} deg/s, expected more than zero")
        if self.stamp not in ("centre", "unshifted"):
            raise InputError(f"fft stamp: got '{self.stamp}', expected 'centre' or 'unshifted'")
        if not 0 < self.false_alarm < 1:
            raise InputError(f"fft false alarm level: got {self.false_alarm:g}, expected between 0 and 1")
        if not self.precession_sd >= 0:
            raise InputError(f"fft precession: got {self.precession_sd:g} rad/s, expected none or more")


def fft(
    magnetometer: Samples,
    settings: FftSettings | None = None,
    *,
    strength: float | None = None,
    fixed_axis: bool = False,
) -> YawRate:
    """Spin rate from the peak of the padded spectrum of each window, (P-1) to (P-7).

    ``magnetometer.value`` is (m, 3) in uT; of x and y the axis with the larger variance in the window is used.
    The rate has no sign. (PE1) runs to n + k, one element more than the n + k amplitudes it is matched with: here the
    frequencies are ``[0 .. n + k - 1] / (n + k)`` times the sampling rate, of which a real signal needs the first
    half; (PE2) makes a rate of the peak's. The sampling rate is that of the window's own time stamps.

    A value is NaN where

    - a sample in the window is missing, or its time stamps leave an even grid by more than half a sample;
    - the peak is no local maximum, as on the skirt of something slower than the threshold;
    - without its mean, the window has a stronger line below the threshold (whose side lobes are local maxima too);
    - the line does not stand out: a sinusoid and an offset fitted at the peak must reduce the sum of squares about the
      mean by more than white noise does with the chance ``false_alarm`` (`_false_alarm`);
    - leakage moves the peak by a quarter of a bin (sampling rate / n) or more: it is no longer known whose it is.

    The standard deviation has six parts, in quadrature: noise by the Cramer-Rao bound of one real axis with the noise
    left in the window; the grid's step / sqrt(12); leakage of the negative frequency and of the offset (`_leakage`); a
    smeared line; a change of angular acceleration inside the window, from the estimates half a window before and after;
    and precession, by which the field's phase in flight turns at another rate than the disc: see `_precession`. That
    part is ``precession_sd`` of the result. It does not average out: it may keep its sign for a whole flight.

    Parameters
    ----------
    magnetometer : Samples
        (m, 3) uT in B; z serves the precession's part alone.
    settings : FftSettings or None
        The paper's if None.
    strength : float or None
        Of the field at the place, uT, where it is stated: it tells the hard iron along z.
    fixed_axis : bool
        True on a rig: there is no precession.

    Raises
    ------
    InputError
        If the recording is shorter than one window, or the threshold is not below half the sampling rate.
    """
    settings = _settings(settings, strength)
    _refuse(magnetometer, settings)
    n, t = settings.window, magnetometer.t
    starts = np.arange(0, t.size - n + 1, settings.step)
    rate, sd, amplitude, axial = _by_window(magnetometer, starts, settings)
    centre = (t[starts] + t[starts + n - 1]) / 2
    half = (n - 1) * magnetometer.interval / 2
    sd = np.hypot(sd, _uneven_acceleration(centre, rate, sd, half))
    precession = np.where(np.isnan(rate), np.nan, 0.0)
    if not fixed_axis:
        some = slice(None, None, max(1, round(n / 25 / settings.step), starts.size // AXIAL_WINDOWS))
        iron = axial_field(amplitude[some], axial[some], strength)  # windows as far apart as those of `likelihood`
        precession = _precession(amplitude, axial, iron, strength) * tipping(settings.precession_sd, rate)
    when = centre if settings.stamp == "centre" else t[starts + n - 1]
    return YawRate("fft", when, rate, np.hypot(sd, precession), precession_sd=precession)


def _settings(settings: FftSettings | None, strength: float | None) -> FftSettings:
    """Return the settings, the paper's for none; raises `InputError` for these or a strength of another type."""
    require_type(settings, (FftSettings, NoneType), "settings", "FftSettings(...), or nothing for the paper's")
    require_type(strength, (Real, NoneType), "strength", "the field's strength, uT, or nothing where it is not known")
    return settings or FftSettings()


def _refuse(magnetometer: Samples, settings: FftSettings) -> None:
    """Refuse a recording that is shorter than a window, or sampled too slowly for the threshold."""
    require_readings(magnetometer, "magnetometer")
    n, interval, t = settings.window, magnetometer.interval, magnetometer.t
    if t.size < n:
        have = f"{t.size} samples" + (f" ({t.size * interval:.2f} s)" if t.size > 1 else "")
        want = f"{n} samples" + (f" ({n * interval:.2f} s)" if t.size > 1 else "")
        raise InputError(f"fft: the magnetometer has {have}; a window needs {want}")
    nyquist = np.pi / interval
    if settings.threshold >= nyquist:
        raise InputError(
            f"fft threshold: {np.degrees(settings.threshold):.0f} deg/s is not below half the magnetometer's sampling "
            f"rate ({np.degrees(nyquist):.0f} deg/s)"
        )


def _by_window(
    magnetometer: Samples, starts: IndexArray, settings: FftSettings
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return each window's rate and its sd, rad/s, the line's amplitude and the mean of z, uT: (w,) each.

    NaN where a window says nothing.
    """
    n, t = settings.window, magnetometer.t
    rate, sd, amplitude, axial = (np.full(starts.size, np.nan) for _ in range(4))
    along_axis = sliding_window_view(magnetometer.value[:, 2], n)
    stamps, field = sliding_window_view(t, n), np.ascontiguousarray(magnetometer.value[:, :2])
    whole = np.concatenate([[0], np.cumsum(~np.isfinite(field).all(axis=1))])  # gaps before each sample

    def fill(first: int) -> None:
        chosen = starts[first : first + CHUNK]
        spacing = (t[chosen + n - 1] - t[chosen]) / (n - 1)
        usable = _evenly_spaced(stamps[chosen], spacing) & (whole[chosen + n] == whole[chosen])
        if not usable.any():
            return
        spacing = spacing[usable]
        still, mean = np.empty((spacing.size, n)), np.empty(spacing.size)
        _wider_axis(field, chosen[usable], still, mean)
        blocks = [slice(start, start + BLOCK) for start in range(0, mean.size, BLOCK)]
        found = [_spectral_peak(still[block], mean[block], spacing[block], settings) for block in blocks]
        peak, line, known = (np.concatenate(parts) for parts in zip(*found, strict=True))
        if not known.any():
            return
        omega = 2 * np.pi * peak[known] / (n + settings.pad)  # (PE2), rad per sample
        spread, size, certain = _uncertainty(still[known], mean[known], line[known], omega, settings)
        slots = (first + np.flatnonzero(usable))[known]
        rate[slots] = np.where(certain, omega / spacing[known], np.nan)
        sd[slots] = np.where(certain, spread / spacing[known], np.nan)
        amplitude[slots] = np.where(certain, size, np.nan)
        axial[slots] = _mean_known(along_axis[starts[slots]])

    side_by_side(fill, range(0, starts.size, CHUNK))
    return rate, sd, amplitude, axial


def _evenly_spaced(t: FloatArray, interval: FloatArray) -> BoolArray:
    """Tell in which windows, (w, n), no time stamp strays more than half a sample from another's even grid."""
    stray = t - t[:, :1] - interval[:, None] * np.arange(t.shape[1])
    return np.asarray(np.ptp(stray, axis=1) <= interval / 2)


@compiled_nogil
def _wider_axis(field: FloatArray, starts: IndexArray, still: FloatArray, mean: FloatArray) -> None:
    """Fill ``still`` (w, n) with the windows of the axis that varies more, less their means (w,)."""
    n = still.shape[1]
    for i in range(starts.size):
        window = field[starts[i] : starts[i] + n]
        x_mean, y_mean = 0.0, 0.0
        for k in range(n):
            x_mean += window[k, 0] / n
            y_mean += window[k, 1] / n
        x_squares, y_squares = 0.0, 0.0
        for k in range(n):
            x_squares += (window[k, 0] - x_mean) ** 2
            y_squares += (window[k, 1] - y_mean) ** 2
        axis = 0 if x_squares >= y_squares else 1
        mean[i] = x_mean if axis == 0 else y_mean
        for k in range(n):
            still[i, k] = window[k, axis] - mean[i]


def _spectral_peak(
    still: FloatArray, mean: FloatArray, interval: FloatArray, settings: FftSettings
) -> tuple[IndexArray, ComplexArray, BoolArray]:
    """Return the order of the peak at or above the threshold, (P-3) to (P-5), and whether it is a line of its own.

    ``still`` (w, n) are the windows less their means. Between the two stands the transform of ``still`` at the peak,
    phases counted from the window's centre.
    """
    total = settings.window + settings.pad
    lowest = np.ceil(settings.threshold * total * interval / (2 * np.pi)).astype(np.int64)  # per window
    start, last, none = np.zeros_like(lowest), np.full(lowest.size, total // 2), np.full(lowest.size, -1)
    windows = spectra(still, mean, total)
    # Where a line below the threshold is the strongest, it is found first and few windows have more to be looked at.
    slow = windows.strongest_order < lowest
    _, slower = highest(windows, start, np.where(slow, lowest - 1, none), offset=False)
    rival, _ = highest(windows, lowest, np.where(slow, last, none), offset=False, above=slower)
    searched = ~slow | (rival >= 0)
    peak, _ = highest(windows, lowest, np.where(searched, last, none), offset=not settings.remove_mean)
    line = transform_at(windows, np.maximum(peak, 0))
    slower_peak, _ = highest(
        windows, start, np.where(searched, lowest - 1, none), offset=False, above=line.real**2 + line.imag**2
    )
    return peak, line, (slower_peak < 0) & (peak > lowest) & (peak < last)


def _uncertainty(
    still: FloatArray, mean: FloatArray, line: ComplexArray, omega: FloatArray, settings: FftSettings
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return one sigma of the rate, rad per sample, the amplitude, and whether the line at ``omega`` is certain.

    ``omega`` is in rad per sample. The noise of one real axis: of ``A cos(omega k + phase)`` in white noise of
    deviation s the Fisher information of omega is ``A^2/s^2 sum(k^2 sin^2)``, half that of a complex tone with s on
    each of its two axes, so ``var(omega) >= 24 s^2 / (A^2 n (n^2 - 1))``.

    ``line`` is the transform of ``still`` there, ``sum(x cos) - i sum(x sin)`` with angles counted from the centre.
    """
    n, total = settings.window, settings.window + settings.pad
    # About the window's centre a cosine is even and a sine odd: only the offset and the cosine share anything.
    level, twice = dirichlet(omega, n) / n, dirichlet(2 * omega, n)
    cosines, sines = (n + twice) / 2 - n * level**2, (n - twice) / 2  # sums of squares
    even, odd = line.real / cosines, -line.imag / sines
    offset = mean - even * level
    about_mean = np.einsum("wn,wn->w", still, still)
    residual = np.maximum(about_mean - even**2 * cosines - odd**2 * sines, 0.0)
    share = 1 - np.divide(residual, about_mean, out=np.ones_like(residual), where=about_mean > 0)
    amplitude = np.maximum(np.hypot(even, odd), np.finfo(float).tiny)

    bin_width = 2 * np.pi / n
    variance = np.empty(omega.size)
    _noise_variance(still, omega, variance)
    noise = np.sqrt(24 * variance / (n * (n**2 - 1))) / amplitude
    grid = 2 * np.pi / total / np.sqrt(12)
    shown = offset - mean if settings.remove_mean else offset
    leakage = _leakage(omega / bin_width, 2 * shown / amplitude, n) * bin_width
    smear = np.where(share < COHERENT_SHARE, COHERENT_SHARE / np.maximum(share, 1e-3), 0.0) * bin_width
    certain = (_false_alarm(share, n) < settings.false_alarm) & (leakage < bin_width / 4)
    return np.sqrt(noise**2 + grid**2 + leakage**2 + smear**2), amplitude, certain


@compiled_nogil
def _noise_variance(still: FloatArray, omega: FloatArray, variance: FloatArray) -> None:
    """Fill ``variance`` (w,) with that of the noise in windows (w, n) that hold a line at ``omega`` rad per sample.

    A spin that decays by 250 deg/s^2, as in flight, leaves the line of a whole window by 50 deg of phase at its ends,
    which hardly moves the peak but is no noise. So an offset and a line whose amplitude and phase may change linearly
    are fitted to each of `NOISE_PARTS` parts of the window, and what they leave is counted. About a part's centre
    1, cos and tau sin are even, sin and tau cos odd: of those two sets only members of one share anything.
    """
    n = still.shape[1]
    parts = max(1, min(NOISE_PARTS, n // NOISE_LEAST))
    even, odd, shown_even, shown_odd = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    for i in range(omega.size):
        squares, freedom = 0.0, 0
        for part in range(parts):
            first, after = part * n // parts, (part + 1) * n // parts
            count = after - first
            even[:], odd[:], shown_even[:], shown_odd[:] = 0.0, 0.0, 0.0, 0.0
            start = -(count - 1) / 2
            turned, turn = np.exp(1j * omega[i] * start), np.exp(1j * omega[i])
            for k in range(count):
                tau, x = 2 * (start + k) / count, still[i, first + k]
                c, s = turned.real, turned.imag
                e2, o1 = tau * s, tau * c
                even[0, 0] += 1.0
                even[1, 0] += c
                even[2, 0] += e2
                even[1, 1] += c * c
                even[2, 1] += c * e2
                even[2, 2] += e2 * e2
                odd[0, 0] += s * s
                odd[1, 0] += s * o1
                odd[1, 1] += o1 * o1
                shown_even[0] += x
                shown_even[1] += x * c
                shown_even[2] += x * e2
                shown_odd[0] += x * s
                shown_odd[1] += x * o1
                squares += x * x
                turned *= turn
            explained_even, rank_even = _explained(even, shown_even, 3)
            explained_odd, rank_odd = _explained(odd, shown_odd, 2)
            squares -= explained_even + explained_odd
            freedom += count - rank_even - rank_odd
        variance[i] = max(squares, 0.0) / freedom


@compiled_nogil
def _explained(gram: FloatArray, shown: FloatArray, size: int) -> tuple[float, int]:
    """Return the sum of squares that columns explain, and how many count; both arguments are overwritten.

    ``gram`` has their products in its lower triangle, ``shown`` theirs with the readings. A column that is one of those
    before but for 1e-9 of its square, as where a part holds little of a turn, does not count.
    """
    total, rank = 0.0, 0
    for c in range(size):
        whole = gram[c, c]
        for before in range(c):
            gram[c, c] -= gram[c, before] ** 2
            shown[c] -= gram[c, before] * shown[before]
        if gram[c, c] <= 1e-9 * whole:
            gram[c:, c], shown[c] = 0.0, 0.0
            continue
        pivot = np.sqrt(gram[c, c])
        shown[c] /= pivot
        for later in range(c + 1, size):
            for before in range(c):
                gram[later, c] -= gram[later, before] * gram[c, before]
            gram[later, c] /= pivot
        total += shown[c] ** 2
        rank += 1
    return total, rank


def _leakage(order: FloatArray, offset: FloatArray, n: int) -> FloatArray:
    """Shift of the peak by leakage, root mean square over the line's phase, in bins.

    With phases counted from the window's centre a line at ``order`` bins (turns per window) has the spectrum
    ``e^{i phase} D(y - order) + e^{-i phase} D(y + order) + offset D(y)``, ``D(y) = sin(pi y) / (n sin(pi y / n))``,
    offset in units of half the amplitude. To first order the other two terms move the maximum of the first by their
    slope there over its curvature, ``(pi^2 / 3)(1 - 1 / n^2)``, times the cosine of their phase against it.
    """
    curvature = np.pi**2 / 3 * (1 - 1 / n**2)
    mirrored, still = _dirichlet_slope(2 * order, n), offset * _dirichlet_slope(order, n)
    return np.asarray(np.hypot(mirrored, still) / curvature / np.sqrt(2))


def _dirichlet_slope(y: FloatArray, n: int) -> FloatArray:
    sine, cosine = np.sin(np.pi * y / n), np.cos(np.pi * y / n)
    return np.asarray(np.pi * (np.cos(np.pi * y) / sine - np.sin(np.pi * y) * cosine / (n * sine**2)) / n)


def _false_alarm(share: FloatArray, n: int) -> FloatArray:
    """Chance that white noise has a peak that explains ``share`` of the sum of squares about its mean.

    At one frequency a fitted sinusoid and offset (three parameters) leave 1 - share or less with the chance
    ``e^-z = (1 - share)^((n - 3) / 2)``. Over a band of W bins there are ``W sqrt(pi z / 3) e^-z`` such peaks to be
    expected (Baluev 2008, MNRAS 385, 1279); the band is taken up to half the sampling rate.
    """
    bins = n / 2
    z = -(n - 3) / 2 * np.log(np.clip(1 - share, 1e-300, 1.0))
    return np.asarray(np.minimum(1.0, np.exp(-z) * (1 + bins * np.sqrt(np.pi / 3 * z))))


def _uneven_acceleration(t: FloatArray, rate: FloatArray, sd: FloatArray, half: float) -> FloatArray:
    """Error where the angular acceleration changes inside a window, (w,) rad/s.

    Where the rate has a knot at the window's centre, the line's best frequency is off by 0.094 of the change of slope
    times the window's length, which is 0.3 of the second difference over half windows; a straight ramp gives none.
    The second difference counts only beyond its own scatter. Where a neighbour is unknown the nearest known one stands.
    """
    if t.size < 2:
        return np.zeros(t.size)
    before = np.interp(t - half, t, rate, left=np.nan, right=np.nan)
    after = np.interp(t + half, t, rate, left=np.nan, right=np.nan)
    second = (after - 2 * rate + before) ** 2 - 6 * sd**2
    known = np.isfinite(second)
    if not known.any():
        return np.zeros(t.size)
    return np.asarray(0.3 * np.sqrt(np.maximum(0.0, np.interp(t, t[known], second[known]))))


def _mean_known(windows: FloatArray) -> FloatArray:
    """Return the means (w,) of windows (w, n) over what is known; NaN where nothing is."""
    known = np.isfinite(windows)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(known, windows, 0.0).sum(axis=1) / known.sum(axis=1))


def _precession(amplitude: FloatArray, axial: FloatArray, iron: AxialField, strength: float | None) -> FloatArray:
    """Return what an axis that turns at an unseen 1 rad/s along the field moves the phase's rate by, (w,) rad/s.

    The phase turns at ``-r + m_z (p m_x + q m_y)/(m_x^2 + m_y^2)`` (`discsim.estimators.precession`): the part along
    the field of the axis's turning, times the field along the disc's axis over that across it. ``amplitude`` (w,) uT is
    the latter and ``axial`` (w,) the former with its hard iron; where that is unknown the field has its ``strength``,
    or a usual one.
    """
    rest = np.sqrt(np.maximum((strength or USUAL_STRENGTH) ** 2 - amplitude**2, 0.0))
    along = np.where(np.isfinite(axial), np.hypot(axial - iron.offset, iron.sd), rest)
    return np.asarray(along / amplitude)
