"""A rate table that turns faster than half the magnetometer's sampling rate: the field is folded, and nothing wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import discsim
from discsim.validation.estimating.spin_estimates import estimate_spin


def table(rate_deg_s, mirrored=1.0):
    """Six seconds at one rate: a reference, a field at 20 Hz and an accelerometer that lies upright."""
    rng = np.random.default_rng(0)
    t, field_t = np.arange(0.0, 6.0, 0.01), np.arange(0.0, 6.0, 0.05)
    rate = np.radians(rate_deg_s)
    psi = rate * field_t
    m = np.column_stack([25.0 * np.cos(psi), -25.0 * mirrored * np.sin(psi), np.full(psi.size, 40.0)])
    told = {
        "rate_reference": (t, rate + rng.normal(0.0, 0.001, t.size)),
        "magnetometer": (field_t, m + rng.normal(0.0, 0.6, m.shape)),
        "accelerometer": (t, np.array([0.0, 0.0, -9.8]) + rng.normal(0.0, 0.03, (t.size, 3))),
    }
    made = discsim.recording_from_arrays(told, plant="rate_table")
    return replace(made, environment=replace(made.environment, magnetic_field=np.array([25.0, 0.0, 40.0])))


@pytest.mark.parametrize("rate", [3973.0, -3973.0])
def test_a_field_that_is_folded_is_neither_mirrored_nor_a_reference_s_factor(rate):
    said = estimate_spin(table(rate)).summary()
    assert "mirrored" not in said
    assert "times the rate" not in said
    assert "see it folded, as 3227 deg/s" in said


def test_one_that_is_mirrored_and_not_folded_is_still_told():
    assert "mirrored = true" in estimate_spin(table(2973.0, -1.0)).summary()
