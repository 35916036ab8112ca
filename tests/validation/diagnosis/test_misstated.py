"""A number that is stated as exact and is wrong: it moves in no answer, and the reader is told what it would be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import DRIVER, coasts, throws

from discsim.effects import effect
from discsim.recording import Recording
from discsim.shipped import load_disc
from discsim.validation.diagnosis.answer.misstated import Misstated, in_short, sentence
from discsim.validation.diagnosis.misstated import misstated, reconciling
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.report.page import verdict_sentence
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.verdict import leaves_more_than_noise
from discsim.validation.identification.stated_parameters import exact_numbers


def with_disc(recordings: list[Recording], **stated: float) -> list[Recording]:
    """Recordings of the driver that state other numbers of it."""
    return [replace(one, disc=replace(one.disc or DRIVER, **stated)) for one in recordings]


def explains(found: Search) -> bool:
    """Tell whether a search's final fit leaves nothing but noise."""
    return not leaves_more_than_noise(found)


def test_of_a_disc_s_numbers_the_mass_alone_is_told_that_is_off():
    found = screened(SearchProblem(with_disc(throws(), mass=0.92 * DRIVER.mass)))
    ((number,),) = misstated(found, explains)
    assert (number.name, number.stated) == ("mass_kg", pytest.approx(0.92 * DRIVER.mass))
    assert abs(number.value - DRIVER.mass) < 4.0 * number.sd
    assert number.sd < 0.01 * DRIVER.mass
    assert misstated(found, lambda other: False) == ()


@pytest.mark.parametrize("place", ["Ixx", pytest.param("Izz", marks=pytest.mark.slow)])
def test_an_inertia_by_which_the_gyroscope_contradicts_all_others_is_told(place):
    size = getattr(DRIVER, place)
    odd = with_disc(throws(), **{place: 0.92 * size if place == "Izz" else 1.1 * size})
    (number,) = reconciling(SearchProblem(odd), explains)
    assert number.name == f"{place}_kg_m2"
    assert abs(number.value - size) < 4.0 * number.sd


@pytest.mark.slow  # as the two before it, with what a whole diagnosis makes of them
@pytest.mark.parametrize("wrong", [{"mass": 0.92 * DRIVER.mass}, {"Ixx": 1.1 * DRIVER.Ixx}])
def test_the_answer_says_it_first_and_offers_no_law(wrong):
    found = diagnose([with_disc(throws(), **wrong)], ["light"]).diagnosis
    ((number,),) = found.misstated
    assert (found.law, found.recalibrated) == (None, {})
    assert found.warnings[0] == sentence([number], instead=found.verdict == "explained")
    assert found.to_json()["misstated"] == [[number.to_json()]]
    if found.verdict == "unexplained":
        assert verdict_sentence(found).startswith(f"A stated number may be wrong: {number.name}")


def test_where_effects_explain_it_for_less_no_number_is_told():
    found = diagnose([throws([effect("air.wind", w_north_m_s=1.0, w_east_m_s=-0.6)])], ["windy"]).diagnosis
    assert [one.id for one in found.effects] == ["air.wind"]
    assert found.misstated == ()


def test_a_number_is_exact_that_has_no_sigma_and_is_the_same_in_all():
    made = throws()
    assert set(exact_numbers(made)) == {("disc", "mass"), ("disc", "d"), ("disc", "Ixx"), ("disc", "Izz")}
    loose = [replace(one, disc=replace(DRIVER, sigma={"mass_kg": 1e-3, "diameter_m": 1e-3})) for one in made]
    assert set(exact_numbers(loose)) == {("disc", "Ixx"), ("disc", "Izz")}
    assert exact_numbers([made[0], *with_disc(made[1:], mass=0.17)]) == {}
    assert set(exact_numbers(coasts())) == {("rig", "viscous")}
    # a measured table of the air is an array, which no two discs are compared by
    tabled = [replace(one, disc=replace(DRIVER, aero_table=load_disc("dd2")[0].aero_table)) for one in made]
    assert set(exact_numbers(tabled)) == set(exact_numbers(made))


def test_numbers_are_told_to_the_digit_that_their_error_leaves():
    mass, inertia = Misstated("mass_kg", 0.165, 0.179072, 3.2e-5), Misstated("Ixx_kg_m2", 6.6e-4, 5.9987e-4, 4e-5)
    assert (
        in_short([mass, inertia]) == "mass_kg 0.1791 in the place of 0.165 and Ixx_kg_m2 0.0006 in the place of 0.00066"
    )
    assert sentence([mass], instead=True) == (
        "mass_kg is stated as 0.165, without a sigma. Were it 0.1791 ± 3.2e-05, nothing but noise would be left "
        "without any effect: measure it again, with the board on, or state a sigma."
    )
    assert "are stated as" in sentence([mass, inertia], instead=False)
    assert np.isfinite(mass.to_json()["sd"])


def test_a_number_whose_error_is_not_known_is_none():
    with pytest.raises(ValueError, match="what mass_kg would be: sd is nan"):
        Misstated("mass_kg", 0.165, 0.179, float("nan"))
