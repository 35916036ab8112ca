"""Damaged recordings: every fault is refused in one line that names file, line and what was expected."""

from __future__ import annotations

import re
import tracemalloc
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.recording_folder import (
    AERO_TABLE,
    CNR_TABLE,
    CSV,
    HEADER,
    MATRIX,
    TOML,
    line_of,
    make,
    refusal,
)

from discsim import recording as module
from discsim.errors import InputError
from discsim.recording import read_csv, read_recording


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    return make(tmp_path / "flight")


# ------------------------------------------------------------------------------------------ damaged TOML

DAMAGED_TOML = [
    # what is wrong, old text, new text, where the error points (text on its line, or None), what it says
    (
        "no format",
        'format = "discsim-recording/1"\n',
        "",
        None,
        r"missing key 'format' in the top level; expected one of",
    ),
    (
        "another format",
        "recording/1",
        "recording/2",
        "format",
        r"'format' is 'discsim-recording/2', expected one of disc",
    ),
    (
        "format is a number",
        '"discsim-recording/1"',
        "1",
        "format",
        r"'format' is 1, expected one of discsim-recording/1",
    ),
    (
        "unknown plant",
        '"flight"',
        '"fligth"',
        "plant",
        r"'plant' is 'fligth', expected one of flight, rate_table, spin",
    ),
    ("no plant", 'plant = "flight"\n', "", None, r"missing key 'plant' in the top level; expected one of flight"),
    ("no name", 'name = "field"\n', "", None, r"missing key 'name' in the top level; expected a text"),
    ("name is a number", '"field"', "3", "name", r"'name' is 3, expected a text"),
    ("unknown key on top", "[environment]", "weather = 1\n[environment]", "weather", r"unknown key 'weather'"),
    ("unknown table", "[release]", "[releases]", "[releases]", r"unknown key 'releases'; did you mean 'release'\?"),
    (
        "no environment",
        "[environment]",
        "[environs]",
        None,
        r"missing key 'environment' in the top level; expected a t",
    ),
    (
        "misspelt environment",
        "[environment]",
        "[enviroment]",
        "[enviroment]",
        r"missing key 'environment'.*did you mean 'environment'\?",
    ),
    (
        "environment is a number",
        "[environment]",
        "environment = 3\n[x]",
        "environ",
        r"'environment' is 3, expected a tab",
    ),
    (
        "misspelt key",
        "gravity_m_s2",
        "gravty_m_s2",
        "gravty",
        r"missing key 'gravity_m_s2' in \[environment\]; expected a number \(there is 'gravty_m_s2'; did you mean",
    ),
    ("missing key", "gravity_m_s2 = 9.798\n", "", "[environment]", r"missing key 'gravity_m_s2' in \[environment\]"),
    ("wrong unit", "mass_kg = 0.179", "mass_g = 179", "mass_g", r"missing key 'mass_kg'.*there is 'mass_g'"),
    ("wrong case", "CNr = ", "CNR = ", "CNR", r"missing key 'CNr' in \[disc.aero\].*there is 'CNR'"),
    (
        "neighbour is no misspelling",
        "Ixx_kg_m2 = 0.0006\n",
        "",
        "[disc]",
        r"missing key 'Ixx_kg_m2' in \[disc\]; [a ]*expe",
    ),
    (
        "misspelt optional key",
        "noise_rms_uT",
        "noise_rsm_uT",
        "noise_rsm",
        r"unknown key 'sensors.magnetometer.noise_rsm_uT'; did you mean 'noise_rms_uT'\?",
    ),
    ("another sensor's unit", "noise_rms_uT", "noise_rms_m_s2", "noise_rms_m_s2", r"unknown key .*; did you mean"),
    (
        "number is a text",
        "= 9.798",
        '= "9.798"',
        "gravity",
        r"'environment.gravity_m_s2' is '9.798', expected a finite",
    ),
    ("number is true", "= 9.798", "= true", "gravity", r"'environment.gravity_m_s2' is true, expected a finite number"),
    ("number is nan", "= 9.798", "= nan", "gravity", r"'environment.gravity_m_s2' is nan, expected a finite number"),
    ("number is inf", "= 9.798", "= -inf", "gravity", r"'environment.gravity_m_s2' is -inf, expected a finite number"),
    (
        "number is a date",
        "= 9.798",
        "= 2024-05-01",
        "gravity",
        r"'environment.gravity_m_s2' is .*, expected a finite num",
    ),
    (
        "number is a list",
        "= 9.798",
        "= [9.798]",
        "gravity",
        r"'environment.gravity_m_s2' is \[9.798\], expected a finite",
    ),
    ("number too large", "= 9.798", "= 1" + "0" * 400, "gravity", r"is 10+\.\.\., expected a finite number"),
    ("number of too many digits", "= 9.798", "= 1" + "0" * 5000, None, r"no valid TOML: .*digits.*; expected"),
    ("no gravity", "= 9.798", "= 0.0", "gravity", r"'environment.gravity_m_s2' is 0.0, expected a number above zero"),
    ("negative mass", "= 0.179", "= -0.179", "mass", r"'disc.mass_kg' is -0.179, expected a number above zero"),
    ("negative noise", "= 0.6", "= -0.6", "noise", r"'sensors.magnetometer.noise_rms_uT' is -0.6, expected at least 0"),
    ("two numbers for three", ", 39.2]", "]", "magnetic_field", r"is \[30.1, -4.3\], expected a list of 3 numbers"),
    ("four numbers for three", "39.2]", "39.2, 1.0]", "magnetic_field", r"expected a list of 3 numbers"),
    ("number for a vector", "[30.1, -4.3, 39.2]", "30.1", "magnetic_field", r"is 30.1, expected a list of 3 numbers"),
    (
        "true in a vector",
        "-4.3",
        "false",
        "magnetic_field",
        r"'environment.magnetic_field_ned_uT' is false, expected a fin",
    ),
    (
        "nan in a vector",
        "-4.3",
        "nan",
        "magnetic_field",
        r"'environment.magnetic_field_ned_uT' is nan, expected a finite",
    ),
    (
        "no density",
        "air_density_kg_m3 = 1.204\n",
        "",
        "[environment]",
        r"missing key 'air_density_kg_m3' in \[environm",
    ),
    ("a body that cannot be", "0.00115", "0.00125", "[disc]", r"Izz = 0.00125 exceeds Ixx \+ Iyy = 0.0012 kg m\^2"),
    (
        "no aerodynamics",
        TOML[TOML.index("[disc.aero]") : TOML.index("[release]")],
        "",
        "[disc]",
        r"\[disc.aero\] is missing",
    ),
    *[
        (
            f"no {key}",
            re.search(rf"^{key} = .*\n", TOML, re.M)[0],
            "",
            "[disc.aero]",
            rf"missing key '{key}' in \[disc.aero\]",
        )
        for key in ("CL0", "CLa", "CD0", "CDa", "alpha0_rad", "CM0", "CMa", "CMq", "CRr", "CRp", "CNr")
    ],
    (
        "uncertainty below zero",
        "[release]",
        "[disc.aero_sigma]\nCL0 = -1\n[release]",
        "CL0 = -1",
        r"aero_sigma.CL0' is -1, exp",
    ),
    (
        "unknown coefficient's uncertainty",
        "[release]",
        "[disc.aero_sigma]\nCY0 = 1\n[release]",
        "CY0",
        r"unknown key 'disc.aero_sigma.CY0'; did you mean 'C[A-Za-z]0'\?",
    ),
    (
        "uncertainty of an uncertainty",
        "[release]",
        "[disc.aero_sigma]\nCL0 = 1\nCL0_sigma = 1\n[release]",
        "[disc.aero_sigma]",
        r"uncertainty of an uncertainty; expected names of coefficients",
    ),
    (
        "negative uncertainty",
        "[release]",
        "[release]\nvelocity_sigma_m_s = -1",
        "velocity_sigma",
        r"is -1, expected at l",
    ),
    (
        "release says too little",
        "velocity_ned_m_s = [23.6, 5.5, -4.2]",
        "velocity_m_s = [1, 2, 3]",
        "velocity_m_s",
        r"unknown key 'release.velocity_m_s'; did you mean 'velocity_ned_m_s'\?",
    ),
    (
        "no sensor tables",
        TOML[TOML.index("[sensors.mag") :],
        "",
        None,
        r"missing key 'sensors' in the top level; expected a",
    ),
    (
        "unknown sensor",
        "[sensors.magnetometer]",
        "[sensors.magnetomter]",
        "[sensors.magnetomter]",
        r"unknown sensor 'magnetomter'; did you mean 'magnetometer'\? \(expected one of magnetometer, acc",
    ),
    (
        "sensor is a number",
        "[sensors.magnetometer]\n",
        "[sensors]\nmagnetometer = 100\n[x]\n",
        "magnetometer = 100",
        r"'sensors.magnetometer' is 100, expected a table",
    ),
    (
        "sensor without a rate",
        "rate_hz = 100.0\n",
        "",
        "[sensors.magnetometer]",
        r"missing key 'rate_hz' in \[sensors.magnet",
    ),
    (
        "sensor without samples a second",
        "rate_hz = 100.0",
        "rate_hz = 0",
        "rate_hz = 0",
        r"is 0, expected a number above",
    ),
    (
        "accelerometer without a place",
        "position_m = [-0.0161, 0.0, 0.0]\n",
        "",
        "[sensors.acc",
        r"missing key 'position_m'",
    ),
    (
        "rig in a flight",
        "[release]",
        "[rig]\nIzz_kg_m2 = 1\nviscous_N_m_s = 1\n[release]",
        "[rig]",
        r"\[rig\] in a flight reco",
    ),
    (
        "a list of tables",
        "[sensors.magnetometer]",
        "[[sensors.magnetometer]]",
        "[[sensors",
        r"is \[\{.*, expected a table",
    ),
    (
        "key stated twice",
        "mass_kg = 0.179",
        "mass_kg = 0.179\nmass_kg = 0.18",
        "mass_kg = 0.18",
        r"no valid TOML: .*each key once",
    ),
    ("table stated twice", "[release]", "[disc]\n[release]", None, r"no valid TOML: .*; expected"),
    ("decimal comma", "= 9.798", "= 9,798", "gravity", r"no valid TOML: .*; expected lines of"),
    ("no value", "= 9.798", "=", "gravity", r"no valid TOML: .*; expected"),
    ("text without an end", '"field"', '"field', "name", r"no valid TOML: .*; expected"),
    ("nested without end", "= 9.798", "= " + "[" * 5000, None, r"no valid TOML: .*; expected"),
    ("inline table misspelt", "[release]", "x.y = 1\n[release]", "x.y", r"unknown key 'disc.aero.x'"),
]


