"""Raw logger files become recordings: units, axes, time, and every damaged line is listed or refused."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import made_log, three, write_table
from support.places import ROOT

from discsim.errors import InputError
from discsim.files import model_names
from discsim.recording import read_recording, write_recording
from discsim.validation.commands.import_ import command
from discsim.validation.importing import Imported, find_map, import_recording, parse_rows, read_map, repairs_csv
from discsim.validation.importing.imported_log import import_log

G0 = 9.80665
DEG = np.pi / 180

PLAIN = """\
name = "plain"
plant = "free_spin"
repairs = ["header", "comment", "width", "number", "time", "counter"]
[layout]
comment = "#"
[time]
step_s = 0.01
counter = "idx"
[environment]
gravity_m_s2 = 9.8
magnetic_field_ned_uT = [20.0, 0.0, 40.0]
[sensors.gyroscope]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
rate_hz = 100.0
"""


#: what an import says of a file without time stamps
NO_STAMPS = ("no time column: rows are taken as 0.01 s apart; whether they came late or were lost cannot be told",)


def run(tmp_path: Path, raw: str | bytes, map_text: str = PLAIN, rows: str | None = None) -> Imported:
    (tmp_path / "raw.csv").write_bytes(raw.encode() if isinstance(raw, str) else raw)
    (tmp_path / "own.toml").write_text(map_text)
    chosen = None if rows is None else parse_rows(rows)
    return import_recording(tmp_path / "raw.csv", read_map(tmp_path / "own.toml"), chosen)


def shipped(raw: Path, name: str, rows: str | None = None) -> Imported:
    return import_recording(raw, read_map(find_map(name)), None if rows is None else parse_rows(rows))


def lines_and_actions(result: Imported) -> list[tuple[int, str]]:
    return [(repair.line, repair.action) for repair in result.repairs]


# ------------------------------------------------------------------------------------------ damaged lines


def test_a_clean_file_gives_its_rows_and_an_empty_list_of_repairs(tmp_path):
    result = run(tmp_path, "idx,gx,gy,gz\n0,1,2,180\n1,1,2,90\n2,1,2,45\n")
    gyro = result.recording.samples["gyroscope"]
    assert_allclose(gyro.t, [0, 0.01, 0.02], atol=1e-12)
    assert_allclose(gyro.value[:, 2], np.array([180, 90, 45]) * DEG, rtol=1e-15)
    assert repairs_csv(result.repairs) == "file,line,what,action\n"
    assert result.summary == "repairs: none"


def test_a_header_with_a_stale_record_glued_to_it_is_joined_with_its_rest(tmp_path):
    raw = "idx,gx,gy2428,4.05,-0.05,31.7\n,gz,flag\n0,1,2,3,48\n1,4,5,6,48\n"
    result = run(tmp_path, raw)
    assert_allclose(result.recording.samples["gyroscope"].value, np.array([[1, 2, 3], [4, 5, 6]]) * DEG)
    assert [repair.line for repair in result.repairs] == [1]
    assert "stale record (2428" in result.repairs[0].what


def test_a_header_that_does_not_fit_its_rows_when_joined_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"raw.csv:1: broken header: .* 5 names, the next row 4 cells"):
        run(tmp_path, "idx,gx,gy2428,4.05\n,gz,flag\n0,1,2,3\n")


def test_rows_of_another_width_are_left_out_and_keep_their_number_and_time(tmp_path):
    map_text = PLAIN.replace('counter = "idx"\n', "")
    result = run(tmp_path, "idx,gx,gy,gz\n0,1,1,1\n1,2,2\n2,3,3,,3\n3,4,4,4\n", map_text)
    assert lines_and_actions(result) == [(3, "row left out"), (4, "row left out")]
    assert "data row 2 has 5 cells, expected 4" in result.repairs[1].what
    assert_allclose(result.recording.samples["gyroscope"].t, [0, 0.03], atol=1e-12)
    only_last = run(tmp_path, (tmp_path / "raw.csv").read_bytes(), map_text, rows="3:4")
    assert_allclose(only_last.recording.samples["gyroscope"].value, [[4 * DEG] * 3])


def test_a_counter_that_jumps_leaves_a_gap_in_time_and_a_doubled_one_loses_the_second_row(tmp_path):
    result = run(tmp_path, "idx,gx,gy,gz\n5,1,1,1\n6,2,2,2\n9,3,3,3\n9,4,4,4\n10,5,5,5\n")
    gyro = result.recording.samples["gyroscope"]
    assert_allclose(gyro.t, [0, 0.01, 0.04, 0.05], atol=1e-12)
    assert_allclose(gyro.value[:, 0] / DEG, [1, 2, 3, 5])
    assert [(r.line, r.what) for r in result.repairs] == [
        (4, "'idx' jumps from 6 to 9"),
        (5, "time 0.09 s is doubled"),
    ]


def test_one_wild_time_stamp_costs_one_row_and_not_all_that_follow(tmp_path):
    rows = [(0.0, 1), (0.1, 2), (900.0, 3), (0.3, 4), (0.2, 5), (0.4, 6), (0.5, 7)]
    raw = "time,gx,gy,gz\n" + "".join(f"{t},{v},0,0\n" for t, v in rows)
    result = run(tmp_path, raw, PLAIN.replace('step_s = 0.01\ncounter = "idx"', 'column = "time"'))
    kept = result.recording.samples["gyroscope"].value[:, 0] / DEG
    assert len(kept) == 5
    assert 3 not in np.round(kept)
    assert {line for line, _ in lines_and_actions(result)} <= {4, 5, 6}
    assert len(result.repairs) == 2


def test_a_cell_that_is_no_number_costs_the_row_and_an_empty_one_is_a_gap(tmp_path):
    raw = b"idx,gx,gy,gz\n0,1,1,1\n1,2,ERR,2\n2,3,,3\n3,4,\xff\xfe,4\n4,1e999,5,5\n5,1_0,6,6\n6,7,nan,7\n7,8,8,8\n"
    result = run(tmp_path, raw)
    gyro = result.recording.samples["gyroscope"]
    assert_allclose(gyro.value[:, 0] / DEG, [1, 3, 7, 8])
    assert np.isnan(gyro.value[:, 1]).tolist() == [False, True, True, False]
    dropped = "row left out of gyroscope"
    assert lines_and_actions(result) == [(3, dropped), (4, "gap"), (5, dropped), (6, dropped), (7, dropped), (8, "gap")]


def test_comments_alone_or_glued_are_left_out_and_a_record_glued_to_one_is_named(tmp_path):
    raw = "# began\nidx,gx,gy,gz\n0,1,1,1# autosave took 0.03\n# autosave\n1,2,2,2\n# took 0.0168,3,3,3\n3,4,4,4\n"
    result = run(tmp_path, raw)
    assert_allclose(result.recording.samples["gyroscope"].value[:, 0] / DEG, [1, 2, 4])
    assert [(r.line, r.action) for r in result.repairs] == [
        (1, "comment left out"),
        (3, "comment left out"),
        (4, "comment left out"),
        (6, "both left out"),
        (7, "1 missing; time keeps their place"),
    ]


def test_a_comment_with_commas_has_no_record_glued_to_it(tmp_path):
    raw = "# Team A, spring 2025, 3\nidx,gx,gy,gz\n0,1,1,1\n# battery 3.7 V, 21 C, ok, yes\n1,2,2,2\n# x, 4\n2,3,3,3\n"
    result = run(tmp_path, raw)
    assert [(r.line, r.what, r.action) for r in result.repairs] == [
        (1, "comment: # Team A, spring 2025, 3", "comment left out"),
        (4, "comment: # battery 3.7 V, 21 C, ok, yes", "comment left out"),
        (6, "comment: # x, 4", "comment left out"),
    ]


def test_a_byte_order_mark_and_blank_lines_are_listed_and_crlf_is_not(tmp_path):
    result = run(tmp_path, b"\xef\xbb\xbfidx,gx,gy,gz\r\n0,1,1,1\r\n\r\n1,2,2,2\r\n")
    assert len(result.recording.samples["gyroscope"]) == 2
    assert lines_and_actions(result) == [(1, "mark left out"), (3, "line left out")]


def test_a_damage_that_the_map_does_not_allow_to_repair_is_refused_with_its_line(tmp_path):
    strict = PLAIN.replace('"header", "comment", "width", ', "")
    with pytest.raises(InputError, match=r"raw.csv:3: data row 1 has 3 cells, expected 4; .*'width'"):
        run(tmp_path, "idx,gx,gy,gz\n0,1,1,1\n1,2,2\n2,3,3,3\n", strict)


def test_more_than_a_twentieth_of_the_rows_lost_is_a_warning_and_all_of_them_an_error(tmp_path):
    rows = [f"{k},{k},{2 * k},{3 * k}" for k in range(40)]
    rows[3] = rows[7] = "x"
    assert run(tmp_path, "idx,gx,gy,gz\n" + "\n".join(rows)).notes == NO_STAMPS  # 2 of 40 are 5 %
    rows[9] = "x"
    note, *_ = run(tmp_path, "idx,gx,gy,gz\n" + "\n".join(rows)).notes
    assert note.startswith("WARNING: 3 of the gyroscope's 40 rows")
    with pytest.raises(InputError, match="no usable row of the gyroscope"):
        run(tmp_path, "idx,gx,gy,gz\n0,a,0,0\n1,b,0,0\n")
    with pytest.raises(InputError, match="no usable row; expected rows of 4 cells"):
        run(tmp_path, "idx,gx,gy,gz\n0,1\n")
    with pytest.raises(InputError, match="the file is empty"):
        run(tmp_path, "")


# ------------------------------------------------------------------------------- rows, columns, units, axes


@pytest.mark.parametrize(
    ("rows", "first", "count"), [("1:3", 1, 2), (":2", 0, 2), ("2:", 2, 2), ("-3:-1", 1, 2), (":", 0, 4)]
)
def test_rows_are_a_python_slice_and_time_starts_at_the_first(tmp_path, rows, first, count):
    result = run(tmp_path, "idx,gx,gy,gz\n0,0,0,0\n1,1,0,0\n2,2,0,0\n3,3,0,0\n", rows=rows)
    gyro = result.recording.samples["gyroscope"]
    assert_allclose(gyro.value[:, 0] / DEG, np.arange(first, first + count))
    assert_allclose(gyro.t, 0.01 * np.arange(count), atol=1e-12)


@pytest.mark.parametrize("rows", ["2:9", "3:3", "3:1", "-9:2", "4:", "1", "a:b", "1:2:3"])
def test_rows_out_of_range_or_unreadable_are_an_error(tmp_path, rows):
    with pytest.raises(InputError, match=r"--rows .*expected"):
        run(tmp_path, "idx,gx,gy,gz\n0,0,0,0\n1,1,0,0\n2,2,0,0\n3,3,0,0\n", rows=rows)


def test_a_missing_column_is_named_with_the_line_and_the_columns_there(tmp_path):
    with pytest.raises(InputError, match=r"raw.csv:1: no column 'gz'; the columns there are 'idx', 'gx', 'gy', 'g z'"):
        run(tmp_path, "idx,gx,gy,g z\n0,1,1,1\n")


TWO_FILES = """\
name = "two"
plant = "free_spin"
[time]
column = "t"
unit = "ms"
[environment]
gravity_m_s2 = 9.8
latitude_deg = 39.2115
longitude_deg = -8.0575
date = 2021-10-15
[sensors.magnetometer]
file = "mag*.csv"
columns = ["mx", "my", "mz"]
unit = "gauss"
scale = 0.001
axes = ["-z", "x", "y"]
mirrored = true
[sensors.gyroscope]
file = "imu.csv"
where = { id = "B" }
columns = [["wx", "wy", "wz"], ["p", "q", "r"]]
unit = "rpm"
axes = ["z", "x", "y"]
"""


def two_files(folder: Path) -> Path:
    folder.mkdir()
    (folder / "mag1.csv").write_text("t,mx,my,mz\n" + "".join(f"{100 + 10 * k},1,2,{k}\n" for k in range(10)))
    (folder / "imu.csv").write_text(
        "t,id,p,q,r\n" + "".join(f"{98 + 5 * k},{'AB'[k % 2]},{k},60,0\n" for k in range(24))
    )
    return folder


def test_sensors_of_several_files_share_one_clock_and_are_cut_to_the_rows_of_the_first(tmp_path):
    (tmp_path / "own.toml").write_text(TWO_FILES)
    own = read_map(tmp_path / "own.toml")
    raw = two_files(tmp_path / "raw")
    whole = import_recording(raw, own).recording
    assert_allclose(whole.samples["magnetometer"].t, 0.01 * np.arange(10), atol=1e-9)
    # the gyroscope's rows are those of id B: 103, 113, ... ms
    assert_allclose(whole.samples["gyroscope"].t, 0.003 + 0.01 * np.arange(12), atol=1e-9)
    cut = import_recording(raw, own, parse_rows("2:5")).recording
    assert_allclose(cut.samples["magnetometer"].t, [0, 0.01, 0.02], atol=1e-9)  # 120, 130, 140 ms
    assert_allclose(cut.samples["gyroscope"].t, [0.003, 0.013], atol=1e-9)  # 123, 133 ms
    assert_allclose(cut.samples["gyroscope"].value[0], np.array([0, 5, 60]) * 2 * np.pi / 60)
    # 0.001 gauss is 0.1 uT; body x, y, z are -z, x, y of the sensor
    assert_allclose(cut.samples["magnetometer"].value[0], [-0.2, 0.1, 0.2])


def test_a_rate_that_the_map_does_not_state_comes_from_the_time_stamps(tmp_path):
    (tmp_path / "own.toml").write_text(TWO_FILES)
    recording = import_recording(two_files(tmp_path / "raw"), read_map(tmp_path / "own.toml")).recording
    assert recording.sheets["magnetometer"].rate_hz == pytest.approx(100.0, rel=1e-3)


def test_a_place_and_a_day_give_the_field_of_the_world_model_with_its_uncertainty(tmp_path):
    (tmp_path / "own.toml").write_text(TWO_FILES)
    environment = read_map(tmp_path / "own.toml").environment
    # models/sites/ponte_de_sor.toml, to half a unit of its last digit
    assert_allclose(environment.magnetic_field, [26.38, -0.60, 35.47], atol=0.1)
    assert environment.sigma["magnetic_field_ned_uT"] == 0.15


def test_axes_that_mirror_a_sensor_must_be_said_to(tmp_path):
    (tmp_path / "own.toml").write_text(TWO_FILES.replace("mirrored = true\n", ""))
    with pytest.raises(InputError, match=r"own.toml:16: 'sensors.magnetometer.axes' mirror the sensor; .*mirrored"):
        read_map(tmp_path / "own.toml")


@pytest.mark.parametrize(
    ("wrong", "right", "message"),
    [
        ('unit = "deg/s"', 'unit = "degs"', r"'sensors.gyroscope.unit' is 'degs', expected one of rad/s, deg/s"),
        ('"gx", "gy", "gz"', '"gx", "gy"', "expected 3 names of columns"),
        ("step_s = 0.01\n", "", r"expected either 'column' .* or 'step_s'"),
        ('"header", ', '"hedder", ', "'repairs' holds 'hedder', expected header, comment"),
        ("[sensors.gyroscope]", "[sensors.gyro]", "unknown sensor 'gyro'; expected one of magnetometer"),
        ("rate_hz = 100.0", 'axes = ["x", "x", "z"]', "expected three of x, y, z, each once"),
        ("rate_hz = 100.0", "rat_hz = 100.0", "unknown key 'sensors.gyroscope.rat_hz'; did you mean 'rate_hz'"),
        ('"free_spin"', '"spin_down"', "expected flight, rate_table or free_spin"),
    ],
)
def test_a_wrong_map_is_refused_with_file_line_and_what_was_expected(tmp_path, wrong, right, message):
    assert wrong in PLAIN
    with pytest.raises(InputError, match=rf"own.toml:\d+: .*{message}"):
        run(tmp_path, "idx,gx,gy,gz\n0,1,1,1\n", PLAIN.replace(wrong, right))


def test_an_unknown_map_lists_the_shipped_ones():
    with pytest.raises(InputError, match=r"--map flatbal: .*broad, cats, .*flatball, lynx, phyphox, shotshaper, srp"):
        find_map("flatbal")


@pytest.mark.parametrize("name", model_names("imports"))
def test_every_shipped_map_reads(name):
    assert read_map(find_map(name)).name == name


def test_the_map_in_the_documentation_reads(tmp_path):
    text = (ROOT / "docs" / "importing.md").read_text()
    (tmp_path / "mine.toml").write_text(text.split("```toml\n")[1].split("```")[0])
    own = read_map(tmp_path / "mine.toml")
    assert own.disc is not None
    assert own.sensors["magnetometer"].axes == ((1, 1.0), (0, -1.0), (2, 1.0))


# ------------------------------------------------------------------------------------- plain CSV and phyphox


def test_plain_csv_reads_one_file_with_all_sensors_and_leaves_out_those_not_there(tmp_path):
    (tmp_path / "log.csv").write_text("time_s,x_uT,y_uT,z_uT,rate_rad_s\n5.0,1,2,3,60\n5.1,1,2,3,59\n5.2,1,2,3,58\n")
    result = shipped(tmp_path / "log.csv", "csv")
    assert list(result.recording.samples) == ["magnetometer", "rate_reference"]
    assert_allclose(result.recording.samples["rate_reference"].value, [60, 59, 58])
    assert_allclose(result.recording.samples["rate_reference"].t, [0, 0.1, 0.2], atol=1e-9)
    assert "no gyroscope in it" in result.notes
    assert any("magnetic field not known" in note for note in result.notes)


def test_plain_csv_reads_a_folder_with_one_file_per_sensor(tmp_path):
    (tmp_path / "magnetometer.csv").write_text("time_s,x_uT,y_uT,z_uT\n0,1,2,3\n1,4,5,6\n")
    (tmp_path / "gyroscope.csv").write_text("time_s,x_rad_s,y_rad_s,z_rad_s\n0.5,1,2,3\n1.5,4,5,6\n")
    recording = shipped(tmp_path, "csv").recording
    assert list(recording.samples) == ["magnetometer", "gyroscope"]
    assert_allclose(recording.samples["gyroscope"].t, [0.5, 1.5])


def test_a_file_with_none_of_the_sensors_is_an_error(tmp_path):
    (tmp_path / "log.csv").write_text("time_s,x_ut\n0,1\n")
    with pytest.raises(
        InputError, match=r"no sensor of the map 'csv' in it; expected 'x_uT'.*there are 'time_s', 'x_ut'"
    ):
        shipped(tmp_path / "log.csv", "csv")


def test_phyphox_with_quoted_header_and_no_last_line_end_keeps_its_numbers(tmp_path):
    header = '"Time (s)","Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)","Absolute (rad/s)"'
    (tmp_path / "log.csv").write_text(f"{header}\n0.0E0,1.5E0,0E0,2.0E1,2E1\n1.004E-2,1.5E0,0E0,-2.5E-1,2E1")
    gyro = shipped(tmp_path / "log.csv", "phyphox").recording.samples["gyroscope"]
    assert_allclose(gyro.t, [0, 0.01004], rtol=1e-12)
    assert_allclose(gyro.value[:, 2], [20.0, -0.25])


def test_semicolons_and_decimal_commas_read_as_numbers(tmp_path):
    layout = PLAIN.replace('comment = "#"', 'separator = ";"\ndecimal = ","')
    result = run(tmp_path, "idx;gx;gy;gz\n0;1,5;-2,5E1;0\n1;1;1;1\n", layout)
    assert_allclose(result.recording.samples["gyroscope"].value[0] / DEG, [1.5, -25, 0])


def test_lists_in_quoted_cells_are_spread_over_columns(tmp_path):
    (tmp_path / "a_gyro_b.csv").write_text('# began\n7,100.5,"[10, 20, -90.0]"\n8,100.6,"[10, 20, 45]"\n')
    (tmp_path / "a_mag_b.csv").write_text('7,100.5,"[6842, 0, -6842]"\n8,100.7,"[6842, 0,"\n')
    (tmp_path / "a_acc_b.csv").write_text('7,100.55,"[0, 0, 8192]"\n')
    result = shipped(tmp_path, "srp")
    samples = result.recording.samples
    # board z is up, body z down: y and z change sign
    assert_allclose(samples["gyroscope"].value[0] / DEG, [10, -20, 90])
    assert_allclose(samples["magnetometer"].value, [[100, 0, 100]], rtol=1e-9)
    assert_allclose(samples["accelerometer"].value, [[0, 0, -8192 * 0.122e-3 * G0]], rtol=1e-12)
    assert_allclose(samples["accelerometer"].t, [0.05], atol=1e-6)
    assert [(r.file, r.line) for r in result.repairs] == [("a_gyro_b.csv", 1), ("a_mag_b.csv", 2)]


@pytest.mark.parametrize("cell", ["[" * 5000 + "]" * 5000, "[" + "9" * 5000 + ", 1, 2]"], ids=["deep", "long"])
def test_a_list_that_no_logger_writes_leaves_its_row_out(tmp_path, cell):
    (tmp_path / "a_gyro_b.csv").write_text(f'7,100.5,"[10, 20, -90.0]"\n8,100.6,"{cell}"\n')
    (tmp_path / "a_mag_b.csv").write_text('7,100.5,"[6842, 0, -6842]"\n')
    (tmp_path / "a_acc_b.csv").write_text('7,100.55,"[0, 0, 8192]"\n')
    result = shipped(tmp_path, "srp")
    assert len(result.recording.samples["gyroscope"]) == 1
    assert [(r.file, r.line) for r in result.repairs] == [("a_gyro_b.csv", 2)]


# -------------------------------------------------------------------------------- release of a tracked throw

TRACK = "\ufeffmass_A\nt\tx\ty\tv\n1.000\t0       0       0\n1.033\t0.851\t0.0456\t24.46\n1.067\t1.595\t0.213\t22.4\n\n"


def tracked(tmp_path: Path, stem: str, rows: str | None = None) -> Imported:
    (tmp_path / f"{stem}.tsv").write_text(TRACK)
    return shipped(tmp_path / f"{stem}.tsv", "shotshaper", rows)


def test_a_plan_view_track_is_north_and_east_with_the_height_left_empty(tmp_path):
    result = tracked(tmp_path, "throw15")
    write_recording(result.recording, tmp_path / "out")
    track = read_recording(tmp_path / "out").need("track")
    assert_allclose(track.t, [0, 0.033, 0.067], atol=1e-9)
    assert_allclose(track.value[:, :2], [[0, 0], [0.851, -0.0456], [1.595, -0.213]])
    assert np.all(np.isnan(track.value[:, 2]))
    assert (tmp_path / "out" / "track.csv").read_text().splitlines()[2] == "0.033,0.851,-0.0456,"


def disc_axis(roll: float, pitch: float) -> np.ndarray:
    """z_B in North-East-Down: third row of C_BN = C3 C2(pitch) C1(roll)."""
    c1 = np.array([[1, 0, 0], [0, np.cos(roll), np.sin(roll)], [0, -np.sin(roll), np.cos(roll)]])
    c2 = np.array([[np.cos(pitch), 0, -np.sin(pitch)], [0, 1, 0], [np.sin(pitch), 0, np.cos(pitch)]])
    return (c2 @ c1)[2]


@pytest.mark.parametrize(("stem", "nose_deg"), [("throw1", 0.0), ("throw6", 0.8), ("throw15", 0.0)])
def test_the_nose_angle_of_a_throw_is_its_angle_of_attack_over_the_ground(tmp_path, stem, nose_deg):
    release = tracked(tmp_path, stem).recording.release
    direction = release.velocity / np.linalg.norm(release.velocity)
    alpha = np.degrees(np.arcsin(direction @ disc_axis(release.roll, release.pitch)))
    # the source adds angles that do not quite add: 0.09 deg at its largest pitch and roll, of 2 deg stated
    assert alpha == pytest.approx(nose_deg, abs=0.1)


def test_a_throw_to_the_right_with_its_left_edge_low_leans_left_of_its_heading(tmp_path):
    """throw1: 24.7 m/s, 15.5 deg up, 31.6 deg to the right, roll 21.8 deg (left edge low)."""
    release = tracked(tmp_path, "throw1").recording.release
    heading = np.arctan2(release.velocity[1], release.velocity[0])
    assert np.degrees(heading) == pytest.approx(31.6, abs=1e-9)  # East is right of North
    assert np.linalg.norm(release.velocity) == pytest.approx(24.7, rel=1e-12)
    assert release.velocity[2] == pytest.approx(-24.7 * np.sin(15.5 * DEG), rel=1e-12)
    up = -disc_axis(release.roll, release.pitch)
    left_of_heading = np.array([np.sin(heading), -np.cos(heading), 0.0])
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    theta = 15.5 * DEG * np.cos(21.8 * DEG)  # nose up by pitch cos(roll)
    assert up @ left_of_heading == pytest.approx(np.sin(21.8 * DEG) * np.cos(theta), rel=1e-9)
    assert up @ ahead == pytest.approx(-np.sin(theta), rel=1e-9)
    assert_allclose(release.body_rate, [0, 0, 138.0])  # clockwise seen from above
    assert release.yaw is None


def test_the_uncertainty_of_heading_and_pitch_becomes_one_across_the_velocity(tmp_path):
    release = tracked(tmp_path, "throw15").recording.release
    speed, pitch, yaw, two = 24.5, 5.2 * DEG, 8.0 * DEG, 2.0 * DEG
    east = speed * np.cos(pitch) * np.sin(yaw)
    parts = [0.6 / speed * east, two * east * np.tan(pitch), two * east / np.tan(yaw)]
    # central differences over 1e-6 leave 1e-9 of rounding
    assert release.sigma["velocity_ned_m_s"][1] == pytest.approx(np.linalg.norm(parts), rel=1e-6)


def test_rows_that_leave_out_the_release_have_no_release_conditions(tmp_path):
    result = tracked(tmp_path, "throw15", rows="1:")
    assert result.recording.release is None
    assert any("no release conditions" in note for note in result.notes)


# ------------------------------------------------------------------------------------------------ the command


def test_the_command_writes_a_recording_its_repairs_and_its_run(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["discsim", "import"])
    raw = tmp_path / "raw.csv"
    raw.write_text("idx,gx,gy,gz\n0,1,1,1\n1,2,2\n2,3,3,3\n")
    (tmp_path / "own.toml").write_text(PLAIN)
    command(raw, str(tmp_path / "own.toml"), rows="0:3", out=tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "recording.toml",
        "raw.html",
        "gyroscope.csv",
        "repairs.csv",
        "run.json",
    }
    assert len(read_recording(tmp_path / "out").need("gyroscope")) == 2
    assert (tmp_path / "out" / "repairs.csv").read_text().splitlines()[1].startswith("raw.csv,3,")
    assert "repairs: " in capsys.readouterr().err
    assert len(json.loads((tmp_path / "out" / "run.json").read_text())["inputs"]) == 2


def test_the_command_leaves_the_raw_files_alone(tmp_path):
    (tmp_path / "magnetometer.csv").write_text("time_s,x_uT,y_uT,z_uT\n0,1,2,3\n1,4,5,6\n")
    with pytest.raises(InputError, match="the raw files are in it"):
        command(tmp_path, "csv", rows=None, out=tmp_path)


def test_a_raw_file_that_is_not_there_writes_nothing(tmp_path):
    with pytest.raises(InputError, match=r"nothing.csv: no such file or folder"):
        command(tmp_path / "nothing.csv", "csv", rows=None, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_log_of_a_rate_table_without_the_accelerometers_place_is_refused_with_the_line_to_write(tmp_path):
    """The map that the import had written itself was refused as one that lacks a key."""
    log = made_log()
    columns = [("t_s", log.t), *three(["ax", "ay", "az"], log.accel), *three(["gx", "gy", "gz"], log.gyro)]
    raw = write_table(tmp_path / "log.csv", columns)
    with pytest.raises(InputError, match=r"write position_m = \[x, y, z\] there, and import with this map"):
        import_log(raw, plant="rate_table")
    text = import_log(raw).map_text.replace('"free_spin"', '"rate_table"')
    mended = re.sub(r"# position_m = \[[^]]*\]", "position_m = [-0.0161, 0.0, 0.0]", text)
    (tmp_path / "map.toml").write_text(mended)
    assert import_log(raw, str(tmp_path / "map.toml")).recordings[0].plant == "rate_table"
