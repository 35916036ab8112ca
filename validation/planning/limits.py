"""What recordings can show of effects and coefficients: sizes that are seen and named, pairs, standard deviations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.stats import ncx2

from discsim.arrays import FloatArray
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, parameters_of
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.planning.information import Information, inverse

__all__ = ["Coefficient", "EffectLimit", "Limits", "Pair", "coefficients_of", "limits_of", "needed"]

#: a rival that takes all of a trace but this share cannot be told from the effect
_SAME = 1e-4


class EffectLimit(NamedTuple):
    """What recordings show of one effect.

    ``seen`` is the size of each parameter alone at which half of the diagnoses see that something is there, ``named``
    that at which half of them name the effect; infinite where no size does. ``information`` (k, k) is what is known of
    its parameters at zero, ``need`` the noncentrality for each of them that ``named`` stands for. ``rival`` takes the
    share ``taken`` of its trace, the largest of all effects. ``shape`` are the values that shape it.
    """

    id: str
    parameters: tuple[str, ...]
    seen: tuple[float, ...]
    named: tuple[float, ...]
    rival: str
    taken: float
    shape: dict[str, float]
    information: FloatArray
    need: tuple[float, ...]


class Pair(NamedTuple):
    """Two effects of which the second takes a share of the first one's trace, by the parameter that it takes most of.

    They are told apart where the first has ``apart`` times the size that is named; infinite where never. ``visible`` is
    the same over the catalogue's small but visible size: below one, they are told apart before anybody cares.
    """

    id: str
    rival: str
    taken: float
    apart: float
    visible: float


class Coefficient(NamedTuple):
    """A coefficient: its value, its sd with the others as stated, and its sd with all coefficients free together.

    Infinite where the recordings say nothing of it.
    """

    name: str
    value: float
    alone: float
    together: float


@dataclass(frozen=True)
class Limits:
    """What recordings show: each effect, and pairs of effects that are not told apart at the size that is named."""

    effects: tuple[EffectLimit, ...]
    pairs: tuple[Pair, ...]


@cache
def needed(price: float, parameters: int) -> float:
    """Return the noncentrality at which half of all gains in chi-squared exceed a price, so many parameters fitted."""
    if ncx2.median(parameters, 1e-9) >= price:
        return 0.0
    return float(brentq(lambda size: ncx2.median(parameters, size) - price, 1e-9, 10.0 * price + 10.0))


def limits_of(information: Information) -> Limits:
    """Return what recordings show of every effect that is asked about, and which they do not tell apart."""
    candidates = information.questions.candidates
    H = information.left(information.questions.known)
    asked = [_Asked.of(candidate, information, H) for candidate in candidates]
    found, pairs = [], []
    for id in dict.fromkeys(candidate.id for candidate in candidates):
        shape_grid = [one for one in asked if one.candidate.id == id]
        middle = shape_grid[len(shape_grid) // 2]
        limit, mine = _limit(middle, [one for one in asked if one.candidate.id != id], H)
        found.append(limit)
        pairs += mine
    return Limits(tuple(found), tuple(sorted(pairs, key=lambda pair: -pair.apart)))


class _Asked(NamedTuple):
    """A candidate, where its columns stand, and the inverse of its information, its own priors included."""

    candidate: CandidateEffect
    places: list[int]
    inverse: FloatArray

    @classmethod
    def of(cls, candidate: CandidateEffect, information: Information, H: FloatArray) -> _Asked:
        places = information.places(candidate.columns)
        some = parameters_of(candidate, shaped=False)
        prior = np.array([q.sigma**-2.0 if np.isfinite(q.sigma) else 0.0 for q in some])
        return cls(candidate, places, inverse(H[np.ix_(places, places)] + np.diag(prior)))


def _limit(one: _Asked, others: Sequence[_Asked], H: FloatArray) -> tuple[EffectLimit, list[Pair]]:
    """Return what is shown of an effect, and the rivals that it is not told from at the size that is named."""
    own = H[np.ix_(one.places, one.places)]
    power, count = np.maximum(np.diag(own), 0.0), len(parameters_of(one.candidate))
    least = needed(price(one.candidate), len(one.places))
    need = np.full(power.size, least)
    apart: dict[str, FloatArray] = {}
    taken_by: dict[str, FloatArray] = {}
    for other in others:
        cross = H[np.ix_(one.places, other.places)]
        took = np.einsum("ij,jk,ik->i", cross, other.inverse, cross)
        taken = np.clip(took / np.maximum(power, 1e-300), 0.0, 1.0)
        left = np.where(1.0 - taken > _SAME, 1.0 - taken, 0.0)
        more = len(parameters_of(other.candidate)) - count
        with np.errstate(divide="ignore"):
            # a simpler rival stands unless the effect gains what its further parameters cost
            if more < 0:
                need = np.maximum(need, SELECTION.rival * -more / left)
            distance = (SELECTION.confused + SELECTION.per_parameter * max(more, 0)) / left
        id = other.candidate.id
        apart[id] = np.maximum(apart.get(id, np.zeros(power.size)), distance)
        taken_by[id] = np.maximum(taken_by.get(id, np.zeros(power.size)), taken)
    with np.errstate(divide="ignore", invalid="ignore"):
        seen, named = (np.where(power > 0.0, np.sqrt(x / power), np.inf) for x in (np.full(power.size, least), need))
    pairs = _pairs(one.candidate, power, need, apart, taken_by)
    rival = max(taken_by, key=lambda id: float(np.max(taken_by[id])), default="")
    names = tuple(column.name for column in one.candidate.columns)
    limit = EffectLimit(
        one.candidate.id,
        names,
        tuple(seen.tolist()),
        tuple(named.tolist()),
        rival,
        float(np.max(taken_by[rival])) if rival else 0.0,
        one.candidate.shape_grid,
        own,
        tuple(need.tolist()),
    )
    return limit, pairs


def _pairs(
    candidate: CandidateEffect,
    power: FloatArray,
    need: FloatArray,
    apart: Mapping[str, FloatArray],
    taken: Mapping[str, FloatArray],
) -> list[Pair]:
    """Return the rivals that an effect is not told from at the size that is named.

    All are by its parameters: what is known of each, what naming it needs, and what telling it from each rival needs. A
    parameter that nothing shows has no rival. One that no size names, for a simpler rival takes all of its trace, has
    only those that take all of it.
    """
    scales = np.array([candidate.row.fitted_scale[column.name] for column in candidate.columns])
    shown = power > 0.0
    pairs = []
    for id, distance in apart.items():
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.where(np.isinf(distance), np.inf, np.sqrt(distance / need))
            visible = np.sqrt(distance / power) / scales
        later = shown & (times > 1.0)
        if np.any(later):
            worst = int(np.argmax(np.where(later, times, 0.0)))
            sizes = (float(taken[id][worst]), float(times[worst]), float(np.max(visible[later])))
            pairs.append(Pair(candidate.id, id, *sizes))
    return pairs


def coefficients_of(information: Information) -> list[Coefficient]:
    """Return the sd that recordings alone give each coefficient, without what is stated of coefficients."""
    asked = information.questions
    keys = {q.key for q in asked.coefficients}
    H = information.left([q for q in asked.known if q.key not in keys])
    some = information.places([c for c in asked.columns if (c.group, c.name) in keys and not c.given])
    some = _one_each(some, [asked.columns[k].name for k in some])
    own = H[np.ix_(some, some)]
    power = np.diag(own)
    told = power > 0.0
    together = np.full(power.size, np.inf)
    if np.any(told):
        inner = own[np.ix_(told, told)]
        scale = 1.0 / np.sqrt(np.diag(inner))
        w, V = np.linalg.eigh(inner * np.outer(scale, scale))
        # a direction that rounding alone tells is none
        w = np.where(w > 1e-12 * w[-1], w, 0.0)
        with np.errstate(divide="ignore"):
            together[told] = np.sqrt(np.einsum("ij,j->i", V**2, 1.0 / w)) * scale
    values = {q.name: q.stated for q in asked.coefficients}
    names = [asked.columns[k].name for k in some]
    with np.errstate(divide="ignore"):
        alone = np.where(told, 1.0 / np.sqrt(np.maximum(power, 1e-300)), np.inf)
    return [
        Coefficient(name, values[name], float(a), float(b)) for name, a, b in zip(names, alone, together, strict=True)
    ]


def _one_each(places: Sequence[int], names: Sequence[str]) -> list[int]:
    """Return the first place of each name: a stated coefficient has a column of another step, too."""
    return list({name: place for name, place in zip(reversed(names), reversed(places), strict=True)}.values())[::-1]
