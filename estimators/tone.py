"""One window of magnetometer data as a tone with polynomial phase, fitted by maximum likelihood (compiled).

Model (docs/spin-phase.md): ``x + i y = b + A (E + c conj(E))`` with ``E = u exp(i phase)``, phase a polynomial of
time, b hard iron, c the ellipse of soft iron (with a prior), and u the known slow turning of the field by the
transverse body rates, which integrates ``dz/dt = -i r z + i m_z (p + i q)``, ``dm_z/dt = Im(conj(z) (p + i q))``.
The batch and the streaming estimator call the same functions, so they give the same numbers.
"""

from __future__ import annotations

from math import floor, sqrt

import numpy as np

from discsim.arrays import ComplexArray, FloatArray
from discsim.compiled import compiled, compiled_sums

__all__ = ["field_shape", "fit_tone"]


@compiled
def cholesky_inverse(matrix: FloatArray, inverse: FloatArray) -> bool:
    """Write the inverse of a symmetric positive matrix (m, m); return False where it is not positive."""
    m = matrix.shape[0]
    lower = np.zeros((m, m))
    for i in range(m):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                if not total > 1e-13 * matrix[i, i]:
                    return False
                lower[i, i] = sqrt(total)
            else:
                lower[i, j] = total / lower[j, j]
    for column in range(m):
        for i in range(m):
            total = 1.0 if i == column else 0.0
            for k in range(i):
                total -= lower[i, k] * inverse[k, column]
            inverse[i, column] = total / lower[i, i]
        for i in range(m - 1, -1, -1):
            total = inverse[i, column]
            for k in range(i + 1, m):
                total -= lower[k, i] * inverse[k, column]
            inverse[i, column] = total / lower[i, i]
    return True


@compiled
def turns(angle: FloatArray, cosine: FloatArray, sine: FloatArray) -> None:
    """Write cosine and sine of angles (n,), |angle| < 1e6 rad, to 1e-16: a loop that compilers do four at a time.

    Quarter turns are taken off in three parts of pi/2 (Cody and Waite), then Taylor's series as economised in Moshier's
    Cephes (sin.c) hold to 45 degrees.
    """
    for k in range(angle.size):
        quarter = floor(angle[k] * 0.6366197723675814 + 0.5)
        r = (
            (angle[k] - quarter * 1.5707962512969970703) - quarter * 7.5497894158615963534e-8
        ) - quarter * 5.3903028581581190529e-15
        s = r * r
        p = 1.58962301576546568060e-10 * s - 2.50507477628578072866e-8
        p = (p * s + 2.75573136213857245213e-6) * s - 1.98412698295895385996e-4
        p = (p * s + 8.33333333332211858878e-3) * s - 1.66666666666666307295e-1
        y = r + r * s * p
        q = -1.13585365213876817300e-11 * s + 2.08757008419747316778e-9
        q = (q * s - 2.75573141792967388112e-7) * s + 2.48015872888517045348e-5
        q = (q * s - 1.38888888888730564116e-3) * s + 4.16666666666665929218e-2
        x = 1.0 - 0.5 * s + s * s * q
        place = quarter - 4.0 * floor(0.25 * quarter)
        odd = place == 1.0 or place == 3.0
        c, d = (y, x) if odd else (x, y)
        cosine[k] = -c if place == 1.0 or place == 2.0 else c
        sine[k] = -d if place >= 2.0 else d


#: Readings whose columns are held at once: 11 arrays of 256 numbers, 22 kB, stay in a core's first cache.
BLOCK = 256


