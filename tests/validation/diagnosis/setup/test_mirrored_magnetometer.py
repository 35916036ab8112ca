"""A magnetometer with one axis reversed beside a gyroscope that clips: its field turns the other way than the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from support.made import MODULE, throws

from discsim.effects import effect
from discsim.estimators.fusion import unfolding
from discsim.recording import Recording
from discsim.sensors import Instruments
from discsim.validation.diagnosis.setup import find_setup_faults
from discsim.validation.diagnosis.setup.find import WORST
from discsim.validation.diagnosis.setup.hypotheses import Ranking, hypotheses
from discsim.written import as_written

CLIPPED = MODULE.fitted("gyroscope", range=34.9066)
SLOW = replace(CLIPPED.sensors["magnetometer"].sampling, rate_hz=50.0)
MIRRORED = effect("mag.axes", axes="-x y z")


def mirrored(module: Instruments) -> list[Recording]:
    return [as_written(one, [MIRRORED]) for one in throws(seconds=3.0, module=module)]


def test_a_slow_field_that_turns_the_other_way_is_not_folded_where_no_throw_turns_so_fast():
    """At 50 Hz it would be one of 240 rad/s: the field was left out, and nothing told its axes."""
    recordings = mirrored(CLIPPED.fitted("magnetometer", sampling=SLOW))
    assert [unfolding(one) for one in recordings] == [(0, True)] * 2
    (fault,) = find_setup_faults(recordings).faults
    assert fault.effect == MIRRORED


def test_a_board_that_misses_one_relation_by_far_hides_no_reversed_axis(monkeypatch):
    """Turned it empties the gyroscope of clipped readings, which leaves fewer statements to miss: its cost is lower."""
    recordings = mirrored(MODULE)

    def with_board(some: Sequence[Recording], price: float = 0.0) -> Ranking:
        ranking = hypotheses(some, price)
        if ranking.as_written is None or ranking.as_written.worst < WORST:
            return ranking
        first = ranking.found[0]
        board = replace(first, kind="board", sensor="board", costs=0.8 * first.costs, worst=1.5 * WORST, size=0.0)
        return replace(ranking, found=(board, *ranking.found))

    monkeypatch.setattr("discsim.validation.diagnosis.setup.find.hypotheses", with_board)
    (fault,) = find_setup_faults(recordings).faults
    assert fault.effect == MIRRORED
