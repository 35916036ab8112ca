"""What is added to a sensor's readings before lag and noise: effects that are called by their row, laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Effect
from discsim.law import Law
from discsim.motion import Motion
from discsim.recording import SENSORS

__all__ = ["Addition", "added", "by_effect", "by_law"]

#: readings (n, k), true instants t (n,) s and the motion they are of, to new readings (n, k)
Addition: TypeAlias = Callable[[FloatArray, FloatArray, Motion], FloatArray]


def added(additions: Sequence[Addition], readings: FloatArray, t: FloatArray, motion: Motion) -> FloatArray:
    """Return readings (n, k) at instants t (n,) with what is added to them, one addition after the other."""
    for addition in additions:
        readings = addition(readings, t, motion)
    return readings


def by_effect(effect: Effect) -> Addition:
    """Return what an effect with a function of its own does to its sensor's readings."""
    applied = effect.applied
    assert applied is not None

    def addition(readings: FloatArray, t: FloatArray, motion: Motion) -> FloatArray:
        since = t - motion.start
        return applied.on_readings(tuple(effect.value), readings, since, motion.at(t)._replace(t=since))

    return addition


def by_law(law: Law) -> Addition:
    """Return what a law about a sensor's column adds to its readings; V is relative to the known wind."""
    sensor, _, column = law.target.partition(".")
    place = SENSORS[sensor].columns.index(column)

    def addition(readings: FloatArray, t: FloatArray, motion: Motion) -> FloatArray:
        changed = readings.copy()
        changed[:, place] += law.evaluate(_symbols(readings, t, motion))
        return changed

    return addition


def _symbols(readings: FloatArray, t: FloatArray, motion: Motion) -> dict[str, FloatArray]:
    """Return the symbols of a law, each (n,)."""
    state = motion.at(t)
    u, v, w = state.in_body(state.velocity - motion.environment.wind).T
    beta = np.arctan2(v, u)
    P, Q, r = state.rate.T
    from scipy.interpolate import CubicHermiteSpline  # loads in a third of a second, and few sensors have a law

    spin = CubicHermiteSpline(motion.t, motion.rate[:, 2], motion.angular_acceleration[:, 2])
    read = {name: readings[:, k] for k, name in enumerate("xyz") if k < readings.shape[1]}
    return {
        "t": t - motion.start,
        "h": -state.position[:, 2],
        "V": np.sqrt(u * u + v * v + w * w),
        "alpha": np.arctan2(w, np.hypot(u, v)),
        "p_H": np.cos(beta) * P + np.sin(beta) * Q,
        "q_H": np.cos(beta) * Q - np.sin(beta) * P,
        "r": r,
        "psi": spin.antiderivative()(t),
        **read,
    }
