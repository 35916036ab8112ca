"""Motions that a fit left beside their optimum, begun anew by themselves.

Takes a fit and the trajectories that it began with; gives it with the motion of each recording that stands out begun
from several starts, where one ends lower. Readings say little of how the wobble of a free spin dies and turns. In a fit
of all recordings one may turn by tens of rad/s too fast at first and too slowly later, and what that leaves looks like
physics. So does a flight that was begun in the time of a clock that is wrong by percents. One recording alone takes a
second.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.diagnosis.candidates.evidence import BOUNDS
from discsim.validation.diagnosis.first_trajectory import begun_again_in_true_time, first_trajectory, time_ratio
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.gauss_newton import Fit, discontinuous, merit_of, refit
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.noise import chi_squared
from discsim.validation.identification.segments import Trajectory

__all__ = ["begun_anew"]

#: chi-squared per reading beyond which a recording stands out, as a multiple of the others' median; where the same
#: noise is in all it scatters by the root of 2/n, a thirtieth for a throw. Time alone: what ends no lower is forgotten
_STANDS_OUT = 1.15
#: what an end must be lower by: so many numbers has a wobble, and each takes one of noise alone
_LOWER = 10.0
#: steps of a recording alone, and of all with it
_STEPS, _STEPS_OF_ALL = 16, 8


# far from the data a motion may run beyond all numbers: such a step is not finite, and is not taken
@np.errstate(over="ignore", invalid="ignore")
def begun_anew(fit: Fit, first: Sequence[Trajectory], given: Sequence[Linear] = ()) -> Fit:
    """Return a fit whose recordings that stand out were begun anew, where that ends lower.

    ``first`` are the trajectories that the fit began with. Where the others are far from their data, too, something
    else is missing, and the fit is returned as it is. So is a recording of which another fit, whose linearisations are
    ``given``, leaves as much: it is noisier than the others, or lacks physics that both lack.
    """
    other_time = fit.plant.airborne and any(time_ratio(fit.values(i)) != 1.0 for i in range(len(fit.trajectories)))
    in_doubt = fit.plant.weakly_identified or (other_time and not fit.path_alone)
    if not in_doubt or len(fit.trajectories) < 2 or not np.isfinite(fit.merit):
        return fit
    left = _left(fit, fit.linears)
    known = _left(fit, given) if len(given) == len(left) else np.full(len(left), np.inf)
    better = dict[int, Fit]()
    for i in np.argsort(left)[::-1].tolist():
        others = float(np.median(np.delete(left, i)))
        level = _STANDS_OUT * others
        as_known = known[i] < _STANDS_OUT * left[i] and left[i] < _STANDS_OUT * known[i]
        if others >= SELECTION.far or left[i] <= level or as_known:
            continue
        if (lower := _lower(fit, i, first[i], level)) is not None:
            better[i] = lower
    if not better:
        return fit
    trajectories = [better[i].trajectories[0] if i in better else one for i, one in enumerate(fit.trajectories)]
    own = dict[tuple[tuple[str, str], frozenset[int] | None], float]()
    for i, alone in better.items():
        own |= {(q.key, frozenset([i])): float(v) for q, v in zip(alone.parameters, alone.at, strict=True)}
    at = [own.get((q.key, q.recordings), v) for q, v in zip(fit.parameters, fit.at, strict=True)]
    again = refit(
        replace(fit, trajectories=tuple(trajectories), at=np.array(at)), iterations=_STEPS_OF_ALL, bounds=BOUNDS
    )
    return again if again.merit < fit.merit else fit


def _left(fit: Fit, linears: Sequence[Linear]) -> FloatArray:
    """Return chi-squared per reading (c,) of linearisations of the recordings, in the noise of a fit."""
    return np.array([chi_squared(one, fit.noise, one.residual) / max(one.residual.size, 1) for one in linears])


def _lower(fit: Fit, i: int, first: Trajectory, level: float) -> Fit | None:
    """Return the fit of one recording, shared parameters held, from the first start that ends below a ``level``.

    The level is in chi-squared per reading. Where no start ends below it the lowest end counts; None where none is
    lower than where the recording stands.
    """
    stands = _alone(fit, i)
    bar = merit_of(stands, (fit.linears[i],)) - _LOWER
    best: Fit | None = None
    for start in _starts(fit, i, stands, first):
        found = refit(start, iterations=_STEPS, bounds=BOUNDS)
        if found.merit < bar and not discontinuous(found):
            best, bar = found, found.merit
            if found.merit < level * found.count:
                break
    return best


def _alone(fit: Fit, i: int) -> Fit:
    """Return the fit of one recording where it stands: what is shared is held."""
    keys = fit.plant.own_keys
    own = [(q, v) for q, v in zip(fit.parameters, fit.at, strict=True) if q.key in keys and q.acts_in(i)]
    return Fit(
        (fit.trajectories[i],),
        tuple(replace(q, recordings=frozenset([0])) for q, _ in own),
        np.array([v for _, v in own]),
        fit.defects,
        fit.noise,
        {key: value for key, value in fit.values(i).items() if key not in keys},
    )


def _starts(fit: Fit, i: int, stands: Fit, first: Trajectory) -> Iterator[Fit]:
    """Yield starts of one recording, each with the wobble that the others have or with none.

    They are its first trajectory, and one from the data alone, in true time by the clock that the fit has found.
    """
    none = dict.fromkeys(fit.plant.motion_keys, 0.0)
    known = {
        key: [v for q, v in zip(fit.parameters, fit.at, strict=True) if q.key == key and not q.acts_in(i)]
        for key in none
    }
    others = {key: float(np.median(values)) for key, values in known.items() if values}

    def begun(trajectory: Trajectory, wobble: Mapping[tuple[str, str], float]) -> Fit:
        at = [wobble.get(q.key, v) for q, v in zip(stands.parameters, stands.at.tolist(), strict=True)]
        return replace(stands, trajectories=(trajectory,), at=np.array(at))

    yield begun(first, others)
    ratio = time_ratio(fit.values(i))
    if ratio != 1.0:
        yield begun(begun_again_in_true_time(first, ratio), others)
    else:
        yield begun(replace(first, states=first_trajectory(first.recording, nodes=first.nodes).states), none)
    if none:
        yield begun(first, none)
