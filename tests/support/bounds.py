"""Cramer-Rao bounds that the estimators are held against: of a steady tone in closed form, and of a whole recording."""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray


def regular_bound(n: int, interval: float, amplitude: float, noise: float) -> float:
    """Return the bound on a constant rate, rad/s, of n equally spaced samples with nothing else than phase unknown.

    ``var(r) >= 12 sigma^2 / (A^2 N (N^2 - 1) T^2)`` with sigma the noise per axis. A linear change of rate does not
    raise it at the window's centre; hard iron hardly does once the window holds two turns.
    """
    return float(np.sqrt(12 / (n * (n * n - 1.0))) * noise / (amplitude * interval))


def flight_bound(
    t: FloatArray, amplitude: float, noise: float, roughness: float, at: FloatArray, *, step: float = 0.02
) -> FloatArray:
    """Return the bound (m,) rad/s at times ``at`` for a smoother that sees a whole recording.

    The phase is measured at times t (n,) with standard deviation noise/amplitude; its rate is an integrated random
    walk, ``r'' = white noise`` of spectral density ``roughness`` (rad/s^3)^2 s, its start unknown. Bayesian bound
    (van Trees) of a rate given on a grid of ``step`` s, linear in between.
    """
    t = np.asarray(t, dtype=float)
    nodes = max(4, int(np.ceil((t[-1] - t[0]) / step)) + 1)
    grid = np.linspace(t[0], t[-1], nodes)
    h = grid[1] - grid[0]
    # phase at t: the integral of the hat functions up to t
    index = np.minimum(((t - t[0]) / h).astype(int), nodes - 2)
    u = (t - grid[index]) / h
    full = np.tril(np.ones((nodes, nodes)), -1) * h
    full[:, 0] *= 0.5
    integral = full + np.diag(np.full(nodes, 0.5 * h))
    integral[0] = 0.0
    jacobian = integral[index].copy()
    rows = np.arange(t.size)
    jacobian[rows, index] += h * (u - 0.5 * u * u)
    jacobian[rows, index + 1] += h * 0.5 * u * u
    jacobian = np.column_stack((np.ones(t.size), jacobian))
    second = np.diff(np.eye(nodes), 2, axis=0) / h**2
    # white noise of density S sampled by its mean over a step has variance S/step
    prior = np.zeros((nodes + 1, nodes + 1))
    prior[1:, 1:] = second.T @ second * h / roughness
    fisher = jacobian.T @ jacobian * (amplitude / noise) ** 2 + prior
    covariance = np.linalg.inv(fisher)[1:, 1:]
    where = np.clip(((np.asarray(at) - t[0]) / h).astype(int), 0, nodes - 2)
    w = (np.asarray(at) - grid[where]) / h
    weights = np.zeros((len(where), nodes))
    weights[np.arange(len(where)), where] = 1 - w
    weights[np.arange(len(where)), where + 1] = w
    return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", weights, covariance, weights)))
