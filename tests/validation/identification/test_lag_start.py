"""A lagging accelerometer in a free spin: what it still holds of the hand that threw dies away within the recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import DRIVER, MODULE

from discsim.effects.sensors import Lag, lag
from discsim.environment import Environment
from discsim.motion import Motion
from discsim.recording import Recording, Samples
from discsim.sensors import record
from discsim.validation.identification.gauss_newton import Fit, linearised, refit
from discsim.validation.identification.noise import GroupNoise
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants.free_spin import FREE_SPIN
from discsim.validation.identification.prediction import read
from discsim.validation.identification.segments import Trajectory, trajectory_of

SPIN, TAU, HELD = 60.0, 0.15, np.array([70.0, -35.0])
KEYS = FREE_SPIN.held_keys[:2]
TRUE = {("accel.lag", "tau_s"): TAU, **dict(zip(KEYS, HELD, strict=True))}
NOISE = {"magnetometer": GroupNoise(0.3), "accelerometer": GroupNoise(0.05), "gyroscope": GroupNoise(0.005)}


def thrown(tau: float = TAU) -> Recording:
    """Return a disc that spins steadily, as behind a low-pass that still holds the acceleration of a hand."""
    t = np.linspace(0.0, 1.5, 3001)
    zero = np.zeros((t.size, 3))
    attitude = np.column_stack([np.cos(0.5 * SPIN * t), 0 * t, 0 * t, np.sin(0.5 * SPIN * t)])
    rate = np.column_stack([0 * t, 0 * t, np.full(t.size, SPIN)])
    site = Environment(magnetic_field=np.array([20.0, 0.0, 45.0]), gravity=0.0)
    motion = Motion(t, zero, zero, zero, attitude, rate, zero, site)
    module = MODULE.without("gps").fitted("gyroscope", range=104.72)
    made = record(motion, module, np.random.default_rng(2), plant="free_spin", name="thrown", disc=DRIVER)
    felt = made.samples["accelerometer"]
    began = felt.value[0] + np.append(HELD, 0.0)
    late = lag(Lag(tau), felt.t, felt.value, began) if tau else felt.value
    return replace(made, samples={**made.samples, "accelerometer": Samples(felt.t, late)})


def trajectory(recording: Recording) -> Trajectory:
    """Return the trajectory of the true motion."""
    nodes = np.linspace(0.0, recording.end + 1e-6, 4)
    states = np.zeros((3, FREE_SPIN.layout.size))
    states[:, FREE_SPIN.layout.rate] = [0.0, 0.0, SPIN]
    states[:, 6], states[:, 9] = np.cos(0.5 * SPIN * nodes[:-1]), np.sin(0.5 * SPIN * nodes[:-1])
    return trajectory_of(recording, nodes, states)


def felt(current: Trajectory):
    return next(one for one in current.readings if one.sensor == "accelerometer")


def test_means_over_turns_show_a_start_that_dies_away():
    current = trajectory(thrown())
    readings = felt(current)
    left = readings.value - read(current, TRUE, readings)
    without = readings.value - read(current, {("accel.lag", "tau_s"): TAU}, readings)
    sd = np.median(np.abs(left[:, :2]))
    assert np.abs(left[:, :2]).max() < 0.1  # means of forty readings of 0.05 and more m/s^2
    assert np.abs(without[0, :2]).min() > 50.0 * sd
    assert readings.t[0] < 2.0 * TAU  # what the lag remembers takes part


def test_columns_of_the_start_and_of_the_time_constant_are_those_of_the_readings():
    current = trajectory(thrown())
    free = (Parameter("accel.lag", "tau_s", TAU, 1e-5), *(Parameter(*key, 0.0, 0.1, 100.0) for key in KEYS))
    fit = Fit((current,), free, np.array([TAU, *HELD]), FREE_SPIN.sizes.continuous, NOISE)
    (linear,) = linearised(fit)
    readings = felt(current)
    for j, (key, h) in enumerate(zip([q.key for q in free], (1e-6, 0.1, 0.1), strict=True)):
        up, down = (read(current, {**TRUE, key: TRUE[key] + s * h}, readings) for s in (1.0, -1.0))
        slope = (up - down) / (2.0 * h)
        for channel in linear.channels:
            if channel.sensor == "accelerometer":
                expected = slope[channel.index, readings.axes.index(channel.axis)]
                assert linear.common[channel.rows, j] == pytest.approx(expected, abs=2e-3 * np.abs(slope).max())


@pytest.mark.parametrize("start", [0.08, 0.25])
def test_a_fit_finds_the_time_constant_with_any_start(start):
    current = trajectory(thrown())
    free = (Parameter("accel.lag", "tau_s", start, 1e-4), *(Parameter(*key, 0.0, 0.1, 100.0) for key in KEYS))
    fit = Fit((current,), free, np.array([start, 0.0, 0.0]), FREE_SPIN.sizes.continuous, NOISE)
    found = refit(fit, iterations=6)
    sd = np.sqrt(np.diag(found.covariance))
    assert found.at[0] == pytest.approx(TAU, abs=4.0 * sd[0] + 1e-3)
    assert found.at[1:] == pytest.approx(HELD, abs=2.0)
    assert sd[0] < 0.01


def test_an_accelerometer_that_does_not_lag_holds_nothing():
    current = trajectory(thrown(0.0))
    readings = felt(current)
    held = dict(zip(KEYS, HELD, strict=True))
    assert read(current, held, readings) == pytest.approx(read(current, {}, readings))
