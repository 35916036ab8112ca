"""One window of magnetometer data as a tone with polynomial phase, fitted by maximum likelihood (compiled).

Model (docs/spin-phase.md): ``x + i y = b + A (E + c conj(E))`` with ``E = u exp(i phase)``, phase a polynomial of
time, b hard iron, c the ellipse of soft iron (with a prior), and u the known slow turning of the field by the
transverse body rates, which integrates ``dz/dt = -i r z + i m_z (p + i q)``, ``dm_z/dt = Im(conj(z) (p + i q))``.
The batch and the streaming estimator call the same functions, so they give the same numbers.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from discsim.arrays import FloatArray
from discsim.compiled import compiled

__all__ = ["ComplexArray", "field_shape", "fit_tone"]

ComplexArray = NDArray[np.complex128]


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
def _assemble(
    x: FloatArray,
    z: ComplexArray,
    u: ComplexArray,
    parameters: FloatArray,
    powers: int,
    ellipse_weight: float,
    normal: FloatArray,
    right: FloatArray,
) -> float:
    """Fill the normal equations at ``parameters``; return the sum of squares with the prior's share."""
    m = parameters.size
    normal[:] = 0.0
    right[:] = 0.0
    row = np.empty(m, dtype=np.complex128)
    amplitude = parameters[powers]
    b = complex(parameters[powers + 1], parameters[powers + 2])
    c = complex(parameters[powers + 3], parameters[powers + 4])
    cost = 0.0
    for k in range(z.size):
        phase = 0.0
        for j in range(powers - 1, -1, -1):
            phase = phase * x[k] + parameters[j]
        E = u[k] * complex(cos(phase), sin(phase))
        F = E.conjugate()
        residual = z[k] - b - amplitude * (E + c * F)
        cost += residual.real**2 + residual.imag**2
        value = 1j * amplitude * (E - c * F)
        for j in range(powers):
            row[j] = value
            value = value * x[k]
        row[powers] = E + c * F
        row[powers + 1] = 1.0
        row[powers + 2] = 1j
        row[powers + 3] = amplitude * F
        row[powers + 4] = 1j * amplitude * F
        for i in range(m):
            right[i] += row[i].real * residual.real + row[i].imag * residual.imag
            for j in range(i + 1):
                normal[i, j] += row[i].real * row[j].real + row[i].imag * row[j].imag
    for i in (powers + 3, powers + 4):
        normal[i, i] += ellipse_weight
        right[i] -= ellipse_weight * parameters[i]
        cost += ellipse_weight * parameters[i] ** 2
    for i in range(m):
        for j in range(i):
            normal[j, i] = normal[i, j]
    return cost


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
    cost = _assemble(x, z, u, parameters, powers, weight, normal, right)
    if noise <= 0.0:
        weight = cost / freedom / ellipse_sd**2
        cost = _assemble(x, z, u, parameters, powers, weight, normal, right)
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
        trial_cost = _assemble(x, z, u, trial, powers, weight, trial_normal, trial_right)
        if trial_cost <= cost * (1 + 1e-12):
            parameters[:] = trial
            normal[:] = trial_normal
            right[:] = trial_right
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
    return spread / freedom, steps


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
    start = complex(amplitude, 0.0)
    along_start = axial
    mean_rate = 0.0
    # the first passes find which start has the wanted value at the centre and the wanted mean along z
    for _ in range(3):
        y, along = start, along_start
        u[0] = y
        mean_along = along / n
        mean_rate = 0.0
        for i in range(n - 1):
            h = (t[i + 1] - t[i]) / substeps
            for j in range(substeps):
                x = (t[i] + (j + 0.5) * h - centre) / half
                phase = 0.0
                for power in range(powers - 1, -1, -1):
                    phase = phase * x + parameters[power]
                w = rates[i, j] * complex(cos(phase), -sin(phase))
                mean_rate += h * w.real
                # midpoint rule: second order
                middle = y + 0.5j * h * along * w
                half_along = along + 0.5 * h * (y.conjugate() * w).imag
                y += 1j * h * half_along * w
                along += h * (middle.conjugate() * w).imag
            u[i + 1] = y
            mean_along += along / n
        at_centre = u[k] + fraction * (u[k + 1] - u[k])
        start += amplitude - at_centre
        along_start += axial - mean_along
    for i in range(n):
        u[i] /= at_centre
    return float(mean_rate / (t[n - 1] - t[0]))
