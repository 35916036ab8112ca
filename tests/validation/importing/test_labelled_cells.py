"""What Arduino's serial monitor shows (`gx:1.0 gy:2.0`) is read; what ROS prints of a topic is refused by its name."""

from __future__ import annotations

from itertools import chain

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
CELLS = np.column_stack([LOG.t * 1000, LOG.gyro / DEG, LOG.accel / G0])

SHORT = ["ms", "gx", "gy", "gz", "ax", "ay", "az"]
LONG = ["Time ms", "Gyro X", "Gyro Y", "Gyro Z", "Accel X", "Accel Y", "Accel Z"]


@pytest.mark.parametrize(
    ("names", "label", "between"),
    [(SHORT, ":", " "), (SHORT, ":", ","), (SHORT, "=", "\t"), (LONG, ": ", ", "), (LONG, " : ", " | ")],
)
def test_cells_with_their_names_before_them_are_read(tmp_path, names, label, between):
    lines = [between.join(f"{n}{label}{cell:.4f}" for n, cell in zip(names, row, strict=True)) for row in CELLS]
    raw = tmp_path / "serial.txt"
    raw.write_text("\n".join(["MPU6050 ready", *lines[:50], lines[50][:20], *lines[51:], ""]))
    whole = import_log(raw)
    read = whole.recordings[0].samples["gyroscope"]
    assert_allclose(read.value[:, 2], np.delete(LOG.gyro[:, 2], 50), atol=1e-5)
    assert_allclose(read.t, np.delete(LOG.t, 50), atol=1e-6)
    assert "text: each cell has its name before it" in whole.summary()
    assert len(whole.throws) == 1


def test_the_stamps_of_the_serial_monitor_are_the_time(tmp_path):
    stamp = [f"12:00:{t:06.3f} -> " for t in LOG.t]
    lines = [s + " ".join(f"{n}:{c:.4f}" for n, c in zip(SHORT[1:], row[1:], strict=True))
             for s, row in zip(stamp, CELLS, strict=True)]  # fmt: skip
    raw = tmp_path / "serial.txt"
    raw.write_text("\n".join([*lines, ""]))
    assert_allclose(import_log(raw).recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-6)


@pytest.mark.parametrize(
    ("first", "cells"),
    [
        ("{:.0f}: ", "ax={3} ay={4} az={5} gx={0} gy={1} gz={2}"),
        ("{:.0f} ms, ", "Acc: {3} {4} {5}, Gyro: {0} {1} {2}"),
        ("[{:.0f}] ", "A[{3},{4},{5}] G[{0},{1},{2}]"),
    ],
)
def test_a_number_before_the_first_name_is_the_time(tmp_path, first, cells):
    """It made such lines no rows, or lost the accelerometer and the time."""
    lines = [first.format(row[0]) + cells.format(*(f"{cell:.4f}" for cell in row[1:])) for row in CELLS]
    raw = tmp_path / "serial.txt"
    raw.write_text("\n".join([*lines, ""]))
    samples = import_log(raw).recordings[0].samples
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-3)


@pytest.mark.parametrize(("begin", "end"), [("", ""), ("\x1b[0;32m", "\x1b[0m")])
@pytest.mark.parametrize("names", [True, False])
def test_what_esp_idf_s_log_puts_before_a_line_is_the_time(tmp_path, begin, end, names):
    """Such a log had "no rows of numbers in it"."""
    cells = [
        " ".join(f"{n}={c:.4f}" if names else f"{c:.4f}" for n, c in zip(SHORT[1:], row[1:], strict=True))
        for row in CELLS
    ]
    lines = [f"{begin}I ({1e3 * t + 412:.0f}) imu: {text}{end}" for t, text in zip(LOG.t, cells, strict=True)]
    raw = tmp_path / "esp.log"
    raw.write_text(
        "\n".join(["ESP-ROM:esp32c3", "I (29) boot: ESP-IDF v5.1", *lines[:9], "I (460) wifi: up", *lines[9:], ""])
    )
    read = import_log(raw).recordings[0].samples["gyroscope"]
    assert_allclose(read.t, LOG.t, atol=1e-6)
    assert_allclose(read.value[:, 2], LOG.gyro[:, 2], atol=1e-3)


def test_what_ros_prints_of_a_topic_is_refused_with_what_to_do(tmp_path):
    message = "header:\n  stamp:\n    sec: 1\nangular_velocity:\n  x: 0.1\n  y: 0.2\n  z: 0.3\n---\n"
    (tmp_path / "imu.yaml").write_text(message * 50)
    with pytest.raises(InputError, match=r"is the YAML that `ros2 topic echo` .* prints, no table; expected the bag"):
        import_log(tmp_path / "imu.yaml")


