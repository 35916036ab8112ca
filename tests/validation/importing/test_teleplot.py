"""What Teleplot writes: a sensor's axes in rows of their own, and seconds under a name that says ms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.validation.importing.imported_log import import_log

LOG = made_log()
NAMES = ["Altitude", *(f"{sensor} {axis}" for sensor in ("Accel", "Gyro", "Mag") for axis in "XYZ"), "Uptime"]


def written(per: float) -> str:
    """Return a table of what came within each millisecond, its time in units of ``per`` s."""
    rng = np.random.default_rng(4)
    lines = ["timestamp(ms)," + ",".join(NAMES) + ","]
    for t, *values in zip(LOG.t, LOG.accel / G0, LOG.gyro / DEG, LOG.mag, strict=True):
        cells = ["1.2", *(f"{x:.4f}" for value in values for x in value), f"{1000 * t:.0f}"]
        at, first = 1721516629.0 + t, 0
        while first < len(cells):
            stop = min(first + int(rng.integers(2, 7)), len(cells))
            row = [f'"{cell}"' if first <= k < stop else "" for k, cell in enumerate(cells)]
            lines.append(f'"{at / per:.{3 if per == 1 else 0}f}",' + ",".join(row) + ",")
            at, first = at + 0.001, stop
    return "\n".join([*lines, ""])


@pytest.mark.parametrize("per", [1.0, 1e-3])
def test_axes_in_several_rows_are_one_reading(tmp_path, per):
    raw = tmp_path / "teleplot_2026-7-21.csv"
    raw.write_text(written(per))
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert f"rows joined to {LOG.t.size} records" in found.summary()
    assert samples["gyroscope"].t.size == LOG.t.size
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-5)
    assert_allclose(samples["accelerometer"].value[:, 2], LOG.accel[:, 2], atol=1e-3)
    # most of a record came up to four rows of 1 ms late
    assert_allclose(samples["gyroscope"].t - samples["gyroscope"].t[0], LOG.t, atol=5e-3)
