"""Axes that stand still between two steps of a resolution: what their readings tell of the mean, and no more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from support.made import FIELD, RIG

from discsim.recording import Recording
from discsim.rig import spin_down
from discsim.sensors import Instruments, record
from discsim.sensors.sampling import Noise
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.relaxed_fit.coarse_steps import as_far_as_steps_tell
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.identification.gauss_newton import Fit, linearised
from discsim.validation.identification.noise import GroupNoise

STEP = 0.6
#: a third of a step above one: its readings are too low
DOWN = (np.ceil(FIELD.magnetic_field[2] / STEP) + 1.0 / 3.0) * STEP


def coasting(noise: float, *, down: float = DOWN, rates: Sequence[float] = (60.0, 40.0, 25.0)) -> list[Recording]:
    """Return rigs that coast in a field whose magnetometer, along the axis, reads it in coarse steps."""
    field = replace(FIELD, magnetic_field=np.array([*FIELD.magnetic_field[:2], down]))
    module = Instruments.from_parts("mpu9250").without("gyroscope")
    module = module.fitted("magnetometer", noise=Noise(noise), resolution=STEP)
    runs = []
    for k, rate in enumerate(rates):
        motion = spin_down(RIG, field, rate, 4.0, yaw=0.5 + k)
        runs.append(record(motion, module, np.random.default_rng(k), plant="spin_down", name=f"run-{k}", rig=RIG))
    return runs


def counting(recording: Recording, noise: float) -> np.ndarray:
    """Return how many readings of each axis of the magnetometer count beside the true motion."""
    trajectory = first_trajectory(recording)
    own = unknowns([recording])
    at = np.array([q.stated for q in own])
    fit = Fit((trajectory,), own, at, trajectory.plant.sizes.relaxed, {})
    (linear,) = linearised(fit, ())
    level = {c.group: GroupNoise(float(np.hypot(noise, STEP / np.sqrt(12.0)))) for c in linear.channels}
    kept = as_far_as_steps_tell(trajectory, linear, level)
    return np.sum(next(r for r in kept.readings if r.sensor == "magnetometer").good, axis=0)


def test_the_mean_of_readings_that_stand_between_two_steps_is_no_better_than_these_let_it():
    noise = 0.1
    (run,) = coasting(noise, rates=(40.0,))
    x, y, z = counting(run, noise)
    rows = len(run.samples["magnetometer"])
    assert x == y == rows
    off = STEP / np.pi * np.exp(-2.0 * np.pi**2 * noise**2 / STEP**2)
    assert z == pytest.approx((noise**2 + STEP**2 / 12.0) / off**2, abs=1.0)
    # the readings themselves are off by that much at most, and by far more than so many of them would be
    mean = float(np.mean(run.samples["magnetometer"].value[:, 2]))
    spread = float(np.std(run.samples["magnetometer"].value[:, 2])) / np.sqrt(rows)
    assert 5.0 * spread < abs(mean - DOWN) < 1.1 * off


def test_noise_of_half_a_step_spreads_readings_over_steps_and_all_count():
    (run,) = coasting(0.35, rates=(40.0,))
    assert counting(run, 0.35).tolist() == [len(run.samples["magnetometer"])] * 3


def test_a_field_that_stands_between_steps_is_no_other_field():
    """A blind case: 2400 readings of 39.0 and 39.6 uT, where 39.2 were, named a field of 0.9995 its size."""
    found = diagnose([coasting(0.1)], ["runs"]).diagnosis
    assert found.verdict == "consistent"
    assert found.effects == ()
