"""Without a magnetometer gravity in a hand, or the pull to the centre, tells a gyroscope's unit and a clock's ticks."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, RATE, made_log, three, write_table

from discsim.validation.importing.imported_log import import_log

LOG = made_log()
HANDLED = slice(0, 770)  # rest, and a hand that turns it about all axes: no throw
FLIGHT = slice(810, 1390)


def write(path, gyro, accel, kept=slice(None), clock=("t_s", 1.0), unit="rad_s", before="", mag=None):
    name, scale = clock
    columns = [(name, LOG.t[kept] * scale), *three([f"gyro_{axis}_{unit}" for axis in "xyz"], gyro[kept])]
    columns += three([f"acc_{axis}_g" for axis in "xyz"], accel[kept] / G0)
    columns += [] if mag is None else three(["mag_x_uT", "mag_y_uT", "mag_z_uT"], mag[kept])
    return write_table(path, columns, before=before)


def test_deg_s_under_a_header_of_rad_s_are_told_by_gravity_that_a_hand_turns(tmp_path):
    """The slow turns were taken for 100 rad/s."""
    slow = LOG.gyro / DEG * 0.4
    assert np.abs(slow[HANDLED]).max() < 100.0
    accel = slowly_handled()
    raw = write(tmp_path / "log.csv", slow, accel, HANDLED)
    whole = import_log(raw)
    assert_allclose(whole.recordings[0].samples["gyroscope"].value, slow[HANDLED] * DEG, atol=1e-5)
    assert "gyroscope unit: deg/s (likely: gravity turns as fast as deg/s would, although the header says rad/s)" in (
        whole.summary()
    )


def slowly_handled() -> np.ndarray:
    """Return gravity (n, 3) m/s^2 in a body that turns at 0.4 of the made log's rates."""
    rng = np.random.default_rng(2)
    force, found = np.array([0.0, 0.0, -G0]), []
    for rate in 0.4 * LOG.gyro:
        found.append(force)
        force = force - np.cross(rate, force) / RATE
    return np.array(found) + 0.03 * rng.standard_normal((LOG.t.size, 3))


def test_a_right_unit_is_borne_out_by_gravity(tmp_path):
    whole = import_log(write(tmp_path / "log.csv", LOG.gyro, LOG.accel))
    assert "gyroscope unit: rad/s (certain: the header says so, and gravity turns as fast)" in whole.summary()


def test_deg_s_under_a_header_of_rad_s_are_told_by_the_pull_on_a_slow_turntable(tmp_path):
    t, rng = np.arange(0, 20, 0.01), np.random.default_rng(1)
    rate = np.interp(t, [0, 2, 15, 20], [0.0, 85.0, 60.0, 0.0]) * DEG
    gyro = np.column_stack([0 * t, 0 * t, rate]) + 0.002 * rng.standard_normal((t.size, 3))
    accel = np.column_stack([0.3 * rate**2, 0 * t, 0 * t - G0]) + 0.01 * rng.standard_normal((t.size, 3))
    columns = [("t_s", t), *three([f"gyro_{axis} (rad/s)" for axis in "xyz"], gyro / DEG)]
    whole = import_log(write_table(tmp_path / "log.csv", columns + three(["ax", "ay", "az"], accel)))
    assert "gyroscope unit: deg/s (likely: the pull to the centre is that of 3" in whole.summary()
    assert_allclose(whole.recordings[0].samples["gyroscope"].value, gyro, atol=1e-5)


def test_where_nothing_tells_that_is_said(tmp_path):
    """It does not even wobble."""
    steady = LOG.gyro[FLIGHT] * [0.0, 0.0, 1.0] + np.random.default_rng(1).normal(0, 0.003, LOG.gyro[FLIGHT].shape)
    columns = [("t_s", LOG.t[FLIGHT]), *three([f"gyro_{axis}_rad_s" for axis in "xyz"], steady)]
    told = import_log(write_table(tmp_path / "log.csv", columns)).summary()
    assert "whether it is deg/s, up to 40 deg/s, nothing here tells" in told


@pytest.mark.parametrize("field", [False, True])
@pytest.mark.parametrize(("scale", "power"), [(1e4, "0.1"), (1e2, "10")])
def test_stamps_ten_times_too_long_or_short_are_told(tmp_path, scale, power, field):
    """Ticks of 0.1 ms and of 10 ms under the name of milliseconds."""
    raw = write(tmp_path / "log.csv", LOG.gyro / DEG, LOG.accel, clock=("t_ms", scale), unit="dps",
                mag=LOG.mag if field else None)  # fmt: skip
    (line,) = [note for note in import_log(raw).notes if "times as fast as the gyroscope says" in note]
    assert line.startswith(f"WARNING: {'the field' if field else 'gravity'} turns ")
    assert f"the pull to the centre shows that the rows are {power} times as far apart as 't_ms' in ms says" in line


def test_a_rate_that_is_stated_and_contradicts_the_stamps_is_told(tmp_path):
    raw = write(tmp_path / "log.csv", LOG.gyro / DEG, LOG.accel, FLIGHT, ("t_ms", 1e4), "dps", "# fs = 200 Hz\n")
    told = import_log(raw).notes
    assert any("'t_ms' in ms makes 20 rows a second, but '# fs = 200 Hz' says 200" in note for note in told)
    right = write(tmp_path / "right.csv", LOG.gyro / DEG, LOG.accel, FLIGHT, ("t_ms", 1e3), "dps", "# fs = 200 Hz\n")
    assert not any("WARNING" in note for note in import_log(right).notes)