@compiled_sums
def _add_block(
    x: FloatArray, z: FloatArray, u: FloatArray, parameters: FloatArray, p: int, sums: FloatArray, work: FloatArray
) -> None:
    """Add the sums of a block of readings, of which `_assemble` makes the normal equations, to ``sums``.

    ``z`` and ``u`` (2, n) are real and imaginary parts, ``work`` (11, `BLOCK`) is overwritten. Columns are G x^j, H, 1,
    i, A F and i A F with F = conj(E), H = E + c F and G = i A (E - c F): ``sums`` (9, 9) are moments with x^j of
    conj(G) times G, H, 1, i, A F, i A F and the residual, and last the sums without G.
    """
    n = x.size
    A, bx, by, cx, cy = parameters[p], parameters[p + 1], parameters[p + 2], parameters[p + 3], parameters[p + 4]
    phase, power = work[0, :n], work[1, :n]
    for k in range(n):
        phase[k] = parameters[p - 1]
    for j in range(p - 2, -1, -1):
        for k in range(n):
            phase[k] = phase[k] * x[k] + parameters[j]
    turns(phase, work[2, :n], work[3, :n])
    gx, gy, gg, gh, gf, gif, gr = work[4], work[5], work[6], work[7], work[8], work[9], work[10]
    cost = sx = sy = hh = hx = hy = hf = hif = hr = fx = fy = ff = fr = fir = 0.0
    for k in range(n):
        ex = work[2, k] * u[0, k] - work[3, k] * u[1, k]
        ey = work[2, k] * u[1, k] + work[3, k] * u[0, k]
        # c F = c conj(E)
        tx, ty = cx * ex + cy * ey, cy * ex - cx * ey
        Hx, Hy = ex + tx, ey + ty
        Gx, Gy = -A * (ey - ty), A * (ex - tx)
        Fx, Fy = A * ex, -A * ey
        rx, ry = z[0, k] - bx - A * Hx, z[1, k] - by - A * Hy
        gx[k], gy[k] = Gx, Gy
        gg[k] = Gx * Gx + Gy * Gy
        gh[k] = Gx * Hx + Gy * Hy
        gf[k] = Gx * Fx + Gy * Fy
        gif[k] = Gy * Fx - Gx * Fy
        gr[k] = Gx * rx + Gy * ry
        power[k] = 1.0
        cost += rx * rx + ry * ry
        sx += rx
        sy += ry
        hh += Hx * Hx + Hy * Hy
        hx += Hx
        hy += Hy
        hf += Hx * Fx + Hy * Fy
        hif += Hy * Fx - Hx * Fy
        hr += Hx * rx + Hy * ry
        fx += Fx
        fy += Fy
        ff += Fx * Fx + Fy * Fy
        fr += Fx * rx + Fy * ry
        fir += Fx * ry - Fy * rx
    for j in range(p):
        a = b = c = d = e = f = g = 0.0
        for k in range(n):
            w = power[k]
            g += w * gg[k]
            a += w * gh[k]
            b += w * gx[k]
            c += w * gy[k]
            d += w * gf[k]
            e += w * gif[k]
            f += w * gr[k]
            power[k] = w * x[k]
        for i, value in enumerate((g, a, b, c, d, e, f)):
            sums[i, j] += value
    for j in range(p, 2 * p - 1):
        g = 0.0
        for k in range(n):
            g += power[k] * gg[k]
            power[k] *= x[k]
        sums[0, j] += g
    for i, value in enumerate((cost, sx, sy, hh, hx, hy, hf, hif, hr)):
        sums[7, i] += value
    for i, value in enumerate((fx, fy, ff, fr, fir)):
        sums[8, i] += value


