"""Forms of logs found in public repositories, made anew: each was refused, or came in wrongly without a word."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from support.made_logs import DEG, G0, three, write_table

from discsim.validation.importing.imported_log import ImportedLog, import_log

XYZ = ("x", "y", "z")


def turned_by_hand(rate: float, seconds: float = 12.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A board that lies, is turned about two axes, and lies: t (n,) s, rates (n, 3) rad/s, forces (n, 3) m/s^2."""
    rng = np.random.default_rng(3)
    fine = np.arange(0.0, seconds, 1e-3)

    def eased(first: float, last: float) -> np.ndarray:
        return 0.5 * (1.0 - np.cos(np.pi * np.clip((fine - first) / (last - first), 0.0, 1.0)))

    tilt, roll = 1.2 * eased(5.0, 7.0)[:, None] * [0.8, -0.6, 0.0], 0.9 * eased(5.6, 8.0)[:, None] * [0.3, 0.5, 0.8]
    turn = Rotation.from_rotvec(tilt) * Rotation.from_rotvec(roll)
    steps = (turn[:-1].inv() * turn[1:]).as_rotvec() / 1e-3
    gyro, accel = np.vstack([steps, steps[-1:]]), turn.inv().apply([0.3, 0.2, 9.79])
    every = round(1e3 / rate)
    shape = gyro[::every].shape
    return (
        fine[::every],
        gyro[::every] + 0.002 * rng.standard_normal(shape),
        accel[::every] + 0.02 * rng.standard_normal(shape),
    )


def named(pattern: str, value: np.ndarray) -> list[tuple[str, np.ndarray]]:
    return three([pattern.format(axis) for axis in XYZ], value)


def written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def size(log: ImportedLog, sensor: str) -> float:
    """The largest of a sensor's readings, whatever their axes."""
    return float(np.max(np.abs(log.recordings[0].samples[sensor].value)))


# ----------------------------------------------------------------------------- units of what a hand turns


def test_rad_s_with_two_decimals_beside_m_s2_are_no_deg_s(tmp_path):
    """Two decimals of rad/s make steps of 0.01, as a gyroscope's noise in deg/s does: the rates were 57 times low."""
    t, gyro, accel = turned_by_hand(10.0)
    raw = write_table(
        tmp_path / "log.csv", [("Time (s)", t), *named("Accel {}", accel), *named("Gyro {}", gyro)], digits=2
    )
    assert size(import_log(raw), "gyroscope") == pytest.approx(np.max(np.abs(gyro)), abs=0.01)


def test_gravity_between_two_rests_tells_rad_s(tmp_path):
    """It was shaken while it turned, so that no step of gravity is seen: in deg/s it would have turned by 2 degrees."""
    t, gyro, accel = turned_by_hand(10.0)
    shaken = (t > 4.8) & (t < 8.2)
    accel[shaken] += 8.0 * np.random.default_rng(4).standard_normal((np.count_nonzero(shaken), 3))
    columns = [("Time (s)", t), *named("Accel {}", accel / G0), *named("Gyro {}", gyro)]
    log = import_log(write_table(tmp_path / "log.csv", columns, digits=2))
    assert size(log, "gyroscope") == pytest.approx(np.max(np.abs(gyro)), abs=0.01)
    assert "gyroscope unit: rad/s (likely: between two rests gravity turns by " in log.summary()


def test_deg_s_with_two_decimals_stay_deg_s(tmp_path):
    t, gyro, accel = turned_by_hand(10.0)
    columns = [("Time (s)", t), *named("Accel {}", accel / G0), *named("Gyro {}", gyro / DEG)]
    log = import_log(write_table(tmp_path / "log.csv", columns, digits=2))
    assert size(log, "gyroscope") == pytest.approx(np.max(np.abs(gyro)), abs=0.01)


def test_a_slow_log_of_a_few_rows_has_gravity_in_most_of_them(tmp_path):
    """Of 22 rows there is one window, which is restless: g came in as m/s^2."""
    t, _, accel = turned_by_hand(2.0, 11.0)
    accel[5] *= 0.4
    accel[14] *= 1.7
    raw = write_table(tmp_path / "log.csv", [("time_s", t), *named("acc_{}", accel / G0)])
    assert "accelerometer unit: g (certain" in import_log(raw).summary()


# ------------------------------------------------------------------------------------------ ST's examples


def st_lines() -> tuple[list[str], np.ndarray]:
    _, gyro, accel = turned_by_hand(100.0)
    counts = np.rint(gyro / DEG * 1000.0 / 70.0) * 70.0
    cells = np.round(np.column_stack([accel / G0 * 1000.0, counts]), 2)
    return ["\t".join(f"{cell:.2f}" for cell in row) for row in cells], counts * DEG / 1000.0


