"""Every command that flies a disc says what cannot be about it, in the words of `check`."""

from __future__ import annotations

import pickle
import re
import sys
from dataclasses import replace
from importlib import import_module
from inspect import signature
from pathlib import Path

import numpy as np
import pytest

import discsim
from discsim.disc import Release
from discsim.files import model_file
from discsim.recording import Samples, write_recording
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict
from discsim.validation.checking.statements import unlikely_flight
from discsim.validation.cli import main

GRAMS = "mass_kg is 179; expected 0.08 to 0.22 kg; that is a disc in grams: write 0.179"
DEGREES = "it spins at 4200 rad/s; expected up to 250 rad/s; in deg/s?"


def run(monkeypatch, capsys, *arguments: str) -> tuple[int | str | None, str, str]:
    monkeypatch.setattr(sys, "argv", ["discsim", *arguments])
    with pytest.raises(SystemExit) as left:
        main()
    said = capsys.readouterr()
    return left.value.code, said.out, said.err


@pytest.fixture
def grams(tmp_path) -> str:
    text = model_file("discs/driver.toml").read_text("utf-8").replace("mass_kg = 0.179", "mass_kg = 179")
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    return str(tmp_path / "mine.toml")


@pytest.fixture
def degrees(tmp_path) -> str:
    text = model_file("throws/driver.toml").read_text("utf-8").replace("73.303829", "4200.0")
    (tmp_path / "throw.toml").write_text(text, "utf-8")
    return str(tmp_path / "throw.toml")


def planned(folder: Path, text: str) -> str:
    (folder / "plan.toml").write_text(f"[[recording]]\ntext = 'mine'\n{text}\n", "utf-8")
    return str(folder / "plan.toml")


def test_scatter_says_what_cannot_be(monkeypatch, capsys, tmp_path, grams, degrees):
    asked = ["scatter", "--flights", "100", "--disc", grams, "--throw", degrees, "--sd", "speed=0.5"]
    code, said, _ = run(monkeypatch, capsys, *asked, "--out", str(tmp_path / "out"))
    assert code == 0
    assert GRAMS in said
    assert DEGREES in said


def test_view_says_it_before_it_draws(monkeypatch, capsys, tmp_path, degrees):
    asked = ["view", "--disc", "driver", "--throw", degrees, "--video", "x.png", "--out", str(tmp_path)]
    code, said, error = run(monkeypatch, capsys, *asked)
    assert code == 2
    assert DEGREES in said
    assert "the disc turns at 4200 rad/s" in error


def test_a_plan_says_it_of_its_throws(monkeypatch, capsys, tmp_path, grams):
    file = planned(tmp_path, "velocity_ned_m_s = [24.0, 0.0, -4.0]\nbody_rate_rad_s = [0.0, 0.0, 4200.0]")
    code, said, error = run(monkeypatch, capsys, "plan", file, "--disc", grams, "--out", str(tmp_path / "out"))
    assert code == 2
    assert GRAMS in said
    assert DEGREES in said
    assert "'mine' cannot be recorded" in error


def test_a_plan_of_a_table_says_what_no_table_turns(monkeypatch, capsys, tmp_path):
    file = planned(tmp_path, "time_s = [0, 1, 5]\nrate_rad_s = [0, 2000, 2000]")
    code, said, _ = run(monkeypatch, capsys, "plan", file, "--plant", "rate_table", "--out", str(tmp_path / "out"))
    assert code == 0
    assert "'mine' asks for 114592 deg/s" in said
    assert "were deg/s meant under rate_rad_s?" in said
    assert "1 recording: " in said


def test_a_plan_that_is_a_folder_is_refused_with_the_option_for_one(monkeypatch, capsys, tmp_path):
    code, _, error = run(monkeypatch, capsys, "plan", str(tmp_path))
    assert code == 2
    assert f"--like {tmp_path}" in error


def test_nothing_is_said_of_what_is_shipped():
    assert unlikely_flight(*load_disc("driver"), load_throw("driver")) == []


def test_each_thing_is_said_once():
    disc, there = load_disc("driver")
    fast = Release(velocity=np.array([80.0, 0.0, 0.0]))
    said = unlikely_flight(replace(disc, mass=179.0), there, fast, fast)
    assert len(said) == 2


def test_a_path_in_another_unit_is_told_beside_its_picture(monkeypatch, capsys, tmp_path):
    disc, there = load_disc("driver")
    motion = predict(disc, there, load_throw("driver")).motion()
    module = Instruments.from_parts("mpu9250", "neo_m8n")
    made = record(motion, module, np.random.default_rng(0), plant="flight", name="mine", disc=disc)
    gps = made.need("gps")
    feet = Samples(gps.t, gps.value * np.array([3.2808] * 3 + [1.0] * 3))
    write_recording(replace(made, samples={**made.samples, "gps": feet}), tmp_path / "mine")
    asked = ["view", str(tmp_path / "mine"), "--video", "x.png", "--span", "5:1", "--out", str(tmp_path / "out")]
    _, said, error = run(monkeypatch, capsys, *asked)
    assert "the position in feet?" in said
    assert "no motion from 5 to 1 s" in error


@pytest.mark.parametrize(
    ("sd", "expected"), [("speed=0.5,speed=2", "'speed' stands there twice"), ("Speed=0.5", "did you mean 'speed'?")]
)
def test_a_standard_deviation_stated_twice_or_by_another_name_is_refused(monkeypatch, capsys, tmp_path, sd, expected):
    code, _, error = run(monkeypatch, capsys, "scatter", "--sd", sd, "--out", str(tmp_path / "out"))
    assert code == 2
    assert expected in error


FAST = "it is thrown at 90 m/s; expected up to 45; in km/h?"


@pytest.mark.parametrize("engine", ["fly", "predict"])
def test_python_warns_of_it_in_the_same_words_and_the_engines_are_silent(engine):
    """Warnings are errors here: the engines' own functions, which searches and workers call, give none."""
    disc, there = load_disc("driver")
    fast = replace(load_throw("driver"), velocity=np.array([90.0, 0.0, 0.0]))
    with pytest.warns(UserWarning, match=re.escape(FAST)) as told:
        flown = getattr(discsim, engine)(disc, there, release=fast, duration=0.05)
    assert [Path(one.filename) for one in told] == [Path(__file__)]
    silent = getattr(import_module({"fly": "discsim.engine", "predict": "discsim.trajectory"}[engine]), engine)
    again = silent(disc, there, fast, duration=0.05)
    np.testing.assert_array_equal(flown.t, again.t)
    assert signature(getattr(discsim, engine)) == signature(silent)


@pytest.mark.parametrize("engine", ["fly", "predict"])
def test_python_says_nothing_of_a_throw_and_refuses_as_the_engines_do(engine):
    disc, there = load_disc("driver")
    assert pickle.loads(pickle.dumps(getattr(discsim, engine))) is getattr(discsim, engine)
    getattr(discsim, engine)(disc, there, load_throw("driver"), duration=0.05)
    with pytest.raises(discsim.InputError, match="expected"):
        getattr(discsim, engine)(disc, there, load_throw("driver"), duration=-1.0)
