"""The search: from the relaxed fit to the smallest set of effects that leaves nothing but noise.

Proposals come from algebra about a fit that follows the data; each that matters is refitted with pieces that hang
together, and believed only if it gains more than its price by the likelihood, with the noise estimated anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from typing import TypeAlias

import numpy as np

from discsim.recording import Recording
from validation.diagnosis.detectors.all import searched
from validation.diagnosis.detectors.dropped_samples import Shifted, Slips
from validation.diagnosis.relaxed_fit import relaxed, unknowns, without_outliers
from validation.diagnosis.selection.candidates import Trial, parameters_of, trials_for
from validation.diagnosis.selection.constrained_fit import Tied, tied_fit
from validation.diagnosis.selection.evidence import ONE_SIDED, RIVAL, price
from validation.diagnosis.selection.hypothesis import Hypothesis, Start, fitted_parameters
from validation.diagnosis.selection.proposals import Proposal, one_per_effect, pairs, proposals, start_of
from validation.diagnosis.selection.screening import Board, board_of, free_columns
from validation.identification.competing_effects import row_of
from validation.identification.gauss_newton import Fit, merit_of
from validation.identification.noise import NoiseModel, chi_squared, estimate_noise, robust_noise
from validation.identification.parameters import Parameter
from validation.identification.plants import plant_of
from validation.identification.residual_tests import remainders
from validation.identification.stated_parameters import stated_parameters

__all__ = ["Considered", "Rival", "Search", "search"]

Report: TypeAlias = Callable[[str, int, int], None]
#: what is proposed, the fit whose motion a fit of it starts from, and what choosing lost samples costs
Offer: TypeAlias = tuple[Proposal, Fit, float]

#: how many effects are ever added
MOST_EFFECTS = 4
#: how many proposals are refitted at each step, and how many while none comes near the data: far from it, or with two
#: effects at work, algebra ranks many a wrong one before the right one
REFITTED, REFITTED_AT_MOST = 4, 9
#: chi-squared per reading, in the noise of the relaxed fit, below which a fit is near the data
_NEAR = 1.2
#: a refit that will leave this many times the chi-squared of the best one so far is given up
_HOPELESS = 10.0
#: what it counts, in twice the log likelihood, that an effect came out with the sign that physics gives it: a lag and
#: an offset of time are one to first order; of fits that tie to within what a few readings weigh the lag is named
_RIGHT_SIGN = 4.0
#: a refit which expects to stay so much worse than the fit beside it, in chi-squared in the noise of that, is no match
#: for it: no price nor tie comes near
_OUT_OF_REACH = 500.0
#: a gain below this may be due to where the fits started
_DOUBTFUL = 200.0
#: a fit whose chi-squared per reading, in the noise of the relaxed fit, is above this is far from the data
FAR = 1.6


@dataclass(frozen=True)
class Considered:
    """A trial that was refitted: what it gained when it was, by the likelihood and in chi-squared."""

    trial: Trial
    gain: float
    chi2_gain: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class Rival:
    """An effect in the place of a named one: how much worse the likelihood is (twice its logarithm), and the fit."""

    trial: Trial
    worse: float
    tied: Tied


@dataclass
class Search:
    """What the search found: fits of the baseline and of the final hypothesis, and what was considered."""

    recordings: tuple[Recording, ...]
    own: tuple[Parameter, ...]
    loose: Fit
    loose_noise: NoiseModel
    trials: tuple[Trial, ...]
    base: Tied
    final: Tied
    steps: list[Tied] = field(default_factory=list)
    considered: list[Considered] = field(default_factory=list)
    rivals: dict[str, list[Rival]] = field(default_factory=dict)
    board: Board | None = None
    #: readings that were left out: (recording, sensor, axis, time, deviations)
    outliers: list[tuple[int, str, str, float, float]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    #: what the magnetometer's phase told of lost samples, by the relaxed fit that it was asked of
    slips: Slips = field(default_factory=Slips)
    #: what choosing the samples that were lost has cost, in twice the log likelihood
    cost: float = 0.0
    _asked: tuple[Fit, Board] | None = None

    def board_of(self, fit: Fit) -> Board:
        """Return what every effect would do to a fit, in its own noise; of the last fit that was asked it is known."""
        if self._asked is None or self._asked[0] is not fit:
            self._asked = fit, board_of(fit, self.trials, fit.noise, fit.plant.sizes.continuous)
        return self._asked[1]

    def at_base(self) -> Search:
        """Return the search as if nothing had been found."""
        return replace(self, final=self.base)


# a hypothesis far from the data may send a motion beyond all numbers: such a fit is not finite, and is passed over
@np.errstate(over="ignore", invalid="ignore")
def search(
    recordings: Sequence[Recording],
    report: Report = lambda stage, done, total: None,
    as_stated: Sequence[Recording] | None = None,
    followed: Fit | None = None,
    free: Sequence[Parameter] = (),
) -> Search:
    """Find the effects that explain recordings of one plant.

    ``as_stated`` are the same with nothing that stands in for what they do not state, ``followed`` their relaxed fit
    where it is known already; ``free`` are numbers that every fit may move.
    """
    known = (*stated_parameters(recordings), *free)
    own = (*known, *unknowns(recordings))
    report("following the data", 0, 4)
    loose, left_out = without_outliers(relaxed(recordings, known) if followed is None else followed)
    noise = estimate_noise(loose.linears, [linear.residual for linear in loose.linears])
    plant = loose.plant
    given = {q.group for q in free}
    trials = tuple(trial for trial in trials_for(recordings) if trial.id not in given)
    report("asking every effect", 1, 4)
    board = board_of(loose, trials, noise, plant.sizes.continuous)
    report("fitting the baseline", 2, 4)
    start = {**_start(board, Hypothesis(), own), **_wobbles(loose)}
    base = tied_fit(loose, Hypothesis(), own, noise, start, iterations=plant.base_steps)
    if chi2_in(base, noise) < FAR * base.fit.count and base.fit.iterations >= plant.base_steps:
        # beside the data what the baseline has left to gain would pass for what an effect gains
        again = tied_fit(
            base.fit,
            Hypothesis(),
            own,
            base.fit.noise,
            values_of_fit(base),
            iterations=plant.base_steps,
            bar=merit_of(base.fit, base.fit.linears),
        )
        base = min(base, again, key=lambda one: one.score)
    found = Search(tuple(as_stated or recordings), own, loose, noise, trials, base, base)
    found.outliers = left_out
    report("refitting candidates", 3, 4)
    _settle(found, _grown(found, board))
    report("done", 4, 4)
    return found


def _grown(found: Search, board: Board) -> Tied:
    """Return the fit to which effects were added as long as one is worth its price."""
    current = found.base
    for step in range(MOST_EFFECTS):
        better = _next(found, board, current, step)
        if step == 0 and _far(found, current) and (better is None or _far(found, better)) and not _told(better):
            together = _together(found, board)
            if together is not None:
                current = _pruned(found, together)
                found.steps.append(current)
                continue
        if better is None or len(better.hypothesis.trials) > MOST_EFFECTS:
            break
        if step == 0 and _far(found, better) and not _told(better) and _no_nearer(found, current, better):
            # neither one effect nor two come near the data, nor does any lead there
            return better
        again = _from_there(found, current, better)
        if again is not None:
            # it was not the effect that gained, but where its fit had started
            if step == 0:
                found.base = again
            return again
        if step >= 1 and _far(found, better):
            # two effects and still far from the data: none of these
            return better
        current = _pruned(found, better, kept=better.hypothesis.trials[-1])
        found.steps.append(current)
    return current


#: how often a named effect may give way to another, and by how much that must be better than chance makes it: where it
#: has fewer parameters, and where it has as many or more
_EXCHANGES, _SIMPLER, _BETTER = 2, 2.0, 20.0


def _settle(found: Search, final: Tied) -> None:
    """Take a fit as the final one, its effects exchanged for rivals that explain more for their parameters."""
    for exchanges in range(_EXCHANGES + 1):
        found.final = final
        found.board = found.board_of(final.fit)
        # where the fit is far from the data nothing is named, and nothing need be told apart
        found.rivals = {} if _lost(found, final) else _rivals(found)
        better = _exchanged(found)
        if better is None or exchanges == _EXCHANGES:
            return
        final = better
        found.steps.append(final)


def _start(board: Board, hypothesis: Hypothesis, own: Sequence[Parameter]) -> Start:
    """Return what algebra expects of a hypothesis's parameters."""
    taken = board.columns_of(fitted_parameters(hypothesis, own))
    return start_of(taken, board.ask(taken))


