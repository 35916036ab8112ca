"""Where a search stands: what was found so far, and whether a fit is far from the data, and possible."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from discsim.effects.catalogue import CATALOGUE, catalogued
from discsim.effects.events import SpinStep
from discsim.recording import Recording
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit
from discsim.validation.diagnosis.candidates.evidence import ONE_SIDED, holds_itself
from discsim.validation.diagnosis.candidates.hypothesis import Start
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.diagnosis.candidates.screening import NormalEquations, normal_equations_of
from discsim.validation.diagnosis.detectors.dropped_samples import LostSamples
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.identification.gauss_newton import Bars, Fit
from discsim.validation.identification.noise import NoiseModel, chi_squared, robust_noise
from discsim.validation.identification.parameters import Parameter

__all__ = [
    "Considered",
    "Rival",
    "Search",
    "chi2_in",
    "far",
    "from_here",
    "hopeless",
    "misses",
    "no_nearer",
    "on_the_disc",
    "possible",
    "steady_noise",
    "unreliable",
    "values_of_fit",
    "wobbles",
]

#: when a kick changed the spin
_KICK = (catalogued(SpinStep).id, "t_s")


@dataclass(frozen=True)
class Considered:
    """A candidate that was refitted: what it gained by the likelihood when it was, and its numbers."""

    candidate: CandidateEffect
    gain: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class Rival:
    """An effect in the place of a named one: how much worse the likelihood is (twice its logarithm), and the fit."""

    candidate: CandidateEffect
    worse: float
    fitted: ContinuousFit


@dataclass(frozen=True, eq=False)
class Search:
    """A selection of effects, as far as it has come: each step returns another.

    Attributes
    ----------
    recordings, own
        The recordings as they are stated, and the parameters that they leave open without any effect.
    relaxed_fit, relaxed_noise, relaxed_equations
        The relaxed fit, its noise, and the normal equations of all candidates about it.
    candidates
        The effects that compete, at each of their shapes.
    base, final
        The fits of the baseline and of the effects so far.
    equations, asked
        The normal equations of all candidates about a fit, in its own noise, and which fit that is: in the end the
        final one.
    steps, considered, rivals
        Fits on the way; candidates that were refitted; what could stand in for a named effect, by its name.
    outliers
        Readings that were left out: (recording, sensor, axis, time, deviations).
    hints
        What relations between sensors had asked for before any fit, with its values to start from.
    cost : float
        What choosing the samples that were lost has cost, in twice the log likelihood.
    at_once : bool
        Whether the effects were found together, each weighed against the others by the normal equations.
    lost_samples
        What was found of lost samples about the relaxed fit.
    """

    recordings: tuple[Recording, ...]
    own: tuple[Parameter, ...]
    relaxed_fit: Fit
    relaxed_noise: NoiseModel
    candidates: tuple[CandidateEffect, ...]
    base: ContinuousFit
    final: ContinuousFit
    relaxed_equations: NormalEquations
    equations: NormalEquations
    asked: Fit
    steps: tuple[ContinuousFit, ...] = ()
    considered: tuple[Considered, ...] = ()
    rivals: Mapping[str, Sequence[Rival]] = field(default_factory=dict)
    outliers: tuple[tuple[int, str, str, float, float], ...] = ()
    hints: tuple[ScreenedCandidate, ...] = ()
    cost: float = 0.0
    lost_samples: LostSamples = field(default_factory=LostSamples)
    at_once: bool = False

    def about(self, fit: Fit) -> Search:
        """Return the search with its normal equations about a fit, which are worked out once."""
        if self.asked is fit:
            return self
        equations = normal_equations_of(fit, self.candidates, fit.noise, fit.continuous_defects, some_astray=True)
        return replace(self, equations=equations, asked=fit)

    def with_step(self, fitted: ContinuousFit) -> Search:
        """Return the search with one more fit on the way."""
        return replace(self, steps=(*self.steps, fitted))

    def with_cost(self, fitted: ContinuousFit, further: float = 0.0) -> ContinuousFit:
        """Return a fit whose score holds what choosing lost samples has cost so far, and ``further`` cost."""
        return replace(fitted, score=fitted.score + self.cost + further)

    def at_base(self) -> Search:
        """Return the search as if nothing had been found."""
        return replace(self, final=self.base)


def values_of_fit(fitted: ContinuousFit) -> Start:
    """Return the values of a fit's parameters as a start for another."""
    return {(q.key, q.recordings): float(v) for q, v in zip(fitted.fit.parameters, fitted.fit.at, strict=True)}


