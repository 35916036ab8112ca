"""Recordings whose relaxed fit went astray, far from their data, and other starts that may bring it there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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

__all__ = ["astray", "from_nearer_motion", "from_other_flights", "from_other_initial_states"]

#: steps of a fit from another start: of segments, and of whole flights, which come from farther
_STEPS, _OF_FLIGHTS = 6, 40
#: standard deviations by which chi2 is above what noise leaves where another flight is tried, and by how much less one
#: must leave in chi2: noise does that once in 700 times, and a gain of 12 once in 2000
_BY_CHANCE, _BETTER = 3.0, 12.0


def astray(fit: Fit) -> list[int]:
    """Return the places of recordings whose fit is far from their data, worst first.

    A reading counts for no more than 100 standard deviations, so that a few outliers make no fit astray.
    """
    chi2 = _chi2(fit)
    return [i for i in np.argsort(chi2)[::-1].tolist() if chi2[i] > RELAXED_FIT.astray]


def _chi2(fit: Fit) -> list[float]:
    """Return chi2 per reading of each recording."""
    return [
        float(np.sum(np.minimum(whitened(linear, fit.noise, linear.residual[:, None])[:, 0] ** 2, 1e4)))
        / max(linear.raw.size, 1)
        for linear in fit.linears
    ]


def _more_than_noise(fit: Fit) -> list[int]:
    """Return the places of recordings of which a fit leaves more than noise by `_BY_CHANCE` standard deviations."""
    sizes = [max(linear.raw.size, 1) for linear in fit.linears]
    return [i for i, one in enumerate(_chi2(fit)) if one > 1.0 + _BY_CHANCE * np.sqrt(2.0 / sizes[i])]


def from_other_initial_states(fit: Fit) -> Fit:
    """Return a fit that tried other attitudes at release, or other states, for recordings that went astray.

    Each is tried by itself; the fit is returned as it is where none serves.
    """
    return (
        fit
        if fit.plant.layout.attitude is None
        else _from_others(
            fit, _other_states, astray(fit)[: CONSISTENCY.few], _STEPS, lambda merit: RELAXED_FIT.rescued * merit
        )
    )


def from_other_flights(fit: Fit) -> Fit:
    """Return a continuous fit that tried other flights of recordings that went astray; as it is where none serves.

    Where neither a path nor a force tells how fast a disc flew, segments follow the data beside many flights, and whole
    flights beside few of them.
    """

    def others(trajectory: Trajectory, ratio: float) -> list[FloatArray]:
        found = _other_flights(trajectory, ratio)
        return [trajectory.states, *found] if found else []

    return _from_others(fit, others, _more_than_noise(fit), _OF_FLIGHTS, lambda merit: merit - _BETTER)


def _from_others(
    fit: Fit,
    others: Callable[[Trajectory, float], list[FloatArray]],
    places: Sequence[int],
    steps: int,
    bar: Callable[[float], float],
) -> Fit:
    """Return a fit of which recordings begin from others where these come below a bar of their merit."""
    better = dict[int, Trajectory]()
    for i in places:
        ratio = fit.values(i).get(CLOCK, 1.0)
        alone = fit.part([i])
        alone = replace(alone, merit=merit_of(alone, alone.linears))
        for states in others(fit.trajectories[i], ratio):
            candidate = replace(alone, trajectories=(replace(fit.trajectories[i], states=states),))
            candidate = refit(candidate, iterations=steps, tolerance=1e-3 * fit.count if steps == _STEPS else 0.1)
            if candidate.merit < bar(alone.merit):
                alone, better[i] = candidate, candidate.trajectories[0]
    if not better:
        return fit
    together = replace(fit, trajectories=tuple(better.get(i, one) for i, one in enumerate(fit.trajectories)))
    together = refit(together, iterations=steps, tolerance=1e-3 * fit.count if steps == _STEPS else 0.1)
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
    found = _other_flights(trajectory, ratio)
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


def _other_flights(trajectory: Trajectory, ratio: float) -> list[FloatArray]:
    """Return other states (k, s) at a trajectory's nodes that a path or forces leave open."""
    plant = trajectory.plant
    found = list(plant.initial.other_states(trajectory.recording, ratio * trajectory.nodes[:-1], 1.0))
    for states in found:
        states[:, list(plant.layout.per_time)] *= ratio
    return found
