"""Setup faults, found before anything is fitted: units, axes, offsets of time, a turned board, another field.

Takes recordings of one hardware; gives the faults that make their sensors agree, each as an effect of the catalogue
with what it gains and what else would do as well, and the recordings as they were meant. Sound recordings come back as
they are: a fault is named only where the sensors contradict one another as written, and agree with it.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Effect, effect_of
from discsim.effects.sensors import ClockRate, HardIron, Lag
from discsim.effects.setup import TimeOffset
from discsim.recording import Recording
from discsim.validation.diagnosis.setup.faults import (
    LateFault,
    SetupFault,
    SetupFindings,
    SuspectedFault,
    effect_of_hypothesis,
    told_fault,
    with_fault,
)
from discsim.validation.diagnosis.setup.hypotheses import (
    LATEST,
    MOST_TWINS,
    TWIN,
    Hypothesis,
    Ranking,
    beside_physics,
    board_effect,
    chosen,
    hypotheses,
    pairs,
)
from discsim.validation.diagnosis.setup.judged import judgeable
from discsim.validation.diagnosis.setup.late_sensor import SHORTEST, LateSensor, late_sensor
from discsim.validation.diagnosis.setup.proof import REFUTED, left_by_short_fit, told_apart
from discsim.validation.diagnosis.setup.reference import believed, reference_doubts
from discsim.validation.diagnosis.setup.remedy import place_instead, remedy
from discsim.validation.diagnosis.setup.rotation import board_turns, spin_axis
from discsim.validation.diagnosis.setup.told_by_fit import with_fault_that_follows
from discsim.validation.diagnosis.setup.units import clock_doubts, clock_unit, sensor_units
from discsim.validation.identification.plants import Plant, plant_of
from discsim.written import corrected, require_seconds

__all__ = [
    "find_setup_faults",
    "may_be_physics",
    "setup_notes",
    "suspected_fault",
    "with_likeliest_fault",
    "with_turned_board",
]

#: what a fault must gain, in twice the log likelihood of the relations between sensors; on 40 concealed sets of all
#: kinds the largest gain of a fault that is not there is 15 (lost samples of a magnetometer), the next 0.3
PRICE = 30.0
#: what it must gain in a flight where a short fit bears it out
_PRICE_IN_AIR = 15.0
#: what makes a suspicion of it, as one short throw may: above all but one of those 40
_SUSPECT = 15.0
#: sensors agree where the cost per independent statement is below this; sound sets have 0.02 to 0.25
AGREE, SOUND = 0.6, 0.25
#: what a fault beside other physics leaves at most of the cost as written; 45 concealed ones leave 0.34 or are sound
#: after them, and a false one left 0.93
MENDS = 0.6
#: no relation may be left to hold worse than this, cost per statement: 7 ordinary errors. A turned board that empties a
#: gyroscope of clipped readings can hide lost samples at the price of 36 ordinary errors in another relation
WORST = 2.1
#: a turned board leaves statements unasked where it makes gaps of what clips: those of two sensors in three where less
#: than this share is asked
ASKED = 0.67
#: a board is turned whose gyroscope and magnetometer see the spin this far off the board's z, rad, and apart by less
#: than this share of it: a wobble that dies moves an axis by 0.003, a soft iron of some per cent the field's by 0.02
_TILTED, _ALIKE = 0.02, 0.5
#: the same on a rig, where a fault that is not there would stand beside all that is sought: five ordinary cross-axis
#: errors of 0.02
_TILTED_RIG = 0.1
#: most faults of one setup that are looked for
MOST = 3


def find_setup_faults(recordings: Sequence[Recording]) -> SetupFindings:
    """Find what is wrong in how recordings of one hardware were set up and written.

    Takes a second or so. Recordings without a spin, or with one sensor only, tell little: nothing is found then but
    units of time and magnitude. Raises `InputError` where times are none, and their unit does not explain it.
    """
    current = tuple(recordings)
    faults: list[SetupFault] = []
    clock = clock_unit(current)
    for unit in [] if clock is None else [clock]:
        faults.append(SetupFault(unit, float("inf"), None))
        current = tuple(corrected(one, [unit]) for one in current)
    for one in current:
        require_seconds(one)
    clocks = tuple(f"{one.path or one.name}: {doubt.sentence}" for one in current for doubt in clock_doubts(one))
    doubts = [list(reference_doubts(one)) for one in current]

    def judged() -> list[Recording]:
        return [judgeable(believed(one, own)) for one, own in zip(current, doubts, strict=True)]

    if not all(one.samples for one in judged()):
        return SetupFindings(tuple(faults), current, contradictions=clocks)
    for unit in sensor_units(judged()):
        faults.append(SetupFault(unit, float("inf"), None))
        current = tuple(corrected(one, [unit]) for one in current)
    late, unlike = _late([believed(one, own) for one, own in zip(current, doubts, strict=True)])
    for fault in late:
        faults.append(fault)
        current = tuple(corrected(one, [fault.effect]) for one in current)
    clocks = (*clocks, *unlike)
    hints: tuple[Effect, ...] = ()
    for _ in range(MOST):
        found, hints = _next(judged())
        if not found or any(one.id == other.id and not other.of_axes for one in faults for other in found):
            break
        for fault in found:
            faults = with_fault(faults, fault)
        current = tuple(corrected(one, [fault.effect for fault in found]) for one in current)
    told = [(one, doubt) for one, own in zip(current, doubts, strict=True) for doubt in own]
    sure, unsure = (
        tuple(f"{one.path or one.name}: {doubt.sentence}" for one, doubt in told if doubt.sure is wanted)
        for wanted in (True, False)
    )
    return SetupFindings(tuple(faults), current, hints, sure, (*clocks, *unsure))


def _late(recordings: Sequence[Recording]) -> tuple[list[SetupFault], list[str]]:
    """Return the sensors whose clocks are another's in all recordings alike, and a sentence on each that is by itself.

    A file that counts from its own start is off by another time in each recording.
    """
    faults: list[SetupFault] = []
    for _ in ("magnetometer", "accelerometer"):  # each may be off by another time
        # what the phase is asked about it tells more sharply
        found = [late_sensor(one, LATEST if one.environment.field_known else SHORTEST) for one in recordings]
        seen = [one for one in found if one is not None]
        if not seen:
            break
        alike = len(seen) == len(found) and all(
            one.sensor == seen[0].sensor and abs(one.late - seen[0].late) < SHORTEST for one in seen
        )
        if not alike or not all(one.alone for one in seen):
            told = [(one, late) for one, late in zip(recordings, found, strict=True) if late is not None]
            return faults, [
                f"{one.path or one.name}: {late.what}: {late.why}; {remedy(_offset(late))}" for one, late in told
            ]
        effect = _offset(seen[0])
        faults.append(LateFault(effect, sum(one.gain for one in seen), None, told=seen[0]))
        recordings = [corrected(one, [effect]) for one in recordings]
    return faults, []


def _offset(late: LateSensor) -> Effect:
    """Return the offset of a sensor's times as an effect."""
    return effect_of(TimeOffset(late.late), late.sensor)


