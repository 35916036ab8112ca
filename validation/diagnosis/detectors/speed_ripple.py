"""Speed ripple: a line in the residual of a rig's rate at a multiple of its angle (order analysis).

Takes a fit of rigs; gives candidates with order, amplitude and phase.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.rig import SpeedRipple
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.diagnosis.detectors.local_problem import gain_of, peaks
from discsim.validation.diagnosis.settings import DETECTORS
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.sensor_model import delay

__all__ = ["ripple"]

_ID = catalogued(SpeedRipple).id
#: orders of a speed ripple looked for, and the angle (rad) within which readings are taken together
_ORDERS, _BIN = (0.1, 40.0), 0.02


def ripple(
    fit: Fit, noise: NoiseModel, taken: Sequence[CandidateEffect] = (), least: float = DETECTORS.least
) -> list[ScreenedCandidate]:
    """Return ripples of a table's speed as screened candidates, best first: several orders where they are near in gain.

    The rate's residual (rate reference, else gyroscope, else the magnetometer's phase) is transformed over the angle
    turned; the best orders are then refined by least squares. The gain is less what so many orders gain by chance.
    """
    if not fit.plant.commanded or any(candidate.id == _ID for candidate in taken):
        return []
    found = _ripples(fit, noise, least, 0.0)
    if not found:
        return []
    # what is told first slows the table: over the angle that it then has turned a strong ripple is a line
    amplitude = found[0].start[((_ID, "amplitude_rad_s"), None)]
    return _ripples(fit, noise, least, amplitude) or found


def _ripples(fit: Fit, noise: NoiseModel, least: float, amplitude: float) -> list[ScreenedCandidate]:
    """Return what `ripple` does, of a table that one of this amplitude (rad/s) slows."""
    told = [_rate_residual(fit, i, noise, amplitude) for i in range(len(fit.trajectories))]
    parts = [part for part in told if part is not None]
    if not parts:
        return []
    psi, e, weight = (np.concatenate([part[j] for part in parts]) for j in range(3))
    if psi.size < 32 or (width := float(np.ptp(psi))) < 2.0 * np.pi:
        return []
    bins = int(width / _BIN) + 1
    size = 1 << int(np.ceil(np.log2(4 * bins)))
    place = ((psi - psi.min()) / _BIN).astype(np.int64)
    spectrum = np.fft.rfft(np.bincount(place, weight * e, minlength=size)[:size], size)
    order = 2.0 * np.pi * np.fft.rfftfreq(size, _BIN)
    power = 2.0 * np.abs(spectrum) ** 2 / weight.sum()
    inside = (order > max(_ORDERS[0], 4.0 * np.pi / width)) & (order < _ORDERS[1])
    chance = 2.0 * np.log(max(_ORDERS[1] * width / (2.0 * np.pi), 1.0))
    power = np.where(inside, power, 0.0)
    found: list[ScreenedCandidate] = []
    for top in peaks(power, 6):
        best = max(
            (_sine(psi, e, weight, o) for o in order[top] + np.linspace(-1.5, 1.5, 61) * np.pi / width),
            key=lambda sine: sine[0],
        )
        best = max(
            (_sine(psi, e, weight, best[1] + step) for step in np.linspace(-0.03, 0.03, 25) * np.pi / width),
            key=lambda sine: sine[0],
        )
        gain, o, amplitude, phase = best
        if gain - chance > least:
            id, shape = _ID, (("order", o), ("phase_rad", phase))
            candidate = CandidateEffect(id, (Column(id, "amplitude_rad_s", 0.005, shape),))
            start: dict[tuple[tuple[str, str], frozenset[int] | None], float] = {
                ((id, name), None): number for name, number in (*shape, ("amplitude_rad_s", amplitude))
            }
            if all(abs(o - p.candidate.shape_grid["order"]) > np.pi / width for p in found):
                found.append(ScreenedCandidate(candidate, gain - chance, start))
    found.sort(key=gain_of, reverse=True)
    return [p for p in found if p.gain > 0.8 * found[0].gain][:3]


def _sine(psi: FloatArray, e: FloatArray, weight: FloatArray, order: float) -> tuple[float, float, float, float]:
    """Return gain, order, amplitude and phase of the best amplitude sin(order psi + phase)."""
    s, c = np.sin(order * psi), np.cos(order * psi)
    ss, cc, sc = (weight * s) @ s, (weight * c) @ c, (weight * s) @ c
    es, ec = (weight * e) @ s, (weight * e) @ c
    det = ss * cc - sc * sc
    a, b = (cc * es - sc * ec) / det, (ss * ec - sc * es) / det
    return float(a * es + b * ec), float(order), float(np.hypot(a, b)), float(np.arctan2(b, a))


def _rate_residual(
    fit: Fit, i: int, noise: NoiseModel, amplitude: float
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return angle turned, residual of the rate and its weight (n,) of a recording, from the sensor that tells best.

    A table of rate c + a sin(order psi) takes 2 pi / sqrt(c^2 - a^2) for a turn: it turns slower than its command.
    """
    linear, trajectory = fit.linears[i], fit.trajectories[i]
    command = trajectory.recording.command
    assert command is not None
    for sensor, axis in (("rate_reference", None), ("gyroscope", "z_rad_s"), ("magnetometer", None)):
        channels = [c for c in linear.channels if c.sensor == sensor and axis in (None, c.axis)]
        if not channels:
            continue
        t = np.concatenate([linear.t[c.rows] for c in channels])
        t = t - delay(fit.values(i), sensor, t)
        rate = np.interp(t, command.t, command.value)
        mean = np.sign(command.value) * np.sqrt(np.maximum(command.value**2 - amplitude**2, 0.0))
        psi = _turned(command.t, mean, t)
        e = np.concatenate([linear.residual[c.rows] for c in channels])
        sd = np.concatenate([np.full(c.index.size, noise[c.group].sd) for c in channels])
        moving = np.abs(rate) > 0.5
        if sensor != "magnetometer":
            e = e - np.mean(e)
            return psi[moving], e[moving], sd[moving] ** -2.0
        assert trajectory.plant.layout.yaw is not None
        slope = np.concatenate([linear.own[c.rows, trajectory.plant.layout.yaw] for c in channels])
        ok = moving & (np.abs(slope) > 3.0 * sd)
        # the rate that a slip of phase amounts to is its slope in time: differences of one axis at a time
        return _phase_rate(t[ok], psi[ok], e[ok] / slope[ok], sd[ok] / np.abs(slope[ok]))
    return None


