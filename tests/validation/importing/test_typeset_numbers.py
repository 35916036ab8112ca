"""Numbers as spreadsheets and web pages set them: a minus that is no hyphen, a raised mark between thousands."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.validation.importing.imported_log import import_log

LOG = made_log()
CELLS = np.column_stack([1000.0 * LOG.t, LOG.gyro / DEG, LOG.accel / G0, LOG.mag])
NAMES = "ms;gx [dps];gy [dps];gz [dps];ax [g];ay [g];az [g];mx [uT];my [uT];mz [uT]"


def test_a_minus_and_a_mark_between_thousands_are_read(tmp_path):
    lines = [";".join(f"{cell:,.4f}" for cell in row).replace("-", "\u2212").replace(",", "\u2019") for row in CELLS]
    raw = tmp_path / "table.csv"
    raw.write_text("\n".join([NAMES, *lines, ""]), encoding="utf-8")
    samples = import_log(raw).recordings[0].samples
    for sensor, values in (("gyroscope", LOG.gyro), ("accelerometer", LOG.accel), ("magnetometer", LOG.mag)):
        assert_allclose(samples[sensor].value, values, atol=1e-3)


def test_whole_nanotesla_are_no_counts_of_a_part(tmp_path):
    cells = np.column_stack([CELLS[:, :7], np.round(1000.0 * LOG.mag)])
    raw = tmp_path / "nt.csv"
    lines = [",".join(f"{cell:.10g}" for cell in row) for row in cells]
    raw.write_text("\n".join(["ms,gx,gy,gz,ax,ay,az,mx,my,mz", *lines, ""]))
    log = import_log(raw)
    assert "magnetometer unit: nT (likely" in log.summary()
    assert_allclose(log.recordings[0].samples["magnetometer"].value, LOG.mag, atol=1e-3)
