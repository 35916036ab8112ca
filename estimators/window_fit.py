"""Windows of magnetometer data searched for a tone, one after the other (compiled).

Each window is fitted from every likely start: the highest peaks of its periodogram with floating mean, the tone of the
window before, and, where neither explains the data, the peaks of the window turned back by a grid of chirps. The best
fit is kept unless another rate explains the data nearly as well.
"""

from __future__ import annotations

from math import ceil, cos, log, log2, pi, sin, sqrt

import numpy as np

from discsim.arrays import ComplexArray, FloatArray
from discsim.compiled import compiled, compiled_nogil
from discsim.estimators.spin_spline import IndexArray
from discsim.estimators.tone import field_shape, fit_tone, turns

__all__ = ["COLUMNS", "search_windows", "turn_windows"]

#: Most steps of a fit. One that starts at its line converges within eight; the rest are no tones.
MOST_STEPS = 15

#: Residual's variance per axis, over the amplitude squared, above which a window shows no tone: with a tenth the
#: readings lie as far from the circle as a third of its radius, and turns are miscounted.
LARGEST_SHARE = 0.1

#: What is told of a window, in this order; see `discsim.estimators.likelihood.ToneFit`.
COLUMNS = (
    "phase", "phase_sd", "phase_rate", "phase_rate_sd", "chirp", "amplitude", "axial", "noise", "length", "along",
    "correlation", "wobble", "offset_x", "offset_y",
)  # fmt: skip

#: Most peaks of a periodogram that are tried, and most chirps.
_PEAKS = 3

# ------------------------------------------------------------------------------------------------ transform


