"""Reports in a real browser: figures tell their values, tables sort, nothing is fetched, no error is logged."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from support.browser import browse, needs_browser

from discsim.validation.reporting.drawn_values import drawn_values
from discsim.validation.reporting.figures import new_figure, save_figure
from discsim.validation.reporting.html import Section, write_report


def made(folder: Path) -> Path:
    figure, axes = new_figure(width=6.0, height=3.0)
    axes.semilogy([1.0, 2.0, 3.0], [1.0, 10.0, 100.0], label="rise & <fall>")
    axes.barh([20.0], [2.0], height=5.0, label="bar")
    axes.set_xlabel("time (s)")
    save_figure(figure, folder / "figure.png")
    rows = [("b", "2"), ("a", "10"), ("c", "-1")]
    section = Section("Numbers", ("Some.",), ("name", "value"), rows, [("A figure", folder / "figure.png")])
    write_report(folder / "report.html", "A page", "All is well.", [section])
    return folder / "report.html"


def test_a_figure_keeps_where_its_points_are_and_what_they_are_worth(tmp_path):
    figure, axes = new_figure(width=6.0, height=3.0)
    axes.plot([0.0, 1.0], [5.0, np.nan], "o")
    axes.plot([0.0, 1.0], [5.0, 6.0], label="line")
    axes.axhline(5.5)
    told = drawn_values(figure)
    assert told.isascii()
    assert '"name":"line"' in told
    assert re.findall(r'"(\d+)","([\d.]+)"\]', told) == [("0", "5"), ("0", "5"), ("1", "6")]
    empty, _ = new_figure()
    assert drawn_values(empty) == ""


def test_a_page_holds_all_it_shows(tmp_path):
    text = made(tmp_path).read_text()
    assert not re.findall(r'(?:src|href)="(?!data:|#)', text)
    assert "@media print" in text
    assert "prefers-color-scheme: dark" in text


@needs_browser
def test_a_browser_draws_the_page_finds_the_values_and_complains_of_nothing(tmp_path):
    page = made(tmp_path)
    probe = """
<script>
const [name, value] = document.querySelectorAll("th");
value.click();
document.body.dataset.sorted = [...document.querySelectorAll("tr td:nth-child(2)")].map(c => c.textContent).join(" ");
const image = document.querySelector("figure img"), box = image.getBoundingClientRect();
let told = "";
for (let x = 0; x < 1 && !told; x += 0.01) for (let y = 0; y < 1 && !told; y += 0.02) {
  image.dispatchEvent(new PointerEvent("pointermove",
    { clientX: box.left + x * box.width, clientY: box.top + y * box.height }));
  const tip = document.querySelector(".tip");
  if (!tip.hidden) told = tip.textContent;
}
document.body.dataset.told = told;
document.body.dataset.width = image.naturalWidth;
</script></body>"""
    page.write_text(page.read_text().replace("</body>", probe))
    done = browse(page, "--dump-dom")
    assert 'data-ready="yes"' in done.stdout
    assert 'data-sorted="-1 2 10"' in done.stdout
    assert re.search(r'data-told="(rise &amp; &lt;fall&gt;|bar): time \(s\) ', done.stdout)
    assert 'data-width="900"' in done.stdout
    assert not [line for line in done.stderr.splitlines() if "CONSOLE" in line]