def suspected_fault(findings: SetupFindings) -> SuspectedFault | None:
    """Return the fault that makes sensors agree and gains too little to be named, as of one short throw; None if none.

    Where some fault was found already, or a rate reference is doubted, nothing more is suspected.
    """
    recordings = [judgeable(one) for one in findings.recordings]
    if findings.faults or findings.hints or findings.doubts or not all(one.samples for one in recordings):
        return None
    ranking = hypotheses(recordings, _SUSPECT)
    found = ranking.found
    if not found or found[0].kind == "rival" or not _agrees(found[0]):
        return None
    if not _gains(ranking.as_written, found[0], _SUSPECT / PRICE):
        return None
    likeliest = _fault(ranking.as_written, tuple(item for item in found if item.kind != "rival"), recordings)
    return SuspectedFault(likeliest.effect, likeliest.gain, likeliest.heldout_gain, likeliest.twins, likeliest.place)


def setup_notes(findings: SetupFindings, done: str) -> list[str]:
    """Return what a reader must know of the faults, a line each: of those mended, and of one that is suspected.

    ``done`` says what is done with the readings (``"the estimates are of"``).
    """
    notes = [*findings.doubts, *findings.contradictions]
    notes += [f"{fault.sentence}; {done} the readings so corrected" for fault in findings.faults]
    if (perhaps := suspected_fault(findings)) is not None:
        notes.append(f"{perhaps.sentence}; {done} the readings as written")
    return notes


def with_likeliest_fault(findings: SetupFindings, blamed: Collection[str] = ()) -> SetupFindings | None:
    """Return findings with one more fault that gains most, though relations hold badly with it; None if none gains.

    Physics beside a fault, as a field that changes with height, may spoil relations that the fault does not. Where no
    relation tells, the axes of ``blamed`` sensors are told by short fits. It is a supposition, for whoever can test it
    otherwise: by whether a motion follows the sensors then.
    """
    recordings = [judgeable(one) for one in findings.recordings]
    if len(findings.faults) == MOST or not all(one.samples for one in recordings):
        return None
    ranking = hypotheses(recordings, PRICE)
    found = ranking.found
    if not found or found[0].kind == "rival" or not _gains(ranking.as_written, found[0]):
        return with_fault_that_follows(findings, blamed)
    fault = _fault(ranking.as_written, tuple(item for item in found if item.kind != "rival"), recordings)
    return findings.without_hints.plus(fault)


