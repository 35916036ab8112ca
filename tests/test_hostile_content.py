"""Names, paths and texts of strangers: shown as they are, never executed, never followed out of a folder."""

from __future__ import annotations

import csv
import json
import os
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from faults.harness import run
from fuzz.seeds import RAW, recording_files
from support import outcomes

from discsim.errors import InputError, printable
from discsim.files import model_file
from discsim.recording import read_recording, write_recording
from discsim.validation.challenge.cases.conceal import Answer
from discsim.validation.challenge.report.page import write_page as write_challenge_page
from discsim.validation.challenge.scores.result import Scored
from discsim.validation.challenge.scores.scoring import score_case
from discsim.validation.diagnosis.report.files import write_outcome
from discsim.validation.diagnosis.result import NamedEffect, ParameterValue
from discsim.validation.experiments.validation_report import write_validation_report
from discsim.validation.importing.sniffing import opened
from discsim.validation.reporting.ci import github_commands, markdown_summary
from discsim.validation.reporting.figures import new_figure, save_figure
from discsim.validation.reporting.html import Section, write_report
from discsim.validation.reporting.markdown import literal
from discsim.validation.reporting.regression import compare_scores, write_regression
from discsim.validation.reporting.run import start_run
from discsim.validation.reporting.scores import at_most, write_junit
from discsim.validation.sweeps.cases import Row, write_rows

#: ends a cell, a paragraph, an attribute and a script, and begins an element, a formula and a template
MARKUP = "</td></p>\"'><img src=x onerror=alert(1)><script>alert(2)</script> $\\frac{$ {{ 7 * 7 }} `code` |"
#: the same as a name that a file may have
FILE = MARKUP.replace("/", "") + " javascript:alert(3)"


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


@pytest.fixture
def given(tmp_path) -> Path:
    """A folder whose path is markup, with a plan, a part, a rate table and a fit whose texts are."""
    folder = tmp_path / FILE
    folder.mkdir()
    recording = f"[[recording]]\ntext = '''{MARKUP}'''\ntime_s = [0.0, 1.0, 5.0]\nrate_rad_s = [20.0, 60.0, 60.0]\n"
    (folder / "plan.toml").write_text(recording)
    for kind, name in (("parts", "mpu9250"), ("tables", "workshop")):
        shipped = model_file(f"{kind}/{name}.toml").read_text(encoding="utf-8")
        first = next(line for line in shipped.splitlines() if line.startswith("name = "))
        (folder / f"{name}.toml").write_text(shipped.replace(first, f"name = '''{MARKUP}'''"))
    (folder / "cnr.json").write_text(json.dumps({"CNr": {"value": -0.0045, "sd": 1e-4}}))
    (folder / "profile.csv").write_text("time_s,rate_deg_s\n0,0\n1,500\n4,500\n5,1500\n8,1500\n")
    return folder


def page_of(words: list[str], given: Path) -> str:
    """Run a command that writes into a folder below the given one; return the harmless text of its page."""
    assert run([*words, "--out", str(given / "out")], given / "heard") == 0, (given / "heard").read_text()
    return assert_harmless(given / "out" / "report.html")


def test_markup_in_a_plan_is_shown_as_text(given):
    plan, part = str(given / "plan.toml"), str(given / "mpu9250.toml")
    words = ["plan", plan, "--plant", "rate_table", "--candidates", plan, "--parts", part, "--instead", part]
    text = page_of(words, given)
    assert text.count(MARKUP) >= 2  # as a recording, and as the next one
    assert text.count(FILE) >= 2  # as other hardware, and in the command


def test_markup_in_what_a_scatter_begins_with_is_shown_as_text(given):
    words = ["scatter", "--flights", "100", "--sd", "speed=0.5", "--fit", str(given / "cnr.json")]
    assert page_of(words, given).count(f"{FILE}/cnr.json") == 2  # from where C_Nr is, and in the command