def chi2_in(fitted: ContinuousFit, noise: NoiseModel) -> float:
    """Return the chi-squared of a fit's residuals in a given noise."""
    return sum(
        chi_squared(linear, noise, residual)
        for linear, residual in zip(fitted.fit.linears, fitted.residuals, strict=True)
    )


def far(found: Search, fitted: ContinuousFit) -> bool:
    """Tell whether a fit is far from the data."""
    return chi2_in(fitted, found.relaxed_noise) > SELECTION.far * fitted.fit.count


def unreliable(found: Search, fitted: ContinuousFit) -> bool:
    """Tell whether a fit is far from the data and leaves more than noise, so that no answer may rest on it."""
    return far(found, fitted) and bool(fitted.unmodelled())


def no_nearer(found: Search, before: ContinuousFit, after: ContinuousFit) -> bool:
    """Tell whether one fit is not much nearer to the data than another."""
    return chi2_in(after, found.relaxed_noise) > SELECTION.no_nearer * chi2_in(before, found.relaxed_noise)


def misses(found: Search, fitted: ContinuousFit) -> bool:
    """Tell whether a fit is far from data that the relaxed fit follows: something is missing in its hypothesis."""
    return far(found, fitted) and found.relaxed_fit.merit < SELECTION.followed * found.relaxed_fit.count


def hopeless(best: float, count: int) -> Bars:
    """Return the chi-squared above which a refit is of no use beside the best so far, of so many readings."""
    times = SELECTION.hopeless_near if best < SELECTION.far * count else SELECTION.hopeless
    return Bars(times * best, SELECTION.hopeless_held * best)


def on_the_disc(found: Search, start: Start) -> bool:
    """Tell whether a start has its centre of mass on the disc.

    Where recordings hardly show it, algebra may ask for any number, under which no motion lasts. A sensor's place that
    nothing shows, as along the axis of a table, does no harm.
    """
    radius = _radius(found.recordings[0])
    return all(abs(number) <= radius for (key, _), number in start.items() if _is_place(key[0], "motion"))


def _is_place(id: str, acts_on: str | None = None) -> bool:
    """Tell whether an effect's parameters are distances from the disc's centre or from another place on it, m.

    With ``acts_on`` only where it acts on that.
    """
    row = CATALOGUE.get(id)
    return row is not None and row.on_disc and acts_on in (None, row.acts_on)


def _radius(recording: Recording) -> float:
    return np.inf if recording.disc is None else 0.5 * recording.disc.diameter


def possible(fitted: ContinuousFit) -> bool:
    """Tell whether a fit's parameters make sense.

    Friction does not drive, an event is told from the start, neither a sensor nor the centre of mass lies off the disc,
    and no effect holds another.
    """
    if holds_itself(fitted.hypothesis.candidates):
        return False
    sd = np.sqrt(np.maximum(np.diag(fitted.fit.covariance), 0.0))
    recording = fitted.fit.trajectories[0].recording
    radius = _radius(recording)
    for q, value, error in zip(fitted.fit.parameters, fitted.fit.at, sd, strict=True):
        if q.key in ONE_SIDED and ONE_SIDED[q.key] * value < -3.0 * error:
            return False
        if q.key == _KICK and value < fitted.fit.plant.durations.event_from:
            return False
        if _is_place(q.group) and abs(value) - 3.0 * error > radius:
            return False
    return True


def from_here(screened: ScreenedCandidate, current: ContinuousFit) -> ScreenedCandidate:
    """Return a screened candidate that starts from the present fit: only its own values are those of algebra."""
    own = {key: value for key, value in screened.start.items() if key[0][0] == screened.candidate.id}
    return replace(screened, start={**values_of_fit(current), **own})


def steady_noise(found: Search) -> NoiseModel:
    """Return the noise in which events are looked for.

    It is that of most readings, to which a short event adds nothing, unless that is much louder than stated.
    """
    linears = found.relaxed_fit.linears
    steady = robust_noise(linears, [linear.residual for linear in linears])
    stated = {c.group: float(linear.sd[c.rows][0]) for linear in linears for c in linear.channels}
    well = all(
        not np.isfinite(stated[group]) or noise.sd < SELECTION.short * stated[group] for group, noise in steady.items()
    )
    return steady if well else found.relaxed_noise


def wobbles(fit: Fit) -> Start:
    """Return how the wobble of free spins dies and turns in a fit, as a start for a fit from its segments.

    What algebra expects of it is no use: turning for a second makes a radian, which is far from linear.
    """
    parameters = zip(fit.parameters, fit.at, strict=True)
    return {(q.key, q.recordings): float(v) for q, v in parameters if q.key in fit.plant.own_keys}