def with_turned_board(findings: SetupFindings) -> SetupFindings | None:
    """Return findings with the board turned as gyroscope and magnetometer alike say, None where not so.

    Both show the axis of the spin, and no time enters that: it tells a turned board where rows or samples that were
    lost or late spoil every relation. Two chips that are each turned in the board show two axes. In a flight, which the
    air bends, relations are believed alone.
    """
    recordings = [judgeable(one) for one in findings.recordings]
    plant = plant_of(recordings[0])
    if findings.faults or plant.air_modelled or not all(one.samples for one in recordings):
        return None
    axes = [spin_axis(recordings, sensor) for sensor in ("gyroscope", "magnetometer")]
    if any(axis is None for axis in axes):
        return None
    tilted = min(_angle(axis, np.array([0.0, 0.0, 1.0])) for axis in axes if axis is not None)
    if tilted < (_TILTED if plant.airborne else _TILTED_RIG) or _angle(*axes) > _ALIKE * tilted:
        return None
    effects = _turns(recordings)
    if not effects:
        return None
    return findings.without_hints.plus(told_fault(effects[0], effects[1:]))


def _turns(recordings: Sequence[Recording]) -> tuple[Effect, ...]:
    """Return the turns of a board that its axis of spin leaves, likeliest first; on a rig those that do as well.

    There gravity, the field along the axis and a rate with a sign tell which end of the axis points down.
    """
    if plant_of(recordings[0]).airborne:
        return tuple(board_effect(turn) for turn in board_turns(recordings))
    boards = [item for item in hypotheses(recordings).found if item.kind == "board"]
    alike = [item for item in boards if item.charged < boards[0].charged + TWIN]
    return tuple(effect_of_hypothesis(item, recordings[0].environment.magnetic_field) for item in alike)


def _angle(one: FloatArray | None, other: FloatArray | None) -> float:
    """Return the angle between two axes (3,), rad, whichever way they point."""
    assert one is not None
    assert other is not None
    return float(np.arccos(np.clip(abs(float(one @ other)), 0.0, 1.0)))


def _next(recordings: Sequence[Recording]) -> tuple[list[SetupFault], tuple[Effect, ...]]:
    """Return the fault, or the two at once, that make the sensors agree; none where they do, or nothing does.

    Beside them where there are none the physics that would make them agree, as effects of about its size.
    """
    ranking = hypotheses(recordings, PRICE)
    as_written, found = ranking.as_written, ranking.found
    site = recordings[0].environment.magnetic_field
    before = None if as_written is None else as_written.costs
    if found and found[0].kind == "rival" and _gains(as_written, found[0], 0.5):
        return [], _hints(ranking)
    rivals = [item for item in found if item.kind == "rival"]
    # of a board that empties a gyroscope of clipped readings fewer statements are left: it must hold in each of them
    found = tuple(item for item in found if item.kind != "rival" and (item.kind != "board" or item.worst < WORST))
    if found and may_be_physics(found[0], rivals):
        return [], _hints(ranking)
    named = bool(found) and _agrees(found[0]) and _worth_naming(as_written, found[0], recordings)
    if not named and as_written is not None and _agrees(as_written):
        return [], ()
    # other axes than the best may do far better with a wrong clock beside, where the best leaves enough to gain
    if not named or (found[0].kind == "axes" and found[0].cost > PRICE):
        beside, alone = beside_physics(ranking), next(iter(ranking.found), None)
        if beside and _agrees(beside[0]) and _gains(alone, beside[0]) and _gains(as_written, beside[0], 2.0):
            return [_fault(as_written, beside, recordings)], ()
    if named:
        return [_fault(as_written, found, recordings)], ()
    for both, one, other in pairs(ranking.base)[:1]:
        if _agrees(both) and _gains(as_written, both, 2.0):
            gain = float("inf") if before is None else float(np.sum(before) - both.cost)
            return [SetupFault(effect_of_hypothesis(item, site), gain, None) for item in (one, other)], ()
    return [], _hints(ranking)


def may_be_physics(fault: Hypothesis, rivals: Sequence[Hypothesis]) -> bool:
    """Tell whether a lag, a clock or lost samples do as well as a fault, so that fits have to decide.

    That holds of a shift of the same sensor's times, and of a turned board that leaves so many statements unasked.
    """
    alike = [item for item in rivals if item.charged < fault.charged + TWIN]
    if fault.kind == "board":
        return any(fault.weight < ASKED * item.weight for item in alike)
    return fault.kind == "offset" and any(item.sensor == fault.sensor for item in alike)


