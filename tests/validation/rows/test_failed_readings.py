"""Readings that failed and were written as a number become gaps, aloud; what rests, falls or clips is a reading."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, LANDING, RATE, RELEASE, made_log, three, write_table
from support.thinned import one_in

from discsim.validation.importing.imported_log import import_log
from discsim.validation.rows.cleaning import cleaned
from discsim.validation.rows.failed import dead_axis, failed_at_once, failed_on_one_axis, failed_rows
from discsim.validation.rows.readings import Readings

LOG = made_log()
ROWS = np.arange(LOG.t.size)
SENSORS = {"gyroscope": LOG.gyro / DEG, "accelerometer": LOG.accel / G0, "magnetometer": LOG.mag}
NAMES = {
    "gyroscope": ["gx_dps", "gy_dps", "gz_dps"],
    "accelerometer": ["ax", "ay", "az"],
    "magnetometer": ["mx", "my", "mz"],
}
EVERY_7 = ROWS % 7 == 3
APART = ROWS % 97 == 50
FOR_LONG = (ROWS > 900) & (ROWS < 1000)  # 0.5 s in the flight
AT_THE_START = ROWS < 300


def log(path, failed, number=0.0):
    """Write the log with a number on all axes in the rows (n,) of each sensor named."""
    columns = [("ms", np.round(1000 * LOG.t).astype(int))]
    for sensor, value in SENSORS.items():
        filled = np.where(failed.get(sensor, ROWS < 0)[:, None], number, value)
        columns += three(NAMES[sensor], filled)
    return write_table(path, columns, digits=4)


FAILURES = {
    "a field every few rows": {"magnetometer": EVERY_7},
    "a field not read at first": {"magnetometer": AT_THE_START},
    "a field between its readings": {"magnetometer": ROWS % 4 > 0},
    "an accelerometer": {"accelerometer": APART},
    "a gyroscope in flight": {"gyroscope": APART & (LOG.t > RELEASE + 0.1) & (LOG.t < LANDING)},
    "two sensors of one chip": {"accelerometer": EVERY_7, "gyroscope": EVERY_7},
    "the bus": dict.fromkeys(SENSORS, APART),
    "the bus for long": dict.fromkeys(SENSORS, FOR_LONG),
    "one chip for long": {"accelerometer": FOR_LONG, "gyroscope": FOR_LONG},
    "one chip to the end": {"accelerometer": ROWS > 1300, "gyroscope": ROWS > 1300},
}


@pytest.mark.parametrize("failure", FAILURES)
def test_zeros_amid_readings_are_gaps_that_are_counted_and_the_throw_is_found(tmp_path, failure):
    failed = FAILURES[failure]
    found = import_log(log(tmp_path / "log.csv", failed))
    said = found.summary()
    for sensor, rows in failed.items():
        first = int(np.argmax(rows))
        counted = f"{sensor}: exactly 0 on all axes in {np.count_nonzero(rows)} of {rows.size} rows amid other readings"
        assert f"{counted}, the first row {first}: readings that failed; they become gaps" in said
        samples = found.recordings[0].samples[sensor]
        gap = np.isnan(samples.value).all(axis=1)
        assert_allclose(samples.t[gap], LOG.t[rows], atol=1e-6)
        repairs = [one for one in found.imported[0].repairs if one.action == f"zeros of {sensor} made a gap"]
        assert repairs[0].line == first + 2
    (throw,) = found.throws
    assert RELEASE <= throw.start < RELEASE + 0.2
    assert LANDING - 0.6 < throw.end <= LANDING + 0.1
    assert throw.spin == pytest.approx(32, rel=0.06)
    assert "gyroscope unit: deg/s (certain: the header says so, and the field turns as fast)" in said
    assert "accelerometer unit: g (certain" in said


OTHERS = {
    "a field every few rows": ({"magnetometer": EVERY_7}, (-1, -999, 65535, 32767)),
    "a field not read at first": ({"magnetometer": AT_THE_START}, (-1, -9999, -32768)),
    "a field that failed once": ({"magnetometer": ROWS == 900}, (-1, -999)),
    "an accelerometer": ({"accelerometer": APART}, (-1, -999, 999.99, 65535, 32767)),
    "an accelerometer once": ({"accelerometer": ROWS == 900}, (-999, 65535)),
    "a gyroscope": ({"gyroscope": APART & (LOG.t > RELEASE)}, (-1, -999, -9999, 65535, 32767, -32768)),
    "a gyroscope in flight": ({"gyroscope": FOR_LONG}, (-1, -999, 32767)),
    "the bus": (dict.fromkeys(SENSORS, APART), (-1, -999)),
}


@pytest.mark.parametrize(
    ("failure", "number"), one_in(3, [(key, number) for key, (_, numbers) in OTHERS.items() for number in numbers])
)
def test_another_number_on_all_axes_amid_readings_is_a_failed_one(tmp_path, failure, number):
    """-1, -999, the ends of 16 bits: they cut throws or hid them, and were called clipped or a lost decimal point."""
    failed, _ = OTHERS[failure]
    found = import_log(log(tmp_path / "log.csv", failed, number))
    said = found.summary()
    for sensor, rows in failed.items():
        assert f"{sensor}: {number} on all axes in {np.count_nonzero(rows)} of {rows.size} rows amid other" in said
        samples = found.recordings[0].samples[sensor]
        gap = np.isnan(samples.value).all(axis=1)
        assert_allclose(samples.t[gap], LOG.t[rows], atol=1e-6)
        repairs = [one for one in found.imported[0].repairs if one.action == f"{number} of {sensor} made a gap"]
        assert repairs[0].line == np.argmax(rows) + 2
    assert "clipped" not in said
    assert "glitches" not in said
    (throw,) = found.throws
    assert throw.spin == pytest.approx(32, rel=0.06)
    assert "gyroscope unit: deg/s (certain: the header says so, and the field turns as fast)" in said
    assert "accelerometer unit: g (certain" in said


ON_ONE_AXIS = {
    "gyroscope": (-999, -9999, 65535, 32767),
    "accelerometer": (-1, -999, 65535, -32768),
    "magnetometer": (-1, -999, 999.9, 65535, 32767),
}


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(
    ("sensor", "number"), one_in(3, [(s, number) for s, all_ in ON_ONE_AXIS.items() for number in all_])
)
def test_such_a_number_on_one_axis_is_a_gap_there(tmp_path, sensor, axis, number):
    """A line that breaks in the middle of a record, a chip that gives one register: the number entered as truth."""
    values = {s: np.where(APART[:, None] & (np.arange(3) == axis) & (s == sensor), number, v)
              for s, v in SENSORS.items()}  # fmt: skip
    columns = [("ms", np.round(1000 * LOG.t).astype(int)), *(c for s in values for c in three(NAMES[s], values[s]))]
    found = import_log(write_table(tmp_path / "log.csv", columns, digits=4))
    assert f"{sensor} {'xyz'[axis]}: {number:g} in " in found.summary()
    (throw,) = found.throws
    assert throw.spin == pytest.approx(32, rel=0.06)
    samples = found.recordings[0].samples[sensor]
    gap = np.isnan(samples.value)
    assert gap[:, axis].any()
    assert not np.delete(gap, axis, axis=1).any()
    assert_allclose(np.setdiff1d(np.round(samples.t[gap[:, axis]], 3), np.round(LOG.t[APART], 3)), [])


def test_minus_one_that_is_read_on_one_axis_is_a_reading():
    """Whole numbers of a gyroscope at rest and of a field that turns; tenths of g of a board that is knocked about."""
    rng = np.random.default_rng(5)
    knocked = rng.normal(0, 0.03, LOG.accel.shape)
    knocked[rng.integers(0, ROWS.size, 200)] += rng.normal(0, 1.0, (200, 3))
    for value in (
        np.round(rng.normal(-0.6, 0.6, LOG.gyro.shape)),
        np.where(rng.random(LOG.gyro.shape) < 0.01, -1.0, 0.0),
        np.round(LOG.gyro / DEG),
        np.round(LOG.mag),
        np.round(LOG.mag, 1),
        np.round(knocked, 1),
        np.round(knocked, 2),
    ):
        assert not failed_on_one_axis(value).any()


@pytest.mark.parametrize("number", [32767, -32768])
def test_counts_at_the_end_of_their_range_on_one_axis_are_clipped(number):
    value = np.round(LOG.accel / G0 * 2048)
    value[900:1000:20, 0] = number
    assert not failed_on_one_axis(value).any()


def test_a_map_of_reversed_axes_names_the_number_as_written(tmp_path):
    path = log(tmp_path / "log.csv", {"accelerometer": APART}, -999)
    text = import_log(path).map_text
    (tmp_path / "mine.toml").write_text(text.replace('axes = ["x", "y", "z"]', 'axes = ["x", "-y", "-z"]'))
    assert "accelerometer: -999 on all axes in" in import_log(path, str(tmp_path / "mine.toml")).summary()


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_sensor_of_one_number_throughout_is_left_out_by_name(tmp_path, sensor):
    """The import ended with "one sample and no rate_hz in the map"."""
    path = log(tmp_path / "log.csv", {sensor: ROWS >= 0}, -1)
    found = import_log(path)
    assert (
        f"left out: {sensor} in {', '.join(NAMES[sensor])} of log.csv (all its rows are -1: it was" in found.summary()
    )
    assert set(found.recordings[0].samples) == set(SENSORS) - {sensor}
    text = import_log(log(tmp_path / "other.csv", {})).map_text
    (tmp_path / "mine.toml").write_text(text)
    said = import_log(path, str(tmp_path / "mine.toml")).summary()
    # a field may stand still, so that of a magnetometer it is the motion that tells
    why = "it is dead" if sensor == "magnetometer" else "all its 2000 rows are one number on all axes, so it was not"
    assert f"no {sensor}" in said
    assert why in said


def test_a_held_magnetometer_keeps_its_clock_over_zeros():
    """Read at half the log's rate, each reading stands on two rows; a zero hides one of them."""
    value = LOG.mag[ROWS // 2 * 2]
    gaps = Readings(ROWS, LOG.t, np.where(EVERY_7[:, None], np.nan, value))
    whole = cleaned("magnetometer", Readings(ROWS, LOG.t, value), {"magnetometer": gaps}, True)
    result = cleaned("magnetometer", gaps, {"magnetometer": gaps}, True)
    assert result.rate_hz == pytest.approx(RATE / 2, rel=0.01)
    assert "stand on 2.00 rows each" in result.notes[0]
    assert len(result.readings.time) == len(whole.readings.time)
    assert not np.isnan(result.readings.value).any()


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_sensor_at_zero_throughout_is_left_out_by_name_and_hides_no_throw(tmp_path, sensor):
    found = import_log(log(tmp_path / "log.csv", {sensor: ROWS >= 0}))
    left = f"left out: {sensor} in {', '.join(NAMES[sensor])} of log.csv (all its rows are zero: it was not connected"
    assert left in found.summary()
    assert set(found.recordings[0].samples) == set(SENSORS) - {sensor}
    (throw,) = found.throws
    assert throw.spin == pytest.approx(32, rel=0.06)


def test_of_two_sensors_of_a_kind_the_dead_one_is_not_taken(tmp_path):
    columns = [("t_s", LOG.t), *three(["gx", "gy", "gz"], LOG.gyro), *three(["ax", "ay", "az"], 0 * LOG.accel)]
    columns += three(["acc2_x", "acc2_y", "acc2_z"], LOG.accel)
    found = import_log(write_table(tmp_path / "log.csv", columns))
    assert "accelerometer: acc2_x, acc2_y, acc2_z" in found.summary()


@pytest.mark.parametrize(("axis", "told_by"), [(0, "gyroscope"), (1, "gyroscope"), (2, "magnetometer")])
def test_one_axis_of_a_gyroscope_at_zero_throughout_is_a_gap_aloud_and_the_spin_is_told(tmp_path, axis, told_by):
    """Without the axis of the spin the field tells it; the gyroscope read nothing there, and no throw was found."""
    columns = [("t_s", LOG.t)]
    for sensor, value in SENSORS.items():
        dead = np.where((np.arange(3) == axis) & (sensor == "gyroscope"), 0.0, value)
        columns += three(NAMES[sensor], dead)
    found = import_log(write_table(tmp_path / "log.csv", columns))
    said = f"WARNING: gyroscope {'xyz'[axis]}: 0 in every row while the other two turn: it was not read"
    assert said in found.summary()
    assert np.isnan(found.recordings[0].samples["gyroscope"].value).all(axis=0).tolist() == [
        k == axis for k in range(3)
    ]
    (throw,) = found.throws
    assert throw.sensor == told_by
    assert throw.spin == pytest.approx(32, rel=0.06)


# ------------------------------------------------------------------------------------ zeros that are readings


def test_an_ideal_spin_about_one_axis_has_no_dead_ones():
    rate = np.linspace(0.0, 30.0, ROWS.size)
    assert dead_axis(np.column_stack([0 * rate, 0 * rate, rate])) is None
    assert dead_axis(LOG.gyro) is None
    assert dead_axis(np.column_stack([0.1 * rate, 0 * rate, rate])) == 1


def test_a_gyroscope_that_rests_at_zero_has_not_failed():
    """A dead band of 3 deg/s, as phones have; a spin that begins and ends within a row or two of it."""
    value = np.where(np.abs(LOG.gyro) < 3 * DEG, 0.0, LOG.gyro)
    assert not failed_rows("gyroscope", value).any()


def test_a_table_that_stops_and_turns_back_in_an_ideal_log_has_not_failed():
    rate = np.interp(ROWS, [0, 50, 100, 150, 400, 450, 900], [0, 30, 30, 0, 0, -30, 30])
    value = np.column_stack([0 * rate, 0 * rate, np.round(rate)])
    for held in (1, 3):
        assert not failed_rows("gyroscope", value[ROWS // held * held]).any()


def test_a_coarse_accelerometer_in_free_fall_has_not_failed():
    """49 mg a step, as an ADXL375: at its place on the axis of a falling disc most readings are a step or none."""
    rng = np.random.default_rng(2)
    falling = (LOG.t > 2) & (LOG.t < 4)
    value = np.where(falling[:, None], 0.0, [0.0, 0.0, 20.0]) + np.round(0.5 * rng.standard_normal(LOG.accel.shape))
    assert np.any(np.all(value == 0, axis=1))
    assert not failed_rows("accelerometer", 0.48 * value).any()
    ideal = np.where(falling[:, None], 0.0, [0.0, 0.0, G0])
    assert not failed_rows("accelerometer", ideal).any()


def test_a_gyroscope_at_rest_has_not_failed_where_a_slow_magnetometer_is_filled_with_zeros():
    gyro = np.where((LOG.t < 2)[:, None], 0.0, LOG.gyro)
    field = np.where((ROWS % 4 > 0)[:, None], 0.0, LOG.mag)
    both = {"gyroscope": Readings(ROWS, LOG.t, gyro), "magnetometer": Readings(ROWS, LOG.t, field)}
    assert set(failed_at_once(both)) == {"magnetometer"}


@pytest.mark.parametrize("value", [LOG.mag, 0 * LOG.mag, np.full_like(LOG.mag, np.nan), LOG.mag[:0]])
def test_without_zeros_amid_readings_nothing_failed(value):
    assert not failed_rows("magnetometer", value).any()


# ------------------------------------------------------------------------- other numbers that are readings


def test_an_impact_that_clips_an_accelerometer_on_all_axes_at_once_has_not_failed():
    """Three throws end on the ground, where all axes stand at 16 g for a row, and single ones before or after."""
    value = np.clip(LOG.accel, -16 * G0, 16 * G0)
    for row in (500, 900, 1300):
        value[row : row + 3] = np.array([[16.0, 3.0, -9.0], [16.0, 16.0, 16.0], [-4.0, 16.0, 2.0]]) * G0
    assert not failed_rows("accelerometer", value).any()


@pytest.mark.parametrize("share", [0.1, 0.3, 0.6])
@pytest.mark.parametrize("sensor", SENSORS)
def test_a_sensor_of_a_small_range_has_not_failed(sensor, share):
    largest = share * np.abs(SENSORS[sensor]).max()
    assert not failed_rows(sensor, np.clip(SENSORS[sensor], -largest, largest)).any()


@pytest.mark.parametrize("steps", [10, 30, 100])
@pytest.mark.parametrize("sensor", SENSORS)
def test_coarse_readings_that_are_equal_by_chance_have_not_failed(sensor, steps):
    value = np.round(SENSORS[sensor] * steps / np.abs(SENSORS[sensor]).max())
    failed = failed_rows(sensor, value)
    assert not np.any(failed & (value != 0).any(axis=1))


def test_a_gyroscope_that_rests_at_minus_one_has_not_failed_there():
    """Counts of a degree a second and a bias of -0.8: at rest -1 on all axes comes by chance, again and again."""
    value = np.round(LOG.gyro / DEG + np.random.default_rng(3).normal(-0.8, 0.6, LOG.gyro.shape))
    assert np.count_nonzero(np.all(value == -1, axis=1)) > 10
    assert not failed_rows("gyroscope", value).any()


def test_bytes_of_another_record_spoil_neither_units_nor_sensors_nor_the_clock(tmp_path):
    """Random bits as numbers: the accelerometer was none, the gyroscope in another unit, and quaternions a field."""
    rng = np.random.default_rng(6)
    spoilt = ROWS % 333 == 100
    time = np.round(1000 * LOG.t).astype(int) + 48000
    columns = [("index", ROWS), ("uptime", np.where(spoilt, 658369253, time))]
    quaternions = np.tile([0.01, 0.02, 0.03], (ROWS.size, 1))
    for names, value in (
        (["accel x", "accel y", "accel z"], LOG.accel),
        (["gyro x", "gyro y", "gyro z"], LOG.gyro),
        (["quat x", "quat y", "quat z"], quaternions),
    ):
        wild = rng.normal(size=value.shape) * 10.0 ** rng.integers(8, 30, size=value.shape)
        columns += three(names, np.where(spoilt[:, None], wild, value))
    found = import_log(write_table(tmp_path / "log.csv", columns))
    samples = found.recordings[0].samples
    assert {*samples} == {"gyroscope", "accelerometer"}
    assert_allclose(samples["gyroscope"].t, (LOG.t - LOG.t[0])[~spoilt], atol=1e-6)
    assert_allclose(samples["gyroscope"].value, LOG.gyro[~spoilt], atol=1e-5)
    assert_allclose(samples["accelerometer"].value, LOG.accel[~spoilt], atol=1e-5)


def test_a_reading_far_beyond_all_others_is_a_gap_and_a_knock_none(tmp_path):
    accel = LOG.accel / G0
    accel[ROWS == 300] = (9e4, 1.0, 1.0)
    accel[ROWS == 500] = (150.0, 1.0, 1.0)  # a knock
    columns = [("ms", np.round(1000 * LOG.t).astype(int)), *three(NAMES["gyroscope"], LOG.gyro / DEG)]
    columns += three([f"{name}_g" for name in NAMES["accelerometer"]], accel)
    found = import_log(write_table(tmp_path / "log.csv", columns))
    value = found.recordings[0].samples["accelerometer"].value
    assert np.flatnonzero(np.isnan(value).any(axis=1)).tolist() == [300]
    assert "accelerometer: 1 of 2000 rows hold numbers 10000 times beyond all others" in found.summary()
