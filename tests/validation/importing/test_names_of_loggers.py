"""Names that loggers of one kind have: a time of the GPS week, hx hy hz of a magnetometer, p q r, a message's stamp."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log, three, write_table

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.names import is_time_name, read_name, sensor_of
from discsim.validation.importing.sniffing.turning import best_worth, steps_between

LOG = made_log()


@pytest.mark.parametrize(
    ("name", "is_one"), [("GPS TOW", True), ("iTOW", True), ("tow_ms", True), ("towards", False), ("UTC_Nano", True)]
)
def test_a_time_of_the_week_is_a_time(name, is_one):
    assert is_time_name(name) is is_one


def test_a_magnetometer_may_be_called_h():
    assert [sensor_of(name) for name in ("h", "H", "hour")] == ["magnetometer", "magnetometer", None]


def test_the_week_s_time_in_the_third_column_is_that_of_the_rows(tmp_path):
    """As MicroStrain's SensorConnect writes a log: rows were taken as 0.01 s apart."""
    columns = [("GPS TFlags", [6] * LOG.t.size), ("GPS Week", [2312] * LOG.t.size), ("GPS TOW", 482531.25 + LOG.t)]
    columns += three([f"{axis} Accel [x8004]" for axis in "XYZ"], LOG.accel)
    columns += three([f"{axis} Gyro [x8005]" for axis in "XYZ"], LOG.gyro)
    columns += three([f"h{axis}" for axis in "xyz"], LOG.mag)
    above = "INFO,3DM-GX5-25,6254.12345\n\nDATA_START\n"
    log = import_log(write_table(tmp_path / "log.csv", columns, before=above))
    (recording,) = log.recordings
    assert_allclose(recording.samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(recording.samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(recording.samples["accelerometer"].value, LOG.accel, atol=1e-5)
    (named,) = [decision for decision in log.decisions if decision.what == "magnetometer"]
    assert (named.choice, named.sure) == ("hx, hy, hz", "certain")


@pytest.mark.parametrize("axis", range(3))
def test_the_y_of_velocity_is_no_axis(axis):
    name = read_name(f"{'XYZ'[axis]}-axis angular velocity (°/s)")
    assert (name.axis, sensor_of(name.base)) == (axis, "gyroscope")


@pytest.mark.parametrize(
    "names",
    [("p", "q", "r"), ("P", "Q", "R"), ("roll_rate", "pitch_rate", "yaw_rate"),
     ("Rate_X", "Rate_Y", "Rate_Z")],
)  # fmt: skip
def test_the_rates_of_flight_mechanics_are_a_gyroscope(tmp_path, names):
    columns = [("time_us", 1e6 * LOG.t), ("roll", 0 * LOG.t), ("pitch", 0 * LOG.t), ("yaw", 0 * LOG.t)]
    columns += [*three(names, LOG.gyro), *three(["ax", "ay", "az"], LOG.accel)]
    log = import_log(write_table(tmp_path / "log.csv", columns))
    assert_allclose(log.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-5)


def test_what_a_phone_s_fusion_gives_is_read_where_it_is_all_there_is(tmp_path):
    """It has the rate less its bias, and the field less its iron; the log had no gyroscope. It shows gravity itself."""
    columns = [("loggingTime(txt)", [f"2026-08-11 14:03:{20 + t:06.3f} +0200" for t in LOG.t])]
    columns += three([f"accelerometerAcceleration{axis}(G)" for axis in "XYZ"], -LOG.accel / G0)
    columns += three([f"motionRotationRate{axis}(rad/s)" for axis in "XYZ"], LOG.gyro)
    columns += three([f"motionUserAcceleration{axis}(G)" for axis in "XYZ"], -LOG.accel / G0 - [0.0, 0.0, 1.0])
    columns += three([f"motionMagneticField{axis}(uT)" for axis in "XYZ"], LOG.mag)
    samples = import_log(write_table(tmp_path / "log.csv", columns)).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-4)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=1e-4)
    columns += three([f"gyroRotation{axis}(rad/s)" for axis in "XYZ"], LOG.gyro + 0.02)
    samples = import_log(write_table(tmp_path / "both.csv", columns)).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro + 0.02, atol=1e-5)


