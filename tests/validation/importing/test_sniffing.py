"""A stranger's log comes in without a map: sensors, units, time and axes are found, whatever the text looks like."""

from __future__ import annotations

import random
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.log_shapes import (
    ALL,
    SHAPES,
    TOLERANCE,
    XYZ,
    brackets_and_milliseconds,
    degrees_written_as_radians,
    german_phyphox,
    named,
    plain_names,
    two_sensors_of_a_kind,
)
from support.made_logs import DEG, LANDING, RELEASE, SPIN, Log, made_log, three, write_table
from support.places import REAL, real

from discsim.errors import InputError
from discsim.recording import read_dataset, read_recording
from discsim.validation.cli import main
from discsim.validation.importing import find_map, import_recording, read_map, read_readings
from discsim.validation.importing.sniffing import Proposal, map_text, opened, recognised, sniff, stretches
from discsim.validation.importing.sniffing.axes import letters
from discsim.validation.importing.sniffing.raw_page import envelope


def proposed(raw: Path, place: Path) -> Proposal:
    proposal = sniff(raw)
    (place / "map.toml").write_text(map_text(proposal), encoding="utf-8")
    return proposal


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.__name__)
def test_sensors_units_time_and_axes_are_found(tmp_path, shape):
    log = made_log()
    with opened(shape(tmp_path, log)) as raw:
        proposed(raw, tmp_path)
        recording = import_recording(raw, read_map(tmp_path / "map.toml")).recording
    assert set(recording.samples) == set(SHAPES[shape])
    for sensor, truth in zip(ALL, (log.gyro, log.accel, log.mag), strict=True):
        if sensor in recording.samples:
            samples = recording.samples[sensor]
            sound = np.isfinite(samples.value).all(axis=1)
            assert sound.sum() > 0.04 * log.t.size
            expected = np.column_stack([np.interp(samples.t, log.t, truth[:, k]) for k in range(3)])
            # stamps are rounded to a millisecond at worst, and a reading goes with the nearest row
            assert_allclose(samples.t[sound][[0, -1]], log.t[[0, -1]], atol=0.11)
            assert_allclose(samples.value[sound], expected[sound], atol=TOLERANCE[sensor] + 0.003 * np.abs(truth).max())


# ------------------------------------------------------------------------------------------------- the map


def test_the_written_map_states_every_decision_with_its_reason_and_reads_to_the_same(tmp_path):
    log = made_log()
    raw = brackets_and_milliseconds(tmp_path, log)
    proposal = proposed(raw, tmp_path)
    text = (tmp_path / "map.toml").read_text(encoding="utf-8")
    for decision in proposal.all_decisions:
        assert f"{decision.sure}: {decision.why}" in text
    assert {decision.what for decision in proposal.all_decisions} >= {
        "time",
        *ALL,
        *(f"{sensor} unit" for sensor in ALL),
    }
    assert {decision.sure for decision in proposal.all_decisions} <= {"certain", "likely", "guess"}
    assert 'axes = ["x", "-y", "-z"]' in text


def test_a_name_with_quotes_brackets_and_signs_of_other_tongues_survives_the_map(tmp_path):
    log = made_log()
    odd = [f'gyro "{axis}" \\ é (deg/s)'.replace('"', "") for axis in XYZ]
    write_table(tmp_path / "in" / "lo[g] #1.csv", [("time_s", log.t), *three(odd, log.gyro / DEG)])
    proposed(tmp_path / "in", tmp_path)
    recording = import_recording(tmp_path / "in", read_map(tmp_path / "map.toml")).recording
    assert_allclose(recording.samples["gyroscope"].value, log.gyro, atol=1e-6)


