"""A magnetometer that free-runs beside its logger: its clock, the samples that rows show, and what asks for none."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import MODULE, throws

from discsim.recording import Recording, Samples
from discsim.sensors.sampling import Noise, Sampling
from validation.diagnosis.consistency.own_clock import OwnClock, own_clock_of
from validation.diagnosis.consistency.time_stamp_recovery import rows_of

#: the logger's loop and the part's period, s: the loop skips a sample every 1 / (LOOP / PERIOD - 1) steps
LOOP, PERIOD = 0.01, 0.0094
NAMES = ["a", "b"]


@cache
def motions() -> tuple[Recording, ...]:
    """Return throws whose sensors are read so often that any instant's readings lie on a line between two."""
    often = Sampling(1000.0)
    board = MODULE.without("gps").fitted("gyroscope", range=100.0, sampling=often)
    board = board.fitted("magnetometer", sampling=often, noise=Noise(0.02), resolution=0.0).fitted(
        "accelerometer", sampling=often
    )
    return tuple(throws(module=board, plant="free_spin", seconds=2.0))


def logged(recording: Recording, seed: int, *, own_clock: bool, weight: float) -> tuple[Recording, np.ndarray]:
    """Return what a loop writes of a motion that loses a fifth of its rows, and the newest sample of each row."""
    rng = np.random.default_rng(seed)
    steps = np.arange(2, int(1.9 / LOOP))
    kept = steps[rng.random(steps.size) > 0.2]
    phase = rng.uniform(0.0, PERIOD)

    def sampled(step: np.ndarray) -> np.ndarray:
        t = step * LOOP
        return phase + PERIOD * np.floor((t - phase) / PERIOD) if own_clock else t

    samples = {}
    for name, own in recording.samples.items():

        def at(t: np.ndarray, own: Samples = own) -> np.ndarray:
            return np.column_stack([np.interp(t, own.t, column) for column in own.value.T])

        if name == "magnetometer":
            value = (1.0 - weight) * at(sampled(kept)) + weight * at(sampled(kept - 1))
            value = np.round((value + rng.normal(0.0, 0.1, value.shape)) / 0.01) * 0.01
        else:
            value = at(kept * LOOP)
        samples[name] = Samples(LOOP * np.arange(kept.size), value)
    return replace(recording, samples=samples), np.rint((sampled(kept) - phase) / PERIOD).astype(int)


def found(seed: int, *, own_clock: bool, weight: float) -> tuple[OwnClock | None, list[np.ndarray]]:
    made = [logged(motion, seed + k, own_clock=own_clock, weight=weight) for k, motion in enumerate(motions())]
    recordings = [recording for recording, _ in made]
    rows = rows_of(recordings, NAMES)
    assert rows is not None
    return own_clock_of(recordings, NAMES, rows), [newest for _, newest in made]


@pytest.mark.parametrize("seed", [1, 11, 21])
def test_means_of_two_samples_of_a_part_with_its_own_clock_are_told_apart_row_by_row(seed):
    clock, newest = found(seed, own_clock=True, weight=0.5)
    assert clock is not None
    assert abs(clock.period_s - PERIOD) < 3.0 * clock.sd_s + 2e-3 * PERIOD
    for item, true in zip(clock.shown, newest, strict=True):
        assert np.mean(np.diff(item.newest) == np.diff(true)) > 0.98
        assert item.loop_s == pytest.approx(LOOP, rel=0.01)
        assert item.lost == pytest.approx(0.2, abs=0.05)
        counted, here = item.left
        # the readings' own noise is 0.1 uT on each axis
        assert here < 0.3 < counted


@pytest.mark.parametrize("seed", range(1, 41, 8))
@pytest.mark.parametrize("own_clock", [False, True])
def test_lost_rows_alone_ask_for_no_means(seed, own_clock):
    assert found(seed, own_clock=own_clock, weight=0.0)[0] is None


def test_rows_are_put_where_their_samples_were_taken():
    clock, newest = found(5, own_clock=True, weight=0.5)
    assert clock is not None
    recording = logged(motions()[0], 5, own_clock=True, weight=0.5)[0]
    counted = clock.counted(recording, NAMES[0])
    assert counted is not None
    times = counted.samples["magnetometer"].t
    # the mean time of two samples: half a period behind the newest, or a whole one where one was skipped
    behind = (times - times[0]) - (newest[0] - newest[0][0]) * PERIOD
    assert np.quantile(np.abs(behind), 0.95) < 0.55 * PERIOD
    assert clock.counted(recording, "another") is None
