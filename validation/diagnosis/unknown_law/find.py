"""None of these: the force, moment or sensor term that no effect of the catalogue accounts for, as a formula.

Takes a fit that follows the data; gives a law, or None. One linearisation with a constant force and moment in each
direction answers, segment by segment, what any function of the state would explain: its value in a segment weighs that
segment's part of the column. The best few are fitted by output error, their exponents free, and believed only where
recordings that took no part are explained by them, too.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.kind import BOARD
from discsim.validation.diagnosis.candidates.candidate import parameters_of, stand_ins
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.evidence import price_of_oddity
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.result import Law
from discsim.validation.diagnosis.selection.next_effect import next_effect
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.settings import SELECTION, UNKNOWN_LAW
from discsim.validation.diagnosis.unknown_law.formula import as_laws, as_sensor_laws, swinging_in_words
from discsim.validation.diagnosis.unknown_law.motion_law import candidate_laws, fitted_law, reference_of, state_of
from discsim.validation.diagnosis.unknown_law.sensor_law import (
    asked_of_sensors,
    coefficients_of,
    fitted_sensor_law,
    further_sensor_terms,
    sensor_library,
    settled_terms,
)
from discsim.validation.diagnosis.unknown_law.terms import SensorTerm
from discsim.validation.identification.gauss_newton import Fit, reduced_each, refit
from discsim.validation.identification.noise import GroupNoise, NoiseModel, chi_squared, log_likelihood
from discsim.validation.identification.normal_equations import common_step, nuisance_step
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import Plant
from discsim.validation.identification.plants.law_terms import Term

__all__ = ["FoundLaw", "LawOfAll", "find_law", "left_to_gain", "one_more_does_as_well"]


@dataclass(frozen=True)
class FoundLaw:
    """A law that holds on recordings that took no part.

    ``gain`` is twice the log likelihood gained over the fit without any effect, ``heldout`` the log likelihood gained
    by recording while it took no part, ``chi2`` its chi-squared there before and after in the noise of the fit with the
    law, ``share`` the part of the excess of chi2 that it explains. ``fitted`` is that fit. ``reference`` says
    the same law in another way: its value at an ordinary state, which is known better than its coefficients, whose
    errors are continuous with those of the exponents. ``swinging`` tells in words how often what swings does so.
    """

    law: Law
    gain: float
    heldout: Mapping[int, float]
    share: float
    reference: str
    fitted: ContinuousFit
    also: tuple[Law, ...] = field(default_factory=tuple)
    chi2: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    swinging: str = ""

    @property
    def explains_all(self) -> bool:
        """Whether nothing but noise is left beside it."""
        return self.share > UNKNOWN_LAW.all and not self.fitted.unmodelled()


# --------------------------------------------------------------------------------------------------- fitting


def _held_out(before: Fit, after: Fit) -> tuple[dict[int, float], dict[int, tuple[float, float]]]:
    """Return what each recording gains in log likelihood while it took no part in either fit, and its chi-squared then.

    The shared parameters are those of the other recordings, by one step of the fit without it; the recording's own
    unknowns follow. chi-squared is in the levels of noise of the fit after.
    """
    count = len(before.trajectories)
    if count < 2:
        return {}, {}
    levelled = {group: noise._replace(correlation=0.0) for group, noise in after.noise.items()}
    sides, squares = [], []
    for fit in (before, after):
        linears = fit.linears
        reduced = reduced_each(fit)
        levels, squared = [], []
        for i in range(count):
            others = np.sum([r.gram for j, r in enumerate(reduced) if j != i], axis=0)
            told = [j for j, q in enumerate(fit.parameters) if q.recordings != frozenset({i})]
            some = [*told, len(fit.parameters)]
            step = np.zeros(len(fit.parameters))
            step[told], _, _ = common_step(others[np.ix_(some, some)], [fit.parameters[j] for j in told], fit.at[told])
            acting = np.array([q.acts_in(i) for q in fit.parameters], dtype=bool)
            step = np.where(acting, step, 0.0)
            left = linears[i].after(nuisance_step(reduced[i], step), step)
            levels.append(log_likelihood(linears[i], fit.noise, left))
            squared.append(chi_squared(linears[i], levelled, left))
        sides.append(levels)
        squares.append(squared)
    # a recording's own numbers of a law took part: each gains one half by chance, and as much is lost elsewhere
    price = [sum(q.group == "term" and q.recordings == frozenset({i}) for q in after.parameters) for i in range(count)]
    gains = {i: 0.5 * (sides[0][i] - sides[1][i]) - price[i] for i in range(count)}
    return gains, {i: (squares[0][i], squares[1][i]) for i in range(count)}


# ----------------------------------------------------------------------------------------------------- finding


def _own_at(relaxed_fit: Fit, own: Sequence[Parameter]) -> FloatArray:
    """Return where own parameters start: those that stand for a recording alone, where the relaxed fit has them."""
    known = {(q.key, q.recordings): number for q, number in zip(relaxed_fit.parameters, relaxed_fit.at, strict=True)}
    return np.array([known.get((q.key, q.recordings), q.stated) if q.recordings else q.stated for q in own])


def _white(noise: NoiseModel) -> dict[str, GroupNoise]:
    return {group: GroupNoise(item.sd, min(item.correlation, 0.9)) for group, item in noise.items()}


def _beside(relaxed_fit: Fit, own: Sequence[Parameter], own_at: FloatArray, noise: NoiseModel) -> Fit:
    """Return a fit without errors of the sensors whose motion stays beside the data, to ask from.

    In the air its segments jump as those of the relaxed fit do, for what hides turns a whole flight too far from a
    line; a rig's are continuous.
    """
    fit = refit(Fit(relaxed_fit.trajectories, tuple(own), own_at, relaxed_fit.defects, _white(noise)), iterations=5)
    levels: dict[str, list[float]] = {}
    for linear in fit.linears:
        for channel in linear.channels:
            levels.setdefault(channel.group, []).append(_quick(linear.residual[channel.rows]))
    quick = {group: float(np.sqrt(np.mean(np.square(found)))) for group, found in levels.items()}
    sure = {
        g: GroupNoise(min(item.sd, max(quick[g], 0.1 * item.sd)), item.correlation)
        for g, item in fit.noise.items()
        if g in quick
    }
    return replace(fit, noise=sure, defects=fit.defects if fit.plant.airborne else fit.plant.sizes.continuous)


def _quick(e: FloatArray) -> float:
    """Return the noise that differences of neighbours show, whatever drifts below it."""
    return float(np.sqrt(0.5 * np.mean(np.diff(e) ** 2))) if e.size > 1 else 0.0


#: terms of an accelerometer to which something moves, or from which
_OF_WHAT_MOVES = frozenset([("accelerometer", "settling"), ("accelerometer", "warming"), ("accelerometer", "drift")])


def find_law(search: Search, *, instead: bool = True, moves_out: bool = False) -> FoundLaw | None:
    """Return the law that explains what the catalogue does not, or None where none holds on held-out recordings.

    ``search`` holds the best fit with effects of the catalogue, or without any. What nobody stated of the recordings is
    open under a law. ``instead`` asks for a law that does better than the effects of the best fit, which then would
    explain the recordings; ``moves_out`` for one of what moves in a body, by the pull that it changes.
    """
    relaxed_fit, best, noise, recordings = search.relaxed_fit, search.final, search.relaxed_noise, search.recordings
    plant = relaxed_fit.plant
    if relaxed_fit.path_alone:
        return None  # a path alone leaves no motion beside the data
    if len(recordings) == 1 and BOARD.isdisjoint(recordings[0].samples):
        return None  # one path takes any law, and no other recording could bear it out
    unstated = [q for candidate in stand_ins(recordings) for q in parameters_of(candidate)]
    own = [*search.own, *unstated]
    base = search.base if best.hypothesis.candidates else best
    if unstated or any(candidate.fixed_values for candidate in best.hypothesis.candidates):
        # where samples were lost, the baseline's fit is that of others
        base = continuous_fit(relaxed_fit, Hypothesis(), own, noise, {}, iterations=6, polish=1)
    own_at = _own_at(relaxed_fit, own)
    start = _beside(relaxed_fit, own, own_at, noise)
    states = [state_of(trajectory, start.values(i)) for i, trajectory in enumerate(start.trajectories)]
    at = reference_of(states)
    motion = _on_motion(plant)
    about = sensor_library(start)
    if moves_out:
        about = [term for term in about if (term.sensor, term.kind) in _OF_WHAT_MOVES]
    ranked: list[tuple[float, float, Term | SensorTerm]] = []
    if motion:
        ranked += candidate_laws(start, own, motion, at)
    ranked += _worth(start, about, asked_of_sensors(start, own, about))
    ranked.sort(key=lambda item: -item[0])
    places = plant.laws.places(states)
    # where a wind blows shows in what it does to all of a path after it, which jumps between segments would take up
    widths = _best_of_widths(candidate_laws(replace(base.fit, noise=start.noise), own, places, at)) if places else []
    if moves_out:
        # the motion is as all others tell it; there its segments are joined already, which short steps end beside
        own_at = base.fit.at
        start = replace(start, trajectories=base.fit.trajectories, at=own_at, linears=())
    found = _likeliest(start, own, own_at, base, [*_spread(ranked), *widths], at)
    if found is None:
        return None
    fitted, term = found
    if isinstance(term, SensorTerm):
        law = _believed(*_more_sensor_terms(start, own, own_at, fitted, term, about), base, at, start.noise)
    else:
        law = _believed(*_more_terms(start, own, own_at, fitted, term, at), base, at, start.noise)
    return None if law is None or (instead and not _does_better(law, best)) else law


def _on_motion(plant: Plant) -> tuple[Term, ...]:
    """Return the terms on a plant's motion; none of a free spin: what it does not model takes up any further moment."""
    return () if plant.weakly_identified else plant.laws.terms


