"""Reports of commands, from results made up here: the answer comes first, and a browser shows all of it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from support.browser import browse, needs_browser

import discsim
from discsim.estimators.rate import YawRate
from discsim.validation.estimating.page import write_estimate_page
from discsim.validation.estimating.scored import score_rates
from discsim.validation.estimating.spin_estimates import draw_estimates
from discsim.validation.reporting.figures import new_figure, save_figure
from discsim.validation.reporting.html import Section, write_report
from discsim.validation.reporting.scores import at_most, score
from discsim.validation.scenarios.rate_table import Plateau
from discsim.validation.scenarios.table_page import write_table_page
from discsim.validation.scenarios.table_scores import Band, MethodScore, TableScores
from discsim.validation.sweeps.cases import Row
from discsim.validation.sweeps.page import write_sweep_page

NAN = float("nan")


def lead_of(page: Path) -> str:
    """Return the look and the text of the banner, which stands right below the title."""
    found = re.search(r'</h1>\s*<p class="lead (\w+)">(.*?)</p>', page.read_text(encoding="utf-8"), re.S)
    assert found
    return f"{found[1]}: {re.sub('<[^>]+>', '', found[2])}"


def rate(method: str, value: float, sd: float, signed: bool = True) -> YawRate:
    t = np.linspace(0.0, 2.0, 20)
    return YawRate(method, t, np.full(20, np.radians(value)), np.full(20, np.radians(sd)), signed)


def estimated(folder: Path, rates: list[YawRate], contradictions: list[str]) -> Path:
    t = np.arange(0.0, 2.0, 0.01)
    made = discsim.recording_from_arrays({"magnetometer": (t, np.ones((200, 3)))}, name="made")
    draw_estimates(rates, "made", folder / "rate.png")
    return write_estimate_page(folder, made, rates, {"gyroscope": "no gyroscope"}, contradictions, [])


def turned(folder: Path, good: bool = True) -> Path:
    methods = (
        MethodScore("fft", 0.84, 0.01, 0.1, 0.5, 0.007, 0.001),
        MethodScore("gyroscope", 0.3, 0.0, 0.01, 0.02, NAN, NAN),
        MethodScore("accelerometer", 1.0, 0.4, 0.7, 2.0, NAN, NAN),
    )
    bands = (Band("fft", 0.0, np.radians(250.0), 12, 0.0, NAN, NAN, NAN),)
    figure, axes = new_figure(width=5.0, height=3.0)
    axes.plot([0.0, 1.0], [1.0, 2.0], label="fft")
    save_figure(figure, folder / "methods.png")
    checks = [at_most("rate table: bias", 0.1 if good else 9.0, "deg/s", 0.2), score("rate table: share", 1, "1", 1, 0)]
    plateaus = [Plateau("fft", 10.0, 1.0, 0.1, 0.1, 0.3)]
    return write_table_page(folder, TableScores(methods, bands), plateaus, checks)


def test_an_estimate_says_the_rate_first_and_what_contradicts_it(tmp_path):
    rates = [rate("fusion", 3600.0, 0.25), rate("accelerometer", 3500.0, 160.0, signed=False)]
    said = lead_of(estimated(tmp_path, rates, []))
    assert said.startswith("good: Spin rate 3,600.0 deg/s in the middle (10.00 turns a second, 600 rpm)")
    assert "standard deviation 0.25 deg/s, by fusion; known for 100 % of the time." in said
    assert lead_of(estimated(tmp_path, rates, ["they differ"])).startswith("heed: ")
    assert "They differ." in (tmp_path / "report.html").read_text()
    unknown = [rate("fft", NAN, NAN)]
    assert lead_of(estimated(tmp_path, unknown, [])) == "bad: No spin rate: fft could tell one anywhere."


@pytest.mark.parametrize(("good", "tone", "kept"), [(True, "good", 2), (False, "bad", 1)])
def test_a_rate_table_names_the_method_that_errs_least_of_those_that_know_the_rate(tmp_path, good, tone, kept):
    said = lead_of(turned(tmp_path, good))
    assert said.startswith(f"{tone}: fft errs least: 5.73 deg/s rms where it knows the rate, 84 % of the run.")
    assert f"{kept} of 2 checks" in said
    page = (tmp_path / "report.html").read_text()
    assert "&lt;= 0.2 deg/s" in page
    assert '<td class="number">1</td><td>&gt;= 1</td>' in page  # no unit where there is none


def test_a_measured_run_says_first_how_it_differs_from_its_emulation(tmp_path):
    turned(tmp_path)
    save_figure(new_figure()[0], tmp_path / "comparison.png")
    scores = TableScores((MethodScore("fft", 1.0, 0.0, 0.1, 0.2, NAN, NAN),), ())
    said = lead_of(write_table_page(tmp_path, scores, compared=["note: no clock", "It errs otherwise."]))
    assert said.endswith("of the run. It errs otherwise.")


def test_a_sweep_names_the_estimator_that_errs_least_and_lists_cases(tmp_path):
    save_figure(new_figure()[0], tmp_path / "sweep.png")
    errors = [
        ("fft", "64", "100 %", "1.4", "7.7"),
        ("best", "4", "100 %", "0.2", "0.7"),
        ("gyroscope", "4", "0 %", "", ""),
    ]
    rows = [Row({"radius_m": 0.0161, "parts": "mpu9250"}, "fft", 500.0, 64, 1.0, 0.1, 0.2, NAN)] * 300
    said = lead_of(write_sweep_page(tmp_path, "made", "64 of mount", errors, rows))
    assert said == (
        "plain: best errs least: 95 % of its rms errors are below 0.7 deg/s, half below 0.2. "
        "The same limit of the others: fft 7.7 deg/s."
    )
    page = (tmp_path / "report.html").read_text()
    assert "100 more are in cases.csv." in page
    assert ">16.1 mm, mpu9250<" in page


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({}, "plain: late errs least: 1 deg/s rms, 1 deg/s at worst, 100 % known. No limit was asked for."),
        ({"rms": 30.0}, "good: All limits are kept. late errs least: 1 deg/s rms"),
        ({"rms": 2.0, "known": 0.9}, "bad: 1 of 4 limits are exceeded: early: rms. late errs least: 1 deg/s rms"),
    ],
)
def test_a_score_says_first_which_limits_are_exceeded(tmp_path, limits, said):
    rates = [rate("early", 3580.0, 0.25), rate("late", 3601.0, 0.25)]
    score_rates(rates, rate("truth", 3600.0, 0.0), limits).report(tmp_path)
    assert lead_of(tmp_path / "report.html").startswith(said)


def test_a_score_of_a_rate_that_is_known_nowhere_is_no_good_one(tmp_path):
    score_rates([rate("fft", NAN, NAN)], rate("truth", 3600.0, 0.0)).report(tmp_path)
    assert lead_of(tmp_path / "report.html") == "bad: No rate is known anywhere."


def test_the_head_of_a_column_of_numbers_stands_where_they_do(tmp_path):
    rows = [("a", "2", "0.1 m", ""), ("b", "–", "3", "7 %")]
    write_report(tmp_path / "report.html", "A page", "All.", [Section("", (), ("name", "n", "size", "share"), rows)])
    heads = re.findall(r"<th( class=\"number\")?>(\w+)</th>", (tmp_path / "report.html").read_text())
    assert [name for right, name in heads if right] == ["n", "share"]


@needs_browser
def test_a_click_on_a_head_puts_values_with_units_in_order_and_blanks_last(tmp_path):
    page = tmp_path / "report.html"
    rows = [(text,) for text in ("31.27 deg/s", "–", "4.7 to 9.1", "<= 1.5 m", "1,200", "throw 10", "throw 9")]
    write_report(page, "A page", "All.", [Section("Numbers", (), ("value",), rows)])
    probe = """