def test_a_log_without_stamps_takes_its_step_from_the_field_that_turns_with_the_gyroscope(tmp_path):
    log = made_log()
    columns = [("idx", np.arange(log.t.size)), *three(named("gyro {} (dps)"), log.gyro / DEG)]
    raw = write_table(tmp_path / "log.csv", [*columns, *three(named("mag {} (uT)"), log.mag)])
    proposal = sniff(raw)
    assert proposal.clock.step == pytest.approx(1 / 200, rel=0.02)
    assert proposal.clock.decision.sure == "likely"
    alone = sniff(write_table(tmp_path / "alone.csv", columns))
    assert (alone.clock.step, alone.clock.decision.sure) == (0.01, "guess")


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("timestamp", lambda t: f"2025-06-01 12:00:{int(t):02d}"),
        ("Time", lambda t: f"23:59:{int(t):02d}"),
        ("time", lambda t: str(1_714_557_600 + int(t))),
        ("time_s", lambda t: str(int(t))),
    ],
)
def test_stamps_of_whole_seconds_count_the_rows(tmp_path, name, shown):
    """197 rows a second, with a pause of half a second in which none was written; the first second is cut off."""
    log = made_log()
    time = 0.3 + np.arange(log.t.size) / 197.0
    time[1200:] += 0.5
    columns = [(name, [shown(t) for t in time]), *three(named("gyro_{}_dps"), log.gyro / DEG)]
    columns += [*three(named("acc_{}_g"), log.accel / 9.80665), *three(named("mag_{}_uT"), log.mag)]
    clock = sniff(write_table(tmp_path / "log.csv", columns)).clock
    assert clock.column is None
    assert clock.step == pytest.approx(1 / 197, rel=0.002)
    assert clock.step == pytest.approx(1 / 197, rel=3 * clock.off)
    assert clock.off < 0.002
    assert clock.decision.sure == "likely"
    assert f"'{name}' stands still over many rows, and counts 197" in clock.decision.why


def test_stamps_that_change_once_count_no_rows(tmp_path):
    log = made_log()
    columns = [
        ("time", [f"2025-06-01 12:0{int(t > 5)}" for t in log.t]),
        *three(named("acc_{}_g"), log.accel / 9.80665),
    ]
    decision = sniff(write_table(tmp_path / "log.csv", columns)).clock.decision
    assert decision.sure == "guess"
    assert "'time' tells no time here (its first cell is '2025-06-01 12:00')" in decision.why


def test_what_a_header_says_wrong_is_seen_and_said(tmp_path):
    proposal = sniff(degrees_written_as_radians(tmp_path, made_log()))
    (unit,) = [decision for decision in proposal.all_decisions if decision.what == "gyroscope unit"]
    assert (unit.choice, unit.sure) == ("deg/s", "likely")
    assert "although the header says rad/s" in unit.why


@pytest.mark.parametrize(
    ("size", "unit", "why"),
    [
        (0.78, "gauss", "is the earth's field with iron near the sensor in gauss, although the header says uT"),
        (780.0, "mgauss", "is the earth's field with iron near the sensor in mgauss, although the header says uT"),
        (78.0, "uT", "the header says so; 78 uT"),
        (1e-5, "uT", "is not the earth's field, nor is it in another unit"),
    ],
)
def test_a_field_with_iron_that_no_header_s_unit_explains_is_not_believed(tmp_path, size, unit, why):
    field = made_log().mag
    field = field * size / np.median(np.linalg.norm(field, axis=1))
    columns = [("time_s", made_log().t), *three(named("mag_{}_uT"), field)]
    proposal = sniff(write_table(tmp_path / "log.csv", columns, digits=9))
    (found,) = [decision for decision in proposal.all_decisions if decision.what == "magnetometer unit"]
    assert found.choice == unit
    assert why in found.why
    assert ("the earth's field with iron" in found.why) is (size > 0.1)


def test_a_second_imu_and_an_acceleration_without_gravity_are_named_and_left_out(tmp_path):
    notes = sniff(two_sensors_of_a_kind(tmp_path, made_log())).notes
    assert any("imu2_acc_x" in note and "a second one" in note for note in notes)
    assert any("linear_acc_x" in note and "without gravity" in note for note in notes)


