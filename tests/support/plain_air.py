"""The air of docs/physics.md a second time, with matrices and at leisure, to hold the compiled one against."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from discsim.disc import Disc


def rotation_about_y(a: float) -> np.ndarray:
    return np.array([[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]])


def rotation_about_z(a: float) -> np.ndarray:
    return np.array([[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1]])


class Flow(NamedTuple):
    """What a coefficient may depend on."""

    alpha: float
    gamma: float
    V: float
    h: float
    d: float


Coefficients = dict[str, float]
#: an effect as a change of the baseline's coefficients
Change = Callable[[Coefficients, Flow], None]


def plain_wrench(
    disc: Disc, density: float, velocity: np.ndarray, rate: np.ndarray, h: float = 50.0, change: Change | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment (3,) in B about the geometric centre; velocity (3,) in B relative to the air."""
    a, d = disc.aero, disc.diameter
    assert a is not None
    V = float(np.linalg.norm(velocity))
    beta = np.arctan2(velocity[1], velocity[0])
    into_H = rotation_about_z(beta)
    u, v, w = into_H @ velocity
    assert abs(v) <= 1e-12 * V
    alpha = float(np.arctan2(w, u))
    p, q, r = into_H @ rate
    gamma = d * r / (2 * V)
    half = d / (2 * V)
    C = {
        "L": a.CL0 + a.CLa * alpha,
        "D": a.CD0 + a.CDa * (alpha - a.alpha0) ** 2,
        "Y": 0.0,
        "R": a.CRr * gamma + a.CRp * p * half,
        "M": a.CM0 + a.CMa * alpha + a.CMq * q * half,
        "N": a.CNr * gamma,
    }
    if change is not None:
        change(C, Flow(alpha, gamma, V, h, d))
    QA = density * V**2 / 2 * np.pi * d**2 / 4
    F_W = QA * np.array([-C["D"], C["Y"], -C["L"]])
    M_W = QA * d * np.array([C["R"], C["M"], 0.0])
    out_of_W = rotation_about_y(alpha)
    force = into_H.T @ out_of_W @ F_W
    moment = into_H.T @ (out_of_W @ M_W + np.array([0, 0, QA * d * C["N"]]))
    return force, moment