@pytest.mark.parametrize(
    ("old", "new", "place", "says"), [row[1:] for row in DAMAGED_TOML], ids=[r[0] for r in DAMAGED_TOML]
)
def test_damaged_toml_is_refused_with_its_line(tmp_path, old, new, place, says):
    assert old in TOML
    text = TOML.replace(old, new, 1)
    message = refusal(make(tmp_path / "flight", text))
    assert re.search(says, message)
    line = re.match(r"recording\.toml(?::(\d+))?: ", message)
    assert line
    if place is not None:
        assert int(line[1]) == line_of(text, place)


def test_an_uncertainty_stated_in_two_places_is_refused(tmp_path):
    text = TOML.replace("CLa = 2.1", "CLa = 2.1\nCLa_sigma = 0.1") + "[disc.aero_sigma]\nCLa = 0.2\n"
    message = refusal(make(tmp_path / "flight", text))
    assert message.startswith(
        f"recording.toml:{line_of(text, 'CLa = 0.2')}: uncertainty of 'CLa' is stated twice; expect"
    )


DAMAGED_TABLES = [
    ("missing column", AERO_TABLE, "[disc.aero_table]", r"missing key 'CM' in \[disc.aero_table\]; expected a list of"),
    ("unequal columns", AERO_TABLE + "CM = [0.0, 0.1]\n", "[disc.aero_table]", r"columns of one length.*got .*'CM': 2"),
    (
        "one node",
        "[disc.aero_table]\nalpha_rad = [0]\nCL = [0]\nCD = [0]\nCM = [0]\n",
        "[disc.aero_table]",
        r"at least 2, exp",
    ),
    (
        "descending angles",
        AERO_TABLE.replace("-0.1, 0.0, 0.1", "0.1, 0.0, -0.1") + "CM = [0, 0, 0]\n",
        "[disc.aero_table]",
        r"expected alpha_rad to ascend",
    ),
    (
        "text in a column",
        AERO_TABLE + 'CM = [0, "0", 0]\n',
        "CM = [0, ",
        r"'disc.aero_table.CM' is '0', expected a finite",
    ),
    (
        "nan in a column",
        AERO_TABLE + "CM = [0, nan, 0]\n",
        "CM = [0, ",
        r"'disc.aero_table.CM' is nan, expected a finite",
    ),
    ("number for a column", AERO_TABLE + "CM = 0\n", "CM = 0\n", r"'disc.aero_table.CM': expected a list of numbers"),
    ("empty column", AERO_TABLE + "CM = []\n", "CM = []", r"'disc.aero_table.CM': expected a list of numbers"),
    ("unknown column", AERO_TABLE + "CM = [0, 0, 0]\nCY = [0, 0, 0]\n", "CY =", r"unknown key 'disc.aero_table.CY'"),
    ("ragged matrix", CNR_TABLE.replace("-0.004], [", "-0.004, 1], [", 1), "CNr = [[", r"expected a matrix"),
    ("list for a matrix", CNR_TABLE.replace(MATRIX, "[1, 2, 3, 4]"), "CNr = [1", r"expected a matrix"),
    (
        "too few rates",
        CNR_TABLE.replace(", 4650", ""),
        "[disc.CNr_table]",
        r"CNr is 4 x 4, expected rates x speeds = 3 x 4",
    ),
    (
        "rates descend",
        CNR_TABLE.replace("4500", "4700"),
        "[disc.CNr_table]",
        r"expected rate_deg_s and speed_m_s to ascend",
    ),
    ("true in the matrix", CNR_TABLE.replace("[[-0.004", "[[true"), "CNr = [[", r"is true, expected a finite number"),
]


