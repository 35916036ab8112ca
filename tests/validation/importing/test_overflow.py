"""A gyroscope whose register overflows: the spin is taken where another sensor shows it, and a gap elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, RATE, RELEASE, made_log, three, write_table

from discsim.validation.importing import import_recording, read_map
from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.overflow import continued

LOG = made_log()
END = 2000.0  # of a 16-bit part, deg/s; the throw spins at 2292 to 1461
NAMES = [[f"{sensor}{axis}_{unit}" for axis in "xyz"] for sensor, unit in (("g", "dps"), ("a", "g"), ("m", "uT"))]


def wrapped(value: np.ndarray, end: float) -> np.ndarray:
    return (value + end) % (2 * end) - end


def log(place: Path, sensors: str = "gam", rows: slice = slice(None), up: bool = False, end: float = END) -> Path:
    gyro, accel, mag = LOG.shown(up)
    columns = [("t_ms", 1000 * LOG.t[rows])]
    shown = {"g": wrapped(gyro / DEG, end), "a": accel / G0, "m": mag}
    for names, (letter, value) in zip(NAMES, shown.items(), strict=True):
        columns += three(names, value[rows]) if letter in sensors else []
    return write_table(place / "log.csv", columns, digits=4)


def flight(times: np.ndarray) -> np.ndarray:
    return (times > RELEASE + 0.2) & (times < RELEASE + 2.8)


@pytest.mark.parametrize(("sensors", "by"), [("gam", "the field turns"), ("gm", "the field"), ("ga", "the pull")])
@pytest.mark.parametrize("up", [False, True])
def test_a_spin_beyond_the_register_is_continued_where_another_sensor_shows_it(tmp_path, sensors, by, up):
    """To the noise of the readings (0.003 rad/s one sigma) and the last digit written."""
    raw = log(tmp_path, sensors, up=up and "a" in sensors)
    whole = import_log(raw)
    gyro = whole.recordings[0].samples["gyroscope"]
    assert_allclose(gyro.value[:, 2], np.interp(gyro.t, LOG.t, LOG.gyro[:, 2]), atol=1e-5)
    (note,) = [note for note in whole.remarks if "OVERFLOWS at 2000 deg/s" in note]
    assert f"as {by}" in note
    assert any(one.action.endswith("rows of gyroscope continued, the first here") for one in whole.imported[0].repairs)
    assert whole.throws[0].spin == pytest.approx(np.median(LOG.gyro[flight(LOG.t), 2]), rel=0.02)


def test_a_throw_that_is_cut_out_is_told_of_a_leap_before_it(tmp_path):
    cut = import_log(log(tmp_path), throw=1)
    assert any("OVERFLOWS" in note for note in cut.remarks)
    assert np.min(cut.recordings[0].samples["gyroscope"].value[:, 2]) > 1400 * DEG


def test_a_spin_beyond_the_register_that_nothing_confirms_becomes_a_gap(tmp_path):
    whole = import_log(log(tmp_path, "g"))
    gyro = whole.recordings[0].samples["gyroscope"]
    beyond = np.abs(np.interp(gyro.t, LOG.t, LOG.gyro[:, 2])) > END * DEG
    assert_allclose(np.isnan(gyro.value[:, 2]), beyond)
    assert any("not to be trusted, now gaps" in note for note in whole.remarks)


def test_a_log_that_begins_beyond_the_end_is_continued_back_from_its_rest(tmp_path):
    first = int((RELEASE + 0.1) * RATE)
    whole = import_log(log(tmp_path, "gam", slice(first, None)))
    gyro = whole.recordings[0].samples["gyroscope"]
    assert_allclose(gyro.value[:, 2], LOG.gyro[first:, 2], atol=1e-5)


def test_a_log_that_ends_in_the_flight_is_continued_too(tmp_path):
    last = int((RELEASE + 2.0) * RATE)
    gyro = import_log(log(tmp_path, "gam", slice(None, last))).recordings[0].samples["gyroscope"]
    assert_allclose(gyro.value[:, 2], LOG.gyro[:last, 2], atol=1e-5)


def test_a_spin_beyond_the_end_all_through_a_log_is_told_by_the_field_that_slows_down(tmp_path):
    """No leap is in it: it came in as -1857 deg/s. The same rows within the range are left alone."""
    beyond = slice(int((RELEASE + 0.1) * RATE), int((RELEASE + 0.8) * RATE))
    whole = import_log(log(tmp_path, "gam", beyond))
    assert np.all(np.isnan(whole.recordings[0].samples["gyroscope"].value[:, 2]))
    assert any("overflowed all through this log" in note for note in whole.remarks)
    assert whole.throws[0].spin == pytest.approx(np.median(LOG.gyro[beyond, 2]), rel=0.02)
    sound = import_log(log(tmp_path, "gam", beyond, end=2293.76))
    assert not any("overflow" in note for note in sound.remarks)


def test_a_clock_that_is_off_makes_no_overflow(tmp_path):
    """Then the field turns faster than the gyroscope says by one share, and slows down with it."""
    raw = log(tmp_path, "gam", slice(int((RELEASE + 0.1) * RATE), int((RELEASE + 2.8) * RATE)), end=4000.0)
    header, *rows = raw.read_text().splitlines()
    fast = (f"{0.8 * float(row.partition(',')[0]):.3f},{row.partition(',')[2]}" for row in rows)
    raw.write_text("\n".join([header, *fast, ""]))
    assert not any("overflow" in note for note in import_log(raw).remarks)


def test_what_is_continued_stands_at_no_stated_range(tmp_path):
    raw = log(tmp_path)
    text = import_log(raw).map_text
    assert "[sensors.gyroscope]\n" in text
    stated = text.replace("[sensors.gyroscope]\n", f"[sensors.gyroscope]\nrange_rad_s = {END * DEG:.4f}\n")
    (tmp_path / "map.toml").write_text(stated, encoding="utf-8")
    found = import_recording(raw, read_map(tmp_path / "map.toml"))
    assert found.recording.sheets["gyroscope"].range is None
    assert not any("clipped" in note for note in found.notes)


def test_a_reversal_that_the_field_shows_is_no_overflow(tmp_path):
    """A table of 1000 deg/s that turns back from one row to the next: the field goes back as well."""
    t = np.arange(0.0, 8.0, 1 / RATE)
    rate = np.where(t < 4.0, 1000.0, -1000.0)
    angle = np.concatenate([[0.0], np.cumsum(rate[:-1] * DEG / RATE)])
    field = np.column_stack([20 * np.cos(angle), -20 * np.sin(angle), 45 + 0 * t])
    turning = np.column_stack([0 * t, 0 * t, rate]) + 0.2 * np.random.default_rng(2).standard_normal((t.size, 3))
    columns = [("t_ms", 1000 * t), *three(NAMES[0], turning), *three(NAMES[2], field)]
    whole = import_log(write_table(tmp_path / "log.csv", columns, digits=4))
    assert not any("OVERFLOWS" in note for note in whole.remarks)
    assert_allclose(
        np.abs(whole.recordings[0].samples["gyroscope"].value[:, 2]), np.abs(turning[:, 2] * DEG), atol=1e-5
    )


@given(
    peak=st.floats(1.1, 2.9), end=st.sampled_from([250.0, 286.72, 500.0, 1000.0, 2000.0, 2293.76]), sign=st.booleans()
)
def test_a_pulse_beyond_either_end_comes_back_whole(peak, end, sign):
    """Half a sine over a second at 200 Hz changes by 1.6 % of its peak a row: no leap is missed."""
    t = np.arange(0.0, 3.0, 1 / RATE)
    true = (1 if sign else -1) * peak * end * DEG * np.where((t > 1) & (t < 2), np.sin(np.pi * (t - 1)), 0.0)
    found = continued(wrapped(true, end * DEG), 1 / RATE, 1e-7)
    assert found is not None
    assert found.span == pytest.approx(2 * end * DEG, rel=1e-9)
    assert_allclose(found.value, true, atol=1e-9)


def test_readings_within_the_register_are_left_as_they_are():
    assert all(continued(column, 1 / RATE, 1e-7) is None for column in LOG.gyro.T)
    noise = np.random.default_rng(1).uniform(-34.9, 34.9, 500)
    assert continued(noise, 1 / RATE, 1e-7) is None
    assert continued(np.full(20, np.nan), 1 / RATE) is None


def test_a_gyroscope_at_rest_that_is_written_coarsely_does_not_overflow():
    steps = np.array([-3, 0, 0, 4, 1, -3, 0, 0, -1, 0, 1, 3, 2, 1, 1, 1, 0, 0, -1, 1, 0, -1, 1, 1, 0, -1, -1, 0], float)
    assert continued(0.1 * DEG * steps, 0.001, 0.1 * DEG) is None
    assert continued(0.1 * np.sign(steps), 0.001) is None