def _hints(ranking: Ranking) -> tuple[Effect, ...]:
    """Return the lags, clocks and iron that are worth a fault's price, best first, as effects."""
    rivals = [item for item in ranking.found if item.kind == "rival" and _gains(ranking.as_written, item)]
    # samples that were lost are counted beside a motion: there is no size to start from
    likely = [item for item in rivals if item.charged < rivals[0].charged + PRICE]
    return tuple(_physics(item) for item in likely if not any(name.endswith(".losses") for name in item.columns.rival))


def _physics(item: Hypothesis) -> Effect:
    """Return what is no fault of the setup as an effect of its size."""
    ((name, size),) = item.columns.rival.items()
    sensor, _, what = name.rpartition(".")
    if what == "lag":
        return effect_of(Lag(size), sensor)
    return effect_of(ClockRate(1.0 + size), sensor) if what == "clock" else effect_of(HardIron(0.0, 0.0, size))


def _fault(as_written: Hypothesis | None, found: Sequence[Hypothesis], recordings: Sequence[Recording]) -> SetupFault:
    """Return the best of hypotheses as a fault, with those that cannot be told from it."""
    site = recordings[0].environment.magnetic_field
    before = None if as_written is None else as_written.costs
    tied = [item for item in found if _may_be_meant(item, found[0], plant_of(recordings[0]))]
    best, others = told_apart(tied, recordings, site)
    twins = [effect_of_hypothesis(item, site) for item in sorted(others, key=lambda item: item.kind != best.kind)]
    gain = float("inf") if before is None else float(np.sum(before) - best.cost)
    effects = (effect_of_hypothesis(best, site), *twins[:MOST_TWINS])
    place = next((at for one in effects if (at := place_instead(one, recordings[0])) is not None), None)
    return SetupFault(effects[0], gain, _heldout(before, best, found), effects[1:], place)


def _worth_naming(as_written: Hypothesis | None, item: Hypothesis, recordings: Sequence[Recording]) -> bool:
    """Tell whether a hypothesis gains its price and leaves no more than sound recordings do, or the air bears it out.

    Lost samples of one sensor turn its phase by a radian and more, and one offset may gain its price by chance. What
    is named so leaves more than sound recordings do; what gains twice its price is a fault beside other physics, unless
    it leaves most of what is wrong, as where a board is turned a little and clips.
    """
    sound = item.cost <= SOUND * item.weight
    mends = as_written is None or item.cost < MENDS * as_written.cost
    clear = sound or (mends and (_gains(as_written, item, 2.0) or not plant_of(recordings[0]).air_modelled))
    return (clear and _gains(as_written, item)) or _borne_out(as_written, item, recordings)


def _borne_out(as_written: Hypothesis | None, item: Hypothesis, recordings: Sequence[Recording]) -> bool:
    """Tell whether the air bears out a hypothesis that gains less than its price: a short fit leaves far less."""
    if not plant_of(recordings[0]).air_modelled or not _gains(as_written, item, _PRICE_IN_AIR / PRICE):
        return False
    some = chosen(recordings)
    meant = [corrected(one, [effect_of_hypothesis(item, some[0].environment.magnetic_field)]) for one in some]
    return REFUTED * left_by_short_fit(meant) < left_by_short_fit(some)


def _may_be_meant(item: Hypothesis, best: Hypothesis, plant: Plant) -> bool:
    """Tell whether a hypothesis is to be told from the best by more than what it costs.

    Where the best leaves more than sound recordings do, something else is wrong, too: lost samples turn the phase of
    one sensor, and columns turned about the spin axis may then cost less than the true ones. In a flight the air is
    asked about all of that sensor that come as near; of a turned board each relation tells, and it is not asked.
    """
    if item.charged < best.charged + TWIN:
        return True
    spoilt = best.cost > SOUND * best.weight
    alike = best.kind == "axes" and (item.kind, item.sensor) == (best.kind, best.sensor)
    return plant.air_modelled and spoilt and alike and item.cost < AGREE * item.weight


def _agrees(item: Hypothesis) -> bool:
    """Tell whether the sensors agree under a hypothesis."""
    return item.cost < AGREE * item.weight and item.worst < WORST


def _gains(as_written: Hypothesis | None, item: Hypothesis, faults: float = 1.0) -> bool:
    """Tell whether a hypothesis is worth its price; what cannot be as written has none."""
    return as_written is None or as_written.cost - item.charged > faults * PRICE


def _heldout(before: FloatArray | None, best: Hypothesis, found: Sequence[Hypothesis]) -> float | None:
    """Return what recordings gain in log likelihood by the hypothesis that the others choose; None for one alone."""
    if before is None or best.costs.size < 2 or before.size != best.costs.size:
        return None
    same = [item for item in found if item.costs.size == best.costs.size]
    gain = 0.0
    for i in range(best.costs.size):
        choice = min(same, key=lambda item: item.charged - item.costs[i])
        gain += 0.5 * float(before[i] - choice.costs[i])
    return gain