@pytest.mark.parametrize(
    ("table", "place", "says"), [r[1:] for r in DAMAGED_TABLES], ids=[r[0] for r in DAMAGED_TABLES]
)
def test_damaged_coefficient_tables_are_refused(tmp_path, table, place, says):
    text = TOML + table
    message = refusal(make(tmp_path / "flight", text))
    assert message.startswith(f"recording.toml:{line_of(text, place)}: ")
    assert re.search(says, message)


def test_an_uncertainty_of_a_coefficient_that_is_tabulated_is_refused(tmp_path):
    text = TOML.replace("CL0 = 0.13\n", "") + AERO_TABLE + "CM = [0, 0, 0]\n[disc.aero_sigma]\nCL0 = 0.01\n"
    message = refusal(make(tmp_path / "flight", text))
    assert message.startswith(
        f"recording.toml:{line_of(text, 'CL0 = 0.01')}: uncertainty of 'CL0', which [disc.aero] lacks"
    )


def test_uncertainties_of_coefficients_need_the_coefficients(tmp_path):
    start, stop = TOML.index("[disc.aero]"), TOML.index("[release]")
    text = (TOML[:start] + "[disc.aero_sigma]\nCL0 = 0.1\n" + TOML[stop:]).replace('"flight"', '"free_spin"')
    message = refusal(make(tmp_path / "flight", text))
    assert message.startswith(
        f"recording.toml:{line_of(text, '[disc.aero_sigma]')}: [disc.aero_sigma] without [disc.aero]"
    )