def _does_better(law: FoundLaw, fitted: ContinuousFit) -> bool:
    """Tell whether a law is worth its price over a fit with effects; one that some recordings alone have is dear."""
    odd = sum(price_of_oddity(candidate) for candidate in fitted.hypothesis.candidates)
    return _priced(law.fitted) + SELECTION.entry <= fitted.score + odd


#: kinds of a sensor's terms that no effect passes for: what turns or swings, and a play, leave what is seen as such
_NO_COPY = ("turning", "swinging", "play")


class LawOfAll:
    """Asks a search whether a law explains all that it has before it, and keeps the law in ``found``."""

    def __init__(self) -> None:
        self.found: FoundLaw | None = None

    def __call__(self, search: Search) -> bool:
        """Tell whether one does, where no further effect does as well beside the one that the search has come to.

        A scale of a sensor and a drift are two effects of the catalogue, and a law of two terms says the same.
        """
        law = find_law(search.at_base(), instead=False)
        if law is not None and law.explains_all and not one_more_does_as_well(search, law):
            self.found = law
        return self.found is not None


def one_more_does_as_well(search: Search, law: FoundLaw) -> bool:
    """Tell whether one further effect, beside those that a search has come to, explains as much as a law.

    A drift in proportion to time is an effect of the catalogue, and a law of time to the power 1 says the same.
    """
    _, with_one_more = next_effect(search, search.final, len(search.final.hypothesis.candidates))
    return with_one_more is not None and not _does_better(law, with_one_more)


