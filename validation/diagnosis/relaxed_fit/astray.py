"""Recordings whose relaxed fit went astray, far from their data, and other starts that may bring it there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.frames import conjugate, multiply
from discsim.validation.diagnosis.first_trajectory import CLOCK, first_trajectory, trajectory_in_true_time
from discsim.validation.diagnosis.relaxed_fit.further_steps import fitted_further
from discsim.validation.diagnosis.settings import CONSISTENCY, RELAXED_FIT
from discsim.validation.identification.gauss_newton import Fit, merit_of, refit
from discsim.validation.identification.noise import whitened
from discsim.validation.identification.segments import Trajectory

__all__ = ["astray", "from_nearer_motion", "from_other_initial_states"]


def astray(fit: Fit) -> list[int]:
    """Return the places of recordings whose fit is far from their data, worst first.

    A reading counts for no more than 100 standard deviations, so that a few outliers make no fit astray.
    """
    chi2 = [
        float(np.sum(np.minimum(whitened(linear, fit.noise, linear.residual[:, None])[:, 0] ** 2, 1e4)))
        / max(linear.raw.size, 1)
        for linear in fit.linears
    ]
    return [i for i in np.argsort(chi2)[::-1].tolist() if chi2[i] > RELAXED_FIT.astray]


def from_other_initial_states(fit: Fit) -> Fit:
    """Return a fit that tried other attitudes at release, or other states, for recordings that went astray.

    Each is tried by itself; the fit is returned as it is where none serves.
    """
    if fit.plant.layout.attitude is None:
        return fit
    better = dict[int, Trajectory]()
    for i in astray(fit)[: CONSISTENCY.few]:
        ratio = fit.values(i).get(CLOCK, 1.0)
        alone = fit.part([i])
        alone = replace(alone, merit=merit_of(alone, alone.linears))
        for states in _other_states(fit.trajectories[i], ratio):
            candidate = replace(alone, trajectories=(replace(fit.trajectories[i], states=states),))
            candidate = refit(candidate, iterations=6, tolerance=1e-3 * fit.count)
            if candidate.merit < RELAXED_FIT.rescued * alone.merit:
                alone, better[i] = candidate, candidate.trajectories[0]
    if not better:
        return fit
    together = replace(fit, trajectories=tuple(better.get(i, one) for i, one in enumerate(fit.trajectories)))
    together = refit(together, iterations=6, tolerance=1e-3 * fit.count)
    return together if together.merit < fit.merit else fit


def from_nearer_motion(fit: Fit, other: Fit) -> Fit | None:
    """Return a relaxed fit from the motion of another fit; None where that is no nearer to the data.

    The relaxed fit leaves less than any other at its best. Where it leaves more it stands at another minimum, as where
    a field that turns beside the spin leads each segment astray by itself.
    """
    bar = RELAXED_FIT.rescued * fit.merit
    if merit_of(fit, other.linears) > bar:
        return None
    nearer = fitted_further(replace(fit, trajectories=other.trajectories, linears=()), fit.count)
    return nearer if nearer.merit < bar else None


def _other_states(trajectory: Trajectory, ratio: float) -> list[FloatArray]:
    """Return other states (k, s) at a trajectory's nodes that are worth trying.

    ``ratio`` is that of written to true time.
    """
    recording, plant, count = trajectory.recording, trajectory.plant, len(trajectory.states)
    found = list(plant.initial.other_states(recording, ratio * trajectory.nodes[:-1], 1.0))
    for states in found:
        states[:, list(plant.layout.per_time)] *= ratio
    others = plant.initial.other_attitudes(recording)[:3]
    if not others:
        return found
    attitude = plant.layout.attitude
    first = (
        first_trajectory(recording, nodes=trajectory.nodes)
        if ratio == 1.0
        else trajectory_in_true_time(recording, ratio)
    )
    for other in others:
        turned = multiply(other, conjugate(first.states[0, attitude]))
        states = first.states[:count].copy()
        states[:, attitude] = multiply(np.broadcast_to(turned, (count, 4)), states[:, attitude])
        found.append(states)
    return found