@compiled
def _assemble(
    x: FloatArray,
    z: FloatArray,
    u: FloatArray,
    parameters: FloatArray,
    p: int,
    ellipse_weight: float,
    normal: FloatArray,
    right: FloatArray,
    work: FloatArray,
) -> float:
    """Fill the normal equations at ``parameters``, p of them of the phase; return the cost with the prior's share."""
    n, m = x.size, parameters.size
    sums = np.zeros((9, 9))
    for start in range(0, n, BLOCK):
        stop = min(start + BLOCK, n)
        _add_block(x[start:stop], z[:, start:stop], u[:, start:stop], parameters, p, sums, work)
    for i in range(p):
        for j in range(i + 1):
            normal[i, j] = sums[0, i + j]
        for column in range(5):
            normal[p + column, i] = sums[1 + column, i]
        right[i] = sums[6, i]
    cost, sx, sy = sums[7, 0], sums[7, 1], sums[7, 2]
    hh, hx, hy, hf, hif, hr = sums[7, 3], sums[7, 4], sums[7, 5], sums[7, 6], sums[7, 7], sums[7, 8]
    fx, fy, ff, fr, fir = sums[8, 0], sums[8, 1], sums[8, 2], sums[8, 3], sums[8, 4]
    normal[p, p], normal[p + 1, p], normal[p + 2, p], normal[p + 3, p], normal[p + 4, p] = hh, hx, hy, hf, hif
    normal[p + 1, p + 1], normal[p + 2, p + 1], normal[p + 3, p + 1], normal[p + 4, p + 1] = n, 0.0, fx, -fy
    normal[p + 2, p + 2], normal[p + 3, p + 2], normal[p + 4, p + 2] = n, fy, fx
    normal[p + 3, p + 3], normal[p + 4, p + 3], normal[p + 4, p + 4] = ff, 0.0, ff
    right[p], right[p + 1], right[p + 2], right[p + 3], right[p + 4] = hr, sx, sy, fr, fir
    for i in (p + 3, p + 4):
        normal[i, i] += ellipse_weight
        right[i] -= ellipse_weight * parameters[i]
        cost += ellipse_weight * parameters[i] ** 2
    for i in range(m):
        for j in range(i):
            normal[j, i] = normal[i, j]
    return float(cost)


@compiled
def fit_tone(
    x: FloatArray,
    z: ComplexArray,
    u: ComplexArray,
    parameters: FloatArray,
    covariance: FloatArray,
    powers: int,
    ellipse_sd: float,
    noise: float,
    iterations: int,
) -> tuple[float, int]:
    """Fit by Levenberg-Marquardt from ``parameters``, which are overwritten, as is ``covariance``.

    Parameters
    ----------
    x : (n,) array
        Time from the window's centre over the half width: -1 to 1.
    z, u : (n,) complex array
        The two axes, and the known turning of the field.
    parameters : (powers + 5,) array
        Phase polynomial in x, amplitude, hard iron (2), ellipse (2); the start, then the answer.
    covariance : (powers + 5, powers + 5) array
        Inverse normal matrix for unit noise, overwritten.
    powers : int
        Number of phase coefficients.
    ellipse_sd, noise : float
        Prior of the ellipse, and the noise that weighs it (0: from the residual).
    iterations : int
        Most steps taken.

    Returns
    -------
    variance, steps : float, int
        Residual variance per axis, degrees of freedom taken off; -1 steps where the normal equations failed.
    """
    m = parameters.size
    n = z.size
    parts, shape, work = np.empty((2, n)), np.empty((2, n)), np.empty((11, BLOCK))
    for k in range(n):
        parts[0, k], parts[1, k] = z[k].real, z[k].imag
        shape[0, k], shape[1, k] = u[k].real, u[k].imag
    freedom = max(1, 2 * n - (m - 2))
    normal = np.empty((m, m))
    right = np.empty(m)
    trial_normal = np.empty((m, m))
    trial_right = np.empty(m)
    damped = np.empty((m, m))
    trial = np.empty(m)
    weight = 0.0
    if noise > 0.0:
        weight = (noise / ellipse_sd) ** 2
    cost = _assemble(x, parts, shape, parameters, powers, weight, normal, right, work)
    if noise <= 0.0:
        weight = cost / freedom / ellipse_sd**2
        cost = _assemble(x, parts, shape, parameters, powers, weight, normal, right, work)
    damping = 0.0
    steps = 0
    while steps < iterations:
        steps += 1
        for i in range(m):
            for j in range(m):
                damped[i, j] = normal[i, j]
            damped[i, i] += damping * normal[i, i] + 1e-300
        if not cholesky_inverse(damped, covariance):
            damping = max(1e-6, 10.0 * damping)
            if damping > 1e6:
                return 0.0, -1
            continue
        decrement = 0.0
        for i in range(m):
            step = 0.0
            for j in range(m):
                step += covariance[i, j] * right[j]
            trial[i] = parameters[i] + step
            decrement += step * right[i]
        trial_cost = _assemble(x, parts, shape, trial, powers, weight, trial_normal, trial_right, work)
        if trial_cost <= cost * (1 + 1e-12):
            # entry by entry: an assignment of arrays compiles the words of an error that cannot be, a second's work
            for i in range(m):
                parameters[i], right[i] = trial[i], trial_right[i]
                for j in range(m):
                    normal[i, j] = trial_normal[i, j]
            cost = trial_cost
            damping = damping * 0.1 if damping > 1e-5 else 0.0
            if noise <= 0.0:  # the prior's weight follows the noise found
                spread = cost - weight * (trial[powers + 3] ** 2 + trial[powers + 4] ** 2)
                new = spread / freedom / ellipse_sd**2
                change = new - weight
                for i in (powers + 3, powers + 4):
                    normal[i, i] += change
                    right[i] -= change * trial[i]
                    cost += change * trial[i] ** 2
                weight = new
            # a step worth a ten-thousandth of a standard deviation
            if decrement < 1e-8 * cost / freedom:
                break
        else:
            damping = max(1e-4, 10.0 * damping)
            if damping > 1e8:
                break
    if not cholesky_inverse(normal, covariance):
        return 0.0, -1
    spread = cost - weight * (parameters[powers + 3] ** 2 + parameters[powers + 4] ** 2)
    # of readings that are all alike rounding alone is left, of either sign
    return max(0.0, spread / freedom), steps


