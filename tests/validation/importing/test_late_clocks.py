"""Files that each count from their own start, two loggers not set alike: told with the line that mends it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import cumulative_trapezoid

from discsim.errors import InputError
from discsim.plain_arrays import recording_from_arrays
from discsim.recording import Samples
from discsim.validation.checking.checked import check
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.setup import find_setup_faults
from discsim.validation.diagnosis.setup.late_sensor import late_sensor
from discsim.validation.importing.imported_log import import_log

#: a disc that rests, is spun up, runs down and is stopped, in a field of 48 uT that dips by 66 deg
FINE = np.arange(0.0, 16.0, 1e-3)
RATE = np.interp(FINE, [0.0, 3.0, 4.2, 10.0, 10.8, 16.0], [0.0, 0.0, 25.0, 18.0, 0.0, 0.0])
ANGLE = cumulative_trapezoid(RATE, FINE, initial=0)


def readings(step_gyro=0.005, step_field=0.01):
    rng = np.random.default_rng(3)
    tg, tm = np.arange(0.0, 16.0, step_gyro), np.arange(0.0, 16.0, step_field)
    gyro = np.column_stack([0 * tg, 0 * tg, np.interp(tg, FINE, RATE)]) + 0.01 * rng.standard_normal((tg.size, 3))
    psi, across, down = np.interp(tm, FINE, ANGLE), 48.0 * np.cos(np.radians(66.0)), 48.0 * np.sin(np.radians(66.0))
    field = np.column_stack([across * np.cos(psi), -across * np.sin(psi), down + 0 * psi])
    return tg, gyro, tm, field + [5.0, -8.0, 3.0] + 0.4 * rng.standard_normal((tm.size, 3))


def recorded(late):
    """Return a recording whose magnetometer's times are late by so much, s."""
    tg, gyro, tm, field = readings()
    return recording_from_arrays({"gyroscope": (tg, gyro), "magnetometer": (tm + max(late, 0.0), field)})


def write(file, header, t, value):
    rows = [",".join(f"{cell:.6f}" for cell in (at, *row)) for at, row in zip(t, value, strict=True)]
    file.write_text("\n".join([header, *rows, ""]), encoding="utf-8")


def phone_export(folder, later):
    """Write a file per sensor, of which the magnetometer's counts from its own start, ``later`` s after the other's."""
    folder.mkdir()
    tg, gyro, tm, field = readings()
    write(folder / "Gyroscope.csv", '"Time (s)","X (rad/s)","Y (rad/s)","Z (rad/s)"', tg, gyro)
    seen = tm >= later
    header = '"Time (s)","X (µT)","Y (µT)","Z (µT)"'
    write(folder / "Magnetometer.csv", header, tm[seen] - later, field[seen])
    return folder


def offset_in(text):
    (line,) = (line for line in text.splitlines() if line.startswith("time_offset_s"))
    return float(line.split("=")[1].split("#")[0])


@pytest.mark.parametrize("later", [0.5, 1.2])
def test_a_proposed_map_moves_a_file_that_counts_from_its_own_start(tmp_path, later):
    found = import_log(phone_export(tmp_path / "raw", later))
    (told,) = (one for one in found.decisions if one.what == "magnetometer time")
    assert "'Magnetometer.csv' is " in told.why
    assert " s early against 'Gyroscope.csv'" in told.why
    # the spins are followed over windows of tenths of a second: a corner is told to some hundredths
    assert_allclose(offset_in(found.map_text), later, atol=0.06)
    assert not any("time_offset" in line for line in found.remarks)


def test_a_map_without_the_offset_is_told_the_line(tmp_path):
    raw = phone_export(tmp_path / "raw", 0.5)
    lines = [line for line in import_log(raw).map_text.splitlines() if not line.startswith("time_offset_s")]
    (tmp_path / "mine.toml").write_text("\n".join(lines), encoding="utf-8")
    said = "\n".join(import_log(raw, str(tmp_path / "mine.toml")).remarks)
    assert "the magnetometer's times are 0.5" in said
    assert " s early against the gyroscope's" in said
    assert "[sensors.magnetometer] time_offset_s = 0.5" in said


def test_files_of_one_clock_are_not_moved(tmp_path):
    found = import_log(phone_export(tmp_path / "raw", 0.0))
    assert "time_offset_s" not in found.map_text
    assert not any("time_offset" in line for line in found.remarks)


def test_two_loggers_seconds_apart_are_put_on_one_clock():
    setup = find_setup_faults([recorded(3.2)])
    (fault,) = setup.faults
    assert fault.id == "mag.time_offset"
    assert "the magnetometer's times are 3." in fault.sentence
    assert "late against the gyroscope's" in fault.sentence
    assert_allclose(fault.effect.value.offset_s, 3.2, atol=0.06)
    assert_allclose(setup.recordings[0].samples["magnetometer"].t[0], 0.0, atol=0.06)
    (warning,) = (one for one in check([recorded(3.2)]).checks[0].findings if one.id == "mag.time_offset")
    assert "time_offset_s = -3." in warning.sentence


def test_a_spin_that_only_runs_down_tells_no_offset():
    """Late is there no other than a factor: a rate of 95 % is one of 100 % some tenths of a second ago."""
    cut = replace(recorded(0.0), samples={name: one.between(4.4, 9.8) for name, one in recorded(0.0).samples.items()})
    field = cut.samples["magnetometer"]
    late = replace(cut, samples={**cut.samples, "magnetometer": Samples(field.t + 0.4, field.value)})
    assert find_setup_faults([late]).faults == ()


def test_recordings_that_are_off_by_different_times_are_told_and_not_moved():
    setup = find_setup_faults([recorded(0.6), recorded(2.4)])
    assert setup.faults == ()
    assert len(setup.contradictions) == 2
    assert all("late against the gyroscope's" in one for one in setup.contradictions)


def test_a_sensor_that_shows_the_spin_for_a_short_time_may_be_late_by_more_than_that():
    """Its rates over 3 s were held against offsets up to 1.5 s, and one that was 3 s late was told by no word."""
    tg, gyro, tm, field = readings()
    shown = (tm > 3.6) & (tm < 6.6)
    arrays = {"gyroscope": (tg, gyro), "magnetometer": (tm[shown] + 3.0, field[shown])}
    late = late_sensor(recording_from_arrays(arrays))
    assert late is not None
    assert late.sensor == "magnetometer"
    assert_allclose(late.late, 3.0, atol=0.06)


@pytest.mark.slow
def test_a_diagnosis_that_is_refused_tells_the_clock_that_is_another_ones():
    """It told what drives the body alone, and to what the field would agree with it at the times as written."""
    recording = recorded(late=3.0)
    with pytest.raises(InputError) as refused:
        diagnose([[recording]], ["log"])
    said = str(refused.value)
    assert "Something drives this body" in said
    assert "Found before, and allowed for in this: the magnetometer's times are " in said
    (line,) = re.findall(r"\[sensors.magnetometer\] time_offset_s = (-[0-9.]+)", said)
    assert_allclose(float(line), -3.0, atol=0.06)
