"""A PX4 flight log comes in as any log does: its sensors, stamps, units and axes are those of the motion in it."""

from __future__ import annotations

import builtins
import struct
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.flight_log import BOOT, LATE, battery, combined, flight, integrals, magnetometer, message, ulog
from support.made_logs import LANDING, RELEASE, Log, made_log

from discsim.recording import Recording, read_recording
from discsim.validation.cli import main
from discsim.validation.importing import import_recording, read_map
from discsim.validation.importing.sniffing import map_text, opened, sniff

needs_reader = pytest.mark.skipif(
    find_spec("pyulog") is None, reason='no reader of ULog here: pip install "discsim[logs]"'
)
ALL = ("gyroscope", "accelerometer", "magnetometer")


def imported(raw: Path, place: Path) -> Recording:
    with opened(raw) as tables:
        (place / "map.toml").write_text(map_text(sniff(tables)), encoding="utf-8")
        return import_recording(tables, read_map(place / "map.toml")).recording


def assert_is_the_motion(recording: Recording, log: Log, start: float = 0.0) -> None:
    """Hold a recording, whose time zero is at ``start`` of the motion, against it.

    A stamp is rounded to half a us; the steepest edge, 160 m/s^2 within one row of 5 ms, makes 0.016 m/s^2 of that,
    1e-4 of the largest reading. Floats of 32 bits and nine digits are far finer.
    """
    for sensor, truth in zip(ALL, (log.gyro, log.accel, log.mag), strict=True):
        samples = recording.samples[sensor]
        expected = np.column_stack([np.interp(samples.t + start, log.t, truth[:, k]) for k in range(3)])
        assert_allclose(samples.value, expected, atol=1e-4 * np.abs(truth).max(), err_msg=sensor)


