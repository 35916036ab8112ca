"""The likelihood of an event's instant: of what happens at once it is no parabola, and its curvature tells no error.

Takes a fit; gives how chi-squared goes with the instant of an event, all else following, and a covariance by that. A
step of size a seen in noise s is a change point: chi-squared grows by (a/s)^2 for each reading between two instants,
with a random walk upon it. So the most likely instant lies some way off, at the bottom of one of many dips, and it
scatters by more than the width of any (Hinkley, "Inference about the change-point in a sequence of random variables",
1970; Yao, "Approximating the distribution of the maximum likelihood estimate of the change-point", 1987).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE
from discsim.validation.identification.gauss_newton import Fit, reduced_each
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.linearisation import linearise, moved
from discsim.validation.identification.normal_equations import Reduced, common_step, nuisance_step, reduce
from discsim.validation.identification.propagation import EVENTS, Column

__all__ = ["InstantProfile", "instant_profile", "instants_of", "with_errors_of_instants"]

#: The parameter that says when.
_WHEN = "t_s"
#: Standard deviation of a change point, by how much chi-squared grows per second beside it: the root of 26 (Yao, 1987).
_CHANGE_POINT = float(np.sqrt(26.0))
#: Instants to each side at which it is asked first, and how many standard deviations away the farthest is: of a change
#: point chi-squared has grown by 41 there, the walk upon it scatters by 13.
_EACH_SIDE, _FARTHEST = 10, 8.0
#: Instants between those at which chi-squared has grown by so much, which leaves a likelihood of a thousandth.
_BETWEEN, _GROWN = 49, 14.0


@dataclass(frozen=True, eq=False)
class InstantProfile:
    """How chi-squared goes with the instant of one event, what else is unknown following to first order.

    Attributes
    ----------
    fit : Fit
        The fit about which it is asked.
    place : int
        The place of the instant among the fit's parameters.
    instants : (g,) array
        Instants that are tried, ascending, s.
    chi2 : (g,) array
        Chi-squared with priors, less what it is where the fit stands.
    steps : (g, p) array
        How the shared parameters go with the instant from where the fit stands.
    linear : Linear
        The linearisation of the event's recording, a column for each instant behind those of the parameters.
    reduced : sequence of Reduced
        What each recording says of these columns.
    """

    fit: Fit
    place: int
    instants: FloatArray
    chi2: FloatArray
    steps: FloatArray
    linear: Linear
    reduced: Sequence[Reduced]

    @property
    def weights(self) -> FloatArray:
        """How likely each instant is (g,), in all one, if none was likelier beforehand."""
        density = np.exp(-0.5 * (self.chi2 - np.min(self.chi2))) * np.gradient(self.instants)
        return np.asarray(density / np.sum(density))

    @property
    def covariance(self) -> FloatArray:
        """The covariance (p, p) of the shared parameters about where the fit stands.

        That at a given instant, and how they go with an instant that is as likely as chi-squared says.
        """
        C, j = self.fit.covariance, self.place
        given = C - np.outer(C[:, j], C[j]) / C[j, j]
        return np.asarray(given + self.steps.T @ (self.weights[:, None] * self.steps))

    def at_least(self) -> Fit:
        """Return the fit moved to where chi-squared is least, with all that follows the instant."""
        fit, best = self.fit, int(np.argmin(self.chi2))
        (own,) = _recordings(fit, self.place)
        p = len(fit.parameters)
        trajectories = list(fit.trajectories)
        for i, (linear, reduced) in enumerate(zip(fit.linears, self.reduced, strict=True)):
            step = self.steps[best].copy()
            if i == own:
                # the event has a column for each instant in the place of a slope by it
                linear = self.linear
                grown = 1.0 + float(_per_size(fit, self.place) @ step)
                step = np.concatenate([step, np.zeros(self.instants.size)])
                step[self.place], step[p + best] = 0.0, grown * fit.parameters[self.place].step
            trajectories[i] = moved(trajectories[i], linear, nuisance_step(reduced, step), step)
        return replace(fit, trajectories=tuple(trajectories), at=fit.at + self.steps[best])


def _recordings(fit: Fit, place: int) -> tuple[int, ...]:
    """Return the recordings that a parameter acts in."""
    recordings = fit.parameters[place].recordings
    return tuple(range(len(fit.trajectories))) if recordings is None else tuple(sorted(recordings))


def _per_size(fit: Fit, place: int) -> FloatArray:
    """Return by what share of itself an event grows with each parameter (p,): what it changes is linear in its sizes.

    Of several, as the components of a push, along their direction.
    """
    when = fit.parameters[place]
    mine = [q.group == when.group and q.recordings == when.recordings for q in fit.parameters]
    sizes = np.where(mine, fit.at, 0.0)
    sizes[place] = 0.0
    squared = float(sizes @ sizes)
    return sizes / squared if squared > 0.0 else sizes


def instants_of(fit: Fit) -> Iterator[int]:
    """Yield the places of parameters that tell when a brief event was, each in one recording, with a known error."""
    if fit.covariance.shape[0] != len(fit.parameters):
        return
    for j, q in enumerate(fit.parameters):
        brief = q.group in EVENTS and q.name == _WHEN
        if brief and len(_recordings(fit, j)) == 1 and 0.0 < fit.covariance[j, j] < np.inf:
            yield j


def instant_profile(fit: Fit, place: int) -> InstantProfile | None:
    """Return how chi-squared of a fit goes with one of its `instants_of`; None where that is not finite.

    Instants about the estimate are asked first, close ones and such as are as far away as the event's size tells, then
    evenly those among which it may have been. Each costs a neighbour of the motion beside it, not a fit.
    """
    reduced = reduced_each(fit)
    first = _profile(fit, place, reduced, _first_instants(fit, place))
    if first is None:
        return None
    some = np.flatnonzero(first.chi2 < np.min(first.chi2) + _GROWN)
    begin, end = first.instants[max(some[0] - 1, 0)], first.instants[min(some[-1] + 1, first.instants.size - 1)]
    return _profile(fit, place, reduced, np.unique(np.append(np.linspace(begin, end, _BETWEEN), fit.at[place])))


def _first_instants(fit: Fit, place: int) -> FloatArray:
    """Return instants (g,) s about an estimate, ever farther apart, as far away as an event might have been.

    Of a pulse that lasts w (one sigma) the curvature at its best instant is that of a step by 1/(2 w sqrt(pi)) of what
    chi-squared grows by per second beside it. A step that shows by what it leads to alone, as a kick by the angle of
    spin, has an error as the curvature says.
    """
    (own,) = _recordings(fit, place)
    lasts, variance = CATALOGUE[fit.parameters[place].group].lasts, float(fit.covariance[place, place])
    assert not isinstance(lasts, str)
    sd = float(np.sqrt(variance))
    # what a user's own event leaves has no known width: at once, or as smooth as its curvature says
    widest = max(sd, _CHANGE_POINT * variance / (2.0 * lasts * float(np.sqrt(np.pi)))) if lasts else sd
    away = np.geomspace(0.5 * sd, _FARTHEST * widest, _EACH_SIDE)
    now, begin, end = float(fit.at[place]), fit.plant.durations.event_from, float(fit.trajectories[own].nodes[-1])
    # an event is in its recording, unless a fit has it elsewhere
    instants = np.clip(now + np.concatenate([-away[::-1], [0.0], away]), min(begin, now), max(end, now))
    return np.unique(instants)


def _profile(fit: Fit, place: int, about: Sequence[Reduced], instants: FloatArray) -> InstantProfile | None:
    """Return chi-squared at instants (g,), one of which is where the fit stands; None where one is not finite.

    ``about`` is what each recording says of the shared parameters there.
    """
    q, p, g = fit.parameters[place], len(fit.parameters), instants.size
    (own,) = _recordings(fit, place)
    acting = [j for j, one in enumerate(fit.parameters) if one.acts_in(own)]
    columns = [Column(fit.parameters[j].group, fit.parameters[j].name, fit.parameters[j].step) for j in acting]
    # one-sided differences from the motion with the event where the fit has it to that with it where it is tried
    columns += [Column(q.group, q.name, q.step, ((_WHEN, float(t) - q.step),)) for t in instants]
    trajectory = fit.trajectories[own]
    linear = linearise(trajectory, fit.values(own), columns, fit.defects.allowed, central=False)
    linear = linear.spread([*acting, *range(p, p + g)], p + g)
    reduced = [*about]
    reduced[own] = reduce(linear, trajectory, fit.noise, fit.defects)
    gram, shared = reduced[own].gram.copy(), [*range(p), p + g]
    gram[np.ix_(shared, shared)] += sum((one.gram for i, one in enumerate(about) if i != own), np.zeros(()))
    others = [j for j in range(p) if j != place]
    kept = np.eye(p + g + 1)[:, [*others, p + g]]
    per_size = _per_size(fit, place)[others]
    chi2, steps = np.empty(g), np.zeros((g, p))
    for k, t in enumerate(instants):
        # the residual that is left once the event has been moved there, and what one of another size changes there
        kept[p : p + g] = 0.0
        kept[p + k] = q.step * np.append(per_size, -1.0)
        step, _, chi2[k] = common_step(kept.T @ gram @ kept, [fit.parameters[j] for j in others], fit.at[others])
        steps[k, others], steps[k, place] = step, t - fit.at[place]
    if not (np.all(np.isfinite(chi2)) and np.all(np.isfinite(steps))):
        return None
    now = int(np.argmin(np.abs(instants - fit.at[place])))
    return InstantProfile(fit, place, instants, chi2 - chi2[now], steps, linear, reduced)


def with_errors_of_instants(fit: Fit) -> Fit:
    """Return a fit whose covariance is by the likelihood of each event's instant, not by its curvature alone."""
    for place in instants_of(fit):
        profile = instant_profile(fit, place)
        if profile is not None:
            fit = replace(fit, covariance=profile.covariance)
    return fit
