"""The loop beside which a part's samples are skipped: told by the pattern, and not by rows lost at random."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.validation.diagnosis.consistency.skipped_samples import Loops, loops_beside

LOOP = 0.01


def shown(period: float, lost: float, seed: int, seconds: float = 2.5) -> np.ndarray:
    """Return the newest sample of each row of a loop of 10 ms beside a part of some period."""
    rng = np.random.default_rng(seed)
    t = LOOP * np.arange(int(seconds / LOOP))
    t = t[rng.random(t.size) >= lost]
    return np.floor((t - rng.uniform(0.0, period)) / period).astype(np.int64)


def loop_beside(newest: np.ndarray, period: float) -> Loops | None:
    """Return the loop that one recording tells."""
    return loops_beside({"one": newest}, {"one": period}, LOOP)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("period", [0.0088, 0.0091, 0.0094])
def test_a_loop_is_found_beside_a_faster_part(period, seed):
    found = loop_beside(shown(period, 0.2, seed), period)
    assert found is not None
    assert found.step_s["one"] == pytest.approx(LOOP, rel=2e-3)
    assert found.gain > 8.0


@pytest.mark.slow
def test_rows_lost_at_random_of_a_loop_that_is_off_its_rate_show_every_sample():
    """A loop of 9.4 ms that loses rows: no other loop is likelier in any of forty recordings."""
    gains = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        newest = np.flatnonzero(rng.random(260) >= 0.25)
        found = loop_beside(newest, 0.0094)
        assert found is not None
        gains.append(found.gain)
    assert max(gains) < 0.0


def test_a_part_that_is_no_faster_than_the_loop_skips_nothing():
    assert loop_beside(shown(0.0102, 0.2, 1), 0.0102) is None
    assert loop_beside(np.zeros(5, dtype=np.int64), 0.009) is None


def test_a_few_miscounted_rows_do_not_hide_the_loop():
    newest = shown(0.009, 0.2, 3)
    newest[::50] += 1
    found = loop_beside(newest, 0.009)
    assert found is not None
    assert found.step_s["one"] == pytest.approx(LOOP, rel=2e-3)
    assert found.gain > 8.0


@pytest.mark.parametrize("seed", range(2))
def test_recordings_of_one_loop_tell_it_together(seed):
    """A loop of 10 ms beside 9.64 ms skips eight samples in a throw: each throw alone tells too little."""
    period, names = 0.00964, "abcd"
    newest = {name: shown(period, 0.24, 10 * seed + k, seconds=2.8) for k, name in enumerate(names)}
    found = loops_beside(newest, dict.fromkeys(names, period), LOOP)
    alone = [loop_beside(one, period) for one in newest.values()]
    assert found is not None
    assert all(step == pytest.approx(LOOP, rel=2e-4) for step in found.step_s.values())
    assert found.gain > 24.0
    assert all(one is not None and one.gain < 24.0 for one in alone)
    assert found.gain > sum(one.gain for one in alone if one is not None)


def test_recordings_that_lose_rows_at_random_tell_no_loop_together():
    gains = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        newest = {name: np.flatnonzero(rng.random(260) >= 0.25) for name in "abcd"}
        found = loops_beside(newest, dict.fromkeys(newest, 0.0094), LOOP)
        assert found is not None
        gains.append(found.gain)
    assert max(gains) < 0.0
