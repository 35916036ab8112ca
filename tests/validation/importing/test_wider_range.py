"""Two sensors of a kind in one table: where the first stands at its limit, the one that reads on is taken."""

from __future__ import annotations

import numpy as np
import pytest
from support.made_logs import DEG, G0, made_log, three, write_table

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.names import read_name, sensor_of

LOG = made_log()
ACCEL = LOG.accel / G0
NARROW = float(np.quantile(np.abs(ACCEL).max(axis=1), 0.6))
WIDE = np.round(ACCEL / 0.049) * 0.049


def log(path, first, second, *, narrow=NARROW):
    columns = [("t_s", LOG.t), *three(first, np.clip(ACCEL, -narrow, narrow)), *three(second, WIDE)]
    return write_table(path, columns + three(["gx", "gy", "gz"], LOG.gyro / DEG))


@pytest.mark.parametrize(
    ("first", "second"),
    [("ax,ay,az", "high_g_x,high_g_y,high_g_z"), ("acc_x,acc_y,acc_z", "acc2_x,acc2_y,acc2_z")],
)
def test_the_one_that_reads_on_is_taken(tmp_path, first, second):
    whole = import_log(log(tmp_path / "log.csv", first.split(","), second.split(",")))
    said = whole.summary()
    assert (
        f"accelerometer: {second.replace(',', ', ')} (likely: {first.replace(',', ', ')} stand at their limit" in said
    )
    assert f"left out: accelerometer in {first.replace(',', ', ')}" in said
    assert "gyroscope: gx, gy, gz (certain" in said


def test_the_first_is_taken_where_it_does_not_stand_at_its_limit(tmp_path):
    said = import_log(log(tmp_path / "log.csv", ["ax", "ay", "az"], ["hx", "hy", "hz"], narrow=1e3)).summary()
    assert "accelerometer: ax, ay, az (certain" in said


def test_one_that_stands_at_a_limit_of_the_same_size_is_not_wider(tmp_path):
    both = np.clip(ACCEL, -NARROW, NARROW)
    columns = [("t_s", LOG.t), *three(["ax", "ay", "az"], both), *three(["acc2_x", "acc2_y", "acc2_z"], 1000.0 * both)]
    path = write_table(tmp_path / "log.csv", columns + three(["gx", "gy", "gz"], LOG.gyro / DEG))
    assert "accelerometer: ax, ay, az (certain" in import_log(path).summary()


@pytest.mark.parametrize(
    ("name", "sensor"),
    [("high_g_x", "accelerometer"), ("LowG X (g)", "accelerometer"), ("highgyro_x", "gyroscope"), ("g_x", "gyroscope")],
)
def test_a_g_after_high_or_low_is_an_accelerometers(name, sensor):
    assert sensor_of(read_name(name).base) == sensor