def _wobbles(fit: Fit) -> Start:
    """Return how the wobble of free spins dies and turns in a fit whose pieces go with it.

    What algebra expects of it is far from linear where turning for a second makes a radian.
    """
    parameters = zip(fit.parameters, fit.at, strict=True)
    return {(q.key, q.recordings): float(v) for q, v in parameters if q.key in fit.plant.own_keys}


def values_of_fit(tied: Tied) -> Start:
    """Return the values of a fit's parameters as a start for another."""
    return {(q.key, q.recordings): float(v) for q, v in zip(tied.fit.parameters, tied.fit.at, strict=True)}


def chi2_in(tied: Tied, noise: NoiseModel) -> float:
    """Return the chi-squared of a fit's residuals in a given noise."""
    return sum(
        chi_squared(linear, noise, residual) for linear, residual in zip(tied.fit.linears, tied.residuals, strict=True)
    )


def _far(found: Search, tied: Tied) -> bool:
    """Tell whether a fit is far from the data."""
    return chi2_in(tied, found.loose_noise) > FAR * tied.fit.count


def _lost(found: Search, tied: Tied) -> bool:
    """Tell whether a fit is far from the data and leaves what is no noise: no answer rests on it."""
    return _far(found, tied) and bool(remainders(tied.fit.linears, tied.residuals, tied.fit.noise))