@compiled
def field_shape(
    t: FloatArray,
    centre: float,
    half: float,
    parameters: FloatArray,
    powers: int,
    axial: float,
    rates: ComplexArray,
    substeps: int,
    u: ComplexArray,
) -> float:
    """Write the turning u (n,) of the field by the transverse rates, with u = 1 at the centre; return mean Re(w).

    ``rates`` (n - 1, substeps) holds p + i q, rad/s, at the middle of each sub-step between neighbouring samples;
    ``axial`` is the field along z, averaged over the window, in the amplitude's unit. The value returned is the
    mean of the transverse rate along the field, (p m_x + q m_y)/m_perp: it times m_z/m_perp is the phase rate.
    """
    n = t.size
    amplitude = parameters[powers]
    k = 0
    while k < n - 2 and t[k + 1] < centre:
        k += 1
    fraction = (centre - t[k]) / (t[k + 1] - t[k])
    count = (n - 1) * substeps
    phase, cosine, sine = np.empty(count), np.empty(count), np.empty(count)
    for i in range(n - 1):
        h = (t[i + 1] - t[i]) / substeps
        for j in range(substeps):
            x = (t[i] + (j + 0.5) * h - centre) / half
            angle = 0.0
            for power in range(powers - 1, -1, -1):
                angle = angle * x + parameters[power]
            phase[i * substeps + j] = angle
    turns(phase, cosine, sine)
    # the transverse rate turned with the field, times its sub-step
    turned = np.empty(count, dtype=np.complex128)
    total = 0.0
    for i in range(n - 1):
        h = (t[i + 1] - t[i]) / substeps
        for j in range(substeps):
            s = i * substeps + j
            turned[s] = h * rates[i, j] * complex(cosine[s], -sine[s])
            total += turned[s].real
    start = complex(amplitude, 0.0)
    along_start = axial
    # the first passes find which start has the wanted value at the centre and the wanted mean along z
    for _ in range(3):
        y, along = start, along_start
        u[0] = y
        mean_along = along / n
        for i in range(n - 1):
            for s in range(i * substeps, (i + 1) * substeps):
                w = turned[s]
                # midpoint rule: second order
                middle = y + 0.5j * along * w
                half_along = along + 0.5 * (y.conjugate() * w).imag
                y += 1j * half_along * w
                along += (middle.conjugate() * w).imag
            u[i + 1] = y
            mean_along += along / n
        at_centre = u[k] + fraction * (u[k + 1] - u[k])
        start += amplitude - at_centre
        along_start += axial - mean_along
    for i in range(n):
        u[i] /= at_centre
    return float(total / (t[n - 1] - t[0]))
