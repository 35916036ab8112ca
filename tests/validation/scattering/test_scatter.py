"""Where throws land: draws, ellipses, percentiles and shares against what is known in closed form."""

from __future__ import annotations

import csv
import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from discsim.errors import InputError
from discsim.launch import launch_of
from discsim.shipped import load_disc, load_throw
from discsim.validation.cli import main
from discsim.validation.scattering import landings, scattered
from discsim.validation.scattering.fitted import read_fitted
from discsim.validation.scattering.inputs import Fitted, Input, Inputs, inputs_of
from discsim.validation.scattering.scattered import scatter
from discsim.validation.scattering.sensitivities import sensitivities

DISC, FIELD = load_disc("driver")
THROW = load_throw("driver")


def normal_inputs(covariance: np.ndarray) -> Inputs:
    items = tuple(
        Input(name, "", 0.0, float(np.sqrt(covariance[k, k])), "given", 1.0, k)
        for k, name in zip(range(len(covariance)), "abc", strict=False)
    )
    return Inputs(items, covariance, THROW, np.zeros(3))


def test_the_shares_of_a_polynomial_are_its_sobol_indices():
    """Of 2 a + b^2 + 3 a b with standard normal a and b the variance is 4 + 2 + 9."""
    inputs = normal_inputs(np.eye(2))
    rows = np.random.default_rng(0).standard_normal((20_000, 2))
    a, b = rows.T
    found = sensitivities(inputs, rows, 2 * a + b**2 + 3 * a * b, "y")
    share = {item.inputs[0]: item for item in found.shares}
    assert share["a"].first == pytest.approx(4 / 15, abs=0.01)
    assert share["a"].total == pytest.approx(13 / 15, abs=0.01)
    assert share["b"].first == pytest.approx(2 / 15, abs=0.01)
    assert share["b"].total == pytest.approx(11 / 15, abs=0.01)
    assert share["a"].slopes[0] == pytest.approx(2.0, abs=0.05)
    assert found.unexplained < 1e-12


