"""Gauss-Newton iteration over all recordings: nuisance unknowns of each, and common parameters.

Takes a `Fit` where it stands; gives it where chi-squared with priors is least, with the covariance of the common
parameters. Nuisance unknowns are eliminated recording by recording (Schur complement), so cost grows linearly with
their number. Steps are shortened where they do not improve, and damped where the readings say little (Levenberg,
"A method for the solution of certain non-linear problems in least squares", 1944).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.validation.identification.competing_effects import Competing
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.linearisation import linearise, moved, reread
from discsim.validation.identification.noise import NoiseModel, chi_squared
from discsim.validation.identification.normal_equations import (
    OWN_TRUST_RADIUS,
    Reduced,
    common_step,
    nuisance_step,
    reduce,
)
from discsim.validation.identification.parameters import AllowedDefects, Parameter, Values, values_of
from discsim.validation.identification.plants import Plant
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.release_prior import release_rows
from discsim.validation.identification.segments import Trajectory, resegmented, stepped

__all__ = ["NO_BARS", "Bars", "Fit", "linearised_columns", "linearised_in", "refit"]

#: recordings that are worked on at once, on as many threads as there are cores
THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Bars(NamedTuple):
    """Chi-squared above which a fit is of no use to its caller, as it is expected after the first steps.

    ``held`` is asked of held steps alone: they move little, and what they expect of the end is within a tenth of it.
    """

    free: float = np.inf
    held: float = np.inf


NO_BARS = Bars()


class Beside(Protocol):
    """The last ``count`` parameters of a fit, which stand in readings alone."""

    @property
    def count(self) -> int:
        """Number of parameters."""

    def __call__(self, fit: Fit, recording: int, linear: Linear) -> Linear:
        """Return a linearisation less what they do, with columns for them."""


@dataclass(frozen=True)
class Fit:
    """Where a fit stands: the trajectories, the shared parameters and their values (p,), the last linearisations.

    ``fixed`` are values that take part without being fitted. ``beside`` widens a linearisation of a recording (the
    second argument, its place) by the last parameters, which stand in its readings and in no motion; its first are
    linearised as ever.
    """

    trajectories: tuple[Trajectory, ...]
    parameters: tuple[Parameter, ...]
    at: FloatArray
    defects: AllowedDefects
    noise: NoiseModel
    fixed: Values = field(default_factory=dict)
    beside: Beside | None = None
    linears: tuple[Linear, ...] = ()
    merit: float = np.inf
    covariance: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    iterations: int = 0

    def values(self, recording: int) -> dict[tuple[str, str], float]:
        """Return the values that hold in a recording."""
        return values_of(self.parameters, self.at, recording, self.fixed)

    def cut_at(self, nodes: Sequence[FloatArray]) -> Fit:
        """Return the fit with each trajectory cut at other edges (k + 1,), where its motion was."""
        pairs = enumerate(zip(self.trajectories, nodes, strict=True))
        return replace(self, trajectories=tuple(resegmented(one, self.values(i), edges) for i, (one, edges) in pairs))

    def part(self, chosen: Sequence[int]) -> Fit:
        """Return the fit of the ``chosen`` recordings alone, with the parameters that act in them where they stand.

        Its merit and covariance are not known before it is fitted.
        """
        place = {i: k for k, i in enumerate(chosen)}

        def there(q: Parameter) -> Parameter:
            own = q.recordings
            return q if own is None else replace(q, recordings=frozenset(place[i] for i in own if i in place))

        acting = [j for j, q in enumerate(self.parameters) if any(q.acts_in(i) for i in chosen)]
        return replace(
            self,
            trajectories=tuple(self.trajectories[i] for i in chosen),
            parameters=tuple(there(self.parameters[j]) for j in acting),
            at=self.at[acting],
            linears=tuple(self.linears[i] for i in chosen) if self.linears else (),
            merit=np.inf,
            covariance=np.empty((0, 0)),
        )

    @property
    def plant(self) -> Plant:
        """The plant of its recordings, which is one for all."""
        return self.trajectories[0].plant

    @property
    def effects(self) -> Competing:
        """The effects that may act on its recordings."""
        return self.trajectories[0].effects

    @property
    def continuous_defects(self) -> AllowedDefects:
        """The defects of continuity that its recordings allow where segments are continuous."""
        return self.plant.continuous_defects([one.recording for one in self.trajectories])

    @property
    def path_alone(self) -> bool:
        """Whether paths, and what is stated of a release, are all that tells of its motions: no sensor flew along."""
        return all(self.plant.path_alone(trajectory.recording) for trajectory in self.trajectories)

    @property
    def counted(self) -> bool:
        """Whether rows of its recordings were counted one by one."""
        return any(trajectory.recording.averaged for trajectory in self.trajectories)

    @property
    def count(self) -> int:
        """Number of scalar readings that take part."""
        return sum(linear.residual.size for linear in self.linears)


# ------------------------------------------------------------------------------------------ all recordings


def mapped(function: Callable[..., Any], *arguments: Sequence[Any]) -> list[Any]:
    """Map over recordings, on as many threads as there are cores, each with the call's `numpy.errstate`."""
    asked = list(zip(*arguments, strict=True))
    if len(asked) == 1:  # begun and ended a thousand times a diagnosis, a pool would cost more than it serves
        return [copy_context().run(function, *asked[0])]
    with ThreadPoolExecutor(THREADS) as pool:
        tasks = [pool.submit(copy_context().run, function, *each) for each in asked]
        return [task.result() for task in tasks]


