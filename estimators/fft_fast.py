"""The highest peak of a zero-padded spectrum, exactly as the padded transform finds it, at a tenth of its cost.

Counted from the window's centre, the transform X(theta) of n samples holds frequencies up to (n - 1)/2. It is computed
on a coarse grid of M >= 8 (n - 1) points, and

- its greatest power anywhere is at most the greatest on the grid over cos(pi (n - 1)/M) (Ehlich and Zeller 1964);
- by Bernstein's inequality its m-th derivative is at most ((n - 1)/2)^m times its greatest value.

A maximum inside a range is flat, so it exceeds the nearest coarse value by at most (pi/M)^2/2 times the greatest second
derivative nearby. Only around coarse points within that of the best value, and at the ends of the range, must the fine
grid be looked at. There X is interpolated by a polynomial through eight coarse points, whose error is bounded by the
eighth derivative (6e-7 of the greatest value); orders within that of the best are then computed one by one from the
samples. So no peak of the padded transform can be missed. An offset, which the paper leaves in the window, has a closed
form and is bounded on its own: its transform falls off away from zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.fft

from discsim.arrays import ComplexArray, FloatArray, readonly
from discsim.compiled import compiled, compiled_nogil
from discsim.estimators.spin_spline import IndexArray

__all__ = ["Spectra", "dirichlet", "highest", "padded_peak", "spectra", "transform_at"]

#: Windows transformed at once by `padded_peak`: their coarse spectra, 1 MB at n = 128, stay in a core's cache.
CHUNK = 64

#: Coarse points on either side of an order through which the polynomial goes.
SIDE = 4


@dataclass(frozen=True)
class Spectra:
    """What is known of the padded spectra of windows before they are searched.

    Attributes
    ----------
    still : (w, n) array
        The windows, each less its mean.
    mean : (w,) array
        Those means.
    coarse : (w, M/2 + 1 + 2 SIDE) array
        Transforms of ``still`` on the coarse grid, phases counted from the centre, with SIDE points beyond either end.
    strongest : (w,) array
        The coarse point, from zero frequency, at which each is greatest.
    total : int
        Length of the padded window, n + k of (P-2).
    """

    still: FloatArray
    mean: FloatArray
    coarse: ComplexArray
    strongest: IndexArray
    total: int

    @property
    def strongest_order(self) -> FloatArray:
        """Order of the strongest line of each window without its mean, (w,), to half a coarse step."""
        coarse_size = 2 * (self.coarse.shape[1] - 1 - 2 * SIDE)
        return np.asarray(self.strongest * (self.total / coarse_size))


def spectra(still: FloatArray, mean: FloatArray, total: int) -> Spectra:
    """Transform windows (w, n), given less their means (w,), on the coarse grid."""
    n = still.shape[1]
    coarse_size = 1 << int(np.ceil(np.log2(8 * max(n - 1, 1))))
    coarse = np.empty((len(still), coarse_size // 2 + 1 + 2 * SIDE), dtype=complex)
    strongest = np.empty(len(still), dtype=np.int64)
    _centre(scipy.fft.rfft(still, coarse_size, axis=1), _centring(n, coarse_size), (-1) ** (n - 1), coarse, strongest)
    return Spectra(still, mean, coarse, strongest, total)


def highest(
    windows: Spectra,
    first: IndexArray,
    last: IndexArray,
    *,
    offset: bool = True,
    above: FloatArray | None = None,
) -> tuple[IndexArray, FloatArray]:
    """Return order and power of the greatest of orders first..last of each window's padded transform, (P-4), (P-5).

    Parameters
    ----------
    windows : Spectra
        Of w windows.
    first, last : (w,) arrays
        Inclusive range of orders searched, 0 to total // 2; where it is empty, order and power are -1.
    offset : bool
        Whether the windows keep their means.
    above : (w,) array or None
        Power that a peak must exceed to count; where none does, order and power are -1. The higher, the less there is
        to be looked at.

    Returns
    -------
    order, power : (w,) arrays
        As ``argmax`` and ``max`` of ``abs(rfft(x, total))**2`` over the range; of two values that are the same to
        rounding either may be taken.
    """
    n, total = windows.still.shape[1], windows.total
    coarse_size = 2 * (windows.coarse.shape[1] - 1 - 2 * SIDE)
    order = np.full(len(windows.mean), -1, dtype=np.int64)
    power = np.full(len(windows.mean), -1.0) if above is None else np.maximum(above, -1.0)
    _search(
        windows.still,
        windows.mean if offset else np.zeros_like(windows.mean),
        windows.coarse,
        windows.strongest,
        _turns(total),
        _weights(total, coarse_size),
        _box(n, total),
        _box(n, coarse_size),
        _steep(n, coarse_size, total),
        first,
        last,
        order,
        power,
    )
    return order, np.where(order < 0, -1.0, power)


def padded_peak(x: FloatArray, total: int, first: IndexArray, last: IndexArray) -> tuple[IndexArray, FloatArray]:
    """Return `highest` of windows x (w, n), however many."""
    order, power = np.empty(len(x), dtype=np.int64), np.empty(len(x))
    for start in range(0, len(x), CHUNK):
        part = slice(start, start + CHUNK)
        mean = x[part].mean(axis=1)
        windows = spectra(np.ascontiguousarray(x[part] - mean[:, None]), mean, total)
        order[part], power[part] = highest(windows, first[part], last[part])
    return order, power


def transform_at(windows: Spectra, order: IndexArray) -> ComplexArray:
    """Return one value (w,) of each window's padded transform, without its mean, phases counted from the centre.

    Its real part is ``sum(x cos)`` and its imaginary part ``-sum(x sin)`` with the angle zero at the centre.
    """
    value = _values_at(windows.still, _turns(windows.total), order)
    return np.asarray(value * np.exp(1j * np.pi * (windows.still.shape[1] - 1) * order / windows.total))


def dirichlet(theta: FloatArray, n: int) -> FloatArray:
    """Return sin(n theta/2)/sin(theta/2), the transform of n ones counted from their centre, for theta below 2 pi."""
    sine = np.sin(theta / 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.abs(sine) > 1e-12, np.sin(n * theta / 2) / sine, n * np.cos((n - 1) * theta / 2))


@lru_cache(maxsize=4)
def _centring(n: int, coarse_size: int) -> ComplexArray:
    """Factors (M/2 + 1,) that count the phases of a coarse spectrum from the window's centre."""
    factors: ComplexArray = np.exp(1j * np.pi * (n - 1) * np.arange(coarse_size // 2 + 1) / coarse_size)
    factors.flags.writeable = False
    return factors


@lru_cache(maxsize=4)
def _turns(total: int) -> ComplexArray:
    """exp(-2 pi i k/total), (total,)."""
    angle = 2 * np.pi * np.arange(total) / total
    table: ComplexArray = np.cos(angle) - 1j * np.sin(angle)
    table.flags.writeable = False
    return table


@lru_cache(maxsize=4)
def _weights(total: int, coarse_size: int) -> FloatArray:
    """Lagrange's weights (total // 2 + 1, 2 SIDE) of the coarse points around each order, from SIDE - 1 before it."""
    place = np.arange(total // 2 + 1) * coarse_size / total
    u = place - np.floor(place)
    points = np.arange(2 * SIDE) - (SIDE - 1)
    weights = np.ones((u.size, 2 * SIDE))
    for i in range(2 * SIDE):
        for j in range(2 * SIDE):
            if i != j:
                weights[:, i] *= (u - points[j]) / (points[i] - points[j])
    return readonly(weights)


@lru_cache(maxsize=8)
def _box(n: int, total: int) -> FloatArray:
    """Transform of an offset of one at each order, (total // 2 + 1,)."""
    return readonly(dirichlet(2 * np.pi * np.arange(total // 2 + 1) / total, n))


@lru_cache(maxsize=4)
def _steep(n: int, coarse_size: int, total: int) -> FloatArray:
    """Return what |D|, 2|D'|/n and 4|D''|/n^2 cannot exceed within half a step and an order of each coarse point.

    (3, M/2 + 1). D(theta) = sin(n theta/2)/sin(theta/2) is the transform of an offset of one about the window's centre,
    theta the angle per sample; with s = sin(theta/2) its derivatives are below the sums here, and by Bernstein below n.
    """
    theta = 2 * np.pi * ((np.arange(coarse_size // 2 + 1) - 0.5) / coarse_size - 1 / total)
    s = np.maximum(np.sin(np.clip(theta, 0.0, np.pi) / 2), 1e-9)
    bounds = np.stack([1 / s, 1 / s + 1 / (n * s**2), 1 / s + 2 / (n * s**2) + 2 / (n**2 * s**3)])
    return readonly(np.minimum(bounds, n))


@compiled_nogil
def _centre(
    spectrum: ComplexArray, centring: ComplexArray, mirror: int, coarse: ComplexArray, strongest: IndexArray
) -> None:
    """Fill ``coarse`` and ``strongest`` of `Spectra` from the transforms of the windows."""
    nodes = spectrum.shape[1]
    for i in range(spectrum.shape[0]):
        greatest = -1.0
        for j in range(nodes):
            value = spectrum[i, j] * centring[j]
            coarse[i, SIDE + j] = value
            power = value.real**2 + value.imag**2
            if power > greatest:
                greatest, strongest[i] = power, j
        # beyond zero and half the sampling rate a real signal repeats itself, conjugate
        for j in range(1, SIDE + 1):
            coarse[i, SIDE - j] = np.conj(coarse[i, SIDE + j])
            coarse[i, SIDE + nodes - 1 + j] = mirror * np.conj(coarse[i, SIDE + nodes - 1 - j])


@compiled
def _value_at(x: FloatArray, table: ComplexArray, order: int) -> complex:
    """One value of the padded transform."""
    total, angle = table.size, 0
    real, imaginary = 0.0, 0.0
    for k in range(x.size):
        real += x[k] * table[angle].real
        imaginary += x[k] * table[angle].imag
        angle += order
        angle -= total if angle >= total else 0
    return complex(real, imaginary)


@compiled_nogil
def _values_at(x: FloatArray, table: ComplexArray, order: IndexArray) -> ComplexArray:
    out = np.empty(order.size, dtype=np.complex128)
    for i in range(order.size):
        out[i] = _value_at(x[i], table, order[i])
    return out


@compiled_nogil
def _search(
    still: FloatArray,
    mean: FloatArray,
    coarse: ComplexArray,
    strongest: IndexArray,
    table: ComplexArray,
    weights: FloatArray,
    box: FloatArray,
    coarse_box: FloatArray,
    steep: FloatArray,
    first: IndexArray,
    last: IndexArray,
    order: IndexArray,
    power: FloatArray,
) -> None:
    """Search each window's range for a power above ``power``; ``coarse`` has SIDE points beyond either end."""
    n, total = still.shape[1], table.size
    nodes = steep.shape[1]
    coarse_size = 2 * (nodes - 1)
    step, step_of_order = np.pi / coarse_size, 2 * np.pi / total
    # remainder of the polynomial: the eighth derivative over 8! times the greatest product of distances, (7!!/2^4)^2
    interpolation = (step * (n - 1)) ** 8 * 43.1 / 40320.0
    rough = np.empty(nodes)
    tried = np.empty(total + 2 * nodes, dtype=np.int64)
    found = np.empty(total + 2 * nodes)
    for i in range(still.shape[0]):
        if last[i] < first[i]:
            continue
        # of the window without its offset, anywhere
        line = abs(coarse[i, SIDE + strongest[i]]) / np.sqrt(np.cos(step * (n - 1)))
        # of an interpolated value; of two powers that are compared each may be wrong by it
        error = interpolation * line
        offset = abs(mean[i])
        low = max(0, (first[i] * coarse_size) // total)
        high = min(nodes - 1, -((-last[i] * coarse_size) // total))
        best, count = power[i], 0
        top, at = -1.0, first[i]
        for j in range(low, high + 1):
            value = coarse[i, SIDE + j] + mean[i] * coarse_box[j]
            rough[j] = value.real**2 + value.imag**2
            if rough[j] > top:
                k = (2 * j * total + coarse_size) // (2 * coarse_size)
                if first[i] <= k <= last[i]:
                    top, at = rough[j], k
        # maxima at the ends of the range are not flat: look at them themselves
        for k in (first[i], last[i], at):
            tried[count], found[count] = k, _interpolated(coarse[i], mean[i], weights, box, coarse_size, total, k)
            best = max(best, found[count])
            count += 1
        margin = 2 * error * (2 * np.sqrt(max(best, 0.0)) + 3 * error)
        for j in range(low, high + 1):
            # P'' = 2 |X'|^2 + 2 Re(X* X''), each of X at most that of the line and of the offset
            slope = line + offset * steep[1, j]
            bend = (line + offset * steep[0, j]) * (line + offset * steep[2, j])
            curvature = 0.5 * n * n * (slope * slope + bend)
            # the best order may be one off the maximum that it stands for
            slack = 0.5 * (step + step_of_order) ** 2 * curvature
            if rough[j] + slack + margin < best:
                continue
            # padded orders nearer to this coarse point than to its neighbours
            begin = max(-((-(2 * j - 1) * total) // (2 * coarse_size)), first[i])
            stop = min(((2 * j + 1) * total) // (2 * coarse_size), last[i])
            for k in range(begin, stop + 1):
                tried[count], found[count] = k, _interpolated(coarse[i], mean[i], weights, box, coarse_size, total, k)
                best = max(best, found[count])
                count += 1
            margin = 2 * error * (2 * np.sqrt(max(best, 0.0)) + 3 * error)
        for m in range(count):
            if found[m] + margin < best:
                continue
            value = _value_at(still[i], table, tried[m]) * np.exp(1j * step_of_order * (n - 1) / 2 * tried[m])
            value += mean[i] * box[tried[m]]
            value_at = value.real**2 + value.imag**2
            if value_at > power[i] or (value_at == power[i] and tried[m] < order[i]):
                power[i], order[i] = value_at, tried[m]


@compiled
def _interpolated(
    coarse: ComplexArray,
    mean: float,
    weights: FloatArray,
    box: FloatArray,
    coarse_size: int,
    total: int,
    order: int,
) -> float:
    """Power at an order, by the polynomial through the coarse points around it and the offset's own transform."""
    start = (order * coarse_size) // total + 1  # of SIDE points beyond the end and SIDE - 1 before the order
    real: float = mean * box[order]
    imaginary = 0.0
    for i in range(2 * SIDE):
        real += weights[order, i] * coarse[start + i].real
        imaginary += weights[order, i] * coarse[start + i].imag
    return real * real + imaginary * imaginary
