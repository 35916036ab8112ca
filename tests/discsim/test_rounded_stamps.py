"""Stamps that a logger has rounded are taken as even where they are, and as they stand where they are not."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.rounded_stamps import evened, unit_of


@pytest.mark.parametrize("rate", [333.0, 400.0, 416.0, 833.0, 952.0])
@pytest.mark.parametrize("cut", [np.round, np.floor])
def test_rows_come_evenly_in_stamps_of_milliseconds(rate, cut):
    t = 3.0 + np.arange(2000) / rate
    stamps = cut(1e3 * t) / 1e3
    assert unit_of(stamps) == 1e-3
    off = evened(stamps) - t
    assert np.max(np.abs(off - np.mean(off))) < 1e-4  # 500 us as they stand
    assert abs(np.mean(off) + 5e-4 * (cut is np.floor)) < 5e-5  # what is cut off is lost to all rows alike


def test_rows_on_either_side_of_lost_ones_have_lines_of_their_own():
    t = np.delete(np.arange(2000) / 400.0, [*range(300, 307), 1200, *range(1210, 1214)])
    off = evened(np.round(t, 3)) - t
    assert np.std(np.delete(off, np.s_[1193:1202])) < 1e-4  # the nine rows between two losses keep their stamps
    assert np.max(np.abs(off)) <= 5e-4 + 1e-12


def test_a_tenth_of_a_unit_of_jitter_is_less_than_the_rounding():
    t = np.arange(2000) / 400.0
    late = t + np.random.default_rng(1).normal(0.0, 1e-4, t.size)
    assert np.std(evened(np.round(late, 3)) - late) < 1.2e-4


@pytest.mark.parametrize(
    "stamps",
    [
        np.arange(500) / 100.0,
        np.arange(500) / 400.0,
        np.round(np.arange(500) / 81.97, 5),
        np.round(np.arange(500) / 400.0 + np.random.default_rng(2).normal(0.0, 1e-3, 500).cumsum() / 9, 3),
        np.round(np.arange(20) / 400.0, 3),
    ],
    ids=["even", "even to the last digit", "finely rounded", "uneven", "few"],
)
def test_others_are_left_as_they_stand(stamps):
    stamps = np.unique(stamps)
    assert evened(stamps) is stamps