def left_to_gain(fit: Fit, about: Collection[str]) -> float:
    """Return what the best term would gain in chi2 beside a fit, effects and all; 0 where no term is asked.

    ``about`` is what terms may stand on: "motion", or sensors. Of those on a sensor their coefficients are paid.
    """
    if fit.path_alone:
        return 0.0
    gains = [0.0]
    if "motion" in about and (motion := _on_motion(fit.plant)):
        at = reference_of([state_of(trajectory, fit.values(i)) for i, trajectory in enumerate(fit.trajectories)])
        gains += [gain for gain, _, _ in candidate_laws(fit, fit.parameters, motion, at)]
    terms = sensor_library(fit, about, _NO_COPY)
    gains += [gain for gain, _, _ in _worth(fit, terms, asked_of_sensors(fit, fit.parameters, terms))]
    return max(gains)


def _likeliest(
    start: Fit,
    own: Sequence[Parameter],
    own_at: FloatArray,
    base: ContinuousFit,
    chosen: Sequence[tuple[float, float, Term | SensorTerm]],
    at: Mapping[str, float],
) -> tuple[ContinuousFit, Term | SensorTerm] | None:
    """Return the best fit of a law of one term of those chosen, and the term; one that explains all ends the search."""
    found: tuple[ContinuousFit, Term | SensorTerm] | None = None
    for _, coefficient, term in chosen:
        fitted: ContinuousFit | None
        if isinstance(term, SensorTerm):
            fitted = fitted_sensor_law(start, own, own_at, [term])
        else:
            fitted = fitted_law(start, own, own_at, [term], [coefficient], at)
        if fitted is None or not np.isfinite(fitted.score):
            continue
        if found is None or _priced(fitted) < _priced(found[0]):
            found = fitted, term
        if _share(base.fit, fitted.fit, start.noise) > UNKNOWN_LAW.all:
            break
    return found


