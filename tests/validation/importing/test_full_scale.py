"""A gyroscope of whole deg/s hides its noise: where it stands at a full scale, it is clipped, and the range is told."""

from __future__ import annotations

import numpy as np
import pytest
from support.made_logs import DEG, made_log, three, write_table

from discsim.recording import read_recording, write_recording
from discsim.validation.checking.check import check_recording
from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.full_scale import full_scale
from discsim.validation.importing.sniffing.spin_axis import Reading3

LOG = made_log()


def log(path, limit):
    """Write the log with a gyroscope of whole deg/s that ends at ``limit``, and counts of 2048 per g that end at 16 g.

    A hand's jerk of 20 g, to and fro, clips the accelerometer's x before the release.
    """
    gyro = np.clip(np.rint(LOG.gyro / DEG), -limit, limit).astype(int)
    jerk = np.zeros_like(LOG.accel)
    jerk[300:330, 0] = np.repeat([0.0, 200.0, 0.0, -200.0, 0.0, 200.0], 5)
    counts = np.clip(np.rint((LOG.accel + jerk) / 9.80665 * 2048), -32768, 32767).astype(int)
    columns = [("time_us", np.round(1e6 * LOG.t).astype(int))]
    columns += three(["gyroADC[0]", "gyroADC[1]", "gyroADC[2]"], gyro)
    columns += three(["accSmooth[0]", "accSmooth[1]", "accSmooth[2]"], counts)
    columns += three(["mag_x", "mag_y", "mag_z"], LOG.mag)
    return write_table(path, columns, digits=4)


def test_a_spin_beyond_a_full_scale_is_told_by_the_magnetometer(tmp_path):
    found = import_log(log(tmp_path / "log.csv", 1000))
    assert "gyroscope range: 1000 deg/s (likely: a full scale that parts have; readings stand at it" in found.summary()
    assert "range_rad_s = 17.4532925 # 1000 deg/s" in found.map_text
    (throw,) = found.throws
    assert throw.sensor == "magnetometer"
    assert throw.spin == pytest.approx(32, rel=0.06)


def test_the_range_of_a_gyroscope_that_shows_the_spin_is_left_open(tmp_path):
    found = import_log(log(tmp_path / "log.csv", 4000))
    assert "range_rad_s" not in found.map_text
    assert "gyroscope range" not in found.summary()


def test_counts_at_the_end_of_16_bits_are_clipped_and_did_not_fail(tmp_path):
    said = import_log(log(tmp_path / "log.csv", 4000)).summary()
    assert "32767 in" not in said
    assert "-32768 in" not in said


@pytest.mark.parametrize(
    ("rate", "step", "seconds", "told"),
    [
        (2000.0, 1.0, 1.0, True),
        (-2000.0, 1.0, 1.0, True),
        (1999.9, 0.1, 1.0, True),  # 16 bits end a step below
        (1990.0, 1.0, 1.0, False),  # no full scale
        (2000.0, 1.0, 0.05, False),  # a crest
        (250.0, 1.0, 0.15, False),  # a slow spin takes 0.2 s for a step
    ],
)
def test_a_full_scale_is_one_at_which_readings_stand_longer_than_a_free_spin_does(rate, step, seconds, told):
    t = np.arange(0.0, 3.0, 0.002)
    spin = np.where(t < 1.0, rate * t, np.where(t < 1.0 + seconds, rate, 0.5 * rate))
    wobble = 30.0 * np.sin(40.0 * t)
    value = step * np.rint(np.column_stack([wobble, -wobble, spin]) / step)
    found = full_scale(Reading3(t, value * DEG))
    assert (found is not None) == told
    if found is not None:
        assert found[0] == pytest.approx(2000 * DEG)


@pytest.mark.parametrize(
    ("ends", "step", "told"),
    [
        ((250.13, -250.14), 0.01, True),  # 131 counts per deg/s, as a MPU-6050's data sheet has it
        ((250.13, -249.0), 0.01, False),
        ((2000.0, -2000.0), 1.0, False),  # whole deg/s: two largest rates may come to lie there
    ],
)
def test_both_ends_of_a_full_scale_are_not_met_by_chance(ends, step, told):
    """A board shaken by hand at 10 rows a second clips for one reading at a time."""
    rng = np.random.default_rng(7)
    value = np.clip(rng.normal(0.0, 0.5 * ends[0], (150, 3)), ends[1], ends[0])
    found = full_scale(Reading3(0.1 * np.arange(150), step * np.rint(value / step) * DEG))
    assert (found is not None) == told
    if found is not None:
        assert found[0] == pytest.approx(2**15 / 131 * DEG)
        assert "both its ends" in found[1].text


def test_a_reading_beyond_shows_a_wider_range():
    t = np.arange(0.0, 3.0, 0.002)
    value = np.column_stack([np.full(t.size, 40.0) + (t > 2), np.zeros(t.size), np.where(t < 2, 1000.0, 1200.0)])
    assert full_scale(Reading3(t, value * DEG)) is None


def test_check_names_the_line_that_states_the_range_and_is_content_with_it(tmp_path):
    found = import_log(log(tmp_path / "log.csv", 1000))
    mine = tmp_path / "mine.toml"
    mine.write_text("\n".join(line for line in found.map_text.splitlines() if not line.startswith("range_")))
    recording = import_log(tmp_path / "log.csv", str(mine), throw=1).recordings[0]
    (told,) = [one for one in check_recording(recording).findings if one.id == "gyroscope.range"]
    assert told.severity == "warning"
    line = "range_rad_s = 17.4532925"
    assert line in told.remedy
    write_recording(recording, tmp_path / "folder")
    stated = tmp_path / "folder" / "recording.toml"
    stated.write_text(stated.read_text().replace("[sensors.gyroscope]", f"[sensors.gyroscope]\n{line}"))
    ids = [one.id for one in check_recording(read_recording(tmp_path / "folder")).findings]
    assert "gyroscope.range" not in ids
    assert "gyroscope.clipped" in ids
