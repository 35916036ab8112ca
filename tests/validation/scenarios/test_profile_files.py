"""Profiles of a rate table as others write them, and a profile in the wrong unit."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from discsim.errors import InputError
from discsim.rate_tables import RateTable, load_table
from discsim.recording import Samples
from discsim.table_drive import TableDrive
from discsim.validation.cli import main
from discsim.validation.scenarios.profile_files import Profile, fastest_shipped, read_knots, speed_note

KNOTS = "0,0\n1,600\n3,600\n4,0\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "profile.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        f"time_s,rate_deg_s\n{KNOTS}",
        f"Time (s),Rate (deg/s)\n{KNOTS}",
        f"t,speed_dps\n{KNOTS}",
        "Time (ms);Speed (rpm)\n0;0\n1000;100\n3000;100\n4000;0\n",
        "time;target_rate_dps\n0,0;0\n1,0;600,0\n3,0;600,0\n4,0;0\n",
        "time_s\trate_rpm\n0\t0\n1\t100\n3\t100\n4\t0\n",
        "time_s,rate_deg_s\r\n" + KNOTS.replace("\n", "\r\n"),
        f"timestamp,yaw_rate_deg_s\n{KNOTS}",
        "time_s,rate_deg_s,remark\n0,0,\n1,600,hold\n3,600,\n4,0,\n",
        "t_s,rate_deg_s\n12,0\n13,600\n15,600\n16,0\n",
    ],
)
def test_a_profile_is_read_whatever_its_names_units_and_separators(tmp_path, text):
    knots = read_knots(written(tmp_path, text)).knots
    np.testing.assert_allclose(knots.t, [0.0, 1.0, 3.0, 4.0], atol=1e-12)
    np.testing.assert_allclose(np.degrees(knots.value), [0.0, 600.0, 600.0, 0.0], atol=1e-9)


def test_what_was_read_under_other_names_is_said(tmp_path):
    notes = read_knots(written(tmp_path, "Time (s),Speed (rpm)\n5,0\n6,100\n")).notes
    assert "'Time (s)' and 'Speed (rpm)' are read as time and rate" in notes[0]
    assert "begins at 5 s; it is counted from there" in notes[1]
    assert read_knots(written(tmp_path, f"time_s,rate_deg_s\n{KNOTS}")).notes == ()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("when,how\n0,0\n1,1\n", r"profile.csv:1: header when, how; expected time_s and one of rate_rad_s"),
        ("t,dps\n0,0\n1,\n2,5\n", r"profile.csv:3: has no rate; expected a number"),
        ("t,dps\n0,0\n", r"profile.csv:2: one knot only; expected at least two"),
        ("t,dps\n0,0\n2,1\n1,1\n", r"profile.csv:4: time 1 s follows 2 s"),
        ("t,dps\n0,0\n\n1,1\n9999,1\n", r"profile.csv:5: the profile ends at 9999 s, expected at most 3600 s"),
        ("t,dps,method\n0,0,a\n1,0,b\n", r"holds 2 methods; expected one profile"),
    ],
)
def test_what_is_wrong_in_a_file_is_named_with_its_line(tmp_path, text, expected):
    with pytest.raises(InputError, match=expected):
        read_knots(written(tmp_path, text))


def test_degrees_per_second_under_rad_per_second_are_asked_about(tmp_path):
    header = "time_s,rate_rad_s"
    note = speed_note(read_knots(written(tmp_path, f"{header}\n0,0\n1,3000\n")), RateTable())
    assert note is not None
    assert "--profile asks for 171887 deg/s" in note
    assert "were deg/s meant under rad/s? Then the header is 'time_s,rate_deg_s'" in note
    assert speed_note(read_knots(written(tmp_path, f"{header}\n0,0\n1,87\n")), RateTable()) is None


def test_a_profile_beyond_the_drive_is_said_and_not_one_up_to_it():
    table = RateTable(drive=TableDrive(largest_rate=50.0))

    def asks(rate: float) -> Profile:
        return Profile(Samples(np.array([0.0, 1.0]), np.array([0.0, rate])), in_radians=False)

    note = speed_note(asks(50.1), table)
    assert note is not None
    assert note.endswith("and the table turns at most 2864.79 deg/s")
    assert speed_note(asks(50.0), table) is None


def test_the_fastest_shipped_table_is_read_from_its_file():
    assert fastest_shipped() == load_table("workshop").drive.largest_rate


def test_the_command_says_what_it_read(tmp_path, monkeypatch, capsys):
    profile = written(tmp_path, "Time (ms);Speed (rpm)\n0;0\n500;0\n1000;100\n2500;100\n")
    words = ["discsim", "rate-table", "--profile", str(profile), "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit):
        main()
    assert "note: profile.csv: 'Time (ms)' and 'Speed (rpm)' are read as time and rate" in capsys.readouterr().out
    truth = np.loadtxt(tmp_path / "out" / "truth.csv", delimiter=",", skiprows=1)
    assert np.degrees(truth[-1, 1]) == pytest.approx(600.0, rel=1e-3)