def test_mg_and_mdps_without_names_are_no_field_and_no_counts(tmp_path):
    """The pull was taken for a field of 1000 mgauss, the rates for counts of a range of 2000 deg/s."""
    lines, gyro = st_lines()
    log = import_log(written(tmp_path / "teraterm.log", *lines))
    assert_allclose(size(log, "gyroscope"), np.max(np.abs(gyro)), rtol=1e-6)
    assert "mdeg/s (likely: multiples of 70, an ST part's step in it" in log.summary()
    assert "magnetometer:" not in log.summary()


def test_a_unit_in_square_brackets_before_the_colon_names_three_numbers(tmp_path):
    lines, gyro = st_lines()
    parted = [line.split("\t") for line in lines]
    pairs = [
        text
        for row in parted
        for text in ("Acceleration [mg]:" + "\t".join(row[:3]), "Angular rate [mdps]:" + "\t".join(row[3:]))
    ]
    log = import_log(written(tmp_path / "putty.log", *pairs))
    assert_allclose(size(log, "gyroscope"), np.max(np.abs(gyro)), rtol=1e-6)
    assert "accelerometer unit: mg (certain" in log.summary()


# ---------------------------------------------------------------------------------------------------- ROS


def test_messages_as_rostopic_prints_them_have_the_time_of_their_header(tmp_path):
    """Seconds and nanoseconds stand in lines of their own: rows were taken as 100 a second where there are 200."""
    t, gyro, accel = turned_by_hand(200.0)
    messages = []
    for k, time in enumerate(t):
        whole = 1721381710 + int(time)
        lines = ["header:", f"  seq: {k}", "  stamp:", f"    secs: {whole}", f"    nsecs: {round((time % 1) * 1e9)}"]
        lines += ['  frame_id: "imu"', "orientation_covariance: [-1.0, 0.0, 0.0]"]
        for name, value in (("angular_velocity", gyro[k]), ("linear_acceleration", accel[k])):
            lines += [f"{name}:", *(f"  {axis}: {one:.6f}" for axis, one in zip(XYZ, value, strict=True))]
        messages += [*lines, "---"]
    log = import_log(written(tmp_path / "imu_output.txt", *messages))
    recording = log.recordings[0]
    assert recording.sheets["gyroscope"].rate_hz == pytest.approx(200.0, rel=1e-3)
    assert_allclose(recording.samples["gyroscope"].t[-1], t[-1], atol=1e-6)
    assert size(log, "gyroscope") == pytest.approx(np.max(np.abs(gyro)), abs=1e-5)


@pytest.mark.parametrize("parts", [("stamp.secs", "stamp.nsecs"), ("sec", "nanosec")])
def test_seconds_and_nanoseconds_in_two_columns_are_one_time(tmp_path, parts):
    t, gyro, accel = turned_by_hand(100.0)
    whole, rest = np.floor(t + 1e-9).astype(int), np.rint((t + 1e-9) % 1 * 1e9).astype(int)
    columns = [(parts[0], 1721381710 + whole), (parts[1], rest)]
    columns += [*named("angular_velocity.{}", gyro), *named("linear_acceleration.{}", accel)]
    log = import_log(write_table(tmp_path / "bag.csv", columns))
    assert_allclose(np.diff(log.recordings[0].samples["gyroscope"].t), 0.01, atol=1e-6)
    assert "the time stands in two columns" in log.summary()
    # by ROS's names alone: sensor_msgs/Imu is in rad/s
    assert size(log, "gyroscope") == pytest.approx(np.max(np.abs(gyro)), abs=1e-5)


# -------------------------------------------------------------------------------------------- other names


def test_a_log_of_one_row_a_second_is_believed_by_its_header(tmp_path):
    """`time_s` a second apart was taken for ms: 27 s lasted 0.027 s."""
    t, gyro, accel = turned_by_hand(1.0, 27.0)
    raw = write_table(
        tmp_path / "imu_log.csv", [("time_s", t + 0.15), *named("accel_{}", accel), *named("gyro_{}", gyro)]
    )
    assert import_log(raw).recordings[0].samples["accelerometer"].t[-1] == pytest.approx(26.0, abs=0.01)


def test_witmotions_angular_speed_is_a_gyroscopes_and_at_rest_it_has_not_failed(tmp_path):
    """At rest it reads 0 or one count: the zeros were taken for readings that failed."""
    t = np.arange(0.0, 4.0, 0.1)
    still = np.column_stack([0.061 * (np.arange(t.size) % 3 == 0), np.zeros(t.size), np.zeros(t.size)])
    accel = np.tile([0.001, -0.008, 1.022], (t.size, 1))
    columns = [("time_s", t), *three(["AccX(g)", "AccY(g)", "AccZ(g)"], accel)]
    raw = write_table(tmp_path / "wit.csv", columns + three(["AsX(°/s)", "AsY(°/s)", "AsZ(°/s)"], still), digits=3)
    log = import_log(raw)
    assert log.recordings[0].samples["gyroscope"].gaps == 0
    assert "readings that failed" not in log.summary()


