"""When readings were made: rows that are lost or late, parts with a clock of their own, rows that are means."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.effects.catalogue import CATALOGUE, effect
from discsim.environment import Environment
from discsim.motion import Motion
from discsim.sensors import Accelerometer, Gyroscope, Instruments, Magnetometer, Sampling
from discsim.sensors.instruments import record

RATE, SPIN, LOOP = 100.0, 50.0, 0.01


def spinning(duration: float = 2.0) -> Motion:
    t = np.linspace(0.0, duration, 4001)
    psi = SPIN * t
    zero = np.zeros((t.size, 3))
    attitude = np.column_stack([np.cos(psi / 2), 0 * t, 0 * t, np.sin(psi / 2)])
    rate = np.column_stack([0 * t, 0 * t, np.full(t.size, SPIN)])
    return Motion(t, zero, zero, zero, attitude, rate, zero, Environment(magnetic_field=np.array([20.0, 0.0, 45.0])))


def recorded(*effects, seed: int = 1):
    sampling = Sampling(RATE)
    module = Instruments(
        {
            "magnetometer": Magnetometer(sampling),
            "accelerometer": Accelerometer(sampling),
            "gyroscope": Gyroscope(sampling),
        }
    ).with_effects(effects)
    return record(spinning(), module, np.random.default_rng(seed), plant="free_spin", name="made")


def phase_times(recording) -> np.ndarray:
    """When each row's field was made, from its phase."""
    m = recording.samples["magnetometer"].value
    return -np.unwrap(np.arctan2(m[:, 1], m[:, 0])) / SPIN


def test_lost_rows_last_whole_steps_for_all_sensors_alike():
    recording = recorded(effect("clock.lost_rows", fraction=0.2))
    steps = np.diff(phase_times(recording)) / LOOP
    assert steps == pytest.approx(np.rint(steps), abs=1e-6)
    assert np.mean(steps) == pytest.approx(1.25, abs=0.1)
    lengths = {len(samples) for samples in recording.samples.values()}
    assert len(lengths) == 1
    assert np.diff(recording.samples["gyroscope"].t) == pytest.approx(LOOP)


def test_late_rows_come_a_tick_late_and_none_is_lost():
    late = phase_times(recorded(effect("clock.late_rows", tick_s=0.004, fraction=0.3)))
    even = phase_times(recorded())
    off = (late - even)[:-1]
    assert late.size == even.size
    assert np.minimum(np.abs(off), np.abs(off - 0.004)).max() < 1e-6
    assert np.mean(off > 0.002) == pytest.approx(0.3, abs=0.1)


def test_a_part_that_runs_freely_shows_whole_periods_of_its_own():
    period = 0.0094
    newest = phase_times(recorded(effect("mag.own_clock", period_s=period)))[1:]
    steps = np.diff(newest) / period
    assert steps == pytest.approx(np.rint(steps), abs=1e-6)
    assert set(np.rint(steps)) == {1.0, 2.0}
    age = recorded().samples["magnetometer"].t[1:] - newest
    assert age.min() > -1e-9
    assert age.max() < period


def test_a_chip_with_its_own_clock_keeps_both_of_its_sensors_together():
    recording, even = recorded(effect("imu.own_clock", period_s=0.0096)), recorded()
    same = recording.samples["magnetometer"].value, even.samples["magnetometer"].value
    assert same[0] == pytest.approx(same[1])
    module = Instruments({"gyroscope": Gyroscope(Sampling(RATE)), "accelerometer": Accelerometer(Sampling(RATE))})
    module = module.with_effects([effect("imu.own_clock", period_s=0.0096)])
    times = [
        sensor.sampling.instants(0.0, 1.0, np.random.default_rng(k))[1]
        for k, sensor in enumerate(module.sensors.values())
    ]
    assert times[0] == pytest.approx(times[1])


def test_a_mean_of_two_samples_is_late_by_half_a_step_and_smaller():
    mean, sound = recorded(effect("mag.average", weight=0.5)), recorded()
    late = (phase_times(sound) - phase_times(mean))[1:]
    assert late == pytest.approx(0.5 * LOOP, abs=1e-6)
    size = np.linalg.norm(mean.samples["magnetometer"].value[1:, :2], axis=1)
    assert size == pytest.approx(20.0 * np.cos(0.5 * SPIN * LOOP), abs=1e-6)


def test_a_mean_is_of_the_loop_s_steps_whether_or_not_they_wrote_a_row():
    both = recorded(effect("mag.average", weight=0.5), effect("clock.lost_rows", fraction=0.3))
    size = np.linalg.norm(both.samples["magnetometer"].value[1:, :2], axis=1)
    assert size == pytest.approx(20.0 * np.cos(0.5 * SPIN * LOOP), abs=1e-6)


@pytest.mark.parametrize("id", ["mag.mount", "gyro.mount", "accel.mount"])
def test_a_sensor_turned_in_its_board_shows_the_same_vectors_along_other_axes(id):
    sensor = {"mag": "magnetometer", "gyro": "gyroscope", "accel": "accelerometer"}[id.partition(".")[0]]
    turned, sound = recorded(effect(id, rx_rad=0.3, ry_rad=-0.2, rz_rad=0.1)), recorded()
    v, w = turned.samples[sensor].value, sound.samples[sensor].value
    assert np.linalg.norm(v, axis=1) == pytest.approx(np.linalg.norm(w, axis=1), rel=1e-6)
    assert np.abs(v - w).max() > 0.1
    others = set(sound.samples) - {sensor}
    assert all(turned.samples[name].value == pytest.approx(sound.samples[name].value) for name in others)


def test_a_gyroscope_shows_a_share_of_the_spin_on_its_other_axes():
    w = recorded(effect("gyro.cross_axis", sxz=0.0064, syz=-0.002)).samples["gyroscope"].value
    assert w[:, 0] == pytest.approx(0.0064 * SPIN)
    assert w[:, 1] == pytest.approx(-0.002 * SPIN)
    assert w[:, 2] == pytest.approx(SPIN)


def test_what_is_counted_row_by_row_is_left_to_its_detector():
    counted = [id for id, row in CATALOGUE.items() if row.detector == "row_times"]
    assert counted == ["clock.lost_rows", "clock.late_rows", "mag.own_clock", "imu.own_clock", "mag.average"]
