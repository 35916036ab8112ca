"""The turning field's attitude, and the normal equations of everything that moves it (compiled).

A parameter of a spline turns the body while its splines act, and has turned it by the same vector ever after. So its
row of the normal matrix needs sums while it acts, and sums backwards from the end for what came later: two parameters
that never act together need the product of two short vectors, whatever the number of readings between.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from discsim.arrays import ComplexArray, FloatArray
from discsim.compiled import compiled, compiled_nogil, compiled_nogil_sums, compiled_sums
from discsim.estimators.spin_spline import IndexArray

__all__ = ["SOFT", "add_normal_equations", "integrate"]

#: rows and columns of the six parameters of soft iron
SOFT = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
#: readings whose derivatives are multiplied with each other at once: so the sums run along memory
TOGETHER = 32
#: most parameters that act at one time: four of the spin's spline and of each of two others
ACTING = 12


@compiled_nogil
def integrate(
    times: FloatArray,
    substeps: int,
    first: IndexArray,
    weights: FloatArray,
    spin: FloatArray,
    body: ComplexArray,
    despun: ComplexArray,
    attitude: FloatArray,
    psi_at: FloatArray,
    axes: FloatArray,
    turn: FloatArray,
) -> None:
    """Integrate the attitude from rates at the middle of equal sub-steps between ``times`` (n,).

    Written: ``attitude`` (n, 3, 3) C_BN, the identity at the first time; ``psi_at`` (n,) the angle turned;
    ``axes`` (k, 3, 3), whose rows are the axes of the frame that does not spin, in N, at the middle of each sub-step,
    and ``turn`` (k, 2), cosine and sine of the angle there. The spin is a spline of coefficients ``spin``, of which
    four from ``first`` (k,) on act by ``weights`` (k, 4); transverse rates (k,) are the sum of those given in the body
    and in the frame that does not spin (each p + i q; empty: none).
    """
    D = np.eye(3)
    psi = 0.0
    for i in range(3):
        for j in range(3):
            attitude[0, i, j] = D[i, j]
    psi_at[0] = 0.0
    for k in range(times.size - 1):
        h = (times[k + 1] - times[k]) / substeps
        for j in range(substeps):
            s = k * substeps + j
            r = 0.0
            for i in range(4):
                r += weights[s, i] * spin[first[s] + i]
            middle = psi + 0.5 * h * r
            c, si = cos(middle), sin(middle)
            a, b = 0.0, 0.0
            if body.size:
                # C3(psi)^T takes body components to the frame that does not spin
                a = c * body[s].real - si * body[s].imag
                b = si * body[s].real + c * body[s].imag
            if despun.size:
                a += despun[s].real
                b += despun[s].imag
            # exp(-[v x]) with v = (a, b, 0) h/2 twice, so that the axes are there at the middle too
            x, y = 0.5 * h * a, 0.5 * h * b
            square = x * x + y * y
            if square < 1e-3:  # the next terms are below 1e-17
                f1 = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)))
                f2 = 0.5 - square / 24.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0 * (1.0 - square / 90.0)))
            else:
                angle = sqrt(square)
                f1, f2 = sin(angle) / angle, (1.0 - cos(angle)) / square
            for half in range(2):
                for i in range(3):
                    d0, d1, d2 = D[0, i], D[1, i], D[2, i]
                    dot = x * d0 + y * d1
                    D[0, i] = d0 - f1 * y * d2 + f2 * (x * dot - square * d0)
                    D[1, i] = d1 + f1 * x * d2 + f2 * (y * dot - square * d1)
                    D[2, i] = d2 - f1 * (x * d1 - y * d0) - f2 * square * d2
                if half == 0:
                    for i in range(3):
                        axes[s, 0, i], axes[s, 1, i], axes[s, 2, i] = D[0, i], D[1, i], D[2, i]
                    turn[s, 0], turn[s, 1] = c, si
            psi += h * r
        c, si = cos(psi), sin(psi)
        for i in range(3):
            attitude[k + 1, 0, i] = c * D[0, i] + si * D[1, i]
            attitude[k + 1, 1, i] = -si * D[0, i] + c * D[1, i]
            attitude[k + 1, 2, i] = D[2, i]
        psi_at[k + 1] = psi


@compiled_sums
def _weigh(
    scale: float,
    C: FloatArray,
    iron: FloatArray,
    skew: FloatArray,
    turned: FloatArray,
    residual: FloatArray,
    rows: FloatArray,
    at: int,
    q: int,
    dense: int,
) -> None:
    """Write a reading's derivatives, weighed, into ``rows`` (p, 3 n) from its column ``at`` on.

    First those by rotations in N and, where ``q`` is 4, about the axis; then ``dense`` by field, hard iron and soft
    iron, some left to the caller, and last the residual.
    """
    for a in range(3):
        for b in range(3):
            rows[q + b, at + a] = scale * (iron[a, 0] * C[0, b] + iron[a, 1] * C[1, b] + iron[a, 2] * C[2, b])
            rows[q + 3 + b, at + a] = scale if a == b else 0.0
        x, y, z = rows[q, at + a], rows[q + 1, at + a], rows[q + 2, at + a]
        for b in range(3):
            rows[b, at + a] = x * skew[b, 0] + y * skew[b, 1] + z * skew[b, 2]
        if q == 4:
            rows[3, at + a] = rows[0, at + a] * C[2, 0] + rows[1, at + a] * C[2, 1] + rows[2, at + a] * C[2, 2]
        rows[q + dense - 1, at + a] = scale * residual[a]
    for column in range(6):
        a, b = SOFT[column]
        rows[q + 6 + column, at + a] = scale * turned[b]
        rows[q + 6 + column, at + b] = scale * turned[a]


@compiled_sums
def _product(rows: FloatArray, a: int, b: int, count: int) -> float:
    total = 0.0
    for k in range(count):
        total += rows[a, k] * rows[b, k]
    return total


@compiled_sums
def _add_products(
    rows: FloatArray,
    filled: int,
    active: IndexArray,
    count: int,
    sum_g: FloatArray,
    sum_l: FloatArray,
    sum_d: FloatArray,
    run: FloatArray,
    pairs: FloatArray,
    cross: FloatArray,
) -> None:
    """Add the products of the derivatives of some readings, ``filled`` columns of ``rows``, to all sums."""
    q, dense = sum_l.shape
    for a in range(q):
        for b in range(q):
            sum_g[a, b] += _product(rows, a, b, filled)
        for b in range(dense):
            sum_l[a, b] += _product(rows, a, q + b, filled)
    for a in range(dense):
        for b in range(a + 1):
            value = sum_d[a, b] + _product(rows, q + a, q + b, filled)
            sum_d[a, b], sum_d[b, a] = value, value
    for m in range(count):
        j, own = active[m], q + dense + m
        for a in range(q):
            run[j, a] += _product(rows, own, a, filled)
        for b in range(dense):
            cross[j, b] += _product(rows, own, q + b, filled)
        for other in range(m + 1):
            k = active[other]
            pairs[max(j, k), min(j, k)] += _product(rows, own, q + dense + other, filled)


@compiled
def _note(rest: FloatArray, total: FloatArray, place: int) -> None:
    """Write a sum (q, k) at a place of ``rest`` (m, q, k), entry by entry.

    An assignment of arrays compiles the words of an error that cannot be, which takes seconds.
    """
    for a in range(total.shape[0]):
        for b in range(total.shape[1]):
            rest[place, a, b] = total[a, b]


@compiled
def _acting(low: int, now: int, slow_low: int, slow_now: int, size: int, slow_size: int, active: IndexArray) -> int:
    """Write which coefficients act now or did at the reading before; return how many."""
    count = 0
    for c in range(low, now + 4):
        active[count] = c
        count += 1
    if slow_size:
        for c in range(slow_low, slow_now + 4):
            active[count], active[count + 1] = size + c, size + slow_size + c
            count += 2
    return count


@compiled_nogil_sums
def add_normal_equations(
    substeps: int,
    h: FloatArray,
    axes: FloatArray,
    attitude: FloatArray,
    iron: FloatArray,
    m0: FloatArray,
    turned: FloatArray,
    residual: FloatArray,
    scale: FloatArray,
    despun: bool,
    first: IndexArray,
    weights: FloatArray,
    size: int,
    slow_first: IndexArray,
    slow_weights: FloatArray,
    slow_size: int,
    read: int,
    shown: ComplexArray,
    turn: FloatArray,
    information: FloatArray,
    right: FloatArray,
) -> None:
    """Add the magnetometer's part of the normal equations to ``information`` (m, m) and ``right`` (m,).

    Parameters in order: the spin's spline, bias and gain of the transverse rates that a gyroscope shows (``read``: 4,
    or none), the two splines of what is not read, field (3), hard iron (3), soft iron (6).

    Parameters
    ----------
    substeps, h, axes, attitude
        As `integrate` takes and gives them; h (k,) are the sub-steps' lengths, s.
    iron : (3, 3) array
        I + S of the soft iron.
    m0, turned, residual : (3,), (n, 3), (n, 3) arrays
        The field in N, in B, and what the model leaves of the readings.
    scale : (n,) array
        Each reading's weight over its standard deviation.
    despun : bool
        Whether the axis turns by rates of the frame that does not spin, so that the spin turns about where it is now.
    first, weights, size : (k,), (k, 4) arrays, int
        First coefficient and weights of the spin's spline at each sub-step, and its coefficients' number;
        ``slow_first``, ``slow_weights`` and ``slow_size`` of the others' (none: 0).
    shown, turn : (k,), (k, 2) arrays
        Transverse rates p + i q that the gyroscope shows, less its bias, and cosine and sine as `integrate` gives them.
    """
    n = attitude.shape[0]
    #: rotation in N by bias (2) and gain (2) of the gyroscope so far, per unit
    moments = np.zeros((read, 3))
    total_size, q, dense = size + 2 * slow_size, 4 if despun else 3, 13 + read
    #: rotation by each parameter so far; its product with G, summed; those with each other; and with L
    theta, run = np.zeros((total_size, q)), np.zeros((total_size, q))
    pairs, cross = np.zeros((total_size, total_size)), np.zeros((total_size, dense))
    #: sums of G = B^T B, L = B^T D and D^T D, and the first two up to where each parameter ceased to act
    sum_g, sum_l, sum_d = np.zeros((q, q)), np.zeros((q, dense)), np.zeros((dense, dense))
    rest_g, rest_l = np.zeros((total_size, q, q)), np.zeros((total_size, q, dense))
    order, ended = np.empty(total_size, dtype=np.int64), 0
    skew = np.array([[0.0, m0[2], -m0[1]], [-m0[2], 0.0, m0[0]], [m0[1], -m0[0], 0.0]])
    #: derivatives of some readings at once: by rotations, by the rest, and by the parameters that act
    rows, filled = np.zeros((q + dense + ACTING, 3 * TOGETHER)), 0
    active, count = np.empty(total_size + 16, dtype=np.int64), 0
    low, slow_low = int(first[0]), int(slow_first[0]) if slow_size else 0
    for i in range(n):
        if i > 0:
            for s in range((i - 1) * substeps, i * substeps):
                if read:
                    body_p, body_q, cosine, sine = shown[s].real, shown[s].imag, turn[s, 0], turn[s, 1]
                    for a in range(3):
                        ex = h[s] * (cosine * axes[s, 0, a] + sine * axes[s, 1, a])
                        ey = h[s] * (-sine * axes[s, 0, a] + cosine * axes[s, 1, a])
                        moments[0, a] -= ex
                        moments[1, a] -= ey
                        moments[2, a] += body_p * ex + body_q * ey
                        moments[3, a] += body_p * ey - body_q * ex
                for j in range(4):
                    c, w = first[s] + j, h[s] * weights[s, j]
                    if despun:
                        theta[c, 3] += w
                    else:
                        for a in range(3):
                            theta[c, a] += w * axes[s, 2, a]
                    if slow_size:
                        c, w = size + slow_first[s] + j, h[s] * slow_weights[s, j]
                        for a in range(3):
                            theta[c, a] += w * axes[s, 0, a]
                            theta[c + slow_size, a] += w * axes[s, 1, a]
            now = first[i * substeps - 1]
            slow_now = slow_first[i * substeps - 1] if slow_size else 0
            if i == 1 or now > low or slow_now > slow_low:
                _add_products(rows, filled, active, count, sum_g, sum_l, sum_d, run, pairs, cross)
                filled = 0
                count = _acting(low, now, slow_low, slow_now, size, slow_size, active)
                m = 0
                while m < count:
                    j = active[m]
                    if not (j < now if j < size else (j - size) % slow_size < slow_now):
                        m += 1
                        continue
                    # it has ceased to act: from here on the sums of those that act count for it
                    for other in range(count):
                        k = active[other]
                        if k != j:
                            for a in range(q):
                                pairs[max(j, k), min(j, k)] -= theta[j, a] * run[k, a]
                    _note(rest_g, sum_g, j)
                    _note(rest_l, sum_l, j)
                    order[ended] = j
                    ended, count = ended + 1, count - 1
                    active[m] = active[count]
                low, slow_low = now, slow_now
        _weigh(scale[i], attitude[i], iron, skew, turned[i], residual[i], rows, filled, q, dense)
        for a in range(filled, filled + 3):
            x, y, z = rows[0, a], rows[1, a], rows[2, a]
            for j in range(read):
                rows[q + 12 + j, a] = x * moments[j, 0] + y * moments[j, 1] + z * moments[j, 2]
            for m in range(count):
                j = active[m]
                value = x * theta[j, 0] + y * theta[j, 1] + z * theta[j, 2]
                if despun:
                    value += rows[3, a] * theta[j, 3]
                rows[q + dense + m, a] = value
        filled += 3
        if filled == 3 * TOGETHER:
            _add_products(rows, filled, active, count, sum_g, sum_l, sum_d, run, pairs, cross)
            filled = 0
    _add_products(rows, filled, active, count, sum_g, sum_l, sum_d, run, pairs, cross)
    settled = ended
    for m in range(count):
        _note(rest_g, sum_g, active[m])
        _note(rest_l, sum_l, active[m])
        order[ended] = active[m]
        ended += 1
    for place in range(ended):
        k = order[place]
        tail = np.zeros(q)
        for a in range(q):
            for b in range(q):
                tail[a] += (sum_g[a, b] - rest_g[k, a, b]) * theta[k, b]
            for b in range(dense):
                cross[k, b] += theta[k, a] * (sum_l[a, b] - rest_l[k, a, b])
        for a in range(q):
            pairs[k, k] += theta[k, a] * tail[a]
            # those that act to the end have met in all readings
            for before in range(min(place, settled)):
                j = order[before]
                pairs[max(j, k), min(j, k)] += theta[j, a] * (run[k, a] + tail[a])
    columns = np.empty(dense, dtype=np.int64)
    for b in range(12):
        columns[b] = total_size + read + b
    for b in range(read):
        columns[12 + b] = size + b
    for j in range(total_size):
        row = j if j < size else j + read
        for k in range(j + 1):
            column = k if k < size else k + read
            information[row, column] += pairs[j, k]
            if k < j:
                information[column, row] += pairs[j, k]
        for b in range(dense - 1):
            information[row, columns[b]] += cross[j, b]
            information[columns[b], row] += cross[j, b]
        right[row] += cross[j, dense - 1]
    for a in range(dense - 1):
        for b in range(dense - 1):
            information[columns[a], columns[b]] += sum_d[a, b]
        right[columns[a]] += sum_d[a, dense - 1]
