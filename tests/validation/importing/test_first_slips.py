"""Slips of strangers that came in silently: each comes in rightly now, or is told with what was expected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, FIELD, G0, made_log, three, write_table

from discsim.environment import Environment
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
XYZ = ("x", "y", "z")


def named(pattern: str) -> list[str]:
    return [pattern.format(axis) for axis in XYZ]


def both(path: Path, gyro: np.ndarray, accel: np.ndarray, names: str = "g{}", mag: np.ndarray | None = None) -> Path:
    columns = [("t_s", LOG.t), *three(named(names), gyro), *three(named("acc_{}_g"), accel / G0)]
    return write_table(path, columns + ([] if mag is None else three(named("mag_{}_uT"), mag)))


def spun(raw: Path) -> np.ndarray:
    return import_log(raw).recordings[0].samples["gyroscope"].value[:, 2]


def test_rad_s_under_a_header_of_deg_s_are_told_by_gravity_in_a_hand(tmp_path):
    """Without a magnetometer: the spin came in 57 times too slow."""
    whole = import_log(both(tmp_path / "log.csv", LOG.gyro, LOG.accel, "gyro_{}_dps"))
    assert_allclose(whole.recordings[0].samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-5)
    assert "gyroscope unit: rad/s (likely: gravity turns as fast as rad/s would, although" in whole.summary()


def test_rad_s_under_a_header_of_deg_s_are_told_by_the_pull_to_the_centre_of_a_throw_alone(tmp_path):
    kept = slice(810, 1390)
    columns = [("t_s", LOG.t[kept]), *three(named("gyro_{}_dps"), LOG.gyro[kept])]
    whole = import_log(write_table(tmp_path / "log.csv", columns + three(named("acc_{}_g"), LOG.accel[kept] / G0)))
    assert_allclose(np.abs(whole.recordings[0].samples["gyroscope"].value), np.abs(LOG.gyro[kept]), atol=1e-5)
    assert "gyroscope unit: rad/s (likely: the pull to the centre is that of 16" in whole.summary()


def test_a_unit_that_nothing_states_is_told_by_the_pull_to_the_centre(tmp_path):
    """Rounded to 0.01 the rad/s looked like a gyroscope's deg/s, and no throw was found."""
    kept = slice(810, 1390)
    columns = [("t_s", LOG.t[kept]), *three(named("g{}"), np.round(LOG.gyro[kept], 2))]
    raw = write_table(tmp_path / "log.csv", columns + three(named("acc_{}_g"), LOG.accel[kept] / G0))
    whole = import_log(raw)
    assert_allclose(np.abs(whole.recordings[0].samples["gyroscope"].value), np.abs(LOG.gyro[kept]), atol=0.006)
    why = "the pull to the centre is that of 16.1 mm from the axis, by deg/s it would be 53 m"
    assert f"gyroscope unit: rad/s (likely: {why})" in whole.summary()


def slowly(path: Path, gyro: np.ndarray, accel: np.ndarray) -> str:
    """Return what is said of the gyroscope's unit in a part of a log, of which no header states any."""
    t = 0.005 * np.arange(len(gyro))
    columns = [("t", t), *three(named("g{}"), np.round(gyro, 2)), *three(named("a{}"), np.round(accel, 3))]
    (line,) = (
        line for line in import_log(write_table(path, columns)).summary().splitlines() if "gyroscope unit" in line
    )
    return line


def test_a_throw_by_itself_whose_spin_hardly_changes_tells_its_unit_by_a_pull_that_no_gravity_is(tmp_path):
    """31 rad/s of a throw alone without units came in as 31 deg/s."""
    kept = slice(810, 930)
    assert np.ptp(LOG.gyro[kept, 2]) < 0.1 * np.max(np.abs(LOG.gyro[kept, 2]))
    assert "rad/s (likely: the pull to the centre is that of 16" in slowly(
        tmp_path / "log.csv", LOG.gyro[kept], LOG.accel[kept]
    )


