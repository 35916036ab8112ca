"""Repeats, late, lost and doubled rows, dead sensors and clocks: told apart at import and said."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from discsim.errors import InputError
from discsim.validation.importing import Imported, find_map, import_recording, parse_rows, read_map
from discsim.validation.importing.cell_texts import number
from discsim.validation.importing.clock import mended
from discsim.validation.importing.stamps import iso_seconds
from discsim.validation.rows.held import find_held, find_interpolated, fresh_rows, step_of
from discsim.validation.rows.timing import row_timing


def spinning(t: np.ndarray, rate_deg_s: float = 2000.0) -> np.ndarray:
    """A field of 50 uT on a tilted axis that spins, (n, 3)."""
    phase = np.radians(rate_deg_s) * t
    return np.stack([30 * np.cos(phase), -30 * np.sin(phase), 40 + 0 * t], axis=1)


def held_log(sensor_hz: float, log_hz: float, seconds: float, step: float = 0.15) -> tuple[np.ndarray, np.ndarray]:
    """Rows of a log and a field that a slower sensor read, rounded, the last reading standing."""
    rng = np.random.default_rng(0)
    t = np.arange(int(seconds * log_hz)) / log_hz
    taken = (np.arange(int(seconds * sensor_hz) + 2) - 0.37) / sensor_hz
    read = np.round((spinning(taken) + 0.6 * rng.standard_normal((taken.size, 3))) / step) * step
    return t, read[np.searchsorted(taken, t, side="right") - 1]


# ---------------------------------------------------------------------------------------------------- repeats


@pytest.mark.parametrize(
    ("sensor_hz", "log_hz"), [(100.0, 104.0), (100.0, 250.0), (75.0, 100.0), (20.0, 200.0), (1.0, 100.0)]
)
def test_readings_that_stand_on_rows_are_found_with_the_rows_they_stand_on(sensor_hz, log_hz):
    _, value = held_log(sensor_hz, log_hz, seconds=12.0)
    held = find_held(value)
    assert held is not None
    # the ends cut off a reading each
    assert held.rows_per_reading == pytest.approx(log_hz / sensor_hz, rel=2 / (12 * sensor_hz))


@pytest.mark.parametrize("noise_steps", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("rate", [0.0, 400.0])
def test_a_coarse_resolution_that_repeats_by_chance_is_no_hold(noise_steps, rate):
    rng = np.random.default_rng(1)
    t = np.arange(4000) / 100
    going = np.where((t > 10) & (t < 25), rate, 0.0)
    value = spinning(t, 0.0) + spinning(np.cumsum(going) / rate / 100, rate) if rate else spinning(t, 0.0)
    read = np.round(value / 0.5 + noise_steps * rng.standard_normal(value.shape)) * 0.5
    assert np.mean(np.all(read[1:] == read[:-1], axis=1)) > 0.01
    assert find_held(read) is None


def test_a_slow_ramp_in_steps_is_no_hold_though_it_changes_evenly():
    ramp = np.round(np.linspace(0, 100, 5000))
    assert find_held(ramp) is None
    assert (
        find_held(np.stack([ramp, np.round(np.linspace(0, 73, 5000)), np.round(np.linspace(0, 41, 5000))], 1)) is None
    )


def test_one_axis_that_is_held_is_found_by_its_even_spacing():
    rng = np.random.default_rng(2)
    rate = 60 + 0.02 * rng.standard_normal(300)
    assert find_held(np.repeat(rate, 5)).rows_per_reading == pytest.approx(5.0, rel=0.01)
    # the same repeats at random rows are chance's
    assert find_held(rate[np.sort(rng.integers(0, 300, 1500))]) is None


def test_a_constant_sensor_is_not_called_held():
    assert find_held(np.ones((1000, 3))) is None
    assert find_held(np.full((1000, 3), np.nan)) is None


def test_a_held_sensor_at_rest_keeps_the_readings_that_were_due():
    """Ten readings on 25 rows: two or three rows each; those from the fourth to the seventh are equal by chance."""
    reading = np.array([0, 1, 2, 3, 3, 3, 3, 4, 5, 6], dtype=float)
    value = np.repeat(reading, [3, 2] * 5)[:, None]
    held = find_held(np.tile(np.repeat(np.random.default_rng(0).normal(size=(40, 3)), 5, axis=0), (5, 1)))
    fresh = fresh_rows(value, type(held)(2.5, 99.0, 99.0))
    assert np.count_nonzero(fresh) == 10
    assert value[fresh][:, 0].tolist() == reading.tolist()


def test_rows_that_were_interpolated_are_told_from_readings():
    rng = np.random.default_rng(3)
    t = np.arange(500) / 100
    read = np.round(spinning(t, 300.0) + rng.standard_normal((500, 3)), 3)
    fine = np.interp(np.arange(1497) / 3, np.arange(500), read[:, 0])
    between = np.stack([fine, *(np.interp(np.arange(1497) / 3, np.arange(500), c) for c in read.T[1:])], axis=1)
    assert find_interpolated(np.round(between, 3)) == (3, 0)
    assert find_interpolated(read) is None


@pytest.mark.parametrize("step", [0.15, 1 / 16.4, 0.000488 * 9.80665])
def test_the_step_of_resolution_is_found_in_the_readings(step):
    value = np.round(40 * np.sin(np.arange(2000)) / step) * step
    assert step_of(value) == pytest.approx(step, rel=1e-3)
    assert step_of(np.round(value, 6)) == pytest.approx(step, rel=1e-3)
    assert step_of(40 * np.sin(np.arange(2000))) is None


MAP = """\
name = "made"
plant = "free_spin"
repairs = ["width", "number", "time"]
[time]
column = "ms"
unit = "ms"
[environment]
gravity_m_s2 = 9.8
magnetic_field_ned_uT = [30.0, 0.0, 40.0]
[sensors.magnetometer]
columns = ["mx", "my", "mz"]
unit = "uT"
rate_hz = 250.0
[sensors.gyroscope]
columns = ["gx", "gy", "gz"]
unit = "rad/s"
"""


def imported(folder: Path, stamps: list[str], mag: np.ndarray, gyro: np.ndarray, **options: str) -> Imported:
    cells = [
        ",".join([stamp, *(f"{x:.9g}" if x == x else options.get("gap", "") for x in row)])
        for stamp, row in zip(stamps, np.column_stack((mag, gyro)), strict=True)
    ]
    (folder / "log.csv").write_text("ms,mx,my,mz,gx,gy,gz\n" + "\n".join(cells) + "\n")
    (folder / "map.toml").write_text(MAP.replace('unit = "ms"', f'unit = "{options.get("unit", "ms")}"'))
    rows = None if "rows" not in options else parse_rows(options["rows"])
    return import_recording(folder / "log.csv", read_map(folder / "map.toml"), rows)


def turning(count: int, rate: float = 35.0) -> np.ndarray:
    rng = np.random.default_rng(4)
    return np.array([0.0, 0.0, rate]) + 0.01 * rng.standard_normal((count, 3))


def test_an_import_takes_repeats_out_and_writes_the_sensors_own_rate_and_times(tmp_path):
    t, mag = held_log(100.0, 250.0, seconds=4.0)
    result = imported(tmp_path, [f"{1000 * x:.0f}" for x in t], mag, turning(t.size))
    field, gyro = (result.recording.samples[s] for s in ("magnetometer", "gyroscope"))
    assert len(gyro) == t.size
    assert len(field) == pytest.approx(400, abs=2)
    assert result.recording.sheets["magnetometer"].rate_hz == pytest.approx(100.0, rel=1e-3)
    assert result.recording.sheets["gyroscope"].rate_hz == pytest.approx(250.0)
    (repair,) = result.repairs
    assert repair.line == 3  # the second row repeats the first
    assert repair.action == f"{t.size - len(field)} rows left out of magnetometer, the first here"
    note = next(note for note in result.notes if "sample and hold" in note)
    assert "magnetometer: its readings stand on 2.5" in note
    assert "100 Hz in a log of 250 Hz" in note
    assert "magnetometer: 100 Hz is written, not the 250 Hz that the map states" in result.notes
    # the field was taken at even times; the rows' own would be off by up to 4 ms, which is 8 deg of this spin
    assert_allclose(np.diff(field.t), 0.01, atol=2e-5)


def test_a_sensor_that_the_loop_reads_every_second_row_has_the_time_of_that_row(tmp_path):
    """Half a row before it was taken for a gyroscope that lags."""
    t = np.arange(800) / 200.0
    angle = 35.0 * t
    mag = np.column_stack((20.0 * np.cos(angle), -20.0 * np.sin(angle), np.full(t.size, 43.0)))
    mag += 0.3 * np.random.default_rng(2).standard_normal(mag.shape)
    result = imported(tmp_path, [f"{1000 * x:.0f}" for x in t], mag[np.arange(800) // 2 * 2], turning(t.size))
    field, gyro = (result.recording.samples[s] for s in ("magnetometer", "gyroscope"))
    assert_allclose(field.t, gyro.t[::2], atol=1e-6)
    assert any("read every second row, in step with the log" in note for note in result.notes)
    # cut within a reading, it stands since the row before
    cut = imported(tmp_path, [f"{1000 * x:.0f}" for x in t], mag[(np.arange(800) + 1) // 2 * 2 % 800], turning(t.size))
    assert cut.recording.samples["magnetometer"].t[0] == pytest.approx(cut.recording.samples["gyroscope"].t[0] - 0.005)


@pytest.mark.parametrize(("sensor_hz", "log_hz"), [(100.0, 104.0), (100.0, 250.0), (75.0, 100.0), (20.0, 200.0)])
def test_rows_lost_from_a_held_log_leave_its_sensors_clock_whole(tmp_path, sensor_hz, log_hz):
    t, mag = held_log(sensor_hz, log_hz, seconds=20.0)
    keep = np.random.default_rng(5).random(t.size) > 0.005
    result = imported(tmp_path, [f"{1000 * x:.3f}" for x in t[keep]], mag[keep], turning(int(keep.sum())))
    field = result.recording.samples["magnetometer"]
    assert result.recording.sheets["magnetometer"].rate_hz == pytest.approx(sensor_hz, rel=1e-3)
    taken = (field.t - field.t[0]) * sensor_hz
    # every reading is at a whole number of periods from the first, rows that were lost or not
    assert_allclose(taken, np.round(taken), atol=0.05)


def test_phases_of_a_held_field_follow_the_spin_within_its_noise(tmp_path):
    """Row times would scatter the phase by 4 ms / sqrt(12) at 2000 deg/s, 2.3 deg, beside 1.1 deg of noise."""
    t, mag = held_log(100.0, 250.0, seconds=4.0)
    field = imported(tmp_path, [f"{1000 * x:.0f}" for x in t], mag, turning(t.size)).recording.samples["magnetometer"]
    phase = np.unwrap(-np.arctan2(field.value[:, 1], field.value[:, 0]))
    line = np.polyfit(field.t, phase, 1)
    assert np.degrees(line[0]) == pytest.approx(2000.0, rel=1e-3)
    assert np.degrees(np.std(phase - np.polyval(line, field.t))) == pytest.approx(np.degrees(0.6 / 30), rel=0.15)


# ------------------------------------------------------------------------------------------- late, lost, doubled


def test_late_rows_keep_their_place_and_lost_rows_leave_steps_of_whole_multiples():
    t = np.arange(1000) / 100
    late = t.copy()
    late[[100, 300, 500]] += 0.004
    assert (row_timing(late).late, row_timing(late).lost) == (6, 0)  # the step before and the step after
    very_late = t.copy()
    very_late[[100, 300]] += 0.007
    assert (row_timing(very_late).late, row_timing(very_late).lost) == (2, 0)
    lost = np.delete(t, [100, 300, 301, 302])
    assert (row_timing(lost).late, row_timing(lost).lost, row_timing(lost).breaks) == (0, 4, 2)
    assert row_timing(lost).exact
    assert not row_timing(late).exact


def test_stamps_in_whole_milliseconds_are_neither_late_nor_lost():
    timing = row_timing(np.round(np.arange(2000) / 285.7, 3))
    assert (timing.late, timing.lost) == (0, 0)
    assert timing.interval == pytest.approx(1 / 285.7, rel=1e-3)


@pytest.mark.parametrize("rate", [833.0, 847.4, 952.0])
@pytest.mark.parametrize("jitter_s", [0.0, 3e-4])
def test_stamps_in_whole_milliseconds_of_nearly_as_many_rows_lose_none(rate, jitter_s):
    """A row each 1.18 ms steps by 1 ms or by 2: 1672 rows of 9294 were said to be lost."""
    late = np.random.default_rng(5).uniform(0.0, jitter_s or 1e-12, 9000)
    t = np.unique(np.floor(1000.0 * (np.arange(9000) / rate + late))) / 1000.0
    timing = row_timing(t)
    assert timing.lost < 0.002 * t.size
    assert timing.interval == pytest.approx((t[-1] - t[0]) / (t.size - 1), rel=0.005)


@pytest.mark.parametrize("share", [0.01, 0.05, 0.18])
def test_rows_that_are_lost_at_random_from_a_clock_of_milliseconds_are_counted(share):
    kept = np.random.default_rng(5).uniform(size=9000) > share
    timing = row_timing(np.arange(9000)[kept] / 1000.0)
    assert timing.lost == pytest.approx(np.count_nonzero(~kept), abs=2)  # but for the first and the last
    assert timing.interval == pytest.approx(1e-3)


def test_an_import_says_lost_late_and_doubled_rows_apart(tmp_path):
    t = np.arange(500) * 10.0
    t[50::40] += 6.0
    keep = np.delete(np.arange(500), [20, 21, 222])
    keep = np.insert(keep, 301, keep[301])
    mag = spinning(np.arange(500) / 100)
    result = imported(tmp_path, [f"{x:g}" for x in t[keep]], mag[keep], turning(500)[keep])
    assert [(repair.line, repair.what) for repair in result.repairs] == [
        (304, f"time {t[keep[301]] / 1000:.9g} s is doubled, and so is the row")
    ]
    assert any(note.startswith("magnetometer: 3 rows are lost in 2 places") for note in result.notes)
    assert any(note.startswith("magnetometer: 12 of 497 rows came late") for note in result.notes)


# ------------------------------------------------------------------------------------------------- dead sensors


def test_a_sensor_without_a_number_is_left_out_and_the_rest_goes_on(tmp_path):
    t = np.arange(200)
    nothing = np.full((200, 3), np.nan)
    result = imported(tmp_path, [f"{10 * k}" for k in t], nothing, turning(200), gap="NA")
    assert list(result.recording.samples) == ["gyroscope"]
    assert "no magnetometer: none of its 200 rows holds a number; it is left out" in result.notes
    with pytest.raises(InputError, match="nothing to import: no magnetometer: none of its 200 rows"):
        imported(tmp_path, [f"{10 * k}" for k in t], nothing, nothing)


def test_a_sensor_of_zeros_or_one_that_never_changes_while_the_body_turns_is_left_out(tmp_path):
    stamps = [f"{10 * k}" for k in range(200)]
    zeros = imported(tmp_path, stamps, spinning(np.arange(200) / 100), np.zeros((200, 3)))
    assert list(zeros.recording.samples) == ["magnetometer"]
    assert any("all its 200 rows are zero" in note for note in zeros.notes)
    stuck = imported(tmp_path, stamps, np.full((200, 3), 12.5), turning(200))
    assert list(stuck.recording.samples) == ["gyroscope"]
    assert any("it is dead" in note for note in stuck.notes)
    resting = imported(tmp_path, stamps, np.full((200, 3), 12.5), turning(200, rate=0.0))
    assert "magnetometer" in resting.recording


def test_a_magnetometer_that_freezes_becomes_a_gap_from_that_instant(tmp_path):
    mag = spinning(np.arange(600) / 100) + np.random.default_rng(0).normal(0, 0.6, (600, 3))
    mag[351:] = mag[350]
    result = imported(tmp_path, [f"{10 * k}" for k in range(600)], mag, turning(600))
    assert result.recording.samples["magnetometer"].t[-1] == pytest.approx(3.5)
    assert any(
        note
        == "magnetometer: it shows one value from 3.500 s to the end while the body moves: frozen; 249 rows become "
        "a gap"
        for note in result.notes
    )


def test_a_coarse_gyroscope_in_a_steady_spin_is_not_frozen_but_one_in_a_spin_that_changes_is(tmp_path):
    stamps = [f"{10 * k}" for k in range(600)]
    mag = spinning(np.arange(600) / 100) + np.random.default_rng(0).normal(0, 0.6, (600, 3))
    gyro = np.round(turning(600), 0) + np.outer(np.arange(600) < 50, [0, 0, 1.0])
    steady = imported(tmp_path, stamps, mag, gyro)
    assert len(steady.recording.samples["gyroscope"]) == 600
    slowing = turning(600, rate=0.0) + np.outer(np.linspace(40, 5, 600), [0, 0, 1.0])
    force = np.round(0.02 * slowing**2, 2)
    force[300:] = force[300]
    frozen = imported_with_force(tmp_path, stamps, force, slowing)
    assert frozen.recording.samples["accelerometer"].t[-1] == pytest.approx(3.0)


def imported_with_force(folder: Path, stamps: list[str], force: np.ndarray, gyro: np.ndarray) -> Imported:
    """Import a log whose first three columns are a specific force."""
    imported(folder, stamps, force, gyro)  # writes the log
    text = (folder / "map.toml").read_text().replace("[sensors.magnetometer]", "[sensors.accelerometer]")
    (folder / "map.toml").write_text(text.replace('unit = "uT"', 'unit = "m/s^2"'))
    return import_recording(folder / "log.csv", read_map(folder / "map.toml"))


@pytest.mark.parametrize("cell", ["NaN", "nan", "NA", "n/a", "null", "-", "#N/A", "inf", "-Inf", "1.#QNAN", ""])
def test_words_for_no_number_are_gaps(cell):
    assert np.isnan(number(cell))


@pytest.mark.parametrize("cell", ["1_000", "ERR", "1e999", "12:00", "--1"])
def test_other_words_are_no_gaps(cell):
    assert number(cell) is None


# --------------------------------------------------------------------------------------------------------- clocks


@pytest.mark.parametrize(
    ("width", "unit"),
    [(2**16, 1e-3), (2**32, 1e-3), (2**31, 1e-6), (2**32, 1e-6), (1_000_000, 1e-6), (86_400_000, 1e-3), (60_000, 1e-3)],
)
def test_a_counter_that_wraps_goes_on(width, unit):
    step = 10e-3 / unit
    count = (width - 300 * step + step * np.arange(900)) % width
    clock = mended(count * unit, unit)
    assert len(clock.breaks) == (1 if width * unit > 9 else 8)
    assert_allclose(np.diff(clock.time), 0.01, atol=1e-6)
    assert not clock.stretch.any()


def test_a_signed_counter_and_the_milliseconds_of_a_second_wrap_too():
    count = np.arange(2**31 - 3000, 2**31 + 3000, 10, dtype=np.int64)
    signed = np.where(count >= 2**31, count - 2**32, count)
    assert_allclose(np.diff(mended(signed * 1e-3, 1e-3).time), 0.01, atol=1e-6)
    thousand = np.arange(0, 5000, 10) % 1000
    clock = mended(thousand * 1e-3, 1e-3)
    assert len(clock.breaks) == 4
    assert_allclose(np.diff(clock.time), 0.01, atol=1e-9)


def test_a_logger_that_starts_again_begins_a_stretch_and_a_wild_stamp_does_not():
    again = np.concatenate([np.arange(300), np.arange(700)]) * 0.01
    clock = mended(again, 1.0)
    assert [found.index for found in clock.breaks] == [300]
    assert clock.stretch.sum() == 700
    wild = np.arange(500) * 0.01
    wild[100] = 900.0
    wild[200] = 0.0
    assert mended(wild, 1.0).breaks == ()
    assert_allclose(mended(wild, 1.0).time, wild)


def test_a_clock_that_is_set_to_the_date_begins_a_stretch():
    t = np.concatenate([np.arange(100) * 0.01, 1.7e9 + np.arange(400) * 0.01])
    clock = mended(t, 1.0)
    assert [(found.index, found.shift) for found in clock.breaks] == [(100, 0.0)]
    assert "the clock was set" in clock.breaks[0].what


def test_the_longest_stretch_is_imported_or_the_one_that_rows_pick(tmp_path):
    stamps = [f"{10 * k}" for k in range(200)] + [f"{10 * k}" for k in range(300)]
    mag = spinning(np.arange(500) / 100)
    whole = imported(tmp_path, stamps, mag, turning(500))
    assert len(whole.recording.samples["gyroscope"]) == 300
    assert_allclose(whole.recording.samples["magnetometer"].value[0], mag[200], rtol=1e-6)
    said = "the clock starts anew in line 202: 2 stretches; the longest is kept; --rows takes another: 0:200, 200:500"
    assert any(said in note for note in whole.notes)
    assert [(r.line, r.action) for r in whole.repairs] == [(202, "a new stretch begins here")]
    first = imported(tmp_path, stamps, mag, turning(500), rows=":200")
    assert len(first.recording.samples["gyroscope"]) == 200
    assert_allclose(first.recording.samples["magnetometer"].value[0], mag[0], rtol=1e-6)


def test_a_wrap_is_listed_with_its_line_and_no_row_is_lost(tmp_path):
    stamps = [f"{(65000 + 10 * k) % 65536}" for k in range(400)]
    result = imported(tmp_path, stamps, spinning(np.arange(400) / 100), turning(400))
    (repair,) = result.repairs
    assert repair.line == 56  # 65540 is the 55th row
    assert "a counter of 16 bits wrapped round" in repair.what
    assert "65.536 s added" in repair.action
    assert all(b - a == pytest.approx(0.01) for a, b in pairwise(result.recording.samples["gyroscope"].t))


def test_iso_times_are_seconds_with_or_without_a_zone_and_go_over_midnight(tmp_path):
    assert iso_seconds("2025-06-01T14:00:00.5+02:00") == iso_seconds("2025-06-01T12:00:00.500Z")
    assert iso_seconds("2025-06-01 12:00:00,25") - iso_seconds("2025-06-01T12:00:00") == pytest.approx(0.25, abs=1e-6)
    assert iso_seconds("2025-06-01T12:00:00.000000001Z") == pytest.approx(iso_seconds("2025-06-01T12:00:00Z"), abs=1e-6)
    assert iso_seconds("12:00:00.123") == pytest.approx(43200.123)
    assert iso_seconds("20250601") is None
    assert iso_seconds("1.5") is None
    seconds = [86398.0 + 0.01 * k for k in range(400)]
    stamps = [f"{int(s // 3600) % 24:02}:{int(s // 60) % 60:02}:{s % 60:06.3f}" for s in seconds]
    result = imported(tmp_path, stamps, spinning(np.arange(400) / 100), turning(400), unit="iso")
    assert_allclose(result.recording.samples["gyroscope"].t, 0.01 * np.arange(400), atol=1e-6)
    assert "a clock of 24 h began anew" in result.repairs[0].what


def test_a_file_without_stamps_says_that_nothing_is_known_of_its_timing(tmp_path):
    text = MAP.replace('column = "ms"\nunit = "ms"', "step_s = 0.01")
    (tmp_path / "map.toml").write_text(text)
    (tmp_path / "log.csv").write_text("mx,my,mz,gx,gy,gz\n1,2,3,4,5,6\n2,2,3,4,5,6\n")
    notes = import_recording(tmp_path / "log.csv", read_map(tmp_path / "map.toml")).notes
    assert notes == (
        "no time column: rows are taken as 0.01 s apart; whether they came late or were lost cannot be told",
    )


def test_the_plain_map_takes_a_held_log_as_it_is(tmp_path):
    t, mag = held_log(100.0, 104.0, seconds=10.0)
    rows = "".join(f"{x:.6f},{a},{b},{c}\n" for x, (a, b, c) in zip(t, mag, strict=True))
    (tmp_path / "log.csv").write_text("time_s,x_uT,y_uT,z_uT\n" + rows)
    recording = import_recording(tmp_path / "log.csv", read_map(find_map("csv"))).recording
    assert recording.sheets["magnetometer"].rate_hz == pytest.approx(100.0, rel=1e-3)
    assert_allclose(np.diff(recording.samples["magnetometer"].t), 0.01, rtol=1e-2)


def test_a_log_of_two_rows_imports_and_one_row_tells_no_rate(tmp_path):
    result = imported(tmp_path, ["0", "10"], spinning(np.arange(2) / 100), turning(2))
    assert len(result.recording.samples["magnetometer"]) == 2
    with pytest.raises(InputError, match="one sample and no rate_hz in the map"):
        imported(tmp_path, ["0"], spinning(np.zeros(1)), turning(1))


def test_stamps_in_whole_milliseconds_give_the_rate_of_their_mean_and_not_of_one_rounded_step(tmp_path):
    t = np.arange(1040) / 104
    result = imported(tmp_path, [f"{1000 * x:.0f}" for x in t], spinning(t), turning(t.size))
    assert result.recording.sheets["gyroscope"].rate_hz == pytest.approx(104.0, rel=1e-3)


def test_time_that_stands_or_runs_backwards_is_refused_in_one_sentence(tmp_path):
    mag = spinning(np.arange(50) / 100)
    for stamps in (["7"] * 50, [f"{10 * k}" for k in range(50, 0, -1)]):
        with pytest.raises(InputError, match="time does not go on over the magnetometer's 50 rows: 'ms' runs from"):
            imported(tmp_path, stamps, mag, turning(50))


def test_stamps_that_are_coarser_than_the_rows_are_said_to_be(tmp_path):
    result = imported(tmp_path, [f"{100 * (k // 5)}" for k in range(200)], spinning(np.arange(200) / 50), turning(200))
    assert any("40 different times in 200 rows" in note for note in result.notes)


def test_a_log_that_stutters_throughout_has_lost_no_row():
    rng = np.random.default_rng(6)
    t = np.cumsum(np.maximum(1 + 0.3 * rng.standard_normal(3000), 0.05)) / 100
    timing = row_timing(t)
    assert (timing.lost, timing.twice) == (0, 0)
    assert timing.late > 1000


def test_an_accelerometer_that_is_coarse_for_a_slow_change_is_not_frozen(tmp_path):
    rate = np.linspace(40, 20, 2000)
    force = np.round(np.stack([0.016 * rate**2, 0 * rate, 0 * rate - 9.8], axis=1))
    gyro = turning(2000, rate=0.0) + np.outer(rate, [0, 0, 1.0])
    result = imported_with_force(tmp_path, [f"{10 * k}" for k in range(2000)], force, gyro)
    assert len(result.recording.samples["accelerometer"]) == 2000


def test_readings_that_differ_by_rounding_alone_have_no_step_of_resolution():
    assert step_of(3.0e7 * (1.0 + 1e-13 * np.arange(5.0))) is None
