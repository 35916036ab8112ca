"""Stamps that are late behind rows that come evenly, and rows that come unevenly behind stamps that are true."""

from __future__ import annotations

import numpy as np
import pytest

import discsim
from discsim.arrays import FloatArray
from discsim.estimators.methods import estimate
from discsim.validation.diagnosis.late_stamps import with_even_rows
from discsim.validation.rows.even_rows import at_even_times, even_times
from discsim.validation.rows.readings import Readings

ROWS, STEP, RATE = 600, 0.005, np.radians(3900.0)
TRUE = 2.0 + STEP * np.arange(ROWS)


def field(t: FloatArray, seed: int) -> FloatArray:
    psi = RATE * t - 2.0 * t**2
    m = np.column_stack([25.0 * np.cos(psi), -25.0 * np.sin(psi), np.full(t.size, 40.0)])
    return np.asarray(m + np.random.default_rng(seed).normal(0.0, 0.6, m.shape))


def late(seed: int, size: float = 0.003) -> FloatArray:
    """Stamps of a host: each row arrives later by a while, none before the one before."""
    stamps = TRUE + np.random.default_rng(seed).exponential(size, ROWS)
    return np.asarray(np.maximum.accumulate(stamps) + 1e-9 * np.arange(ROWS))


def log(stamps: FloatArray, taken: FloatArray, seed: int, number: FloatArray | None = None) -> dict[str, Readings]:
    rows = np.arange(stamps.size) if number is None else number
    still = np.random.default_rng(seed + 100).normal(0.0, 0.05, (stamps.size, 3))
    return {"gyroscope": Readings(rows, stamps, still), "magnetometer": Readings(rows, stamps, field(taken, seed))}


TABLE = {"gyroscope": "log.csv", "magnetometer": "log.csv"}


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("size", [0.001, 0.003])
def test_rows_of_late_stamps_are_taken_at_even_times(seed, size):
    stamps = late(seed, size)
    found, (note,) = at_even_times(log(stamps, TRUE, seed), TABLE)
    for one in found.values():
        # but for the mean delay, which all rows share
        assert np.std(one.time - TRUE) < 0.1 * np.std(stamps - TRUE)
    assert "gyroscope, magnetometer: the stamps are" in note


@pytest.mark.parametrize("seed", range(5))
def test_rows_that_came_late_by_true_stamps_keep_them(seed):
    stamps = late(seed)
    found, notes = at_even_times(log(stamps, stamps, seed), TABLE)
    assert notes == []
    assert found["magnetometer"].time is stamps


@pytest.mark.parametrize("seed", range(5))
def test_lost_rows_keep_their_place(seed):
    """Nothing counts them: the rows behind are late by whole ones."""
    kept = np.delete(np.arange(ROWS), [*range(200, 207), *range(400, 420)])
    stamps = late(seed, 0.001)[kept]
    found, notes = at_even_times(log(stamps, TRUE[kept], seed), TABLE)
    assert len(notes) == 1
    assert np.std(found["magnetometer"].time - TRUE[kept]) < 2e-4


@pytest.mark.parametrize("seed", range(5))
def test_a_loop_whose_pace_wanders_has_no_even_rows(seed):
    pace = STEP * (1.0 + 0.05 * np.sin(np.arange(ROWS) / 60.0))
    stamps = np.cumsum(pace) + np.random.default_rng(seed).normal(0.0, 2e-4, ROWS)
    assert even_times(np.arange(ROWS), stamps) is None


def test_even_stamps_and_few_rows_are_left():
    assert even_times(np.arange(ROWS), TRUE) is None
    assert even_times(np.arange(20), late(1)[:20]) is None


def test_a_field_at_rest_tells_nothing():
    rest = log(late(1), np.zeros(ROWS), 1)
    assert at_even_times(rest, TABLE)[1] == []


def test_of_another_table_nothing_is_told():
    stamps = late(2)
    found, _ = at_even_times(log(stamps, TRUE, 2), {"gyroscope": "gyro.csv", "magnetometer": "mag.csv"})
    assert found["gyroscope"].time is stamps
    assert found["magnetometer"].time is not stamps


def test_a_recording_is_estimated_by_even_rows():
    """By the stamps no window of the field's spectrum was even, and the paper's method was silent."""
    t = late(3) - 2.0
    one = discsim.recording_from_arrays({"magnetometer": (t, field(TRUE, 3))}, plant="free_spin")
    mended, (note,) = with_even_rows(one)
    assert "the stamps of magnetometer" in note
    rate = estimate(mended, "fft")
    known = np.isfinite(rate.rate)
    assert np.count_nonzero(known) > 0.9 * known.size
    truth = RATE - 4.0 * (rate.t[known] + 2.0)
    assert np.median(np.abs(rate.rate[known] - truth)) < np.radians(15.0)
    assert with_even_rows(discsim.recording_from_arrays({"magnetometer": (t, field(t, 3))}, plant="free_spin"))[1] == []