def test_gravity_across_a_slow_turn_is_no_pull(tmp_path):
    rng, t = np.random.default_rng(4), 0.005 * np.arange(400)
    gyro = np.column_stack([0 * t, 0 * t, 31.0 + 0 * t]) + rng.normal(0.0, 0.05, (400, 3))
    accel = np.column_stack([G0 * np.cos(0.54 * t), G0 * np.sin(0.54 * t), 0 * t])
    assert "pull to the centre" not in slowly(tmp_path / "log.csv", gyro, accel + rng.normal(0.0, 0.05, (400, 3)))


def test_a_line_of_units_with_some_that_are_none_known_is_one(tmp_path):
    """Shimmer's has `local_flux` of a magnetometer, and `m/(s^2)`: it was taken for the names."""
    raw = both(tmp_path / "log.csv", LOG.gyro / DEG, LOG.accel * G0, mag=LOG.mag / 50)
    rows = raw.read_text().splitlines()[1:]
    units = ["s", *3 * ["deg/s"], *3 * ["m/(s^2)"], *3 * ["local_flux"]]
    names = [f"Shimmer_5E2F_{kind}_{axis}_CAL" for kind in ("Gyro", "Accel_WR", "Mag") for axis in "XYZ"]
    raw.write_text("\n".join([",".join(["Timestamp", *names]), ",".join(units), *rows, ""]))
    whole = import_log(raw)
    assert_allclose(whole.recordings[0].samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-5)
    assert_allclose(whole.recordings[0].samples["accelerometer"].value[:, 2], LOG.accel[:, 2], atol=1e-4)
    assert "gyroscope unit: deg/s (certain: the header says so" in whole.summary()


@pytest.mark.parametrize("arm", [0.3, 1.5])
def test_a_right_header_is_believed_whatever_the_arm_is_up_to_metres(tmp_path, arm):
    """A swing on a rope is a motion, too."""
    swung = LOG.gyro / 20
    accel = LOG.accel.copy()
    accel[:, 0] = arm * np.sum(swung**2, axis=1)
    raw = both(tmp_path / "log.csv", swung / DEG, accel, "gyro_{}_dps")
    assert_allclose(spun(raw), swung[:, 2], atol=1e-5)


def test_mrad_s_are_a_gyroscopes(tmp_path):
    raw = both(tmp_path / "log.csv", LOG.gyro * 1000, LOG.accel, "gyro_{}_mrad_s")
    assert_allclose(spun(raw), LOG.gyro[:, 2], atol=1e-5)


@pytest.mark.parametrize("name", ["motion.csv", "bias-test.csv", "roll.csv", "user world.csv"])
def test_the_name_that_a_user_gives_an_only_file_hides_no_sensor(tmp_path, name):
    assert_allclose(spun(both(tmp_path / name, LOG.gyro / DEG, LOG.accel)), LOG.gyro[:, 2], atol=1e-5)


def test_a_header_with_a_name_too_few_moves_no_names(tmp_path):
    raw = both(tmp_path / "log.csv", LOG.gyro / DEG, LOG.accel)
    header, *rows = raw.read_text().splitlines()
    raw.write_text("\n".join([header, *(f"{row},{4.0 - 0.0001 * k:.4f}" for k, row in enumerate(rows)), ""]))
    whole = import_log(raw)
    assert_allclose(whole.recordings[0].samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-5)
    assert "text: the header has 7 names for 8 columns: the last is taken to have none" in whole.summary()


def test_a_row_number_without_a_name_still_goes_before_the_others(tmp_path):
    raw = both(tmp_path / "log.csv", LOG.gyro / DEG, LOG.accel)
    header, *rows = raw.read_text().splitlines()
    raw.write_text("\n".join([header, *(f"{k},{row}" for k, row in enumerate(rows, start=1)), ""]))
    assert_allclose(spun(raw), LOG.gyro[:, 2], atol=1e-5)


