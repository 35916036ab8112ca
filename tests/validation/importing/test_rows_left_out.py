"""Rows of a log that were left out: told with the first of them and why, whether or not a map was named."""

from __future__ import annotations

import numpy as np

from discsim.validation.importing.imported_log import import_log


def test_a_damaged_log_without_a_map_is_told_by_its_first_damaged_line(tmp_path):
    t = np.arange(0.0, 4.0, 0.01)
    rates = 0.02 * np.random.default_rng(5).standard_normal((t.size, 3)) + [0.0, 0.0, 10.0]
    rows = [f"{at:.2f},{x:.4f},{y:.4f},{z:.4f}" for at, (x, y, z) in zip(t, rates, strict=True)]
    rows[40::10] = [row.rsplit(",", 1)[0] + ",ERR" for row in rows[40::10]]
    (tmp_path / "log.csv").write_text("\n".join(["time_s,gx (rad/s),gy (rad/s),gz (rad/s)", *rows, ""]))
    (said,) = (line for line in import_log(tmp_path / "log.csv").remarks if "were left out" in line)
    assert (
        "36 of the gyroscope's 400 rows were left out; the first at line 42 ('gz (rad/s)' is 'ERR', no number)" in said
    )
    assert "repairs.csv lists them" in said
    assert "right map" not in said
