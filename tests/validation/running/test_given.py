"""Recordings as a caller has them, and what is said where some of a folder are no part of it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from support.recording_folder import make

import discsim as ds
from discsim.validation.cli import main
from discsim.validation.running.given import given_recordings, read_given

NOT_READ = (
    r"is a recording itself, so 2 in its sub-folders \(a, b\) are not read; to read all as one data set, move its own "
    r"recording\.toml and CSV files into a sub-folder, too"
)


@pytest.fixture
def both(tmp_path: Path) -> Path:
    """A folder that is a recording and holds two in sub-folders."""
    folder = make(tmp_path / "day")
    for name in ("a", "b"):
        make(folder / name)
    return folder


def test_recordings_below_a_recording_are_named_as_not_read(both: Path):
    said: list[str] = []
    assert [recording.path for recording in read_given(both, said.append)] == [both]
    (sentence,) = said
    assert re.search(NOT_READ, sentence)


def test_python_warns_of_them(both: Path):
    with pytest.warns(UserWarning, match=NOT_READ):
        assert len(given_recordings(both)) == 1


def test_the_remedy_reads_all(both: Path):
    (both / "c").mkdir()
    for file in [file for file in both.iterdir() if file.is_file()]:
        file.rename(both / "c" / file.name)
    said: list[str] = []
    assert [recording.path for recording in read_given(both, said.append)] == [both / name for name in "abc"]
    assert said == []


@pytest.mark.parametrize("other", ["answer.toml", "figures/fit.png"])
def test_nothing_is_said_of_other_files_and_folders(tmp_path: Path, other: str):
    folder = make(tmp_path / "throw")
    (folder / other).parent.mkdir(exist_ok=True)
    (folder / other).write_text("")
    said: list[str] = []
    read_given(folder, said.append)
    assert said == []


def test_a_command_says_it_on_the_standard_error(both: Path, monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.setattr("sys.argv", ["discsim", "check", str(both)])
    with pytest.raises(SystemExit):
        main()
    assert re.search(f"^note: .*{NOT_READ}", " ".join(capsys.readouterr().err.split()))


@pytest.mark.parametrize("given", [None, 5, np.zeros((3, 3)), [np.zeros(3)]])
def test_what_is_no_recording_is_refused_with_what_makes_one(given: object):
    with pytest.raises(ds.InputError, match=r"recordings are of type .*recording_from_arrays makes a recording of arr"):
        given_recordings(given)  # type: ignore[arg-type]