@pytest.mark.parametrize(
    ("gyro", "mag", "said"),
    [
        ((1, 1, 1), np.eye(3), False),
        ((1, 1, -1), np.eye(3), True),
        ((1, 1, 1), np.diag([1, 1, -1]), True),
        ((1, 1, 1), np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]]), False),  # AK8963 in an MPU-9250: a rotation
    ],
)
def test_a_magnetometer_that_mirrors_the_gyroscope_is_said_aloud(tmp_path, gyro, mag, said):
    log = made_log()
    columns = [("time_s", log.t), *three(named("gyro_{}_dps"), log.gyro / DEG * np.array(gyro))]
    columns += [*three(named("acc_{}_g"), log.accel / 9.80665), *three(named("mag_{}_uT"), log.mag @ mag)]
    notes = sniff(write_table(tmp_path / "log.csv", columns)).notes
    assert any("mirror images" in note and "the sign of the spin" in note for note in notes) is said


@pytest.mark.parametrize("clips", [False, True])
@pytest.mark.parametrize("odd", ALL)
def test_a_sensor_whose_axes_are_swapped_is_told_by_the_two_others(tmp_path, odd, clips):
    """Two columns of the header in the wrong order: the spin axis of one sensor is not that of the others."""
    log = made_log()
    gyro = np.clip(log.gyro, -17.5, 17.5) if clips else log.gyro
    arm = np.stack([0.015 * log.gyro[:, 2] ** 2, 0 * log.t, 0 * log.t], axis=1)  # 31 mm off the axis in all
    accel = log.accel + arm
    shown = {"gyroscope": gyro / DEG, "accelerometer": accel / 9.80665, "magnetometer": log.mag}
    shown[odd] = shown[odd][:, [2, 1, 0]]
    names = {"gyroscope": "gyro_{}_dps", "accelerometer": "acc_{}_g", "magnetometer": "mag_{}_uT"}
    columns = [("time_s", log.t)]
    for sensor, value in shown.items():
        columns += three(named(names[sensor]), value)
    raw = write_table(tmp_path / "log.csv", columns)
    proposal = proposed(raw, tmp_path)
    # of the magnetometer the field shows step by step how it lies, without a guess
    guessed = any(f"the {odd}'s x and z are taken as swapped" in note for note in proposal.notes)
    assert guessed is (odd != "magnetometer")
    recording = import_recording(raw, read_map(tmp_path / "map.toml")).recording
    spinning = (log.t > RELEASE + 0.2) & (log.t < LANDING - 0.2)
    for sensor, truth in zip(ALL, (gyro, accel, log.mag), strict=True):
        samples = recording.samples[sensor]
        there = np.interp(samples.t, log.t, spinning.astype(float)) == 1
        expected = np.interp(samples.t[there], log.t, truth[:, 2])
        assert_allclose(samples.value[there, 2], expected, atol=0.2 + TOLERANCE[sensor], err_msg=sensor)


@pytest.mark.parametrize(
    ("gyro", "mag", "axes", "said"),
    [
        ((1, 1, 1), (1, 1, 1), "x y z", False),
        ((1, 1, -1), (1, 1, 1), "x y z", True),
        ((1, 1, 1), (-1, 1, 1), "x y z", True),
        ((1, 1, 1), (1, -1, -1), "x -y -z", False),
    ],
)
def test_a_clipping_gyroscope_still_tells_which_way_the_field_goes_round(tmp_path, gyro, mag, axes, said):
    log = made_log()
    clipped = np.clip(log.gyro, -17.5, 17.5) / DEG * np.array(gyro)
    quiet = np.abs(log.gyro).max(axis=1) < 17.5
    clipped[quiet] = 0.0  # no turn is left by which the two could be compared one by one
    columns = [("time_s", log.t), *three(named("gyro_{}_dps"), clipped)]
    columns += [*three(named("acc_{}_g"), log.accel / 9.80665), *three(named("mag_{}_uT"), log.mag * np.array(mag))]
    proposal = proposed(write_table(tmp_path / "log.csv", columns), tmp_path)
    assert any("mirror images" in note for note in proposal.notes) is said
    (sensor,) = (one for one in proposal.sensors if one.sensor == "magnetometer")
    assert " ".join(letters(sensor.axes)) == axes


# --------------------------------------------------------------------------------------------------- throws


