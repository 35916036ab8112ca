"""Spin rate from the magnetometer by maximum likelihood in a moving window: two axes as one complex signal.

In each window the field across the spin axis is a tone whose phase is a polynomial of time; hard iron and the
ellipse of soft iron are unknown along with it (`estimators.tone`). Two axes tell the direction of spin, have no
leakage from the negative frequency, and reach the Cramer-Rao bound. The field's phase does not turn at -r but at
``-r + m_z (p m_x + q m_y)/(m_x^2 + m_y^2)`` (docs/spin-phase.md): with a gyroscope the difference is removed, without
one its stated size is part of the standard deviation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.errors import InputError
from discsim.recording import Recording, Samples, SensorSheet
from estimators.precession import AxialField, axial_field, transverse_gyroscope, transverse_rates
from estimators.rate import YawRate
from estimators.tone import ComplexArray, field_shape, fit_tone

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

#: Residual's variance per axis, over the amplitude squared, above which a window shows no tone: with a tenth the
#: readings lie as far from the circle as a third of its radius, and turns are miscounted.
LARGEST_SHARE = 0.1

#: Relative standard deviation of the correction by p and q: the gyroscope's gain (2 %), and soft iron (3 % on the field
#: along the axis, and the mean of two such across it).
CORRECTION_SD = 0.042

#: Most steps of a fit. One that starts at its line converges within eight; the rest are no tones.
MOST_STEPS = 15


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
        Transverse rate expected in flight where no gyroscope shows it, rad/s.
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
            slack = np.hypot(fits.axial - axial.offset, axial.sd) / fits.amplitude * settings.precession_sd
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
    z = m[:, 0] + 1j * m[:, 1]
    interval = float(np.median(np.diff(t))) if t.size > 1 else 1.0
    span = float(t[-1] - t[0]) if t.size else 0.0
    count = len(centres)
    out = {name: np.full(count, np.nan) for name in ToneFit.__dataclass_fields__ if name not in ("t", "offset")}
    offset = np.full(count, complex(np.nan, np.nan))
    rates, substeps = transverse_rates(gyroscope, t) if gyroscope is not None else (None, 1)
    previous: FloatArray | None = None
    for index, centre in enumerate(centres):
        lengths = _lengths(settings)
        guess = None
        if start is not None:
            if not np.isfinite(start.phase_rate[index]):
                continue
            lengths = [float(start.length[index])]
            guess = (float(start.phase_rate[index]), float(start.chirp[index]))
        for length in lengths:
            lo, hi = np.searchsorted(t, (centre - 0.5 * length - 1e-9, centre + 0.5 * length + 1e-9))
            if hi - lo < settings.degree + 12 or hi - lo < 0.5 * min(length, span) / interval:
                previous = None
                continue
            half = 0.5 * float(t[hi - 1] - t[lo])
            window = _Window(t[lo:hi], z[lo:hi], float(centre), half, interval)
            if rates is None:
                result = _search(window, settings, previous, length is lengths[0])
            else:
                assert axial is not None
                along_z = float(np.mean(m[lo:hi, 2])) - axial.offset
                result = _with_turning(window, settings, guess, rates[lo : hi - 1], substeps, along_z)
            if result is None:
                previous = None
                continue
            parameters, covariance, variance, along, u = result
            rate = parameters[1] / half
            powers = settings.degree + 2
            if abs(rate) * 2 * half < 2 * np.pi * settings.turns and length is not lengths[-1]:
                continue
            sd = float(np.sqrt(covariance[1, 1] * variance)) / half
            misfit = variance > LARGEST_SHARE * parameters[powers] ** 2
            if misfit and abs(rate) * 2 * half >= 2 * np.pi * settings.turns:
                break  # whole turns that no tone explains: a longer window explains them no better
            if parameters[powers] < settings.significance * np.sqrt(covariance[powers, powers] * variance):
                continue
            if sd > settings.largest_sd or sd > 0.25 * abs(rate) or misfit:
                continue
            correlation, wobble = _correlation(window, parameters, powers, u)
            # n white samples are worth more than n correlated ones
            variance *= (1 + correlation) / max(1 - correlation, 0.05)
            sd = float(np.sqrt(covariance[1, 1] * variance)) / half
            out["phase"][index] = parameters[0]
            out["phase_sd"][index] = np.sqrt(covariance[0, 0] * variance)
            out["phase_rate"][index] = rate
            out["phase_rate_sd"][index] = sd
            out["chirp"][index] = 2 * parameters[2] / half**2 if powers > 2 else 0.0
            out["amplitude"][index] = parameters[powers]
            out["axial"][index] = np.mean(m[lo:hi, 2])
            out["noise"][index] = np.sqrt(variance * max(1 - correlation, 0.05) / (1 + correlation))
            out["correlation"][index] = correlation
            out["wobble"][index] = wobble
            out["length"][index] = length
            out["along"][index] = along
            offset[index] = complex(parameters[powers + 1], parameters[powers + 2])
            previous = np.array([rate, out["chirp"][index], centre])
            break
    return ToneFit(t=np.asarray(centres, dtype=float), offset=offset, **out)


def _lengths(settings: LikelihoodSettings) -> list[float]:
    lengths = [settings.window]
    while 2 * lengths[-1] <= settings.longest_window * (1 + 1e-9):
        lengths.append(2 * lengths[-1])
    return lengths


@dataclass(frozen=True)
class _Window:
    t: FloatArray
    z: ComplexArray
    centre: float
    half: float
    interval: float

    @property
    def x(self) -> FloatArray:
        return (self.t - self.centre) / self.half


_Result = tuple[FloatArray, FloatArray, float, float, ComplexArray]


def _search(
    window: _Window, settings: LikelihoodSettings, previous: FloatArray | None, chirping: bool
) -> _Result | None:
    """Fit from every likely start and keep the best; None where two different rates explain the data alike."""
    tau = window.t - window.centre
    starts = [(rate, 0.0) for rate, _ in _peaks(tau, window.z[None], window.interval)[0]]
    if previous is not None:
        starts.insert(0, (previous[0] + previous[1] * (window.centre - previous[2]), previous[1]))
    power = float(np.sum(np.abs(window.z - np.mean(window.z)) ** 2))
    results = _fits(window, starts, settings)
    if chirping and (not results or results[0][2] * 2 * len(tau) > 0.2 * power):
        # a strong change of rate smears the line: look for it on a grid of chirps
        # about the mean, for hard iron would be smeared instead
        chirps = _chirp_grid(window.half)
        turned = (window.z - np.mean(window.z)) * np.exp(-0.5j * chirps[:, None] * tau**2)
        highest = _peaks(tau, turned, window.interval, count=1)
        smeared = [(height, rate, float(c)) for c, found in zip(chirps, highest, strict=True) for rate, height in found]
        results += _fits(window, [(rate, chirp) for _, rate, chirp in sorted(smeared)[-3:]], settings)
        results.sort(key=lambda result: result[2])
    if not results:
        return None
    best = results[0]
    for other in results[1:]:
        apart = abs(other[0][1] - best[0][1]) / window.half
        # different if a radian apart over the window; alike if the data prefer one by less than about 3.5 sd
        if apart * window.half > 1.0 and 2 * len(tau) * np.log(other[2] / best[2]) < 12.0:
            return None
    return best


def _fits(window: _Window, starts: list[tuple[float, float]], settings: LikelihoodSettings) -> list[_Result]:
    x = window.x
    u = np.ones(len(x), dtype=complex)
    results = []
    for rate, chirp in starts:
        parameters = _linear_start(window, rate, chirp, settings)
        covariance = np.zeros((parameters.size, parameters.size))
        variance, steps = fit_tone(
            x, window.z, u, parameters, covariance, settings.degree + 2, settings.ellipse_sd, 0.0, MOST_STEPS
        )
        outside = abs(parameters[1] / window.half) > 1.02 * np.pi / window.interval
        if steps < 0 or outside or not np.all(np.isfinite(parameters)):
            continue
        results.append((_positive(parameters, settings.degree + 2), covariance, float(variance), 0.0, u))
    results.sort(key=lambda result: result[2])
    return results


def _linear_start(window: _Window, rate: float, chirp: float, settings: LikelihoodSettings) -> FloatArray:
    tau = window.t - window.centre
    tone = np.exp(1j * (rate * tau + 0.5 * chirp * tau**2))
    # least squares of tone and mean: two equations
    overlap, mean = complex(np.mean(np.conj(tone))), complex(np.mean(window.z))
    left = max(1 - abs(overlap) ** 2, 1e-9)
    amplitude = (complex(np.mean(np.conj(tone) * window.z)) - overlap * mean) / left
    offset = mean - amplitude * np.conj(overlap)
    parameters = np.zeros(settings.degree + 7)
    parameters[0] = np.angle(amplitude)
    parameters[1] = rate * window.half
    if settings.degree > 0:
        parameters[2] = 0.5 * chirp * window.half**2
    parameters[settings.degree + 2] = abs(amplitude)
    parameters[settings.degree + 3] = offset.real
    parameters[settings.degree + 4] = offset.imag
    return parameters


def _positive(parameters: FloatArray, powers: int) -> FloatArray:
    if parameters[powers] < 0:
        parameters[powers] *= -1
        parameters[0] += np.pi
    return parameters


def _with_turning(
    window: _Window,
    settings: LikelihoodSettings,
    guess: tuple[float, float] | None,
    rates: ComplexArray,
    substeps: int,
    axial: float,
) -> _Result | None:
    """Fit with the field's turning by p and q: the turning needs the phase and the phase the turning, so thrice."""
    assert guess is not None
    parameters = _linear_start(window, guess[0], guess[1], settings)
    covariance = np.zeros((parameters.size, parameters.size))
    u = np.ones(len(window.t), dtype=complex)
    powers = settings.degree + 2
    variance, steps, along = 0.0, 0, 0.0
    for _ in range(3):
        along = field_shape(window.t, window.centre, window.half, parameters, powers, axial, rates, substeps, u)
        variance, steps = fit_tone(
            window.x, window.z, u, parameters, covariance, powers, settings.ellipse_sd, 0.0, MOST_STEPS
        )
        if steps < 0:
            return None
    return _positive(parameters, powers), covariance, float(variance), float(along), u


