"""Many throws of one disc in MuJoCo, on all cores: `fly_many`.

`mujoco.batch` steps them on its own threads, in which our air is a C function and needs no interpreter. It never runs a
callback in Python: on two threads that is slower than on one, and an exception in it would end the process.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco.batch import Batch

from discsim.arrays import FloatArray, IntArray
from discsim.callbacks import own_warnings, stepped_by_c
from discsim.compiled import compiled
from discsim.disc import Disc, Release
from discsim.effects.catalogue import Effect
from discsim.engine import DIVERGED, LARGEST_TURN, FlyingDisc, centre_state, touch_down
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.law import Law
from discsim.logbook import Logbook, height
from discsim.motion import State

__all__ = ["Ends", "fly_many"]

#: steps that all flights together take before the ground is looked for, and the most that each takes: what is recorded
#: meanwhile is a few megabytes, what a thread waits that opens a block is tenths of a second, and what is flown below
#: the ground is a small part of a flight
ROUND, LONGEST = 20_000, 200
#: what is recorded: 14 numbers, which stand first in the whole state, too
_STATE = int(mujoco.mjtState.mjSTATE_TIME | mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL)
_WIDTH = 14
_WHOLE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


class Ends(NamedTuple):
    """How n flights ended: the state at the end of each, and touched_down (n,).

    All of a flight whose motion or whose air is not finite is NaN, as outside a C_Nr table, and so is one that turns by
    more than `discsim.engine.LARGEST_TURN` in a step.
    """

    state: State
    touched_down: np.ndarray[Any, np.dtype[np.bool_]]


@compiled
def _first_below(path: FloatArray, first: IntArray, ex: float, ey: float, ez: float) -> None:
    """Write the place of the first row of each flight (n, m, 14) whose centre of mass is below the ground or nowhere.

    It is m where none is.
    """
    for flight in range(path.shape[0]):
        first[flight] = path.shape[1]
        for k in range(path.shape[1]):
            if not height(path[flight, k, 1:], ex, ey, ez) > 0.0:
                first[flight] = k
                break


def fly_many(
    disc: Disc,
    environment: Environment,
    releases: Sequence[Release],
    effects: Sequence[Effect] = (),
    *,
    timestep: float = 1e-3,
    duration: float = 30.0,
    threads: int | None = None,
    law: Law | Sequence[Law] | None = None,
) -> Ends:
    """Fly n throws in MuJoCo until each touches down, or for ``duration`` s; see `fly`.

    What comes out does not depend on the number of threads, by default one for each core. Where the callback cannot be
    in C, all fly on one thread. Raises `InputError` for a release that lacks something.
    """
    count, steps = len(releases), max(1, round(duration / timestep))
    flying, last = (FlyingDisc(disc, environment, effects, timestep=timestep, law=law) for _ in range(2))
    rows = np.full((count, 1 + last.model.nq + 2 * last.model.nv), np.nan)
    touched = np.zeros(count, dtype=np.bool_)
    if not count:
        return Ends(centre_state(rows, flying), touched)
    with own_warnings(), flying.air(), last.air():
        batch = Batch(flying.model, count, threads or len(os.sched_getaffinity(0)))
        batch.set_models(flying.model)  # the callback knows this one; the batch's own is a copy
        for k, release in enumerate(releases):
            flying.release(release)
            mujoco.mj_getState(flying.model, flying.data, batch.state[k], _WHOLE)
        ids, done = np.arange(count), 0
        while ids.size and done < steps:
            length = min(max(ROUND // ids.size, 1), LONGEST, steps - done)
            # each flight from where the round began, so that the state before a step is always there
            path = np.empty((ids.size, length + 1, _WIDTH))
            path[:, 0] = batch.state[ids, :_WIDTH]
            path[:, 1:] = advance(flying, batch, ids, length)
            done += length
            first = np.empty(ids.size, dtype=np.int64)
            _first_below(path, first, *flying.centre_of_mass)
            with np.errstate(invalid="ignore"):
                too_fast = np.max(np.sum(path[:, :, 11:14] ** 2, axis=2), axis=1) > (LARGEST_TURN / timestep) ** 2
            flies = ~too_fast & (first > length)
            for place in np.flatnonzero(~too_fast & ((first <= length) | (done == steps))).tolist():
                way, k = path[place], ids[place]
                touched[k] = first[place] <= length and bool(np.isfinite(way[first[place]]).all())
                if touched[k] or first[place] > length:
                    rows[k] = _last_row(last, way[min(first[place], length + 1) - 1], bool(touched[k]))
            flies &= ~batch.warning[ids][:, DIVERGED, 1].any(axis=1)
            ids = ids[flies]
        for each in (flying, last):
            each.lost_air()  # those flights are NaN
    return Ends(centre_state(rows, flying), touched)


def advance(flying: FlyingDisc, batch: Batch, ids: Any, length: int) -> FloatArray:
    """Step some flights ``length`` times and return time, qpos and qvel after each step, (ids, length, WIDTH)."""
    with stepped_by_c() as in_c:
        if in_c:
            return np.asarray(batch.rollout(length, record=(_STATE,), ids=ids)[_STATE])
    path = np.full((ids.size, length, _WIDTH), np.nan)
    for place, k in enumerate(ids.tolist()):
        mujoco.mj_resetData(flying.model, flying.data)  # an error leaves it in the middle of a step
        mujoco.mj_setState(flying.model, flying.data, batch.state[k], _WHOLE)
        # the callback in Python says at once what the one in C writes down
        with suppress(InputError):
            for row in path[place]:
                mujoco.mj_step(flying.model, flying.data)
                mujoco.mj_getState(flying.model, flying.data, row, _STATE)
        mujoco.mj_getState(flying.model, flying.data, batch.state[k], _WHOLE)
    return path


def _last_row(last: FlyingDisc, start: FloatArray, lands: bool) -> FloatArray:
    """Return time, qpos, qvel and qacc at the end of a flight: at ``start`` (14,), or on the ground within a step."""
    if lands:
        touch_down(last, start)
    else:
        mujoco.mj_setState(last.model, last.data, start, _STATE)
    mujoco.mj_forward(last.model, last.data)
    log = Logbook(last.model, last.data, last.centre_of_mass)
    log.note()
    row: FloatArray = log.rows[0]
    return row