def test_a_message_s_own_stamp_is_its_time_and_not_when_it_came(tmp_path):
    late = np.random.default_rng(2).exponential(1e6, LOG.t.size)
    columns = [
        ("%time", [str(1786457048_000000000 + round(1e9 * t + more)) for t, more in zip(LOG.t, late, strict=True)]),
        ("field.header.seq", np.arange(LOG.t.size)),
        ("field.header.stamp", [str(1786457048_000000000 + round(1e9 * t)) for t in LOG.t]),
    ]
    columns += three([f"field.angular_velocity.{axis}" for axis in "xyz"], LOG.gyro)
    columns += three([f"field.linear_acceleration.{axis}" for axis in "xyz"], LOG.accel)
    samples = import_log(write_table(tmp_path / "imu.csv", columns)).recordings[0].samples
    assert_allclose(samples["gyroscope"].t - samples["gyroscope"].t[0], LOG.t, atol=1e-6)


def test_turns_that_are_57_times_too_small_explain_no_field():
    """They did, with an iron of 100 000 uT: a spin of 1.2 rad between readings of the field was read in deg/s."""
    slow = np.arange(0, len(LOG.t), 6)
    steps = steps_between(LOG.t, LOG.gyro, LOG.t[slow], LOG.mag[slow])
    wrong, right = (best_worth(steps, [worth]) for worth in (DEG, 1.0))
    assert wrong is None or wrong.ratio > 0.9
    assert right is not None
    assert right.ratio < 0.1


@pytest.mark.parametrize(("name", "per"), [("ms", 1000), ("header.stamp.nanosec", 10**9)])
def test_parts_of_a_second_beside_its_count_go_on(tmp_path, name, per):
    """The import had taken the wraps out, but units and axes were looked for in times that fell back each second."""
    ms = (1000 * LOG.t).round().astype(int) + 210
    columns = [("second", ms // 1000), (name, ms % 1000 * (per // 1000))]
    columns += [*three(["gx", "gy", "gz"], LOG.gyro / DEG), *three(["ax", "ay", "az"], LOG.accel / G0)]
    columns += three(["mx", "my", "mz"], LOG.mag)
    log = import_log(write_table(tmp_path / "log.csv", columns))
    samples = log.recordings[0].samples
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert "gyroscope unit: deg/s (likely: the field turns as fast in this unit)" in log.summary()
    assert "so the field turns as the gyroscope says" in log.summary()


@pytest.mark.parametrize(
    ("name", "axis", "sensor"),
    [
        ("Data Set 1:X-axis acceleration(m/s²)", 0, "accelerometer"),
        ("Latest: Y-axis gyro (rad/s)", 1, "gyroscope"),
        ("Run 1: Magnetic field Z (mT)", 2, "magnetometer"),
    ],
)
def test_what_vernier_puts_before_a_name_hides_no_axis(name, axis, sensor):
    found = read_name(name)
    assert (found.axis, sensor_of(found.base)) == (axis, sensor)


@pytest.mark.parametrize(("gravity", "sensors"), [(0.0, 3), (G0, 2)])
def test_an_acceleration_that_is_called_linear_and_rests_on_gravity_is_a_reading(tmp_path, gravity, sensors):
    """ "Ang Vel X" and "Lin Acc X" were left out as worked out from other readings: the field stood alone."""
    columns = [("Time", LOG.t), *three([f"Ang Vel {axis}" for axis in "XYZ"], LOG.gyro)]
    columns += three([f"Lin Acc {axis}" for axis in "XYZ"], LOG.accel + np.array([0.0, 0.0, gravity]))
    columns += three([f"Mag Field {axis}" for axis in "XYZ"], LOG.mag)
    assert len(import_log(write_table(tmp_path / "log.csv", columns)).recordings[0].samples) == sensors


def test_what_a_program_converted_goes_before_the_counts_beside_it(tmp_path):
    names = [f"imu1_{sensor}_{axis}" for sensor in ("accel", "gyro") for axis in "xyz"]
    counts = np.column_stack([LOG.accel * 139.3, LOG.gyro * 3274.0]).round()
    columns = [("timestamp_ms", 1000 * LOG.t), *zip(names, counts.T, strict=True)]
    columns += zip([f"{name}_real" for name in names], np.column_stack([LOG.accel, LOG.gyro]).T, strict=True)
    samples = import_log(write_table(tmp_path / "log.csv", columns)).recordings[0].samples
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-3)
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-3)


