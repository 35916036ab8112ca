"""Rows that came late beside an even loop: what one part's windows ask for by themselves."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.validation.diagnosis.consistency.late_rows import Windows, late_all_along, late_needed

LOOP, PERIOD, ROWS = 0.01, 0.0094, 260


def windows(seed: int, tick: float, share: float, *, period: float = PERIOD) -> dict[str, Windows]:
    """Return what a part of a period shows in three recordings of a loop whose rows come late by a tick, s."""
    rng = np.random.default_rng(seed)
    found = {}
    for name in ("a", "b", "c"):
        step = np.arange(ROWS, dtype=float)
        asked = LOOP * step + tick * (rng.random(ROWS) < share)
        phase = rng.uniform(0.0, period)
        found[name] = Windows(step, phase + period * np.floor((asked - phase) / period), period)
    return found


@pytest.mark.parametrize("seed", range(5))
def test_a_tick_of_a_sixth_of_a_period_is_told_by_one_part_alone(seed):
    tick, gain = late_needed(windows(seed, 1.6e-3, 0.25))
    # the least that does, but for one row in a hundred
    assert 1.0e-3 < tick <= 1.7e-3
    assert gain > 24.0


@pytest.mark.parametrize("seed", range(5))
def test_a_loop_that_is_on_time_asks_for_no_tick(seed):
    tick, gain = late_needed(windows(seed, 0.0, 0.0))
    assert tick < 1e-6
    assert gain <= 0.0


@pytest.mark.parametrize("more", [-3e-3, 0.0, 2e-3])
def test_the_one_time_that_a_recordings_rows_are_off_by_is_found_again(more):
    own = windows(3, 3e-3, 0.25)["a"]
    due = LOOP * own.step
    moved = Windows(own.step, own.made - more, own.period_s)
    assert late_all_along(due, 3e-3, moved) == pytest.approx(more, abs=3e-4)
