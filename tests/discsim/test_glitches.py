"""A rate that no throw has, alone among readings like one another, is a slip of the log; a motion is none."""

from __future__ import annotations

import numpy as np

from discsim.glitches import glitches


def spin(rows: int = 200) -> np.ndarray:
    value = np.zeros((rows, 3))
    value[:, 2] = 28.0 + 0.01 * np.random.default_rng(0).standard_normal(rows)
    return value


def test_single_readings_beyond_any_throw_are_told_also_at_the_ends_and_beside_a_gap():
    value = spin()
    value[[0, 50, 120, 199], 2] = 2800.0, -2800.0, 282.0, 300.0
    value[[49, 51], 2] = np.nan
    assert [tuple(place) for place in np.argwhere(glitches("gyroscope", value))] == [
        (0, 2),
        (50, 2),
        (120, 2),
        (199, 2),
    ]
    assert np.flatnonzero(glitches("rate_reference", value[:, 2])).tolist() == [0, 50, 120, 199]


def test_a_slip_of_three_rows_is_told_whatever_its_rows_are_among_themselves():
    value = spin()
    value[50:53, 2] = 2800.0, 2810.0, -3200.0
    value[198:, 2] = 2800.0
    assert np.argwhere(glitches("gyroscope", value)).tolist() == [[row, 2] for row in (50, 51, 52, 198, 199)]


def test_what_lasts_or_rises_to_it_is_no_glitch():
    """Four rows may be a motion; a rotor of 400 rad/s gets there by readings that are near their neighbours."""
    value = spin()
    value[50:54, 2] = 2800.0
    assert not np.any(glitches("gyroscope", value))
    value = spin()
    value[40:61, 2] += 12.0 * (10 - np.abs(np.arange(-10, 11))) + 120.0 * np.cos(np.linspace(-np.pi / 2, np.pi / 2, 21))
    assert np.max(value) > 250
    assert not np.any(glitches("gyroscope", value))


def test_readings_in_another_unit_have_no_glitches_and_neither_has_a_field():
    value = spin()
    value[::10, 2] *= 100
    assert not np.any(glitches("gyroscope", value))
    value = spin()
    value[50, 2] = 2800.0
    assert not np.any(glitches("magnetometer", value))
