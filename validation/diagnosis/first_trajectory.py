"""The trajectories that fits start from: of the data alone, in true time by a wrong clock, of a beginning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import ClockRate
from discsim.recording import Recording
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.noise import channel_of
from discsim.validation.identification.parameters import Values
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.segments import Trajectory, trajectory_of

__all__ = [
    "CLOCK",
    "beginning",
    "begun_again",
    "begun_again_in_true_time",
    "first_trajectory",
    "nodes_of",
    "time_ratio",
    "trajectory_in_true_time",
    "within_range",
]

#: the clock of all sensors
CLOCK = (catalogued(ClockRate, "clock").id, "ratio")
#: clocks by which the motion of a relaxed fit goes: it follows the magnetometer's phase
_LEADING = (CLOCK, (catalogued(ClockRate, "magnetometer").id, "ratio"))


def nodes_of(recording: Recording) -> FloatArray:
    """Return the nodes of a recording's segments, s."""
    plant = plant_of(recording)
    return plant.nodes(recording, plant.durations.segment)


def time_ratio(values: Values) -> float:
    """Return the ratio of written to true time, of the times by which a motion is followed, under some values."""
    return float(np.prod([values.get(key, 1.0) for key in _LEADING]))


def trajectory_in_true_time(recording: Recording, ratio: float) -> Trajectory:
    """Return the first trajectory of a recording all of whose times are written as ``ratio`` times the true ones."""
    first = first_trajectory(recording)
    states = first.states.copy()
    states[:, list(first.plant.layout.per_time)] *= ratio
    return replace(first, nodes=first.nodes / ratio, states=states)


def first_trajectory(recording: Recording, ratio: float = 1.0, nodes: FloatArray | None = None) -> Trajectory:
    """Return a recording's trajectory, started from the data; ``ratio`` is that of the magnetometer's clock.

    Starts stand in the time that the magnetometer writes. ``nodes`` (k + 1,) are the boundaries of the segments, s,
    where they are not those that `nodes_of` a recording takes.
    """
    nodes, plant = nodes_of(recording) if nodes is None else nodes, plant_of(recording)
    found = trajectory_of(recording, nodes, plant.initial.states(recording, nodes[:-1], ratio))
    return replace(found, trust_radius=plant.sizes.of_path) if plant.path_alone(recording) else found


def begun_again(current: Trajectory, ratio: float = 1.0) -> Trajectory:
    """Return the first trajectory of a recording that is followed already; ``ratio`` is as in `first_trajectory`.

    Whether its body is out of balance is kept, and nothing else that was found meanwhile: neither which effects
    compete, nor which readings were left out or lost.
    """
    return replace(first_trajectory(current.recording, ratio), unbalanced=current.unbalanced)


def begun_again_in_true_time(current: Trajectory, ratio: float) -> Trajectory:
    """Return a trajectory with the segments and states of `trajectory_in_true_time`; all else of it stays."""
    timed = trajectory_in_true_time(current.recording, ratio)
    return replace(current, nodes=timed.nodes, states=timed.states)


def beginning(current: Trajectory, length: float) -> Trajectory:
    """Return the segments of a trajectory's first ``length`` s, at least one, and the readings within them."""
    count = min(max(1, int(np.searchsorted(current.nodes, length))), len(current.states))
    within = {r.sensor: r.t < float(current.nodes[count]) - 0.03 for r in current.readings}
    lost = {
        sensor: counts[within[sensor]] if counts.size == within[sensor].size else counts
        for sensor, counts in current.lost.items()
    }
    readings = tuple(r.at(within[r.sensor]) for r in current.readings)
    nodes, states = current.nodes[: count + 1], current.states[:count]
    return replace(current, nodes=nodes, states=states, readings=readings, lost=lost)


def within_range(current: Trajectory, linear: Linear) -> Trajectory:
    """Return the trajectory without readings that the sensor's range may have clipped, by what a fit expects of them.

    Leaving out readings by their own value would bias what remains.
    """
    kept = []
    for readings in current.readings:
        limit = readings.limit
        good = readings.good.copy()
        if limit is not None:
            for axis, name in enumerate(readings.axes):
                channel = channel_of(linear, readings.sensor, name)
                if channel is not None:
                    expected = readings.value[channel.index, axis] - linear.raw[channel.rows]
                    near = np.abs(expected) > limit - 6.0 * np.nan_to_num(linear.sd[channel.rows])
                    good[channel.index[near], axis] = False
        kept.append(replace(readings, good=good))
    return replace(current, readings=tuple(kept))
