"""Names of two sensors exchanged in a header: the readings say which is which, and the import says so aloud."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log, three, write_table

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

LOG = made_log()


def log(path: Path, names: tuple[str, str, str], kept: slice = slice(None)) -> Path:
    """Write the gyroscope (deg/s), accelerometer (g) and magnetometer (uT) under names such as ``g{}``."""
    values = (LOG.gyro / DEG, LOG.accel / G0, LOG.mag)
    columns = [("t_s", LOG.t[kept])]
    for name, value in zip(names, values, strict=True):
        columns += three([name.format(axis) for axis in "xyz"], value[kept])
    return write_table(path, columns)


@pytest.mark.parametrize(
    ("names", "which"),
    [
        (("a{}", "g{}", "m{}"), "accelerometer and gyroscope"),
        (("acc_{}_g", "gyro_{}_dps", "mag_{}_uT"), "accelerometer and gyroscope"),
        (("m{}", "a{}", "g{}"), "gyroscope and magnetometer"),
        (("g{}", "m{}", "a{}"), "accelerometer and magnetometer"),
        (("a{}", "m{}", "g{}"), "accelerometer and gyroscope and magnetometer"),
    ],
)
def test_exchanged_names_are_told_and_taken_by_their_readings(tmp_path, names, which):
    whole = import_log(log(tmp_path / "log.csv", names))
    read = whole.recordings[0].samples
    assert_allclose(read["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(read["accelerometer"].value, LOG.accel, atol=2e-5)
    assert len(whole.throws) == 1
    (line,) = [note for note in whole.notes if "EXCHANGED" in note]
    assert line.startswith(f"WARNING: the names of {which} are EXCHANGED")
    assert "[sensors.gyroscope] columns = [" in line or "gyroscope" not in which
    assert not any("left out" in note for note in whole.notes)


def test_without_a_magnetometer_they_are_told_as_well(tmp_path):
    columns = [("ms", np.round(1000 * LOG.t).astype(int)), *three(["ax", "ay", "az"], LOG.gyro / DEG)]
    columns += three(["gx", "gy", "gz"], LOG.accel / G0)
    whole = import_log(write_table(tmp_path / "log.csv", columns))
    assert_allclose(whole.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert "accelerometer: gx, gy, gz (likely: " in whole.summary()
    assert "gravity" in whole.summary()


@pytest.mark.parametrize("kept", [slice(None), slice(810, 1390)])
def test_right_names_are_believed_with_a_rest_and_without(tmp_path, kept):
    whole = import_log(log(tmp_path / "log.csv", ("g{}", "a{}", "m{}"), kept))
    assert not any("EXCHANGED" in note for note in whole.notes)
    assert_allclose(whole.recordings[0].samples["gyroscope"].value[:, 2], LOG.gyro[kept, 2], atol=1e-5)


def test_acceleration_without_gravity_beside_a_gyroscope_with_a_bias_of_one_is_no_exchange(tmp_path):
    """Linear acceleration rests at nothing as a gyroscope does; a bias of 1 deg/s has gravity's size in g."""
    gyro = LOG.gyro / DEG + [0.0, 0.0, 1.0]
    linear = LOG.accel / G0 - [0.0, 0.0, -1.0]
    columns = [("t_s", LOG.t), *three(["gx", "gy", "gz"], gyro), *three(["ax", "ay", "az"], linear)]
    whole = import_log(write_table(tmp_path / "log.csv", columns))
    assert not any("EXCHANGED" in note for note in whole.notes)


def test_a_table_that_turns_at_a_steady_1000_deg_s_has_its_names_right(tmp_path):
    t = np.arange(0, 20, 0.01)
    rng = np.random.default_rng(1)
    rate = np.interp(t, [0, 1, 2, 14, 15, 17, 18, 20], np.array([0, 0, 1000, 1000, 2000, 2000, 0, 0]))
    gyro = np.column_stack([0 * t, 0 * t, rate]) + 0.1 * rng.standard_normal((t.size, 3))
    accel = np.column_stack([0.1 * (rate * DEG) ** 2, 0 * t, 0 * t - G0]) + 0.03 * rng.standard_normal((t.size, 3))
    columns = [("t_s", t), *three(["gx", "gy", "gz"], gyro), *three(["ax", "ay", "az"], accel)]
    whole = import_log(write_table(tmp_path / "log.csv", columns))
    assert not any("EXCHANGED" in note for note in whole.notes)
    assert_allclose(np.abs(whole.recordings[0].samples["gyroscope"].value[:, 2]).max(), 2000 * DEG, rtol=0.01)


def test_names_that_a_second_time_moved_by_a_column_are_refused(tmp_path):
    """Its accelerometer was (time, x, y), without gravity at rest, and its gyroscope had gravity on it."""
    late = np.random.default_rng(4).exponential(0.0008, LOG.t.size)
    names = ["accelX", "accelY", "accelZ", "gyroX", "gyroY", "gyroZ"]
    columns = [("timestamp", 1723940841.0 + LOG.t + late), (names[0], 1e3 * LOG.t)]
    columns += [*three(names[1:4], LOG.accel), *zip(names[4:], LOG.gyro[:, :2].T, strict=True)]
    with pytest.raises(InputError, match="'accelX' is the accelerometer's by its name and goes on as 'timestamp' does"):
        import_log(write_table(tmp_path / "log.csv", columns))


@pytest.mark.parametrize("rise", [1.0, 0.3])
def test_a_reading_that_rises_is_no_time(tmp_path, rise):
    """Its noise tells it, or how fast it rises."""
    noise = np.random.default_rng(5).normal(0, 0.05 if rise == 1.0 else 1e-5, LOG.t.size)
    mag = np.column_stack([rise * LOG.t + noise, LOG.mag[:, 1:]])
    columns = [("t_s", LOG.t), *three(["gx", "gy", "gz"], LOG.gyro), *three(["mx", "my", "mz"], mag)]
    assert import_log(write_table(tmp_path / "log.csv", columns)).recordings


@pytest.mark.parametrize("worth", [1.0, 1.16])
def test_forces_under_the_letter_g_alone_are_an_accelerometer_s(tmp_path, worth):
    """A flight sensor wrote GX, GY, GZ for g: 9.5 deg/s at rest were called a gyroscope's, certainly."""
    aslant = LOG.accel.copy()
    aslant[: len(aslant) // 2] = np.roll(aslant[: len(aslant) // 2], 1, axis=1)  # it is picked up and laid on its side
    names = ["GX", "GY", "GZ"]
    columns = [("Zeit (ms)", np.round(1000 * LOG.t).astype(int)), *three(names, aslant / worth)]
    whole = import_log(write_table(tmp_path / "log.csv", columns))
    assert set(whole.recordings[0].samples) == {"accelerometer"}
    (line,) = [note for note in whole.notes if "is taken as one" in note]
    assert line.startswith("WARNING: GX, GY, GZ reads as an accelerometer (")
    assert line.endswith('[sensors.gyroscope] columns = ["GX", "GY", "GZ"]')


def test_a_gyroscope_under_the_letter_g_alone_is_one(tmp_path):
    columns = [("Zeit (ms)", np.round(1000 * LOG.t).astype(int)), *three(["GX", "GY", "GZ"], LOG.gyro / DEG)]
    whole = import_log(write_table(tmp_path / "log.csv", columns))
    assert set(whole.recordings[0].samples) == {"gyroscope"}
    assert not any("is taken as one" in note for note in whole.notes)