# ------------------------------------------------------------------------------------------ damaged CSV

ROWS = "0.0,1,2,3\n0.01,1,2,3\n0.02,1,2,3\n"


def with_row(row: str) -> str:
    return f"{HEADER}\n0.0,1,2,3\n{row}\n0.02,1,2,3\n"


DAMAGED_CSV = [
    ("zero bytes", "", 1, rf"header is '', expected '{HEADER}'"),
    ("no header", ROWS, 1, rf"header is '0.0,1,2,3', expected '{HEADER}'"),
    ("wrong unit", ROWS.replace("0.0", "time_s,x_T,y_T,z_T\n0.0", 1), 1, r"header is 'time_s,x_T,y_T,z_T', expected"),
    ("columns swapped", "time_s,y_uT,x_uT,z_uT\n" + ROWS, 1, rf"expected '{HEADER}'"),
    ("one column short", "time_s,x_uT,y_uT\n" + ROWS, 1, rf"expected '{HEADER}'"),
    ("one column over", f"{HEADER},t_C\n" + ROWS, 1, rf"expected '{HEADER}'"),
    ("spaces in the header", HEADER.replace(",", ", ") + "\n" + ROWS, 1, rf"expected '{HEADER}'"),
    ("semicolons", f"{HEADER}\n{ROWS}".replace(",", ";"), 1, rf"expected '{HEADER}'"),
    ("old Mac line ends", f"{HEADER}\n{ROWS}".replace("\n", "\r"), 1, rf"expected '{HEADER}'"),
    ("blank line first", f"\n{HEADER}\n{ROWS}", 1, rf"header is '', expected '{HEADER}'"),
    ("header only", HEADER, 2, r"no samples; expected at least one row"),
    ("header and blank lines", HEADER + "\n\n \n", 2, r"no samples; expected at least one row"),
    ("blank line inside", with_row(""), 3, rf"a blank line between rows; expected 4 cells: {HEADER}"),
    ("blank line after the header", f"{HEADER}\n\n{ROWS}", 2, r"a blank line between rows; expected 4 cells"),
    ("line of spaces inside", with_row("  "), 3, r"a blank line between rows; expected 4 cells"),
    ("trailing comma", with_row("0.01,1,2,3,"), 3, rf"5 cells in '0.01,1,2,3,', expected 4 .*: {HEADER}"),
    ("trailing commas everywhere", f"{HEADER}\n0.0,1,2,3,\n0.01,1,2,3,\n", 2, r"5 cells in '0.0,1,2,3,', expected 4"),
    ("too few cells", with_row("0.01,1,2"), 3, r"3 cells in '0.01,1,2', expected 4"),
    ("too few cells everywhere", f"{HEADER}\n0.0,1,2\n0.01,1,2\n", 2, r"3 cells in '0.0,1,2', expected 4"),
    ("a last line cut off", f"{HEADER}\n0.0,1,2,3\n0.01,1.", 3, r"2 cells in '0.01,1.', expected 4"),
    ("decimal commas", with_row("0,01,1,5,2,5,3,5"), 3, r"8 cells in .*, expected 4 .*decimal points"),
    ("a decimal comma", with_row("0.01,0,5,2,3"), 3, r"5 cells in '0.01,0,5,2,3', expected 4 .*decimal points"),
    ("a semicolon", with_row("0.01;1;2;3"), 3, r"1 cells in '0.01;1;2;3', expected 4 with commas"),
    ("text", with_row("0.01,1,error,3"), 3, r"y_uT is 'error', expected a finite number or an empty cell"),
    ("inf", with_row("0.01,1,inf,3"), 3, r"y_uT is 'inf', expected a finite number or an empty cell"),
    ("-Infinity", with_row("0.01,1,-Infinity,3"), 3, r"y_uT is '-Infinity', expected a finite number"),
    ("beyond the largest number", with_row("0.01,1,1e400,3"), 3, r"y_uT is '1e400', expected a finite number"),
    ("underscore between digits", with_row("0.01,1,1_000,3"), 3, r"y_uT is '1_000', expected a finite number"),
    ("quotes", with_row('0.01,1,"2",3'), 3, r"y_uT is '\"2\"', expected a finite number"),
    ("a comment", with_row("# lost sync"), 3, r"1 cells in '# lost sync', expected 4"),
    ("a hexadecimal number", with_row("0.01,1,0x10,3"), 3, r"y_uT is '0x10', expected a finite number"),
    ("an exponent of Fortran", with_row("0.01,1,1d2,3"), 3, r"y_uT is '1d2', expected a finite number"),
    ("two numbers in a cell", with_row("0.01,1,2 2,3"), 3, r"y_uT is '2 2', expected a finite number"),
    ("digits of another script", with_row("0.01,1,\u0662,3"), 3, r"y_uT is '\u0662', expected a finite number"),
    ("a minus sign of a typesetter", with_row("0.01,1,\u22122,3"), 3, r"y_uT is '\u22122', expected a finite number"),
    ("a carriage return inside", with_row("0.01,1,2\r,3"), 3, r"y_uT is .*, expected a finite number"),
    ("a line that ends in CR only", with_row("0.01,1,2,3\r0.015,1,2,3"), 3, r"7 cells in .*, expected 4"),
    ("zero bytes inside", with_row("0.01,1,\0\0\0,3"), 3, r"y_uT is .*, expected a finite number"),
    ("time backwards", with_row("-0.01,1,2,3"), 3, r"time -0.01 s follows 0.0 s; expected ascending time"),
    ("time stands", with_row("0.0,1,2,3"), 3, r"time 0.0 s follows 0.0 s; expected ascending time"),
    ("time backwards at the end", f"{HEADER}\n{ROWS}0.015,1,2,3\n", 5, r"time 0.015 s follows 0.02 s; expected asc"),
    ("time is nan", with_row("nan,1,2,3"), 3, r"time_s is 'nan', expected a finite number"),
    ("time is empty", with_row(",1,2,3"), 3, r"time_s is '', expected a finite number"),
    ("time is inf", with_row("inf,1,2,3"), 3, r"time_s is 'inf', expected a finite number"),
    ("time of day", with_row("12:00:00,1,2,3"), 3, r"time_s is '12:00:00', expected a finite number"),
    ("the header again", with_row(HEADER), 3, r"time_s is 'time_s', expected a finite number"),
]


