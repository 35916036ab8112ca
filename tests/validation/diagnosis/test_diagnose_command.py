"""``discsim diagnose`` as a person types it: files, names of data sets, exit statuses. The fit has tests of its own."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.outcomes import OUTCOMES, explained

from discsim.disc import Rig
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.model_file import read_model
from discsim.recording import Recording, Samples, SensorSheet, write_recording
from discsim.validation.cli import main
from discsim.validation.diagnosis.datasets import dataset_names, read_datasets, recording_names

EFFECT = """from typing import NamedTuple
class Bias(NamedTuple):
    b_uT: float = 0.0
ID, ACTS_ON, SCALE = "my.bias", "magnetometer", (0.1,)
def apply(effect, readings, t, motion):
    return readings + effect.b_uT
"""


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["discsim", "diagnose", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def dataset(folder: Path, *names: str, plant: str = "spin_down") -> Path:
    t = np.arange(5) / 100.0
    for name in names:
        recording = Recording(
            plant,
            f"name of {name}",
            Environment(air_density=None),
            rig=Rig(1e-3, 3e-5) if plant == "spin_down" else None,
            sheets={"magnetometer": SensorSheet(100.0, 0.6)},
            samples={"magnetometer": Samples(t, np.ones((5, 3)))},
        )
        write_recording(recording, folder / name)
    return folder


@pytest.fixture
def asked(monkeypatch):
    """What the command asks of the fit, whose answer is made up here."""
    calls = []

    def diagnose(datasets, names, **options):
        options["progress"]("fitting", 1, 2)
        options["progress"]("fitting", 2, 2)
        calls.append((datasets, names, options))
        return replace(explained(), residuals=explained().residuals[:3])

    monkeypatch.setattr("discsim.validation.diagnosis.diagnosed.diagnose", diagnose)
    return calls


def test_it_writes_its_answer_and_the_model_and_says_the_verdict(monkeypatch, tmp_path, asked, capsys):
    out = tmp_path / "out"
    assert run(monkeypatch, str(dataset(tmp_path / "set", "01", "02")), "--out", str(out), "--seed", "7") == 0
    answer = json.loads((out / "diagnosis.json").read_text())
    assert answer == explained().diagnosis.to_json()
    assert [item.effect.id for item in read_model(out / "model.toml").effects] == ["air.wind", "event.impulse"]
    assert "discsim diagnose" in (out / "report.html").read_text()
    assert (out / "residuals-magnetometer.png").is_file()
    assert json.loads((out / "run.json").read_text())["seed"] == 7
    ((datasets, names, options),) = asked
    assert names == ["set"]
    assert [recording.name for recording in datasets[0]] == ["name of 01", "name of 02"]
    assert options["seed"] == 7
    said = capsys.readouterr()
    assert said.out.startswith("explained: The baseline leaves out a steady wind")
    assert said.err == "fitting (step 2 of 2)\n"


def test_an_effect_of_ones_own_is_handed_on_and_its_file_kept_in_the_run(monkeypatch, tmp_path, asked):
    (tmp_path / "mine.py").write_text(EFFECT)
    folder = dataset(tmp_path / "set", "01")
    arguments = (str(folder), "--with", str(tmp_path / "mine.py"), "--out", str(tmp_path / "out"))
    assert run(monkeypatch, *arguments) == 0
    ((_, _, options),) = asked
    assert [effect.id for effect in options["user_effects"]] == ["my.bias"]
    assert str(tmp_path / "mine.py") in json.loads((tmp_path / "out" / "run.json").read_text())["inputs"]


def test_a_list_of_recordings_that_could_be_made_is_handed_on_and_kept_in_the_run(monkeypatch, tmp_path, asked):
    (tmp_path / "mine.toml").write_text("[[recording]]\nrate_rad_s = 30.0\nduration_s = 60.0\n")
    folder = dataset(tmp_path / "set", "01")
    arguments = (str(folder), "--candidates", str(tmp_path / "mine.toml"), "--out", str(tmp_path / "out"))
    assert run(monkeypatch, *arguments) == 0
    ((_, _, options),) = asked
    assert [plan.duration for plan in options["plans"]] == [60.0]
    assert str(tmp_path / "mine.toml") in json.loads((tmp_path / "out" / "run.json").read_text())["inputs"]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["absent"], "no such folder"),
        (["set", "set"], "given twice"),
        (["set", "table"], "expected recordings of one plant"),
        (["set", "--with", "absent.py"], "no such file"),
        (["set", "--out", "set"], "is the input"),
        ([], "Missing argument"),
    ],
)
def test_input_that_cannot_be_used_is_one_line_and_leaves_nothing(
    monkeypatch, tmp_path, asked, capsys, arguments, expected
):
    monkeypatch.chdir(tmp_path)
    dataset(Path("set"), "01")
    dataset(Path("table"), "01", plant="free_spin")
    before = sorted(tmp_path.rglob("*"))
    assert run(monkeypatch, *arguments) == 2
    error = capsys.readouterr().err
    assert expected in error
    assert error.count("\n") == 1
    assert asked == []
    assert sorted(tmp_path.rglob("*")) == before


def test_recordings_of_several_sets_are_named_by_set_and_folder(tmp_path):
    folders = [dataset(tmp_path / "monday", "01", "02"), dataset(tmp_path / "tuesday", "01")]
    assert recording_names(*read_datasets(folders)) == [["monday/01", "monday/02"], ["tuesday/01"]]
    assert recording_names(*read_datasets(folders[:1])) == [["01", "02"]]
    assert recording_names(*read_datasets([folders[0] / "02"])) == [["02"]]


def test_sets_of_one_name_are_told_apart_by_their_parents(tmp_path):
    assert dataset_names([tmp_path / "monday" / "throws", tmp_path / "tuesday" / "throws"]) == [
        "monday-throws",
        "tuesday-throws",
    ]
    with pytest.raises(InputError, match="given twice"):
        dataset_names([tmp_path / "a", tmp_path / "b" / ".." / "a"])


def test_the_made_up_answers_hold_every_verdict():
    assert [make().diagnosis.verdict for make in OUTCOMES.values()] == list(OUTCOMES)