def _best_of_widths(ranked: Sequence[tuple[float, float, Term]]) -> list[tuple[float, float, Term]]:
    """Return the best place of each width where it is worth its price: a fit moves a middle further than a width."""
    best: dict[float, tuple[float, float, Term]] = {}
    for item in ranked:
        if item[0] > SELECTION.entry and item[2].place is not None:
            best.setdefault(item[2].place[2], item)
    return list(best.values())


def _more_terms(
    start: Fit,
    own: Sequence[Parameter],
    own_at: FloatArray,
    fitted: ContinuousFit,
    first: Term,
    at: Mapping[str, float],
) -> tuple[ContinuousFit, tuple[Term, ...]]:
    """Return the fit of a law with one more term where the first leaves more than noise, and its terms.

    The further term is asked for beside the first from where the motion is beside the data, and must gain its price and
    held-out likelihood over the law without it.
    """
    terms: tuple[Term, ...] = (first,)
    if len(start.trajectories) < 2 or not fitted.unmodelled():
        return fitted, terms  # and where no other recording could bear a further term out
    held = tuple(q for q in fitted.fit.parameters if q.group == "law")
    beside = Fit(start.trajectories, (*own, *held), fitted.fit.at, start.defects, start.noise, fitted.fit.fixed)
    beside = refit(beside, iterations=3)
    if not np.isfinite(beside.merit):
        return fitted, terms  # under this law no motion lasts: there is nothing beside it to ask
    coefficient = float(fitted.fit.at[[q.name for q in fitted.fit.parameters].index("0.coefficient")])
    powers = {q.name: float(v) for q, v in zip(fitted.fit.parameters, fitted.fit.at, strict=True) if q.group == "law"}
    place = None if first.place is None else (powers["0.north"], powers["0.east"], powers["0.size"])
    settled = replace(first, powers=tuple((s, powers.get(f"0.power_{s}", n)) for s, n in first.powers), place=place)
    others = [term for term in start.plant.laws.terms if _key(term) != _key(first)]
    best, chosen = fitted, terms
    for _, further, term in _spread(candidate_laws(beside, (*own, *held), others, at)):
        assert isinstance(term, Term)
        both = fitted_law(start, own, own_at, [settled, term], [coefficient, further], at)
        if _priced(both) + SELECTION.entry > _priced(best):
            continue
        gains, _ = _held_out(fitted.fit, both.fit)
        if not _holds(gains):
            continue
        best, chosen = both, (settled, term)
    return best, chosen


def _more_sensor_terms(
    start: Fit,
    own: Sequence[Parameter],
    own_at: FloatArray,
    fitted: ContinuousFit,
    first: SensorTerm,
    library: Sequence[SensorTerm],
) -> tuple[ContinuousFit, tuple[SensorTerm, ...]]:
    """Return the fit of a law about a sensor with one more term where the first leaves more than noise, and its terms.

    As for motion, the further term must gain its price and held-out likelihood over the law without it.
    """
    terms: tuple[SensorTerm, ...] = (first,)
    if len(start.trajectories) < 2 or not fitted.unmodelled():
        return fitted, terms
    settled = settled_terms(fitted, terms)
    others = further_sensor_terms(library, settled)
    ranked = sorted(_worth(start, others, asked_of_sensors(start, own, others, settled)), key=lambda item: -item[0])
    best = fitted
    for _, _, term in _spread(ranked):
        assert isinstance(term, SensorTerm)
        two = (settled[0].term, term)
        both = fitted_sensor_law(start, own, own_at, two)
        if both is None or _priced(both) + SELECTION.entry > _priced(best):
            continue
        gained, _ = _held_out(fitted.fit, both.fit)
        if _holds(gained, two):
            best, terms = both, two
    return best, terms