def block(gyro: FloatArray, accel: FloatArray, stamp: str = "") -> list[str]:
    """Return the lines that an example of Adafruit's for an MPU6050 prints of one reading."""
    values = [(*accel, "m/s^2"), (*gyro, "rad/s")]
    lines = [
        f"{name} X: {x:.2f}, Y: {y:.2f}, Z: {z:.2f} {unit}"
        for name, (x, y, z, unit) in zip(("Acceleration", "Rotation"), values, strict=True)
    ]
    return [f"{stamp}{line}" for line in (*lines, "Temperature: 24.50 degC", "")]


def test_a_record_over_several_lines_is_joined(tmp_path):
    raw = tmp_path / "serial.txt"
    blocks = [block(gyro, accel) for gyro, accel in zip(LOG.gyro, LOG.accel, strict=True)]
    del blocks[30][1]  # the rotation of one reading is missing
    raw.write_text("\n".join(["Adafruit MPU6050 test!", "MPU6050 Found!", "", *chain(*blocks)]))
    whole = import_log(raw)
    samples = whole.recordings[0].samples
    for name, values in (("gyroscope", LOG.gyro), ("accelerometer", LOG.accel)):
        assert_allclose(samples[name].value, np.delete(values, 30, axis=0), atol=0.006)
    # the reading that is left out keeps its place in time
    assert np.argmax(np.diff(samples["gyroscope"].t)) == 29
    assert "gyroscope unit: rad/s (certain: the header says so" in whole.summary()
    left_out = [repair.what for repair in whole.imported[0].repairs if "row left out" in repair.action]
    assert "data row 32 has 3 cells under names of its columns, expected 7" in left_out


def test_of_a_record_over_several_lines_the_stamp_of_the_first_is_the_time(tmp_path):
    raw = tmp_path / "serial.txt"
    lines = [
        line
        for t, gyro, accel in zip(LOG.t, LOG.gyro, LOG.accel, strict=True)
        for line in block(gyro, accel, f"12:00:{t:06.3f} -> ")
    ]
    raw.write_text("\n".join(lines))
    assert_allclose(import_log(raw).recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-6)


@pytest.mark.parametrize(
    "form",
    [
        "Scaled. Acc (mg) [ {0:09.2f}, {1:09.2f}, {2:.2f} ], Gyr (DPS) [ {3:.2f}, {4:.2f}, {5:.2f} ], Tmp (C) [ 24.5 ]",
        "Accel: {0:.2f}, {1:.2f}, {2:.2f} mg Gyro: {3:.2f}, {4:.2f}, {5:.2f} dps",
        "acc=({0:.2f} {1:.2f} {2:.2f}) mg; gyro=({3:.2f} {4:.2f} {5:.2f}) dps",
    ],
)
def test_three_numbers_behind_one_name_are_its_axes(tmp_path, form):
    raw = tmp_path / "serial.txt"
    rows = zip(LOG.accel / G0 * 1000, LOG.gyro / DEG, strict=True)
    raw.write_text("\n".join(form.format(*accel, *gyro) for accel, gyro in rows))
    whole = import_log(raw)
    assert_allclose(whole.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(whole.recordings[0].samples["accelerometer"].value, LOG.accel, atol=1e-4)
    assert len(whole.throws) == 1


def test_a_map_may_name_cells_without_the_units_behind_them(tmp_path):
    raw = tmp_path / "serial.txt"
    raw.write_text("\n".join(line for both in zip(LOG.gyro, LOG.accel, strict=True) for line in block(*both)))
    import_log(raw).report(tmp_path / "out")
    written = (tmp_path / "out" / "map.toml").read_text()
    short = written.replace(" (rad/s)", "").replace(" (m/s^2)", "").replace(" (degC)", "")
    assert short != written
    (tmp_path / "own.toml").write_text(short)
    read = import_log(raw, map=str(tmp_path / "own.toml")).recordings[0].samples["gyroscope"]
    assert_allclose(read.value, LOG.gyro, atol=0.006)


def printed(form: str) -> list[str]:
    """Return the lines that a well-known example for a board of nine axes prints of each reading."""
    found = []
    for gyro, accel, mag in zip(LOG.gyro / DEG, LOG.accel / G0, LOG.mag, strict=True):
        (gx, gy, gz), (ax, ay, az), (mx, my, mz) = gyro, accel, mag
        if form == "SparkFun LSM9DS1":
            found += [
                f"G: {gx:.2f}, {gy:.2f}, {gz:.2f} deg/s",
                f"A: {ax:.4f}, {ay:.4f}, {az:.4f} g",
                f"M: {mx / 100:.4f}, {my / 100:.4f}, {mz / 100:.4f} gauss",
                "Pitch, Roll: 1.20, -3.40",
                "Heading: 12.30",
                "",
            ]
        else:
            found += [
                f"ax = {1e3 * ax:.2f} ay = {1e3 * ay:.2f} az = {1e3 * az:.2f} mg",
                f"gx = {gx:.2f} gy = {gy:.2f} gz = {gz:.2f} deg/s",
                f"mx = {10 * mx:.1f} my = {10 * my:.1f} mz = {10 * mz:.1f} mG",
                "rate = 130.00 Hz",
            ]
    return found


@pytest.mark.parametrize("form", ["SparkFun LSM9DS1", "Winer MPU9250"])
def test_a_unit_behind_the_last_of_three_is_that_of_all_and_the_field_tells_how_far_apart_rows_are(tmp_path, form):
    """The first had no magnetometer, the second no sensor of motion; both had rows 0.01 s apart, which are 0.005."""
    raw = tmp_path / "serial.txt"
    raw.write_text("\n".join(printed(form)))
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-3)
    assert_allclose(samples["magnetometer"].value[:, 2], LOG.mag[:, 2], atol=0.02)
    assert "with this step the field turns as fast as the gyroscope says (deg/s)" in found.summary()
    # its standard deviation is 4 %
    assert samples["gyroscope"].t[-1] == pytest.approx(LOG.t[-1], rel=0.04)


