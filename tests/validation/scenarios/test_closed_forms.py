"""The checks that need no sensor: a second formulation of the flight notices a slip in the first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discsim.disc import Aero
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict
from discsim.validation.scenarios.closed_forms import PLAIN_TOLERANCE, closed_form_checks
from discsim.validation.scenarios.plain_flight import plain_landing

DISC, AIR = load_disc("driver")
RELEASE = load_throw("driver")


@pytest.fixture(scope="module")
def landing() -> np.ndarray:
    return plain_landing(DISC, replace(AIR, wind=np.array([1.0, -2.0, 0.3])), RELEASE)


def test_the_plain_formulation_lands_where_the_standalone_model_does(landing):
    """Steps of 1e-8 leave 4e-6 m; the wind is there, too."""
    flight = predict(DISC, replace(AIR, wind=np.array([1.0, -2.0, 0.3])), RELEASE)
    np.testing.assert_allclose(landing, [*flight.landing, flight.end], atol=1e-5)


@pytest.mark.parametrize("name", Aero._fields)
def test_a_slip_of_a_hundredth_in_any_coefficient_is_one_against_it(landing, name):
    """But of the two derivatives that only damp the nutation, of which a flight feels tenths: those by a half."""
    share = 1.5 if name in ("CMq", "CRp") else 1.01
    slipped = replace(DISC, aero=DISC.aero._replace(**{name: share * getattr(DISC.aero, name)}))
    flight = predict(slipped, replace(AIR, wind=np.array([1.0, -2.0, 0.3])), RELEASE)
    assert np.linalg.norm(flight.landing - landing[:3]) > PLAIN_TOLERANCE


def test_a_flight_that_does_not_land_is_nan_and_a_table_it_does_not_know_an_error():
    assert np.isnan(plain_landing(DISC, AIR, RELEASE, duration=0.1)).all()
    with pytest.raises(ValueError, match="CR_table"):
        plain_landing(replace(DISC, aero=None), AIR, RELEASE)


@pytest.mark.parametrize("name", ["ultrastar"])
def test_every_check_is_ok_with_another_disc(name):
    """Its CRr is negative, so its bias of (26) has the other sign; its coefficients of lift are a table."""
    scores = closed_form_checks(*load_disc(name))
    assert [item.text for item in scores if not item.ok] == []
    assert len(scores) == 6
