"""Sensors of one file that have their own columns of time: each is read by its own, or it is said why not."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, made_log

from discsim.errors import InputError
from discsim.recording import Recording
from discsim.validation.importing import import_recording, read_map
from discsim.validation.importing.sniffing import map_text, sniff

SLOW = 0.0223  # s from a reading of the magnetometer to the next
LATE = 0.1503  # s by which its first one comes after the gyroscope's


def field(t: np.ndarray) -> np.ndarray:
    log = made_log()
    return np.column_stack([np.interp(t, log.t, log.mag[:, k]) for k in range(3)])


def written(path: Path, header: str, left: np.ndarray, right: np.ndarray, digits: int = 6) -> Path:
    """Write two tables side by side; the shorter one's cells end earlier."""
    rows = []
    for k in range(max(len(left), len(right))):
        parts = [
            [f"{value:.{digits}f}" for value in table[k]] if k < len(table) else [""] * table.shape[1]
            for table in (left, right)
        ]
        rows.append(",".join([*parts[0], *parts[1]]))
    path.write_text("\n".join([header, *rows, ""]))
    return path


def imported(path: Path) -> tuple[Recording, str]:
    proposal = sniff(path)
    (path.parent / "map.toml").write_text(map_text(proposal), encoding="utf-8")
    result = import_recording(path, read_map(path.parent / "map.toml"))
    said = [*(decision.text for decision in proposal.all_decisions), *proposal.notes, *result.notes]
    return result.recording, "\n".join(said)


def assert_each_has_its_own_times(recording: Recording) -> None:
    log = made_log()
    gyro, mag = recording.samples["gyroscope"], recording.samples["magnetometer"]
    slow = np.arange(LATE, log.t[-1], SLOW)
    assert_allclose(gyro.t, log.t, atol=1e-9)
    assert_allclose(gyro.value, log.gyro, atol=1e-3)
    assert_allclose(mag.t, slow, atol=1e-5)  # written in tenths of a millisecond or finer
    assert_allclose(mag.value, field(slow), atol=1e-3 * np.abs(log.mag).max())


@pytest.mark.parametrize(
    ("header", "scale"),
    [
        ("gyro_time,gx,gy,gz,mag_time,mx,my,mz", 1.0),
        ("t_gyro_ms,gx,gy,gz,t_mag_ms,mx,my,mz", 1e3),
        ("timestamp_us,gyro_x,gyro_y,gyro_z,mag_timestamp_us,mag_x,mag_y,mag_z", 1e6),
        ("time,gx,gy,gz,time,mx,my,mz", 1.0),
    ],
)
def test_each_sensor_is_read_by_its_own_column_of_time(tmp_path, header, scale):
    log, slow = made_log(), np.arange(LATE, made_log().t[-1], SLOW)
    left = np.column_stack([scale * log.t, log.gyro])
    right = np.column_stack([scale * slow, field(slow)])
    recording, said = imported(written(tmp_path / "log.csv", header, left, right))
    assert_each_has_its_own_times(recording)
    assert "magnetometer time: '" in said
    assert "WARNING" not in said


def test_readings_that_stand_with_their_stamp_until_the_next_are_taken_once(tmp_path):
    log, slow = made_log(), np.arange(LATE, made_log().t[-1], SLOW)
    last = np.searchsorted(slow, log.t, side="right") - 1
    right = np.column_stack([1e3 * slow, field(slow)])[np.maximum(last, 0)]
    left = np.column_stack([1e3 * log.t, log.gyro])
    header = "ms,gx,gy,gz,mag_ms_time,mx,my,mz".replace("mag_ms_time", "mag_time_ms")
    recording, said = imported(written(tmp_path / "log.csv", header, left, right))
    assert_each_has_its_own_times(recording)
    assert "WARNING" not in said


