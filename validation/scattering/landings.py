"""Flights of many drawn throws: chunks that any worker can fly, each with random numbers of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Disc
from discsim.effects.catalogue import Effect
from discsim.environment import Environment
from discsim.trajectory import predict_many
from discsim.validation.running.tasks import Task
from discsim.validation.scattering.inputs import Inputs

__all__ = ["CHUNK", "Flown", "Throws", "chunk_tasks", "fly_chunk"]

#: flights of one task: some seconds of work
CHUNK = 10_000
#: tolerance of the flights: 1e-6 is within a hundredth of a millimetre (docs/trajectory.md), beside decimetres
TOLERANCE = 1e-6


class Throws(NamedTuple):
    """What every worker has: the uncertain throw, its disc and place for their tables, the seed, threads per chunk."""

    inputs: Inputs
    disc: Disc
    environment: Environment
    effects: tuple[Effect, ...]
    seed: int
    threads: int | None


class Flown(NamedTuple):
    """How throws ended: inputs (n, k) in their units, ends (n, 4) north, east, time aloft and speed, draws refused.

    The ends of a flight that did not land are NaN.
    """

    inputs: FloatArray
    ends: FloatArray
    refused: int

    @classmethod
    def of(cls, chunks: Sequence[dict[str, FloatArray]]) -> Flown:
        """Join the chunks of `fly_chunk`."""
        return cls(
            np.concatenate([chunk["inputs"] for chunk in chunks]),
            np.concatenate([chunk["ends"] for chunk in chunks]),
            int(sum(chunk["refused"][0] for chunk in chunks)),
        )


def chunk_tasks(flights: int) -> list[Task]:
    """Return the chunks of so many flights, for `fly_chunk`."""
    counts = [min(CHUNK, flights - first) for first in range(0, flights, CHUNK)]
    return [Task(f"chunk-{number:05d}", [number, count]) for number, count in enumerate(counts)]


def fly_chunk(chunk: Sequence[int], throws: Throws) -> dict[str, FloatArray]:
    """Fly the throws of one chunk (number, count); what is drawn depends on the seed and the number alone."""
    number, count = chunk
    rng = np.random.default_rng(np.random.SeedSequence(throws.seed, spawn_key=(number,)))
    drawn = throws.inputs.draw(count, rng)
    flown = predict_many(
        throws.disc,
        throws.environment,
        drawn.states,
        throws.effects,
        parameters=drawn.parameters,
        tolerance=TOLERANCE,
        threads=throws.threads,
    )
    ends = np.column_stack([flown.state[:, :2], flown.end, np.linalg.norm(flown.state[:, 3:6], axis=1)])
    ends[~flown.touched_down] = np.nan
    return {"inputs": drawn.inputs, "ends": ends, "refused": np.array([float(drawn.refused)])}