@pytest.mark.parametrize(
    ("line", "header"),
    [
        ("({:.4f}, {:.4f}, {:.4f}), ({:.2f}, {:.2f}, {:.2f}), ({:.2f}, {:.2f}, {:.2f})", ""),
        ('"({:.4f}, {:.4f}, {:.4f})","({:.2f}, {:.2f}, {:.2f})","({:.2f}, {:.2f}, {:.2f})"', "acc,gyro,mag"),
        ("[{:.4f}, {:.4f}, {:.4f}];[{:.2f}, {:.2f}, {:.2f}];[{:.2f}, {:.2f}, {:.2f}]", "acc;gyro;mag"),
        ("[ {:.4f} {:.4f} {:.4f}],[{:.2f} {:.2f} {:.2f}],[{:.2f} {:.2f} {:.2f}]", "acc,gyro,mag"),
    ],
)
def test_what_python_prints_of_tuples_and_arrays_is_three_columns_each(tmp_path, line, header):
    cells = np.column_stack([LOG.accel / G0, LOG.gyro / DEG, LOG.mag])
    raw = tmp_path / "log.txt"
    raw.write_text("\n".join([*([header] if header else []), *(line.format(*row) for row in cells), ""]))
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-3)
    assert_allclose(samples["magnetometer"].value[:, 2], LOG.mag[:, 2], atol=0.02)
    assert ("gyro x, gyro y, gyro z" in found.summary()) == bool(header)


def test_a_clock_behind_a_word_and_a_counter_without_names_is_the_time(tmp_path):
    """Rows were taken as 0.01 s apart, and the columns behind the clock were cut in threes from a wrong one on."""
    rows = [
        f"v2,{k},{1e6 * t:.0f}," + ",".join(f"{x:.4f}" for x in (*accel, *gyro, *mag)) + ",24.1,3,3"
        for k, (t, gyro, accel, mag) in enumerate(zip(LOG.t, LOG.gyro / DEG, LOG.accel / G0, LOG.mag, strict=True))
    ]
    raw = tmp_path / "log.txt"
    raw.write_text("\n".join([*rows, ""]))
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert "'c3' in us (likely: whole numbers 5000 apart" in found.summary()
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-4)
    assert {*samples} == {"gyroscope", "accelerometer", "magnetometer"}


def test_axes_behind_their_sensors_name_with_bars_between_are_read(tmp_path):
    """What an example for the BNO055 prints was said to hold no rows of numbers."""
    sensors = (("Orient", np.zeros_like(LOG.mag)), ("Gyro", LOG.gyro), ("Mag", LOG.mag), ("Accl", LOG.accel))
    lines = []
    for k in range(LOG.t.size):
        lines += [f"{name}:\tx= {v[k, 0]:.3f} |\ty= {v[k, 1]:.3f} |\tz= {v[k, 2]:.3f}" for name, v in sensors]
        lines.append("")
    raw = tmp_path / "serial.txt"
    raw.write_text("\n".join(lines))
    samples = import_log(raw).recordings[0].samples
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-3)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-3)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=1e-3)


@pytest.mark.parametrize("stamped", [True, False])
def test_what_a_device_prints_for_teleplot_is_read(tmp_path, stamped):
    """One number a line, with or without the time and a unit; there were "no rows of numbers in it"."""
    lines = []
    for t, gyro, accel, mag in zip(LOG.t, LOG.gyro / DEG, LOG.accel / G0, LOG.mag, strict=True):
        for name, value, unit in (("g", gyro, "dps"), ("a", accel, "g"), ("m", mag, "uT")):
            at, behind = (f"{1627551892437 + 1000 * t:.0f}:", f"|{unit}") if stamped else ("", "")
            lines += [f">{name}{axis}:{at}{x:.4f}{behind}" for axis, x in zip("xyz", value, strict=True)]
    raw = tmp_path / "serial.txt"
    raw.write_text("\n".join(["booting", *lines, ""]))
    samples = import_log(raw).recordings[0].samples
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-4)
    assert_allclose(samples["accelerometer"].value[:, 2], LOG.accel[:, 2], atol=1e-3)
    assert_allclose(samples["gyroscope"].t, LOG.t, rtol=1e-6 if stamped else 0.04, atol=1e-6)
