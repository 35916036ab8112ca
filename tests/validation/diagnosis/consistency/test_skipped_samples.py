"""The loop beside which a part's samples are skipped: told by the pattern, and not by rows lost at random."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.validation.diagnosis.consistency.skipped_samples import loop_beside

LOOP = 0.01


def shown(period: float, lost: float, seed: int, seconds: float = 2.5) -> np.ndarray:
    """Return the newest sample of each row of a loop of 10 ms beside a part of some period."""
    rng = np.random.default_rng(seed)
    t = LOOP * np.arange(int(seconds / LOOP))
    t = t[rng.random(t.size) >= lost]
    return np.floor((t - rng.uniform(0.0, period)) / period).astype(np.int64)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("period", [0.0088, 0.0091, 0.0094])
def test_a_loop_is_found_beside_a_faster_part(period, seed):
    found = loop_beside(shown(period, 0.2, seed), period, LOOP)
    assert found is not None
    assert found.step_s == pytest.approx(LOOP, rel=2e-3)
    assert found.gain > 8.0


def test_rows_lost_at_random_of_a_loop_that_is_off_its_rate_show_every_sample():
    """A loop of 9.4 ms that loses rows: no other loop is likelier in any of forty recordings."""
    gains = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        newest = np.flatnonzero(rng.random(260) >= 0.25)
        found = loop_beside(newest, 0.0094, LOOP)
        assert found is not None
        gains.append(found.gain)
    assert max(gains) < 0.0


def test_a_part_that_is_no_faster_than_the_loop_skips_nothing():
    assert loop_beside(shown(0.0102, 0.2, 1), 0.0102, LOOP) is None
    assert loop_beside(np.zeros(5, dtype=np.int64), 0.009, LOOP) is None


def test_a_few_miscounted_rows_do_not_hide_the_loop():
    newest = shown(0.009, 0.2, 3)
    newest[::50] += 1
    found = loop_beside(newest, 0.009, LOOP)
    assert found is not None
    assert found.step_s == pytest.approx(LOOP, rel=2e-3)
    assert found.gain > 8.0