#: chi-squared per reading, in the noise that it shows, up to which the relaxed fit follows the data
_FOLLOWED = 2.0
#: an effect that leaves more than this share of the baseline's chi-squared leads no nearer to the data: of two that
#: are hidden the larger leaves half of it, or less
_NO_NEARER = 0.7


def _no_nearer(found: Search, before: Tied, after: Tied) -> bool:
    """Tell whether one fit is not much nearer to the data than another."""
    return chi2_in(after, found.loose_noise) > _NO_NEARER * chi2_in(before, found.loose_noise)


def misses(found: Search, tied: Tied) -> bool:
    """Tell whether a fit is far from data that the relaxed fit follows: whatever it holds, something is missing."""
    return _far(found, tied) and found.loose.merit < _FOLLOWED * found.loose.count


def _told(tied: Tied | None) -> bool:
    """Tell whether a fit's last effect was found in the readings themselves and is in its chains."""
    return tied is not None and bool(tied.hypothesis.trials[-1].told)


def _next(found: Search, board: Board, current: Tied, step: int) -> Tied | None:
    """Return the fit with the best further effect, or None where none is worth its price."""
    noise = found.loose_noise
    chi2_now = chi2_in(current, noise)
    far = chi2_now > FAR * current.fit.count
    # what is asked of the relaxed fit, and of the present one
    there: list[Offer] = []
    here: list[Offer] = []
    if far or step == 0:
        ranked = one_per_effect(proposals(board, found.trials, current.hypothesis, found.own))
        # beside the data a refit goes on from the present fit: from the pieces it would have to be tied again
        there += [(p, found.loose, 0.0) if far else (_from_here(p, current), current.fit, 0.0) for p in ranked]
    if not far or step > 0:
        near = found.board_of(current.fit)
        here += [
            (_from_here(p, current), current.fit, 0.0)
            for p in one_per_effect(proposals(near, found.trials, current.hypothesis, found.own))
        ]
    for item in searched(found.loose, current, found.own, _steady_noise(found), found.slips):
        if isinstance(item, Shifted):
            there.append((item.proposal, replace(found.loose, chains=item.chains), item.cost))
        elif current.hypothesis.trials:
            here.append((item, found.loose if far else current.fit, 0.0))
        else:
            there.append((item, found.loose, 0.0))
    # far from the data the two are asked in different noise: what they gain does not compare
    there, here = ([offer for offer in some if _on_the_disc(found, offer[0].start)] for some in (there, here))
    worth = _in_turn(there, here) if far and step > 0 else _in_turn([*there, *here])
    fits: list[tuple[float, Tied, Fit, float]] = []
    seen: set[tuple[str, frozenset[int] | None]] = set()
    near_data = chi2_now < _NEAR * current.fit.count
    best_chi2, merit_now = chi2_now, merit_of(current.fit, current.fit.linears)
    for proposal, fit, cost in worth:
        key = (proposal.trial.id, proposal.trial.recordings)
        if key in seen:
            continue
        if len(seen) >= (REFITTED if near_data else REFITTED_AT_MOST):
            break
        seen.add(key)
        if proposal.trial.id == "accel.saturation":
            # readings at the limit take no part in a fit: what the motion asks for beyond it is the evidence
            cost = -proposal.gain
        # beside the data it must gain half its price, as algebra said it would; where other readings take part that
        # cannot be seen
        beside = np.inf if cost else merit_now - 0.5 * price(proposal.trial)
        refitted = tied_fit(
            fit,
            current.hypothesis.plus(proposal.trial),
            found.own,
            noise if far else current.fit.noise,
            {**values_of_fit(current), **proposal.start, **_wobbles(fit)},
            bar=_HOPELESS * best_chi2 if far else beside,
        )
        refitted = replace(refitted, score=refitted.score + found.cost + cost)
        gain, chi2 = _consider(found, (current.score, chi2_now), refitted, proposal.trial)
        if gain > price(proposal.trial) and _possible(refitted):
            # far from the data chi-squared says more than a likelihood that has swallowed the mismatch as noise
            merit = (chi2 + cost if far else refitted.score) + RIVAL * refitted.hypothesis.size
            merit -= _RIGHT_SIGN * any(q.key in ONE_SIDED for q in parameters_of(proposal.trial))
            fits.append((merit, refitted, fit, cost))
            best_chi2 = min(best_chi2, chi2)
            near_data |= chi2 < _NEAR * refitted.fit.count
    if not fits:
        return None
    _, best, fit, cost = min(fits, key=lambda item: item[0])
    found.cost += cost
    if cost > 0:
        found.loose = replace(found.loose, chains=fit.chains)
    return best