def _worth(
    start: Fit, terms: Sequence[SensorTerm], gains: Sequence[float]
) -> list[tuple[float, float, Term | SensorTerm]]:
    """Return sensor terms with what they gain less what their coefficients cost: a swing has many of its own."""
    return [
        (gain - SELECTION.per_parameter * coefficients_of(start.trajectories, term), 0.0, term)
        for gain, term in zip(gains, terms, strict=True)
    ]


def _holds(heldout: Mapping[int, float], terms: Sequence[Term | SensorTerm] = ()) -> bool:
    """Tell whether recordings held out gain enough, half of them anything; where none could be held out it may.

    Of a term whose coefficients each recording has for itself every recording must gain: little else is foretold.
    """
    gains = np.array([*heldout.values()])
    least = 1.0 if any(isinstance(term, SensorTerm) and term.own for term in terms) else 0.5
    return not heldout or bool(2.0 * np.sum(gains) >= UNKNOWN_LAW.held_out and np.mean(gains > 0.0) >= least)


def _key(term: Term | SensorTerm) -> tuple[object, ...]:
    if isinstance(term, SensorTerm):
        return term.sensor, term.kind
    return (
        term.target,
        frozenset(symbol for symbol, _ in term.powers),
        bool(term.decay),
        bool(term.order),
    )


def _spread(ranked: Sequence[tuple[float, float, Term | SensorTerm]]) -> list[tuple[float, float, Term | SensorTerm]]:
    """Return the best few of a ranking, one of each set of symbols: the exponents are the fit's business."""
    chosen: dict[tuple[object, ...], tuple[float, float, Term | SensorTerm]] = {}
    for item in ranked:
        if item[0] > max(SELECTION.entry, UNKNOWN_LAW.worth * ranked[0][0]):
            chosen.setdefault(_key(item[2]), item)
    return list(chosen.values())[: UNKNOWN_LAW.fitted]


def _share(base: Fit, fit: Fit, noise: NoiseModel) -> float:
    """Return the part of the excess of chi2 over the number of readings that a fit takes away, in white noise.

    Noise with a memory weighs the differences of neighbours most, which hold none of what a law explains; noise that
    holds what it explains, as that of a swing from reading to reading, gives way to what the fit leaves.
    """
    left = {
        group: min(item.sd, fit.noise[group].sd) if group in fit.noise else item.sd for group, item in noise.items()
    }
    white = {group: item._replace(sd=left[group], correlation=0.0) for group, item in noise.items()}
    before, after = (sum(chi_squared(linear, white, linear.residual) for linear in one.linears) for one in (base, fit))
    return min((before - after) / max(before - base.count, 1.0), 1.0)


def _priced(fitted: ContinuousFit) -> float:
    """Return a fit's score with what the numbers of its law cost: of laws that do as well the simpler one is taken."""
    return fitted.score + SELECTION.per_parameter * sum(q.group in ("law", "term") for q in fitted.fit.parameters)


def _believed(
    fitted: ContinuousFit,
    terms: tuple[Term, ...] | tuple[SensorTerm, ...],
    base: ContinuousFit,
    at: Mapping[str, float],
    noise: NoiseModel,
) -> FoundLaw | None:
    """Return the law if it gains what it costs, and on recordings that took no part, and explains what there is.

    That is most of the excess, or all that tests of residuals find: beside that a small excess is the scatter of noise.
    """
    if _priced(fitted) + SELECTION.entry > base.score:
        return None
    share = _share(base.fit, fitted.fit, noise)
    heldout, chi2 = _held_out(base.fit, fitted.fit)
    if not _holds(heldout, terms) or (share < UNKNOWN_LAW.share and fitted.unmodelled()):
        return None
    total = sum(heldout.values()) if heldout else None
    about = tuple(term for term in terms if isinstance(term, SensorTerm))
    if about:
        laws, reference = as_sensor_laws(about, fitted.fit, total)
    else:
        laws, reference = as_laws(tuple(t for t in terms if isinstance(t, Term)), fitted.fit, at, total)
    if not laws:
        return None
    words = swinging_in_words(about, fitted.fit)
    return FoundLaw(laws[0], base.score - fitted.score, heldout, share, reference, fitted, laws[1:], chi2, words)
