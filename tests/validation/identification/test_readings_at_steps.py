"""Readings on steps far coarser than their noise say what they know where they go on by a step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import discsim
from discsim.recording import Recording
from discsim.validation.diagnosis.prepared import prepared
from discsim.validation.identification.coarse_steps import at_steps, stands
from discsim.validation.identification.observations import readings_of

NOISE, STEP = 0.0056, 0.1
T = np.arange(1200) / 400.0


def slowing(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A spin that slows down, and its readings to one decimal."""
    rng = np.random.default_rng(seed)
    true = 60.0 - 3.1 * T + 0.3 * np.sin(2.0 * T + seed)
    return true, np.round((true + rng.normal(0.0, NOISE, T.size)) / STEP) * STEP


@pytest.mark.parametrize("seed", range(6))
def test_errors_at_steps_are_the_noise_and_white(seed):
    true, read = slowing(seed)
    value, good = at_steps(read[:, None], STEP, NOISE)
    off = (value[:, 0] - true)[good[:, 0]]
    assert off.size > 70
    assert 0.7 * NOISE < np.std(off) < 1.2 * NOISE
    assert abs(np.mean(off)) < 4.0 * NOISE / np.sqrt(off.size)
    assert abs(np.corrcoef(off[1:], off[:-1])[0, 1]) < 0.35
    # as they stand, the readings are a saw about the truth
    assert np.std(read - true) > 4.0 * NOISE
    assert np.corrcoef((read - true)[1:], (read - true)[:-1])[0, 1] > 0.4


def test_what_changes_with_every_row_stands_on_no_steps():
    """Its rounding is white, and part of the noise."""
    fast = np.round(8.0 * np.sin(60.0 * T) / STEP)[:, None] * STEP
    assert not stands(fast, STEP, NOISE)
    assert stands(slowing(1)[1][:, None], STEP, NOISE)
    assert not stands(slowing(1)[1][:, None], STEP, 0.05)
    assert not stands(slowing(1)[1][:, None], STEP, 0.0)
    assert stands(slowing(1)[1][:, None], STEP, None)
    assert not stands(np.full((1000, 3), 4.0), STEP, NOISE)  # one rate of a table


def test_a_leap_over_steps_and_a_gap_tell_nothing():
    leap = np.repeat([1.0, 1.2, 1.3], 20)[:, None]
    _, good = at_steps(leap, STEP, NOISE)
    assert np.flatnonzero(good[:, 0]).tolist() == [40]
    torn = leap.copy()
    torn[40:42] = np.nan
    assert not np.any(at_steps(torn, STEP, NOISE)[1])


def spin(decimals: int, seed: int = 3) -> Recording:
    """A free spin's gyroscope with so many decimals, and its stated noise."""
    still = np.random.default_rng(seed).normal(0.0, NOISE, (T.size, 2))
    value = np.round(np.column_stack([still, slowing(seed)[0] + still[::-1, 0]]), decimals)
    one = discsim.recording_from_arrays({"gyroscope": (T, value)}, plant="free_spin")
    sheet = replace(one.sheets["gyroscope"], noise_rms=NOISE, resolution=0.001)
    return replace(one, sheets={"gyroscope": sheet})


def test_a_gyroscope_of_one_decimal_is_looked_at_where_it_steps():
    """Four such throws were `unexplained`: a saw was left in every reading."""
    ready, said = prepared([spin(1)], ["throw"])
    assert any("stands on steps of 0.1 rad/s, 18 times its noise" in line for line in said)
    assert not any("repeats" in line for line in said)
    (gyroscope,) = readings_of(ready[0])
    assert gyroscope.sd == pytest.approx(np.full(3, NOISE))
    assert 60 < np.count_nonzero(gyroscope.good[:, 2]) < 0.1 * T.size
    assert not any("stands on steps" in line for line in prepared([spin(3)], ["throw"])[1])
