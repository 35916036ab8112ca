"""Stated numbers against what discs have: slopes and angles in degrees are told, and published discs are not."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, radians

import numpy as np
import pytest

from discsim.disc import Aero, AeroTable, Disc
from discsim.environment import Environment
from discsim.files import model_names
from discsim.recording import Recording, Samples
from discsim.sensor_sheet import SensorSheet
from discsim.shipped import load_disc
from discsim.validation.checking.statements import statement_findings, unlikely_flight

DRIVER, THERE = load_disc("driver")
AERO = DRIVER.aero or Aero()
ALPHA = np.radians([-10.0, -5.0, 0.0, 5.0, 10.0, 20.0])
CL = np.array([-0.2, -0.05, 0.13, 0.32, 0.5, 0.85])


def said_of(aero: Aero, table: AeroTable | None = None) -> list[str]:
    return unlikely_flight(replace(DRIVER, aero=aero, aero_table=table), THERE)


def table(alpha: np.ndarray, lift: np.ndarray) -> AeroTable:
    return AeroTable(alpha, lift, 0.06 + 0 * lift, 0 * lift)


def test_slopes_per_degree_are_told_with_the_factor_and_the_slopes_per_radian():
    said = said_of(AERO._replace(CLa=radians(2.1), CDa=radians(radians(1.35)), CMa=radians(0.12)))
    assert said == [
        "[disc.aero]: CLa is 0.0366519, 57.3 times too small for a disc; expected 1.9 to 3.1 per rad; per degree? "
        "write 2.1",
        "[disc.aero]: CDa is 0.000411234, 3283 times too small for a disc; expected 0.7 to 3.3 per rad^2; per degree? "
        "write 1.35",
        "[disc.aero]: CMa is 0.0020944, 57.3 times too small for a disc; expected 0.057 to 0.43 per rad; per degree? "
        "write 0.12",
    ]


def test_a_slope_that_was_turned_into_radians_twice_is_told():
    (said,) = said_of(AERO._replace(CLa=degrees(2.1)))
    assert said.startswith("[disc.aero]: CLa is 120.321, 57.3 times too large for a disc")
    assert said.endswith("multiplied by 180/pi? write 2.1")


def test_a_zero_lift_angle_in_degrees_is_told_in_radians():
    (said,) = said_of(AERO._replace(alpha0=-2.9))
    assert said.endswith("alpha0_rad is -2.9; expected within +-0.3 rad; in degrees? write -0.05061")


def test_a_table_in_degrees_that_could_be_radians_is_told_by_its_slope():
    (said,) = said_of(AERO, table(np.array([-3.0, -1.0, 0.0, 1.0, 3.0]), 0.13 + 0.037 * np.arange(-2.0, 3.0)))
    assert said.startswith("[disc.aero_table]: CL rises by 0.037 per rad about alpha_rad = 0, 57.3 times too little")
    assert said.endswith("is alpha_rad in degrees? Multiply by 0.0174533: -0.05236 to 0.05236")
    assert said_of(AERO, table(ALPHA, CL)) == []


def test_the_slope_beside_a_table_is_told_per_degree():
    assert ["CLa is 0.037" in said for said in said_of(AERO._replace(CLa=0.037), table(ALPHA, CL))] == [True]


#: CLa, CDa, CMa as published: Hummel (2003), Hubbard and Hummel (2000), Potts and Crowther (2002), Yasuda (1999),
#: Stilley and Carstens (1972), Crowther and Potts (2007), and discs tuned to instrumented throws
PUBLISHED = [
    *[
        (1.91, 0.69, 0.43),
        (2.37, 1.24, 0.38),
        (2.96, 2.72, 0.13),
        (2.4, 2.3, 0.0),
        (2.8, 2.5, 0.25),
        (3.09, 3.3, 0.057),
    ],
    *[(2.7, 1.9, 0.13), (2.29, 1.67, 0.343), (2.29, 1.67, 0.3), (2.29, 1.67, 0.35)],
]


@pytest.mark.parametrize(("CLa", "CDa", "CMa"), PUBLISHED)
def test_nothing_is_said_of_published_slopes(CLa: float, CDa: float, CMa: float):
    assert said_of(AERO._replace(CLa=CLa, CDa=CDa, CMa=CMa)) == []


@pytest.mark.parametrize("CMa", [0.0, 0.002, -0.002, -0.1])
def test_nothing_is_said_of_a_disc_that_is_nearly_neutral(CMa: float):
    assert said_of(AERO._replace(CMa=CMa)) == []


@pytest.mark.parametrize("name", model_names("discs"))
def test_nothing_is_said_of_a_shipped_disc(name: str):
    assert unlikely_flight(*load_disc(name)) == []


def test_nothing_is_said_of_slopes_where_none_are_stated():
    body = Disc(0.175, 0.21, 6e-4, 1.15e-3, Aero())
    assert unlikely_flight(body, THERE) == []


@pytest.mark.parametrize("share", [0.7, 0.04, 0.01])
def test_times_of_rows_that_are_a_guess_are_told_beyond_what_parts_are_off_by(share: float):
    """A log without times, taken as 100 rows a second where it had 200: lengths came out with a sd of microns."""
    rows = Samples(np.arange(10) * 0.01, np.zeros((10, 3)))
    sheet = SensorSheet(rate_hz=100.0, sigma={"rate_hz": np.array(100.0 * share)})
    guessed = Recording(
        plant="free_spin",
        name="guessed",
        environment=Environment(magnetic_field=np.array([20.0, 0.0, 40.0])),
        samples={"accelerometer": rows},
        sheets={"accelerometer": sheet},
    )
    said = [finding.sentence for finding in statement_findings(guessed) if finding.id == "sensors.row_spacing"]
    if share <= 0.01:
        assert not said
        return
    off = f"rate_hz is stated to be off by {100 * share:.2g} % (one sd): no column of the log tells the times of rows"
    assert said == [
        f"[sensors]: {off}; expected 1 %, as parts are; spin rates are off by as much, and lengths told from an "
        "acceleration by twice that; where the step is known, write step_s into the map of the import, without "
        "step_sigma_s"
    ]
