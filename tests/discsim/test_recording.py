"""Recordings: what is refused and how it is said, what is accepted, and that writing loses nothing."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.recording_folder import AERO_TABLE, CNR_TABLE, CSV, RATE_TABLE, SPIN_DOWN, TOML, line_of, make, refusal

from discsim.disc import Aero, Rig
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.recording import (
    SENSORS,
    Recording,
    Samples,
    SensorSheet,
    read_dataset,
    read_recording,
    write_recording,
)


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    return make(tmp_path / "flight")


# ------------------------------------------------------------------------------------------ what is accepted


def test_a_recording_is_read_as_it_stands(flight):
    recording = read_recording(flight)
    assert (recording.plant, recording.name, recording.path) == ("flight", "field", flight)
    np.testing.assert_array_equal(recording.need("magnetometer").t, [0.0, 0.01, 0.02])
    np.testing.assert_array_equal(recording.need("accelerometer").value, [[-9.0, 0.1, -9.8], [-9.1, 0.2, -9.7]])
    assert recording.disc is not None
    assert recording.disc.aero == Aero(0.13, 2.1, 0.062, 1.35, -0.05, -0.012, 0.12, -0.15, 0.0035, -0.12, -0.0045)
    assert recording.release is not None
    np.testing.assert_array_equal(recording.release.velocity, [23.6, 5.5, -4.2])
    assert recording.release.position is None
    np.testing.assert_array_equal(recording.sheets["accelerometer"].position, [-0.0161, 0.0, 0.0])
    np.testing.assert_array_equal(recording.environment.wind, [0.0, 0.0, 0.0])
    assert recording.end == 0.02


MAGNETOMETER = CSV["magnetometer.csv"]


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("\ufeff" + MAGNETOMETER, id="byte order mark"),
        pytest.param(MAGNETOMETER.replace("\n", "\r\n"), id="CRLF"),
        pytest.param(MAGNETOMETER.rstrip("\n"), id="no line end at the end"),
        pytest.param(MAGNETOMETER + "\n\n", id="blank lines at the end"),
        pytest.param(MAGNETOMETER + "\r\n \r\n", id="blank CRLF lines at the end"),
        pytest.param(MAGNETOMETER.replace(",1.1,", ", +1.1 ,"), id="spaces around a number"),
        pytest.param(MAGNETOMETER.replace(",1.1,", ",110E-2,"), id="exponent"),
    ],
)
def test_spellings_of_the_same_numbers_are_read_as_the_same(flight, text):
    (flight / "magnetometer.csv").write_bytes(text.encode())
    samples = read_recording(flight).need("magnetometer")
    np.testing.assert_array_equal(samples.value, [[1.0, 2.0, 3.0], [1.1, 2.1, 3.1], [1.2, 2.2, 3.2]])
    assert samples.gaps == 0


@pytest.mark.parametrize("cell", ["", " ", "nan", "NaN", "\t"])
@pytest.mark.parametrize("column", [1, 2, 3])
def test_an_empty_cell_or_nan_is_a_gap_and_is_counted(flight, cell, column):
    rows = [line.split(",") for line in MAGNETOMETER.splitlines()]
    rows[2][column] = cell
    (flight / "magnetometer.csv").write_text("\n".join(",".join(row) for row in rows))
    samples = read_recording(flight).need("magnetometer")
    assert samples.gaps == 1
    assert np.isnan(samples.value[1, column - 1])
    assert np.count_nonzero(np.isfinite(samples.value)) == 8


def test_a_table_without_a_file_is_a_sensor_that_was_not_present(flight):
    (flight / "accelerometer.csv").unlink()
    recording = read_recording(flight)
    assert "accelerometer" not in recording
    assert recording.get("accelerometer") is None
    with pytest.raises(InputError, match=r"flight: needs accelerometer samples; this recording has magnetometer$"):
        recording.need("accelerometer")


def test_files_that_are_no_part_of_the_format_are_ignored(flight):
    (flight / "truth.csv").write_text("anything")
    (flight / "notes").mkdir()
    assert list(read_recording(flight).samples) == ["magnetometer", "accelerometer"]


def test_sensors_are_read_with_their_own_columns(tmp_path):
    toml = TOML + "[sensors.gps]\nrate_hz = 10\n[sensors.rate_reference]\nrate_hz = 50\n[sensors.track]\nrate_hz = 60\n"
    csv = {
        "gps.csv": SENSORS["gps"].header + "\n0,1,2,-3,4,5,6\n",
        "rate_reference.csv": "time_s,rate_rad_s\n0,70\n1,\n",
        "track.csv": "time_s,north_m,east_m,down_m\n0,1,,-1.5\n",
    }
    recording = read_recording(make(tmp_path / "many", toml, csv))
    assert recording.need("gps").value.shape == (1, 6)
    assert recording.need("rate_reference").value.shape == (2,)
    assert recording.need("rate_reference").gaps == 1
    assert recording.need("track").gaps == 1


def test_a_rate_table_has_a_command(tmp_path):
    folder = make(tmp_path / "table", RATE_TABLE, CSV | {"command.csv": "time_s,rate_rad_s\n0,0\n5,87.3\n"})
    command = read_recording(folder).command
    assert command is not None
    np.testing.assert_array_equal(command.value, [0.0, 87.3])


def test_a_spin_down_has_a_rig(tmp_path):
    rig = read_recording(make(tmp_path / "rig", SPIN_DOWN)).rig
    assert rig is not None
    assert (rig.Izz, rig.viscous) == (0.0011, 3.0e-5)


SIGMAS = {
    "gravity_m_s2": "gravity_sigma_m_s2",
    "magnetic_field_ned_uT": "magnetic_field_sigma_uT",
    "air_density_kg_m3": "air_density_sigma_kg_m3",
    "wind_ned_m_s": "wind_sigma_m_s",
    "mass_kg": "mass_sigma_kg",
    "diameter_m": "diameter_sigma_m",
    "Ixx_kg_m2": "Ixx_sigma_kg_m2",
    "Izz_kg_m2": "Izz_sigma_kg_m2",
    "alpha0_rad": "alpha0_sigma_rad",
    "CNr": "CNr_sigma",
    "viscous_N_m_s": "viscous_sigma_N_m_s",
    "position_ned_m": "position_sigma_m",
    "velocity_ned_m_s": "velocity_sigma_m_s",
    "roll_rad": "roll_sigma_rad",
    "pitch_rad": "pitch_sigma_rad",
    "yaw_rad": "yaw_sigma_rad",
    "body_rate_rad_s": "body_rate_sigma_rad_s",
    "rate_hz": "rate_sigma_hz",
    "noise_rms_uT": "noise_rms_sigma_uT",
    "resolution_m_s2": "resolution_sigma_m_s2",
    "range_rad_s": "range_sigma_rad_s",
    "position_noise_rms_m": "position_noise_rms_sigma_m",
    "velocity_noise_rms_m_s": "velocity_noise_rms_sigma_m_s",
    "position_m": "position_sigma_m",
}
VECTORS = (
    "magnetic_field_ned_uT",
    "wind_ned_m_s",
    "position_ned_m",
    "velocity_ned_m_s",
    "body_rate_rad_s",
    "position_m",
)


def sigmas_of(recording: Recording) -> dict[str, object]:
    parts = (recording.environment, recording.disc, recording.rig, recording.release, *recording.sheets.values())
    return {key: value for part in parts if part is not None for key, value in part.sigma.items()}


def with_every_key(key: str) -> str:
    """Return a recording.toml in which ``key`` occurs once with a value."""
    text = SPIN_DOWN
    values = dict.fromkeys(SIGMAS, "0.5") | dict.fromkeys(VECTORS, "[0.1, 0.2, 0.3]")
    places = {
        "wind_ned_m_s": "[environment]",
        "position_ned_m": "[release]",
        "roll_rad": "[release]",
        "pitch_rad": "[release]",
        "yaw_rad": "[release]",
        "body_rate_rad_s": "[release]",
        "resolution_m_s2": "[sensors.accelerometer]",
    }
    if key in places:
        text = text.replace(places[key], f"{places[key]}\n{key} = {values[key]}")
    elif key == "range_rad_s":
        text += "[sensors.gyroscope]\nrate_hz = 10\nrange_rad_s = 35\n"
    elif "_noise_rms_m" in key:
        text += f"[sensors.gps]\nrate_hz = 10\n{key} = 0.5\n"
    return text


@pytest.mark.parametrize(("key", "sigma"), SIGMAS.items())
def test_every_number_takes_an_uncertainty_before_its_unit(tmp_path, key, sigma):
    text = with_every_key(key)
    folder = make(tmp_path / "rig", re.sub(rf"^({key} = .*)$", rf"\1\n{sigma} = 0.25", text, count=1, flags=re.M))
    assert sigmas_of(read_recording(folder)) == {key: 0.25}


@pytest.mark.parametrize(("key", "sigma"), SIGMAS.items())
def test_an_uncertainty_survives_writing(tmp_path, key, sigma):
    text = re.sub(rf"^({key} = .*)$", rf"\1\n{sigma} = 0.25", with_every_key(key), count=1, flags=re.M)
    recording = read_recording(make(tmp_path / "first", text))
    write_recording(recording, tmp_path / "second")
    assert sigmas_of(read_recording(tmp_path / "second")) == {key: 0.25}


@pytest.mark.parametrize(
    ("key", "sigma"),
    [
        item
        for item in SIGMAS.items()
        if item[0] not in ("wind_ned_m_s", "CNr", "alpha0_rad", "rate_hz", "position_m") and "inertia" not in item[0]
    ],
)
def test_an_uncertainty_of_nothing_is_refused(tmp_path, key, sigma):
    text = re.sub(rf"^{key} = .*$", f"{sigma} = 0.25", with_every_key(key), count=1, flags=re.M)
    message = refusal(make(tmp_path / "rig", text))
    required = key in ("gravity_m_s2", "magnetic_field_ned_uT", "mass_kg", "diameter_m", "Ixx_kg_m2", "Izz_kg_m2")
    if required or key == "viscous_N_m_s":
        assert re.search(rf"missing key '{key}'", message)
    else:
        assert message.startswith(f"recording.toml:{line_of(text, sigma)}: ")
        assert re.search(rf"'[a-z.]*{sigma}' is the uncertainty of '{key}', which is missing", message)


def test_a_vector_takes_one_uncertainty_or_one_for_each_component(tmp_path):
    text = TOML.replace("[release]", "[release]\nvelocity_sigma_m_s = [0.1, 0.2, 0.3]")
    release = read_recording(make(tmp_path / "flight", text)).release
    assert release is not None
    np.testing.assert_array_equal(release.sigma["velocity_ned_m_s"], [0.1, 0.2, 0.3])


def test_an_unstated_wind_is_calm_and_may_be_uncertain(tmp_path):
    text = TOML.replace("[environment]", "[environment]\nwind_sigma_m_s = 0.5")
    environment = read_recording(make(tmp_path / "flight", text)).environment
    np.testing.assert_array_equal(environment.wind, [0.0, 0.0, 0.0])
    assert environment.sigma["wind_ned_m_s"] == 0.5


def test_a_table_of_coefficients_replaces_lift_drag_and_pitch(tmp_path):
    linear = re.compile(r"^(CL0|CLa|CD0|CDa|alpha0_rad|CM0|CMa) = .*\n", re.M)
    folder = make(tmp_path / "flight", linear.sub("", TOML) + AERO_TABLE + "CM = [-0.02, -0.012, 0.0]\n")
    disc = read_recording(folder).disc
    assert disc is not None
    assert disc.aero_table is not None
    np.testing.assert_array_equal(disc.aero_table.CL, [-0.1, 0.13, 0.34])
    assert disc.aero is not None
    assert disc.aero.CMq == -0.15


def test_a_table_of_coefficients_in_degrees_is_refused_with_its_angles_in_radians(tmp_path):
    degrees = AERO_TABLE.replace("[-0.1, 0.0, 0.1]", "[-10.0, 0.0, 90.0]") + "CM = [-0.02, -0.012, 0.0]\n"
    text = TOML + degrees
    message = refusal(make(tmp_path / "flight", text))
    assert message.startswith(f"recording.toml:{line_of(text, '[disc.aero_table]')}: ")
    assert "alpha_rad runs from -10 to 90, expected angles of attack in radians" in message
    assert message.endswith("multiply each by pi/180 = 0.0174533: -0.1745 to 1.571")


def test_a_table_of_coefficients_may_go_all_around(tmp_path):
    """A half turn is rounded to four digits, as people write it."""
    around = AERO_TABLE.replace("[-0.1, 0.0, 0.1]", "[-3.142, 0.0, 3.142]") + "CM = [-0.02, -0.012, 0.0]\n"
    disc = read_recording(make(tmp_path / "flight", TOML + around)).disc
    assert disc is not None
    assert disc.aero_table is not None
    assert disc.aero_table.alpha[0] == -3.142


def test_a_table_of_CNr_may_stand_on_several_lines(tmp_path):
    text = TOML.replace("CNr = -0.0045\n", "") + CNR_TABLE.replace("], ", "],\n  ").replace("[[", "[\n  [")
    disc = read_recording(make(tmp_path / "flight", text)).disc
    assert disc is not None
    assert disc.yaw_damping_table is not None
    assert disc.yaw_damping_table.CNr.shape == (4, 4)
    np.testing.assert_allclose(np.degrees(disc.yaw_damping_table.rate), [4500, 4550, 4600, 4650], rtol=1e-15)


def test_the_line_of_an_error_is_right_after_a_matrix_on_several_lines(tmp_path):
    matrix = CNR_TABLE.replace("], ", "]\n  ,").replace("[[", "[\n  [")
    text = TOML.replace("[release]", f"{matrix}\n[release]\nrol_rad = 1.0")
    message = refusal(make(tmp_path / "flight", text))
    assert message.startswith(f"recording.toml:{line_of(text, 'rol_rad')}: ")


# ------------------------------------------------------------------------------------------ data sets


def test_a_data_set_is_its_recordings_in_name_order(tmp_path):
    for name in ("02", "10", "01"):
        make(tmp_path / name, TOML.replace('"field"', f'"throw {name}"'))
    (tmp_path / "answer.toml").write_text("not = 'read'")
    (tmp_path / "figures").mkdir()
    assert [recording.name for recording in read_dataset(tmp_path)] == ["throw 01", "throw 02", "throw 10"]


def test_one_recording_is_a_data_set_of_one(flight):
    assert [recording.name for recording in read_dataset(flight)] == ["field"]


def test_a_data_set_without_recordings_is_refused(tmp_path):
    (tmp_path / "answer.toml").write_text("")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"no recording in it; expected sub-folders with a recording.toml"):
        read_dataset(tmp_path)


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("throw.TXT", "; a raw log is brought in first, discsim import .* --out DIR$"),
        ("gyroscope.csv", r"; gyroscope.csv without the recording\.toml that states plant, place and parts$"),
        ("photo.jpg", r"sub-folders with a recording\.toml$"),
    ],
)
def test_what_else_lies_in_a_folder_without_a_recording_is_said(tmp_path, file, words):
    (tmp_path / file).write_text("")
    with pytest.raises(InputError, match=words):
        read_dataset(tmp_path)


@pytest.mark.parametrize(
    ("name", "words"),
    [("nowhere", "no such folder; expected a recording or a data set"), ("file", "this is a file; .* discsim import")],
)
def test_a_data_set_that_is_no_folder_is_refused(tmp_path, name, words):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=rf"{name}: {words}"):
        read_dataset(tmp_path / name)


def test_one_damaged_recording_of_a_data_set_is_named(tmp_path):
    make(tmp_path / "01")
    make(tmp_path / "02", TOML.replace("gravity", "levity"))
    with pytest.raises(InputError, match=r"02/recording.toml:5: missing key 'gravity_m_s2'"):
        read_dataset(tmp_path)


# ------------------------------------------------------------------------------------------ types


@pytest.mark.parametrize(
    ("t", "value", "says"),
    [
        ([0.0, 1.0], [1.0], "expected \\(n,\\) and"),
        ([[0.0]], [[1.0]], "expected \\(n,\\) and"),
        ([0.0, 0.0], [1.0, 2.0], "time runs from 0 to 0 s; expected ascending"),
        ([0.0, np.nan], [1.0, 2.0], "time stamp 1 is not finite"),
        ([0.0, 1.0], [1.0, np.inf], "a value is infinite; expected finite"),
    ],
)
def test_samples_check_their_shapes_and_times(t, value, says):
    with pytest.raises(ValueError, match=says):
        Samples(np.array(t), np.array(value))


def test_samples_are_copies_that_cannot_be_written():
    value = np.array([1.0, 2.0])
    samples = Samples(np.array([0.0, 1.0]), value)
    value[0] = 9.0
    assert samples.value[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        samples.value[0] = 9.0


def test_a_recording_has_known_sensors_with_sheets_and_the_right_width():
    t, sheets = np.array([0.0]), {"magnetometer": SensorSheet(100.0)}
    with pytest.raises(ValueError, match="unknown sensor 'compass'"):
        Recording("flight", "x", Environment(), samples={"compass": Samples(t, t)})
    with pytest.raises(ValueError, match="unknown sensor 'compass'"):
        Recording("flight", "x", Environment(), sheets={"compass": SensorSheet(100.0)})
    with pytest.raises(ValueError, match="gyroscope has samples but no sheet"):
        Recording("flight", "x", Environment(), sheets=sheets, samples={"gyroscope": Samples(t, np.zeros((1, 3)))})
    with pytest.raises(ValueError, match="magnetometer: got values \\(1, 2\\)"):
        Recording("flight", "x", Environment(), sheets=sheets, samples={"magnetometer": Samples(t, np.zeros((1, 2)))})


def test_a_recording_has_a_text_for_its_name():
    """Which plants there are is asked where one is made or read: a plant of one's own has a recording, too."""
    with pytest.raises(InputError, match="name is 7, of type int; expected a text"):
        Recording("flight", 7, Environment())


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"disc": None}, "missing key 'disc'"),
        ({"environment": Environment(air_density=None)}, "missing key 'air_density_kg_m3'"),
        ({"plant": "spin_down"}, "missing key 'rig'"),
        ({"rig": Rig(1e-3, 1e-5)}, "[rig] in a flight recording; expected it in spin_down only"),
        ({"command": Samples([0.0, 1.0], [0.0, 1.0])}, "a command in a flight; expected it in rate_table only"),
        ({"sheets": {"magnetometer": SensorSheet(-1.0)}}, "'sensors.magnetometer.rate_hz' is -1.0"),
        ({"sheets": {"magnetometer": SensorSheet(float("nan"))}}, "'sensors.magnetometer.rate_hz' is nan"),
    ],
)
def test_what_no_reader_takes_is_not_written(flight, tmp_path, changes, says):
    whole = read_recording(flight)
    sound = replace(whole, samples={"magnetometer": whole.samples["magnetometer"]})
    with pytest.raises(InputError, match=re.escape(says)):
        write_recording(replace(sound, **changes), tmp_path / "out")
    assert not (tmp_path / "out").exists()
