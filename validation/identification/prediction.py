"""Prediction of readings from segments of motion: clocks, lags and what a sensor would show."""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from validation.identification.dynamics import (
    ROW,
)
from validation.identification.parameters import Values
from validation.identification.propagation import Runner, base_flat, runner_of
from validation.identification.readings import Readings
from validation.identification.segments import Chain
from validation.identification.sensor_model import delay, predicted, value

__all__ = ["Sampled", "read", "shown"]

#: half the difference in time by which a reading's slope is taken, s
_TIME_STEP = 2e-4


#: nodes and weights of a first-order lag: an integral over the past with weight exp(-s)
_LAG_NODES, _LAG_WEIGHTS = np.polynomial.laguerre.laggauss(8)


class Sampled:
    """The instants at which one sensor's readings show the motion."""

    def __init__(self, current: Chain, readings: Readings, values: Values) -> None:
        self.readings, self.sensor = readings, readings.sensor
        self.width = readings.value.shape[1]
        self.rate_hz = current.recording.sheets[readings.sensor].rate_hz
        self.lost = current.lost.get(readings.sensor)
        self.tau = 0.0
        self.written = readings.t if readings.taken is None else readings.taken.ravel()
        self.weights = readings.weights
        written = self.written
        taken = written - self.delays(values)
        prefix = {"magnetometer": "mag", "accelerometer": "accel", "gyroscope": "gyro"}.get(self.sensor, "")
        self.tau = value(values, f"{prefix}.lag", "tau_s") if prefix and self.weights is None else 0.0
        self.nodes = 1
        if self.tau > 0:
            self.weights = np.repeat(_LAG_WEIGHTS[:, None], written.size, axis=1)
            # every reading is a weighted mean over its past
            past = taken[None, :] - self.tau * _LAG_NODES[:, None]
            self.instants = past.ravel()
            self.lag_slope = np.repeat(_LAG_NODES, written.size)
        else:
            self.instants = taken
            self.lag_slope = np.ones(written.size)
        self.nodes = 1 if self.weights is None else self.weights.shape[0]

    def delays(self, values: Values) -> FloatArray:
        """Return how much earlier than written the readings (nodes n,) show the motion."""
        late = delay(values, self.sensor, self.written)
        if self.lost is not None and self.lost.size == late.size:
            late = late - self.lost / self.rate_hz
        if self.tau > 0:
            late = np.tile(late, _LAG_NODES.size)
        return late

    def time_slope(
        self, runner: Runner, flat: FloatArray, own: FloatArray, values: Values, current: Chain
    ) -> FloatArray:
        """Return the slopes (m, width) of the ideal readings in time."""
        slope = np.empty((self.instants.size, self.width))
        edges = current.edges
        piece = np.clip(np.searchsorted(edges, self.instants, side="right") - 1, 0, current.states.shape[0] - 1)
        for i in range(current.states.shape[0]):
            o = np.flatnonzero(piece == i)
            if o.size == 0:
                continue
            t = np.maximum(self.instants[o], edges[i])
            early = np.maximum(t - _TIME_STEP, edges[i])
            late = early + 2.0 * _TIME_STEP
            both = np.concatenate([late, early])
            times, last = runner.times(float(edges[i]), float(edges[i + 1]), float(both.max()), current.states[i])
            rows, _ = runner.run(flat[None], own[None], current.states[i : i + 1], times, last, both)
            read = predicted(self.sensor, current.recording, values, both, rows[0], current.effects)
            slope[o] = (read[: o.size] - read[o.size :]) / (2.0 * _TIME_STEP)
        return slope

    def weighted(self, array: FloatArray) -> FloatArray:
        """Return what the sensor shows of ideal readings (nodes n, ...): itself, or the weighted past."""
        if self.weights is None:
            return array
        parts = array.reshape(self.nodes, -1, *array.shape[1:])
        return np.asarray(np.einsum("wn,wn...->n...", self.weights, parts))


def shown(current: Chain, values: Values, sensor: str, t: FloatArray) -> FloatArray:
    """Return what a sensor would read (n, k) at true instants t (n,) of a chain's motion, before lag and noise."""
    recording = current.recording
    runner = runner_of(recording, values, (), current.effects)
    flat, own = base_flat(recording, values, (), current.effects), current.plant.own_values(values)
    rows = np.empty((t.size, ROW))
    piece = np.clip(np.searchsorted(current.edges, t, side="right") - 1, 0, len(current.states) - 1)
    for i in range(len(current.states)):
        mine = np.flatnonzero(piece == i)
        if mine.size:
            out = np.maximum(t[mine], current.edges[i])
            start, stop = float(current.edges[i]), float(current.edges[i + 1])
            times, last = runner.times(start, stop, float(out.max()), current.states[i])
            rows[mine] = runner.run(flat[None], own[None], current.states[i : i + 1], times, last, out)[0][0]
    return predicted(sensor, recording, values, t, rows, current.effects)


def read(current: Chain, values: Values, readings: Readings) -> FloatArray:
    """Return what a sensor would read (n, width) of a chain's motion when `readings` are written, clocks and lag too.

    Noise, rounding and range are left to whoever asks.
    """
    sampled = Sampled(current, readings, values)
    return sampled.weighted(shown(current, values, readings.sensor, sampled.instants))
