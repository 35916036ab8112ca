"""Axes and times that no relation between sensors shows, told by fits.

Without a magnetometer, or with one alone, nothing that holds whatever the air does tells how columns lie and whether
two sensors count from one instant; a motion of the plant does. Takes findings; gives them with the fault of one sensor
that short fits of a flight, or a fit of everything, bear out, and what else these recordings cannot tell from it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Effect, effect_of
from discsim.effects.kind import BOARD
from discsim.effects.setup import Axes, TimeOffset, axes_of
from discsim.recording import Recording
from discsim.validation.diagnosis.setup.faults import SetupFindings, effect_of_hypothesis, told_fault
from discsim.validation.diagnosis.setup.hypotheses import MOST_TWINS, TWIN, Hypothesis, chosen, hypotheses
from discsim.validation.diagnosis.setup.judged import judgeable
from discsim.validation.diagnosis.setup.proof import left_by_short_fit, short_fit
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import plant_of
from discsim.written import corrected

__all__ = ["with_axes_as_read", "with_fault_that_follows"]

#: what follows leaves less than this many times the best: a merit per reading of a thousand readings scatters by
#: sqrt(2 / 1000), of which this is two
_ALIKE = 1.1
#: ... or leaves so many times less than the columns as written and all others: with another error beside, as a clock
#: that is 0.6 % off, reversed columns left 5.3 a reading, those as written 464 and the next 335
_CLEARLY = 20.0
#: sensors whose times are told by fits where there is no magnetometer; the offsets that are tried, s: as far as phases
#: are asked, at twice what a fit moves one by with ease (a radian at a throw's 50 rad/s); and the step of its slope
_TIMED = ("accelerometer", "gyroscope")
_WITHIN, _TIME_STEP = 0.01, 1e-5
_OFFSETS = np.arange(-7, 8) * 2.0 * _WITHIN
#: a short fit that leaves more than this per reading follows nothing
_FOLLOWS = 2.0


def with_fault_that_follows(findings: SetupFindings, sensors: Collection[str]) -> SetupFindings | None:
    """Return findings of flights with the axes, or the times, of one of some sensors that a motion follows.

    None where no motion follows any. Tried are axes that the relations between sensors cannot tell from those as they
    are, first those that leave the spin where it is; and where no phase of a field tells them, offsets of time.
    """
    recordings = [judgeable(one) for one in findings.recordings]
    if not all(one.samples for one in recordings) or not plant_of(recordings[0]).air_modelled:
        return None
    ranking = hypotheses(recordings)
    known = 0.0 if ranking.as_written is None else ranking.as_written.cost
    unseen = [one for one in ranking.found if one.kind == "axes" and one.sensor in sensors and one.sensor in BOARD]
    unseen = [one for one in unseen if one.cost < known + TWIN]
    some, site = chosen(recordings), recordings[0].environment.magnetic_field
    as_written = left_by_short_fit(some)
    for upright in (True, False):
        tried = [one for one in unseen if _leaves_axis(one) is upright]
        effects = _effects(tried, site)
        left = [left_by_short_fit([corrected(one, [effect]) for one in some]) for effect in effects]
        if left and (min(left) < _FOLLOWS or _CLEARLY * min(left) < min([as_written, *sorted(left)[1:2]])):
            alike = [k for k in range(len(left)) if left[k] < _ALIKE * min(left)]
            best, *others = sorted(alike, key=lambda k: (tried[k].size, left[k]))
            return findings.plus(told_fault(effects[best], [effects[k] for k in others]))
    return _with_times(findings, some) if {*sensors} & {*_TIMED} else None


def _with_times(findings: SetupFindings, some: Sequence[Recording]) -> SetupFindings | None:
    """Return findings with the offset of a sensor's times that a motion follows; None where none does, or phases tell.

    Of two sensors either may be off against the other: how the path goes on tells which.
    """
    if any("magnetometer" in one for one in some) or not all(name in one for name in _TIMED for one in some):
        return None
    found = []
    for sensor in _TIMED:
        late = effect_of(TimeOffset(0.0), sensor)
        free = (Parameter(late.id, "offset_s", 0.0, _TIME_STEP, _WITHIN),)
        for offset in _OFFSETS:
            tried = effect_of(TimeOffset(float(offset)), sensor)
            fit = short_fit([corrected(one, [tried]) for one in some], free)
            found.append((fit, effect_of(TimeOffset(float(offset) + fit.at["offset_s"]), sensor)))
    best, effect = min(found, key=lambda one: one[0].merit)
    if best.left > _FOLLOWS:
        return None
    alike = [one for one in found if one[0].left < _ALIKE * best.left and one[1].id != effect.id]
    return findings.plus(told_fault(effect, [min(alike, key=lambda one: one[0].merit)[1]] if alike else []))


def _leaves_axis(item: Hypothesis) -> bool:
    """Tell whether a sensor's columns under a hypothesis have the spin axis where they have it as written."""
    return bool(abs(item.columns.of(item.sensor)[2, 2]) > 0.5)


def with_axes_as_read(findings: SetupFindings, reads: Mapping[str, FloatArray]) -> SetupFindings:
    """Return findings with the axes of sensors that a fit has found to read other axes than they should.

    ``reads`` (3, 3) are by sensor the signed permutations that take true axes to columns. A disc is round: what turns
    all sensors of the board by half a turn about its axis is no other setup, and of the two the one is told in which
    fewer sensors are at fault.
    """
    board = {name: reads.get(name, np.eye(3)) for name in BOARD if any(name in one for one in findings.recordings)}
    half = np.diag([-1.0, -1.0, 1.0])
    turned = {name: own @ half for name, own in board.items()}
    fewest = min((board, turned), key=lambda one: sum(not np.array_equal(own, np.eye(3)) for own in one.values()))
    for sensor, own in fewest.items():
        if not np.array_equal(own, np.eye(3)):
            effect = effect_of(Axes(axes_of(own)), sensor)
            findings = findings.plus(told_fault(effect, _twins(findings.recordings, effect)))
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