@pytest.mark.parametrize("line_end", ["\n", "\r\n"], ids=["LF", "CRLF"])
@pytest.mark.parametrize(
    ("text", "line", "says"), [row[1:] for row in DAMAGED_CSV], ids=[row[0] for row in DAMAGED_CSV]
)
def test_a_damaged_file_is_refused_with_its_line(flight, text, line, says, line_end):
    (flight / "magnetometer.csv").write_bytes(text.replace("\n", line_end).encode())
    message = refusal(flight)
    assert message.startswith(f"magnetometer.csv:{line}: ")
    assert re.search(says, message)


def test_the_first_of_several_faults_is_named(flight):
    (flight / "magnetometer.csv").write_text(f"{HEADER}\n0.0,1,2,3\n0.01,1,x,3\n0.005,1,2\n")
    assert refusal(flight).startswith("magnetometer.csv:3: y_uT is 'x'")


@pytest.mark.parametrize("file", ["magnetometer.csv", "recording.toml"])
@pytest.mark.parametrize(
    "junk", [bytes(range(256)), "Größe".encode("latin-1"), "time".encode("utf-16")], ids=["binary", "latin-1", "utf-16"]
)
def test_a_file_that_is_no_utf_8_is_refused(flight, file, junk):
    (flight / file).write_bytes(b"a\nb\n" + junk)
    assert re.match(rf"{re.escape(file)}:[3-9]: byte 0x[0-9a-f]+ is no UTF-8; expected UTF-8 text", refusal(flight))


