"""How samples that were lost at random walk about a slow clock, where no reading tells each of them.

Takes a fit with a sensor's clock that stands for losses; gives its trajectories with the walk. So many losses of a
share p are a Brownian motion of variance p/(1 - p)^2 by sample about the line of the clock. Its likeliest course is
linear in the readings, and what it costs is what a Gaussian process costs: the squares of its modes, and the logarithm
of how far the readings narrow them (C. Rasmussen and C. Williams, Gaussian Processes for Machine Learning, 2006, 2.3).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.identification.gauss_newton import Fit, mapped
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.prediction import read, shown
from discsim.validation.identification.readings import Readings, group_of
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import Values, delay

__all__ = ["by_one_sample", "evidence_of_walk", "place_of", "price_of_walk", "sd_of_axes", "walked"]

#: modes of a Brownian motion (Karhunen and Loeve); the others hold 1/(8 pi^2) of its variance, 1.3 %
_MODES = 16


class _Walk(NamedTuple):
    """A walk of losses in a recording: its modes (n, k) of unit variance in samples, and readings by them.

    ``rows`` (m, k) are what the modes change of the readings that count, in noise, ``left`` (m,) what these leave
    beside a clock without a walk, ``now`` (n,) the walk that a trajectory has. ``smooth`` (m, 3) are a shift of its
    times, one that grows with time and one with its square, in noise: what a motion may take up.
    """

    modes: FloatArray
    rows: FloatArray
    left: FloatArray
    now: FloatArray
    smooth: FloatArray

    @property
    def curvature(self) -> FloatArray:
        """The matrix (k, k) of the squares that the likeliest walk makes least."""
        return np.asarray(np.eye(self.modes.shape[1]) + self.rows.T @ self.rows, dtype=float)

    @property
    def likeliest(self) -> FloatArray:
        """The sizes (k,) of its modes that readings and ordinary losses make likeliest."""
        return np.asarray(np.linalg.solve(self.curvature, self.rows.T @ self.left), dtype=float)

    @property
    def held(self) -> FloatArray:
        """The sizes (k,) of its modes that a trajectory has."""
        return np.asarray(np.linalg.lstsq(self.modes, self.now, rcond=None)[0], dtype=float)

    def price(self, sizes: FloatArray) -> float:
        """Return what a walk with modes of some sizes (k,) costs, in chi-squared."""
        return float(sizes @ sizes + np.linalg.slogdet(self.curvature)[1])

    @property
    def evidence(self) -> float:
        """Twice the logarithm by which readings are likelier with a walk than without, beside what is smooth."""
        basis = np.linalg.qr(self.smooth)[0]
        rows = self.rows - basis @ (basis.T @ self.rows)
        moment = rows.T @ self.left
        curvature = np.eye(rows.shape[1]) + rows.T @ rows
        return float(moment @ np.linalg.solve(curvature, moment) - np.linalg.slogdet(curvature)[1])


def walked(fit: Fit, clock: CandidateEffect, noise: NoiseModel) -> tuple[Fit, float]:
    """Return a fit whose trajectories hold the likeliest walk of losses about a clock of all, and what it costs."""
    walks = _walks(fit, clock, noise)
    cost, trajectories = 0.0, list(fit.trajectories)
    for i, walk in enumerate(walks):
        if walk is not None:
            sizes = walk.likeliest
            cost += walk.price(sizes)
            lost = {**trajectories[i].lost, clock.row.acts_on: walk.modes @ sizes}
            trajectories[i] = replace(trajectories[i], lost=lost)
    return replace(fit, trajectories=tuple(trajectories)), cost


def price_of_walk(fit: Fit, clock: CandidateEffect, noise: NoiseModel) -> float:
    """Return what the walk of losses costs that the trajectories of a fit hold; zero where they hold none."""
    if all(clock.row.acts_on not in one.lost for one in fit.trajectories):
        return 0.0
    walks = [walk for walk in _walks(fit, clock, noise) if walk is not None]
    return float(sum(walk.price(walk.held) for walk in walks))


def evidence_of_walk(fit: Fit, clock: CandidateEffect) -> float:
    """Return twice the logarithm by which losses at random are likelier than a steady clock, by how they walk.

    Negative where their walk would show, and does not. What a motion may take up of it is left out: a phase, a rate and
    a friction of each recording. Nothing speaks for either where no walk is worked out.
    """
    walks = [walk for walk in _walks(fit, clock, fit.noise) if walk is not None]
    return float(sum(walk.evidence for walk in walks))


def _walks(fit: Fit, clock: CandidateEffect, noise: NoiseModel) -> list[_Walk | None]:
    """Return the walk in each recording; None where the sensor has no readings, or its clock is not a slow one."""
    place = place_of(fit, clock)
    assert place is not None
    share = 1.0 - float(fit.at[place])
    if not 0.0 < share < 1.0:
        return [None] * len(fit.trajectories)

    def one(i: int) -> _Walk | None:
        trajectory = fit.trajectories[i]
        readings = next((r for r in trajectory.readings if r.sensor == clock.row.acts_on), None)
        return None if readings is None else _walk(trajectory, fit.values(i), readings, share, noise)

    return mapped(one, range(len(fit.trajectories)))


def _walk(trajectory: Trajectory, values: Values, readings: Readings, share: float, noise: NoiseModel) -> _Walk:
    """Return the walk of a sensor's losses in one recording, ``share`` of its samples."""
    sensor, count = readings.sensor, len(readings.t)
    rate_hz = trajectory.recording.sheets[sensor].rate_hz
    now = trajectory.lost.get(sensor, np.zeros(count))
    t = readings.t - delay(values, sensor, readings.t) + now / rate_hz
    moved, good = by_one_sample(trajectory, values, readings, t)
    sd = sd_of_axes(noise, readings)
    left = readings.value - read(trajectory, values, readings) + moved * now[:, None]
    share_of_time = np.arange(1, count + 1) / count
    order = np.pi * (np.arange(1, _MODES + 1) - 0.5)
    size = np.sqrt(2.0 * count * share / (1.0 - share) ** 2) / order
    modes = np.sin(np.outer(share_of_time, order)) * size
    rows = (moved / sd)[:, :, None] * modes[:, None, :]
    smooth = (moved / sd)[:, :, None] * np.vander(share_of_time, 3)[:, None, :]
    return _Walk(modes, rows[good], (left / sd)[good], now, smooth[good])


def place_of(fit: Fit, clock: CandidateEffect) -> int | None:
    """Return the place of a clock's ratio among a fit's parameters; None where it is no part of the fit."""
    keys = [(q.group, q.recordings) for q in fit.parameters]
    wanted = (clock.id, clock.recordings)
    return keys.index(wanted) if wanted in keys else None


def by_one_sample(
    trajectory: Trajectory, values: Values, readings: Readings, t: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return by how much one sample later moves readings (n, k) that were taken at ``t`` (n,) s; which of them count.

    The sensor's rate is known.
    """
    later = t + 1.0 / trajectory.recording.sheets[readings.sensor].rate_hz
    moved = shown(trajectory, values, readings.sensor, later) - shown(trajectory, values, readings.sensor, t)
    return moved, readings.good & ((t > 0.0) & (later < trajectory.nodes[-1]))[:, None]


def sd_of_axes(noise: NoiseModel, readings: Readings) -> FloatArray:
    """Return the noise (k,) of a sensor's axes."""
    return np.array([noise[group_of(readings.sensor, axis)].sd for axis in range(readings.value.shape[1])])