def test_a_gyroscope_that_lies_still_has_no_dead_axis(tmp_path):
    """Two axes toggle by their last digit, the third does not."""
    t, turn = np.arange(0.0, 2.0, 0.02), np.arange(100)
    still = np.column_stack([-0.03 - 0.01 * (turn % 7 == 0), 0.03 + 0.01 * (turn % 5 == 0), np.zeros(100)])
    raw = write_table(tmp_path / "gyro.csv", [("time_s", t), *named("gyro_{}_dps", still)], digits=2)
    assert "it was not read" not in import_log(raw).summary()


def test_roll_pitch_and_yaw_are_the_axes_of_a_cansats_sensors(tmp_path):
    """Of GYRO_R, GYRO_P, GYRO_Y the Y was an axis and the others were none; the barometer's height was the GPS's."""
    t, gyro, accel = turned_by_hand(5.0)
    columns = [("MISSION_TIME_s", t), ("ALTITUDE", 300.0 + t)]
    columns += three(["GYRO_R", "GYRO_P", "GYRO_Y"], gyro / DEG) + three(["ACCEL_R", "ACCEL_P", "ACCEL_Y"], accel)
    columns += [("GPS_ALTITUDE", 298.0 + t), ("GPS_LATITUDE", 35.0 + 1e-5 * t), ("GPS_LONGITUDE", -106.0 + 1e-5 * t)]
    summary = import_log(write_table(tmp_path / "flight.csv", columns)).summary()
    assert "gyroscope: GYRO_R, GYRO_P, GYRO_Y (certain" in summary
    assert "accelerometer: ACCEL_R, ACCEL_P, ACCEL_Y (certain" in summary
    assert "gps: GPS_LATITUDE, GPS_LONGITUDE, GPS_ALTITUDE" in summary


def test_numbers_of_windows_name_no_sensors_and_a_count_in_them_no_rows(tmp_path):
    """Four windows of ten rows were four gyroscopes, of which three were left out."""
    _, gyro, accel = turned_by_hand(5.0, 8.0)
    rows = np.arange(len(gyro))
    columns = [("ID", rows // 10), ("sample_idx", rows % 10), *named("a{}", accel), *named("g{}", gyro)]
    log = import_log(write_table(tmp_path / "imu_data.csv", columns))
    assert len(log.recordings[0].samples["gyroscope"]) == rows.size


# ------------------------------------------------------------------------------------------ bare readings


def test_names_and_numbers_in_turn_need_no_colon(tmp_path):
    t, gyro, _ = turned_by_hand(50.0)
    lines = [
        " ".join(f"{n} {v:.4f}" for n, v in zip(("t", "gx", "gy", "gz"), row, strict=True))
        for row in np.column_stack([t, gyro])
    ]
    log = import_log(written(tmp_path / "serial.txt", *lines))
    assert size(log, "gyroscope") == pytest.approx(np.max(np.abs(gyro)), rel=0.01)


def test_a_table_without_names_at_rest_is_guessed_by_gravity(tmp_path):
    """An accelerometer that nothing moves was refused, and its gyroscope with it."""
    t, gyro, accel = turned_by_hand(50.0, 4.0)
    whole = np.rint(np.column_stack([1000.0 * t, accel / G0 * 16384.0, gyro / DEG * 131.072])).astype(int)
    lines = [",".join(map(str, row)) for row in whole]
    log = import_log(written(tmp_path / "DATALOG.TXT", *lines))
    assert "accelerometer: c2, c3, c4 (guess" in log.summary()
    assert "gyroscope: c5, c6, c7 (guess: the three columns beside the accelerometer's)" in log.summary()


def test_two_parts_that_are_told_by_their_address_are_two(tmp_path):
    _, gyro, accel = turned_by_hand(50.0, 4.0)
    rows = np.column_stack([accel / G0, gyro / DEG])
    lines = [f"IMU,{part}," + ",".join(f"{cell:.3f}" for cell in row) for row in rows for part in ("0x68", "0x69")]
    log = import_log(written(tmp_path / "imu_data.txt", *lines))
    assert len(log.recordings[0].samples["accelerometer"]) == len(rows)
    assert "c2 = 0x69" in log.summary()


def test_records_behind_a_programs_own_words_are_read(tmp_path):
    t, gyro, accel = turned_by_hand(50.0)
    lines = [
        f"[{k}][IMU]: {{'t': {t[k]:.3f}, 'acc.x': {a[0]:.4f}, 'acc.y': {a[1]:.4f}, 'acc.z': {a[2]:.4f}, "
        f"'gyro.x': {g[0]:.4f}, 'gyro.y': {g[1]:.4f}, 'gyro.z': {g[2]:.4f}}}"
        for k, (g, a) in enumerate(zip(gyro, accel, strict=True))
    ]
    log = import_log(written(tmp_path / "imu_log.txt", *lines))
    assert size(log, "gyroscope") == pytest.approx(np.max(np.abs(gyro)), rel=0.01)