def _correlation(window: _Window, parameters: FloatArray, powers: int, u: ComplexArray) -> tuple[float, float]:
    """Return how much neighbouring residuals correlate beyond chance, the larger of as read and turned with the field.

    A wandering axis, or a rate that no polynomial follows, leaves a residual that is smooth in one of both. The second
    value is the rms rate, rad/s, of the phase's part of it: a smooth signal's covariance falls by half its slope's
    variance times the lag squared, so between one and two lags, which no white noise reaches, by 3/2 of it.
    """
    phase = np.polynomial.polynomial.polyval(window.x, parameters[:powers])
    E = u * np.exp(1j * phase)
    A, b, c = parameters[powers], complex(*parameters[powers + 1 : powers + 3]), complex(*parameters[powers + 3 :])
    residual = window.z - b - A * (E + c * np.conj(E))
    total = float(np.sum(np.abs(residual) ** 2))
    if total <= 0:
        return 0.0, 0.0
    as_read = float(np.sum(residual[1:] * np.conj(residual[:-1])).real) / total
    turned = residual * np.exp(-1j * phase)
    with_field = float(np.sum(turned[1:] * np.conj(turned[:-1])).real) / total
    # of white noise the real part scatters by 1/sqrt(2 n)
    correlation = max(0.0, max(as_read, with_field) - 3 / np.sqrt(2 * len(residual)))
    angle = turned.imag / A
    fall = float(np.mean(angle[1:] * angle[:-1]) - np.mean(angle[2:] * angle[:-2]))
    return float(correlation), float(np.sqrt(max(0.0, fall / 1.5)) / window.interval)


