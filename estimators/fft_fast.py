"""The highest peak of a zero-padded spectrum, exactly as the padded transform finds it, at a tenth of its cost.

The power |X(f)|^2 of n samples is a trigonometric polynomial of degree n - 1. On a coarse grid of M >= 8 (n - 1) points

- its greatest value anywhere is at most the greatest on the grid over cos(pi (n - 1)/M) (Ehlich and Zeller 1964), and
- by Bernstein's inequality its second derivative is at most (n - 1)^2 times that greatest value.

A maximum inside a range is flat, so it exceeds the nearest coarse value by at most (pi/M)^2/2 times the greatest second
derivative nearby. Only around coarse points within that of the best value, and at the ends of the range, must the fine
grid be looked at; there its values are computed one by one. So no peak of the padded transform can be missed. An
offset, which the paper leaves in the window, is bounded on its own: its transform falls off away from zero.
"""

from __future__ import annotations

import numpy as np
import scipy.fft

from discsim.arrays import FloatArray
from discsim.compiled import compiled
from estimators.spin_spline import IndexArray
from estimators.tone import ComplexArray

__all__ = ["padded_peak"]

#: Windows transformed at once: their coarse spectra take 4 MB at n = 128.
CHUNK = 512


def padded_peak(x: FloatArray, total: int, first: IndexArray, last: IndexArray) -> tuple[IndexArray, FloatArray]:
    """Return order and power of the greatest of orders first..last of each window's padded transform, (P-4), (P-5).

    Parameters
    ----------
    x : (w, n) array
        Windows of real samples.
    total : int
        Length of the padded window, n + k of (P-2).
    first, last : (w,) arrays
        Inclusive range of orders searched, 0 to total // 2; where it is empty, order and power are -1.

    Returns
    -------
    order, power : (w,) arrays
        As ``argmax`` and ``max`` of ``abs(rfft(x, total))**2`` over the range; of two values that are the same to
        rounding either may be taken.
    """
    windows, n = x.shape
    coarse_size = 1 << int(np.ceil(np.log2(8 * max(n - 1, 1))))
    order = np.full(windows, -1, dtype=np.int64)
    power = np.full(windows, -1.0)
    angle = 2 * np.pi * np.arange(total) / total
    table = np.cos(angle) - 1j * np.sin(angle)
    if coarse_size >= total:  # nothing is gained
        for start in range(0, windows, CHUNK):
            part = slice(start, min(start + CHUNK, windows))
            spectrum = scipy.fft.rfft(x[part], total, axis=1)
            everything = spectrum.real**2 + spectrum.imag**2
            _search_all(everything, first[part], last[part], order[part], power[part])
        return order, power
    box = scipy.fft.rfft(np.ones(n), coarse_size)
    steep = _offset_bounds(n, coarse_size)
    for start in range(0, windows, CHUNK):
        part = slice(start, min(start + CHUNK, windows))
        block = np.ascontiguousarray(x[part], dtype=np.float64)
        mean = block.mean(axis=1)
        spectrum = scipy.fft.rfft(block - mean[:, None], coarse_size, axis=1)
        _search(
            block, mean, spectrum, box, steep, table, coarse_size, first[part], last[part], order[part], power[part]
        )
    return order, power