def test_a_bias_that_a_rest_shows_is_told(tmp_path):
    raw = both(tmp_path / "log.csv", LOG.gyro / DEG + [3.0, -60.0, 80.0], LOG.accel)
    told = [one for one in import_log(raw, throw=1).remarks if "deg/s (x, y, z); expected 0 to 10 deg/s" in one]
    assert len(told) == 1
    assert "reads 3, -60, 80 deg/s" in told[0].replace("3.01,", "3,").replace("2.99,", "3,")
    sound = both(tmp_path / "sound.csv", LOG.gyro / DEG + [1.0, -2.0, 3.0], LOG.accel)
    assert not any("lies still" in one for one in import_log(sound).remarks)


@pytest.mark.parametrize("up", [False, True])
def test_an_accelerometer_that_shows_gravity_with_its_own_sign_is_told_where_the_place_is_known(tmp_path, up):
    gyro, accel, mag = LOG.shown(up)
    place = Environment(magnetic_field=FIELD)
    wrong = import_log(both(tmp_path / "wrong.csv", gyro / DEG, -accel, mag=mag), environment=place)
    (line,) = [one for one in wrong.remarks if "contradict one another while" in one]
    assert "the field dips by -67 deg; expected 67 deg" in line
    right = import_log(both(tmp_path / "right.csv", gyro / DEG, accel, mag=mag), environment=place)
    assert not any("lies still" in one for one in right.remarks)


def test_a_place_whose_latitude_lost_its_sign_is_asked_about_beside_the_sensors(tmp_path):
    """The sensors alone were blamed, with a remedy that reverses every spin."""
    place = Environment(magnetic_field=FIELD * [1.0, 1.0, -1.0])
    log = import_log(both(tmp_path / "log.csv", LOG.gyro / DEG, LOG.accel, mag=LOG.mag), environment=place)
    (line,) = [one for one in log.remarks if "contradict one another while" in one]
    assert "the field dips by 67 deg; expected -67 deg" in line
    assert "southern latitudes are negative" in line


def test_what_is_left_out_stands_in_the_summary(tmp_path):
    columns = [("t_s", LOG.t), *three(named("g{}"), LOG.gyro / DEG), ("batt", 4.0 + 0 * LOG.t)]
    assert "not used: batt" in import_log(write_table(tmp_path / "log.csv", columns)).summary()


def test_a_line_of_names_of_another_width_is_told(tmp_path):
    raw = both(tmp_path / "log.csv", LOG.gyro / DEG, LOG.accel)
    header, *rows = raw.read_text().splitlines()
    raw.write_text("\n".join([f"{header},temp,batt", *rows, ""]))
    assert "the line of names has 9 for 7 columns and was not used: mend it" in import_log(raw).summary()


def test_a_third_column_without_numbers_is_named(tmp_path):
    columns = [("t_s", LOG.t), ("gx", LOG.gyro[:, 0]), ("gy", ["NaN"] * LOG.t.size), ("gz", LOG.gyro[:, 2])]
    raw = write_table(tmp_path / "log.csv", [*columns, *three(named("a{}"), LOG.accel)])
    assert "x and z were found and y was not: 'gy' is there and holds too few numbers" in import_log(raw).summary()


def test_a_time_in_front_stays_the_first_column_where_the_last_has_no_name(tmp_path):
    raw = tmp_path / "log.csv"
    rows = [
        f"2021-10-24-08:46:{6 + t:09.6f},{','.join(f'{v:.5f}' for v in (*mag, *accel, *gyro))},24.8,41.1"
        for t, mag, accel, gyro in zip(LOG.t, LOG.mag, LOG.accel, LOG.gyro / DEG, strict=True)
    ]
    names = "Time,MagX,MagY,MagZ,AccelX,AccelY,AccelZ,GyroX,GyroY,GyroZ,Temp Hum"
    raw.write_text("\n".join([names, *rows, ""]))
    found = import_log(raw)
    assert "the header has 11 names for 12 columns: the last is taken to have none" in found.summary()
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-4)
    assert_allclose(samples["magnetometer"].value[:, 0], LOG.mag[:, 0], atol=1e-4)
