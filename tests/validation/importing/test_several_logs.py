"""A folder of several throws' files: each is imported by itself; a folder with a file per sensor is one log."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log, three, write_table

from discsim.errors import InputError
from discsim.recording import read_recording
from discsim.validation.cli import main
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
FLIGHT, HELD = slice(600, 1500), slice(0, 400)


def write(path: Path, kept: slice) -> Path:
    columns = [("t_s", LOG.t[kept]), *three(["gx", "gy", "gz"], LOG.gyro[kept] / DEG)]
    return write_table(path, columns + three(["ax", "ay", "az"], LOG.accel[kept] / G0))


def run(monkeypatch, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", ["discsim", *words])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def test_each_log_of_a_folder_becomes_a_recording_of_one_data_set(tmp_path, monkeypatch, capsys):
    """The first alone was taken; the others were said to be a second gyroscope."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "day" / "throw_1.csv", FLIGHT)
    write(tmp_path / "day" / "throw_2.csv", FLIGHT)
    write(tmp_path / "day" / "held.csv", HELD)
    (tmp_path / "day" / "notes.txt").write_text("windy\n")
    assert run(monkeypatch, "import", "day", "--throw", "1", "--out", "set") == 0
    said = capsys.readouterr()
    assert (
        "3 logs of the same columns in day: held.csv, throw_1.csv, throw_2.csv; each is imported by itself" in said.out
    )
    assert "LEFT OUT: " in said.err
    assert "held.csv: no throw found in it" in said.err
    assert "recordings of one data set: discsim diagnose set" in said.out
    for name in ("throw_1", "throw_2"):
        assert len(read_recording(tmp_path / "set" / name).samples["gyroscope"]) > 400
    assert not (tmp_path / "set" / "held" / "recording.toml").exists()


def test_python_asks_which(tmp_path):
    for name in ("a", "b"):
        write(tmp_path / "day" / f"{name}.csv", FLIGHT)
    with pytest.raises(InputError, match=r"2 logs of the same columns in it \(a.csv, b.csv\); expected one"):
        import_log(tmp_path / "day")


def test_a_file_per_sensor_is_one_log(tmp_path):
    for name, value in (("Gyroscope", LOG.gyro), ("Accelerometer", LOG.accel)):
        write_table(tmp_path / "day" / f"{name}.csv", [("time", LOG.t), *three(["x", "y", "z"], value)])
    assert set(import_log(tmp_path / "day").recordings[0].samples) == {"gyroscope", "accelerometer"}


def test_a_folder_with_another_table_beside_is_one_log(tmp_path):
    write(tmp_path / "day" / "imu.csv", FLIGHT)
    write_table(tmp_path / "day" / "mag.csv", [("t_s", LOG.t[FLIGHT]), *three(["mx", "my", "mz"], LOG.mag[FLIGHT])])
    assert set(import_log(tmp_path / "day").recordings[0].samples) == {"gyroscope", "accelerometer", "magnetometer"}


def test_a_file_of_gravity_beside_one_for_each_sensor_makes_no_logs_of_them(tmp_path):
    """A phone's export with a gravity of its own was said to be five logs of the same columns."""
    folder = tmp_path / "app"
    gravity = np.tile([0.0, 0.0, -G0], (LOG.t.size, 1)) + 0.01 * np.sin(LOG.t)[:, None]
    for name, value in (("Gyroscope", LOG.gyro), ("TotalAcceleration", LOG.accel), ("Gravity", gravity)):
        write_table(folder / f"{name}.csv", [("seconds_elapsed", LOG.t), *three(["x", "y", "z"], value)])
    samples = import_log(folder).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-4)


@pytest.mark.parametrize("quote", ['"', ""])
def test_a_file_that_is_named_otherwise_is_read_by_a_layout_of_its_own(tmp_path, quote):
    """A GoPro's two files of one folder need names written into the map, each its own: one was left out."""
    folder = tmp_path / "log"
    folder.mkdir()
    for name, unit, value in (("Gyroscope", "rad/s", LOG.gyro), ("Accelerometer", "m/s2", LOG.accel)):
        names = [f"{quote}{name} (z,x,y) [{unit}]{quote}", "1", "2"]
        columns = [("cts", 1e3 * LOG.t), *three(names, value[:, [2, 0, 1]])]
        write_table(folder / f"{name}.csv", columns)
    log = import_log(folder)
    for sensor, value in (("gyroscope", LOG.gyro), ("accelerometer", LOG.accel)):
        assert_allclose(log.recordings[0].samples[sensor].value, value, atol=1e-4)
    assert not any("left out" in note for note in log.notes)
    log.report(tmp_path / "out")
    again = import_log(folder, map=str(tmp_path / "out" / "map.toml"))
    assert_allclose(again.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-4)


def test_a_file_with_other_separators_is_read_where_it_has_another_sensor(tmp_path):
    folder = tmp_path / "log"
    folder.mkdir()
    write_table(folder / "gyro.csv", [("time_s", LOG.t), *three(["gx_rad_s", "gy_rad_s", "gz_rad_s"], LOG.gyro)])
    columns = [("time_s", LOG.t), *three(["ax_m_s2", "ay_m_s2", "az_m_s2"], LOG.accel)]
    write_table(folder / "accel.csv", columns, separator=";", decimal=",")
    log = import_log(folder)
    for sensor, value in (("gyroscope", LOG.gyro), ("accelerometer", LOG.accel)):
        assert_allclose(log.recordings[0].samples[sensor].value, value, atol=1e-4)