@compiled
def _wheel(size: int) -> ComplexArray:
    """Return exp(-2 pi i k/size) for k below half of ``size``, a power of two."""
    out = np.empty(size // 2, dtype=np.complex128)
    for k in range(size // 2):
        angle = 2 * pi * k / size
        out[k] = complex(cos(angle), -sin(angle))
    return out


@compiled
def _fourier(a: ComplexArray, size: int, wheel: ComplexArray) -> None:
    """Transform the first ``size`` values, a power of two, in place (Cooley and Tukey, radix two)."""
    j = 0
    for i in range(1, size):
        bit = size >> 1
        while j & bit:
            j ^= bit
            bit >>= 1
        j |= bit
        if i < j:
            a[i], a[j] = a[j], a[i]
    half = 1
    while half < size:
        stride = wheel.size // half
        for start in range(0, size, 2 * half):
            for k in range(half):
                w = wheel[k * stride]
                low, high = a[start + k], a[start + k + half]
                re = high.real * w.real - high.imag * w.imag
                im = high.real * w.imag + high.imag * w.real
                a[start + k] = complex(low.real + re, low.imag + im)
                a[start + k + half] = complex(low.real - re, low.imag - im)
        half *= 2


@compiled
def _transform(
    t: FloatArray,
    z: ComplexArray,
    interval: float,
    size: int,
    wheel: ComplexArray,
    grid: ComplexArray,
    total: ComplexArray,
) -> None:
    """Write the sums of z exp(-i w t) at the FFT's frequencies w = 2 pi k/(size interval), (size,), into ``total``.

    t >= 0 (n,) are time stamps. Each is rounded to the grid and the rest d expanded,
    ``exp(-i w d) = sum (-i w d)^j/j!``: one FFT per term, as many as leave less than a thousandth at half the sampling
    rate; one on an even grid.
    """
    n = t.size
    slots = np.empty(n, dtype=np.int64)
    rest = np.empty(n)
    furthest = 0.0
    for k in range(n):
        slots[k] = int(np.rint(t[k] / interval))
        rest[k] = t[k] - slots[k] * interval
        furthest = max(furthest, abs(rest[k]))
    most = pi / interval * furthest
    total[:size] = 0.0
    term = np.ones(n)
    share, power = 1.0, 0
    unit = 1.0 / (size * interval)
    factor = complex(1.0, 0.0)
    scale = 1.0
    while share > 1e-3:
        grid[:size] = 0.0
        for k in range(n):
            grid[slots[k]] += z[k] * term[k]
        _fourier(grid, size, wheel)
        if power == 0:
            for k in range(size):
                total[k] = grid[k]
        else:
            for k in range(size):
                w = 2 * pi * ((k if k < size // 2 else k - size) * unit)
                total[k] += factor * (w**power / scale) * grid[k]
        power += 1
        share *= most / power
        scale *= power
        factor *= -1j
        for k in range(n):
            term[k] *= rest[k]


@compiled
def _even(t: FloatArray, interval: float) -> bool:
    """Tell whether time stamps (n,) stand on consecutive places of the grid that `_transform` rounds them to.

    So near that the first of its terms is all there is.
    """
    furthest = 0.0
    for k in range(t.size):
        furthest = max(furthest, abs((t[k] - t[0]) - k * interval))
    return furthest <= 1e-4 * interval


@compiled
def _powers_of(tone: ComplexArray, value: ComplexArray, mean: complex, n: int, size: int, power: FloatArray) -> None:
    """Write the power that a tone of each frequency takes with the mean fitted along.

    Zero where tone and mean cannot be told apart.
    """
    for k in range(size):
        left = n - (tone[k].real ** 2 + tone[k].imag ** 2) / n
        if left > 1e-3 * n:
            part = value[k] - tone[k] * mean
            power[k] = (part.real**2 + part.imag**2) / left
        else:
            power[k] = 0.0


@compiled
def _peaks(power: FloatArray, size: int, unit: float, rates: FloatArray) -> int:
    """Write the frequencies, rad/s, of the highest local maxima above a tenth of the highest; return how many."""
    heights = np.full(_PEAKS, -1.0)
    places = np.zeros(_PEAKS, dtype=np.int64)
    for k in range(size):
        p = power[k]
        if p <= heights[_PEAKS - 1] or p < power[k - 1 if k else size - 1] or p < power[k + 1 if k + 1 < size else 0]:
            continue
        place = _PEAKS - 1
        while place > 0 and p > heights[place - 1]:
            heights[place], places[place] = heights[place - 1], places[place - 1]
            place -= 1
        heights[place], places[place] = p, k
    count = 0
    for i in range(_PEAKS):
        if heights[i] > 0.1 * heights[0]:
            k = places[i]
            rates[count] = 2 * pi * ((k if k < size // 2 else k - size) * unit)
            count += 1
    return count


# ------------------------------------------------------------------------------------------------ one window


@compiled
def _linear_start(
    tau: FloatArray, z: ComplexArray, half: float, rate: float, chirp: float, powers: int, parameters: FloatArray
) -> None:
    """Write tone and mean by least squares: two equations."""
    n = tau.size
    overlap, mean, product = 0j, 0j, 0j
    cosine, sine = np.empty(n), np.empty(n)
    turns(rate * tau + 0.5 * chirp * tau**2, cosine, sine)
    for k in range(n):
        tone = complex(cosine[k], -sine[k])
        overlap += tone
        mean += z[k]
        product += tone * z[k]
    overlap, mean, product = overlap / n, mean / n, product / n
    left = max(1 - abs(overlap) ** 2, 1e-9)
    amplitude = (product - overlap * mean) / left
    offset = mean - amplitude * overlap.conjugate()
    parameters[:] = 0.0
    parameters[0] = np.arctan2(amplitude.imag, amplitude.real)
    parameters[1] = rate * half
    if powers > 2:
        parameters[2] = 0.5 * chirp * half**2
    parameters[powers] = abs(amplitude)
    parameters[powers + 1] = offset.real
    parameters[powers + 2] = offset.imag


@compiled
def _positive(parameters: FloatArray, powers: int) -> None:
    if parameters[powers] < 0:
        parameters[powers] *= -1
        parameters[0] += pi


@compiled
def _fits(
    tau: FloatArray,
    x: FloatArray,
    z: ComplexArray,
    u: ComplexArray,
    half: float,
    interval: float,
    starts: FloatArray,
    powers: int,
    ellipse_sd: float,
    found: FloatArray,
    spread: FloatArray,
    variances: FloatArray,
    count: int,
) -> int:
    """Fit from each of ``starts`` (rate, chirp) and append what converges in the band; return how many there are."""
    for i in range(len(starts)):
        parameters, covariance = found[count], spread[count]
        _linear_start(tau, z, half, starts[i, 0], starts[i, 1], powers, parameters)
        variance, steps = fit_tone(x, z, u, parameters, covariance, powers, ellipse_sd, 0.0, MOST_STEPS)
        outside = abs(parameters[1] / half) > 1.02 * pi / interval
        if steps < 0 or outside or not np.all(np.isfinite(parameters)):
            continue
        _positive(parameters, powers)
        variances[count] = variance
        count += 1
    return count


@compiled
def _chirped(
    tau: FloatArray,
    z: ComplexArray,
    mean: complex,
    half: float,
    interval: float,
    size: int,
    wheel: ComplexArray,
    tone: ComplexArray,
    work: ComplexArray,
    power: FloatArray,
) -> FloatArray:
    """Return (rate, chirp) of the highest peaks over a grid of chirps, the highest last.

    A strong change of rate smears the line. About the mean, for hard iron would be smeared instead. The grid is spaced
    so that the phase at the window's ends is within a radian of one of them.
    """
    n = tau.size
    spacing = 4.0 / half**2
    steps = ceil(min(150.0, 24 * spacing) / spacing)
    rows = np.empty((2 * steps, 3))
    count = 0
    turned = np.empty(n, dtype=np.complex128)
    phase, cosine, sine = np.empty(n), np.empty(n), np.empty(n)
    unit = 1.0 / (size * interval)
    grid, value = work[:size], work[size : 2 * size]
    for step in range(-steps, steps + 1):
        if step == 0:
            continue
        chirp = spacing * step
        for k in range(n):
            phase[k] = -0.5 * chirp * tau[k] ** 2
        turns(phase, cosine, sine)
        total = 0j
        for k in range(n):
            turned[k] = (z[k] - mean) * complex(cosine[k], sine[k])
            total += turned[k]
        _transform(tau - tau[0], turned, interval, size, wheel, grid, value)
        _powers_of(tone, value, total / n, n, size, power)
        highest = int(np.argmax(power[:size]))
        # nothing turns in a row without power
        if power[highest] > 0:
            rows[count, 0] = power[highest]
            rows[count, 1] = 2 * pi * ((highest if highest < size // 2 else highest - size) * unit)
            rows[count, 2] = chirp
            count += 1
    kept = min(count, _PEAKS)
    highest_last = np.empty((kept, 2))
    for place in range(kept - 1, -1, -1):
        best = 0
        for row in range(1, count):
            # of equals the later one
            if rows[row, 0] >= rows[best, 0]:
                best = row
        highest_last[place, 0], highest_last[place, 1] = rows[best, 1], rows[best, 2]
        rows[best, 0] = -1.0
    return highest_last


@compiled
def _best(found: FloatArray, variances: FloatArray, count: int, n: int) -> int:
    """Return the fit of least variance, or -1 where another rate explains the data alike, or there is none."""
    if count == 0:
        return -1
    best = 0
    for i in range(1, count):
        if variances[i] < variances[best]:
            best = i
    for i in range(count):
        # different if a radian apart over the window; alike if the data prefer one by less than about 3.5 sd
        apart = abs(found[i, 1] - found[best, 1])
        if i != best and apart > 1.0 and 2 * n * log(variances[i] / variances[best]) < 12.0:
            return -1
    return best


@compiled
def _remaining(
    x: FloatArray, z: ComplexArray, parameters: FloatArray, powers: int, u: ComplexArray, interval: float
) -> tuple[float, float]:
    """Return how much neighbouring residuals correlate beyond chance, the larger of as read and turned with the field.

    A wandering axis, or a rate that no polynomial follows, leaves a residual that is smooth in one of both. The second
    value is the rms rate, rad/s, of the phase's part of it: a smooth signal's covariance falls by half its slope's
    variance times the lag squared, so between one and two lags, which no white noise reaches, by 3/2 of it.
    """
    n = x.size
    A, b = parameters[powers], complex(parameters[powers + 1], parameters[powers + 2])
    c = complex(parameters[powers + 3], parameters[powers + 4])
    residual, turned = np.empty(n, dtype=np.complex128), np.empty(n, dtype=np.complex128)
    total = 0.0
    for k in range(n):
        phase = 0.0
        for j in range(powers - 1, -1, -1):
            phase = phase * x[k] + parameters[j]
        direction = complex(cos(phase), sin(phase))
        E = u[k] * direction
        residual[k] = z[k] - b - A * (E + c * E.conjugate())
        turned[k] = residual[k] * direction.conjugate()
        total += residual[k].real ** 2 + residual[k].imag ** 2
    if not total > 0:
        return 0.0, 0.0
    as_read, with_field, once, twice = 0.0, 0.0, 0.0, 0.0
    for k in range(1, n):
        as_read += (residual[k] * residual[k - 1].conjugate()).real
        with_field += (turned[k] * turned[k - 1].conjugate()).real
        once += turned[k].imag * turned[k - 1].imag
        if k > 1:
            twice += turned[k].imag * turned[k - 2].imag
    # of white noise the real part scatters by 1/sqrt(2 n)
    correlation = max(0.0, max(as_read, with_field) / total - 3 / sqrt(2 * n))
    fall = (once / (n - 1) - twice / (n - 2)) / A**2
    return correlation, sqrt(max(0.0, fall / 1.5)) / interval


#: What a window says: nothing at this length; nothing, at any; or its tone.
_LONGER, _NEVER, _TOLD = 0, 1, 2


@compiled
def _tell(
    x: FloatArray,
    z: ComplexArray,
    u: ComplexArray,
    half: float,
    interval: float,
    parameters: FloatArray,
    covariance: FloatArray,
    variance: float,
    powers: int,
    last: bool,
    limits: tuple[float, float, float],
    row: FloatArray,
) -> int:
    """Judge a fit and write what it tells into ``row``; ``limits`` are least turns and significance, and largest sd."""
    least_turns, significance, largest_sd = limits
    rate = parameters[1] / half
    few = abs(rate) * 2 * half < 2 * pi * least_turns
    if few and not last:
        return _LONGER
    sd = sqrt(covariance[1, 1] * variance) / half
    misfit = variance > LARGEST_SHARE * parameters[powers] ** 2
    if misfit and not few:
        return _NEVER  # whole turns that no tone explains: a longer window explains them no better
    if parameters[powers] < significance * sqrt(covariance[powers, powers] * variance):
        return _LONGER
    if sd > largest_sd or sd > 0.25 * abs(rate) or misfit:
        return _LONGER
    correlation, wobble = _remaining(x, z, parameters, powers, u, interval)
    # n white samples are worth more than n correlated ones
    worth = (1 + correlation) / max(1 - correlation, 0.05)
    row[0] = parameters[0]
    row[1] = sqrt(covariance[0, 0] * variance * worth)
    row[2] = rate
    row[3] = sqrt(covariance[1, 1] * variance * worth) / half
    row[4] = 2 * parameters[2] / half**2 if powers > 2 else 0.0
    row[5] = parameters[powers]
    row[7] = sqrt(variance)
    row[10] = correlation
    row[11] = wobble
    row[12] = parameters[powers + 1]
    row[13] = parameters[powers + 2]
    return _TOLD


# ------------------------------------------------------------------------------------------------ all windows


@compiled_nogil
def search_windows(
    t: FloatArray,
    m: FloatArray,
    centres: FloatArray,
    lengths: FloatArray,
    first: IndexArray,
    after: IndexArray,
    interval: float,
    span: float,
    degree: int,
    ellipse_sd: float,
    limits: tuple[float, float, float],
    table: FloatArray,
) -> None:
    """Fill ``table`` (w, columns) with the tones of windows about ``centres`` (w,); rows stay where nothing is told.

    ``lengths`` (k,) are tried in turn; ``first`` and ``after`` (k, w) are the ranges of the readings at times t (n,)
    and field m (n, 3). ``interval`` and ``span`` are the readings' usual spacing and the length of them all, s.
    """
    powers = degree + 2
    most = 1 + 2 * _PEAKS
    found, spread = np.empty((most, powers + 5)), np.empty((most, powers + 5, powers + 5))
    variances, rates = np.empty(most), np.empty(_PEAKS)
    wheel = _wheel(2)
    work, tone, power = np.empty(4, dtype=np.complex128), np.empty(2, dtype=np.complex128), np.empty(2)
    known, before, slope, at = False, 0.0, 0.0, 0.0
    shown, shown_size = 0, 0
    for index in range(centres.size):
        centre = centres[index]
        for number in range(lengths.size):
            lo, hi = first[number, index], after[number, index]
            n = hi - lo
            if n < degree + 12 or n < 0.5 * min(lengths[number], span) / interval:
                known = False
                continue
            half = 0.5 * (t[hi - 1] - t[lo])
            tau = t[lo:hi] - centre
            x = tau / half
            z = m[lo:hi, 0] + 1j * m[lo:hi, 1]
            u = np.ones(n, dtype=np.complex128)
            size = int(2 ** ceil(log2(4 * (tau[-1] - tau[0] + interval) / interval)))
            if size > 2 * wheel.size:
                wheel, shown = _wheel(size), 0
                work, tone = np.empty(2 * size, dtype=np.complex128), np.empty(size, dtype=np.complex128)
                power = np.empty(size)
            # on an even grid the windows of n readings have one transform of ones
            even = n if _even(tau, interval) else 0
            if even == 0 or shown != even or shown_size != size:
                _transform(tau - tau[0], u, interval, size, wheel, work[:size], tone)
            shown, shown_size = even, size
            _transform(tau - tau[0], z, interval, size, wheel, work[:size], work[size:])
            mean = np.sum(z) / n
            _powers_of(tone, work[size:], mean, n, size, power)
            count = _peaks(power, size, 1.0 / (size * interval), rates)
            # of a type, not the number itself: for that one numba would compile the function once more
            found_so_far = int(np.int64(0))
            if known:
                starts = np.empty((1, 2))
                starts[0, 0], starts[0, 1] = before + slope * (centre - at), slope
                found_so_far = _fits(
                    tau, x, z, u, half, interval, starts, powers, ellipse_sd, found, spread, variances, found_so_far
                )
                # the highest peak, where that fit has found it, leads to the same one
                if found_so_far and count and abs(rates[0] - found[0, 1] / half) < pi / (n * interval):
                    count -= 1
                    for k in range(count):
                        rates[k] = rates[k + 1]
            starts = np.zeros((count, 2))
            starts[:, 0] = rates[:count]
            count = _fits(
                tau, x, z, u, half, interval, starts, powers, ellipse_sd, found, spread, variances, found_so_far
            )
            about = 0.0
            for k in range(n):
                about += (z[k] - mean).real ** 2 + (z[k] - mean).imag ** 2
            if number == 0 and (count == 0 or np.min(variances[:count]) * 2 * n > 0.2 * about):
                starts = _chirped(tau, z, mean, half, interval, size, wheel, tone, work, power)
                count = _fits(tau, x, z, u, half, interval, starts, powers, ellipse_sd, found, spread, variances, count)
            best = _best(found, variances, count, n)
            if best < 0:
                known = False
                continue
            verdict = _tell(
                x, z, u, half, interval, found[best], spread[best], variances[best], powers,
                number == lengths.size - 1, limits, table[index],
            )  # fmt: skip
            if verdict == _NEVER:
                break
            if verdict == _TOLD:
                table[index, 6] = np.mean(m[lo:hi, 2])
                table[index, 8] = lengths[number]
                table[index, 9] = 0.0
                known, before, slope, at = True, table[index, 2], table[index, 4], centre
                break


@compiled_nogil
def turn_windows(
    t: FloatArray,
    m: FloatArray,
    centres: FloatArray,
    start: FloatArray,
    first: IndexArray,
    after: IndexArray,
    interval: float,
    span: float,
    degree: int,
    ellipse_sd: float,
    limits: tuple[float, float, float],
    axial: float,
    rates: ComplexArray,
    table: FloatArray,
) -> None:
    """Fill ``table`` as `search_windows` does, from its tones ``start``, with the field's turning by p and q.

    ``rates`` (n - 1, substeps) are p + i q at the middles of sub-steps between the readings; ``axial`` is the hard iron
    along z. The turning needs the phase and the phase the turning, so thrice.
    """
    powers = degree + 2
    parameters, covariance = np.empty(powers + 5), np.empty((powers + 5, powers + 5))
    for index in range(centres.size):
        lo, hi, length = first[index], after[index], start[index, 8]
        n = hi - lo
        if not np.isfinite(start[index, 2]) or n < degree + 12 or n < 0.5 * min(length, span) / interval:
            continue
        centre, half = centres[index], 0.5 * (t[hi - 1] - t[lo])
        tau = t[lo:hi] - centre
        x = tau / half
        z = m[lo:hi, 0] + 1j * m[lo:hi, 1]
        u = np.ones(n, dtype=np.complex128)
        mean_z = float(np.mean(m[lo:hi, 2]))
        _linear_start(tau, z, half, start[index, 2], start[index, 4], powers, parameters)
        variance, steps, along = 0.0, 0, 0.0
        for _ in range(3):
            along = field_shape(
                t[lo:hi], centre, half, parameters, powers, mean_z - axial, rates[lo : hi - 1], rates.shape[1], u
            )
            variance, steps = fit_tone(x, z, u, parameters, covariance, powers, ellipse_sd, 0.0, MOST_STEPS)
            if steps < 0:
                break
        if steps < 0:
            continue
        _positive(parameters, powers)
        row = table[index]
        if (
            _tell(x, z, u, half, interval, parameters, covariance, variance, powers, bool(np.bool_(True)), limits, row)
            == _TOLD
        ):
            row[6], row[8], row[9] = mean_z, length, along