def test_rows_are_cut_by_time_for_a_sensor_with_its_own_stamps(tmp_path):
    log, slow = made_log(), np.arange(LATE, made_log().t[-1], SLOW)
    left, right = np.column_stack([log.t, log.gyro]), np.column_stack([slow, field(slow)])
    path = written(tmp_path / "log.csv", "gyro_time,gx,gy,gz,mag_time,mx,my,mz", left, right)
    imported(path)
    recording = import_recording(path, read_map(tmp_path / "map.toml"), slice(800, 1400)).recording
    assert recording.samples["gyroscope"].t[-1] == pytest.approx(2.995)
    inside = slow[(slow >= 4.0) & (slow <= 6.995)]
    assert_allclose(recording.samples["magnetometer"].t, inside - 4.0, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "factor", "start", "sentence"),
    [
        (
            "received",
            1.002,
            1.75e9,
            "another column of time, 'time', is not used, and runs otherwise than 'received_time'",
        ),
        ("mag", 1e3, 0.0, "magnetometer: 'mag_time' is not used for its time: it is in ms and 'time' in s"),
        ("mag", 1.0, 500.0, "magnetometer: 'mag_time' is not used for its time: it runs from 500"),
    ],
)
def test_a_column_of_time_that_is_unclear_is_named_and_not_used(tmp_path, name, factor, start, sentence):
    log = made_log()
    other = start + factor * (log.t + (0.0004 if name == "mag" else 0.0))
    if factor == 1e3:
        other = np.round(other)
    left = np.column_stack([log.t, log.gyro, other])
    header = f"time,gx,gy,gz,{name}_time,mx,my,mz"
    recording, said = imported(written(tmp_path / "log.csv", header, left, log.mag))
    assert sentence in said
    assert_allclose(recording.samples["magnetometer"].t, recording.samples["gyroscope"].t)


def test_two_columns_of_one_clock_are_no_news(tmp_path):
    """The date of each row beside its milliseconds: one clock twice, nothing to say."""
    log = made_log()
    left = np.column_stack([1e3 * log.t, 1.75e9 + np.floor(log.t), log.gyro])
    _, said = imported(written(tmp_path / "log.csv", "ms,unix_time,gx,gy,gz,mx,my,mz", left, log.mag))
    assert "not used" not in said


def test_a_column_of_its_own_needs_one_of_the_file_too(tmp_path):
    text = """name = "x"
plant = "free_spin"
[time]
step_s = 0.01
[environment]
gravity_m_s2 = 9.81
[sensors.gyroscope]
columns = ["gx", "gy", "gz"]
unit = "rad/s"
time = "t_gyro"
"""
    (tmp_path / "map.toml").write_text(text)
    with pytest.raises(InputError, match="names a column of time stamps; expected 'column' in \\[time\\] too"):
        read_map(tmp_path / "map.toml")


NAMES = [("time_ms", 1e3, "time_ms", 1e3, "t", 1.0), ("time_ms", 1e3, "elapsed (s)", 1.0, "timestamp_us", 1e6)]


def folder_of(place: Path, names: tuple[str, float, str, float, str, float], start: float = 0.0) -> Path:
    """Write a file for each sensor; the magnetometer's has every second row, and may begin later by its own clock."""
    log = made_log()
    place.mkdir()
    files = zip(("gyro", "accel", "mag"), names[::2], names[1::2], (log.gyro / DEG, log.accel, log.mag), strict=True)
    for file, name, scale, value in files:
        every, late = (2, start) if file == "mag" else (1, 0.0)
        rows = np.column_stack([(log.t + late) * scale, value])[::every]
        np.savetxt(place / f"{file}.csv", rows, delimiter=",", fmt="%.6f", header=f"{name},x,y,z", comments="")
    return place


@pytest.mark.parametrize("names", NAMES)
def test_a_file_that_calls_its_time_otherwise_is_read_by_it(tmp_path, names):
    recording, said = imported(folder_of(tmp_path / "log", names))
    log = made_log()
    assert {*recording.samples} == {"gyroscope", "accelerometer", "magnetometer"}
    assert_allclose(recording.samples["magnetometer"].t, log.t[::2], atol=1e-6)
    assert_allclose(recording.samples["magnetometer"].value, log.mag[::2], atol=1e-3)
    assert f"that file has no '{names[0]}'" in said


def test_a_file_on_another_clock_is_left_out_aloud(tmp_path):
    recording, said = imported(folder_of(tmp_path / "log", NAMES[0], start=5000.0))
    assert {*recording.samples} == {"gyroscope", "accelerometer"}
    assert "WARNING: left out: magnetometer of mag.csv: its time 't' runs from 5000 to 5009.99 s" in said


def test_a_file_without_stamps_beside_others_with_them_is_left_out_aloud(tmp_path):
    place = folder_of(tmp_path / "log", NAMES[0])
    np.savetxt(place / "mag.csv", made_log().mag, delimiter=",", fmt="%.3f", header="x,y,z", comments="")
    recording, said = imported(place)
    assert {*recording.samples} == {"gyroscope", "accelerometer"}
    assert "WARNING: left out: magnetometer of mag.csv: it has no column 'time_ms', the others' time" in said
