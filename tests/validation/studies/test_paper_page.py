"""The paper side by side: nothing of it is left out, what is named is there, and the page says what is computed."""

from __future__ import annotations

import inspect
import json
import re

import numpy as np
import pytest
from support.places import ROOT

from discsim.shipped import load_disc
from discsim.validation.studies.paper.beside import BLOCKS, FIGURES
from discsim.validation.studies.paper.command import SEED, read_numbers
from discsim.validation.studies.paper.distance import UNKNOWNS
from discsim.validation.studies.paper.equations import EQUATIONS, STEPS, find
from discsim.validation.studies.paper.figures import draw_fig_9
from discsim.validation.studies.paper.modules import compare_modules
from discsim.validation.studies.paper.numbers import compute
from discsim.validation.studies.paper.page import page_text
from discsim.validation.studies.paper.prediction import FLOWN
from discsim.validation.studies.paper.releases import carry
from discsim.validation.studies.paper.spectrum import whole_flight
from discsim.validation.yaw_damping.paper_table import RATES_DEG_S, SPEEDS_M_S

PAGE = ROOT / "docs" / "paper.md"
NUMBERS = read_numbers(PAGE.parent / PAGE.stem)
DISC, AIR = load_disc("driver")

_ITEM = r"(?:PE?-?\d|A[12]|\d{1,2})"
_CITED = re.compile(rf"(?<![\w\]])\(({_ITEM})\)(?:\s*(?:-|to)\s*\(({_ITEM})\))?|Eq\. ({_ITEM})\b")


def cited(name: str) -> set[str]:
    """Return the numbers of equations and steps that a function cites: in its docstring, and where it computes them."""
    thing = find(name)
    found: set[str] = set()
    for first, last, alone in _CITED.findall(inspect.getsource(getattr(thing, "py_func", thing))):
        if not last:
            found.add(first or alone)
            continue
        stem = first.rstrip("0123456789")
        numbers = range(int(first.removeprefix(stem)), int(last.removeprefix(stem)) + 1)
        found |= {f"{stem}{number}" for number in numbers}
    return found


@pytest.mark.parametrize(
    ("listed", "printed"),
    [
        ([row.number for row in EQUATIONS], [*map(str, range(1, 29)), "A1", "A2"]),
        (
            sorted(row.number for row in STEPS),
            sorted(["PE1", "PE2", *(f"P-{k}" for k in range(1, 8))]),
        ),
        ([number for number, *_ in FIGURES], [*map(str, range(1, 14)), "A1", "A2"]),
    ],
    ids=["equations", "steps", "figures"],
)
def test_all_that_the_paper_prints_is_listed_once(listed, printed):
    assert listed == printed


@pytest.mark.parametrize(("number", "name"), [(row.number, name) for row in (*EQUATIONS, *STEPS) for name in row.names])
def test_the_function_is_there_and_cites_its_equation(number, name):
    assert number in cited(name)


@pytest.mark.parametrize("name", [*(name for _, _, names, _ in FIGURES for name in names), *(b for _, b in BLOCKS)])
def test_what_stands_for_a_figure_is_there(name):
    assert callable(find(name))


def test_shapes_and_counts_are_no_citations():
    assert "3" not in cited("discsim.frames.C1")
    assert cited("discsim.flight_equations.derivative") == {"18", "19", "22", "23"}


def test_the_page_is_made_from_its_numbers():
    text = page_text(NUMBERS, PAGE.stem)
    assert PAGE.read_text(encoding="utf-8") == text, "run `discsim study paper --text`"


def same(one, other, where: str) -> list[str]:
    """Return where two contents differ; numbers by more than a hundredth, for the page prints three digits at most."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        return [line for key in one for line in same(one[key], other[key], f"{where}.{key}")]
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return [line for k, pair in enumerate(zip(one, other, strict=True)) for line in same(*pair, f"{where}[{k}]")]
    if isinstance(one, float) and isinstance(other, float):
        return [] if one == pytest.approx(other, rel=0.01, abs=1e-9) else [f"{where}: {one} was {other}"]
    return [] if one == other else [f"{where}: {one} was {other}"]


def test_the_numbers_of_the_page_are_those_of_the_code():
    made = json.loads(json.dumps(compute(SEED)))
    assert same(made, NUMBERS, "numbers") == [], "run `discsim study paper`, and read the page"


class TestFigures:
    def test_the_line_of_a_whole_flight_lies_where_the_disc_turned(self):
        """Fig. 3. A line that slides over 1 Hz in 6 s is resolved to 1/6 Hz: that far it may reach beyond."""
        found = whole_flight(DISC, AIR, np.random.default_rng(1))
        slow, fast = found.true_hz
        assert fast == pytest.approx(10.0)
        assert slow - 1 / 6 < found.dominant_hz[0] < found.frequency[np.argmax(found.amplitude)]
        assert found.dominant_hz[1] < fast + 1 / 6
        assert found.magnetometer.t[-1] > 5.9

    def test_two_modules_are_drawn_as_two_flights(self, tmp_path):
        draw_fig_9(DISC, AIR, NUMBERS["fig_9"], np.random.default_rng(0), tmp_path / "fig-9.png")
        assert (tmp_path / "fig-9.png").stat().st_size > 10_000


class TestWhatThePageSays:
    """Sentences of the page that no number in it stands for."""

    def test_the_flown_release_stays_inside_the_table_and_the_paper_s_own_spins_do_not(self):
        _, flight = carry(DISC, AIR, FLOWN.release)
        state = flight.at(np.linspace(0.0, flight.end, 500))
        speed, rate = np.linalg.norm(state.velocity, axis=1), np.degrees(state.rate[:, 2])
        assert SPEEDS_M_S[0] < speed.min() < speed.max() < SPEEDS_M_S[-1]
        assert RATES_DEG_S[0] < rate.min() < rate.max() < RATES_DEG_S[-1]
        assert RATES_DEG_S[0] > 4200.0

    def test_neither_mass_nor_inertia_makes_the_lighter_module_s_spin_or_distance(self):
        found = compare_modules(DISC, AIR)["ways"]
        for name, one in found.items():
            if "10 %" not in name:
                assert one["spin"] < 1.006
                assert one["distance"] < 1.12

    def test_few_unknowns_make_up_for_the_distance(self):
        found = NUMBERS["distance"]["unknowns"]
        assert set(found) == set(UNKNOWNS)
        can = {name for name, one in found.items() if one["needed"]}
        assert can == {"speed", "heading", "CL0", "CRr"}
        assert found["speed"]["needed"][0] > SPEEDS_M_S[-1]
        assert not {"mass", "CD0", "CDa", "CNr", "spin"} & can

    def test_a_receiver_s_first_fix_costs_more_than_any_source_of_spin(self):
        predicted = NUMBERS["fig_13"]["predicted"]
        by_spin = [one["landing_m"] for label, one in predicted.items() if "GPS" not in label]
        assert NUMBERS["fig_13"]["gps"]["median_m"] > 2 * max(by_spin)
        assert predicted["fft, (28)"]["landing_m"] < predicted["accelerometer, 1 mm, (28)"]["landing_m"]
        assert predicted["accelerometer, 1 mm, (28)"]["landing_m"] < predicted["accelerometer, 5 mm, (28)"]["landing_m"]

    def test_no_disc_moves_by_a_metre_without_its_damping(self):
        assert max(max(pair) for pair in NUMBERS["distance"]["undamped_m"].values()) < 0.9
