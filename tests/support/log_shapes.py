"""The made log in the shapes in which strangers write theirs: each writes it and returns what to import."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from support.made_logs import DEG, G0, Log, three, write_table

XYZ = ("x", "y", "z")


def zipped(path: Path, folder: Path) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(folder.rglob("*")):
            archive.write(file, file.relative_to(folder))
    return path


def named(pattern: str) -> list[str]:
    return [pattern.format(axis) for axis in XYZ]


def whole(value: np.ndarray) -> np.ndarray:
    return np.round(value).astype(int)


# --------------------------------------------------------------- shapes: each writes the log and returns what to import


def plain_names(place: Path, log: Log) -> Path:
    columns = [("time_s", log.t), *three(named("g{}"), log.gyro / DEG), *three(named("a{}"), log.accel / G0)]
    return write_table(place / "log.csv", [*columns, *three(named("m{}"), log.mag)])


def brackets_and_milliseconds(place: Path, log: Log) -> Path:
    gyro, accel, mag = log.shown(up=True)
    columns = [("t (ms)", whole(1000 * log.t)), *three(named("Gyro {} (deg/s)"), gyro / DEG)]
    columns += [*three(named("acc_{} [g]"), accel / G0), *three(named("mag_{}_uT"), mag)]
    return write_table(place / "log.csv", columns)


def microseconds_and_milligauss(place: Path, log: Log) -> Path:
    columns = [("timestamp_us", whole(1e6 * log.t) + 4_120_000), *three(named("Accel {} [mg]"), 1000 * log.accel / G0)]
    columns += [*three(named("Mag {} [mG]"), 10 * log.mag), *three(named("Gyro {} [rad/s]"), log.gyro)]
    return write_table(place / "log.csv", columns)


def german_phyphox(place: Path, log: Log) -> Path:
    gyro, accel, mag = log.shown(up=True)
    for file, stem, unit, value in (
        ("Gyroskop.csv", "Gyroskop", "rad/s", gyro),
        ("Beschleunigung.csv", "Beschleunigung", "m/s^2", accel),
        ("Magnetometer.csv", "Magnetfeld", "µT", mag),
    ):
        columns = [('"Zeit (s)"', log.t), *three(named(f'"{stem} {{}} ({unit})"'), value)]
        write_table(place / "phone" / file, columns, separator=";", decimal=",")
    return place / "phone"


def french_phyphox_zip(place: Path, log: Log) -> Path:
    gyro, accel, mag = log.shown(up=True)
    for file, unit, value in (
        ("Gyroscope.csv", "rad/s", gyro),
        ("Accéléromètre.csv", "m/s^2", accel),
        ("Magnétomètre.csv", "µT", mag),
    ):
        columns = [('"Temps (s)"', log.t), *three([f'"{axis.upper()} ({unit})"' for axis in XYZ], value)]
        write_table(place / "export" / file, columns, separator="\t", decimal=",")
    (place / "export" / "meta").mkdir()
    (place / "export" / "meta" / "device.csv").write_text('"property","value"\n"deviceModel","X"\n')
    return zipped(place / "vol.zip", place / "export")


def english_raw_data(place: Path, log: Log) -> Path:
    gyro, accel, _ = log.shown(up=True)
    columns = [('"Time (s)"', log.t), *three(named('"Acceleration {} (m/s^2)"'), accel)]
    columns += [*three(named('"Gyroscope {} (rad/s)"'), gyro), ('"Absolute (rad/s)"', np.linalg.norm(gyro, axis=1))]
    return write_table(place / "Raw Data.csv", columns)


def sensor_logger_folder(place: Path, log: Log) -> Path:
    gyro, accel, mag = log.shown(up=True)
    epoch = [f"{int(1.7e18) + round(1e9 * t)}" for t in log.t]
    for file, value in (
        ("Accelerometer.csv", accel - np.median(accel[:200], axis=0)),  # this app takes gravity off here ...
        ("TotalAcceleration.csv", accel),  # ... and not here
        ("Gyroscope.csv", gyro),
        ("Magnetometer.csv", mag),
    ):
        columns = [("time", epoch), ("seconds_elapsed", log.t), *[(a, value[:, XYZ.index(a)]) for a in "zyx"]]
        write_table(place / "app" / file, columns)
    (place / "app" / "Metadata.csv").write_text("version,device name\n3,telephone\n")
    return place / "app"


def betaflight(place: Path, log: Log) -> Path:
    gyro, accel, mag = log.shown(up=True)
    preamble = '"Product","Blackbox flight data recorder"\n"Firmware type","Cleanflight"\n"looptime","5000"\n'
    columns = [("loopIteration", whole(200 * log.t)), ("time (us)", whole(1e6 * log.t) + 77_000_000)]
    columns += [(f"gyroADC[{k}] (deg/s)", whole(gyro[:, k] / DEG)) for k in range(3)]
    columns += [(f"accSmooth[{k}]", whole(2048 * accel[:, k] / G0)) for k in range(3)]
    columns += [(f"magADC[{k}] (mG)", whole(10 * mag[:, k])) for k in range(3)]
    return write_table(place / "LOG00001.csv", columns, before=preamble)


def counts_of_an_mpu(place: Path, log: Log) -> Path:
    columns = [
        ("millis", whole(1000 * log.t)),
        *three(["ax", "ay", "az"], whole(2048 * log.accel / G0)),
    ]
    columns += [
        *three(["gx", "gy", "gz"], whole(log.gyro / DEG * 14.286)),
        *three(["mx", "my", "mz"], whole(log.mag / 0.15)),
    ]
    return write_table(place / "LOG.TXT", columns)


def tabs_without_header(place: Path, log: Log) -> Path:
    columns = [("t", log.t), *three(XYZ, log.accel / G0), *three(XYZ, log.gyro / DEG), *three(XYZ, log.mag)]
    return write_table(place / "log.dat", columns, separator="\t", header=False)


def blanks_with_a_commented_header(place: Path, log: Log) -> Path:
    columns = [("# t", log.t), *three(["wx", "wy", "wz"], log.gyro), *three(["bx", "by", "bz"], log.mag)]
    return write_table(place / "log.txt", columns, separator=" ", before="# numpy\n", digits=8)


def pipes(place: Path, log: Log) -> Path:
    columns = [
        ("Time [s]", log.t),
        *three(named("Acc{}[m/s²]"), log.accel),
        *three(named("Gyr{}[°/s]"), log.gyro / DEG),
    ]
    return write_table(place / "log.csv", columns, separator=" | ")


def units_on_a_line_of_their_own(place: Path, log: Log) -> Path:
    columns = [("Time", log.t), *three(named("Rate {}"), log.gyro / DEG), *three(named("Accel {}"), log.accel)]
    columns = [(name.replace("Rate", "AngularRate"), value) for name, value in columns]
    path = write_table(place / "log.csv", columns)
    names, rest = path.read_text().split("\n", 1)
    path.write_text(f"{names}\ns,deg/s,deg/s,deg/s,m/s2,m/s2,m/s2\n{rest}")
    return path


def preamble_and_latin_1(place: Path, log: Log) -> Path:
    before = "Gerät: Wurfscheibe\nDatum: 01.06.2025\n\n"
    columns = [("Zeit / s", log.t), *three(named("Drehrate {} / °/s"), log.gyro / DEG)]
    columns += three(named("Beschleunigung {} / m/s²"), log.accel)
    return write_table(place / "messung.csv", columns, separator=";", decimal=",", encoding="latin-1", before=before)


def utf_16(place: Path, log: Log) -> Path:
    columns = [
        ("Time (s)", log.t),
        *three(named("Magnetic field {} (µT)"), log.mag),
        *three(named("Gyro {} (rad/s)"), log.gyro),
    ]
    return write_table(place / "log.csv", columns, separator="\t", encoding="utf-16")


def utf_8_with_a_mark(place: Path, log: Log) -> Path:
    columns = [("Zeit (ms)", whole(1000 * log.t)), *three(named("Magnetfeld {} (µT)"), log.mag)]
    columns += three(named("Gyroskop {} (°/s)"), log.gyro / DEG)
    return write_table(place / "log.csv", columns, separator=";", decimal=",", encoding="utf-8-sig")


def thousands_marks(place: Path, log: Log) -> Path:
    columns = [("time_us", whole(1e6 * log.t)), *three(named("acc_{}_mg"), 1000 * log.accel / G0)]
    columns += three(named("gyro_{}_dps"), log.gyro / DEG)
    return write_table(place / "log.csv", columns, separator=";", decimal=",", mark=".", digits=3)


def long_form(place: Path, log: Log) -> Path:
    lines = ["sensor,time,x,y,z"]
    for k, t in enumerate(log.t):
        for sensor, value in (("ACC", log.accel), ("GYR", log.gyro), ("MAG", log.mag)):
            lines.append(f"{sensor},{t:.4f},{value[k, 0]:.5f},{value[k, 1]:.5f},{value[k, 2]:.5f}")
    (place / "long.csv").write_text("\n".join(lines))
    return place / "long.csv"


def epoch_milliseconds_and_prefixed_axes(place: Path, log: Log) -> Path:
    stamps = [str(1_750_000_000_000 + round(1000 * t)) for t in log.t]
    columns = [("timestamp", stamps), *three(["XAccel", "YAccel", "ZAccel"], log.accel)]
    return write_table(place / "log.csv", [*columns, *three(["XGyro", "YGyro", "ZGyro"], log.gyro / DEG)])


def two_sensors_of_a_kind(place: Path, log: Log) -> Path:
    columns = [("time_s", log.t), *three(named("imu1_acc_{}"), log.accel), *three(named("imu2_acc_{}"), log.accel + 1)]
    columns += [*three(named("linear_acc_{}"), log.accel * 0.1), *three(named("imu1_gyr_{}"), log.gyro)]
    return write_table(place / "log.csv", [*columns, *three(named("imu1_mag_{}"), log.mag)])


def meaningless_names(place: Path, log: Log) -> Path:
    values = np.column_stack([log.mag, log.gyro / DEG, log.accel])
    return write_table(place / "log.csv", [("ms", whole(1000 * log.t)), *[(f"ch{k}", values[:, k]) for k in range(9)]])


def field_in_gauss_with_its_z_reversed(place: Path, log: Log) -> Path:
    reversed_z = log.mag * np.array([1.0, 1.0, -1.0]) / 100
    columns = [("t", log.t), *three(["gx", "gy", "gz"], log.gyro), *three(["ax", "ay", "az"], log.accel)]
    return write_table(place / "log.csv", [*columns, *three(["mx", "my", "mz"], reversed_z)])


def spin_about_x(place: Path, log: Log) -> Path:
    # the board stands on edge: its x is the disc's -z, y the disc's x
    def turned(value: np.ndarray) -> np.ndarray:
        return np.column_stack([-value[:, 2], value[:, 0], -value[:, 1]])

    columns = [("t_s", log.t), *three(named("gyr{}_dps"), turned(log.gyro) / DEG)]
    return write_table(place / "log.csv", [*columns, *three(named("acc{}_g"), turned(log.accel) / G0)])


def iso_stamps(place: Path, log: Log) -> Path:
    day = np.datetime64("2025-06-01T23:59:58.000000")
    stamps = [f"{day + np.timedelta64(round(1e6 * t), 'us')}Z" for t in log.t]
    columns = [
        ("Timestamp", stamps),
        *three(named("accel_{}"), log.accel / G0),
        *three(named("gyro_{}"), log.gyro / DEG),
    ]
    return write_table(place / "log.csv", columns)


def a_gap_word_and_a_trailing_comma(place: Path, log: Log) -> Path:
    mag = [[f"{v:.3f}" if k % 20 == 0 else "NaN" for k, v in enumerate(log.mag[:, a])] for a in range(3)]
    columns = [("t_s", log.t), *three(named("gyro_{}_rad_s"), log.gyro)]
    path = write_table(place / "log.csv", [*columns, *zip(named("mag_{}_uT"), mag, strict=True)])
    names, rest = path.read_text().split("\n", 1)
    path.write_text(f"{names}\n{rest.replace(chr(10), ',' + chr(10))}")
    return path


def px4_folder(place: Path, log: Log) -> Path:
    stamps = [("timestamp", whole(1e6 * log.t) + 3_000_000)]
    columns = [*stamps, *three([f"gyro_rad[{k}]" for k in range(3)], log.gyro)]
    columns += [("gyro_integral_dt", whole(0 * log.t) + 5000)]
    columns += three([f"accelerometer_m_s2[{k}]" for k in range(3)], log.accel)
    write_table(place / "ulog" / "flight_sensor_combined_0.csv", columns)
    columns = [*stamps, *three([f"magnetometer_ga[{k}]" for k in range(3)], log.mag / 100)]
    write_table(place / "ulog" / "flight_vehicle_magnetometer_0.csv", columns)
    write_table(place / "ulog" / "flight_battery_status_0.csv", [*stamps, ("voltage_v", 11.1 + 0 * log.t)])
    return place / "ulog"


def degrees_written_as_radians(place: Path, log: Log) -> Path:
    columns = [
        ("time_s", log.t),
        *three(named("gyro {} (rad/s)"), log.gyro / DEG),
        *three(named("mag {} (uT)"), log.mag),
    ]
    return write_table(place / "log.csv", columns)


def codes_of_android_without_names(place: Path, log: Log) -> Path:
    value = np.stack([log.accel, log.gyro, log.mag], axis=1).reshape(-1, 3)
    stamps, codes = np.repeat(whole(1e9 * log.t) + 1_700_000_000 * 10**9, 3), np.tile([1, 4, 2], log.t.size)
    return write_table(place / "log.csv", [("", stamps), ("", codes), *three(XYZ, value)], header=False)


def units_behind_commas(place: Path, log: Log) -> Path:
    columns = [('"time,s"', log.t), *three([f'"Accel {axis.upper()}, g"' for axis in XYZ], log.accel / G0)]
    return write_table(
        place / "log.csv", [*columns, *three([f'"Gyro {axis.upper()}, deg/s"' for axis in XYZ], log.gyro / DEG)]
    )


def units_between_bars(place: Path, log: Log) -> Path:
    """As RaceCapture writes them, with rates under the names of angles."""
    pulls = [f'"Accel{axis.upper()}"|"G"|-3.0|3.0|25' for axis in XYZ]
    turns = [f'"{angle}"|"Deg/Sec"|-120|120|25' for angle in ("Roll", "Pitch", "Yaw")]
    stamps = [('"Interval"|"ms"|0|0|1', whole(1e3 * log.t))]
    return write_table(
        place / "log.csv", [*stamps, *three(pulls, log.accel / G0), *three(turns[::-1], log.gyro[:, ::-1] / DEG)]
    )


ALL = ("gyroscope", "accelerometer", "magnetometer")
SHAPES: dict[Callable[[Path, Log], Path], tuple[str, ...]] = {
    plain_names: ALL,
    brackets_and_milliseconds: ALL,
    microseconds_and_milligauss: ALL,
    german_phyphox: ALL,
    french_phyphox_zip: ALL,
    english_raw_data: ALL[:2],
    sensor_logger_folder: ALL,
    betaflight: ALL,
    counts_of_an_mpu: ALL,
    tabs_without_header: ALL,
    blanks_with_a_commented_header: ("gyroscope", "magnetometer"),
    pipes: ALL[:2],
    units_on_a_line_of_their_own: ALL[:2],
    preamble_and_latin_1: ALL[:2],
    utf_16: ("gyroscope", "magnetometer"),
    utf_8_with_a_mark: ("gyroscope", "magnetometer"),
    thousands_marks: ALL[:2],
    long_form: ALL,
    epoch_milliseconds_and_prefixed_axes: ALL[:2],
    two_sensors_of_a_kind: ALL,
    meaningless_names: ALL,
    field_in_gauss_with_its_z_reversed: ALL,
    spin_about_x: ALL[:2],
    degrees_written_as_radians: ("gyroscope", "magnetometer"),
    iso_stamps: ALL[:2],
    px4_folder: ALL,
    a_gap_word_and_a_trailing_comma: ("gyroscope", "magnetometer"),
    codes_of_android_without_names: ALL,
    units_behind_commas: ALL[:2],
    units_between_bars: ALL[:2],
}
#: What a reading may be off by: rounding as written above (1/2048 g, 0.15 uT, a whole deg/s), and 0.1 % of a scale.
TOLERANCE = {"gyroscope": 0.6 * DEG + 0.001, "accelerometer": 0.006, "magnetometer": 0.15}