def test_a_fault_far_down_a_long_file_is_found(tmp_path, monkeypatch):
    """Blocks are far smaller here than in use, so that the fault lies in the thousandth of them."""
    monkeypatch.setattr(module, "BLOCK", 100)
    rows = [f"{k},1,2,3" for k in range(10_000)]
    file = tmp_path / "magnetometer.csv"
    file.write_text("\n".join([HEADER, *rows]))
    assert len(read_csv(file, HEADER)) == 10_000
    for damage, says in [
        ("8999,1,2", "3 cells"),
        ("8998,1,2,3", "time 8998.0 s follows 8998.0 s"),
        ("8999,1,x,3", "y_uT"),
    ]:
        rows[8999] = damage
        file.write_text("\n".join([HEADER, *rows]))
        with pytest.raises(InputError, match=rf"magnetometer.csv:9001: {re.escape(says)}"):
            read_csv(file, HEADER)


def test_time_must_ascend_from_block_to_block(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "BLOCK", 1)
    file = tmp_path / "magnetometer.csv"
    file.write_text(f"{HEADER}\n{ROWS}0.02,1,2,3\n")
    with pytest.raises(InputError, match=r"magnetometer.csv:5: time 0.02 s follows 0.02 s"):
        read_csv(file, HEADER)


# ------------------------------------------------------------------------------------------ any damage


