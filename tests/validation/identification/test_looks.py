"""Readings are put to the segments that they fall into, at instants that sensors share but once."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from discsim.validation.identification.looks import looks_at
from discsim.validation.identification.sensitivities import add_weighted, write_slopes


@pytest.mark.parametrize("segments", [1, 4, 40])
def test_each_segment_has_the_readings_that_fall_into_it(segments: int):
    rng = np.random.default_rng(segments)
    nodes = np.linspace(0.0, 2.0, segments + 1)
    board = np.sort(rng.uniform(0.0, 2.1, 50))
    # a sensor of its own, one whose means go back and forth, and one that shows nothing
    instants = [board, rng.permutation(np.concatenate([board, rng.uniform(0.0, 2.0, 9)])), np.empty(0)]
    which = [np.clip(np.searchsorted(nodes, t, side="right") - 1, 0, segments - 1) for t in instants]
    for i, look in enumerate(looks_at(instants, which, segments)):
        there = [t[segment == i] for t, segment in zip(instants, which, strict=True)]
        assert_array_equal(look.out, np.unique(np.concatenate(there)))
        assert_array_equal(look.out[look.place], np.concatenate(there))
        for own, segment in zip(look.own, which, strict=True):
            assert_array_equal(own, np.flatnonzero(segment == i))


def test_a_trajectory_without_sensors_is_looked_at_nowhere():
    assert [(look.own, look.place.size, look.out.size) for look in looks_at([], [], 3)] == [([], 0, 0)] * 3


def test_weighted_slopes_are_summed_and_written_where_they_belong():
    rng = np.random.default_rng(1)
    M, weights = rng.normal(size=(9, 3, 5)), rng.normal(size=9)
    mine, place = np.array([0, 2, 3, 7, 8]), np.array([1, 0, 1, 2, 1])
    said, expected = np.zeros((3, 3, 4)), np.zeros((3, 3, 4))
    np.add.at(expected, place, weights[mine, None, None] * M[mine, :, :4])
    add_weighted(M, weights, mine, place, said)
    assert_array_equal(said, expected)
    slopes, columns = np.zeros((9, 3, 6)), np.array([5, 1])
    write_slopes(M[mine][:, :, :2], mine, columns, slopes)
    assert_array_equal(slopes[mine[:, None], :, columns], np.moveaxis(M[mine][:, :, :2], 2, 1))
    assert np.count_nonzero(slopes) == mine.size * 3 * 2
