"""Cramer-Rao bounds: how well any unbiased estimator can know the spin rate from a magnetometer.

Two axes of a spinning magnetometer are one complex signal, x + i y = b + A (E + c conj(E)) with E = exp(i phase):
b is hard iron, c the ellipse of soft iron, and the phase a polynomial of time whose slope is minus the spin rate.
The Fisher matrix of that model gives the bound with every nuisance unknown; a prior on c is counted as information
(van Trees), since without one less than a turn of signal says nothing. See docs/spin-phase.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import FloatArray

__all__ = ["ToneBound", "tone_bound"]


@dataclass(frozen=True)
class ToneBound:
    """Smallest standard deviations at one instant: rate rad/s, chirp rad/s^2, phase rad, amplitude in its unit."""

    rate: float
    chirp: float
    phase: float
    amplitude: float


def tone_bound(
    t: FloatArray,
    amplitude: float,
    noise: float,
    rate: float,
    *,
    degree: int = 1,
    phase: float = 0.0,
    hard_iron: bool = True,
    ellipse_sd: float = 0.0,
) -> ToneBound:
    """Return the bound at the mean of times t (n,), s, of any spacing.

    Parameters
    ----------
    t : (n,) array
        Time stamps, s.
    amplitude, noise : float
        Field across the spin axis and its noise per axis, one unit.
    rate : float
        Spin rate, rad/s; it matters where the window holds less than about two turns.
    degree : int
        Of the unknown polynomial of the rate: 0 constant, 1 with chirp, 2 with curvature.
    phase : float
        Phase at the mean of ``t``, rad.
    hard_iron : bool
        Whether the offset of both axes is unknown.
    ellipse_sd : float
        Prior standard deviation of each part of the relative ellipse c; 0 if c is known.
    """
    jacobian = _tone_jacobian(t, amplitude, rate, degree, phase, hard_iron, ellipse_sd > 0)
    # unit columns: the powers of tau differ by orders of magnitude
    scale = np.linalg.norm(jacobian, axis=0)
    fisher = (jacobian / scale).T @ (jacobian / scale) / noise**2
    if ellipse_sd > 0:
        fisher[-2:, -2:] += np.diag(1 / (ellipse_sd * scale[-2:]) ** 2)
    sd = np.sqrt(np.diag(np.linalg.inv(fisher))) / scale
    powers = degree + 2
    return ToneBound(
        rate=float(sd[1]),
        chirp=float(sd[2]) if powers > 2 else 0.0,
        phase=float(sd[0]),
        amplitude=float(sd[powers]),
    )


def _tone_jacobian(
    t: FloatArray,
    amplitude: float,
    rate: float,
    degree: int,
    phase: float,
    hard_iron: bool,
    ellipse: bool,
) -> FloatArray:
    """Derivatives (2n, m) of both axes by phase, rate, chirp, ..., amplitude, hard iron (2), ellipse (2)."""
    tau = np.asarray(t, dtype=float) - float(np.mean(t))
    spin = np.exp(1j * (phase - rate * tau))
    columns = [1j * amplitude * spin]
    factorial = 1.0
    for power in range(1, degree + 2):
        factorial *= power
        columns.append(-1j * amplitude * spin * tau**power / factorial)
    columns.append(spin)
    if hard_iron:
        columns += [np.ones_like(spin), 1j * np.ones_like(spin)]
    if ellipse:
        columns += [amplitude * np.conj(spin), 1j * amplitude * np.conj(spin)]
    complex_columns = np.stack(columns, axis=1)
    return np.concatenate([complex_columns.real, complex_columns.imag])
