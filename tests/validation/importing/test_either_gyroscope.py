"""Threes of columns without telling names of which two read like a gyroscope's: the first is not simply taken."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, made_log, three, write_table

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
#: what a phone makes of its accelerometer: gravity, as it lay, taken off
LINEAR = LOG.accel - np.mean(LOG.accel[:200], axis=0)
TABLE = {"accel": LOG.accel, "linear": LINEAR, "gyro": LOG.gyro / DEG}


def written(path, order: str, names: str = "c{}", header: bool = False):
    columns = [("t", LOG.t)]
    for k, kind in enumerate(order.split()):
        columns += three([names.format(f"{k + 1}{axis}") for axis in "xyz"], TABLE[kind])
    return write_table(path, columns, header=header)


@pytest.mark.parametrize("order", ["accel linear gyro", "linear accel gyro", "gyro linear accel", "gyro accel linear"])
def test_an_acceleration_without_gravity_is_no_gyroscope(tmp_path, order):
    """It stood beside the accelerometer, was nothing at rest, and was taken: a spin of 40 rad/s came in as 0.3."""
    samples = import_log(written(tmp_path / "log.csv", order)).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-4)


def test_of_two_that_read_like_a_gyroscope_none_is_taken(tmp_path):
    raw = written(tmp_path / "log.csv", "linear gyro")
    with pytest.raises(InputError, match="'c2, c3, c4' and 'c5, c6, c7' read as a gyroscope's do alike"):
        import_log(raw)


def test_names_for_the_one_of_two_let_it_be_read(tmp_path):
    raw = written(tmp_path / "log.csv", "linear gyro")
    raw.write_text(f"t,lx,ly,lz,gx,gy,gz\n{raw.read_text()}")
    found = import_log(raw).recordings[0].samples
    assert_allclose(found["gyroscope"].value, LOG.gyro, atol=1e-4)


def test_a_column_that_only_ascends_is_no_axis(tmp_path):
    """A clock of tenths of a second stood in front, and was a magnetometer's x."""
    tenths = np.floor(10 * LOG.t) / 10
    value = np.array([3000.0, -400.0, 2600.0]) + 30.0 * LOG.gyro
    raw = write_table(tmp_path / "log.csv", [("t", tenths), *three(["x", "y", "z"], value)], header=False, digits=1)
    with pytest.raises(InputError, match=r"its columns may be 'c1,mx,my,mz'"):
        import_log(raw)


# ----------------------------------------------------------------------------- what a refusal proposes


def test_a_refusal_shows_the_line_of_names_to_put_above(tmp_path):
    """With it, corrected where it is wrong, the log is read."""
    value = 900.0 * LOG.accel + 3000.0
    columns = [
        ("t", LOG.t),
        *three(["u1", "u2", "u3"], value),
        *three(["w1", "w2", "w3"], 3000.0 * LOG.accel + 70000.0),
    ]
    raw = write_table(tmp_path / "log.csv", columns, header=False)
    with pytest.raises(InputError, match="its columns may be 'time,") as refused:
        import_log(raw)
    assert "'c2' to 'c4' are " in str(refused.value)
    assert " at rest and reach " in str(refused.value)
    raw.write_text(f"time,gx,gy,gz,mx,my,mz\n{raw.read_text()}")
    assert {"gyroscope", "magnetometer"} <= {*import_log(raw).recordings[0].samples}


def test_prices_of_one_day_get_no_line_of_names(tmp_path):
    rng = np.random.default_rng(0)
    words = [("day", [f"2025-06-{1 + k % 28:02d}" for k in range(60)])]
    raw = write_table(
        tmp_path / "log.csv", [*words, ("open", rng.normal(100, 3, 60)), ("close", rng.normal(100, 3, 60))]
    )
    with pytest.raises(InputError) as refused:
        import_log(raw)
    assert "its columns may be" not in str(refused.value)