def _in_turn(*offers: Sequence[Offer]) -> list[Offer]:
    """Return offers that may be worth their price, from each list the best in turn."""

    def later(offer: Offer) -> tuple[bool, float]:
        # lost samples first: they bend what algebra says of everything else
        return offer[2] <= 0.0, RIVAL * len(parameters_of(offer[0].trial)) - offer[0].gain

    worth = [sorted((o for o in some if o[0].gain > 0.5 * price(o[0].trial)), key=later) for some in offers]
    return [offer for turn in zip_longest(*worth) for offer in turn if offer is not None]


def _on_the_disc(found: Search, start: Start) -> bool:
    """Tell whether a start has no centre of mass off the disc.

    Of recordings in which that hardly shows algebra asks for any number, under which no motion lasts. A sensor's place
    that nothing shows, as along the axis of a table, does no harm.
    """
    radius = _radius(found.recordings[0])
    return all(abs(number) <= radius for (key, _), number in start.items() if _is_place(key[0], "motion"))


def _is_place(id: str, acts_on: str | None = None) -> bool:
    """Tell whether an effect's parameters are distances from the disc's centre or from another place on it, m.

    With ``acts_on`` only where it acts on that.
    """
    row = row_of(id)
    return row is not None and row.on_disc and acts_on in (None, row.acts_on)


def _radius(recording: Recording) -> float:
    return np.inf if recording.disc is None else 0.5 * recording.disc.diameter


def _consider(found: Search, before: tuple[float, float], refitted: Tied, trial: Trial) -> tuple[float, float]:
    """Note what a trial gains upon a fit of score and chi-squared ``before``; return gain and chi-squared left."""
    score, chi2_before = before
    gain = score - refitted.score
    chi2 = chi2_in(refitted, found.loose_noise)
    values = {
        q.name: float(v)
        for q, v in zip(refitted.fit.parameters, refitted.fit.at, strict=True)
        if q.group == trial.id and q.recordings == trial.recordings
    }
    found.considered.append(Considered(trial, gain, chi2_before - chi2, values))
    return gain, chi2