def test_the_throw_is_cut_inside_release_and_impact(tmp_path):
    raw = plain_names(tmp_path, made_log())
    proposed(raw, tmp_path)
    (throw,) = stretches(read_readings(raw, read_map(tmp_path / "map.toml")))
    assert RELEASE <= throw.start <= RELEASE + 0.1
    assert LANDING - 0.1 <= throw.end <= LANDING
    assert throw.first == round(200 * throw.start)
    assert throw.stop == round(200 * throw.end) + 1
    assert throw.spin == pytest.approx(SPIN * np.exp(-0.15 * 1.5), rel=0.01)


def test_the_throw_is_found_in_spite_of_lost_decimal_points_which_are_said_and_become_gaps(tmp_path):
    log = made_log()
    gyro = log.gyro.copy()
    gyro[50::97, 2] *= 100
    raw = plain_names(tmp_path, replace(log, gyro=gyro))
    proposed(raw, tmp_path)
    read = read_readings(raw, read_map(tmp_path / "map.toml"))
    (throw,) = stretches(read)
    assert RELEASE <= throw.start <= RELEASE + 0.1
    assert throw.end - throw.start == pytest.approx(LANDING - RELEASE, abs=0.2)
    slipped = np.count_nonzero(np.isnan(read.readings["gyroscope"].value[:, 2]))
    assert slipped > 3
    assert np.nanmax(np.abs(read.readings["gyroscope"].value)) < 250
    assert any(note.startswith("gyroscope z: readings beyond 250 rad/s") for note in read.notes)
    assert sum("glitch" in repair.action for repair in read.repairs) == slipped


def test_a_magnetometer_alone_finds_the_throw_too(tmp_path):
    log = made_log()
    raw = write_table(
        tmp_path / "log.csv", [("time_s", log.t), *three(named("mag_{}_uT"), log.mag + np.array([15.0, -9.0, 4.0]))]
    )
    proposed(raw, tmp_path)
    (throw,) = stretches(read_readings(raw, read_map(tmp_path / "map.toml")))
    assert RELEASE - 0.1 < throw.start < RELEASE + 0.5
    assert LANDING - 0.5 < throw.end < LANDING + 0.1
    middle = (throw.start + throw.end) / 2
    assert throw.spin == pytest.approx(SPIN * np.exp(-0.15 * (middle - RELEASE)), rel=0.02)


@pytest.mark.parametrize(("wander", "squeezed"), [(0.0, 1.0), (16.0, 1.0), (0.0, 0.6)])
def test_the_field_s_rate_is_that_of_its_turns_about_a_centre_that_wanders_or_on_an_ellipse(tmp_path, wander, squeezed):
    t = np.arange(0.0, 3.0, 0.0124)
    phase, slow = -55.0 * t, np.pi * t / 3.0
    field = np.column_stack([20.0 * np.cos(phase), squeezed * 20.0 * np.sin(phase), np.full(t.size, 45.0)])
    field += wander * np.column_stack([np.sin(slow), np.cos(slow), 0.0 * t])
    field += 0.3 * np.random.default_rng(7).standard_normal(field.shape)
    raw = write_table(tmp_path / "log.csv", [("time_s", t), *three(named("mag_{}_uT"), field)])
    proposed(raw, tmp_path)
    (throw,) = stretches(read_readings(raw, read_map(tmp_path / "map.toml")))
    assert throw.spin == pytest.approx(55.0, rel=0.01)


def test_a_swing_of_the_arm_and_a_rest_are_no_throws(tmp_path):
    log = made_log()
    before = log.t < RELEASE - 0.2
    raw = write_table(
        tmp_path / "log.csv", [("time_s", log.t[before]), *three(named("gyro_{}_rad_s"), log.gyro[before])]
    )
    proposed(raw, tmp_path)
    assert stretches(read_readings(raw, read_map(tmp_path / "map.toml"))) == []


