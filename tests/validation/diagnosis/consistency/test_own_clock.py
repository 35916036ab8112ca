"""A magnetometer that free-runs beside its logger: its clock, the samples that rows show, and what asks for none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.logger_loop import LOOP, NAMES, PERIOD, logged, motions

from discsim.validation.diagnosis.consistency.counted_samples import field_of, followed, unslipped
from discsim.validation.diagnosis.consistency.own_clock import (
    MOST_ROWS,
    FoundOwnClock,
    SamplesShown,
    own_clock_of,
    too_many,
)
from discsim.validation.diagnosis.consistency.time_stamp_recovery import rows_of


def found(seed: int, *, own_clock: bool, weight: float) -> tuple[FoundOwnClock | None, list[np.ndarray]]:
    made = [logged(motion, seed + k, own_clock=own_clock, weight=weight) for k, motion in enumerate(motions())]
    recordings = [recording for recording, _ in made]
    rows = rows_of(recordings, NAMES)
    assert rows is not None
    return own_clock_of(recordings, NAMES, rows), [newest for _, newest in made]


@pytest.mark.parametrize("seed", [1, 11, 21])
def test_means_of_two_samples_of_a_part_with_its_own_clock_are_told_apart_row_by_row(seed):
    clock, newest = found(seed, own_clock=True, weight=0.5)
    assert clock is not None
    assert abs(clock.period_s - PERIOD) < 3.0 * clock.sd_s + 2e-3 * PERIOD
    for item, true in zip(clock.shown, newest, strict=True):
        assert np.mean(np.diff(item.newest) == np.diff(true)) > 0.98
        assert item.loop_s == pytest.approx(LOOP, rel=0.01)
        assert item.lost == pytest.approx(0.2, abs=0.05)
        counted, here = item.left
        # the readings' own noise is 0.1 uT on each axis
        assert here < 0.3 < counted


@pytest.mark.parametrize("seed", range(1, 41, 8))
def test_lost_rows_alone_ask_for_no_clock_and_no_means(seed):
    assert found(seed, own_clock=False, weight=0.0)[0] is None


@pytest.mark.parametrize("seed", range(1, 41, 8))
def test_single_samples_of_a_part_with_its_own_clock_are_told_by_those_that_are_skipped(seed):
    clock, newest = found(seed, own_clock=True, weight=0.0)
    assert clock is not None
    assert clock.weight == 0.0
    assert abs(clock.period_s - PERIOD) < 3.0 * clock.sd_s + 2e-3 * PERIOD
    assert "mag.average" not in " ".join(clock.sentences)
    for item, true in zip(clock.shown, newest, strict=True):
        assert np.mean(np.diff(item.newest) == np.diff(true)) > 0.98
        assert item.loop_s == pytest.approx(LOOP, rel=0.01)
        assert item.lost == pytest.approx(0.2, abs=0.06)


@pytest.mark.parametrize(("seed", "at"), [(1, 8), (11, 30), (21, 90)])
def test_a_slip_of_one_sample_is_found_by_the_row_that_no_sample_makes_read_as_it_does(seed, at):
    recording, true = logged(motions()[0], seed, own_clock=True, weight=0.5)
    field = field_of(recording)
    assert field is not None
    right = followed(field, true - true[0] + 2, np.ones(true.size, dtype=int), PERIOD, means=True)
    slipped = right.newest.copy()
    slipped[at:] += 1
    # where a row beside it shows the sample that the first one slipped to, no later row can be counted one less there
    slipped[at - 2] = slipped[at - 1] - 1
    begun = followed(field, slipped, right.apart, PERIOD, means=True, rounds=1)
    found = unslipped(field, begun, PERIOD, means=True, kept=False)
    assert np.mean(np.diff(found.newest) == np.diff(true)) > 0.98
    assert found.doubtful == ()


def test_rows_are_put_where_their_samples_were_taken():
    clock, newest = found(5, own_clock=True, weight=0.5)
    assert clock is not None
    recording = logged(motions()[0], 5, own_clock=True, weight=0.5)[0]
    counted = clock.counted(recording, NAMES[0])
    assert counted is not None
    times = counted.samples["magnetometer"].t
    # the mean time of two samples: half a period behind the newest, or a whole one where one was skipped
    behind = (times - times[0]) - (newest[0] - newest[0][0]) * PERIOD
    assert np.quantile(np.abs(behind), 0.95) < 0.55 * PERIOD
    assert clock.counted(recording, "another") is None


def test_rows_that_are_too_many_for_their_samples_are_not_asked_for_a_clock():
    """A count of 2000 rows had taken minutes, and one of ten minutes of a rate table would have taken a day."""
    recordings = [logged(motion, 1 + k, own_clock=True, weight=0.5)[0] for k, motion in enumerate(motions())]
    rows = rows_of(recordings, NAMES)
    assert rows is not None
    assert not too_many(rows)
    first, *others = rows.durations
    long = replace(first, t=np.arange(MOST_ROWS + 1.0))
    many = replace(rows, durations=(long, *others))
    assert too_many(many)
    assert own_clock_of(recordings, NAMES, many) is None


@pytest.mark.parametrize("count", range(60, 140, 7))
def test_no_fewer_than_none_of_the_rows_are_lost_where_steps_are_counted_by_their_mean(count):
    period = 0.0094
    newest = np.floor(0.4 + 1.1 * np.arange(count)).astype(int)
    shown = SamplesShown("a", period, newest, np.zeros_like(newest), (1.0, 1.0), 1.1 * period)
    assert 0.0 <= shown.lost < 0.02
