"""A gyroscope in no stated unit, or a wrong one: what swings once a turn tells how fast it turns."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import G0, three, write_table

from discsim.validation.importing.imported_log import import_log

RATE = 100.0


def throw(spin=25.0, seconds=2.5, arm=0.016, noise=0.002):
    """Times (n,) s, rates (n, 3) rad/s and forces (n, 3) m/s^2 of a disc that wobbles, its board's z along the axis."""
    rng = np.random.default_rng(4)
    t = np.arange(int(seconds * RATE)) / RATE
    rate = spin * np.exp(-0.03 * t)
    turn = spin * (1 - np.exp(-0.03 * t)) / 0.03
    gyro = np.column_stack([0.8 * np.cos(0.92 * turn), 0.8 * np.sin(0.92 * turn), rate])
    accel = np.column_stack([arm * rate**2 + 2 * np.cos(turn), -2 * np.sin(turn), np.full(t.size, 0.7 * G0)])
    return t, gyro + rng.normal(0, noise, gyro.shape), accel + rng.normal(0, 0.03, accel.shape)


def written(path, t, gyro, accel=None, gyro_names="g{}"):
    columns = [("t", t), *([] if accel is None else three(["ax", "ay", "az"], accel))]
    return write_table(path, [*columns, *three([gyro_names.format(axis) for axis in "xyz"], gyro)], digits=5)


@pytest.mark.parametrize("noise", [0.002, 0.02])
def test_a_slow_throw_alone_is_in_radians(tmp_path, noise):
    """Four turns a second pull by a g alone, and its noise is as large as a gyroscope's in deg/s."""
    t, gyro, accel = throw(noise=noise)
    whole = import_log(written(tmp_path / "log.csv", t, gyro, accel))
    assert_allclose(np.abs(whole.recordings[0].samples["gyroscope"].value[:, 2]), np.abs(gyro[:, 2]), atol=1e-4)
    assert len(whole.throws) == 1


def test_so_is_one_beside_forces_in_g(tmp_path):
    t, gyro, accel = throw(spin=31.0, noise=0.02)
    whole = import_log(written(tmp_path / "log.csv", t, gyro, accel / G0))
    assert_allclose(np.abs(whole.recordings[0].samples["gyroscope"].value[:, 2]), np.abs(gyro[:, 2]), atol=1e-4)
    assert_allclose(np.abs(whole.recordings[0].samples["accelerometer"].value[:, 2]), np.abs(accel[:, 2]), atol=1e-3)


def test_so_is_a_gyroscope_alone_of_the_letter_g(tmp_path):
    t, gyro, _ = throw(noise=0.02)
    whole = import_log(written(tmp_path / "log.csv", t, gyro))
    assert "gyroscope unit: rad/s (likely: in rad/s it makes 10 turns, and what swings across" in whole.summary()
    assert list(whole.recordings[0].samples) == ["gyroscope"]


def test_a_header_of_degrees_is_refuted_by_swing_and_pull(tmp_path):
    t, gyro, accel = throw(spin=31.0)
    whole = import_log(written(tmp_path / "log.csv", t, gyro, accel, "g{}_dps"))
    assert "although the header says deg/s" in whole.summary()
    assert_allclose(np.abs(whole.recordings[0].samples["gyroscope"].value[:, 2]), np.abs(gyro[:, 2]), atol=1e-4)


@pytest.mark.parametrize("swing", [0.0, 1.0])
def test_a_slow_turn_by_hand_stays_in_degrees(tmp_path, swing):
    """It does not swing once a turn of readings in rad/s: it is still, or nods twice a second."""
    t, gyro, _ = throw()
    gyro[:, 0], gyro[:, 1] = swing * 5 * np.sin(4 * np.pi * t), 0.0
    gyro += np.random.default_rng(1).normal(0, 0.2, gyro.shape)
    whole = import_log(written(tmp_path / "log.csv", t, gyro))
    assert "gyroscope unit: deg/s (guess" in whole.summary()


def test_a_header_of_degrees_stands_where_nothing_pulls(tmp_path):
    """What shakes so on a table that turns slowly is its motor."""
    t, gyro, accel = throw(noise=0.05)
    accel[:] = np.array([0.5, 0.0, 9.8]) + np.random.default_rng(1).normal(0, 0.03, accel.shape)
    whole = import_log(written(tmp_path / "log.csv", t, gyro, accel, "g{}_dps"))
    assert "gyroscope unit: deg/s (certain: the header says so" in whole.summary()


def test_a_stated_unit_that_the_swing_bears_out_is_in_no_doubt(tmp_path):
    t, gyro, _ = throw(spin=31.0)
    whole = import_log(written(tmp_path / "log.csv", t, gyro, gyro_names="g{}_rad_s"))
    assert "gyroscope unit: rad/s (certain: the header says so" in whole.summary()
