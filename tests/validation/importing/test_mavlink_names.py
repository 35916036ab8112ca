"""Tables of MAVLink's messages of an IMU, as ground stations export them: xacc, ygyro, zmag, in whole mg and mrad/s."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import G0, made_log

from discsim.validation.importing.imported_log import import_log

LOG = made_log()


@pytest.mark.parametrize("prefix", ["", "SCALED_IMU.", "imu "])
def test_columns_with_the_axis_in_front_are_read_in_the_protocols_units(tmp_path, prefix):
    """Such a table had "no sensor of motion"; the field alone would take mrad/s for counts of a part, 6 % off."""
    counts = np.round(np.column_stack([1e3 * LOG.gyro, 1e3 * LOG.accel / G0, 10.0 * LOG.mag])).astype(int)
    head = ["time_boot_ms", *(f"{prefix}{axis}{what}" for what in ("gyro", "acc", "mag") for axis in "xyz")]
    rows = [f"{1e3 * t:.0f},{','.join(map(str, row))}" for t, row in zip(LOG.t, counts, strict=True)]
    (tmp_path / "log.csv").write_text("\n".join([",".join(head), *rows, ""]))
    done = import_log(tmp_path / "log.csv")
    (recording,) = done.recordings
    assert [f'unit = "{unit}"' in done.map_text for unit in ("mrad/s", "mg", "mgauss")] == [True] * 3
    assert_allclose(recording.samples["gyroscope"].value, LOG.gyro, atol=1e-3)
    assert_allclose(recording.samples["accelerometer"].value, LOG.accel, atol=0.01)
    assert_allclose(recording.samples["magnetometer"].value, LOG.mag, atol=0.1)


def test_such_names_beside_numbers_with_decimals_are_of_no_protocol(tmp_path):
    head = ["time_ms", *(f"{axis}{what}" for what in ("gyro", "acc", "mag") for axis in "xyz")]
    cells = np.column_stack([1e3 * LOG.t, np.degrees(LOG.gyro), LOG.accel / G0, LOG.mag])
    rows = [",".join(f"{cell:.5f}" for cell in row) for row in cells]
    (tmp_path / "log.csv").write_text("\n".join([",".join(head), *rows, ""]))
    (recording,) = import_log(tmp_path / "log.csv").recordings
    assert_allclose(recording.samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(recording.samples["accelerometer"].value, LOG.accel, atol=1e-3)