@settings(max_examples=400, deadline=None)
@given(data=st.data())
def test_random_damage_gives_a_recording_or_one_clear_line(data):
    with TemporaryDirectory() as folder:
        check_damage(make(Path(folder) / "flight", TOML + CNR_TABLE), data)


def check_damage(folder: Path, data: st.DataObject) -> None:
    file = folder / data.draw(st.sampled_from(["recording.toml", *CSV]))
    content = bytearray(file.read_bytes())
    alphabet = st.one_of(st.integers(0, 255), st.sampled_from(b'0123456789+-.eEnainf,;"#=[]{}\r\n\t _'))
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content)))
        stop = start + data.draw(st.integers(0, 12))
        content[start:stop] = bytes(data.draw(st.lists(alphabet, max_size=12)))
    file.write_bytes(content)
    try:
        recording = read_recording(folder)
    except InputError as error:
        assert re.match(rf"{re.escape(str(folder))}(/[a-z.]+)?(:\d+)?: \S", str(error))  # noqa: PT017
        assert len(str(error).splitlines()) == 1  # noqa: PT017
        return
    for samples in recording.samples.values():
        assert np.all(np.isfinite(samples.t))
        assert np.all(np.diff(samples.t) > 0)
        assert not np.any(np.isinf(samples.value))


@pytest.mark.parametrize("block", [1, 40, 1 << 22])
def test_blank_lines_are_a_fault_between_rows_and_none_at_the_end_whatever_the_blocks(tmp_path, monkeypatch, block):
    monkeypatch.setattr(module, "BLOCK", block)
    file = tmp_path / "magnetometer.csv"
    file.write_text(f"{HEADER}\n{ROWS}\n \n\t\n\n")
    assert len(read_csv(file, HEADER)) == ROWS.count("\n")
    file.write_text(f"{HEADER}\n{ROWS}\n \n9,1,2,3\n")
    with pytest.raises(InputError, match=rf"magnetometer.csv:{2 + ROWS.count(chr(10))}: a blank line between rows"):
        read_csv(file, HEADER)


def test_reading_holds_little_more_than_the_readings(tmp_path, monkeypatch):
    """A log of an hour has 115 MB of readings a sensor: the text of all, and copies, would be many times that."""
    monkeypatch.setattr(module, "BLOCK", 1 << 16)
    t = 0.001 * np.arange(150_000)
    value = np.round(np.random.default_rng(0).normal(0, 30, (t.size, 3)), 4)
    file = tmp_path / "magnetometer.csv"
    with file.open("w") as stream:
        stream.write(f"{HEADER}\n")
        stream.write(("%.3f,%.4f,%.4f,%.4f\n" * t.size) % tuple(np.column_stack([t, value]).ravel().tolist()))
    tracemalloc.start()
    try:
        read = read_csv(file, HEADER)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert np.array_equal(read.value, value)
    # the parts and all of it, once, and a few blocks as text
    assert most < 2.1 * (t.nbytes + value.nbytes) + 20 * module.BLOCK
