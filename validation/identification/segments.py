"""Shooting segments of a recording's motion: states at nodes, how they are moved, cut and compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.frames import conjugate, multiply, rotation_vector, turn
from discsim.recording import Recording
from validation.identification.dynamics import (
    STATE,
)
from validation.identification.observations import Readings, readings_of
from validation.identification.propagation import WOBBLE, base_flat, runner_of
from validation.identification.sensor_model import Values

__all__ = ["STEPS", "Chain", "chain", "recut", "stepped", "undone"]

#: half the differences of states: m, m/s, rad, rad/s
STEPS = {
    "flight": np.repeat([1e-3, 1e-3, 1e-5, 1e-4], 3),
    "free_spin": np.array([1e-2, 1e-2, 1e-2, 1e-2, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4, 1e-3, 3e-3, 3e-3]),
    "spin_down": np.array([1e-5, 1e-4]),
    "rate_table": np.array([1e-5]),
}


@dataclass(frozen=True)
class Chain:
    """The pieces of one recording: boundaries (k + 1,) s and the states (k, s) they start from."""

    recording: Recording
    readings: tuple[Readings, ...]
    edges: FloatArray
    states: FloatArray
    #: sensor -> samples lost before each of its samples (n,), where some were
    lost: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def tangent(self) -> int:
        """Number of directions in which a state can move."""
        return {"flight": 12, "free_spin": 15, "spin_down": 2, "rate_table": 1}[self.recording.plant]


def shifted(plant: str, states: FloatArray, tangents: FloatArray) -> FloatArray:
    """Return states (..., s) moved by tangents (..., d): rotations are small turns in B."""
    shape = (*np.broadcast_shapes(states.shape[:-1], tangents.shape[:-1]), states.shape[-1])
    moved = np.array(np.broadcast_to(states, shape))
    if plant in ("flight", "free_spin"):
        moved[..., :6] += tangents[..., :6]
        moved[..., 6:10] = multiply(moved[..., 6:10], turn(tangents[..., 6:9]))
        moved[..., 10:] += tangents[..., 9:]
    else:
        d = tangents.shape[-1]
        moved[..., :d] += tangents
    return moved


def difference(plant: str, a: FloatArray, b: FloatArray, d: int) -> FloatArray:
    """Return the tangents (..., d) that move states b (..., s) to a."""
    if plant in ("flight", "free_spin"):
        return np.concatenate(
            [
                a[..., :6] - b[..., :6],
                rotation_vector(multiply(conjugate(b[..., 6:10]), a[..., 6:10])),
                a[..., 10:] - b[..., 10:],
            ],
            axis=-1,
        )
    return np.asarray(a[..., :d] - b[..., :d])


def chain(
    recording: Recording, edges: FloatArray, states: FloatArray, lost: Mapping[str, FloatArray] | None = None
) -> Chain:
    """Return a recording cut at edges (k + 1,) s with states (k, s) at the starts of its pieces.

    Numbers of a state beyond those given are zero.
    """
    missing = STATE[recording.plant] - states.shape[1]
    states = np.hstack([states, np.zeros((len(states), missing))])
    return Chain(recording, readings_of(recording), edges, states, dict(lost or {}))


def recut(current: Chain, values: Values, edges: FloatArray) -> Chain:
    """Return the chain cut at other edges (k + 1,), its new pieces starting where the old motion was."""
    recording = current.recording
    runner = runner_of(recording, values)
    flat, wobble = base_flat(recording, values), np.array([values.get(key, 0.0) for key in WOBBLE])
    states = np.empty((edges.size - 1, current.states.shape[1]))
    piece = np.clip(np.searchsorted(current.edges, edges[:-1] + 1e-9, side="right") - 1, 0, len(current.states) - 1)
    for j, i in enumerate(piece):
        start, state = float(current.edges[i]), current.states[i]
        stop = float(edges[j])
        if stop - start < 1e-9:
            states[j] = state
            continue
        times, last = runner.times(start, stop, stop, state)
        _, ends = runner.run(flat[None], wobble[None], state[None], times, last, np.empty(0))
        states[j] = ends[0]
    return replace(current, edges=edges, states=states)


def stepped(current: Chain, tangents: FloatArray) -> Chain:
    """Return the chain with its states moved by tangents (k, d)."""
    states = shifted(current.recording.plant, current.states, tangents)
    if current.recording.plant == "rate_table":
        # the angle turned so far goes along with the yaw
        states[:, 1] = states[:, 0] - states[0, 0]
    return replace(current, states=states)


def undone(moves: FloatArray, change: FloatArray) -> FloatArray:
    """Return the change (d, c) of a first state that amounts to a change (d, c) of a later one, moved there by (d, d).

    What motion has damped beyond double precision cannot be undone; of that the least is taken.
    """
    return np.asarray(np.linalg.lstsq(moves, change, rcond=1e-13)[0])
