"""Axes below a line that names their sensor, as examples for Arduino print them."""

from __future__ import annotations

import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.other_forms.headed_lines import begins

LOG = made_log()


def written(head: str, axes: str, stamp: str = "") -> str:
    """Return a text with a ``head`` for each sensor's name and its ``axes`` below it."""
    named = (("Accelerometer", LOG.accel / G0), ("Gyroscope", LOG.gyro / DEG), ("Magnetometer", LOG.mag))
    lines = []
    for k in range(LOG.t.size):
        for name, value in named:
            x, y, z = value[k]
            lines += (head.format(name) + "\n" + axes.format(x=x, y=y, z=z)).split("\n")
    return "".join(f"{stamp}{line}\n" for line in lines)


@pytest.mark.parametrize("head", ["{}", "--- {}: ---", "[{}]", "{} data"])
@pytest.mark.parametrize("axes", ["X: {x:.4f} Y: {y:.4f} Z: {z:.4f}", "  x = {x:.4f}\n  y = {y:.4f}\n  z = {z:.4f}"])
def test_the_name_above_the_axes_is_theirs(tmp_path, head, axes):
    """All three were read as one gyroscope, a row each, and no throw was found."""
    raw = tmp_path / "log.txt"
    raw.write_text(written(head, axes))
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-3)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=1e-3)
    assert "the names of its sensors stand above their axes" in found.summary()


def test_a_serial_monitor_s_stamps_stand_before_both(tmp_path):
    raw = tmp_path / "log.txt"
    text = written("{}", "X: {x:.4f} Y: {y:.4f} Z: {z:.4f}", "STAMP")
    lines = text.splitlines()
    stamped = [line.replace("STAMP", f"14:03:{20 + k // 6 / 200:06.3f} -> ") for k, line in enumerate(lines)]
    raw.write_text("\n".join([*stamped, ""]))
    samples = import_log(raw).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["gyroscope"].t - samples["gyroscope"].t[0], LOG.t, atol=1e-9)


@pytest.mark.parametrize("head", ["[IMU{}]:", "{}:", "---{}---"])
@pytest.mark.parametrize(
    "axes", ["{x:.4f} {y:.4f} {z:.4f}", "({x:.4f}, {y:.4f}, {z:.4f})", "{x:.4f}\n{y:.4f}\n{z:.4f}"]
)
def test_numbers_below_a_sensor_s_name_are_its_axes(tmp_path, head, axes):
    """They were one magnetometer of a row for each sensor, by the size of some of them."""
    raw = tmp_path / "log.txt"
    raw.write_text("MPU9250 ready\n" + written(head, axes))
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-3)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=1e-3)


@pytest.mark.parametrize("time", ["[Time]: {:.0f}\n", "t={:.0f} ms\n"])
@pytest.mark.parametrize("below", ["\n", " "])
def test_a_line_of_the_time_goes_with_names_in_brackets(tmp_path, time, below):
    """On the line of the name, too: the names in brackets were none, and the time was lost."""
    text = ""
    for t, gyro, accel in zip(LOG.t, LOG.gyro / DEG, LOG.accel / G0, strict=True):
        for name, value in (("[Time]", [t]), ("[IMUGyro]", gyro), ("[IMUAcc]", accel)):
            numbers = " ".join(f"{number:.4f}" for number in value)
            text += time.format(1000 * t) if name == "[Time]" else f"{name}:{below}{numbers}\n"
    raw = tmp_path / "log.txt"
    raw.write_text(text)
    samples = import_log(raw).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-9)


@pytest.mark.parametrize(
    "text", ["Gyroscope\n" + "1,2,3\n" * 40, "Gyroscope\nX: 1 Y: 2 Z: 3\n", "x: 1 y: 2\n" * 40, "1,2,3\n" * 40]
)
def test_other_texts_are_left_as_they_are(tmp_path, text):
    raw = tmp_path / "log.txt"
    raw.write_text(text)
    assert not begins(raw)