def test_a_unit_that_makes_a_row_of_seconds_is_doubted_beside_positions_too(tmp_path):
    """Where fixes come once a minute, readings of a gyroscope do not."""
    motion = [*three(["gx_dps", "gy_dps", "gz_dps"], LOG.gyro / DEG), *three(["ax", "ay", "az"], LOG.accel)]
    place = [("gps_lat", 0 * LOG.t + 44.8), ("gps_long", 0 * LOG.t - 73.1)]
    columns = [("timestamp_s", 1393343 + 1000 * LOG.t), *motion, *place]
    found = import_log(write_table(tmp_path / "log.csv", columns))
    assert_allclose(found.recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-3)
    assert "time: 'timestamp_s' in ms (guess: the header says s, which is a row every 5 s" in found.summary()


def test_where_a_row_stands_in_a_memory_is_no_time_of_it(tmp_path):
    place = 2174656 + 64 * np.arange(LOG.t.size)
    rows = np.column_stack([place, (4.1 * LOG.t * 1000).round(), LOG.gyro / DEG / 4.1, LOG.accel / G0])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", fmt=["%d", "%d", *["%.4f"] * 6])
    assert import_log(tmp_path / "log.csv").recordings[0].samples["gyroscope"].t[-1] > 35.0


def test_columns_whose_capitals_differ_are_one_sensor_s(tmp_path):
    """As in "Timestamp;Index;AccelX;AccelY;AccelZ;gyroX;GyroY;GyroZ": there was no gyroscope."""
    columns = [("time_us", 1e6 * LOG.t), *three(["AccelX", "AccelY", "AccelZ"], LOG.accel)]
    columns += three(["gyroX", "GyroY", "GyroZ"], LOG.gyro)
    log = import_log(write_table(tmp_path / "log.csv", columns))
    assert_allclose(log.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    columns += three(["GyroX", "gyroY", "gyroZ"], 0 * LOG.gyro)
    log = import_log(write_table(tmp_path / "two.csv", columns))  # GyroX, GyroY, GyroZ and gyroX, gyroY, gyroZ
    names = {decision.choice for decision in log.decisions if decision.what == "gyroscope"}
    assert names <= {"gyroX, gyroY, gyroZ", "GyroX, GyroY, GyroZ"}


def test_a_unit_may_be_parted_by_its_capital_alone_and_an_angular_acceleration_is_no_accelerometer_s(tmp_path):
    """It was taken for one, without gravity, and rows as 0.01 s apart."""
    columns = [*three([f"gyro{axis}Dps" for axis in "XYZ"], LOG.gyro / DEG)]
    columns += three([f"angAcc{axis}" for axis in "XYZ"], np.random.default_rng(3).normal(0, 20, (LOG.t.size, 3)))
    columns += [*three([f"linAcc{axis}" for axis in "XYZ"], LOG.accel - LOG.accel[0]), ("tsMs", 1e3 * LOG.t)]
    log = import_log(write_table(tmp_path / "log.csv", columns))
    samples = log.recordings[0].samples
    assert list(samples) == ["gyroscope"]
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    (unit,) = [decision for decision in log.decisions if decision.what == "gyroscope unit"]
    assert (unit.choice, unit.sure) == ("deg/s", "certain")


@pytest.mark.parametrize(("name", "unit"), [("gyro_z", '"rad/s" or "deg/s"'), ("gyro_z_dps", '"deg/s"')])
def test_a_gyroscope_of_one_axis_beside_other_sensors_is_said_with_the_lines_of_a_map(tmp_path, name, unit):
    columns = [("time_us", 1e6 * LOG.t), *three(["ax", "ay", "az"], LOG.accel), *three(["mx", "my", "mz"], LOG.mag)]
    log = import_log(write_table(tmp_path / "log.csv", [*columns, (name, LOG.gyro[:, 2])]))
    line = f'[sensors.rate_reference] columns = ["{name}"], unit = {unit} (scale'
    assert [note for note in log.notes if line in note]


def test_what_a_count_is_worth_stands_above_gyroflow_s_logs(tmp_path):
    """Its scales were passed over: a spin of 3229 deg/s came in as 1615, a guess."""
    per_g, per_rad_s = 1 / 2048, 0.002
    above = f"GYROFLOW IMU LOG\nversion,1.3\norientation,YxZ\ntscale,0.001\ngscale,{per_rad_s}\nascale,{per_g}\n"
    columns = [("t", np.round(1e3 * LOG.t).astype(int)), *three(["gx", "gy", "gz"], np.round(LOG.gyro / per_rad_s))]
    columns += three(["ax", "ay", "az"], np.round(LOG.accel / G0 / per_g))
    raw = write_table(tmp_path / "video.gcsv", columns)
    raw.write_text(above + raw.read_text("utf-8"), "utf-8")
    log = import_log(raw)
    assert_allclose(log.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=per_rad_s)
    units = {one.what: one for one in log.decisions if one.what.endswith("unit")}
    assert units["gyroscope unit"].sure == units["accelerometer unit"].sure == "certain"
    assert "a line above the table says so" in units["gyroscope unit"].why


@pytest.mark.parametrize("quote", ['"', ""])
def test_a_gopro_s_columns_1_and_2_are_the_other_axes_in_their_order(tmp_path, quote):
    """Without quotes the commas in brackets parted the name, and the axes stayed as written."""
    names = [f"{quote}Gyroscope (z,x,y) [rad/s]{quote}", "1", "2"]
    columns = [("cts", 1e3 * LOG.t), *three(names, LOG.gyro[:, [2, 0, 1]]), ("temperature [°C]", 0 * LOG.t + 33)]
    log = import_log(write_table(tmp_path / "GYRO.csv", columns))
    assert_allclose(log.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    (unit,) = [decision for decision in log.decisions if decision.what == "gyroscope unit"]
    assert unit.choice == "rad/s"


def test_a_gyroscope_s_axes_may_be_called_by_euler_s_angles(tmp_path):
    names = ["Gyro_Phi", "Gyro_Psi", "Gyro_Theta"]
    columns = [("time_us", 1e6 * LOG.t), *three(names, LOG.gyro[:, [0, 2, 1]]), *three(["ax", "ay", "az"], LOG.accel)]
    log = import_log(write_table(tmp_path / "log.csv", columns))
    assert_allclose(log.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-4)


def test_three_columns_that_never_move_are_no_field_that_turns(tmp_path):
    """A sum of floats made them move by 1e-17, and the gyroscope told that to nothing."""
    rows = [f"4;{t:.3f};{w[0]:.4f};{w[1]:.4f};{w[2]:.4f}" for t, w in zip(LOG.t, LOG.gyro, strict=True)]
    still = [f"9;{t:.3f};0.195;5.64;8.02" for t in LOG.t]
    mixed = [line for pair in zip(rows, still, strict=True) for line in pair]
    (tmp_path / "log.csv").write_text("\n".join(mixed) + "\n", "utf-8")
    log = import_log(tmp_path / "log.csv")
    assert list(log.recordings[0].samples) == ["gyroscope"]


NAMED = {
    "capitals behind the axis, of a watch": (["x_A", "y_A", "z_A"], ["x_R", "y_R", "z_R"], ["x_M", "y_M", "z_M"]),
    "units in words behind underscores": (
        [f"{axis}_ACCELERATION_METERS_PER_SECOND_SQUARED" for axis in "XYZ"],
        [f"{axis}_ANGULAR_VELOCITY_DEGREES_PER_SECOND" for axis in "XYZ"],
        [f"MAG_{axis}_IN_UT" for axis in "XYZ"],
    ),
}


@pytest.mark.parametrize("form", NAMED)
def test_a_watch_s_and_a_specification_s_names_are_known(tmp_path, form):
    """Of the one a gyroscope alone was guessed, the others' A and M being amperes and metres; of the other none."""
    accel, gyro, mag = NAMED[form]
    columns = [("time_ms", 1e3 * LOG.t), *three(accel, LOG.accel), *three(gyro, LOG.gyro / DEG), *three(mag, LOG.mag)]
    read = import_log(write_table(tmp_path / "log.csv", columns)).recordings[0].samples
    assert_allclose(read["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(read["accelerometer"].value, LOG.accel, atol=1e-4)
    assert_allclose(read["magnetometer"].value, LOG.mag, atol=1e-3)


def test_g_behind_in_is_a_force_also_in_capitals(tmp_path):
    """It was gauss: 99 uT, with iron near the sensor."""
    columns = [("HEADER_TIME_STAMP_ms", 1e3 * LOG.t), *three(["X_IN_G", "Y_IN_G", "Z_IN_G"], LOG.accel / G0)]
    log = import_log(write_table(tmp_path / "log.csv", columns))
    assert_allclose(log.recordings[0].samples["accelerometer"].value, LOG.accel, atol=1e-4)


def test_g_force_is_an_accelerometer_s_beside_an_acceleration_without_gravity(tmp_path):
    """A phone's `gFx` was no sensor's: the capital had parted it, and `ax` without gravity was taken."""
    linear = np.random.default_rng(4).normal(0.0, 0.3, LOG.accel.shape)
    columns = [("time", LOG.t), *three(["gFx", "gFy", "gFz"], LOG.accel / G0), *three(["ax", "ay", "az"], linear)]
    columns += three(["wx", "wy", "wz"], LOG.gyro)
    log = import_log(write_table(tmp_path / "log.csv", columns))
    assert_allclose(log.recordings[0].samples["accelerometer"].value, LOG.accel, atol=1e-4)


def test_a_line_of_sources_below_the_units_is_no_line_of_names(tmp_path):
    names = ["timestamp", "lap", *[f"{axis}_acc" for axis in "xyz"], *[f"{axis}_rate_of_rotation" for axis in "xyz"]]
    head = [
        ",".join(names),
        "unix time,,G,G,G,deg/s,deg/s,deg/s",
        ",,201: acc,201: acc,201: acc,202: gyro" + ",202: gyro" * 2,
    ]
    table = np.column_stack([1714557600 + LOG.t, 0 * LOG.t, LOG.accel / G0, LOG.gyro / DEG])
    rows = [",".join(f"{cell:.6f}" for cell in row) for row in table]
    above = ["This file is created using RaceChrono v7 ( http://racechrono.com/ ).", "Format,3", ""]
    (tmp_path / "log.csv").write_text("\n".join([*above, *head, *rows]) + "\n", "utf-8")
    read = import_log(tmp_path / "log.csv").recordings[0].samples
    assert_allclose(read["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(read["accelerometer"].value, LOG.accel, atol=1e-4)


def test_betaflight_s_rates_are_whole_deg_s_beside_counts_of_the_accelerometer(tmp_path):
    """They were counts of 16 bits: a spin of 2300 deg/s came in as 140. The decoder writes no unit for them."""
    rates, counts = np.round(LOG.gyro / DEG).astype(int), np.round(2048 * LOG.accel / G0).astype(int)
    columns = [("loopIteration", np.arange(LOG.t.size)), ("time (us)", np.round(1e6 * LOG.t).astype(int))]
    columns += [
        *three([f"gyroADC[{k}]" for k in range(3)], rates),
        *three([f"accSmooth[{k}]" for k in range(3)], counts),
    ]
    log = import_log(write_table(tmp_path / "btfl_001.csv", columns))
    assert_allclose(log.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=0.51 * DEG)


def test_movesense_s_files_are_its_sensors_by_their_names(tmp_path):
    """The angular velocity was one worked out, and the acceleration, which it calls linear, one without gravity."""
    folder = tmp_path / "session"
    for name, value in (
        ("LinearAcceleration", LOG.accel),
        ("AngularVelocity", LOG.gyro / DEG),
        ("MagneticField", LOG.mag),
    ):
        columns = [("timestamp", np.round(1e3 * LOG.t).astype(int)), *three(["x", "y", "z"], value)]
        write_table(folder / f"2025-06-01T14-03-20_174630000192_{name}.csv", columns)
    samples = import_log(folder).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-4)


def test_powers_of_ten_behind_a_decimal_comma_are_no_units(tmp_path):
    """Where all of a file's readings were tens (`6,3E+01`) it was left out: a phone's magnetometer."""
    folder = tmp_path / "export"
    for name, value, unit in (("Gyroscope", LOG.gyro, "rad/s"), ("Magnetic field", 40.0 + LOG.mag / 100.0, "µT")):
        rows = [
            ";".join(f"{cell:.6E}" for cell in (t, *row)).replace(".", ",") for t, row in zip(LOG.t, value, strict=True)
        ]
        head = ";".join(['"Time (s)"', *[f'"{name} {axis} ({unit})"' for axis in "xyz"]])
        folder.mkdir(exist_ok=True)
        (folder / f"{name}.csv").write_text("\n".join([head, *rows, ""]), "utf-8")
    log = import_log(folder)
    assert {*log.recordings[0].samples} == {"gyroscope", "magnetometer"}
    assert "units stand in its cells" not in log.summary()
