"""Chips that are turned alike in their board: the board is turned in the body, and every sensor on it with them.

Takes a search that named a turned gyroscope and a turned magnetometer; gives it with one turn of the whole board in
their place where that explains as much for its numbers. A board that is turned about the axis of the spin shows by the
accelerometer alone: it seems to sit elsewhere, by the turn times its distance from the axis.
"""

from __future__ import annotations

from dataclasses import replace

from discsim.effects.catalogue import catalogued
from discsim.effects.mount_rows import Mount
from discsim.effects.sensors import PositionOffset
from discsim.effects.setup import BoardRotation
from discsim.validation.diagnosis.candidates.candidate import free_candidate
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis, Start
from discsim.validation.diagnosis.selection.search_state import Search, possible, values_of_fit

__all__ = ["with_one_board"]

_BOARD = catalogued(BoardRotation)
_GYRO, _MAG = (catalogued(Mount, sensor).id for sensor in ("gyroscope", "magnetometer"))
_PLACE = catalogued(PositionOffset, "accelerometer").id
#: steps of the fit: the turn about the axis of the spin begins at none
_STEPS = 20


def with_one_board(found: Search) -> Search:
    """Return a search with a turned board in the place of chips that are turned alike, where that explains as much."""
    present = {candidate.id for candidate in found.final.hypothesis.candidates}
    if not {_GYRO, _MAG} <= present or any(q.group == _BOARD.id for q in found.own):
        return found
    simpler = [
        fitted for ids in ({_GYRO, _MAG}, {_GYRO, _MAG, _PLACE}) if ids <= present and (fitted := _turned(found, ids))
    ]
    best = min(simpler, key=_charged, default=None)
    return found if best is None or _charged(best) > _charged(found.final) else replace(found, final=best, rivals={})


def _turned(found: Search, ids: set[str]) -> ContinuousFit | None:
    """Return the fit of one turn of the board in the place of some effects, None where it runs away."""
    final = found.final
    kept = tuple(one for one in final.hypothesis.candidates if one.id not in ids)
    values = values_of_fit(final)
    turn: Start = {((_BOARD.id, name), None): values.get(((_GYRO, name), None), 0.0) for name in _BOARD.parameters}
    hypothesis = Hypothesis((*kept, free_candidate(_BOARD.id)))
    fitted = continuous_fit(final.fit, hypothesis, found.own, final.fit.noise, {**values, **turn}, iterations=_STEPS)
    fitted = found.with_cost(fitted)
    return fitted if possible(fitted) else None


def _charged(fitted: ContinuousFit) -> float:
    """Return the score of a fit with what its effects must gain to be believed."""
    return fitted.score + sum(map(price, fitted.hypothesis.candidates))
