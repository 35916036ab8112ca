"""Folders that are no whole recording are refused in one line that names what is missing or too much."""

from __future__ import annotations

import re
from pathlib import Path
from typing import IO, Any

import pytest
from support.recording_folder import (
    CSV,
    RATE_TABLE,
    TOML,
    make,
    refusal,
)

from discsim.errors import InputError
from discsim.recording import SENSORS, read_dataset


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    return make(tmp_path / "flight")


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    assert refusal(tmp_path / "nowhere") == ": no such folder; expected a recording (a folder with recording.toml)"


def test_a_file_instead_of_a_folder_is_refused(flight):
    assert refusal(flight / "recording.toml") == f": this is a file; expected the folder of a recording: {flight}"


def test_a_log_instead_of_a_folder_is_refused_with_the_command_that_brings_it_in(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("t,gx,gy,gz\n")
    asked = f": this is a file; expected the folder of a recording: bring it in first, discsim import {log} --out DIR"
    assert refusal(log) == asked


def test_a_folder_without_recording_toml_is_refused(flight):
    (flight / "recording.toml").unlink()
    assert refusal(flight).startswith("recording.toml: no such file; expected")


def test_a_data_set_in_the_place_of_a_recording_is_refused(flight, tmp_path):
    said = refusal(tmp_path)
    assert said == f": is a data set; expected one of its recordings, such as {flight}"


def test_an_empty_recording_toml_is_refused(flight):
    (flight / "recording.toml").write_bytes(b"")
    assert refusal(flight).startswith("recording.toml: missing key 'format'")


def test_a_sensor_file_without_its_table_is_refused(flight):
    (flight / "gyroscope.csv").write_text(SENSORS["gyroscope"].header + "\n0,1,2,3\n")
    assert (
        refusal(flight)
        == "gyroscope.csv: a sensor file without its table; expected [sensors.gyroscope] in recording.toml"
    )


def test_a_recording_without_a_sensor_is_refused(flight):
    for file in CSV:
        (flight / file).unlink()
    assert re.match(r": no sensor file; expected at least one of magnetometer.csv, accelerometer.csv", refusal(flight))


def test_a_command_belongs_to_a_rate_table_only(flight):
    (flight / "command.csv").write_text("time_s,rate_rad_s\n0,1\n")
    assert refusal(flight) == "command.csv: a command in a flight recording; expected it in rate_table only"


def test_a_command_has_no_gaps(tmp_path):
    folder = make(tmp_path / "table", RATE_TABLE, CSV | {"command.csv": "time_s,rate_rad_s\n0,0\n1,\n"})
    assert refusal(folder) == "command.csv:3: a cell is empty; expected a number in every cell of command.csv"


def test_a_spin_down_needs_its_rig(tmp_path):
    folder = make(tmp_path / "rig", TOML.replace('"flight"', '"spin_down"'))
    assert refusal(folder) == "recording.toml: missing key 'rig' in the top level; expected a table"


@pytest.mark.parametrize("name", ["recording.toml", "magnetometer.csv"])
def test_a_folder_in_the_place_of_a_file_is_refused(flight, name):
    (flight / name).unlink()
    (flight / name).mkdir()
    assert refusal(flight).startswith(f"{name}: cannot be read (Is a directory); expected a readable")


def test_a_link_that_leads_nowhere_is_no_absent_sensor(flight):
    (flight / "gyroscope.csv").symlink_to(flight / "elsewhere.csv")
    text = TOML + "[sensors.gyroscope]\nrate_hz = 100\n"
    (flight / "recording.toml").write_text(text)
    assert refusal(flight).startswith("gyroscope.csv: no such file; expected")


@pytest.mark.parametrize("name", ["recording.toml", "magnetometer.csv"])
def test_a_file_that_may_not_be_read_is_refused(flight, name, monkeypatch):
    """The reading itself is made to fail, because the superuser may read what nobody else may."""
    opened = Path.open

    def forbidden(path: Path, *how: str, **more: str) -> IO[Any]:
        if path.name == name:
            raise PermissionError(13, "Permission denied", str(path))
        return opened(path, *how, **more)

    monkeypatch.setattr(Path, "open", forbidden)
    assert refusal(flight) == f"{name}: cannot be read (Permission denied); expected a readable UTF-8 file"


def test_a_name_that_is_too_long_is_refused(tmp_path):
    assert "File name too long" in refusal(tmp_path / ("x" * 300))
    with pytest.raises(InputError, match="File name too long"):
        read_dataset(tmp_path / ("x" * 300))