def test_inputs_that_vary_together_have_one_share_and_slopes_of_their_own():
    covariance = np.array([[4.0, -1.9, 0.0], [-1.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    inputs = normal_inputs(covariance)
    rows = np.random.default_rng(1).multivariate_normal(np.zeros(3), covariance, 20_000)
    noise = np.random.default_rng(2).standard_normal(20_000)
    found = sensitivities(inputs, rows, rows @ [1.0, 2.0, 0.5] + noise, "y")
    together = next(share for share in found.shares if share.inputs == ("a", "b"))
    whole = 4.0 + 4.0 - 4 * 1.9 + 0.25 + 1.0
    assert together.total == pytest.approx(0.4 / whole, abs=0.01)
    assert together.slopes == pytest.approx((1.0, 2.0), abs=0.1)  # the error of a is 0.03, of b 0.06
    assert found.unexplained == pytest.approx(1.0 / whole, abs=0.02)


def test_few_flights_are_asked_for_a_linear_answer_only():
    rows = np.random.default_rng(0).standard_normal((50, 2))
    assert sensitivities(normal_inputs(np.eye(2)), rows, rows[:, 0], "y").order == 1


def test_ellipses_hold_their_share_and_those_of_normal_landings_have_the_normal_size():
    points = np.random.default_rng(0).multivariate_normal([80.0, 3.0], [[9.0, 4.0], [4.0, 4.0]], 20_000)
    for ellipse in scattered.ellipses_of(points):
        turn = np.radians(ellipse.direction_deg)
        away = points - [ellipse.north, ellipse.east]
        long = away @ [np.cos(turn), np.sin(turn)] / ellipse.semi_axes[0]
        short = away @ [-np.sin(turn), np.cos(turn)] / ellipse.semi_axes[1]
        assert np.mean(long**2 + short**2 <= 1.0) == pytest.approx(ellipse.share, abs=1e-4)
        assert ellipse.normal == pytest.approx(1.0, abs=0.02)  # 20 000 draws: 1 % and less


def test_the_interval_of_a_percentile_holds_it_in_95_of_100_samples():
    rng = np.random.default_rng(3)
    held = 0
    for _ in range(400):
        found = scattered.percentiles_of("x", "m", 0.0, rng.standard_normal(300))
        low, high = found.intervals[2]
        held += low <= 0.0 <= high
    assert held / 400 > 0.92  # binomial: 0.95 -+ 0.011, and the interval is conservative


def test_a_heading_that_scatters_moves_the_landing_by_the_distance_times_the_angle():
    found = scatter(DISC, THROW, environment=FIELD, flights=400, sd={"heading": 0.5})
    distance = found.percentiles[0]
    aside = found.percentiles[2]
    assert distance.sd < 1e-3  # north turned, it is the same flight
    assert aside.sd == pytest.approx(distance.nominal * np.radians(0.5), rel=0.1)  # 400 draws: 3.5 %
    assert found.shares[1].shares[0].slopes[0] == pytest.approx(distance.nominal * np.radians(1.0), rel=1e-3)


def test_flights_depend_on_the_seed_and_not_on_the_chunks_before_them(monkeypatch):
    monkeypatch.setattr(landings, "CHUNK", 60)
    found = scatter(DISC, THROW, environment=FIELD, flights=120, sd={"speed": 0.5}, seed=4)
    again = scatter(DISC, THROW, environment=FIELD, flights=150, sd={"speed": 0.5}, seed=4)
    np.testing.assert_array_equal(found.flown.ends[:60], again.flown.ends[:60])
    assert not np.array_equal(found.flown.inputs[:60], found.flown.inputs[60:])


def test_a_sigma_of_the_release_becomes_that_of_the_words_to_first_order():
    """0.3 m/s across the flight turn the heading by 0.3 over the level speed, and the plane stays where it is."""
    throw = replace(THROW, sigma={"velocity_ned_m_s": np.array([0.0, 0.3, 0.0])})
    inputs = inputs_of(DISC, FIELD, throw)
    assert inputs.groups() == [[0, 1, 2]]  # one number moves them all
    heading = inputs.items[0]
    assert inputs.names == ("heading", "hyzer", "nose")
    assert heading.sd == pytest.approx(np.degrees(0.3 / THROW.velocity[0]), rel=1e-6)
    along = inputs_of(DISC, FIELD, replace(THROW, sigma={"velocity_ned_m_s": np.array([0.3, 0.0, 0.0])}))
    assert {"speed", "launch", "nose"} == set(along.names)


def test_a_fit_brings_its_values_and_its_covariance():
    covariance = np.array([[1e-8, -0.9e-7], [-0.9e-7, 1e-6]])
    fitted = Fitted(("CNr", "CD0"), np.array([-0.005, 0.061]), covariance, "cnr.json")
    inputs = inputs_of(DISC, FIELD, THROW, fitted=fitted)
    drawn = inputs.draw(20_000, np.random.default_rng(0))
    np.testing.assert_allclose(np.cov(drawn.inputs.T), covariance[::-1, ::-1], rtol=0.05)  # 20 000 draws: 1 %
    places = [item.place for item in inputs.items]
    np.testing.assert_array_equal(drawn.parameters[:, places], drawn.inputs)
    asked = inputs_of(DISC, FIELD, THROW, fitted=fitted, sd={"CNr": 0.0})
    assert asked.names == ("CD0",)


def test_draws_that_are_no_disc_are_drawn_again_and_counted():
    drawn = inputs_of(DISC, FIELD, THROW, sd={"height": 1.3}).draw(1000, np.random.default_rng(0))
    assert np.all(drawn.states[:, 2] < 0.0)
    assert 100 < drawn.refused < 300  # one draw of six is below the ground


@pytest.mark.parametrize(
    ("sd", "said"),
    [
        ({}, "nothing is uncertain"),
        ({"sped": 1.0}, "--sd sped: unknown"),
        ({"speed": -1.0}, "zero or more"),
        ({"mass": 2.0}, r"--sd mass=2 is 1. times the 0.\d+ kg that it is about; expected a standard deviation in kg"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(sd, said):
    with pytest.raises(InputError, match=said):
        scatter(DISC, THROW, flights=100, sd=sd)


def test_the_command_writes_every_flight_the_ellipses_and_a_page(tmp_path, monkeypatch):
    fit = tmp_path / "cnr.json"
    told = {"names": ["CNr"], "matrix": [[1e-8]]}
    fit.write_text(json.dumps({"CNr": {"value": -0.0045, "sd": 1e-4}, "refined": {}, "covariance": told}))
    assert read_fitted(tmp_path).covariance == pytest.approx(1e-8)
    out = tmp_path / "out"
    words = ["scatter", "--flights", "150", "--sd", "speed=0.5,hyzer=2", "--fit", str(fit), "--out", str(out)]
    monkeypatch.setattr(sys, "argv", ["discsim", *words])
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code
    told = json.loads((out / "scatter.json").read_text())
    assert [ellipse["share"] for ellipse in told["ellipses"]] == [0.5, 0.9, 0.95]
    assert {item["name"] for item in told["inputs"]} == {"speed", "hyzer", "CNr"}
    rows = list(csv.DictReader((out / "landings.csv").read_text().splitlines()))
    assert len(rows) == 150
    assert {"north_m", "east_m", "speed_m_s", "hyzer_deg"} <= set(rows[0])
    page = (out / "report.html").read_text()
    assert "Where it lands" in page
    assert page.count("--flights 150") == 1  # the command stands in the footer alone


def test_a_file_that_is_no_fit_is_refused_by_name(tmp_path):
    path = tmp_path / "cnr.json"
    path.write_text('{"CNr": 3}')
    with pytest.raises(InputError, match=r"holds no fit; expected the cnr\.json that discsim fit wrote"):
        read_fitted(path)


def test_the_words_of_a_throw_are_what_is_drawn():
    inputs = inputs_of(DISC, FIELD, THROW, sd={"spin": 50.0, "nose": 1.0})
    words = launch_of(inputs.release)
    assert {item.name: item.mean for item in inputs.items} == pytest.approx(
        {"nose": np.degrees(words.nose), "spin": words.spin * 30 / np.pi}
    )
