"""Prediction of readings from shooting segments: clocks, lags and what a sensor would show.

Takes a trajectory and values of parameters; gives readings when they are written. A low-pass is a weighted mean over
earlier instants (Gauss-Laguerre quadrature of its exponential memory).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray, IntArray
from discsim.effects.sensors import Lag
from discsim.validation.identification.dynamics import ROW
from discsim.validation.identification.noise import GroupNoise
from discsim.validation.identification.parameters import Values
from discsim.validation.identification.propagation import Runner, base_flat, runner_of
from discsim.validation.identification.readings import Readings, group_of
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import delay, predicted, sized

__all__ = ["Sampled", "Shiftable", "read", "shiftable", "shown"]

#: half the difference in time by which a reading's slope is taken, s
_TIME_STEP = 2e-4
#: how far behind a motion's end an instant is read at most, s: by a clock that ran away it would be run for ever
_BEYOND = 10.0


#: nodes and weights of a first-order lag: an integral over the past with weight exp(-s)
_LAG_NODES, _LAG_WEIGHTS = np.polynomial.laguerre.laggauss(8)
#: the same from a corner on until now, on -1 to 1, without the weight
_SINCE_NODES, _SINCE_WEIGHTS = np.polynomial.legendre.leggauss(8)
#: time constants after which a lag has forgotten a corner: 6 parts in a million are left
_FORGOTTEN = 12.0


class Sampled:
    """The instants at which one sensor's readings show the motion."""

    def __init__(self, current: Trajectory, readings: Readings, values: Values) -> None:
        self.readings, self.sensor = readings, readings.sensor
        self.width = readings.value.shape[1]
        self.rate_hz = current.recording.sheets[readings.sensor].rate_hz
        self.lost = current.lost.get(readings.sensor)
        self.tau = 0.0
        self.written = readings.t if readings.taken is None else readings.taken.ravel()
        self.weights = readings.weights
        taken = np.minimum(self.written - self.delays(values), float(current.nodes[-1]) + _BEYOND)
        self.tau = sized(values, Lag, self.sensor).tau_s
        #: what is left of what a lag held when the recording began, a share (m,); None where that is left out
        self.dying: FloatArray | None = None
        if self.tau > 0:
            own = np.ones((1, taken.size)) if self.weights is None else self.weights
            # every sample is a weighted mean over its past
            ages, weights = _memory(taken, _corners(current, self.tau), self.tau)
            self.weights = (weights.reshape(-1, *own.shape) * own).reshape(-1, own.shape[1])
            past = taken[None, :] - self.tau * ages
            self.lag_slope = ages.ravel()
            if current.plant.held and self.sensor == "accelerometer":
                self.lag_slope[past.ravel() < 0.0] = 0.0
                past = np.maximum(past, 0.0)
                self.dying = np.tile(np.exp(-np.maximum(taken, 0.0) / self.tau), len(ages))
            self.instants = past.ravel()
        else:
            self.instants = taken
            self.lag_slope = np.ones(taken.size)
        self.nodes = 1 if self.weights is None else self.weights.shape[0]
        #: what is read beside the motion (m, width): what a lag still held at these instants, how that grows with its
        #: time constant, and by how much a magnetometer's zero is off
        self.held = self.held_slope = np.zeros((self.instants.size, self.width))
        if self.sensor == "magnetometer" and current.plant.zeros:
            self.held = self.held + np.array([values.get(key, 0.0) for key in current.plant.zero_keys])
        if self.dying is not None:
            began = np.array([values.get(key, 0.0) for key in current.plant.held_keys])
            self.held = self.dying[:, None] * began
            self.held_slope = self.held * np.tile(np.maximum(taken, 0.0), len(ages))[:, None] / self.tau**2

    def delays(self, values: Values) -> FloatArray:
        """Return how much earlier than written the readings (nodes n,) show the motion."""
        late = delay(values, self.sensor, self.written)
        if self.lost is not None and self.lost.size == late.size:
            late = late - self.lost / self.rate_hz
        return np.tile(late, self.instants.size // late.size) if self.tau > 0 and late.size else late

    def time_slope(
        self, runner: Runner, flat: FloatArray, own: FloatArray, values: Values, current: Trajectory
    ) -> FloatArray:
        """Return the slopes (m, width) of the ideal readings in time."""
        segments = current.segment_of(self.instants)
        early = np.maximum(np.maximum(self.instants, current.nodes[segments]) - _TIME_STEP, current.nodes[segments])
        both, twice = np.concatenate([early + 2.0 * _TIME_STEP, early]), np.concatenate([segments, segments])
        rows = _rows(current, runner, (flat, own), both, twice)
        read = predicted(self.sensor, current.recording, values, both, rows, current.effects)
        return np.asarray((read[: early.size] - read[early.size :]) / (2.0 * _TIME_STEP))

    def weighted(self, array: FloatArray) -> FloatArray:
        """Return what the sensor shows of ideal readings (nodes n, ...): itself, or the weighted past."""
        if self.weights is None:
            return array
        parts = array.reshape(self.nodes, -1, *array.shape[1:])
        return np.asarray(np.einsum("wn,wn...->n...", self.weights, parts))


def _corners(current: Trajectory, tau: float) -> FloatArray:
    """Return the instants (c,) s at which a command bends, none where bends are closer than a lag remembers one."""
    command = current.recording.command
    if not current.plant.commanded or command is None or np.min(np.diff(command.t), initial=np.inf) < tau:
        return np.zeros(0)
    return command.t


def _memory(taken: FloatArray, corners: FloatArray, tau: float) -> tuple[FloatArray, FloatArray]:
    """Return ages (j, m), in time constants, and weights (j, m) of the past in readings taken at (m,) s.

    A rule for smooth signals knows nothing of corners: of a rate that begins to grow it misses up to 3.7 % of what it
    grows by in a time constant. So the past is parted at the last corner.
    """
    plain = np.repeat(_LAG_NODES[:, None], taken.size, axis=1), np.repeat(_LAG_WEIGHTS[:, None], taken.size, axis=1)
    if not corners.size:
        return plain
    last = np.searchsorted(corners, taken, side="right") - 1
    since = np.where(last < 0, 0.0, (taken - corners[np.maximum(last, 0)]) / tau)
    since = np.where(since > _FORGOTTEN, 0.0, since)
    ages = 0.5 * since * (_SINCE_NODES[:, None] + 1.0)
    weights = 0.5 * since * _SINCE_WEIGHTS[:, None] * np.exp(-ages)
    return np.vstack([ages, since + plain[0]]), np.vstack([weights, np.exp(-since) * plain[1]])


def _rows(
    current: Trajectory, runner: Runner, parameters: tuple[FloatArray, FloatArray], t: FloatArray, segments: IntArray
) -> FloatArray:
    """Return the rows (n, 19) of a trajectory's motion at instants t (n,) s of its segments (n,).

    ``parameters`` are those of the physics, laid flat, and the plant's own.
    """
    flat, own = parameters
    rows = np.empty((t.size, ROW))
    for i, (start, stop) in enumerate(pairwise(current.nodes.tolist())):
        mine = np.flatnonzero(segments == i)
        if mine.size:
            out = np.maximum(t[mine], start)
            times, last = runner.times(start, stop, float(out.max()), current.states[i])
            rows[mine] = runner.run(flat[None], own[None], current.states[i : i + 1], times, last, out)[0][0]
    return rows


def shown(current: Trajectory, values: Values, sensor: str, t: FloatArray) -> FloatArray:
    """Return what a sensor would read (n, k) at true instants t (n,) of a trajectory's motion, before lag and noise."""
    recording = current.recording
    effects = current.effects
    parameters = base_flat(recording, values, (), effects), current.plant.own_values(values)
    rows = _rows(current, runner_of(recording, values, (), effects), parameters, t, current.segment_of(t))
    return predicted(sensor, recording, values, t, rows, effects)


def read(current: Trajectory, values: Values, readings: Readings) -> FloatArray:
    """Return what a sensor would read (n, width) when `readings` are written, clocks and lag too.

    Noise, rounding and range are left to whoever asks.
    """
    sampled = Sampled(current, readings, values)
    return sampled.weighted(shown(current, values, readings.sensor, sampled.instants) + sampled.held)


class Shiftable(NamedTuple):
    """Readings beside what a motion shows on a fine grid, both in noise, so that they can be shifted along it.

    ``at`` (n,) s are the true times of readings (n, k), NaN where they do not count; ``shown`` (m, k) is the motion's
    on the ``grid`` (m,) s.
    """

    at: FloatArray
    value: FloatArray
    grid: FloatArray
    shown: FloatArray


def shiftable(
    current: Trajectory, values: Values, readings: Readings, noise: Mapping[str, GroupNoise], step: float
) -> Shiftable:
    """Return readings beside what a trajectory's motion shows on a grid of ``step`` s."""
    sensor = readings.sensor
    groups = [group_of(sensor, axis) for axis in range(readings.value.shape[1])]
    # of a sensor that has no reading which counts, nothing is known
    sd = np.array([noise[group].sd if group in noise else np.nan for group in groups])
    grid = np.arange(float(current.nodes[0]), float(current.nodes[-1]), step)
    value = np.where(readings.good, readings.value, np.nan) / sd
    at = readings.t - delay(values, sensor, readings.t)
    return Shiftable(at, value, grid, shown(current, values, sensor, grid) / sd)
