"""A long table whose rows are each of one sensor, by number or name: each is told by its readings, none mixed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, RELEASE, made_log, three, write_table

from discsim.recording import Samples
from discsim.validation.importing.imported_log import import_log

LOG = made_log()


def assert_as_made(read: Mapping[str, Samples]) -> None:
    assert_allclose(np.abs(read["gyroscope"].value), np.abs(LOG.gyro), atol=1e-5)
    assert_allclose(np.abs(read["accelerometer"].value), np.abs(LOG.accel), atol=1e-4)
    assert_allclose(np.abs(read["magnetometer"].value), np.abs(LOG.mag), atol=1e-4)


def test_sensors_that_are_numbers_are_not_mixed(tmp_path):
    """Their rows came in as one gyroscope's, two thirds of them left out."""
    value = np.stack([LOG.gyro / DEG, LOG.accel / G0, LOG.mag], axis=1).reshape(-1, 3)
    columns = [("sensor", np.tile([1, 2, 3], LOG.t.size)), ("ms", np.repeat(LOG.t * 1000, 3))]
    read = import_log(write_table(tmp_path / "log.csv", columns + three(["x", "y", "z"], value))).recordings[0].samples
    assert_as_made(read)


@pytest.mark.parametrize("name", ["t_us", "time"])
def test_rows_of_two_sensors_may_be_microseconds_apart(tmp_path, name):
    """40 us from a row to the next were taken for ms, against the header, and no throw was found."""
    made = made_log()
    lines = [f"sensor,{name},x,y,z"]
    for k, stamp in enumerate(np.round(1e6 * made.t).astype(int)):
        rows = [("ACC", made.accel[k] / G0), ("GYRO", made.gyro[k] / DEG)] + [("MAG", made.mag[k])] * (k % 2 == 0)
        for j, (sensor, value) in enumerate(rows):
            lines.append(f"{sensor},{stamp + 40 * j}," + ",".join(f"{one:.4f}" for one in value))
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    found = import_log(tmp_path / "log.csv")
    assert f"time: '{name}' in us (" in found.summary()
    (throw,) = found.throws
    assert RELEASE <= throw.start < RELEASE + 0.2
    assert throw.spin == pytest.approx(32, rel=0.06)


@pytest.mark.parametrize("header", [True, False])
def test_codes_under_an_unknown_name_part_rows_that_go_on_from_one_to_the_next(tmp_path, header):
    """All rows came in as a magnetometer's, or as a gyroscope's."""
    value = np.stack([LOG.gyro / DEG, LOG.accel / G0, LOG.mag], axis=1).reshape(-1, 3)
    columns = [("t_ms", np.repeat(LOG.t * 1000, 3)), ("src", np.tile([7, 8, 9], LOG.t.size))]
    log = write_table(tmp_path / "log.csv", columns + three(["x", "y", "z"], value), header=header)
    read = import_log(log).recordings[0].samples
    assert_as_made(read)


@pytest.mark.parametrize("header", [True, False])
def test_a_flag_that_toggles_parts_no_rows(tmp_path, header):
    columns = [("t_ms", LOG.t * 1000), ("sync", np.arange(LOG.t.size) % 2), *three(["gx", "gy", "gz"], LOG.gyro / DEG)]
    columns += [*three(["ax", "ay", "az"], LOG.accel / G0), *three(["mx", "my", "mz"], LOG.mag)]
    read = import_log(write_table(tmp_path / "log.csv", columns, header=header)).recordings[0].samples
    assert len(read["gyroscope"]) == len(read["magnetometer"]) == LOG.t.size


@pytest.mark.parametrize("letters", ["ab", "abcdefgh"])
def test_letters_that_count_files_are_no_sensors(tmp_path, letters):
    """Two throws called a and b came in as an accelerometer and a magnetometer of one."""
    for letter in letters:
        write_table(tmp_path / f"throw_{letter}.csv", [("t_s", LOG.t), *three(["x", "y", "z"], LOG.gyro / DEG)])
    found = import_log(tmp_path / "throw_a.csv")
    assert "gyroscope: x, y, z" in found.summary()


def test_letters_of_sensors_are_theirs(tmp_path):
    for letter, value in (("g", LOG.gyro / DEG), ("a", LOG.accel), ("m", LOG.mag)):
        write_table(tmp_path / f"throw_{letter}.csv", [("t_s", LOG.t), *three(["x", "y", "z"], value)])
    read = import_log(tmp_path).recordings[0].samples
    assert_as_made(read)
