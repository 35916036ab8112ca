"""A latitude and a longitude in one cell, as radio transmitters log them, are read as a fix."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log, three, write_table

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.other_forms.pair_cells import begins

LOG = made_log()
#: a fix every 0.2 s: metres north and east of the first one
FIX = np.floor(LOG.t / 0.2)


def table(path, cells):
    columns = [
        ("time", LOG.t),
        ("GPS", cells),
        ("Alt(m)", 430.0 + 0.1 * FIX),
        *three(["AccX(g)", "AccY(g)", "AccZ(g)"], LOG.accel / G0),
        *three(["GyrX(dps)", "GyrY(dps)", "GyrZ(dps)"], LOG.gyro / DEG),
    ]
    return write_table(path, columns)


@pytest.mark.parametrize("form", ["{:.7f} {:.7f}", '"{:.7f}, {:.7f}"', "({:.7f} {:.7f})"])
def test_two_numbers_in_a_cell_are_a_fix(tmp_path, form):
    """The column was no number, and was not even named as left out."""
    cells = [form.format(47.4 + 1e-5 * k, 8.5 + 2e-5 * k) for k in FIX]
    cells[:80] = [""] * 80  # no fix yet
    found = import_log(table(tmp_path / "log.csv", cells))
    gps = found.recordings[0].samples["gps"]
    # 1e-5 deg of latitude are 1.11 m, and 2e-5 deg of longitude 2.22 m times the cosine of 47.4 degrees
    assert_allclose(gps.value[-1, 0] / (gps.value.shape[0] - 1), 1.11, rtol=0.01)
    assert_allclose(gps.value[-1, 1] / (gps.value.shape[0] - 1), 2.22 * np.cos(47.4 * DEG), rtol=0.01)
    assert "'GPS' holds two numbers a cell; read as a latitude and a longitude" in found.summary()
    assert_allclose(found.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-5)


@pytest.mark.parametrize("cell", ["147.40001 8.50001", "47 8", "47.40001", "1.250 3.500", "0.1 0.2 0.3", ""])
def test_other_cells_are_left_as_they_are(tmp_path, cell):
    assert not begins(table(tmp_path / "log.csv", [cell] * LOG.t.size))