def test_markup_in_the_parts_of_a_rate_table_and_in_a_measured_run_s_name_is_shown_as_text(given):
    files = ("--table", "workshop.toml", "--parts", "mpu9250.toml", "--profile", "profile.csv")
    words = [word if word.startswith("--") else str(given / word) for word in files]
    assert page_of(["rate-table", *words, "--radius", "0.03"], given).count(FILE) >= 3

    measured = (given / "out").rename(given / "measured")
    write_recording(replace(read_recording(measured), name=MARKUP), measured)
    page_of(["rate-table", "--recording", str(measured)], given)
    heading = (given / "out" / "comparison.md").read_text(encoding="utf-8").splitlines()[0]
    assert heading == f"# {literal(MARKUP)}, measured and emulated"


def test_markup_in_the_names_of_a_validation_is_shown_as_text(tmp_path):
    """Of throws and recordings, of scores of an earlier run and its folder, of a concealed case and its command."""
    score = at_most(f"recordings: {MARKUP}", 2.0, "m", 1.0)
    write_regression(tmp_path, compare_scores([replace(score, name=f"{MARKUP} once")], [score]), MARKUP)
    assert assert_harmless(tmp_path / "against.html").count(MARKUP) == 4  # title, heading and two scores
    figures = ("rate-table", "throws", "cnr", "cnr-sources", "cnr-table", "feedback")
    for name in figures:
        save_figure(new_figure()[0], tmp_path / f"{name}.png")
    thrown = SimpleNamespace(throw=SimpleNamespace(name=MARKUP), rates={"best": None}, error=lambda _: np.zeros(2))
    loop = SimpleNamespace(flown=[SimpleNamespace(predicted=[])], found=[], by_table={})
    concealed = SimpleNamespace(row=(MARKUP, MARKUP, "ok", MARKUP))
    with start_run(tmp_path, 0) as started:
        write_validation_report(started, [score], [thrown], loop, [concealed])
    assert assert_harmless(tmp_path / "report.html").count(MARKUP) == 5


def test_a_score_s_name_forges_no_line_of_a_log_and_no_row_of_a_summary(tmp_path):
    """GitHub obeys a line that begins with two colons; a page in Markdown may be shown as HTML."""
    name = f"recordings: {MARKUP} [a](javascript:alert(3))\n::error::all is lost\x01\n| all | 1 | 1 | 0 | ok |"
    scores = [at_most(name, 2.0, "m", 1.0)]
    said = [scores[0].text, *github_commands(scores, compare_scores(scores, []))]
    assert not any("\n" in line for line in said)
    lines = markdown_summary("discsim validate", scores).splitlines()
    rows = [line for line in lines if "all is lost" in line]
    assert len(rows) == 2  # what fails, and every score
    for row in rows:
        assert len(re.findall(r"(?<!\\)\|", row)) == 6
        assert not re.search(r"(?<!\\)[<`\[]", row)
    write_junit(tmp_path / "scores.xml", scores, 1.0)
    (case,) = ElementTree.parse(tmp_path / "scores.xml").getroot()[0]
    assert case.get("name") == printable(name).removeprefix("recordings: ")


def test_markup_in_the_cases_of_a_challenge_is_shown_as_text(tmp_path):
    """A law in words, an error of a diagnosis, and the command of a case."""
    answer = Answer(5, "spin_down", "off_catalogue", "unexplained", law=MARKUP)
    case = Scored(answer, None, score_case(answer, None), MARKUP, 1.0, "0" * 64, reproduce=f"discsim {MARKUP}")
    write_challenge_page(tmp_path, [case])
    assert assert_harmless(tmp_path / "report.html").count(MARKUP) == 3


def test_a_comma_or_a_bar_in_the_name_of_parts_stays_in_its_cell_of_a_sweep(tmp_path):
    name = f'{MARKUP},\n"1"'
    rows = [Row({"parts": name}, "fft", 500.0, 64, 1.0, 0.1, 0.2, float("nan"))]
    write_rows(tmp_path, rows)
    with (tmp_path / "cases.csv").open(newline="") as stream:
        head, *lines = csv.reader(stream)
    assert [dict(zip(head, line, strict=True))["parts"] for line in lines] == [name]
    (row,) = (tmp_path / "cases.md").read_text(encoding="utf-8").splitlines()[2:]
    assert len(re.findall(r"(?<!\\)\|", row)) == len(head) + 1
    assert not re.search(r"(?<!\\)[<`\[]", row)


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