#: how many pairs of effects are refitted where no effect alone comes near the data
_PAIRS_REFITTED = 5


def _together(found: Search, board: Board) -> Tied | None:
    """Return the fit with the best two effects where it comes near the data, else None.

    Far from the data each of two effects alone may be fitted with numbers that serve for both, and a third may do
    better than either; algebra about the fit that follows the data tells both at once.
    """
    base, noise = found.base, found.loose_noise
    before = base.score, chi2_in(base, noise)
    sensible = [pair for pair in pairs(board, found.trials, found.own) if _on_the_disc(found, pair.start)]
    for pair in sensible[:_PAIRS_REFITTED]:
        start = {**pair.start, **_wobbles(found.loose)}
        # it counts only where it comes near the data
        both = tied_fit(
            found.loose, pair.hypothesis, found.own, noise, start, bar=_HOPELESS * FAR * found.base.fit.count
        )
        both = replace(both, score=both.score + found.cost)
        for trial in pair.hypothesis.trials:
            _consider(found, before, both, trial)
        worth = base.score - both.score > sum(map(price, pair.hypothesis.trials))
        if worth and _possible(both) and not _far(found, both):
            return both
    return None


#: where most readings lie within this many times the stated noise, what raises its level is short
_SHORT = 2.0


def _steady_noise(found: Search) -> NoiseModel:
    """Return the noise in which events are looked for: without what a short one adds, where most readings are well."""
    linears = found.loose.linears
    steady = robust_noise(linears, [linear.residual for linear in linears])
    stated = {c.group: float(linear.sd[c.rows][0]) for linear in linears for c in linear.channels}
    well = all(not np.isfinite(stated[group]) or noise.sd < _SHORT * stated[group] for group, noise in steady.items())
    return steady if well else found.loose_noise


def tried_without(found: Search, trial: Trial) -> Tied:
    """Return the fit of the final hypothesis without one of its effects."""
    final = found.final
    rest = final.hypothesis.without(trial)
    if not rest.trials:
        return found.base
    for step in found.steps:
        if set(step.hypothesis.trials) == set(rest.trials):
            return step
    return tied_fit(found.loose, rest, found.own, found.loose_noise, values_of_fit(final), iterations=5, polish=1)


def _from_there(found: Search, current: Tied, better: Tied) -> Tied | None:
    """Return the fit without the last effect from where that with it stands, if then the effect is not worth its price.

    None where it is, or where it gains so much that no start could.
    """
    trial = better.hypothesis.trials[-1]
    if current.score - better.score > _DOUBTFUL or not found.loose.plant.weakly_identified:
        return None
    start = values_of_fit(better)
    again = tied_fit(better.fit, current.hypothesis, found.own, better.fit.noise, start)
    again = replace(again, score=again.score + found.cost)
    return again if again.score - better.score < price(trial) else None


def _from_here(proposal: Proposal, current: Tied) -> Proposal:
    """Return a proposal whose start keeps what the fit has found for everything else."""
    own = {key: value for key, value in proposal.start.items() if key[0][0] == proposal.trial.id}
    return replace(proposal, start={**values_of_fit(current), **own})


def _possible(tied: Tied) -> bool:
    """Tell whether a fit's parameters make sense.

    Friction does not drive, an event is told from the start, neither a sensor nor the centre of mass lies off the disc.
    """
    sd = np.sqrt(np.maximum(np.diag(tied.fit.covariance), 0.0))
    recording = tied.fit.chains[0].recording
    radius = _radius(recording)
    for q, value, error in zip(tied.fit.parameters, tied.fit.at, sd, strict=True):
        if q.key in ONE_SIDED and ONE_SIDED[q.key] * value < -3.0 * error:
            return False
        if q.key == ("event.spin_step", "t_s") and value < plant_of(recording).durations.event_from:
            return False
        if _is_place(q.group) and abs(value) - 3.0 * error > radius:
            return False
    return True


