"""An even loop that asked for rows, some of them late: told by when the samples were made that the rows show."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.validation.diagnosis.consistency.late_rows import Windows, even_loop, loops_with_late_rows

LOOP, PERIOD, ROWS = 0.01, 0.0094, 260
NAMES = ("a", "b", "c", "d")


def asked(seed: int, tick: float, share: float) -> dict[str, np.ndarray]:
    """Return when the rows of recordings were asked for, s, of a loop whose rows come a tick late."""
    rng = np.random.default_rng(seed)
    return {name: LOOP * np.arange(ROWS) + tick * (rng.random(ROWS) < share) for name in NAMES}


def shown(instants: dict[str, np.ndarray], seed: int, period: float = PERIOD) -> dict[str, Windows]:
    """Return what a part of a period shows in rows that were asked for at some instants."""
    rng = np.random.default_rng(seed)
    found = {}
    for name, at in instants.items():
        phase = rng.uniform(0.0, period)
        made = phase + period * np.floor((at - phase) / period)
        found[name] = Windows(np.arange(float(ROWS)), made, period)
    return found


@pytest.mark.parametrize("seed", range(5))
def test_a_tick_of_a_sixth_of_a_period_and_the_share_of_late_rows_are_told_without_a_bias(seed):
    field = shown(asked(seed, 1.6e-3, 0.25), 100 + seed)
    loops = loops_with_late_rows(field)
    assert loops is not None
    assert loops.tick_s == pytest.approx(1.6e-3, abs=1.5e-4)
    late = loops.told_by(field, field)
    assert abs(late.fraction - 0.25) < 3.0 * late.fraction_sd


@pytest.mark.parametrize("seed", range(5))
def test_two_parts_say_that_rows_came_late_and_a_part_of_another_loop_does_not(seed):
    instants = asked(seed, 1.6e-3, 0.25)
    field, chip = shown(instants, 100 + seed), shown(instants, 200 + seed, 0.0091)
    loops = loops_with_late_rows(field)
    assert loops is not None
    assert loops.told_by(field, chip).agreed > 100.0
    # rows that came late at random, others than those of the field
    other = shown(asked(50 + seed, 0.0, 0.0), 200 + seed, 0.0091)
    assert loops.told_by(field, other).agreed < 24.0


@pytest.mark.parametrize("seed", range(5))
def test_a_loop_that_is_on_time_asks_for_no_late_rows(seed):
    field = shown(asked(seed, 0.0, 0.0), 100 + seed)
    loops = loops_with_late_rows(field)
    assert loops is None or loops.told_by(field, field).agreed < 24.0


@pytest.mark.parametrize("seed", range(5))
def test_the_loop_of_a_logger_that_lost_rows_is_told_by_one_part_to_a_fraction_of_a_millisecond(seed):
    rng = np.random.default_rng(seed)
    every = LOOP * np.arange(ROWS) + rng.uniform(0.0, LOOP)
    at = every[rng.random(ROWS) > 0.2]
    phase = rng.uniform(0.0, PERIOD)
    made = phase + PERIOD * np.floor((at - phase) / PERIOD)
    found = even_loop(Windows(np.arange(float(at.size)), made, PERIOD), 1.003 * LOOP)
    assert np.max(np.abs(found - at)) < 4e-4