def run(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    monkeypatch.setattr(sys, "argv", ["discsim", *map(str, words)])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


@needs_reader
def test_every_sensor_of_a_flight_log_keeps_its_own_stamps_units_and_axes(tmp_path):
    log = made_log()
    (tmp_path / "flight.ulg").write_bytes(ulog(flight(log)))
    recording = imported(tmp_path / "flight.ulg", tmp_path)
    assert {sensor: len(recording.samples[sensor]) for sensor in ALL} == {
        "gyroscope": log.t.size,
        "accelerometer": log.t.size - 1,  # row 0 has none yet
        "magnetometer": np.arange(LATE, log.t[-1], 0.02).size,
    }
    assert_is_the_motion(recording, log)
    assert recording.samples["accelerometer"].t[0] == pytest.approx(0.005 - 700e-6, abs=1e-9)
    assert recording.samples["magnetometer"].t[0] == pytest.approx(LATE, abs=1e-9)
    assert recording.sheets["gyroscope"].rate_hz == pytest.approx(200.0, rel=1e-3)
    assert recording.sheets["magnetometer"].rate_hz == pytest.approx(50.0, rel=1e-3)


@needs_reader
def test_a_magnetometer_that_lies_otherwise_and_starts_later_is_laid_on_the_gyroscope(tmp_path):
    log = made_log()
    turned = Log(log.t, log.gyro, log.accel, np.column_stack([log.mag[:, 1], -log.mag[:, 0], log.mag[:, 2]]))
    (tmp_path / "flight.ulg").write_bytes(ulog({**flight(log), "vehicle_magnetometer": magnetometer(turned)}))
    assert_is_the_motion(imported(tmp_path / "flight.ulg", tmp_path), log)


@needs_reader
def test_integrals_become_mean_rates_at_the_middle_of_their_spans(tmp_path):
    log = made_log()
    # the slower sensor_combined is left aside
    slow = Log(log.t[::4], log.gyro[::4], log.accel[::4], log.mag[::4])
    topics = {
        "sensor_combined": combined(slow),
        "vehicle_imu": integrals(log),
        "vehicle_magnetometer": magnetometer(log),
    }
    (tmp_path / "flight.ulg").write_bytes(ulog(topics))
    assert_is_the_motion(imported(tmp_path / "flight.ulg", tmp_path), log, start=0.0025)


@needs_reader
def test_the_throw_is_cut_out_of_a_flight_log_in_a_zip_by_the_command(monkeypatch, tmp_path, capsys):
    log = made_log()
    with zipfile.ZipFile(tmp_path / "flight.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("flight.ulg", ulog(flight(log)))
    assert run(monkeypatch, "import", tmp_path / "flight.zip", "--throw", 1, "--out", tmp_path / "out") == 0
    assert "time: 'timestamp_us' in us (certain: the header says so" in capsys.readouterr().err
    assert (tmp_path / "out" / "raw.html").exists()
    gyro = read_recording(tmp_path / "out").samples["gyroscope"]
    # a tenth of a second is the rule's own width
    assert gyro.t[-1] - gyro.t[0] == pytest.approx(LANDING - RELEASE, abs=0.2)
    assert np.all(gyro.value[:, 2] > 20)
    again = tmp_path / "again"
    words = ("--map", tmp_path / "out" / "map.toml", "--throw", 1, "--out", again)
    assert run(monkeypatch, "import", tmp_path / "flight.zip", *words) == 0
    assert (again / "gyroscope.csv").read_bytes() == (tmp_path / "out" / "gyroscope.csv").read_bytes()


@needs_reader
def test_a_log_that_breaks_off_is_read_up_to_there(tmp_path):
    log = made_log()
    whole = ulog(flight(log))
    (tmp_path / "cut.ulg").write_bytes(whole[: int(0.9 * len(whole)) + 3])
    recording = imported(tmp_path / "cut.ulg", tmp_path)
    assert 8.9 < recording.samples["gyroscope"].t[-1] < 9.1
    assert_is_the_motion(recording, log)


@needs_reader
def test_damage_within_a_log_is_left_out_and_listed(monkeypatch, tmp_path):
    log = made_log()
    short = message("D", struct.pack("<HQ", 1, BOOT) + b"\1\2\3")  # a row of sensor_combined too short for its fields
    (tmp_path / "holed.ulg").write_bytes(ulog(flight(log)) + short)
    assert run(monkeypatch, "import", tmp_path / "holed.ulg", "--out", tmp_path / "out") == 0
    assert "holed.ulg: damaged messages in it were left out" in (tmp_path / "out" / "repairs.csv").read_text()
    assert_is_the_motion(read_recording(tmp_path / "out"), log)


def damaged() -> dict[str, tuple[bytes, str]]:
    empty = ulog({"sensor_combined": (combined(made_log())[0], []), "battery_status": battery(made_log())})
    nested = ulog({"sensor_combined": ("sensor_combined inner;", [(BOOT, bytes(8))])})
    return {
        "head.ulg": (b"ULog\x01\x12\x35\x01\0\0", "is a damaged PX4 ULog (Invalid file format (Header too short))"),
        "zeros.ulg": (b"ULog\x01\x12\x35" + bytes(100), "is a damaged PX4 ULog without readings of motion"),
        "empty.ulg": (empty, "expected one of the topics sensor_accel, sensor_combined"),
        "new.ulg": (b"ULog\x01\x12\x35\x01" + bytes(8) + message("B", b"\xff" * 40), "is a damaged PX4 ULog (Unknown"),
        "nested.ulg": (nested, "is a damaged PX4 ULog (maximum recursion depth"),
        "other.ulg": (b"ULoG\x01\x12\x35\x01" + bytes(100), "is binary, no text"),
    }


@needs_reader
@pytest.mark.parametrize("name", damaged())
def test_a_damaged_flight_log_is_refused_in_one_sentence(monkeypatch, tmp_path, capsys, name):
    content, sentence = damaged()[name]
    (tmp_path / name).write_bytes(content)
    assert run(monkeypatch, "import", tmp_path / name, "--out", tmp_path / "out") == 2
    said = capsys.readouterr()
    assert sentence in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""


def test_without_the_reader_the_sentence_names_the_extra(monkeypatch, tmp_path, capsys):
    found = builtins.__import__

    def absent(name, *rest, **more):
        if name.split(".")[0] == "pyulog":
            raise ImportError(name)
        return found(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", absent)
    (tmp_path / "flight.ulg").write_bytes(ulog(flight(made_log())))
    assert run(monkeypatch, "import", tmp_path / "flight.ulg", "--out", tmp_path / "out") == 2
    said = capsys.readouterr().err
    assert 'pip install "discsim[logs]"' in said
    assert said.count("\n") == 1