# ----------------------------------------------------------------------------------------- the command and refusals


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> int:
    monkeypatch.setattr(sys, "argv", ["discsim", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in (".csv", ".toml")}


def test_the_proposed_map_gives_the_same_recording_again(monkeypatch, tmp_path, capsys):
    raw = german_phyphox(tmp_path, made_log())
    assert run(monkeypatch, "import", raw, "--out", tmp_path / "a") == 0
    said = capsys.readouterr()
    assert "gyroscope unit: rad/s (certain" in said.err
    assert "throw 1: 4.0" in said.out
    assert run(monkeypatch, "import", raw, "--map", tmp_path / "a" / "map.toml", "--out", tmp_path / "b") == 0
    first, second = files(tmp_path / "a"), files(tmp_path / "b")
    first.pop("map.toml")
    assert first == second


@pytest.mark.slow
def test_throws_are_taken_by_number_or_all(monkeypatch, tmp_path, capsys):
    log = made_log()
    twice = Log(
        np.concatenate([log.t, log.t + 10.0]), *(np.concatenate([v, v]) for v in (log.gyro, log.accel, log.mag))
    )
    raw = plain_names(tmp_path, twice)
    assert run(monkeypatch, "import", raw, "--throw", "2", "--out", tmp_path / "one") == 0
    one = read_recording(tmp_path / "one")
    assert one.samples["gyroscope"].t[0] == 0
    assert 2.8 < one.end < 3.0
    assert (
        run(
            monkeypatch, "import", raw, "--all-throws", "--write-map", tmp_path / "mine.toml", "--out", tmp_path / "all"
        )
        == 0
    )
    both = read_dataset(tmp_path / "all")
    assert [recording.path.name for recording in both] == ["01", "02"]
    assert_allclose(both[1].samples["gyroscope"].value, one.samples["gyroscope"].value)
    assert read_map(tmp_path / "mine.toml").plant == "free_spin"
    assert run(monkeypatch, "import", raw, "--throw", "3", "--out", tmp_path / "no") == 2
    assert "--throw 3: log.csv has 2 throws; expected 1 to 2" in capsys.readouterr().err
    assert run(monkeypatch, "import", raw, "--throw", "1", "--rows", "1:9", "--out", tmp_path / "no") == 2


def test_the_page_of_a_long_log_stays_small_and_holds_all_of_it(monkeypatch, tmp_path):
    log = made_log()
    raw = plain_names(tmp_path, Log(*(v[:1800] for v in (log.t, log.gyro, log.accel, log.mag))))
    assert run(monkeypatch, "import", raw, "--out", tmp_path / "out") == 0
    page = (tmp_path / "out" / "raw.html").read_text(encoding="utf-8")
    assert "All traces" in page
    assert "How the columns were understood" in page
    assert "Throw 1:" in page
    assert "http" not in page.replace("http://www.w3.org", "")
    t = np.arange(3_600_000) / 1000
    value = np.sin(t)
    value[1_234_567] = 99.0
    shown_t, shown = envelope(t, value)
    assert shown.size <= 2 * 1650
    assert shown.max() == 99.0
    assert abs(shown_t[np.argmax(shown)] - 1234.567) < 3600 / 1650


def test_a_shipped_map_that_was_made_for_the_logger_is_taken_and_said(monkeypatch, tmp_path, capsys):
    log = made_log()
    columns = [("time_s", log.t), *three(["x_rad_s", "y_rad_s", "z_rad_s"], log.gyro)]
    raw = write_table(tmp_path / "in" / "gyroscope.csv", columns)
    assert run(monkeypatch, "import", raw.parent, "--out", tmp_path / "out") == 0
    assert "taken: the shipped map 'csv', made for these columns" in capsys.readouterr().err
    assert not (tmp_path / "out" / "map.toml").exists()
    assert run(monkeypatch, "import", raw.parent, "--map", "sniff", "--out", tmp_path / "out2") == 0
    assert_allclose(read_recording(tmp_path / "out2").samples["gyroscope"].value, log.gyro, atol=1e-6)


def test_columns_like_a_shipped_maps_do_not_bring_its_place_in(tmp_path):
    log = made_log()
    path = write_table(tmp_path / "log.csv", [("time", log.t), *three(["mag_x", "mag_y", "mag_z"], log.mag)])
    assert recognised(path) is None
    names = [*named("gyr_{}_rad_s"), *named("acc_{}_m_s2"), *named("mag_{}_uT")]
    values = np.column_stack([log.gyro, log.accel, log.mag])
    path = write_table(tmp_path / "berlin.csv", [("t_s", log.t), *[(n, values[:, k]) for k, n in enumerate(names)]])
    assert recognised(path) is None


FINANCE = "Date,Open,High,Low,Close,Volume\n" + "".join(
    f"2025-01-{day:02d},{100 + day}.5,{101 + day}.2,{99 + day}.1,{100 + day}.9,{10000 * day}\n" for day in range(1, 29)
)
REFUSED = {
    "letter.txt": (
        b"Dear reader,\n\nthis is a letter, and no log.\nIt has, by chance, commas.\n",
        "no rows of numbers",
    ),
    "picture.csv": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 4, "is a PNG image"),
    "empty.csv": (b"", "the file is empty"),
    "blank.csv": (b"\n \n\n", "the file is empty"),
    "finance.csv": (FINANCE.encode(), "no sensor of motion found in the columns 'Date', 'Open'"),
    "prices.csv": (FINANCE.partition("\n")[2].encode(), "no sensor of motion found in the columns 'c1'"),
    "header.csv": (b"time,ax,ay,az\n", "no rows of numbers"),
    "short.csv": (b"t_s,gx_dps,gy_dps,gz_dps\n0,1,2,3\n0.1,1,2,4\n", "2 rows of numbers in it"),
    "binary.bin": (bytes(range(256)) * 40, "is binary, no text"),
    "book.xlsx": (b"PK\x03\x04" + bytes(100), "export it as CSV"),
    "rpm.csv": (
        b"ms,rpm\n" + b"".join(b"%d,%d\n" % (10 * k, 600 - k) for k in range(50)),
        "'rpm' is a rate about one axis: a map takes it in [sensors.rate_reference], columns = [\"rpm\"], unit = ",
    ),
    "throws.csv": (
        b"Throw,Speed (mph),Spin (rpm),Nose Angle (deg),Launch Angle (deg)\n"
        + b"".join(b"%d,60.%d,11%02d,1.1,9.2\n" % (k, k % 10, k) for k in range(24)),
        "each row tells a whole throw ('Nose Angle (deg)', 'Launch Angle (deg)'), and a recording is readings over",
    ),
    "broken.zip": (b"PK\x03\x04" + bytes(100), "cannot be unpacked"),
    "pointer.csv": (
        b"version https://git-lfs.github.com/spec/v1\noid sha256:5450\nsize 87365\n",
        "is a pointer of Git LFS, which stands in the place of the file; expected the file itself",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_log_is_refused_in_one_sentence(monkeypatch, tmp_path, capsys, name):
    content, sentence = REFUSED[name]
    (tmp_path / name).write_bytes(content)
    assert run(monkeypatch, "import", tmp_path / name, "--out", tmp_path / "out") == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out" / "recording.toml").exists()


def test_a_folder_without_a_table_says_why_its_first_file_is_none(monkeypatch, tmp_path, capsys):
    (tmp_path / "raw").mkdir()
    (tmp_path / "raw" / "README.md").write_text("A log of a disc.\n")
    (tmp_path / "raw" / "imu.csv").write_bytes(REFUSED["pointer.csv"][0])
    assert run(monkeypatch, "import", tmp_path / "raw", "--out", tmp_path / "out") == 2
    assert "there (README.md, imu.csv); expected a logger's export (imu.csv: is a pointer" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("member", "sentence"),
    [("../out.csv", "leads out of it"), ("/etc/out.csv", "leads out of it"), ("C:\\out.csv", "leads out of it")],
)
def test_a_path_out_of_the_archive_is_refused(tmp_path, member, sentence):
    with zipfile.ZipFile(tmp_path / "bad.zip", "w") as archive:
        archive.writestr(member, "t,x\n1,2\n")
    with pytest.raises(InputError, match=sentence), opened(tmp_path / "bad.zip"):
        pass
    assert not (tmp_path.parent / "out.csv").exists()


@pytest.mark.parametrize("packed", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_damaged_archive_is_read_or_refused_in_one_sentence(tmp_path, packed):
    """Whatever library unpacks it, and wherever the damage lies: in what is packed, or in what is said of it."""
    raw, rng = tmp_path / "log.zip", random.Random(packed)
    with zipfile.ZipFile(raw, "w", packed) as archive:
        for name in ("run/gyro.csv", "run/mag.csv"):
            archive.writestr(name, "t,x,y,z\n" + "".join(f"{k / 50},{k % 7},{k % 5},0\n" for k in range(200)))
    sound, said = raw.read_bytes(), []
    for _ in range(200):
        damaged = bytearray(sound)
        for _ in range(rng.choice((1, 4))):
            damaged[rng.randrange(len(sound))] = rng.randrange(256)
        raw.write_bytes(damaged)
        try:
            with opened(raw):
                pass
        except InputError as error:
            said.append(str(error))
    assert len(said) > 50
    assert all(text.isprintable() and "expected" in text for text in said)


def test_a_link_in_an_archive_is_refused(tmp_path):
    link = zipfile.ZipInfo("log.csv")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(tmp_path / "bad.zip", "w") as archive:
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(InputError, match="is a link"), opened(tmp_path / "bad.zip"):
        pass


def test_a_zip_bomb_is_refused_before_it_fills_the_disk(tmp_path):
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("zeros.csv", bytes(1 << 25))
    with (
        pytest.raises(InputError, match="unpacks to more than 4 GB and 1000 times its size"),
        opened(tmp_path / "bomb.zip"),
    ):
        pass
    with zipfile.ZipFile(tmp_path / "many.zip", "w") as archive:
        for k in range(1001):
            archive.writestr(f"{k}.csv", "")
    with pytest.raises(InputError, match="holds 1001 files"), opened(tmp_path / "many.zip"):
        pass


# ------------------------------------------------------------------------------------- measured logs, no shipped map


@real
@pytest.mark.parametrize(
    ("name", "first", "stop"),
    [("001-rb", 1590, 1830), ("003-rf", 860, 1125), ("004-rf", 680, 908), ("005-rh", 735, 988)],
)
def test_the_flights_of_a_measured_disc_are_found_where_they_are_known_to_be(tmp_path, name, first, stop):
    raw = REAL / "flatball-ins-ultimate-disc" / f"2025-08-31-{name}.csv"
    proposal = proposed(raw, tmp_path)
    (throw,) = stretches(read_readings(raw, read_map(tmp_path / "map.toml")))
    # a tenth of a second: the rule's own width, and what an eye is good for
    assert abs(throw.first - first) < 10
    assert abs(throw.stop - stop) < 10
    shipped, own = read_map(find_map("flatball")), read_map(tmp_path / "map.toml")
    for sensor in ALL:
        assert own.sensors[sensor].factor == shipped.sensors[sensor].factor
        assert set(own.sensors[sensor].columns) & set(shipped.sensors[sensor].columns)
    if name != "005-rh":  # a hammer flies upside down, and nothing in it shows which side is the top
        assert all(own.sensors[sensor].axes == shipped.sensors[sensor].axes for sensor in ALL)
    assert 0.0115 < proposal.clock.step < 0.0140  # what the shipped map's comments found: 12.2 and 13.3 ms a row


@real
def test_a_rocket_without_header_or_units_is_understood_as_its_shipped_map_does(tmp_path):
    raw = REAL / "srp-sa-rocket"
    proposed(raw, tmp_path)
    shipped, own = read_map(find_map("srp")), read_map(tmp_path / "map.toml")
    for sensor in ALL:
        assert own.sensors[sensor].factor == pytest.approx(shipped.sensors[sensor].factor, rel=0.001)
        assert own.sensors[sensor].axes == shipped.sensors[sensor].axes
    assert recognised(raw).name == "srp"


@real
@pytest.mark.parametrize(
    ("raw", "name"),
    [
        ("flatball-ins-ultimate-disc/2025-08-31-003-rf.csv", "flatball"),
        ("cats-euroc21-aris-euler-rocket", "cats"),
        ("cats-euroc21-skyward-lynx-rocket", "lynx"),
        ("broad-mocap-rotation/07_undisturbed_fast_rotation_B_30s.csv", "broad"),
        ("ubsuny-phyphox-roller/z_acc.csv", None),
    ],
)
def test_measured_logs_are_recognised_by_the_maps_that_were_made_for_them(raw, name):
    found = recognised(REAL / raw)
    assert (None if found is None else found.name) == name
