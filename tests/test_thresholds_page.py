"""The page on what chance reaches shows the limits of the code and the rates of the sets that were measured."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def thresholds():
    path = ROOT / "benchmarks" / "thresholds.py"
    spec = importlib.util.spec_from_file_location("measured_thresholds", path)
    module = importlib.util.module_from_spec(spec)
    known = sys.modules.setdefault(spec.name, module)  # where dataclasses look for their annotations
    spec.loader.exec_module(known)
    return known


def test_the_page_has_the_rates_of_the_table_of_sets_against_the_limits_of_the_code(thresholds):
    rows = thresholds.known_rows(ROOT / "docs" / "thresholds" / "sets.csv")
    assert len({row["plant"] for row in rows}) == 4
    page = (ROOT / "docs" / "thresholds.md").read_text(encoding="utf-8")
    first, last = thresholds.MARKS
    shown = page.partition(first)[2].partition(last)[0].strip()
    assert shown == thresholds.rates_table(rows), "run `python benchmarks/thresholds.py --out docs/thresholds --write`"


def test_the_tail_of_an_exponential_is_continued_to_its_own_rate(thresholds):
    """Of 4000 draws with the scale 2 the limit 20 is passed once in e^10 = 22026."""
    reached = np.random.default_rng(5).exponential(2.0, 4000)
    over, bound, tail = thresholds.excess(reached, 20.0)
    assert over == np.sum(reached > 20.0)
    assert 0.0 < bound < 0.01
    # from 4.6 on by the scale of 400 excesses, known to 5 %: three standard deviations of 0.05 (20 - 4.6) / 2
    assert np.log(tail) == pytest.approx(-10.0, abs=3.0 * 0.05 * (20.0 - 4.6) / 2.0)


def test_a_line_that_was_cut_off_is_measured_again(thresholds, tmp_path):
    path = tmp_path / "sets.csv"
    whole = ",".join(thresholds.COLUMNS) + "\n" + ",".join("1" for _ in thresholds.COLUMNS) + "\n"
    path.write_text(whole + "2,fli", encoding="utf-8")
    assert [row["set"] for row in thresholds.known_rows(path)] == ["1"]
