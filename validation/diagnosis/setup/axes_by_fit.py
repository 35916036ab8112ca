"""Axes that no relation between sensors shows, told by fits.

Without a magnetometer, or with one alone, nothing that holds whatever the air does tells how columns lie; a motion of
the plant does. Takes findings; gives them with the axes of one sensor that short fits of a flight, or a fit of
everything, bear out, and which other axes these recordings cannot tell from them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Effect, effect_of
from discsim.effects.kind import BOARD
from discsim.effects.setup import Axes, axes_of
from discsim.recording import Recording
from discsim.validation.diagnosis.setup.faults import SetupFault, SetupFindings, effect_of_hypothesis, with_fault
from discsim.validation.diagnosis.setup.hypotheses import MOST_TWINS, TWIN, Hypothesis, chosen, hypotheses
from discsim.validation.diagnosis.setup.judged import judgeable
from discsim.validation.diagnosis.setup.proof import left_by_short_fit
from discsim.validation.identification.plants import plant_of
from discsim.written import corrected

__all__ = ["with_axes_of_signs", "with_axes_that_follow"]

#: what follows leaves less than this many times the best: a merit per reading of a thousand readings scatters by
#: sqrt(2 / 1000), of which this is two
_ALIKE = 1.1
#: a short fit that leaves more than this per reading follows nothing
_FOLLOWS = 2.0


def with_axes_that_follow(findings: SetupFindings, sensors: Collection[str]) -> SetupFindings | None:
    """Return findings of flights with the axes of one of some sensors that a motion follows; None where none does.

    Tried are those that the relations between sensors cannot tell from the axes as they are, first those that leave
    the spin where it is.
    """
    recordings = [judgeable(one) for one in findings.recordings]
    if not all(one.samples for one in recordings) or not plant_of(recordings[0]).air_modelled:
        return None
    ranking = hypotheses(recordings)
    known = 0.0 if ranking.as_written is None else ranking.as_written.cost
    unseen = [one for one in ranking.found if one.kind == "axes" and one.sensor in sensors and one.sensor in BOARD]
    unseen = [one for one in unseen if one.cost < known + TWIN]
    some, site = chosen(recordings), recordings[0].environment.magnetic_field
    for upright in (True, False):
        tried = [one for one in unseen if _leaves_axis(one) is upright]
        effects = _effects(tried, site)
        left = [left_by_short_fit([corrected(one, [effect]) for one in some]) for effect in effects]
        if left and min(left) < _FOLLOWS:
            alike = [k for k in range(len(left)) if left[k] < _ALIKE * min(left)]
            best, *others = sorted(alike, key=lambda k: (tried[k].size, left[k]))
            return _with(findings, effects[best], [effects[k] for k in others])
    return None


def _leaves_axis(item: Hypothesis) -> bool:
    """Tell whether a sensor's columns under a hypothesis have the spin axis where they have it as written."""
    return bool(abs(item.columns.of(item.sensor)[2, 2]) > 0.5)


def _with(findings: SetupFindings, effect: Effect, twins: Sequence[Effect]) -> SetupFindings:
    """Return findings with one more fault that a fit tells, and what is as likely."""
    fault = SetupFault(effect, float("inf"), None, tuple(twins))
    current = tuple(corrected(one, [effect]) for one in findings.recordings)
    return SetupFindings(tuple(with_fault(findings.faults, fault)), current, findings.hints)


def with_axes_of_signs(findings: SetupFindings, signs: Mapping[str, FloatArray]) -> SetupFindings:
    """Return findings with the axes of sensors that a fit has found to read -1 times what they should.

    ``signs`` (3,) are by sensor. A disc is round: what turns all sensors of the board by half a turn about its axis is
    no other setup, and of the two the one is told in which fewer sensors are at fault.
    """
    board = {name: signs.get(name, np.ones(3)) for name in BOARD if any(name in one for one in findings.recordings)}
    half = np.array([-1.0, -1.0, 1.0])
    turned = {name: own * half for name, own in board.items()}
    fewest = min((board, turned), key=lambda one: sum(bool(np.any(own < 0.0)) for own in one.values()))
    for sensor, own in fewest.items():
        if np.any(own < 0.0):
            effect = effect_of(Axes(axes_of(np.diag(own))), sensor)
            findings = _with(findings, effect, _twins(findings.recordings, effect))
    return findings


def _twins(recordings: Sequence[Recording], effect: Effect) -> list[Effect]:
    """Return what else the axes of a sensor may be, which neither relations nor, in a flight, the air can tell."""
    some = [judgeable(one) for one in recordings]
    if not all(one.samples for one in some):
        return []
    site = some[0].environment.magnetic_field
    own = [one for one in hypotheses(some).found if (one.kind, one.sensor) == ("axes", effect.row.acts_on)]
    named = next((one for one in own if effect_of_hypothesis(one, site) == effect), None)
    if named is None:
        return []
    tied = [one for one in own if one is not named and abs(one.cost - named.cost) < TWIN]
    if tied and plant_of(some[0]).air_modelled:
        flown = chosen(some)
        left = [left_by_short_fit([corrected(one, [e]) for one in flown]) for e in _effects([named, *tied], site)]
        tied = [one for one, leaves in zip(tied, left[1:], strict=True) if leaves < _ALIKE * left[0]]
    return _effects(tied, site)[:MOST_TWINS]


def _effects(items: Sequence[Hypothesis], site: FloatArray) -> list[Effect]:
    return [effect_of_hypothesis(one, site) for one in items]