<script>
const values = () => [...document.querySelectorAll("td")].map(cell => cell.textContent).join("|");
document.querySelector("th").click();
document.body.dataset.up = values();
document.querySelector("th").click();
document.body.dataset.down = values();
</script></body>"""
    page.write_text(page.read_text().replace("</body>", probe))
    done = browse(page, "--dump-dom")
    up = ["&lt;= 1.5 m", "4.7 to 9.1", "31.27 deg/s", "1,200", "throw 9", "throw 10"]
    assert f'data-up="{"|".join([*up, "–"])}"' in done.stdout
    assert f'data-down="{"|".join([*reversed(up), "–"])}"' in done.stdout


@needs_browser
def test_a_browser_shows_a_rate_table_run_with_its_figure_and_terms(tmp_path):
    page = turned(tmp_path)
    probe = """
<script>
const wide = document.documentElement.scrollWidth <= innerWidth;
const lost = [...document.querySelectorAll("a.term")].filter(a => !document.querySelector(a.getAttribute("href")));
document.body.dataset.drawn = [...document.images].every(image => image.naturalWidth > 0 && image.dataset.curves > 0);
document.body.dataset.fits = wide;
document.body.dataset.terms = `${document.querySelectorAll("a.term").length > 0} ${lost.length}`;
</script></body>"""
    page.write_text(page.read_text().replace("</body>", probe))
    done = browse(page, "--dump-dom", "--window-size=480,900")
    for said in ('data-ready="yes"', 'data-drawn="true"', 'data-fits="true"', 'data-terms="true 0"'):
        assert said in done.stdout
    assert not [line for line in done.stderr.splitlines() if "CONSOLE" in line]
