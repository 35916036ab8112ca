"""The first mistakes in a plan of one's own: each is refused by name and line, or said aloud."""

from __future__ import annotations

import sys
import warnings

import pytest

from discsim.errors import InputError
from discsim.files import model_file
from discsim.validation.cli import main
from discsim.validation.sweeps.plan import read_plan
from discsim.validation.sweeps.swept import sweep

PLAN = """name = "mine"
[truth]
plant = "rate_table"
rates_deg_s = [1000, 2000]
hold_s = 2.0
ramp_s = 0.5
[axes]
radius_m = [0.01, 0.02]
[mounts]
design = "sobol"
count = 64
x_m = [-0.002, 0.002]
[estimators]
accelerometer = "all"
"""
IN_AIR = PLAN.replace('"rate_table"\nrates_deg_s = [1000, 2000]\nhold_s = 2.0\nramp_s = 0.5', '"flight"')


@pytest.fixture
def stated(tmp_path):
    """Write a plan with something in the place of something else; return its path."""

    def write(before: str, after: str, text: str = PLAN):
        assert before in text
        (tmp_path / "mine.toml").write_text(text.replace(before, after), "utf-8")
        return tmp_path / "mine.toml"

    return write


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("count = 64\n", "", r":9: missing key 'count' in \[mounts\]; expected a whole number from 1"),
        ("radius_m = [0.01, 0.02]", "effect.accel.bias.bx_m_s2 = [0, 1]", ":8: 'axes.effect.accel': .* in quotes"),
        ("[1000, 2000]", "[0, 0]", ":4: 'truth.rates_deg_s' holds no rate but zero"),
        ("radius_m = [0.01, 0.02]", 'effect = {"accel.bias.bx_m_s2" = [0, 1e40]}', ":8: 'accel.bias.bx_m_s2' has 1e"),
    ],
)
def test_a_mistake_is_refused_with_its_line(stated, before, after, expected):
    with pytest.raises(InputError, match=expected):
        read_plan(stated(before, after))


def test_rates_in_rad_s_and_rates_that_no_table_turns_are_doubted(stated):
    (slow,) = read_plan(stated("[1000, 2000]", "[17.45, 34.9]")).notes
    assert "reaches 34.9 deg/s only, slower than any throw; were rad/s meant? Then it is 2000" in slow
    (fast,) = read_plan(stated("[1000, 2000]", "[1000, 200000]")).notes
    assert fast.startswith("truth.rates_deg_s asks for 200000 deg/s")
    assert read_plan(stated("mine", "mine")).notes == ()


def test_a_profile_by_other_names_is_read_aloud(stated, tmp_path):
    (tmp_path / "p.csv").write_text("Time (s);Speed (rpm)\n0;0\n1;0\n2;300\n6;300\n", "utf-8")
    without = PLAN.replace("rates_deg_s = [1000, 2000]\nhold_s = 2.0\nramp_s = 0.5\n", "")
    (note,) = read_plan(stated("radius_m = [0.01, 0.02]", 'profile = "p.csv"', without)).notes
    assert note == "p.csv: 'Time (s)' and 'Speed (rpm)' are read as time and rate"


def test_a_disc_in_grams_is_told_and_named_where_its_flight_fails(stated, tmp_path):
    text = model_file("discs/driver.toml").read_text("utf-8").replace("mass_kg = 0.179", "mass_kg = 179")
    (tmp_path / "heavy.toml").write_text(text, "utf-8")
    plan = read_plan(stated("radius_m = [0.01, 0.02]", 'disc = ["driver", "heavy.toml"]', IN_AIR))
    (note,) = plan.notes
    assert note.startswith("disc heavy.toml: [disc]: mass_kg is 179;")
    with pytest.raises(InputError, match=r"^sweep 'mine', disc heavy.toml: a flight of 1.10 s"):
        sweep(plan, workers=1)


def test_rates_of_zero_and_below_are_scored_without_a_warning(stated, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = sweep(read_plan(stated("[1000, 2000]", "[0, 1000, -2000]")), workers=1)
        found.report(tmp_path / "out")
        assert {round(one.rate_deg_s) for one in found.tolerances(0.01)} == {1000, 2000}


def test_a_plan_that_varies_no_mount_tells_no_tolerance(stated, tmp_path, monkeypatch, capsys):
    """It said "at no rate, however it sits" of mounts that all sat where they should."""
    asked = ["discsim", "sweep", str(stated("x_m = [-0.002, 0.002]\n", "")), "--below", "1", "--workers", "1"]
    monkeypatch.setattr(sys, "argv", [*asked, "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 0
    said = capsys.readouterr().out
    assert "the plan varies no mount" in said
    assert "however it sits" not in said


def test_a_scheduler_without_a_port_is_refused_at_once(stated):
    with pytest.raises(InputError, match="--scheduler localhost: has no port; expected an address such as tcp://"):
        sweep(read_plan(stated("mine", "mine")), scheduler="localhost")
