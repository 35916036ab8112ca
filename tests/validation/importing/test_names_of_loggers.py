"""Names that loggers of one maker have: a time of the GPS week, hx hy hz of a magnetometer."""

from __future__ import annotations

import pytest
from numpy.testing import assert_allclose
from support.made_logs import made_log, three, write_table

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.names import is_time_name, read_name, sensor_of

LOG = made_log()


@pytest.mark.parametrize(
    ("name", "is_one"), [("GPS TOW", True), ("iTOW", True), ("tow_ms", True), ("towards", False), ("UTC_Nano", True)]
)
def test_a_time_of_the_week_is_a_time(name, is_one):
    assert is_time_name(name) is is_one


def test_a_magnetometer_may_be_called_h():
    assert [sensor_of(name) for name in ("h", "H", "hour")] == ["magnetometer", "magnetometer", None]


def test_the_week_s_time_in_the_third_column_is_that_of_the_rows(tmp_path):
    """As MicroStrain's SensorConnect writes a log: rows were taken as 0.01 s apart."""
    columns = [("GPS TFlags", [6] * LOG.t.size), ("GPS Week", [2312] * LOG.t.size), ("GPS TOW", 482531.25 + LOG.t)]
    columns += three([f"{axis} Accel [x8004]" for axis in "XYZ"], LOG.accel)
    columns += three([f"{axis} Gyro [x8005]" for axis in "XYZ"], LOG.gyro)
    columns += three([f"h{axis}" for axis in "xyz"], LOG.mag)
    above = "INFO,3DM-GX5-25,6254.12345\n\nDATA_START\n"
    log = import_log(write_table(tmp_path / "log.csv", columns, before=above))
    (recording,) = log.recordings
    assert_allclose(recording.samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(recording.samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(recording.samples["accelerometer"].value, LOG.accel, atol=1e-5)
    (named,) = [decision for decision in log.decisions if decision.what == "magnetometer"]
    assert (named.choice, named.sure) == ("hx, hy, hz", "certain")


@pytest.mark.parametrize("axis", range(3))
def test_the_y_of_velocity_is_no_axis(axis):
    name = read_name(f"{'XYZ'[axis]}-axis angular velocity (°/s)")
    assert (name.axis, sensor_of(name.base)) == (axis, "gyroscope")
