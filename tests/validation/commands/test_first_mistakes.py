"""docs/a-strangers-log.md lists what `discsim import` says to first mistakes: each is made here, and said so."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.places import ROOT

from discsim.validation.cli import main
from discsim.validation.scenarios.example_log import write_example_log

PAGE = (ROOT / "docs" / "a-strangers-log.md").read_text(encoding="utf-8")
NAMES = ["timestamp_ms", "gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz"]
FORMATS = ["%d", *["%.4f"] * 6, *["%.2f"] * 3]
GYRO, ACCEL, MAG = slice(1, 4), slice(4, 7), slice(7, 10)


def rows(folder: Path, throws: int = 1, spin_deg_s: float = 1500.0) -> np.ndarray:
    """Return a sound log (n, 10): ms, deg/s, g, uT."""
    write_example_log(folder / "made.csv", throws, spin_deg_s, seed=3)
    made = np.loadtxt(folder / "made.csv", delimiter=",", skiprows=1)
    return np.column_stack([made[:, 0], made[:, 4:7], made[:, 1:4], made[:, 7:10]])


def text(table: np.ndarray, unit: dict[str, str] | None = None, formats: list[str] = FORMATS, sep: str = ",") -> str:
    """Return the text of a log, the units of ``unit`` after the names that begin so."""
    header = [
        next((name + end for start, end in (unit or {}).items() if name.startswith(start)), name) for name in NAMES
    ]
    lines = (sep.join(form % cell for form, cell in zip(formats, row, strict=True)) for row in table)
    return "\n".join([sep.join(header), *lines, ""])


def scaled(table: np.ndarray, columns: slice, factor: float) -> np.ndarray:
    table[:, columns] *= factor
    return table


def restarted(table: np.ndarray) -> np.ndarray:
    half = len(table) // 2
    table[half:, 0] -= table[half, 0] - 13.0
    return table


def wrapped(table: np.ndarray, end: float) -> np.ndarray:
    table[:, GYRO] = (table[:, GYRO] + end) % (2 * end) - end
    return table


MISTAKES: dict[str, Callable[[Path], str]] = {
    "rad/s under a header of deg/s": lambda folder: text(scaled(rows(folder), GYRO, np.pi / 180), {"g": "_dps"}),
    "milligauss under a header of uT": lambda folder: text(scaled(rows(folder), MAG, 10.0), {"m": "_uT"}),
    "m/s² under a header of g": lambda folder: text(scaled(rows(folder), ACCEL, 9.80665), {"a": "_g"}),
    "seconds under a header of ms": lambda folder: text(
        scaled(rows(folder), slice(0, 1), 1e-3), formats=["%.3f", *FORMATS[1:]]
    ),
    "no header": lambda folder: text(rows(folder)).split("\n", 1)[1],
    "semicolons and decimal commas": lambda folder: text(rows(folder), sep=";").replace(".", ","),
    "a clock that starts anew": lambda folder: text(restarted(rows(folder, throws=2))),
    "a gyroscope at the end of its range": lambda folder: text(rows(folder, spin_deg_s=3600.0)),
    "a gyroscope whose register overflows": lambda folder: text(wrapped(rows(folder), 1000.0)),
    "one axis reversed, one throw": lambda folder: text(scaled(rows(folder), slice(9, 10), -1.0)),
    "one axis reversed, two throws": lambda folder: text(scaled(rows(folder, throws=2), slice(9, 10), -1.0)),
}


def listed() -> dict[str, str]:
    """Return the mistakes of the page and what is said to each."""
    return dict(re.findall(r"^\| ([^|`]+) \| `([^`]+)` \|$", PAGE, re.M))


def test_the_page_lists_the_mistakes_that_are_made_here():
    assert list(listed()) == list(MISTAKES)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_told_as_the_page_says(mistake, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    Path("my-log.csv").write_text(MISTAKES[mistake](tmp_path))
    place = ["--place", "37.57,126.98", "--date", "2022-01-01"]
    monkeypatch.setattr(sys, "argv", ["discsim", "import", "my-log.csv", "--all-throws", *place, "--out", "throws"])
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code
    captured = capsys.readouterr()
    start, _, end = listed()[mistake].partition(" ... ")
    said = [line for line in (captured.err + captured.out).splitlines() if line.startswith(start)]
    assert said, captured.err
    assert said[0].endswith(end)


def test_a_place_without_a_date_is_refused_before_the_log_is_read(monkeypatch, tmp_path, capsys):
    """It was refused when all was read, with half a folder left behind."""
    monkeypatch.chdir(tmp_path)
    Path("my-log.csv").write_text("no log at all\n")
    argv = ["discsim", "import", "my-log.csv", "--place", "37.57,126.98", "--out", "throw"]
    monkeypatch.setattr(sys, "argv", argv)
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    assert "--place LAT,LON and --date YYYY-MM-DD belong together" in capsys.readouterr().err
    assert not Path("throw").exists()


@pytest.mark.parametrize("words", [["a.csv", "b.csv"], ["a.csv", "--place", "47.4", "8.5"]])
def test_a_word_too_many_is_told_with_how_the_command_is_called(words, monkeypatch, capsys):
    """Two files of a log, and a place with a space in it."""
    monkeypatch.setattr(sys, "argv", ["discsim", "import", *words])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    said = capsys.readouterr().err
    assert f"extra argument(s) ({words[-1]}); expected `discsim import [OPTIONS] RAW`, and quotes" in said
