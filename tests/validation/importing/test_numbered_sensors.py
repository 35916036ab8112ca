"""A long table whose rows are numbered by sensor (`sensor` of 1, 2, 3): each is told by its readings, none mixed."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log, three, write_table

from discsim.validation.importing.imported_log import import_log

LOG = made_log()


def test_sensors_that_are_numbers_are_not_mixed(tmp_path):
    """Their rows came in as one gyroscope's, two thirds of them left out."""
    value = np.stack([LOG.gyro / DEG, LOG.accel / G0, LOG.mag], axis=1).reshape(-1, 3)
    columns = [("sensor", np.tile([1, 2, 3], LOG.t.size)), ("ms", np.repeat(LOG.t * 1000, 3))]
    read = import_log(write_table(tmp_path / "log.csv", columns + three(["x", "y", "z"], value))).recordings[0].samples
    assert_allclose(np.abs(read["gyroscope"].value), np.abs(LOG.gyro), atol=1e-5)
    assert_allclose(np.abs(read["accelerometer"].value), np.abs(LOG.accel), atol=1e-4)
    assert_allclose(np.abs(read["magnetometer"].value), np.abs(LOG.mag), atol=1e-4)
