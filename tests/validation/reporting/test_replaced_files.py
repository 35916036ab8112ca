"""What discsim did not write is never overwritten, and what it wrote is."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from discsim.errors import InputError
from discsim.files import write_text
from discsim.recording import read_recording, write_recording
from discsim.validation.cli import main
from discsim.validation.reporting.run import start_run
from discsim.validation.reporting.written import OVERWRITE


def run(out: Path, text: str) -> None:
    with start_run(out):
        write_text(out / "answer.txt", text)


def stopped(out: Path) -> None:
    with start_run(out):
        write_text(out / "answer.txt", "half")
        raise KeyboardInterrupt


def test_a_second_run_writes_over_the_first_and_over_no_stranger(tmp_path):
    run(tmp_path, "one")
    run(tmp_path, "two")
    assert (tmp_path / "answer.txt").read_text() == "two"
    other = tmp_path / "other"
    other.mkdir()
    (other / "answer.txt").write_text("mine")
    with pytest.raises(InputError, match=r"answer\.txt: is there, and discsim did not write it"):
        run(other, "theirs")
    assert (other / "answer.txt").read_text() == "mine"


def test_what_was_changed_since_is_somebody_s_work(tmp_path):
    run(tmp_path, "one")
    (tmp_path / "answer.txt").write_text("one, and my notes")
    with pytest.raises(InputError, match="or it was changed since"):
        run(tmp_path, "two")
    token = OVERWRITE.set(True)
    try:
        run(tmp_path, "two")
    finally:
        OVERWRITE.reset(token)
    assert (tmp_path / "answer.txt").read_text() == "two"


def test_a_run_that_was_stopped_does_not_stand_in_the_way_of_the_next(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        stopped(tmp_path)
    assert not (tmp_path / "run.json").exists()
    run(tmp_path, "whole")
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["answer.txt", "run.json"]


def test_a_run_that_was_killed_does_not_stand_in_the_way_of_the_next(tmp_path):
    """Nothing runs behind a signal that kills: what is being written is said before it is."""
    killed = (
        "import os, signal, sys; from pathlib import Path; from discsim.files import write_text\n"
        "from discsim.validation.reporting.run import start_run\n"
        "out = Path(sys.argv[1])\n"
        "with start_run(out):\n"
        "    write_text(out / 'answer.txt', 'half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert subprocess.run([sys.executable, "-c", killed, str(tmp_path)], check=False).returncode == -signal.SIGKILL
    assert (tmp_path / "answer.txt").read_text() == "half"
    (tmp_path / "mine.txt").write_text("mine")
    run(tmp_path, "whole")
    assert (tmp_path / "answer.txt").read_text() == "whole"
    assert {path.name for path in tmp_path.iterdir()} == {"answer.txt", "mine.txt", "run.json"}


def test_a_folder_of_before_there_was_a_list_is_taken_as_discsim_s(tmp_path):
    run(tmp_path, "one")
    told = json.loads((tmp_path / "run.json").read_text())
    assert list(told.pop("files")) == ["answer.txt"]
    (tmp_path / "run.json").write_text(json.dumps(told))
    run(tmp_path, "two")
    assert (tmp_path / "answer.txt").read_text() == "two"


def test_a_run_keeps_what_it_has_written_of_an_earlier_one_in_its_list(tmp_path):
    with start_run(tmp_path):
        write_text(tmp_path / "other.txt", "kept")
    run(tmp_path, "one")
    with start_run(tmp_path):
        write_text(tmp_path / "other.txt", "written anew")


def test_a_measured_recording_is_no_place_for_a_simulated_one(tmp_path):
    (tmp_path / "recording.toml").write_text(
        'format = "discsim-recording/1"\nplant = "free_spin"\nname = "mine"\n[environment]\ngravity_m_s2 = 9.8\n'
        "magnetic_field_ned_uT = [30.0, 0.0, 40.0]\n[sensors.magnetometer]\nrate_hz = 100.0\n"
    )
    (tmp_path / "magnetometer.csv").write_text("time_s,x_uT,y_uT,z_uT\n0,1,2,3\n0.01,1,2,3\n")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    with pytest.raises(InputError, match="discsim did not write it"), start_run(tmp_path):
        write_recording(read_recording(tmp_path), tmp_path)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


@pytest.mark.parametrize(("words", "found"), [("discsim sc", ["scatter", "score"]), ("discsim fly --sp", ["--speed"])])
def test_a_shell_completes_commands_and_their_options(words, found, monkeypatch, capsys):
    monkeypatch.setenv("_DISCSIM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    monkeypatch.setattr(sys, "argv", ["discsim"])
    with pytest.raises(SystemExit):
        main()
    assert set(found) <= set(capsys.readouterr().out.split())


def recorded(out: Path, folders: list[str]) -> None:
    with start_run(out) as run:
        for folder in folders:
            write_text(out / folder / "recording.toml", folder)
            write_text(out / folder / "gyroscope.csv", "1")
        run.replace_recordings()


def test_recordings_of_an_earlier_run_go_where_a_later_one_has_fewer(tmp_path, capsys):
    """A log of one throw after one of two left the second: two logs were one data set."""
    recorded(tmp_path, ["01", "02"])
    recorded(tmp_path, ["01"])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["01", "run.json"]
    assert list(json.loads((tmp_path / "run.json").read_text())["files"]) == ["01/gyroscope.csv", "01/recording.toml"]
    assert (
        f"taken away: the recording that an earlier run had written into {tmp_path / '02'}" in capsys.readouterr().err
    )


def test_what_somebody_put_beside_an_earlier_recording_stays(tmp_path):
    recorded(tmp_path, ["01", "02"])
    (tmp_path / "02" / "notes.txt").write_text("windy")
    recorded(tmp_path, ["01"])
    assert [path.name for path in (tmp_path / "02").iterdir()] == ["notes.txt"]


def test_an_earlier_recording_that_was_changed_since_is_refused(tmp_path):
    recorded(tmp_path, ["01", "02"])
    (tmp_path / "02" / "gyroscope.csv").write_text("2")
    with pytest.raises(InputError, match=r"02.gyroscope\.csv: is of an earlier run, and was changed since"):
        recorded(tmp_path, ["01"])
    assert (tmp_path / "02" / "gyroscope.csv").read_text() == "2"
