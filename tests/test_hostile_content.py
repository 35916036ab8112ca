"""Names, paths and texts of strangers: shown as they are, never executed, never followed out of a folder."""

from __future__ import annotations

import os
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from faults.harness import run
from fuzz.seeds import RAW, recording_files
from support import outcomes

from discsim.errors import InputError
from discsim.recording import read_recording, write_recording
from discsim.validation.diagnosis.report.files import write_outcome
from discsim.validation.diagnosis.result import NamedEffect, ParameterValue
from discsim.validation.importing.sniffing import opened
from discsim.validation.reporting.figures import new_figure, save_figure
from discsim.validation.reporting.html import Section, write_report

#: ends a cell, a paragraph, an attribute and a script, and begins an element, a formula and a template
MARKUP = "</td></p>\"'><img src=x onerror=alert(1)><script>alert(2)</script> $\\frac{$ {{ 7 * 7 }} `code` |"


class Elements(HTMLParser):
    """Counts what a page would do: its scripts, handlers of events, and addresses that it fetches."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.scripts, self.handlers, self.fetched, self.text = 0, [], [], ""
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.scripts += tag == "script"
        for name, value in attrs:
            if name.startswith("on"):
                self.handlers.append((tag, name))
            if name in ("src", "href") and not (value or "").startswith(("data:", "#")):
                self.fetched.append(value)

    def handle_data(self, data):
        self.text += data


def assert_harmless(page: Path) -> str:
    found = Elements(page)
    assert (found.scripts, found.handlers, found.fetched) == (1, [], [])
    return found.text


def test_markup_in_any_part_of_a_page_is_shown_as_text(tmp_path):
    figure, axes = new_figure()
    axes.plot([0, 1], [1, 2], label=MARKUP)
    axes.set(title=MARKUP, xlabel=MARKUP)
    axes.legend()
    save_figure(figure, tmp_path / "figure.png")
    section = Section(MARKUP, [MARKUP], [MARKUP], [[MARKUP]], [(MARKUP, tmp_path / "figure.png")])
    write_report(tmp_path / "report.html", MARKUP, MARKUP, [section])
    assert assert_harmless(tmp_path / "report.html").count(MARKUP) >= 6


def test_markup_in_the_names_of_a_diagnosis_is_shown_as_text(tmp_path):
    """Names of data sets and recordings, of an effect of the reader's own and its parameters, of candidates."""
    outcome = outcomes.explained()
    own = NamedEffect(MARKUP, {MARKUP: ParameterValue(1.0, 0.1)}, outcomes.TOUCH.evidence, (MARKUP,))
    answer = replace(
        outcome.diagnosis,
        datasets=(MARKUP,),
        effects=(own, *outcome.diagnosis.effects),
        located=tuple(replace(one, recording=MARKUP, text=MARKUP) for one in outcome.diagnosis.located[:1]),
        next_recordings=(MARKUP,),
        warnings=(MARKUP,),
    )
    residuals = tuple(replace(one, recording=MARKUP) for one in outcome.residuals[:4])
    write_outcome(replace(outcome, diagnosis=answer, residuals=residuals), tmp_path, {"command": MARKUP})
    assert MARKUP in assert_harmless(tmp_path / "report.html")


def test_a_recording_s_name_leads_nowhere_and_runs_nothing(tmp_path):
    """Two recordings called by a way out of the folder and by markup: nothing is written beside --out."""
    for number, name in enumerate(("../../evil", MARKUP)):
        files = recording_files("rate_table", 2.0)
        given = tmp_path / "given" / f"{number}"
        given.mkdir(parents=True)
        for file, text in files.items():
            (given / file).write_text(text, encoding="utf-8")
        write_recording(replace(read_recording(given), name=name), given)
    before = {path for path in tmp_path.rglob("*")}
    words = ["estimate", str(tmp_path / "given"), "--method", "gyroscope", "--out", str(tmp_path / "out")]
    assert run(words, tmp_path / "heard") == 0, (tmp_path / "heard").read_text()
    new = {path for path in tmp_path.rglob("*")} - before - {tmp_path / "heard"}
    assert new
    assert all(path.is_relative_to(tmp_path / "out") for path in new)


@pytest.mark.parametrize("name", ["../../evil", "/tmp/evil", MARKUP])
def test_a_map_s_name_leads_nowhere_and_runs_nothing(tmp_path, name):
    given = RAW()
    (tmp_path / "raw").mkdir()
    (tmp_path / "raw" / "log.csv").write_text(given["log.csv"], encoding="utf-8")
    text = given["map.toml"].replace('name = "seed"', f"name = '''{name}'''")
    (tmp_path / "map.toml").write_text(text, encoding="utf-8")
    words = ["import", f"{tmp_path}/raw/log.csv", "--map", f"{tmp_path}/map.toml", "--out", f"{tmp_path}/out"]
    assert run(words, tmp_path / "heard") == 0, (tmp_path / "heard").read_text()
    assert_harmless(tmp_path / "out" / "raw.html")
    assert {path.name for path in tmp_path.iterdir()} == {"raw", "map.toml", "out", "heard"}


def test_a_link_in_the_output_folder_is_replaced_and_not_followed(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "raw.html").symlink_to(tmp_path / "mine.txt")
    (tmp_path / "raw").mkdir()
    for name, text in RAW().items():
        (tmp_path / "raw" / name).write_text(text, encoding="utf-8")
    words = ["import", f"{tmp_path}/raw/log.csv", "--map", f"{tmp_path}/raw/map.toml", "--out", f"{tmp_path}/out"]
    assert run(words, tmp_path / "heard") in (0, 2)
    assert (tmp_path / "mine.txt").read_text() == "mine"


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="a system without devices")
@pytest.mark.parametrize("name", ["recording.toml", "gyroscope.csv"])
@pytest.mark.parametrize("kind", ["device", "pipe"])
def test_a_link_of_a_recording_to_what_never_ends_is_refused(tmp_path, name, kind):
    for file, text in recording_files("rate_table", 2.0).items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    (tmp_path / name).unlink()
    if kind == "pipe":
        os.mkfifo(tmp_path / "pipe")
    (tmp_path / name).symlink_to("/dev/zero" if kind == "device" else "pipe")
    with pytest.raises(InputError, match=rf"{name}: is a device or a pipe; expected"):
        read_recording(tmp_path)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="a system without devices")
def test_a_log_that_is_a_device_is_refused(tmp_path):
    (tmp_path / "log.csv").symlink_to("/dev/zero")
    with pytest.raises(InputError, match=r"log\.csv: is a device or a pipe; expected"), opened(tmp_path / "log.csv"):
        pass


def test_a_power_of_ten_on_an_axis_is_still_a_formula(tmp_path):
    """A dollar of a name is one; those of a logarithmic axis are matplotlib's own."""
    figure, axes = new_figure()
    axes.semilogy([1, 2], [1, 1000], label="$5")
    axes.legend()
    figure.canvas.draw()
    save_figure(figure, tmp_path / "figure.png")
    assert all(label.get_parse_math() for label in axes.get_yticklabels())
    assert not axes.get_legend().get_texts()[0].get_parse_math()