def _phase_rate(
    t: FloatArray, psi: FloatArray, phase_drift: FloatArray, sd: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return angle, rate and weight from slips of phase: averaged per instant, then their differences."""
    instants, inverse = np.unique(t, return_inverse=True)
    if instants.size < 8:
        return None
    w = np.bincount(inverse, sd**-2.0)
    mean = np.bincount(inverse, phase_drift * sd**-2.0) / w
    angle = np.bincount(inverse, psi) / np.bincount(inverse)
    gap = np.diff(instants)
    near = gap < 2.5 * np.median(gap)
    rate = np.diff(mean) / gap
    weight = gap**2 / (1.0 / w[1:] + 1.0 / w[:-1])
    return 0.5 * (angle[1:] + angle[:-1])[near], rate[near], weight[near]


def _turned(t: FloatArray, rate: FloatArray, at: FloatArray) -> FloatArray:
    """Return the angle (n,) that a table has turned at instants by its command's knots."""
    until = cumulative_trapezoid(rate, t, initial=0)
    inside = np.clip(at, t[0], t[-1])
    k = np.clip(np.searchsorted(t, inside, side="right") - 1, 0, t.size - 2)
    x = inside - t[k]
    slope = (rate[k + 1] - rate[k]) / (t[k + 1] - t[k])
    outside = (at - inside) * np.where(at > t[-1], rate[-1], rate[0])
    return np.asarray(until[k] + x * (rate[k] + 0.5 * slope * x) + outside)