def _peaks(tau: FloatArray, z: ComplexArray, interval: float, count: int = 3) -> list[list[tuple[float, float]]]:
    """Return angular frequency and power of the highest peaks of the periodograms with floating mean of z (k, n).

    The power that a tone of each frequency takes with the mean fitted along, zero where tone and mean cannot be told
    apart.
    """
    n = float(tau.size)
    span = tau[-1] - tau[0] + interval
    size = int(2 ** np.ceil(np.log2(4 * span / interval)))
    frequency = np.asarray(2 * np.pi * np.fft.fftfreq(size, interval), dtype=np.float64)
    tone, value = _transforms(tau - tau[0], z, frequency, interval)
    left = n - np.abs(tone) ** 2 / n
    value -= tone * (np.sum(z, axis=1, keepdims=True) / n)
    power = np.where(left > 1e-3 * n, (value.real**2 + value.imag**2) / np.maximum(left, 1e-9 * n), 0.0)
    if count == 1:
        highest = np.argmax(power, axis=1)
        # nothing turns in a row without power
        tops = zip(highest, power, strict=True)
        return [[(float(frequency[i]), float(row[i]))] if row[i] > 0 else [] for i, row in tops]
    found = []
    for row in power:
        candidates = np.flatnonzero((row >= np.roll(row, 1)) & (row >= np.roll(row, -1)))
        order = candidates[np.argsort(row[candidates])[::-1][:count]]
        best = row[order[0]] if order.size else 0.0
        found.append([(float(frequency[i]), float(row[i])) for i in order if row[i] > 0.1 * best])
    return found


def _transforms(
    t: FloatArray, z: ComplexArray, frequency: FloatArray, interval: float
) -> tuple[ComplexArray, ComplexArray]:
    """Return the sums of exp(-i w t), (size,), and of z exp(-i w t), (k, size), at the FFT's frequencies w.

    t >= 0 (n,) are time stamps and z (k, n) signals. Each stamp is rounded to the grid and the rest d expanded,
    ``exp(-i w d) = sum (-i w d)^j/j!``: one FFT per term, as many as leave less than a thousandth at half the sampling
    rate; one on an even grid.
    """
    slots = np.rint(t / interval).astype(np.int64)
    rest = t - slots * interval
    most = np.pi / interval * float(np.max(np.abs(rest)))
    rows = np.concatenate([np.ones((1, t.size)), z])
    shared = bool(np.any(slots[1:] == slots[:-1]))
    total = np.zeros((len(rows), frequency.size), dtype=complex)
    share, term, factor = 1.0, np.ones_like(rest), np.ones(frequency.size, dtype=complex)
    power = 0
    while share > 1e-3:
        grid = np.zeros((len(rows), frequency.size), dtype=complex)
        if shared:
            np.add.at(grid.T, slots, (rows * term).T)
        else:
            grid[:, slots] = rows * term
        total += factor * np.fft.fft(grid)
        power += 1
        share *= most / power
        term = term * rest
        factor = factor * (-1j * frequency / power)
    return total[0], total[1:]


def _chirp_grid(half: float) -> FloatArray:
    """Changes of rate, rad/s^2, spaced so that the phase at the window's ends is within a radian of one of them."""
    spacing = 4.0 / half**2
    most = min(150.0, 24 * spacing)
    steps = int(np.ceil(most / spacing))
    return spacing * np.array([k for k in range(-steps, steps + 1) if k != 0], dtype=float)