def _spare(recordings: int) -> int:
    """Return the threads that each of so many recordings has to itself."""
    return max(1, THREADS // max(1, recordings))


def linearised(
    fit: Fit,
    parameters: Sequence[Parameter] | None = None,
    only: Sequence[int] | None = None,
    *,
    central: bool = False,
) -> tuple[Linear, ...]:
    """Linearise all trajectories where they stand, or ``only`` some; the shared columns are those of ``parameters``.

    One-sided differences cost half and do for steps; ``central`` ones for what is told of a fit.
    """
    beside = fit.beside if parameters is None else None
    chosen = fit.parameters if parameters is None else parameters
    chosen = chosen if beside is None else chosen[: len(chosen) - beside.count]
    which = range(len(fit.trajectories)) if only is None else only

    def one(index: int) -> Linear:
        columns = [Column(q.group, q.name, q.step if q.acts_in(index) else 0.0) for q in chosen]
        active = [column for column in columns if column.step > 0]
        trajectory, values = fit.trajectories[index], fit.values(index)
        linear = linearise(trajectory, values, active, fit.defects.allowed, central=central, threads=_spare(len(which)))
        if len(active) < len(columns):
            linear = linear.spread([j for j, column in enumerate(columns) if column.step > 0], len(columns))
        return linear if beside is None else beside(fit, index, linear)

    return tuple(mapped(one, which))


def repredicted(fit: Fit) -> tuple[Linear, ...] | None:
    """Return linearisations with residuals where a fit's trajectories stand and slopes as they were, if known."""
    if fit.beside is not None:
        return None  # what stands beside a motion in readings turns with it

    def one(index: int) -> Linear | None:
        return reread(fit.trajectories[index], fit.values(index), fit.linears[index], _spare(len(fit.trajectories)))

    found = mapped(one, range(len(fit.trajectories)))
    return None if any(linear is None for linear in found) else tuple(found)


def linearised_columns(fit: Fit, columns: Sequence[Column]) -> tuple[Linear, ...]:
    """Linearise all trajectories where they stand, with any columns; one that is another recording's own is zero."""
    return tuple(mapped(lambda index: linearised_in(fit, index, columns), range(len(fit.trajectories))))


def linearised_in(fit: Fit, recording: int, columns: Sequence[Column]) -> Linear:
    """Linearise one trajectory where it stands, with any columns; one that is another recording's own is zero."""
    active = [j for j, c in enumerate(columns) if dict(c.given).get("recording", recording) == recording]
    own = [columns[j] for j in active]
    threads = _spare(len(fit.trajectories))
    linear = linearise(fit.trajectories[recording], fit.values(recording), own, fit.defects.allowed, threads=threads)
    return linear.spread(active, len(columns)) if len(active) < len(columns) else linear


def merit_of(fit: Fit, linears: Sequence[Linear]) -> float:
    """Return chi-squared with priors where a fit stands: what defects may not close is charged, too."""
    chi2 = sum(chi_squared(linear, fit.noise, linear.residual) for linear in linears)
    return chi2 + penalty_of(fit, linears)


def penalty_of(fit: Fit, linears: Sequence[Linear]) -> float:
    """Return what a fit is charged beside its readings: its defects, its distance from what is stated."""
    total = 0.0
    for current, linear in zip(fit.trajectories, linears, strict=True):
        some = linear.defect_kind >= 0
        total += float(np.sum((linear.defect[some] / fit.defects.sd[linear.defect_kind[some]]) ** 2))
        stated, _ = release_rows(current)
        total += float(stated @ stated)
    for q, number in zip(fit.parameters, fit.at, strict=True):
        if np.isfinite(q.sigma):
            total += ((number - q.stated) / q.sigma) ** 2
    return total


def refit(
    fit: Fit,
    *,
    iterations: int = 8,
    tolerance: float = 0.05,
    bounds: Mapping[tuple[str, str], tuple[float, float]] | None = None,
    relinearise: bool = True,
    bars: Bars = NO_BARS,
) -> Fit:
    """Go on from where a fit stands by Gauss-Newton steps, halved where they do not improve.

    Stops when the gain, expected or found, is below ``tolerance`` of chi-squared. ``relinearise`` is false where only
    the noise has changed since the last linearisation. A fit that expects to stay above its ``bars`` is left where it
    stands.
    """
    linears = linearised(fit) if relinearise else fit.linears
    fit = replace(fit, linears=linears, merit=merit_of(fit, linears))
    shorter, held = True, iterations if iterations < _LONG else _HELD * iterations
    if iterations >= _LONG or not discontinuous(fit) or not fit.plant.weakly_identified:
        # else these are a few steps more of a fit that held ones have brought where it is
        fit, shorter = _iterated(fit, iterations, tolerance, bounds or {}, _FREE, bars.free)
    if shorter and fit.plant.weakly_identified:
        # free steps hop about where the readings say little: short ones, and what held them back is not known
        fit, _ = _iterated(fit, held, tolerance, bounds or {}, _FIRST_DAMPING, min(bars))
        _, (_, covariance, _) = _solved(fit, np.full(len(fit.trajectories), _FREE))
        fit = replace(fit, covariance=covariance)
    return fit


def polished(fit: Fit) -> tuple[Fit, list[Reduced]]:
    """Return the optimum beside which a fit has ended, with what its last step solved.

    A fit ends a share of a standard deviation beside it, and slopes by differences to one side are slightly wrong: from
    there whole steps with slopes by central differences are taken, as long as none leads away.
    """
    before: tuple[Fit, list[Reduced]] | None = None
    for _ in range(_WHOLE_STEPS):
        linears = linearised(fit, central=True)
        fit = replace(fit, linears=linears, merit=merit_of(fit, linears))
        if before is not None and not fit.merit < before[0].merit + _NOTHING:
            return before
        reduced, (step, covariance, expected) = _solved(fit, np.full(len(fit.trajectories), _FREE))
        before = replace(fit, covariance=covariance), reduced
        fit = whole_step(before[0], reduced, step)
        if fit.merit - expected < _NOTHING:
            break
    return fit, reduced


def whole_step(fit: Fit, reduced: Sequence[Reduced], step: FloatArray) -> Fit:
    """Return a fit after all of a step of its shared parameters (p,), each recording's own following."""
    trajectories = tuple(
        moved(trajectory, linear, nuisance_step(r, step), step)
        for trajectory, linear, r in zip(fit.trajectories, fit.linears, reduced, strict=True)
    )
    return replace(fit, trajectories=trajectories, at=fit.at + step)


#: whole steps from the end of a fit, at most; one that gains less is the last: the next would be below a thousandth of
#: a standard deviation, even where half of the curvature is in the residuals, of which the method knows nothing
_WHOLE_STEPS, _NOTHING = 8, 1e-6


def _solved(fit: Fit, damping: FloatArray) -> tuple[list[Reduced], tuple[FloatArray, FloatArray, float]]:
    """Return what each recording says where a fit stands, and the `common_step` of all, held by ``damping`` (c,)."""
    reduced = mapped(_reduced(fit), fit.linears, fit.trajectories, list(damping))
    gram = np.sum([r.gram for r in reduced], axis=0)
    return reduced, common_step(gram, fit.parameters, fit.at, _trust_radii(fit, damping))


#: steps of a fit that is to end where it is best, not only to follow a change of the noise
_LONG = 5


def _iterated(
    fit: Fit,
    iterations: int,
    tolerance: float,
    bounds: Mapping[tuple[str, str], tuple[float, float]],
    first: float,
    bar: float = np.inf,
) -> tuple[Fit, bool]:
    """Return a fit after up to so many steps, and whether shorter ones are wanted. ``first`` is how hard they are held.

    These are where the last segments still jump that may not, or no share of a step served that promised much. The best
    fit on the way whose segments are continuous counts where the last is none, or worse; short steps go on from there.
    """
    damping = np.full(len(fit.trajectories), first)
    closed: Fit | None = None
    settled, refused, stuck, hops, idle = False, False, 0, 0, 0
    for done in range(iterations):
        reduced, (step, covariance, expected) = _solved(fit, damping)
        fit = replace(fit, covariance=covariance)
        if done >= _LOOKED and expected > bar:
            return fit, False
        least = max(tolerance, 1e-7 * fit.merit)
        known, closed = closed, _better_continuous(closed, fit)
        idle = idle + 1 if known is not None and closed is not None and known.merit - closed.merit < least else 0
        if fit.merit - expected < least and not discontinuous(fit):
            return fit, False
        going = GaussNewtonStep(fit, reduced, step, bounds, expected)
        if first > _FREE:
            better, rose = going.with_own_fractions()
            damping = np.where(rose, np.clip(_TIGHTER * damping, _LEAST_DAMPING, _MOST_DAMPING), _LOOSER * damping)
            stuck = stuck + 1 if better is None else 0
            better = better or _lower(fit, going.with_one_fraction())
            if better is None and stuck < _STUCK and idle < _IDLE:
                continue  # held harder, from where it stands
        else:
            better = going.with_one_fraction()
            hops = hops + 1 if better is not None and _hopped(fit, better) else 0
        refused = better is None and fit.merit - expected > CHORD
        settled = better is None or (not discontinuous(fit) and fit.merit - better.merit < least)
        fit = better or fit
        if settled or stuck == _STUCK or hops == _HOPS or (first > _FREE and idle >= _IDLE):
            break
    apart = discontinuous(fit)
    if closed is not None and (apart or closed.merit < fit.merit):
        fit = closed
    return fit, refused or (apart and not settled)


def _lower(fit: Fit, found: Fit | None) -> Fit | None:
    """Return what a step has found where its merit is lower; None where it is not."""
    return found if found is not None and found.merit < fit.merit else None


def _hopped(fit: Fit, better: Fit) -> bool:
    """Tell whether a free step has neither closed segments whose data say little nor brought them much nearer these."""
    return fit.plant.weakly_identified and discontinuous(better) and better.merit > _NO_NEARER * fit.merit


def _better_continuous(known: Fit | None, fit: Fit) -> Fit | None:
    """Return the better one of two fits whose segments are continuous; ``fit`` may be one whose segments do not."""
    if discontinuous(fit) or (known is not None and known.merit <= fit.merit):
        return known
    return fit


#: steps after which what a fit expects of the next is believed to be no better than where it will end
_LOOKED = 2
#: held steps, which are short, as a multiple of free ones
_HELD = 3
#: a free step that leaves more than this share of the merit brings a free spin no nearer; after so many in turn short
#: steps are taken (a fit that tied its segments in free steps alone did so with at most one of them)
_NO_NEARER, _HOPS = 0.98, 2
#: so many held steps in turn of which no share served every recording lead nowhere
_STUCK = 4
#: so many held steps after the best end whose segments are continuous bring none that is better: they go round it
_IDLE = 8
#: tries at a step, and what a step that leads astray is shortened by
_TRIES, _SHORTER = 5, 0.4
#: a recording whose chi-squared per reading is above this is far from its data
_FAR = 3.0
#: by how much chi-squared may rise while segments are continuous to first order only
_RISE = 1.3
#: a step that is expected to gain less than this, three standard deviations in all, keeps the slopes that it was worked
#: out with, unless it misses what was expected by more than this share of it
CHORD, _CHORD_MISSES = 10.0, 0.1
#: a rise by more than this is a step that went too far: a fiftieth of the scatter of chi-squared of 3000 readings.
#: Where steps may rise by a share of that they end in turns, from one side of a valley to the other and back
_ROSE = 1.0005


@dataclass(frozen=True)
class GaussNewtonStep:
    """A step from where a fit stands, and how much of it is taken."""

    fit: Fit
    reduced: Sequence[Reduced]
    step: FloatArray
    bounds: Mapping[tuple[str, str], tuple[float, float]]
    #: the merit that the whole step is expected to leave
    expected: float

    def _bounded(self, at: FloatArray) -> FloatArray:
        """Return parameters (p,) within their bounds."""
        if not self.bounds:
            return at
        return np.array(
            [
                np.clip(a, *self.bounds.get(q.key, (-np.inf, np.inf)))
                for a, q in zip(at, self.fit.parameters, strict=True)
            ]
        )

    def with_one_fraction(self) -> Fit | None:
        """Return the fit after the largest share of the step that improves it, the same for all; None if none does."""
        fit, fraction = self.fit, 1.0
        for _ in range(_TRIES):
            at = self._bounded(fit.at + fraction * self.step)
            taken = at - fit.at
            trajectories = tuple(
                moved(trajectory, linear, nuisance_step(r, taken), taken)
                if fraction == 1.0
                else _part(trajectory, linear, nuisance_step(r, self.step), self.step, fraction)
                for trajectory, linear, r in zip(fit.trajectories, fit.linears, self.reduced, strict=True)
            )
            trial = replace(fit, trajectories=trajectories, at=at)
            better = self._tried(trial, fraction) if _finite(trajectories) else None
            if better is not None:
                return better
            fraction *= _SHORTER
        return None

    def _tried(self, trial: Fit, fraction: float) -> Fit | None:
        """Return a trial with its linearisations where it improves the fit; None where it does not.

        After a step that leads astray its shorter ones do, too, more often than not. They are asked first with slopes
        by the states of segments alone, which tell the same merit for a quarter to half of the cost.
        """
        fit = self.fit
        short = fraction == 1.0 and fit.merit - self.expected < CHORD and not discontinuous(fit)
        new = self._by_chord(trial) if short else None
        doubted = new is None and (short or fraction < 1.0) and fit.beside is None
        if doubted and self._better(trial, linearised(trial, ())) is None:
            return None
        return self._better(trial, new or linearised(trial))

    def _better(self, trial: Fit, new: tuple[Linear, ...]) -> Fit | None:
        """Return a trial with these linearisations where it is better than the fit; None where it is not."""
        fit, merit = self.fit, merit_of(trial, new)
        # while gaps are open the merit is that of the closed trajectory to first order only: too good
        bar = fit.merit * (1.0 + 1e-9) if not discontinuous(fit) else 1.5 * fit.merit + 10.0 * fit.count
        if not (np.isfinite(merit) and merit < bar):
            return None
        return replace(trial, linears=new, merit=merit, iterations=fit.iterations + 1)

    def _by_chord(self, trial: Fit) -> tuple[Linear, ...] | None:
        """Return the linearisations after a short step with slopes as they were; None where it does not gain as much.

        What is short is told by what the step gains: in standard deviations it is the root of that.
        """
        new = repredicted(trial)
        if new is None:
            return None
        missed = merit_of(trial, new) - self.expected
        return new if missed < _CHORD_MISSES * (self.fit.merit - self.expected) else None

    def with_own_fractions(self) -> tuple[Fit | None, BoolArray]:
        """Return the fit after a step of which each recording takes as much as leads it nearer, what they share whole.

        What recordings share changes little here, and their own unknowns far from linearly. None where no share serves.
        Beside it which of them (c,) the whole step led astray, or nearly.
        """
        fit, count = self.fit, len(self.fit.trajectories)
        own = [np.array([q.recordings == frozenset([i]) for q in fit.parameters], dtype=bool) for i in range(count)]
        fractions, again = np.ones(count), list(range(count))
        at, trajectories, new = fit.at, list(fit.trajectories), list(fit.linears)
        for _ in range(_TRIES):
            wanted = self.step.copy()
            for i in range(count):
                wanted[own[i]] *= fractions[i]
            at = self._bounded(fit.at + wanted)
            taken = at - fit.at
            for i in again:
                linear, r, fraction = fit.linears[i], self.reduced[i], fractions[i]
                # a share of the way at once, and all that what is shared asks for
                still = nuisance_step(r, np.zeros_like(taken))
                nuisance = fraction * still + (nuisance_step(r, taken) - still)
                tangents = linear.sensitivities @ np.concatenate([nuisance, taken]) + fraction * linear.matching
                trajectories[i] = stepped(fit.trajectories[i], tangents)
            if not _finite(trajectories):
                fractions[again] *= _SHORTER
                continue
            trial = replace(fit, trajectories=tuple(trajectories), at=at)
            for i, linear in zip(again, linearised(trial, only=again), strict=True):
                new[i] = linear
            again = [i for i in again if not self._nearer(i, trial, new[i])]
            if not again:
                new_fit = replace(trial, linears=tuple(new), merit=merit_of(trial, new), iterations=fit.iterations + 1)
                rose = [
                    self._own_merit(i, new_fit, new[i]) > _ROSE * self._own_merit(i, fit, fit.linears[i])
                    for i in range(count)
                ]
                return new_fit, (fractions < 1.0) | np.array(rose)
            fractions[again] *= _SHORTER
        return None, fractions < 1.0

    def _nearer(self, i: int, trial: Fit, new: Linear) -> bool:
        """Tell whether a step has not led a recording astray."""
        was, now = (self._own_merit(i, fit, linear) for fit, linear in ((self.fit, self.fit.linears[i]), (trial, new)))
        if not np.isfinite(now):
            return False
        count = new.residual.size
        bar = _RISE * was if was < _FAR * count else 1.5 * was + 10.0 * count
        return bool(now < bar)

    def _own_merit(self, i: int, fit: Fit, linear: Linear) -> float:
        """Return the chi-squared of one recording, its defects included."""
        one = replace(fit, trajectories=(fit.trajectories[i],), parameters=(), at=np.empty(0))
        return merit_of(one, (linear,))


def _finite(trajectories: Sequence[Trajectory]) -> bool:
    """Tell whether all states are numbers."""
    return all(bool(np.all(np.isfinite(trajectory.states))) for trajectory in trajectories)


#: how hard steps are held to that: not at all, at first, at least after a step that went too far, and at most; what it
#: is multiplied by after a step that went too far, and after one that did not
_FREE, _FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 0.0, 0.3, 0.1, 3.0
_TIGHTER, _LOOSER = 5.0, 0.7


def _trust_radii(fit: Fit, damping: FloatArray) -> FloatArray | None:
    """Return how far one step takes each parameter (p,) of which the readings say little; None where steps are free.

    ``damping`` (c,) is how hard each recording's own are held to it. Where a fit ends does not depend on it.
    """
    if not np.any(damping):
        return None
    radius = np.full(len(fit.parameters), np.inf)
    for j, q in enumerate(fit.parameters):
        if q.key in fit.plant.own_keys and q.recordings is not None:
            radius[j] = OWN_TRUST_RADIUS * q.sigma / np.sqrt(np.max(damping[list(q.recordings)]))
    return radius


#: gaps of a trajectory below this share of the steps of its differences are closed
_CLOSED = 20.0


def discontinuous(fit: Fit) -> bool:
    """Tell whether segments that may not jump still do."""
    forbidden = ~fit.defects.allowed
    steps = fit.plant.sizes.differences
    return any(
        bool(np.any(np.abs(linear.mismatch[:, forbidden]) > _CLOSED * steps[forbidden])) for linear in fit.linears
    )


def reduced_each(fit: Fit) -> list[Reduced]:
    """Return what each recording says of the shared parameters where a fit stands, nothing held."""
    return mapped(
        lambda linear, trajectory: reduce(linear, trajectory, fit.noise, fit.defects), fit.linears, fit.trajectories
    )


def _reduced(fit: Fit) -> Callable[[Linear, Trajectory, float], Reduced]:
    """Return `reduce` with the noise and the defects of a fit."""
    return lambda linear, trajectory, damping: reduce(linear, trajectory, fit.noise, fit.defects, damping)


def _part(
    trajectory: Trajectory, linear: Linear, nuisance: FloatArray, common: FloatArray, fraction: float
) -> Trajectory:
    """Return the trajectory after a share of a step, the closing of gaps included."""
    tangents = fraction * (linear.sensitivities @ np.concatenate([nuisance, common]) + linear.matching)
    return stepped(trajectory, tangents)
