"""Events: steps of momentum or spin at an unknown time.

Takes the local linear problem of a fit; gives candidates with instant and size. Every instant is tried by a matched
filter, the other unknowns projected out (generalised likelihood ratio: Willsky and Jones, 1976).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.events import EVENT_WIDTH_S, Impulse, SpinStep
from discsim.validation.diagnosis.detectors.local_problem import LocalProblem, LocalProblems, gain_of, peaks
from discsim.validation.diagnosis.selection.candidates import CandidateEffect, detected
from discsim.validation.diagnosis.selection.score_tests import ScreenedCandidate
from discsim.validation.diagnosis.settings import DETECTORS
from discsim.validation.identification.gauss_newton import Fit, mapped
from discsim.validation.identification.linearisation import linearise
from discsim.validation.identification.plants.plant import Layout
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.segments import undone

__all__ = ["events"]

#: what pushes a disc, and by how much less than an event's gain a first look at it may promise
_PUSH, _SHORT_OF = catalogued(Impulse).id, 10.0
#: what of a state an event makes jump
_MOVES: Mapping[type[Any], Callable[[Layout], slice | int | None]] = {
    Impulse: lambda layout: layout.velocity,
    SpinStep: lambda layout: layout.spin,
}


def _jumps(problem: LocalProblem, directions: Sequence[int]) -> FloatArray:
    """Return what a jump of the state in some directions at each boundary (k - 1,) would gain."""
    d = problem.trajectory.plant.layout.directions
    k = len(problem.trajectory.states)
    moves = problem.linear.sensitivities[:, :, :d]
    A = np.hstack([problem.white, problem.left[:, None]])
    # products of the rows after each boundary with the first state's columns
    products = np.zeros((k, d, A.shape[1]))
    for i in range(k):
        rows = A[problem.segment == i]
        products[i] = rows[:, :d].T @ rows
    after = np.cumsum(products[::-1], axis=0)[::-1]
    gain = np.zeros(max(k - 1, 0))
    for j in range(1, k):
        back = undone(moves[j], np.eye(d)[:, list(directions)])
        own = back.T @ after[j][:, :d] @ back
        cross = (back.T @ after[j]).T
        gain[j - 1], _ = problem.explained(own, cross[:-1], cross[-1])
    return gain


def _needles(problem: LocalProblem) -> tuple[FloatArray, FloatArray]:
    """Return instants (m,) s, and by how much chi-squared of two widths of a pulse about each exceeds chance.

    What pushes a disc for some milliseconds an accelerometer feels in two or three readings, many times its noise, long
    before the velocity that it leaves shows in anything else.
    """
    known = np.zeros(problem.left.size, dtype=np.bool_)
    for channel in problem.linear.channels:
        known[channel.rows] = True
    step = EVENT_WIDTH_S
    slot = np.floor(problem.linear.t[known] / step).astype(int)
    beyond = np.bincount(np.maximum(slot, 0), problem.left[known] ** 2 - 1.0)
    return step * np.arange(1.0, beyond.size), np.asarray(beyond[:-1] + beyond[1:], dtype=np.float64)


def _events_at(
    problem: LocalProblem, fit: Fit, recording: int, candidate: CandidateEffect, instants: FloatArray
) -> list[ScreenedCandidate]:
    """Return an event at each of some instants as a screened candidate, by its true columns."""
    columns = [Column(c.group, c.name, c.step, (("t_s", float(t)),)) for t in instants for c in candidate.columns]
    values = fit.values(recording)
    linear = linearise(problem.trajectory, values, columns, problem.trajectory.plant.sizes.continuous.allowed)
    white = problem.whiten(linear.common)
    width = len(candidate.columns)
    found = []
    for n, t in enumerate(instants):
        part = slice(n * width, (n + 1) * width)
        gain, value = problem.solve(white[:, part])
        shaped = replace(candidate, columns=tuple(columns[part]), recordings=frozenset([recording]))
        start = {((c.group, c.name), shaped.recordings): float(v) for c, v in zip(shaped.columns, value, strict=True)}
        start[(candidate.id, "t_s"), shaped.recordings] = float(t)
        found.append(ScreenedCandidate(shaped, gain, start))
    return found


def events(problems: LocalProblems, least: float = DETECTORS.least) -> list[ScreenedCandidate]:
    """Return events, at most one of each kind per recording, that would gain more than ``least``, best first.

    A jump of velocity or spin is asked for at every boundary of finely cut motion, which costs no simulation; the
    instant is then read off the event's true signature, in which a pulse of 10 ms is a needle.
    """
    recordings = [trajectory.recording for trajectory in problems.fit.trajectories]
    layout, times = problems.fit.plant.layout, problems.fit.plant.durations
    kinds: list[tuple[str, Sequence[int], tuple[str, ...]]] = [
        (row.id, layout.directions_of(places), tuple(name for name in row.parameters if name != "t_s"))
        for row in detected(recordings, "events")
        if (places := _MOVES[row.type](layout)) is not None
    ]

    def scanned(task: tuple[int, tuple[str, Sequence[int], tuple[str, ...]]]) -> FloatArray:
        i, (id, directions, _) = task
        return np.zeros(0) if problems.has(id, i) else _jumps(problems.by_recording[i], directions)

    def one(
        task: tuple[int, tuple[str, Sequence[int], tuple[str, ...]]], instants: FloatArray
    ) -> ScreenedCandidate | None:
        i, (id, _, names) = task
        problem = problems.by_recording[i]
        candidate = CandidateEffect(id, tuple(Column(id, name, 0.02) for name in names))
        end = float(problem.trajectory.nodes[-1])
        near = np.unique(instants.round(4))
        near = near[(near > max(0.01, times.event_from)) & (near < end)]
        if near.size == 0:
            return None
        best = max(_events_at(problem, problems.fit, i, candidate, near), key=gain_of)
        about = best.candidate.shape_grid["t_s"] + np.linspace(-0.012, 0.012, 7)
        best = max(
            [best, *_events_at(problem, problems.fit, i, candidate, about[(about > times.event_from) & (about < end)])],
            key=gain_of,
        )
        return best if best.gain > least else None

    def about_boundaries(task: tuple[int, tuple[str, Sequence[int], tuple[str, ...]]], gain: FloatArray) -> FloatArray:
        inner = problems.by_recording[task[0]].trajectory.nodes[1:-1]
        return np.concatenate([inner[j] + times.event_near * np.linspace(-1.0, 1.0, 13) for j in peaks(gain, 2)])

    tasks = [(i, kind) for i in problems.by_recording for kind in kinds]
    gains = mapped(scanned, tasks)
    promising = [(t, g) for t, g in zip(tasks, gains, strict=True) if g.size and g.max() >= least - _SHORT_OF]
    promising = sorted(promising, key=lambda item: -float(item[1].max()))[: DETECTORS.followed]
    asked = [(task, about_boundaries(task, gain)) for task, gain in promising]
    pushed = [task for task in tasks if task[1][0] == _PUSH and not problems.has(_PUSH, task[0])]
    needles = [(task, *_needles(problems.by_recording[task[0]])) for task in pushed]
    felt = [(task, at, beyond) for task, at, beyond in needles if beyond.size and beyond.max() >= least - _SHORT_OF]
    for task, at, beyond in sorted(felt, key=lambda item: -float(item[2].max()))[: DETECTORS.followed]:
        sharp = at[peaks(beyond, 2)][:, None] + EVENT_WIDTH_S * np.linspace(-1.0, 1.0, 9)
        asked.append((task, sharp.ravel()))
    found: dict[tuple[str, int], ScreenedCandidate] = {}
    for (task, _), event in zip(asked, mapped(one, *zip(*asked, strict=True)) if asked else [], strict=True):
        place = task[1][0], task[0]
        if event is not None and (place not in found or event.gain > found[place].gain):
            found[place] = event
    return sorted(found.values(), key=gain_of, reverse=True)
