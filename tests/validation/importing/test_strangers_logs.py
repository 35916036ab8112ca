"""What loggers, phones and spreadsheets write otherwise than a table of readings is read rightly, or refused aloud."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, RELEASE, made_log, three, write_table

from discsim.errors import InputError
from discsim.validation.importing import import_recording, read_map, read_readings
from discsim.validation.importing.sniffing import map_text, opened, sniff, stretches
from discsim.validation.importing.stamps import iso_seconds

XYZ = ("x", "y", "z")
LOG = made_log()


def named(pattern: str) -> list[str]:
    return [pattern.format(axis) for axis in XYZ]


def imported(raw: Path, place: Path):
    """Return the recording and the map's text."""
    with opened(raw) as logged:
        text = map_text(sniff(logged))
        (place / "map.toml").write_text(text, encoding="utf-8")
        return import_recording(logged, read_map(place / "map.toml")).recording, text


def turning(place: Path, name: str, stamps, **how) -> Path:
    columns = [stamps, *three(named("gyro_{}"), LOG.gyro / DEG), *three(named("acc_{}"), LOG.accel / G0)]
    return write_table(place / name, columns, **how)


def counted(stamp) -> list[str]:
    """Return a text for each row from hours, minutes, seconds and milliseconds of a log that begins at 14:03:55."""
    ms = [50_635_000 + round(1000 * t) for t in LOG.t]
    return [stamp(one // 3_600_000, one // 60_000 % 60, one // 1000 % 60, one % 1000) for one in ms]


STAMPS = {
    "MATLAB": lambda h, m, s, ms: f"01-Jun-2025 {h:02d}:{m:02d}:{s:02d}.{ms:03d}",
    "a third colon before the milliseconds": lambda h, m, s, ms: f"{h}:{m:02d}:{s:02d}:{ms:03d}",
    "the day first": lambda h, m, s, ms: f"01/06/2025 {h}:{m:02d}:{s:02d}.{ms:03d}",
    "points in the date": lambda h, m, s, ms: f"1.6.2025 {h}:{m:02d}:{s:02d}.{ms:03d}",
    "morning and afternoon": lambda h, m, s, ms: f"6/1/2025 {h - 12}:{m:02d}:{s:02d}.{ms:03d} PM",
    "no zeros before": lambda h, m, s, ms: f"2025-6-1 {h}:{m:02d}:{s:02d}.{ms:03d}",
    "C": lambda h, m, s, ms: f"Sun Jun  1 {h:02d}:{m:02d}:{s:02d}.{ms:03d} 2025",
    "a shell's date": lambda h, m, s, ms: f"Sun Jun  1 {h - 12:02d}:{m:02d}:{s:02d}.{ms:03d} PM CEST 2025",
    "ts": lambda h, m, s, ms: f"Jun 01 {h:02d}:{m:02d}:{s:02d}.{ms:03d}",
    "mail": lambda h, m, s, ms: f'"Sun, 01 Jun 2025 {h:02d}:{m:02d}:{s:02d}.{ms:03d} +0200"',
    "a viewer of logs": lambda h, m, s, ms: f'"Jun 1, 2025 @ {h:02d}:{m:02d}:{s:02d}.{ms:03d}"',
    "digits alone": lambda h, m, s, ms: f"20250601{h:02d}{m:02d}{s:02d}{ms:03d}",
    "digits in groups": lambda h, m, s, ms: f"20250601_{h:02d}{m:02d}{s:02d}_{ms:03d}",
    "as the names of files are": lambda h, m, s, ms: f"2025-06-01-{h:02d}-{m:02d}-{s:02d}-{ms:03d}",
    "minutes and seconds alone": lambda h, m, s, ms: f"{m:02d}:{s:02d}.{ms:03d}",
}


@pytest.mark.parametrize("form", STAMPS)
def test_stamps_are_read_as_spreadsheets_and_phones_write_them(tmp_path, form):
    recording, _ = imported(turning(tmp_path, "log.csv", ("Time", counted(STAMPS[form]))), tmp_path)
    assert_allclose(recording.samples["gyroscope"].t, LOG.t, atol=1e-6)


def test_a_date_with_the_month_in_letters_is_that_day():
    assert iso_seconds("10-Jun-2024 06:13:20.125") == iso_seconds("2024-06-10 06:13:20.125")
    assert iso_seconds("1 December 24 06:13:20") == iso_seconds("2024-12-01 06:13:20")
    assert iso_seconds("10-Foo-2024 06:13:20") is None
    assert iso_seconds("Mon Jun 10 06:13:20 2024") == iso_seconds("2024-06-10 06:13:20")
    assert iso_seconds("June 10, 2024 6:13:20 PM") == iso_seconds("2024-06-10 18:13:20")
    assert iso_seconds("20240610T061320.5Z") == iso_seconds("20240610061320500") == iso_seconds("2024-06-10 06:13:20.5")
    # syslog and `ts` write no year: what goes by between two stamps is right
    assert iso_seconds("Jun 11 06:13:20") - iso_seconds("Jun 10 06:13:20") == 86400


def test_a_remark_above_numbers_without_names_makes_no_header_of_them(tmp_path):
    columns = [("t", (LOG.t * 1e6).round()), *three(named("g{}"), LOG.gyro), *three(named("a{}"), LOG.accel)]
    columns += three(named("m{}"), LOG.mag)
    raw = write_table(tmp_path / "log.txt", columns, separator=" ", header=False, before="# teensy log\n")
    recording, text = imported(raw, tmp_path)
    assert len(recording.samples["gyroscope"]) == LOG.t.size
    assert 'columns = ["c1", "c2"' in text


@pytest.mark.parametrize(
    "cell", ["14:61:00.5", "32/01/2025 10:00:00", "a:b", "20250601", "1,5", "99:99.1", "20251361101010"]
)
def test_what_is_no_time_is_none(cell):
    assert iso_seconds(cell) is None


def test_noon_and_midnight_are_twelve_hours_apart():
    noon, midnight = (iso_seconds(f"6/1/2025 12:00:00 {half}") for half in ("PM", "AM"))
    assert noon - midnight == 43200.0


def test_a_column_of_time_that_cannot_be_read_is_named(tmp_path):
    _, text = imported(turning(tmp_path, "log.csv", ("Time", ["noon"] * LOG.t.size)), tmp_path)
    assert "'Time' tells no time here (its first cell is 'noon')" in text


@pytest.mark.parametrize("name", ["시간(초)", "時間", "ÃÊ°£"])
def test_a_clock_is_found_under_a_name_in_any_script(tmp_path, name):
    columns = [(name, LOG.t), *three(named("각속도 {}(rad/s)"), LOG.gyro), *three(named("ジャイロ2 {}(V)"), LOG.mag)]
    recording, _ = imported(write_table(tmp_path / "log.csv", columns), tmp_path)
    assert_allclose(recording.samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(recording.samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-5)


@pytest.mark.parametrize(
    ("name", "before"),
    [
        ("log.csv", "# Device: X, baud rate 115200, I2C 400 kHz\n# Sampling rate: 200 Hz\n"),
        ("log.csv", "Logger 3\nODR = 200\n\n"),
        ("log.csv", "# Config: data_rate = 200.0 Hz, filter = 42 Hz, gyro_range = 2000.0 dps\n"),
        ("log.csv", "# serial data rate: 115200 baud\n# Data rate 0.2 kHz, clock 8 MHz\n"),
        ("log_200Hz.csv", ""),
    ],
)
def test_a_rate_that_is_stated_beside_the_table_spaces_its_rows(tmp_path, name, before):
    columns = three(named("gyro_{}_dps"), LOG.gyro / DEG)
    recording, _ = imported(write_table(tmp_path / name, columns, before=before), tmp_path)
    assert_allclose(recording.samples["gyroscope"].t, LOG.t, atol=1e-6)


def test_what_a_step_may_be_off_by_comes_into_the_recording(tmp_path):
    """By the field's turning it is known to 4 %; a map without step_sigma_s knows it."""
    columns = [*three(named("gyro_{}_dps"), LOG.gyro / DEG), *three(named("mag_{}_uT"), LOG.mag)]
    raw = write_table(tmp_path / "log.csv", columns)
    recording, text = imported(raw, tmp_path)
    sheet = recording.sheets["magnetometer"]
    assert sheet.sigma["rate_hz"] == pytest.approx(0.04 * sheet.rate_hz, rel=0.05)
    known = [line for line in text.splitlines() if not line.startswith("step_sigma_s")]
    (tmp_path / "known.toml").write_text("\n".join(known), encoding="utf-8")
    assert not import_recording(raw, read_map(tmp_path / "known.toml")).recording.sheets["magnetometer"].sigma


def test_two_stated_rates_space_no_rows(tmp_path):
    columns = three(named("gyro_{}_dps"), LOG.gyro / DEG)
    before = "# gyro: 200 Hz\n# mag: 50 Hz\n"
    recording, text = imported(write_table(tmp_path / "log.csv", columns, before=before), tmp_path)
    assert recording.samples["gyroscope"].interval == pytest.approx(0.01)
    assert "# guess: no time stamps" in text


@pytest.mark.parametrize(
    "lines", ["# accel 0.488 mg/LSB, gyro 70 mdps/LSB\n", "# accel: 2049.18 LSB/g\n# gyro: 14.2857 LSB/(deg/s)\n"]
)
def test_the_worth_of_a_count_is_taken_from_the_lines_above(tmp_path, lines):
    accel, gyro = (np.round(value).astype(int) for value in (LOG.accel / G0 / 0.000488, LOG.gyro / DEG / 0.07))
    columns = [("ms", (1000 * LOG.t).round().astype(int)), *three(named("a{}"), accel), *three(named("g{}"), gyro)]
    recording, text = imported(write_table(tmp_path / "log.csv", columns, before=lines), tmp_path)
    assert_allclose(recording.samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=0.04 * DEG + 1e-4 * 40)
    assert "a line above the table says so" in text


def test_commas_between_thousands_and_between_cells_are_told_apart_by_quotes(tmp_path):
    values = np.column_stack([1000 * LOG.t, LOG.gyro / DEG, 1000 * LOG.mag])
    rows = [",".join(f'"{value:,.1f}"' for value in row) for row in values]
    header = "Time (ms),GyroX (dps),GyroY (dps),GyroZ (dps),MagX (nT),MagY (nT),MagZ (nT)"
    (tmp_path / "log.csv").write_text("\n".join([header, *rows, ""]))
    recording, _ = imported(tmp_path / "log.csv", tmp_path)
    assert_allclose(recording.samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=0.06 * DEG)
    assert len(recording.samples["magnetometer"]) == LOG.t.size


def test_a_decimal_comma_in_quotes_with_three_digits_is_no_mark_between_thousands(tmp_path):
    values = np.column_stack([LOG.t, LOG.gyro / DEG])
    rows = [",".join('"' + f"{value:.3f}".replace(".", ",") + '"' for value in row) for row in values]
    header = '"Zeit (s)","GyroX (°/s)","GyroY (°/s)","GyroZ (°/s)"'
    (tmp_path / "log.csv").write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    recording, _ = imported(tmp_path / "log.csv", tmp_path)
    assert_allclose(recording.samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-3 * DEG)
    assert_allclose(recording.samples["gyroscope"].t, LOG.t, atol=1e-6)


@pytest.mark.parametrize(
    ("form", "between"),
    [
        ("{} -> ", ","),
        ("{} > ", ","),
        ("{} > ", "\t"),
        ("[{}] ", ";"),
        ("[2024-05-03 {}] ", ","),
        ("[2024-05-03 {}] ", " "),
    ],
)
def test_what_a_serial_monitor_puts_before_a_line_is_a_column_of_its_own(tmp_path, form, between):
    """With PlatformIO's and Tera Term's the first column and the time were lost: rows were taken as 0.01 s apart."""
    stamps = counted(lambda h, m, s, ms: f"{h}:{m:02d}:{s:02d}.{ms:03d}")
    rows = [
        form.format(stamp) + between.join([*(f"{x:.3f}" for x in a), *(f"{x:.2f}" for x in w)])
        for stamp, a, w in zip(stamps, LOG.accel / G0, LOG.gyro / DEG, strict=True)
    ]
    (tmp_path / "log.txt").write_text("\n".join([*rows, ""]))
    recording, _ = imported(tmp_path / "log.txt", tmp_path)
    assert set(recording.samples) == {"gyroscope", "accelerometer"}
    assert_allclose(recording.samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(recording.samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=0.01 * DEG)


def test_no_column_is_two_sensors(tmp_path):
    # a tension and a temperature beside: triples of columns are looked for at every place
    columns = [("ms", (1000 * LOG.t).round().astype(int)), ("v", 3.9 + 0.001 * (np.arange(LOG.t.size) % 3))]
    columns += [*three(XYZ, LOG.accel / G0), *three(XYZ, LOG.gyro / DEG), ("v", 21.0 + 0 * LOG.t)]
    raw = write_table(tmp_path / "log.txt", columns, separator=" ", header=False)
    found = {sensor.sensor: sensor.triple.names for sensor in sniff(raw).sensors}
    assert found == {"gyroscope": ("c6", "c7", "c8"), "accelerometer": ("c3", "c4", "c5")}


def test_an_acceleration_without_gravity_is_no_accelerometer(tmp_path):
    # a flight that is steadier than the rest before it
    rng = np.random.default_rng(3)
    flying = (LOG.t > RELEASE) & (LOG.t < RELEASE + 3)
    value = np.where(flying[:, None], [16.0, 4.0, 8.0], 0.0)
    value += np.where(flying, 0.005, 0.03)[:, None] * rng.standard_normal(value.shape)
    columns = [("t_s", LOG.t), *three(named("a{}"), value), *three(named("g{}"), LOG.gyro)]
    proposal = sniff(write_table(tmp_path / "log.csv", columns))
    assert [sensor.sensor for sensor in proposal.sensors] == ["gyroscope"]
    assert any("without gravity" in note for note in proposal.notes)


def test_the_accelerometer_of_a_rocket_that_coasts_keeps_its_gravity(tmp_path):
    """It reads nothing for most of the log, in counts, and gravity on the pad."""
    rng = np.random.default_rng(4)
    value = np.where((LOG.t < 2)[:, None], [0.0, 300.0, 8150.0], 0.0) + 40 * rng.standard_normal(LOG.accel.shape)
    value[(LOG.t > 2) & (LOG.t < 2.3)] += [0, 0, 30000]
    columns = [("t_s", LOG.t), *three(named("a{}"), value.round().astype(int)), *three(named("g{}"), LOG.gyro)]
    proposal = sniff(write_table(tmp_path / "log.csv", columns))
    assert [sensor.sensor for sensor in proposal.sensors] == ["gyroscope", "accelerometer"]


def test_a_throw_beyond_a_small_range_is_found(tmp_path):
    gyro = np.clip(LOG.gyro / DEG, -250, 250)
    columns = [("t_s", LOG.t), *three(named("gyro_{}_dps"), gyro), *three(named("mag_{}_uT"), LOG.mag)]
    raw = write_table(tmp_path / "log.csv", columns)
    (tmp_path / "map.toml").write_text(map_text(sniff(raw)), encoding="utf-8")
    (throw,) = stretches(read_readings(raw, read_map(tmp_path / "map.toml"), None))
    assert throw.sensor == "magnetometer"
    assert RELEASE <= throw.start < throw.end <= RELEASE + 3.1
    assert throw.spin == pytest.approx(32, rel=0.05)


# ------------------------------------------------------------------------------------------------ misspelt names


@pytest.mark.parametrize("typo", ["GryZ [dps]", "GyrrZ [dps]", "GyZ [dps]", "GyrZ [dsp]"])
def test_a_slip_in_one_name_that_leaves_a_sensor_out_is_asked_about(tmp_path, typo):
    names = ["GyrX [dps]", "GyrY [dps]", typo]
    columns = [("t_s", LOG.t), *three(named("Acc{} [g]"), LOG.accel / G0), *three(names, LOG.gyro / DEG)]
    proposal = sniff(write_table(tmp_path / "log.csv", [*columns, ("batt_V", 4.0 + 0 * LOG.t)]))
    asked = f"of the gyroscope x and y were found and z was not: is it '{typo}'? Rename it, or state it in a map"
    assert proposal.notes == (asked, f"not used: GyrX [dps], GyrY [dps], {typo}, batt_V")
    assert all(f"# {note}\n" in map_text(proposal) for note in proposal.notes)
    with pytest.raises(InputError, match="is it '"):
        sniff(write_table(tmp_path / "alone.csv", columns[:1] + columns[4:]))


def test_of_two_names_that_are_a_slip_away_and_of_none_neither_is_proposed(tmp_path):
    columns = [("t_s", LOG.t), *three(named("a{}"), LOG.accel / G0), *three(["gx", "gy", "spin"], LOG.gyro / DEG)]
    none = sniff(write_table(tmp_path / "none.csv", columns))
    two = sniff(write_table(tmp_path / "two.csv", [*columns, ("gzz", LOG.t), ("ggz", LOG.t)]))
    for proposal in (none, two):
        assert "z was not: name its column as 'gx' and 'gy' are named" in proposal.notes[0]
    whole = three(named("q{}"), np.column_stack([LOG.t, LOG.t, LOG.t]))
    beside = sniff(write_table(tmp_path / "beside.csv", [*columns[:-1], ("gzz", LOG.gyro[:, 2]), *whole]))
    assert "is it 'gzz'?" in beside.notes[0]  # qz has mates of its own


@pytest.mark.parametrize("names", [["gyr_x", "gyo_y", "gyrox_z"], ["gyro x", "gyor y", "gyrp z"]])
def test_columns_of_a_sensor_no_two_of_which_are_named_alike_are_named_with_the_line_of_a_map(tmp_path, names):
    columns = [("t_s", LOG.t), *three(named("Acc{} [g]"), LOG.accel / G0), *three(names, LOG.gyro / DEG)]
    proposal = sniff(write_table(tmp_path / "log.csv", [*columns, ("batt_V", 4.0 + 0 * LOG.t)]))
    quoted = ", ".join(f'"{name}"' for name in names)
    x, y, z = names
    assert proposal.notes[0] == (
        f"the gyroscope was not taken, for its columns are not named alike: probably x in '{x}', y in '{y}', z in "
        f"'{z}'. Rename them alike, or write in a map: [sensors.gyroscope] columns = [{quoted}], unit = its unit"
    )
    with pytest.raises(InputError, match="not named alike"):
        sniff(write_table(tmp_path / "alone.csv", columns[:1] + columns[4:]))


def test_the_axis_that_columns_not_named_alike_lack_is_named(tmp_path):
    names = ["gyr_x", "spin", "gyrox_z"]
    columns = [("t_s", LOG.t), *three(named("Acc{} [g]"), LOG.accel / G0), *three(names, LOG.gyro / DEG)]
    (line, _) = sniff(write_table(tmp_path / "log.csv", columns)).notes
    assert "probably x in 'gyr_x', z in 'gyrox_z'; y was not found" in line


def test_a_third_column_of_another_spelling_is_proposed_with_its_unit(tmp_path):
    names = ["acc_x [g]", "acc_y [g]", "acel_z [g]"]
    columns = [("t_s", LOG.t), *three(named("g{}"), LOG.gyro), *three(names, LOG.accel / G0)]
    (line, _) = sniff(write_table(tmp_path / "log.csv", columns)).notes
    assert "is it 'acel_z [g]'? Rename it, or write in a map: [sensors.accelerometer] columns = [" in line
    assert line.endswith('unit = "g"')


def test_a_log_all_of_whose_columns_are_read_says_nothing_of_others(tmp_path):
    columns = [("t_s", LOG.t), *three(named("a{}"), LOG.accel / G0), *three(named("g{}"), LOG.gyro / DEG)]
    assert sniff(write_table(tmp_path / "log.csv", columns)).notes == ()


@pytest.mark.parametrize(("per_g", "per_deg_s"), [(16384, 131.072), (4096, 16.384)])
def test_small_whole_numbers_beside_counts_of_g_are_a_gyroscope_s_counts(tmp_path, per_g, per_deg_s):
    """A rocket's counts of 2341 were taken for deg/s: beyond any usual gyroscope's range, and 131 times too much."""
    slow = np.round(LOG.gyro / np.max(np.abs(LOG.gyro)) * 2400)
    still = np.round(per_g * np.array([0.0, 0.0, 1.0]) + np.random.default_rng(1).normal(0.0, 5.0, LOG.accel.shape))
    columns = [("t_ms", np.round(1000 * LOG.t).astype(int)), *three(["AX", "AY", "AZ"], still)]
    proposal = sniff(write_table(tmp_path / "log.csv", [*columns, *three(["GX", "GY", "GZ"], slow)]))
    unit = next(decision for decision in proposal.all_decisions if decision.what == "gyroscope unit")
    assert unit.choice == f"1/{per_deg_s:.5g} deg/s a count"
    assert f"whole numbers beside {per_g} counts per g" in unit.why


# ------------------------------------------------------------------------------------------------------- archives


def archive(path: Path, names: list[str]) -> Path:
    rows = "\n".join(f"{t},{w[0]},{w[1]},{w[2]}" for t, w in zip(LOG.t, LOG.gyro, strict=True))
    with zipfile.ZipFile(path, "w") as made:
        for name in names:
            made.writestr(name, "hello\n" if "read" in name.lower() else f"t_s,gx,gy,gz\n{rows}\n")
    return path


def test_a_word_beside_the_folder_of_a_zip_does_not_hide_it(tmp_path):
    recording, _ = imported(archive(tmp_path / "log.zip", ["run/gyro.csv", "README.txt"]), tmp_path)
    assert len(recording.samples["gyroscope"]) == LOG.t.size


def test_of_a_zip_with_several_folders_the_folders_are_named_and_not_where_it_was_unpacked(tmp_path):
    raw = archive(tmp_path / "log.zip", ["run1/gyro.csv", "run2/gyro.csv"])
    with pytest.raises(InputError) as caught:
        imported(raw, tmp_path)
    assert "folders in it (run1, run2): import one of them, unpacked" in str(caught.value)
    assert str(raw) in str(caught.value)
    assert "discsim-" not in str(caught.value)


REFUSED = {
    "lines.jsonl": ('{"t": 0.0, "gx": 1.0}\n{"t": 0.1, "gx": 1.0}\n', "is JSON; write it as CSV"),
    "registers.txt": (
        "FFF6 0008 0808 0000 0000 FFFF\nFFFE 000E 0801 FFFD FFFF 0001\n" * 20,
        "its numbers are hexadecimal",
    ),
    "list.json": ('[{"sensor":"Gyroscope","x":"0.1"}]', "is JSON; write it as CSV"),
    "track.kml": ('<?xml version="1.0"?>\n<kml></kml>\n', "is XML"),
    "serial.txt": ("0 ms aX = 0.1 | aY = 0.2\n" * 9, "it begins '0 ms aX = 0.1 | aY = 0.2'"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_text_that_is_no_table_is_refused_with_what_to_do(tmp_path, name):
    content, sentence = REFUSED[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match="expected") as caught:
        sniff(tmp_path / name)
    assert sentence in str(caught.value)
