"""All effects at once that a relaxed fit asks for, where what sensors tell of one another has begun it.

Takes a search that is far from its data; gives the fit with continuity enforced of every ordinary error that the
relaxed fit has moved by more than chance moves it. Where several effects are large each of them alone leaves so much
that no step by step selection comes nearer.
"""

from __future__ import annotations

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from discsim.effects.sensors import Lag
from discsim.validation.diagnosis.selection.candidates import CandidateEffect, free_candidate
from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.selection.evidence import price
from discsim.validation.diagnosis.selection.hypothesis import Hypothesis
from discsim.validation.diagnosis.selection.search_state import Search, far, on_the_disc, possible
from discsim.validation.identification.gauss_newton import Fit

__all__ = ["all_at_once"]

#: most effects at once: those of the consistency stage and the ordinary errors of three sensors that it goes with
_MOST = 8
#: most steps of their fit: they begin where the relaxed fit has them
_STEPS = 12


def all_at_once(found: Search) -> ContinuousFit | None:
    """Return the fit of all effects that a relaxed fit asks for together, None where they are not worth their price."""
    relaxed_fit = found.relaxed_fit
    free = {q.group for q in relaxed_fit.parameters}
    lags = [hint for hint in found.hints if hint.candidate.row.type is Lag and hint.candidate.id in free]
    if not lags or not far(found, found.base):
        return None
    asked = _asked(relaxed_fit, {candidate.id for candidate in found.candidates})
    if not asked:
        return None
    ids = {candidate.id for candidate in asked}
    start = {
        (q.key, q.recordings): float(v)
        for q, v in zip(relaxed_fit.parameters, relaxed_fit.at, strict=True)
        if q.group in ids or q.key in relaxed_fit.plant.own_keys
    }
    if not on_the_disc(found, start):
        return None
    fitted = continuous_fit(
        relaxed_fit, Hypothesis(asked), found.own, found.relaxed_noise, start, iterations=_STEPS, polish=2
    )
    worth = found.base.score - fitted.score > sum(map(price, asked))
    return fitted if worth and possible(fitted) else None


def _asked(fit: Fit, ids: set[str]) -> tuple[CandidateEffect, ...]:
    """Return the effects whose numbers a relaxed fit has moved by more than their price, those that moved most."""
    if fit.covariance.shape[0] != len(fit.parameters):
        return ()
    moved = []
    for id in dict.fromkeys(q.group for q in fit.parameters):
        at = [k for k, q in enumerate(fit.parameters) if q.group == id and q.recordings is None]
        if id not in CATALOGUE or id not in ids or not at or CATALOGUE[id].grid:
            continue
        off = np.array([fit.at[k] - getattr(CATALOGUE[id].baseline, fit.parameters[k].name) for k in at])
        gain = float(off @ np.linalg.lstsq(fit.covariance[np.ix_(at, at)], off, rcond=1e-12)[0])
        candidate = free_candidate(id)
        if gain > price(candidate):
            moved.append((gain, candidate))
    moved.sort(key=lambda item: -item[0])
    return tuple(candidate for _, candidate in moved[:_MOST])
