"""Effects that give way: to none where others make them superfluous, to all recordings, or to a better rival.

Backward elimination and exchange steps of a stepwise selection by likelihood; each refit starts from the present fit.
"""

from __future__ import annotations

from dataclasses import replace

from validation.diagnosis.selection.candidates import Trial, parameters_of
from validation.diagnosis.selection.constrained_fit import Tied, tied_fit
from validation.diagnosis.selection.evidence import price
from validation.diagnosis.selection.found import Rival, Search, from_here, lost, possible, values_of_fit
from validation.diagnosis.selection.hypothesis import fitted_parameters
from validation.diagnosis.selection.proposals import Proposal, scope_price, start_of
from validation.diagnosis.selection.screening import free_columns
from validation.diagnosis.settings import SELECTION
from validation.identification.gauss_newton import merit_of

__all__ = ["exchanged", "pruned", "rivals_of", "takes_its_place", "widened"]


def widened(found: Search, final: Tied) -> Tied:
    """Return a fit with effects that were proposed for one recording in all, where nothing speaks against that.

    Recordings share their hardware and their air. Algebra at a shape that is not the true one, as a stall's angle, may
    see an effect in the one recording that shows it and something else in the others.
    """
    if lost(found, final):
        return final
    for trial in final.hypothesis.trials:
        if trial.recordings is None or trial.told or trial.row.event:
            continue
        everywhere = replace(trial, recordings=None)
        present = values_of_fit(final)
        start = {(key, None if key[0] == trial.id else some): number for (key, some), number in present.items()}
        wide = tied_fit(
            final.fit,
            final.hypothesis.without(trial).plus(everywhere),
            found.own,
            final.fit.noise,
            start,
            bar=merit_of(final.fit, final.fit.linears) + SELECTION.out_of_reach,
        )
        wide = replace(wide, score=wide.score + found.cost)
        if wide.score - final.score < scope_price(len(found.recordings)) and possible(wide):
            final = wide
    return final


def pruned(found: Search, current: Tied, kept: Trial | None = None) -> Tied:
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
                bar=merit_of(current.fit, current.fit.linears) + SELECTION.out_of_reach,
            )
            less = replace(less, score=less.score + found.cost)
            if less.score - current.score < price(trial) and (weakest is None or less.score < weakest.score):
                weakest = less
        if weakest is None:
            return current
        current = weakest
    return current


def rivals_of(found: Search) -> dict[str, list[Rival]]:
    """Return the effects that could stand in for a named one, by its name."""
    final = found.final
    board = found.board
    rivals: dict[str, list[Rival]] = {}
    for trial in final.hypothesis.trials:
        if trial.told:  # found in the readings themselves, and kept in the chains: nothing else could do it from there
            continue
        rest = final.hypothesis.without(trial)
        taken = board.columns_of(fitted_parameters(rest, found.own))
        best = board.ask(board.columns_of(fitted_parameters(final.hypothesis, found.own))).chi2
        # of a large effect algebra knows the last percents badly
        without = board.ask(taken).chi2
        worst = max(SELECTION.worst, SELECTION.worst_share * (without - best))
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
                from_here(proposal, final).start,
                bar=merit_of(final.fit, final.fit.linears) + SELECTION.out_of_reach,
            )
            other_fit = replace(other_fit, score=other_fit.score + found.cost)
            rivals[trial.name].append(Rival(scoped, other_fit.score - final.score, other_fit))
    return rivals


def _merit(worse: float, rival: Trial, trial: Trial) -> float:
    """Return by how much a rival's score is worse than that of an effect, each charged for its parameters."""
    return worse + SELECTION.rival * (len(parameters_of(rival)) - len(parameters_of(trial)))


def takes_its_place(worse: float, rival: Trial, trial: Trial) -> bool:
    """Tell whether a rival explains more for its parameters than an effect, whose score it is ``worse`` than."""
    simpler = len(parameters_of(rival)) < len(parameters_of(trial))
    return _merit(worse, rival, trial) < -(SELECTION.simpler if simpler else SELECTION.better)


def exchanged(found: Search) -> Tied | None:
    """Return the fit with a rival in the place of a named effect where that explains more for its parameters.

    An effect that was taken up while another was missing may have been the one that bends most, not the right one; and
    with the right one in its place others may be superfluous, which together with it stood in for that.
    """
    better = []
    size = found.final.hypothesis.size
    for trial in found.final.hypothesis.trials:
        for rival in found.rivals.get(trial.name, []):
            if not possible(rival.tied):
                continue
            if takes_its_place(rival.worse, rival.trial, trial):
                better.append((_merit(rival.worse, rival.trial, trial), rival.tied))
            elif size > 1 and rival.worse < SELECTION.better:
                fewer = pruned(found, rival.tied, kept=rival.trial)
                merit = fewer.score - found.final.score + SELECTION.rival * (fewer.hypothesis.size - size)
                if len(fewer.hypothesis.trials) < len(found.final.hypothesis.trials) and merit < -SELECTION.simpler:
                    better.append((merit, fewer))
    return min(better, key=lambda item: item[0])[1] if better else None
