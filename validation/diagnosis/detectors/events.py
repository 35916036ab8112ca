"""Events: steps of momentum or spin at an unknown time, by matched filters over a relaxed fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.events import Impulse, SpinStep
from validation.diagnosis.detectors.local_problem import Asked, Ground, gain_of, peaks
from validation.diagnosis.selection.candidates import Trial, detected
from validation.diagnosis.selection.proposals import Proposal
from validation.diagnosis.settings import DETECTORS
from validation.identification.gauss_newton import Fit, mapped
from validation.identification.linearisation import linearise
from validation.identification.plants.plant import Layout
from validation.identification.propagation import Column
from validation.identification.segments import undone

__all__ = ["events"]

#: what of a state an event makes jump
_MOVES: Mapping[type[Any], Callable[[Layout], slice | int | None]] = {
    Impulse: lambda layout: layout.velocity,
    SpinStep: lambda layout: layout.spin,
}


def _jumps(ground: Ground, directions: Sequence[int]) -> FloatArray:
    """Return what a jump of the state in some directions at each boundary (k - 1,) would gain."""
    d = ground.chain.plant.layout.directions
    k = len(ground.chain.states)
    moves = ground.linear.moves[:, :, :d]
    A = np.hstack([ground.white, ground.left[:, None]])
    # products of the rows after each boundary with the first state's columns
    products = np.zeros((k, d, A.shape[1]))
    for i in range(k):
        rows = A[ground.piece == i]
        products[i] = rows[:, :d].T @ rows
    after = np.cumsum(products[::-1], axis=0)[::-1]
    gain = np.zeros(max(k - 1, 0))
    for j in range(1, k):
        back = undone(moves[j], np.eye(d)[:, list(directions)])
        own = back.T @ after[j][:, :d] @ back
        cross = (back.T @ after[j]).T
        gain[j - 1], _ = ground.explained(own, cross[:-1], cross[-1])
    return gain


def _events_at(ground: Ground, fit: Fit, recording: int, trial: Trial, instants: FloatArray) -> list[Proposal]:
    """Return an event at each of some instants as a proposal, by its true columns."""
    columns = [Column(c.group, c.name, c.step, (("t_s", float(t)),)) for t in instants for c in trial.columns]
    values = fit.values(recording)
    linear = linearise(ground.chain, values, columns, ground.chain.plant.sizes.continuous.allowed)
    white = ground.whiten(linear.shared)
    width = len(trial.columns)
    found = []
    for n, t in enumerate(instants):
        part = slice(n * width, (n + 1) * width)
        gain, value = ground.ask(white[:, part])
        shaped = replace(trial, columns=tuple(columns[part]), recordings=frozenset([recording]))
        start = {((c.group, c.name), shaped.recordings): float(v) for c, v in zip(shaped.columns, value, strict=True)}
        start[(trial.id, "t_s"), shaped.recordings] = float(t)
        found.append(Proposal(shaped, gain, start))
    return found


def events(asked: Asked, least: float = DETECTORS.least) -> list[Proposal]:
    """Return events, at most one of each kind per recording, that would gain more than ``least``, best first.

    A jump of velocity or spin is asked for at every boundary of finely cut motion, which costs no simulation; the
    instant is then read off the event's true signature, in which a pulse of 10 ms is a needle.
    """
    recordings = [chain.recording for chain in asked.fit.chains]
    layout, times = asked.fit.plant.layout, asked.fit.plant.durations
    kinds: list[tuple[str, Sequence[int], tuple[str, ...]]] = [
        (row.id, layout.directions_of(places), tuple(name for name in row.parameters if name != "t_s"))
        for row in detected(recordings, "events")
        if (places := _MOVES[row.type](layout)) is not None
    ]

    def scanned(task: tuple[int, tuple[str, Sequence[int], tuple[str, ...]]]) -> FloatArray:
        i, (id, directions, _) = task
        return np.zeros(0) if asked.has(id, i) else _jumps(asked.grounds[i], directions)

    def one(task: tuple[int, tuple[str, Sequence[int], tuple[str, ...]]], gain: FloatArray) -> Proposal | None:
        i, (id, _, names) = task
        ground = asked.grounds[i]
        trial = Trial(id, tuple(Column(id, name, 0.02) for name in names))
        inner, end = ground.chain.edges[1:-1], float(ground.chain.edges[-1])
        near = np.concatenate([inner[j] + times.event_near * np.linspace(-1.0, 1.0, 13) for j in peaks(gain, 2)])
        near = np.unique(near.round(4))
        near = near[(near > max(0.01, times.event_from)) & (near < end)]
        if near.size == 0:
            return None
        best = max(_events_at(ground, asked.fit, i, trial, near), key=gain_of)
        about = best.trial.shapes["t_s"] + np.linspace(-0.012, 0.012, 7)
        best = max(
            [best, *_events_at(ground, asked.fit, i, trial, about[(about > times.event_from) & (about < end)])],
            key=gain_of,
        )
        return best if best.gain > least else None

    tasks = [(i, kind) for i in asked.grounds for kind in kinds]
    gains = mapped(scanned, tasks)
    promising = [(t, g) for t, g in zip(tasks, gains, strict=True) if g.size and g.max() >= least - 10.0]
    promising = sorted(promising, key=lambda item: -float(item[1].max()))[: DETECTORS.followed]
    found = mapped(one, [t for t, _ in promising], [g for _, g in promising])
    return sorted((p for p in found if p is not None), key=gain_of, reverse=True)