def _offset_bounds(n: int, coarse_size: int) -> FloatArray:
    """Return what |D|, 2|D'|/n and 4|D''|/n^2 cannot exceed within half a step of each coarse point, (3, nodes).

    D(theta) = sin(n theta/2)/sin(theta/2) is the transform of an offset of one about the window's centre, theta the
    angle per sample; with s = sin(theta/2) its derivatives are below the sums here, and by Bernstein below n.
    """
    theta = 2 * np.pi * (np.arange(coarse_size // 2 + 1) - 0.5) / coarse_size
    s = np.maximum(np.sin(np.clip(theta, 0.0, np.pi) / 2), 1e-9)
    bounds = np.stack([1 / s, 1 / s + 1 / (n * s**2), 1 / s + 2 / (n * s**2) + 2 / (n**2 * s**3)])
    return np.asarray(np.minimum(bounds, n))


@compiled
def _search_all(coarse: FloatArray, first: IndexArray, last: IndexArray, order: IndexArray, power: FloatArray) -> None:
    for i in range(coarse.shape[0]):
        for k in range(first[i], last[i] + 1):
            if coarse[i, k] > power[i]:
                power[i], order[i] = coarse[i, k], k


@compiled
def _power_at(x: FloatArray, table: ComplexArray, order: int) -> float:
    """One value of the padded power spectrum; four running sums, since one would wait for its own last addition."""
    n, total = x.size, table.size
    re0, re1, re2, re3 = 0.0, 0.0, 0.0, 0.0
    im0, im1, im2, im3 = 0.0, 0.0, 0.0, 0.0
    stride = (4 * order) % total
    i0, i1, i2, i3 = 0, order % total, (2 * order) % total, (3 * order) % total
    whole = n - n % 4
    for k in range(0, whole, 4):
        re0 += x[k] * table[i0].real
        im0 += x[k] * table[i0].imag
        re1 += x[k + 1] * table[i1].real
        im1 += x[k + 1] * table[i1].imag
        re2 += x[k + 2] * table[i2].real
        im2 += x[k + 2] * table[i2].imag
        re3 += x[k + 3] * table[i3].real
        im3 += x[k + 3] * table[i3].imag
        i0 += stride
        i1 += stride
        i2 += stride
        i3 += stride
        i0 -= total if i0 >= total else 0
        i1 -= total if i1 >= total else 0
        i2 -= total if i2 >= total else 0
        i3 -= total if i3 >= total else 0
    for k in range(whole, n):
        angle = (k * order) % total
        re0 += x[k] * table[angle].real
        im0 += x[k] * table[angle].imag
    real, imaginary = re0 + re1 + re2 + re3, im0 + im1 + im2 + im3
    return real * real + imaginary * imaginary


@compiled
def _search(
    x: FloatArray,
    mean: FloatArray,
    spectrum: ComplexArray,
    box: ComplexArray,
    steep: FloatArray,
    table: ComplexArray,
    coarse_size: int,
    first: IndexArray,
    last: IndexArray,
    order: IndexArray,
    power: FloatArray,
) -> None:
    n, total = x.shape[1], table.size
    nodes = spectrum.shape[1]
    step = np.pi / coarse_size
    coarse = np.empty(nodes)
    for i in range(x.shape[0]):
        if last[i] < first[i]:
            continue
        greatest = 0.0
        for j in range(nodes):
            greatest = max(greatest, spectrum[i, j].real ** 2 + spectrum[i, j].imag ** 2)
        # of the window without its offset, anywhere
        line = np.sqrt(greatest / np.cos(step * (n - 1)))
        low = max(0, (first[i] * coarse_size) // total)
        high = min(nodes - 1, -((-last[i] * coarse_size) // total))
        top, at = -1.0, first[i]
        for j in range(low, high + 1):
            value = spectrum[i, j] + mean[i] * box[j]
            coarse[j] = value.real**2 + value.imag**2
            k = (2 * j * total + coarse_size) // (2 * coarse_size)
            if coarse[j] > top and first[i] <= k <= last[i]:
                top, at = coarse[j], k
        best = -1.0
        # maxima at the ends of the range are not flat: look at them themselves
        for k in (first[i], last[i], at):
            value_at = _power_at(x[i], table, k)
            if value_at > best:
                best, order[i] = value_at, k
        offset = abs(mean[i])
        for j in range(low, high + 1):
            # P'' = 2 |X'|^2 + 2 Re(X* X''), each of X at most that of the line and of the offset
            slope = line + offset * steep[1, j]
            bend = (line + offset * steep[0, j]) * (line + offset * steep[2, j])
            curvature = 0.5 * n * n * (slope * slope + bend)
            # the best order may be one off the maximum that it stands for
            slack = 0.5 * (step + 2 * np.pi / total) ** 2 * curvature
            if coarse[j] + slack < best:
                continue
            # padded orders nearer to this coarse point than to its neighbours, every fourth first
            begin = max(-((-(2 * j - 1) * total) // (2 * coarse_size)), first[i])
            stop = min(((2 * j + 1) * total) // (2 * coarse_size), last[i])
            # between them power changes by less than this, by the same bound over three orders
            small = 0.5 * (6 * np.pi / total) ** 2 * curvature
            for quarter in range(begin + 2, stop + 3, 4):
                middle = min(quarter, stop)
                value_at = _power_at(x[i], table, middle)
                if value_at > best or (value_at == best and middle < order[i]):
                    best, order[i] = value_at, middle
                if value_at + small < best:
                    continue
                for k in range(max(begin, middle - 2), min(stop, middle + 2) + 1):
                    if k != middle:
                        value_at = _power_at(x[i], table, k)
                        if value_at > best or (value_at == best and k < order[i]):
                            best, order[i] = value_at, k
        power[i] = best
