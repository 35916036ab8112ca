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


@pytest.mark.parametrize("text", ["Gyroscope\nX: 1 Y: 2 Z: 3\n", "x: 1 y: 2\n" * 40, "1,2,3\n" * 40])
def test_other_texts_are_left_as_they_are(tmp_path, text):
    raw = tmp_path / "log.txt"
    raw.write_text(text)
    assert not begins(raw)
