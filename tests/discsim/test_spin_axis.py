"""The axis of a spin is the one with most of the rate's square where a body spins fast."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.plain_arrays import recording_from_arrays
from discsim.spin_axis import ONE_AXIS, axis_shares, fast_rows
from discsim.validation.checking import check_recording

T = np.arange(0, 4, 0.01)


def spinning(axis: int, wobble: float = 3.0) -> np.ndarray:
    """Rest, then 30 rad/s about an axis with a wobble about the others."""
    rate = np.column_stack([wobble * np.cos(9 * T), wobble * np.sin(9 * T), 0 * T])
    rate[:, axis] = 30.0
    return rate * (T > 1)[:, None]


@pytest.mark.parametrize("axis", range(3))
def test_the_spin_axis_has_the_largest_share_and_a_tilt_of_25_degrees_leaves_it_most(axis):
    shares = axis_shares(spinning(axis))
    assert int(np.argmax(shares)) == axis
    assert shares.sum() == pytest.approx(1.0)
    tilted = np.tile([30 * np.sin(np.radians(25)), 0.0, 30 * np.cos(np.radians(25))], (20, 1))
    assert axis_shares(tilted)[2] > ONE_AXIS
    np.testing.assert_array_equal(fast_rows(spinning(axis)), T > 1)


def test_a_rest_an_empty_recording_and_a_gap_tell_no_axis():
    assert axis_shares(0.1 * spinning(2)) is None
    assert axis_shares(np.zeros((0, 3))) is None
    assert axis_shares(np.where(np.arange(3) == 2, np.nan, spinning(2, wobble=9.0))) is None


def test_a_gyroscope_whose_z_was_not_read_is_not_said_to_spin_about_another_axis():
    """What was left of the rate, the wobble about x, passed for the spin."""
    rate = np.where(np.arange(3) == 2, np.nan, spinning(2, wobble=9.0))
    rate[:, 1] *= 0.1
    found = check_recording(recording_from_arrays({"gyroscope": (T, rate)})).findings
    assert not [one for one in found if "spins about" in one.sentence]
    told = check_recording(recording_from_arrays({"gyroscope": (T, spinning(0))})).findings
    assert [one.where for one in told if "it spins about that axis" in one.sentence] == ["gyroscope"]


@pytest.mark.parametrize("axis", range(2))
def test_without_a_stated_field_a_magnetometer_that_turns_about_another_axis_is_told(axis):
    """The setup compares axes in a stated field alone; the spin is seen by both sensors."""
    rng = np.random.default_rng(0)
    phase = 30 * np.maximum(T - 1, 0)
    field = np.column_stack([30 * np.cos(phase), -30 * np.sin(phase), 0 * T + 39]) + rng.normal(0, 0.6, (T.size, 3))
    swapped = [2, 1, 0] if axis == 0 else [0, 2, 1]
    for columns, said in (([0, 1, 2], []), (swapped, ["magnetometer"])):
        readings = {"gyroscope": (T, spinning(2)), "magnetometer": (T, field[:, columns])}
        told = [
            one for one in check_recording(recording_from_arrays(readings)).findings if "axis of disc" in one.expected
        ]
        assert [one.where for one in told] == said
    assert f"the field stands still along {'xy'[axis]}" in told[0].sentence
    assert "swap these columns of magnetometer.csv" in told[0].sentence
