"""A log that holds a throw alone, with no rest: lift tells the accelerometer's unit, the field who turns."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log, three, write_table

from discsim.validation.importing.imported_log import import_log

LOG = made_log()
FLIGHT = slice(810, 1390)


def write(path, accel, names="a{}", gyro="g{}", mag=True, digits=6):
    columns = [("t_s", LOG.t[FLIGHT]), *three([gyro.format(a) for a in "xyz"], LOG.gyro[FLIGHT] / DEG)]
    columns += three([names.format(a) for a in "xyz"], accel[FLIGHT])
    columns += three(["mx", "my", "mz"], LOG.mag[FLIGHT]) if mag else []
    return write_table(path, columns, digits=digits)


@pytest.mark.parametrize(
    ("scale", "names"),
    [(1.0, "a{}"), (1 / G0, "a{}"), (1000 / G0, "a{}"), (1000 / G0, "acc_{}_g"), (1.0, "acc_{}_m_s2")],
)
def test_lift_tells_the_unit_where_nothing_rests(tmp_path, scale, names):
    """Four g of pull in g were taken for m/s^2, and 4000 mg under a header of g for as many g."""
    whole = import_log(write(tmp_path / "log.csv", LOG.accel * scale, names))
    assert_allclose(np.abs(whole.recordings[0].samples["accelerometer"].value), np.abs(LOG.accel[FLIGHT]), atol=1e-3)
    assert len(whole.throws) == 1


def test_it_is_said_that_lift_tells(tmp_path):
    told = import_log(write(tmp_path / "log.csv", LOG.accel / G0)).summary()
    assert "accelerometer unit: g (likely: nothing rests in it; along the axis of the spin it reads 0.9 g in it" in told


def test_counts_of_a_part_are_told_by_lift_to_a_factor_of_two(tmp_path):
    whole = import_log(write(tmp_path / "log.csv", np.round(LOG.accel / G0 * 2048), digits=0))
    assert "accelerometer unit: 1/2048 g a count (guess: nothing rests in it" in whole.summary()
    assert "it may be" in whole.summary()


def test_exchanged_names_are_told_by_who_turns_with_the_field(tmp_path):
    whole = import_log(write(tmp_path / "log.csv", LOG.accel / G0, "g{}", "a{}"))
    assert any("EXCHANGED" in note for note in whole.notes)
    assert_allclose(whole.recordings[0].samples["gyroscope"].value[:, 2], LOG.gyro[FLIGHT, 2], atol=1e-5)


def test_the_table_that_ros_makes_of_a_topic_is_read(tmp_path):
    """`velocity` and `linear` in its names stood for what is worked out."""
    names = [("field.angular_velocity", LOG.gyro), ("field.linear_acceleration", LOG.accel)]
    stamps = (1.75e18 + LOG.t * 1e9).astype(np.int64)
    columns = [("%time", stamps), ("field.header.seq", np.arange(LOG.t.size))]
    columns += three([f"field.orientation.{axis}" for axis in "xyz"], np.zeros_like(LOG.gyro))
    for name, value in names:
        columns += three([f"{name}.{axis}" for axis in "xyz"], value)
    whole = import_log(write_table(tmp_path / "imu.csv", columns))
    assert_allclose(np.abs(whole.recordings[0].samples["gyroscope"].value), np.abs(LOG.gyro), atol=1e-5)
    assert_allclose(np.abs(whole.recordings[0].samples["accelerometer"].value), np.abs(LOG.accel), atol=1e-5)
