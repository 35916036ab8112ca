"""Free spins as a logger's loop writes them beside a magnetometer that free-runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from discsim.recording import Recording, Samples
from discsim.sensors.sampling import Noise, Sampling
from support.made import MODULE, throws

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


def logged(
    recording: Recording,
    seed: int,
    *,
    own_clock: bool,
    weight: float,
    chip: float | None = None,
    late: tuple[float, float] | None = None,
) -> tuple[Recording, np.ndarray]:
    """Return what a loop writes of a motion that loses a fifth of its rows, and the newest sample of each row.

    Gyroscope and accelerometer are read in step with the loop, or free-run with the period of a ``chip``, s. Where rows
    come ``late`` by a tick, s, a share of them, none is lost.
    """
    rng = np.random.default_rng(seed)
    steps = np.arange(2, int(1.9 / LOOP))
    kept = steps[rng.random(steps.size) > 0.2] if late is None else steps
    phase = rng.uniform(0.0, PERIOD)
    asked = LOOP * np.arange(steps[-1] + 1.0)
    if late is not None:
        asked += late[0] * (rng.random(asked.size) < late[1])

    def sampled(step: np.ndarray) -> np.ndarray:
        t = asked[step]
        return phase + PERIOD * np.floor((t - phase) / PERIOD) if own_clock else t

    read = asked[kept]
    if chip is not None:
        began = rng.uniform(0.0, chip)
        read = began + chip * np.floor((read - began) / chip)
    samples = {}
    for name, own in recording.samples.items():

        def at(t: np.ndarray, own: Samples = own) -> np.ndarray:
            return np.column_stack([np.interp(t, own.t, column) for column in own.value.T])

        if name == "magnetometer":
            value = (1.0 - weight) * at(sampled(kept)) + weight * at(sampled(kept - 1))
            value = np.round((value + rng.normal(0.0, 0.1, value.shape)) / 0.01) * 0.01
        else:
            value = at(read)
        samples[name] = Samples(LOOP * np.arange(kept.size), value)
    return replace(recording, samples=samples), np.rint((sampled(kept) - phase) / PERIOD).astype(int)


def chip_times(seed: int, chip: float) -> np.ndarray:
    """Return when a chip of a period made what each row shows that `logged` writes with it, s."""
    rng = np.random.default_rng(seed)
    steps = np.arange(2, int(1.9 / LOOP))
    kept = steps[rng.random(steps.size) > 0.2]
    rng.uniform(0.0, PERIOD)
    began = rng.uniform(0.0, chip)
    return np.asarray(began + chip * np.floor((kept * LOOP - began) / chip))


def ages(seed: int) -> np.ndarray:
    """Return how old the newest sample of the field is in each row that `logged` writes in step with the loop, s."""
    rng = np.random.default_rng(seed)
    steps = np.arange(2, int(1.9 / LOOP))
    kept = steps[rng.random(steps.size) > 0.2]
    return np.asarray((kept * LOOP - rng.uniform(0.0, PERIOD)) % PERIOD)


def without_wobble(recordings: Sequence[Recording], seed: int) -> list[Recording]:
    """Return recordings whose gyroscope reads nothing but noise across the axis."""
    rng = np.random.default_rng(seed)

    def steady(one: Recording) -> Recording:
        rates = one.samples["gyroscope"]
        value = rates.value.copy()
        value[:, :2] = rng.normal(0.0, 0.01, (len(rates), 2))
        return replace(one, samples={**one.samples, "gyroscope": Samples(rates.t, value)})

    return [steady(one) for one in recordings]
