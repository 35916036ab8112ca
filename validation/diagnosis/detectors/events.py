"""Events: steps of momentum or spin at an unknown time.

Takes the local linear problem of a fit; gives candidates with instant and size. Every instant is tried by a matched
filter, the other unknowns projected out (generalised likelihood ratio: Willsky and Jones, 1976).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Row, catalogued
from discsim.effects.events import EVENT_WIDTH_S, Impulse, SpinStep
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, detected
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.diagnosis.detectors.local_problem import LocalProblem, LocalProblems, gain_of, peaks
from discsim.validation.diagnosis.settings import DETECTORS
from discsim.validation.identification.gauss_newton import Fit, mapped
from discsim.validation.identification.linearisation import linearise
from discsim.validation.identification.plants.plant import Layout
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.segments import undone

__all__ = ["events"]

#: what pushes a disc, and by how much less than an event's gain a first look at it may promise
_PUSH, _SHORT_OF = catalogued(Impulse).id, 10.0
#: instants in a segment of a motion that may wander: of 0.2 s, as fine as others are cut
_PARTS = 4
#: what of a state an event makes jump
_MOVES: Mapping[type[Any], Callable[[Layout], slice | int | None]] = {
    Impulse: lambda layout: layout.velocity,
    SpinStep: lambda layout: layout.spin,
}
#: and what of it that leads on, in time; a spin turns a body about its last axis
_LEADS: Mapping[type[Any], Callable[[Layout], slice | int | None]] = {
    Impulse: lambda layout: layout.position,
    SpinStep: lambda layout: layout.attitude if layout.yaw is None else layout.yaw,
}
#: a recording, and what event is asked for in it
_Task: TypeAlias = tuple[int, Row]


def _jumps(problem: LocalProblem, kind: type[Any], parts: int) -> tuple[FloatArray, FloatArray]:
    """Return instants (m,) s, and what a jump of what a kind of event moves would gain at each of them.

    The instants part each segment in ``parts``; the first is no instant.
    """
    layout, nodes = problem.trajectory.plant.layout, problem.trajectory.nodes
    d, k = layout.directions, len(problem.trajectory.states)
    moves = problem.linear.sensitivities[:, :, :d]
    A = np.hstack([problem.white, problem.left[:, None]])
    length = np.diff(nodes)
    part = np.floor(parts * (problem.linear.t - nodes[problem.segment]) / length[problem.segment])
    cell = parts * problem.segment + np.clip(part, 0, parts - 1).astype(int)
    # products of the rows after each instant with the first state's columns
    products = np.zeros((k * parts, d, A.shape[1]))
    order = np.argsort(cell, kind="stable")
    bounds = np.searchsorted(cell[order], np.arange(k * parts + 1))
    for i in range(k * parts):
        rows = A[order[bounds[i] : bounds[i + 1]]]
        products[i] = rows[:, :d].T @ rows
    after = np.cumsum(products[::-1], axis=0)[::-1]
    instants, gain = np.zeros(k * parts), np.zeros(k * parts)
    for i in range(1, k * parts):
        j, since = i // parts, length[i // parts] * (i % parts) / parts
        back = undone(moves[j], _jump(layout, kind, since))
        own = back.T @ after[i][:, :d] @ back
        cross = (back.T @ after[i]).T
        instants[i] = nodes[j] + since
        gain[i], _ = problem.explained(own, cross[:-1], cross[-1])
    return instants[1:], gain[1:]


def _jump(layout: Layout, kind: type[Any], since: float) -> FloatArray:
    """Return the change of a state (d, c) that some time later, s, has become a jump of what an event moves alone.

    What a jump of a rate or a velocity has turned or moved until then is taken back.
    """
    places = _MOVES[kind](layout)
    assert places is not None
    directions = layout.directions_of(places)
    change = np.eye(layout.directions)[:, list(directions)]
    leads = _LEADS[kind](layout)
    if leads is not None:
        led = layout.directions_of(leads)[-len(directions) :]
        change[list(led), range(len(directions))] -= since
    return change


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

    A jump of velocity or spin is asked for at every boundary of finely cut motion, and within segments where motion may
    wander between them, which costs no simulation; the instant is then read off the event's true signature, in which a
    pulse of 10 ms is a needle.
    """
    recordings = [trajectory.recording for trajectory in problems.fit.trajectories]
    layout, times = problems.fit.plant.layout, problems.fit.plant.durations
    kinds = [row for row in detected(recordings, "events") if _MOVES[row.type](layout) is not None]
    # where motion may wander from segment to segment, a jump between two of them is nothing new
    parts = _PARTS if np.any(problems.fit.defects.allowed) else 1

    def scanned(task: _Task) -> tuple[FloatArray, FloatArray]:
        i, row = task
        if problems.has(row.id, i):
            return np.zeros(0), np.zeros(0)
        return _jumps(problems.by_recording[i], row.type, parts)

    def one(task: _Task, instants: FloatArray) -> ScreenedCandidate | None:
        i, row = task
        problem = problems.by_recording[i]
        candidate = CandidateEffect(row.id, tuple(Column(row.id, n, 0.02) for n in row.parameters if n != "t_s"))
        end = float(problem.trajectory.nodes[-1])
        near = np.unique(instants.round(4))
        near = near[(near > max(0.01, times.event_from)) & (near < end)]
        if near.size == 0:
            return None
        best = max(_events_at(problem, problems.fit, i, candidate, near), key=gain_of)
        fine = best.candidate.shape_grid["t_s"] + np.linspace(-0.012, 0.012, 7)
        best = max(
            [best, *_events_at(problem, problems.fit, i, candidate, fine[(fine > times.event_from) & (fine < end)])],
            key=gain_of,
        )
        return best if best.gain > least else None

    def about(instants: FloatArray, gain: FloatArray) -> FloatArray:
        return np.concatenate([instants[j] + times.event_near * np.linspace(-1.0, 1.0, 13) for j in peaks(gain, 2)])

    tasks = [(i, row) for i in problems.by_recording for row in kinds]
    gains = mapped(scanned, tasks)
    promising = [(t, *g) for t, g in zip(tasks, gains, strict=True) if g[1].size and g[1].max() >= least - _SHORT_OF]
    promising = sorted(promising, key=lambda item: -float(item[2].max()))[: DETECTORS.followed]
    asked = [(task, about(instants, gain)) for task, instants, gain in promising]
    pushed = [task for task in tasks if task[1].id == _PUSH and not problems.has(_PUSH, task[0])]
    needles = [(task, *_needles(problems.by_recording[task[0]])) for task in pushed]
    felt = [(task, at, beyond) for task, at, beyond in needles if beyond.size and beyond.max() >= least - _SHORT_OF]
    for task, at, beyond in sorted(felt, key=lambda item: -float(item[2].max()))[: DETECTORS.followed]:
        sharp = at[peaks(beyond, 2)][:, None] + EVENT_WIDTH_S * np.linspace(-1.0, 1.0, 9)
        asked.append((task, sharp.ravel()))
    found: dict[tuple[str, int], ScreenedCandidate] = {}
    for (task, _), event in zip(asked, mapped(one, *zip(*asked, strict=True)) if asked else [], strict=True):
        place = task[1].id, task[0]
        if event is not None and (place not in found or event.gain > found[place].gain):
            found[place] = event
    return sorted(found.values(), key=gain_of, reverse=True)
