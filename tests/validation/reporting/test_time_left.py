"""How long a diagnosis still takes, told from how fast its stages came."""

from __future__ import annotations

import pytest

from discsim.validation.reporting.progress import in_words
from discsim.validation.reporting.time_left import TimeLeft


class Clock:
    """Seconds as told."""

    def __init__(self) -> None:
        self.at = 100.0

    def __call__(self) -> float:
        return self.at


def test_nothing_is_told_before_the_motion_is_followed():
    clock = Clock()
    left = TimeLeft(table=False, now=clock)
    clock.at += 1.0
    assert left("checking the setup", 0, 5) is None
    assert left("asking whether sensors contradict one another", 0, 5) is None
    clock.at += 1.0
    assert left("following the data", 1, 5) == pytest.approx(18.0)


@pytest.mark.parametrize(("table", "expected"), [(False, 10.0), (True, 9.23)])
def test_half_the_time_is_spent_when_candidates_are_refitted(table, expected):
    clock = Clock()
    left = TimeLeft(table=table, now=clock)
    clock.at += 10.0
    assert left("refitting candidates", 3, 4) == pytest.approx(expected, abs=0.01)


def test_a_stage_that_lasts_makes_the_whole_longer():
    clock = Clock()
    left = TimeLeft(table=False, now=clock)
    clock.at += 5.7
    at_first = left("effect 1, refitting with: air.wind", 0, 4)
    assert at_first == pytest.approx(4.3)
    clock.at += 50.0
    later = left("effect 1, refitting with: mag.lag", 1, 4)
    # no further than the end of its stage, at 0.8 of the whole
    assert later == pytest.approx(55.7 / 0.8 - 55.7)
    # what is part of a stage is not one of its own
    assert left("refitting without: air.wind", 0, 2) == pytest.approx(later)


def test_a_third_effect_says_that_more_come():
    clock = Clock()
    left = TimeLeft(table=False, now=clock)
    clock.at += 62.0
    second = left("effect 2, refitting with: air.wind", 0, 4)
    third = left("effect 3, refitting with: air.wind", 0, 4)
    sixth = left("effect 6, refitting with: air.wind", 0, 4)
    assert (second, third, sixth) == pytest.approx((38.0, 75.8, 41.3), abs=0.1)


def test_in_words():
    assert in_words(None) == in_words(0.4) == ""
    assert in_words(42.3) == "about 42 s left in all"
    assert in_words(150.0) == "about 2 min left in all"
