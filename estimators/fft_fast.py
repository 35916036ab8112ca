"""The highest peak of a zero-padded spectrum, exactly as the padded transform finds it, at a tenth of its cost.

The power |X(f)|^2 of n samples is a trigonometric polynomial of degree n - 1. On a coarse grid of M >= 8 (n - 1) points

- its greatest value anywhere is at most the greatest on the grid over cos(pi (n - 1)/M) (Ehlich and Zeller 1964), and
- by Bernstein's inequality its second derivative is at most (n - 1)^2 times that greatest value.

A maximum inside a range is flat, so it exceeds the nearest coarse value by at most (pi (n - 1)/M)^2/2 = 8 % of the
greatest value. Only around coarse points within that of the best one, and at the ends of the range, must the fine
grid be looked at; there its values are computed one by one. So no peak of the padded transform can be missed.
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
    for start in range(0, windows, CHUNK):
        part = slice(start, min(start + CHUNK, windows))
        # nothing is gained by a coarse grid as fine as the padded one
        spectrum = scipy.fft.rfft(x[part], min(coarse_size, total), axis=1)
        coarse = spectrum.real**2 + spectrum.imag**2
        if coarse_size >= total:
            _search_all(coarse, first[part], last[part], order[part], power[part])
        else:
            block = np.ascontiguousarray(x[part])
            _search(block, coarse, table, coarse_size, first[part], last[part], order[part], power[part])
    return order, power


@compiled
def _search_all(coarse: FloatArray, first: IndexArray, last: IndexArray, order: IndexArray, power: FloatArray) -> None:
    for i in range(coarse.shape[0]):
        for k in range(first[i], last[i] + 1):
            if coarse[i, k] > power[i]:
                power[i], order[i] = coarse[i, k], k


@compiled
def _power_at(x: FloatArray, table: ComplexArray, order: int) -> float:
    real, imaginary = 0.0, 0.0
    total = table.size
    index = 0
    for k in range(x.size):
        real += x[k] * table[index].real
        imaginary += x[k] * table[index].imag
        index += order
        if index >= total:
            index -= total
    return real * real + imaginary * imaginary


@compiled
def _search(
    x: FloatArray,
    coarse: FloatArray,
    table: ComplexArray,
    coarse_size: int,
    first: IndexArray,
    last: IndexArray,
    order: IndexArray,
    power: FloatArray,
) -> None:
    n, total = x.shape[1], table.size
    nodes = coarse.shape[1]
    reach = np.pi * (n - 1) / coarse_size
    for i in range(x.shape[0]):
        if last[i] < first[i]:
            continue
        greatest = 0.0
        for j in range(nodes):
            greatest = max(greatest, coarse[i, j])
        # any maximum is within this of the nearest coarse value
        slack = 0.5 * reach * reach * greatest / np.cos(reach)
        low = max(0, (first[i] * coarse_size) // total)
        high = min(nodes - 1, -((-last[i] * coarse_size) // total))
        best = -1.0
        # coarse points inside the range are met by the padded grid only if its size is a multiple: compute the ends
        for end in (first[i], last[i]):
            value = _power_at(x[i], table, end)
            if value > best:
                best, order[i] = value, end
        top, at = -1.0, -1
        for j in range(low, high + 1):
            k = (2 * j * total + coarse_size) // (2 * coarse_size)
            if first[i] <= k <= last[i] and coarse[i, j] > top:
                top, at = coarse[i, j], k
        if at >= 0:
            value = _power_at(x[i], table, at)
            if value > best:
                best, order[i] = value, at
        for j in range(low, high + 1):
            if coarse[i, j] + slack < best:
                continue
            # padded orders nearer to this coarse point than to its neighbours
            begin = -((-(2 * j - 1) * total) // (2 * coarse_size))
            stop = ((2 * j + 1) * total) // (2 * coarse_size)
            for k in range(max(begin, first[i]), min(stop, last[i]) + 1):
                value = _power_at(x[i], table, k)
                if value > best or (value == best and k < order[i]):
                    best, order[i] = value, k
        power[i] = best
