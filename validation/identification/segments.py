"""Shooting segments of a recording's motion (multiple shooting): states at nodes, how they are moved, cut, compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from discsim.arrays import FloatArray, IntArray
from discsim.recording import Recording
from discsim.validation.identification.competing_effects import CATALOGUED, Competing
from discsim.validation.identification.observations import readings_of
from discsim.validation.identification.parameters import Values
from discsim.validation.identification.plants import Plant, plant_of
from discsim.validation.identification.propagation import base_flat, runner_of
from discsim.validation.identification.readings import Readings

__all__ = ["Trajectory", "resegmented", "stepped", "trajectory_of", "undone"]


@dataclass(frozen=True)
class Trajectory:
    """The motion of one recording in shooting segments: where they begin, in time and in state, and what is read.

    Attributes
    ----------
    recording, readings
        The recording, and those of its readings that take part.
    nodes : (k + 1,) array
        Boundaries of the segments, s.
    states : (k, s) array
        The states that they start from, as the plant's `Layout` has them.
    lost : mapping
        Samples lost before each of a sensor's samples (n,), by sensor, where some were.
    effects : Competing
        The effects that may act on the motion and on the sensors.
    trust_radius : (d,) array or None
        How far a step may move the first state, one sigma; None for the plant's.
    unbalanced : bool
        Whether moments fixed in the body turn it, of which nothing is stated.
    """

    recording: Recording
    readings: tuple[Readings, ...]
    nodes: FloatArray
    states: FloatArray
    lost: Mapping[str, FloatArray] = field(default_factory=dict)
    effects: Competing = CATALOGUED
    trust_radius: FloatArray | None = None
    unbalanced: bool = False

    @property
    def plant(self) -> Plant:
        """What kind of experiment it is."""
        plant = plant_of(self.recording)
        return plant.unbalanced if self.unbalanced and plant.unbalanced is not None else plant

    def segment_of(self, t: FloatArray) -> IntArray:
        """Return the places (n,) of the segments that tell the motion at instants t (n,) s: at a node the later one."""
        return np.clip(np.searchsorted(self.nodes, t, side="right") - 1, 0, len(self.states) - 1)


def trajectory_of(
    recording: Recording,
    nodes: FloatArray,
    states: FloatArray,
    effects: Competing = CATALOGUED,
    *,
    unbalanced: bool = False,
) -> Trajectory:
    """Return a recording cut at nodes (k + 1,) s with states (k, s) at the starts of its segments."""
    return Trajectory(recording, readings_of(recording), nodes, states, effects=effects, unbalanced=unbalanced)


def resegmented(current: Trajectory, values: Values, nodes: FloatArray) -> Trajectory:
    """Return the trajectory cut at other nodes (k + 1,) s, its new segments starting where the old motion was."""
    recording = current.recording
    runner = runner_of(recording, values, (), current.effects)
    flat, own = base_flat(recording, values, (), current.effects), current.plant.own_values(values)
    states = np.empty((nodes.size - 1, current.states.shape[1]))
    for j, i in enumerate(current.segment_of(nodes[:-1] + 1e-9)):
        start, state = float(current.nodes[i]), current.states[i]
        stop = float(nodes[j])
        if stop - start < 1e-9:
            states[j] = state
            continue
        times, last = runner.times(start, stop, stop, state)
        _, ends = runner.run(flat[None], own[None], state[None], times, last, np.empty(0))
        states[j] = ends[0]
    return replace(current, nodes=nodes, states=states)


def stepped(current: Trajectory, tangents: FloatArray) -> Trajectory:
    """Return the trajectory with its states moved by tangents (k, d)."""
    plant = current.plant
    return replace(current, states=plant.dynamics.consistent(plant.layout.moved(current.states, tangents)))


def undone(sensitivities: FloatArray, change: FloatArray) -> FloatArray:
    """Return the change (d, c) of a first state that amounts to a change (d, c) of a later one, moved there by (d, d).

    What motion has damped beyond double precision cannot be undone; of that the least is taken.
    """
    return np.asarray(np.linalg.lstsq(sensitivities, change, rcond=1e-13)[0])