def _pruned(found: Search, current: Tied, kept: Trial | None = None) -> Tied:
    """Leave out effects that the others have made superfluous, but for one that is ``kept``."""
    while len(current.hypothesis.trials) > 1:
        weakest: Tied | None = None
        for trial in current.hypothesis.trials:
            if trial.told or trial is kept:  # what is told is kept in the chains whatever the hypothesis says
                continue
            less = tied_fit(
                current.fit,
                current.hypothesis.without(trial),
                found.own,
                current.fit.noise,
                values_of_fit(current),
                bar=merit_of(current.fit, current.fit.linears) + _OUT_OF_REACH,
            )
            less = replace(less, score=less.score + found.cost)
            if less.score - current.score < price(trial) and (weakest is None or less.score < weakest.score):
                weakest = less
        if weakest is None:
            return current
        current = weakest
    return current


#: rivals that algebra finds worse than this in chi-squared, and than this share of what the effect gains, are none
_WORST, _WORST_SHARE = 60.0, 0.05


def _rivals(found: Search) -> dict[str, list[Rival]]:
    """Return the effects that could stand in for a named one, by its name."""
    final = found.final
    board = found.board
    assert board is not None
    rivals: dict[str, list[Rival]] = {}
    for trial in final.hypothesis.trials:
        if trial.told:  # found in the readings themselves, and kept in the chains: nothing else could do it from there
            continue
        rest = final.hypothesis.without(trial)
        taken = board.columns_of(fitted_parameters(rest, found.own))
        best = board.ask(board.columns_of(fitted_parameters(final.hypothesis, found.own))).chi2
        # of a large effect algebra knows the last percents badly
        without = board.ask(taken).chi2
        worst = max(_WORST, _WORST_SHARE * (without - best))
        near = []
        for other in found.trials:
            if other.id == trial.id or any(other.id == t.id for t in rest.trials):
                continue
            scoped = replace(other, recordings=trial.recordings)
            asked = [*taken, *free_columns(scoped)]
            answer = board.ask(asked)
            near.append(
                (answer.chi2 - best, Proposal(scoped, without - answer.chi2, start_of(asked, answer, (scoped,))))
            )
        near.sort(key=lambda item: item[0])
        rivals[trial.name] = []
        seen: set[str] = set()
        for worse, proposal in near:
            scoped = proposal.trial
            if scoped.id in seen or worse > worst or len(seen) >= 3:
                continue
            seen.add(scoped.id)
            other_fit = tied_fit(
                final.fit,
                rest.plus(scoped),
                found.own,
                final.fit.noise,
                _from_here(proposal, final).start,
                bar=merit_of(final.fit, final.fit.linears) + _OUT_OF_REACH,
            )
            other_fit = replace(other_fit, score=other_fit.score + found.cost)
            rivals[trial.name].append(Rival(scoped, other_fit.score - final.score, other_fit))
    return rivals


def _exchanged(found: Search) -> Tied | None:
    """Return the fit with a rival in the place of a named effect where that explains more for its parameters.

    An effect that was taken up while another was missing may have been the one that bends most, not the right one; and
    with the right one in its place others may be superfluous, which together with it stood in for that.
    """
    better = []
    size = found.final.hypothesis.size
    for trial in found.final.hypothesis.trials:
        for rival in found.rivals.get(trial.name, []):
            if not _possible(rival.tied):
                continue
            more = len(parameters_of(rival.trial)) - len(parameters_of(trial))
            merit = rival.worse + RIVAL * more
            if merit < -(_SIMPLER if more < 0 else _BETTER):
                better.append((merit, rival.tied))
            elif size > 1 and rival.worse < _BETTER:
                fewer = _pruned(found, rival.tied, kept=rival.trial)
                merit = fewer.score - found.final.score + RIVAL * (fewer.hypothesis.size - size)
                if len(fewer.hypothesis.trials) < len(found.final.hypothesis.trials) and merit < -_SIMPLER:
                    better.append((merit, fewer))
    return min(better, key=lambda item: item[0])[1] if better else None
