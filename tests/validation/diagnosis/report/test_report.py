"""The report of a diagnosis: each verdict can be read from it, its figures are in it, and nothing else is needed."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from support.outcomes import OUTCOMES, explained, unexplained

from discsim.effects import CATALOGUE
from discsim.validation.diagnosis.diagnosed import Diagnosed
from discsim.validation.diagnosis.report.figures import draw_overview, draw_sensor
from discsim.validation.diagnosis.report.page import draw_figures, verdict_sentence, write_diagnosis_report
from discsim.validation.diagnosis.report.wording import everyday, form, found, law_text, plus_minus, unit
from discsim.validation.diagnosis.result import Confusion, Evidence, NamedEffect, Outcome, ParameterValue, Residuals


class Page(HTMLParser):
    """Checks that tags close in order, and gathers the text and what is loaded from elsewhere."""

    EMPTY = ("meta", "img", "br")

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""
        self.sources: list[str] = []
        self.feed(html)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.sources += [
            value or "" for name, value in attrs if name in ("src", "href") and not (value or "").startswith("#")
        ]
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def page(outcome: Outcome, folder: Path, figures: list[tuple[str, Path]] | None = None) -> Page:
    write_diagnosis_report(folder / "report.html", outcome, figures or [], {"seed": "0"})
    return Page((folder / "report.html").read_text(encoding="utf-8"))


@pytest.mark.parametrize("verdict", OUTCOMES)
def test_each_verdict_is_said_in_a_sentence_and_the_page_needs_nothing_else(verdict, tmp_path):
    outcome = OUTCOMES[verdict]()
    read = page(outcome, tmp_path)
    assert outcome.diagnosis.verdict == verdict
    assert verdict_sentence(outcome.diagnosis) in read.text
    assert [source for source in read.sources if not source.startswith("data:")] == []


def test_every_figure_is_written_and_embedded(tmp_path):
    outcome = explained()
    short = tuple(
        replace(item, t=item.t[:60], before=item.before[:60], after=item.after[:60]) for item in outcome.residuals[:24]
    )
    outcome = replace(outcome, residuals=short)
    figures = draw_figures(outcome, tmp_path)
    assert [path.name for _, path in figures] == [
        "residuals.png",
        *(f"residuals-{sensor}.png" for sensor in ("magnetometer", "accelerometer", "gyroscope", "gps")),
    ]
    assert all(path.read_bytes().startswith(b"\x89PNG") for _, path in figures)
    assert len(page(outcome, tmp_path, figures).sources) == len(figures)


def test_what_was_found_reads_as_a_formula_with_values_and_units(tmp_path):
    text = page(explained(), tmp_path).text
    assert "V is relative to a wind of 1.091 m/s to the north and −0.712 m/s to the east" in text
    assert "1.30 m/s, blowing towards 327°" in text
    assert "(1.210 ± 0.020) mm" in text
    assert "In recording 02 only." in text


def test_confusions_come_with_what_to_record_next(tmp_path):
    text = page(explained(), tmp_path).text
    assert "cannot tell it from" in text
    assert text.count("A rate-table run with the sensor at another radius") == 2
    assert "A throw at 20 m/s with half the spin" in text


def test_a_setting_stands_in_words_and_so_does_its_twin(tmp_path):
    outcome = explained()
    twin = Confusion("gyro.axes", 90.0, "Turn the disc by hand.", setting={"axes": "x y -z"})
    flipped = NamedEffect("mag.axes", {}, Evidence(900.0, None, 0.0), confused_with=(twin,), setting={"axes": "x -y z"})
    text = page(replace(outcome, diagnosis=replace(outcome.diagnosis, effects=(flipped,))), tmp_path).text
    assert "columns x, y, z hold x −y z of the body" in text
    assert "a gyroscope whose axes are mixed up (axes = x y -z)" in text


def test_a_fault_of_the_setup_comes_with_the_line_that_mends_it_unless_it_may_be_another(tmp_path):
    """ "Times that are shifted (3.000 s)" told neither which way nor where to write what."""
    outcome = explained()
    late = NamedEffect("mag.time_offset", {"offset_s": ParameterValue(3.00006, 1e-4)}, Evidence(900.0, None, 0.0))
    line = "write into the import map: [sensors.magnetometer] time_offset_s = -3 (or add that to what stands there)"
    told = replace(outcome, diagnosis=replace(outcome.diagnosis, effects=(late,)))
    assert f"To mend it, {line}" in page(told, tmp_path).text
    (said,) = Diagnosed(told, {"throws": 2}).remedies
    assert said.startswith(f"times of the magnetometer that are shifted: to mend it, {line}")
    doubtful = replace(late, confused_with=(Confusion("mag.lag", 90.0, "Turn the disc by hand."),))
    unsure = replace(outcome, diagnosis=replace(outcome.diagnosis, effects=(doubtful,)))
    assert "To mend it" not in page(unsure, tmp_path).text
    assert Diagnosed(unsure, {"throws": 2}).remedies == ()
    assert Diagnosed(outcome, {"throws": 2}).remedies == ()


def test_a_law_stands_with_its_coefficients(tmp_path):
    text = page(unexplained(), tmp_path).text
    assert "moment about the spin axis, N m" in text
    assert "(−3.120 ± 0.040) × 10⁻⁶" in text
    assert "c · |r|n · sign(r)" in text
    assert "c · |r|<sup>n</sup> · sign(r)" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize(
    ("text", "html"),
    [
        ("-c r V^2", "−c r V<sup>2</sup>"),
        ("c |alpha|^(-n) + b*p_H**3", "c |α|<sup>−n</sup> + b · p<sub>H</sub><sup>3</sup>"),
    ],
)
def test_a_law_reads_as_a_formula(text, html):
    assert law_text(text) == html


def test_names_from_files_cannot_become_markup(tmp_path):
    outcome = explained()
    strange = replace(
        outcome.diagnosis.effects[0],
        id="my.<b>effect</b>",
        parameters={"<i>x</i>": ParameterValue(1.0, 0.1)},
        confused_with=(Confusion("<script>", 1.0),),
    )
    diagnosis = replace(outcome.diagnosis, datasets=("<script>alert(1)</script>",), effects=(strange,))
    page(replace(outcome, diagnosis=diagnosis), tmp_path)
    html = (tmp_path / "report.html").read_text()
    assert html.count("<script>") == 1  # the page's own
    assert "<script>alert" not in html
    assert "<b>effect" not in html
    assert "<i>x" not in html


def test_an_answer_without_residuals_or_held_out_recordings_has_a_page_too(tmp_path):
    outcome = explained()
    diagnosis = replace(outcome.diagnosis, heldout=(), located=(), outliers=(), noise=(), recalibrated={})
    bare = replace(outcome, diagnosis=diagnosis, residuals=(), candidates=())
    assert draw_figures(bare, tmp_path) == []
    assert "The baseline leaves out" in page(bare, tmp_path).text


def test_a_located_instant_is_marked_on_its_sensor_alone():
    outcome = explained()
    residuals = [item for item in outcome.residuals if item.recording in ("01", "02")]
    marks = {}
    for sensor in ("accelerometer", "gyroscope"):
        axes = draw_sensor(sensor, residuals, outcome.diagnosis.located).axes[0]
        spans = [patch.get_extents().transformed(axes.transData.inverted()) for patch in axes.patches]
        marks[sensor] = [span for span in spans if 0.0 < span.x0 and span.x1 < 3.0]
    assert marks["gyroscope"] == []
    assert marks["accelerometer"]
    for span in marks["accelerometer"]:
        assert (span.x0, span.x1) == pytest.approx((1.37, 1.43), abs=1e-6)


def test_a_short_fault_in_a_long_recording_stays_in_the_figure():
    t = np.arange(200_000) / 100.0
    before = np.zeros(t.size)
    before[123_457] = 40.0
    figure = draw_sensor("magnetometer", [Residuals("01", "magnetometer", "x_uT", t, before, 0 * t)], ())
    drawn = np.concatenate([line.get_ydata() for line in figure.axes[0].lines])
    assert drawn.max() == 40.0
    assert drawn.size < 10_000


@pytest.mark.parametrize("id", CATALOGUE)
def test_every_effect_has_a_name_and_a_formula_with_each_of_its_parameters(id):
    row = CATALOGUE[id]
    assert set(re.findall(r"\{(\w+)\}", CATALOGUE[id].form)) == {*row.parameters, *row.settings}
    assert "{" not in form(id)
    values = {name: ParameterValue(1.2345e-3 * (k + 1), 1e-5) for k, name in enumerate(row.parameters)}
    for k, name in enumerate(row.parameters):
        assert f"{1.2345e-3 * (k + 1):.6f}" in found(id, values)
        assert isinstance(everyday(id, name, values[name]), str)
    for name in row.settings:
        assert "<b>as it is</b>" in found(id, values, {name: "as it is"})


def test_units_are_those_in_the_names():
    for id, row in CATALOGUE.items():
        for name in row.parameters:
            bare = name.split("_")[0] == name or name in ("fraction", "exponent", "ratio")
            assert bool(unit(id, name)) != (bare and id != "gyro.g_sensitivity"), (id, name)


@pytest.mark.parametrize(
    ("value", "sd", "text"),
    [
        (1.0912, 0.0213, "1.091 ± 0.021"),
        (-0.00450123, 0.0000213, "−0.004501 ± 0.000021"),
        (1234.5, 12.0, "1234 ± 12"),
        (3.12e-6, 2e-8, "(3.120 ± 0.020) × 10⁻⁶"),
        (0.0, 0.0, "0 ± 0"),
        (0.02, 3.0, "0.0 ± 3.0"),
        (2.5e-7, None, "2.5 × 10⁻⁷ (not determined)"),
    ],
)
def test_a_value_has_the_digits_that_its_standard_deviation_leaves(value, sd, text):
    assert plus_minus(value, sd) == text


def test_plain_noise_is_pale_in_the_overview_however_few_its_readings_and_a_mismatch_is_not():
    rng = np.random.default_rng(2)
    residuals = []
    for k, n in enumerate((20, 50, 200, 1000)):
        t, noise = np.arange(float(n)), rng.standard_normal(n)
        residuals.append(Residuals(f"{k:02d}", "gps", "north_m", t, noise, noise))
    residuals.append(Residuals("99", "gps", "north_m", t, 3.0 * noise, noise))
    (before, after) = (axes.images[0].get_array().ravel() for axes in draw_overview(residuals).axes)
    assert before.tolist()[:4] == [1.0] * 4
    assert before[4] == pytest.approx(3.0, rel=0.1)  # the rms of a thousand readings scatters by 2 %
    assert after.tolist() == [1.0] * 5
